"""Studies: what a study file says, what comes out, and that nothing that was finished is lost."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from supremal import FormatError, MissingDependencyError, SupremalError
from supremal.cli.study import study_command
from supremal.studies.reading import read_study
from supremal.studies.study import Study
from supremal.studies.trial import Row, Worlds, learn_cell
from supremal.task.experiment import check, run
from supremal.task.reading import read_task
from supremal.task.summary import summary

EDGES = '[["u", "done", "u", 1.0], ["u", "!done", "u", 0.0]]'
TASK = f"""
[[plant]]
name = "machine"
transitions = '''
    uncontrollable breakdown
    marked idle
    idle -start-> busy
    busy -finish-> idle
    busy -breakdown-> down
    down -repair-> idle
    idle -pause-> idle
'''
[environment]
chances = {{ breakdown = 0.2 }}
labels = {{ done = {{ machine = "idle" }} }}
[[rule]]
pattern = "at_most"
of = "pause"
times = 3
[reward_machine]
edges = {EDGES}
[learner] # small
episodes = 40
episode_steps = 20
"""
GRID = """
task = "task.toml"
seeds = 3
[grid]
learner.alpha = [0.1, 0.5]
"environment.chances.breakdown" = [0.1, 0.4]
"""


def write(folder: Path, study: str = GRID, task: str = TASK) -> Path:
    (folder / "task.toml").write_text(task, encoding="utf-8")
    path = folder / "study.toml"
    path.write_text(study, encoding="utf-8")
    return path


def values(study: Study) -> list[dict[str, Any]]:
    return [setting.values for setting in study.settings]


def rows_of(study: Study) -> dict[tuple[int, int], Row]:
    """Run a study cell by cell, each in a world of its own: the definition."""
    found = {}
    for cell in study.cells:
        row = learn_cell(study, Worlds(study.models.__getitem__), cell)
        assert row is not None
        found[cell] = row
    return found


def timeless(rows: dict[tuple[int, int], Row]) -> dict[tuple[int, int], Row]:
    return {cell: replace(row, seconds=0.0) for cell, row in rows.items()}


# --- the study file ---------------------------------------------------------------------------------------


def test_a_grid_is_all_combinations_the_last_key_fastest(tmp_path: Path) -> None:
    study = read_study(write(tmp_path))
    assert study.seeds == (0, 1, 2)
    assert values(study) == [
        {"learner.alpha": alpha, "environment.chances.breakdown": chance}
        for alpha in (0.1, 0.5)
        for chance in (0.1, 0.4)
    ]
    assert len(study.models) == 2  # alpha changes nothing but the learner
    assert [setting.learner.alpha for setting in study.settings] == [0.1, 0.1, 0.5, 0.5]
    assert study.cells[:4] == [(0, 0), (0, 1), (0, 2), (1, 0)]


def test_tables_and_dots_say_the_same(tmp_path: Path) -> None:
    texts = ("[grid]\nlearner.alpha = [1.0]", '[grid]\n"learner.alpha" = [1.0]', "grid.learner.alpha = [1.0]")
    prints = {read_study(write(tmp_path, f'task = "task.toml"\n{text}\n')).fingerprint for text in texts}
    assert len(prints) == 1


def test_a_study_may_be_of_seeds_alone(tmp_path: Path) -> None:
    study = read_study(write(tmp_path, 'task = "task.toml"\nname = "alone"\nseeds = [7, 3]\n'))
    assert (study.name, study.seeds, values(study)) == ("alone", (7, 3), [{}])


RANDOM = """
task = "task.toml"
[random]
samples = 200
learner.alpha = { uniform = [0.1, 0.2] }
learner.epsilon = { log_uniform = [0.001, 1.0] }
learner.episode_steps = { integers = [3, 5] }
learner.algorithm = { choice = ["q_learning", "sarsa"] }
"""


def test_draws_stay_in_their_ranges_and_fill_them(tmp_path: Path) -> None:
    drawn = values(read_study(write(tmp_path, RANDOM)))
    assert len(drawn) == 200
    assert all(0.1 <= one["learner.alpha"] <= 0.2 for one in drawn)
    assert {one["learner.episode_steps"] for one in drawn} == {3, 4, 5}
    assert {one["learner.algorithm"] for one in drawn} == {"q_learning", "sarsa"}
    logs = [math.log10(one["learner.epsilon"]) for one in drawn]
    assert all(-3 <= log <= 0 for log in logs)
    assert sum(logs) / len(logs) == pytest.approx(-1.5, abs=0.2)  # 3.3 standard errors


def test_draws_depend_on_seed_and_key_alone(tmp_path: Path) -> None:
    first = values(read_study(write(tmp_path, RANDOM)))
    assert values(read_study(write(tmp_path, RANDOM))) == first
    fewer = RANDOM.replace("learner.alpha = { uniform = [0.1, 0.2] }\n", "")
    for with_alpha, without in zip(first, values(read_study(write(tmp_path, fewer))), strict=True):
        assert {k: v for k, v in with_alpha.items() if k != "learner.alpha"} == without
    other = values(read_study(write(tmp_path, RANDOM.replace("samples = 200", "samples = 200\nseed = 1"))))
    assert other != first


def test_every_point_of_a_grid_gets_the_same_draws(tmp_path: Path) -> None:
    text = GRID + "[random]\nsamples = 3\nlearner.epsilon = { uniform = [0.1, 0.9] }\n"
    found = values(read_study(write(tmp_path, text)))
    draws = [one["learner.epsilon"] for one in found]
    assert len(found) == 12
    assert draws == draws[:3] * 4


def test_a_setting_is_the_task_with_these_values_written_into_it(tmp_path: Path) -> None:
    text = """
    task = "task.toml"
    [grid]
    rule.1.times = [2]
    check.nonblocking = [false]
    learner.alpha = [{ kind = "visits", power = 0.7 }]
    """
    study = read_study(write(tmp_path, text))
    by_hand = TASK.replace("times = 3", "times = 2") + 'alpha = { kind = "visits", power = 0.7 }\n'
    write(tmp_path, task=by_hand + "[check]\nnonblocking = false\n")
    task = read_task(tmp_path / "task.toml")
    assert study.models[0].rules[0].automaton.n_states == task.rules[0].automaton.n_states
    assert study.models[0].options == task.options
    assert study.settings[0].learner == task.settings


def test_shaped_rewards_go_with_their_discount(tmp_path: Path) -> None:
    text = 'task = "task.toml"\n[grid]\nlearner.gamma = [0.5, 0.9]\n'
    assert len(read_study(write(tmp_path, text)).models) == 1
    shaped = TASK.replace("[learner]", "shaping = true\n[learner]")
    assert len(read_study(write(tmp_path, text, shaped)).models) == 2


def test_the_fingerprint_is_of_all_that_matters(tmp_path: Path) -> None:
    base = read_study(write(tmp_path)).fingerprint

    def of(study: str = GRID, task: str = TASK) -> str:
        return read_study(write(tmp_path, study, task)).fingerprint

    assert of(GRID.replace("seeds = 3", 'seeds = 9\nmetric = "value"')) == base
    assert of(task=TASK.replace("# small", "# smaller")) == base
    assert of(GRID.replace("0.4", "0.3")) != base
    assert of(task=TASK.replace("episodes = 40", "episodes = 41")) != base


def test_the_fingerprint_is_of_named_files_too(tmp_path: Path) -> None:
    machine = f'{{"name": "m", "propositions": ["done"], "initial": "u", "edges": {EDGES}}}'
    text = TASK.replace(f"edges = {EDGES}", 'file = "machine.json"')
    (tmp_path / "machine.json").write_text(machine, encoding="utf-8")
    first = read_study(write(tmp_path, task=text)).fingerprint
    (tmp_path / "machine.json").write_text(machine.replace("1.0", "2.0"), encoding="utf-8")
    assert read_study(write(tmp_path, task=text)).fingerprint != first


BAD = [
    ('seeds = 0\ntask = "task.toml"', "1:9: seeds: is 0; a whole number from 1"),
    ('seeds = [1, 1]\ntask = "task.toml"', "1:9: seeds: is [1, 1]; a list of different seeds"),
    ("seeds = 2", "1:1: has no 'task'; the path of a task file"),
    ('tusk = "task.toml"', "1:1: tusk: unknown key 'tusk'; did you mean 'task'?"),
    ('task = "task.toml"\nmetric = "gup"', "2:10: metric: is 'gup'; did you mean 'gap'?"),
    ('task = "task.toml"\n[grid]\nlearner.alpha = 0.1', "3:17: grid.learner.alpha: is 0.1; a list of values"),
    ('task = "task.toml"\n[grid]\nlearner.alpha = []', "3:17: grid.learner.alpha: is []; a list of values"),
    (
        'task = "task.toml"\n[grid]\nlearner.alpha = [0.1, 2.0]',
        "3:23: grid.learner.alpha: 2 makes no task: learner.alpha: is 2.0; a number above 0, at most 1,",
    ),
    (
        'task = "task.toml"\n[grid]\nlearner.alpah = [0.1]',
        "3:18: grid.learner.alpah: 0.1 makes no task: learner.alpah: unknown key 'alpah'; did you mean 'al",
    ),
    (
        'task = "task.toml"\n[grid]\nrule.1.times = [2, "x"]',
        "3:20: grid.rule.1.times: 'x' makes no task: rule.1.times: is 'x'",
    ),
    (
        'task = "task.toml"\n[grid]\nrule.4.times = [2]',
        "3:17: grid.rule.4.times: 2 makes no task: rule.4.times: 'rule' of the task has 1 parts; give the",
    ),
    (
        'task = "task.toml"\n[grid]\nlearner.episodes.x = [2]',
        "'learner.episodes' of the task is no table; leave out what follows it",
    ),
    (
        'task = "task.toml"\n[grid]\nrun.seed = [2]',
        "run.seed: a study varies keys of events, plant, environment, rule, reward_machine, learner, check",
    ),
    ('task = "task.toml"\n[random]\nlearner.alpha = { uniform = [0.1, 1] }', "2:1: random: has no 'samples'"),
    (
        'task = "task.toml"\n[random]\nsamples = 2\nlearner.alpha = { uniform = [1, 0.1] }',
        "4:29: random.learner.alpha.uniform: is [1, 0.1]; [least, largest] is needed",
    ),
    (
        'task = "task.toml"\n[random]\nsamples = 2\nlearner.alpha = { log_uniform = [0, 1] }',
        "numbers above 0 are needed",
    ),
    (
        'task = "task.toml"\n[random]\nsamples = 2\nlearner.alpha = { choice = [1], uniform = [0, 1] }',
        "exactly one of uniform, log_uniform, integers or choice is needed",
    ),
    (
        'task = "task.toml"\n[random]\nsamples = 2\nlearner.alpha = [0.1]',
        "is [0.1]; a table with one of uniform, log_uniform, integers, choice is needed",
    ),
    (
        'task = "task.toml"\n[grid]\nlearner.alpha = [1]\n[random]\nsamples = 2\nlearner.alpha.choice = [1]',
        "6:9: random.learner.alpha: 'learner.alpha' is in [grid] too",
    ),
    ('task = "none.toml"', "1:8: task: there is no file '"),
    ("task = '.'", "; the path of a task file is needed"),
    ('task = "task.toml"\nname = "../else"', "2:8: name: is '../else'; a name without / is"),
    ('task = "task.toml"\n[random]\nsamples = 2', "2:1: random: has no key to draw for"),
    (
        'task = "task.toml"\n[grid]\nlearner.alpha = [0.1]\n"learner.alpha" = [0.2]',
        "4:1: grid.learner.alpha: 'learner.alpha' stands here twice",
    ),
    (
        'task = "task.toml"\n[grid]\nlearner = [1]',
        "3:12: grid.learner: 1 makes no task: learner: is 1",
    ),
    (
        'task = "task.toml"\n[grid]\ncheck = [true]',
        "3:10: grid.check: true makes no task: check: is true",
    ),
    (
        'task = "task.toml"\n[grid]\nreward_machine = [1]',
        "3:19: grid.reward_machine: 1 makes no task",
    ),
    (
        'task = "task.toml"\ngrid.learner.gamma = [0, 1]\nrandom = { samples = 90000, check.x.choice = [1] }',
        "these are 180,000 settings; at most 100,000 are run",
    ),
]


@pytest.mark.parametrize(("text", "said"), BAD, ids=[str(k) for k in range(len(BAD))])
def test_a_slip_is_told_with_its_place(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError) as caught:
        read_study(write(tmp_path, text))
    assert said in str(caught.value)


def test_a_slip_of_the_task_is_told_where_it_is(tmp_path: Path) -> None:
    text = TASK.replace("episodes = 40", "episodes = 40\nalgorithm = 'sarsa'")
    study = 'task = "task.toml"\n[grid]\nlearner.epsilon = [0.1]\nlearner.counterfactual = [false, true]\n'
    with pytest.raises(FormatError, match=r"counterfactual: true makes no task: learner.counterfactual"):
        read_study(write(tmp_path, study, text))
    broken = TASK.replace("episodes = 40", "episodes = 0")
    with pytest.raises(FormatError, match=r"task.toml:23:12: learner.episodes: is 0.*\nin setting 0 of the"):
        read_study(write(tmp_path, GRID, broken))
    with pytest.raises(FormatError, match="a study learns; give the task the id of an"):
        read_study(write(tmp_path, 'task = "task.toml"', TASK.split("[environment]", maxsplit=1)[0]))


# --- cells ------------------------------------------------------------------------------------------------


def test_a_cell_is_what_an_experiment_says(tmp_path: Path) -> None:
    study = read_study(write(tmp_path))
    rows = rows_of(study)
    for number, setting in enumerate(study.settings):
        task = replace(study.models[setting.model], settings=setting.learner, seeds=len(study.seeds))
        told = summary(run(task, check(task)))
        for seed, said in enumerate(told["per_seed"]):
            row = rows[number, seed]
            assert (row.value, row.gap, row.completion, row.violations) == (
                said["greedy_value"], said["gap"], said["completion"], 0
            )  # fmt: skip
        assert rows[number, 0].expected_steps == told["greedy"]["expected_steps"]
        assert rows[number, 0].steps == told["training"]["steps"]
        assert rows[number, 0].verdict == told["check"]["verdict"]


CANNOT = GRID.replace(
    '"environment.chances.breakdown" = [0.1, 0.4]', 'rule.1.of = ["pause", ["start", "pause"]]'
)


def test_rules_that_cannot_be_kept_are_a_result(tmp_path: Path) -> None:
    rows = rows_of(read_study(write(tmp_path, CANNOT)))
    assert rows[1, 0] == Row(1, 0, "not_enforceable")
    assert rows[0, 0].gap is not None


# --- results ----------------------------------------------------------------------------------------------


@pytest.fixture
def results() -> Callable[[Path, Study], Any]:
    pytest.importorskip("pyarrow", reason="results are kept by pyarrow")
    from supremal.studies.results import Results

    return Results


@pytest.mark.parametrize("jobs", [1, 3])
def test_a_study_comes_out_the_same_however_it_is_run(
    jobs: int, tmp_path: Path, results: Callable[[Path, Study], Any]
) -> None:
    from supremal.studies.running import run_study

    study, told = read_study(write(tmp_path)), []
    there = results(tmp_path / "r.parquet", study)
    assert run_study(there, jobs=jobs, on_row=told.append)
    assert timeless(there.rows) == timeless(rows_of(study))
    assert len(told) == 12
    again = results(tmp_path / "r.parquet", study)
    assert (again.rows, again.missing, list(again.rows)) == (there.rows, [], study.cells)


def test_columns_are_what_a_reader_expects(tmp_path: Path, results: Callable[[Path, Study], Any]) -> None:
    from pyarrow import parquet

    from supremal.studies.running import run_study

    text = (
        'task = "task.toml"\n[grid]\nlearner.alpha = [0.5, { kind = "visits", power = 0.7 }]\n'
        "learner.gamma = [0, 0.5]\nlearner.counterfactual = [false, true]\n"
    )
    run_study(results(tmp_path / "r.parquet", read_study(write(tmp_path, text))))
    table = parquet.read_table(tmp_path / "r.parquet").to_pydict()
    assert table["setting"] == list(range(8))
    assert table["learner.gamma"] == [0.0, 0.0, 0.5, 0.5] * 2
    assert table["learner.counterfactual"] == [False, True] * 4
    assert [json.loads(value) for value in table["learner.alpha"]][3:5] == [
        0.5, {"kind": "visits", "power": 0.7}
    ]  # fmt: skip
    assert list(table)[:5] == ["setting", "learner.alpha", "learner.gamma", "learner.counterfactual", "seed"]


def test_ctrl_c_keeps_what_is_finished(tmp_path: Path, results: Callable[[Path, Study], Any]) -> None:
    from supremal.studies.running import run_study

    study = read_study(write(tmp_path, task=TASK.replace("episodes = 40", "episodes = 20_000")))

    def interrupt(row: Row) -> None:
        nonlocal told
        told += 1
        if told == 5:
            raise KeyboardInterrupt

    there, told = results(tmp_path / "r.parquet", study), 0
    assert not run_study(there, on_row=interrupt)
    again = results(tmp_path / "r.parquet", study)
    assert 5 <= len(again.rows) < 12
    assert run_study(again, jobs=2)
    assert timeless(again.rows) == timeless(rows_of(study))


def test_more_seeds_are_added_to_those_that_are_there(
    tmp_path: Path, results: Callable[[Path, Study], Any]
) -> None:
    from supremal.studies.running import run_study

    path = tmp_path / "r.parquet"
    run_study(results(path, read_study(write(tmp_path))))
    more = results(path, read_study(write(tmp_path, GRID.replace("seeds = 3", "seeds = 5"))))
    assert more.missing == [(number, seed) for number in range(4) for seed in (3, 4)]
    fewer = results(path, read_study(write(tmp_path, GRID.replace("seeds = 3", "seeds = 1"))))
    assert (fewer.missing, len(fewer.rows)) == ([], 12)  # none is forgotten


def test_a_file_is_whole_whenever_it_is_read(tmp_path: Path, results: Callable[[Path, Study], Any]) -> None:
    study = read_study(write(tmp_path))
    there, counts = results(tmp_path / "r.parquet", study), []
    there.add([Row(0, 0, "enforceable")])
    with ThreadPoolExecutor(1) as pool:
        writing = pool.submit(lambda: [there.add([Row(*cell, "enforceable")]) for cell in study.cells * 20])
        while not writing.done():
            counts.append(len(results(there.path, study).rows))
    assert writing.result()
    assert counts == sorted(counts)


def test_a_file_with_something_else_is_refused(tmp_path: Path, results: Callable[[Path, Study], Any]) -> None:
    from supremal.studies.results import ResultsError
    from supremal.studies.running import run_study

    path = tmp_path / "r.parquet"
    run_study(results(path, read_study(write(tmp_path, 'task = "task.toml"'))))
    before = path.read_bytes()
    study = read_study(write(tmp_path))
    with pytest.raises(FormatError, match="other results: of another study, or from before"):
        results(path, study)
    assert path.read_bytes() == before
    path.write_bytes(before[:-20])
    with pytest.raises(FormatError, match="cannot be read as Parquet"):
        results(path, study)
    with pytest.raises(ResultsError, match="choose another file with --out"):
        run_study(results(path / "below" / "r.parquet", study))


def test_what_cannot_be_learned_ends_a_study(tmp_path: Path, results: Callable[[Path, Study], Any]) -> None:
    from supremal.studies.running import run_study

    study = read_study(write(tmp_path, 'task = "task.toml"\nseeds = 9\n[grid]\ncheck.max_states = [3]\n'))
    with pytest.raises(SupremalError, match="raise max_states or split it"):
        run_study(results(tmp_path / "r.parquet", study), jobs=2)


def test_without_pyarrow_a_study_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("supremal.studies._parquet", "supremal.studies.results"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'supremal\[study\]'"):
        import supremal.studies.results  # noqa: F401 - importing it is the test


def test_the_best_come_first_and_what_is_not_known_last(
    tmp_path: Path, results: Callable[[Path, Study], Any]
) -> None:
    from supremal.studies.ranking import rank

    def ranked(metric: str) -> list[int]:
        study = read_study(write(tmp_path, GRID.replace("seeds = 3", f'seeds = 3\nmetric = "{metric}"')))
        there = results(tmp_path / f"{metric}.parquet", study)
        for number, score in enumerate((3.0, 1.0, 2.0)):
            there.add(Row(number, seed, "enforceable", value=score, gap=score) for seed in range(3))
        there.add([Row(3, 0, "not_enforceable")])
        assert len(rank(there)) == 3  # the fourth has not all of its seeds yet
        there.add(Row(3, seed, "not_enforceable") for seed in (1, 2))
        assert rank(there)[-1].mean is None
        assert (rank(there, 1)[0].low, rank(there, 1)[0].high) == (rank(there, 1)[0].mean,) * 2
        return [place.setting for place in rank(there)]

    assert ranked("gap") == [1, 2, 0, 3]
    assert ranked("value") == [0, 2, 1, 3]


# --- the command ------------------------------------------------------------------------------------------


def ask(*arguments: object) -> Result:
    return CliRunner().invoke(study_command, [str(argument) for argument in arguments])


@pytest.mark.usefixtures("results")
def test_the_command_tells_the_best_settings(tmp_path: Path) -> None:
    path, out = write(tmp_path), tmp_path / "r.parquet"
    first = ask(path, "--out", out, "--jobs")
    assert first.exit_code == 0, first.output
    assert "12 of 12 results to come" in first.output
    assert "breakdown" in first.output
    again = ask(path, "--out", out, "--json", "--rows", "2")
    told = json.loads(again.stdout)
    assert (told["settings"], told["seeds"], told["missing"], told["metric"]) == (4, [0, 1, 2], 0, "gap")
    assert len(told["best"]) == 2
    assert told["best"][0]["low"] <= told["best"][0]["mean"] <= told["best"][0]["high"]


@pytest.mark.usefixtures("results")
def test_the_command_says_where_no_rules_can_be_kept(tmp_path: Path) -> None:
    study = CANNOT.replace('"pause", [', "[")
    result = ask(write(tmp_path, study), "--out", tmp_path / "r.parquet")
    assert result.exit_code == 1, result.output
    assert "–" in result.output


@pytest.mark.usefixtures("results")
def test_halving_needs_ray() -> None:
    result = ask("study.toml", "--halving")
    assert (result.exit_code, "say where to run it with --ray" in result.output) == (2, True)


@pytest.mark.usefixtures("results")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_study_that_was_ended_goes_on(how: signal.Signals, tmp_path: Path) -> None:
    from supremal.studies.results import Results

    path, out = write(tmp_path, GRID.replace("seeds = 3", "seeds = 500")), tmp_path / "r.parquet"
    script = "import sys; from supremal.cli.study import study_command as s; s()"
    command = [sys.executable, "-c", script, str(path), "--out", str(out), "--jobs", "2"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=os.environ) as process:
        deadline = time.monotonic() + 60
        while not out.exists() or not Results(out, read_study(path)).rows:
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process.send_signal(how)
        said = process.communicate(timeout=60)[0].decode()
    assert process.returncode == (130 if how == signal.SIGINT else -how), said
    assert how == signal.SIGKILL or "The same command goes on." in said
    study = read_study(path)
    before = Results(out, study)
    assert 0 < len(before.rows) < len(study.cells)
    fewer = read_study(write(tmp_path))  # the first three seeds are enough to compare
    there = Results(out, fewer)
    from supremal.studies.running import run_study

    run_study(there)
    assert before.rows.items() <= there.rows.items()
    rows = timeless(there.rows)
    assert {cell: rows[cell] for cell in fewer.cells} == timeless(rows_of(fewer))

"""``supremal check``, ``rules``, ``synthesize`` and ``run`` on task files, as a user meets them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import book
from supremal import is_same_language, synthesize
from supremal.cli import main
from supremal.formats import read_model
from supremal.task.findings import plants_of
from supremal.task.reading import read_task

EXAMPLES = Path(__file__).parents[1] / "examples"
FEW = ("--episodes", "300")
CANNOT = """
[events]
controllable = ["go"]
uncontrollable = ["fault"]
[[plant]]
transitions = [["up", "go", "up"], ["up", "fault", "up"]]
[environment]
chances = { fault = 0.5 }
[[rule]]
name = "calm"
pattern = "absence"
of = "fault"
"""


def ask(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def told(*arguments: object, code: int = 0) -> dict[str, Any]:
    result = ask(*arguments, "--json")
    assert result.exit_code == code, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return found


@pytest.mark.parametrize(
    ("name", "verdict"),
    [
        ("pickup_delivery", "enforceable"),
        ("pickup_delivery_published", "enforceable"),
        ("manufacturing_cell", "enforceable_in_part"),
        ("taxi", "enforceable_in_part"),
        ("frozen_lake", "enforceable_in_part"),
    ],
)
def test_what_can_be_kept_of_the_examples(name: str, verdict: str) -> None:
    found = told("check", EXAMPLES / f"{name}.toml", code=int(verdict != "enforceable"))
    assert found["verdict"] == verdict
    assert found["must_act"]


@pytest.mark.parametrize("name", ["manufacturing_cell", "taxi", "frozen_lake", "pickup_delivery_published"])
def test_an_example_is_trained_without_a_violation(name: str, tmp_path: Path) -> None:
    found = told("run", EXAMPLES / f"{name}.toml", *FEW, "--out", tmp_path / "run")
    assert found["training"]["violations"] == found["greedy"]["violation_probability"] == 0
    assert found["baseline"]["violations"] > 0
    assert found == json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    assert (
        told("check", tmp_path / "run" / "task.toml", code=found["check"]["verdict"] != "enforceable")[
            "rules"
        ]
        == told("check", EXAMPLES / f"{name}.toml", code=found["check"]["verdict"] != "enforceable")["rules"]
    )
    with np.load(tmp_path / "run" / "learned.npz", allow_pickle=False) as learned:
        assert learned["q"].shape[:2] == learned["policy"].shape
        assert learned["seeds"].tolist() == [0]


def test_the_cell_s_patterns_are_the_automata_drawn_by_hand() -> None:
    task, drawn = (
        read_task(EXAMPLES / "manufacturing_cell.toml"),
        read_model(book.CASES / "manufacturing_cell.json"),
    )
    ours = synthesize(task.plants, [rule.automaton for rule in task.rules], must_act=True).automaton
    theirs = synthesize(drawn.plants, drawn.specs, must_act=True).automaton
    assert (ours.n_states, ours.n_transitions) == (7_778, 18_879)
    assert is_same_language(ours, theirs)


def test_in_the_cell_nothing_is_picked_while_the_buffer_is_full() -> None:
    """It comes out of the synthesis: no rule says so, and without a supervisor it happens."""
    task = read_task(EXAMPLES / "manufacturing_cell.toml")
    rules = [rule.automaton for rule in task.rules]
    supervisor = synthesize(task.plants, rules, must_act=True)
    automaton, p1 = supervisor.automaton, supervisor.automaton.alphabet.index("p1")
    full = automaton.origin[:, len(task.plants)] == rules[0].run(["d1"])
    assert full.any()
    assert not (automaton.delta[full, p1] >= 0).any()
    assert (automaton.delta[~full, p1] >= 0).any()
    said = ask("synthesize", EXAMPLES / "manufacturing_cell.toml", "--all").stdout
    picks = [line for line in said.splitlines() if "p1 is disabled" in line and "phi" in line]
    assert picks
    assert any("deadline_R1" in line for line in picks)


def test_an_environment_that_is_seen_is_not_kept_to_what_a_word_tells() -> None:
    """On slippery ice a word of moves does not tell the place; who sees it can stay dry."""
    task = read_task(EXAMPLES / "frozen_lake.toml")
    (plant,) = plants_of(task)
    assert any(event.startswith("@") for event in plant.alphabet)
    found = told("synthesize", EXAMPLES / "frozen_lake.toml", "--all")
    assert found["supervisor"]["states"] > 0
    assert any("@" in step["event"] for reason in found["disabled"]["reasons"] for step in reason["chain"])


def test_rules_that_cannot_be_kept_are_not_trained(tmp_path: Path) -> None:
    path = tmp_path / "cannot.toml"
    path.write_text(CANNOT, encoding="utf-8")
    result = ask("run", path, "--out", tmp_path / "run")
    assert result.exit_code == 1
    assert "The rules cannot be kept." in result.stdout
    assert "fault can happen, which nobody controls: it breaks calm" in result.stdout
    assert told("run", path, "--out", tmp_path / "run", code=1)["check"]["verdict"] == "not_enforceable"
    assert not (tmp_path / "run").exists()


def test_without_a_plant_the_answer_holds_whatever_happens(tmp_path: Path) -> None:
    path = tmp_path / "worst.toml"
    path.write_text(
        '[events]\ncontrollable = ["a"]\n[[rule]]\npattern = "absence"\nof = "a"\n', encoding="utf-8"
    )
    result = ask("check", path)
    assert result.exit_code == 0
    assert "no plant is given, so any event may come at any time" in result.stdout
    run = ask("run", path)
    assert run.exit_code == 2
    assert "has no [environment], so nothing can be learned; say how likely uncontrollable" in run.stderr


def test_a_slip_is_one_clear_message(tmp_path: Path) -> None:
    path = tmp_path / "slip.toml"
    path.write_text(CANNOT.replace('of = "fault"', 'of = "fualt"'), encoding="utf-8")
    for command in ("check", "rules", "synthesize", "run"):
        result = ask(command, path)
        assert result.exit_code == 2
        assert result.stderr == (
            f"Error: {path}:12:6: rule.1.of: unknown event 'fualt'; did you mean 'fault'?\n"
        ), command


def test_a_task_file_is_asked_alone(tmp_path: Path) -> None:
    result = ask("check", EXAMPLES / "taxi.toml", EXAMPLES / "manufacturing_cell_plants.json")
    assert result.exit_code == 2
    assert "give it alone" in result.stderr
    assert ask("check", tmp_path / "none.toml").exit_code == 2


def test_environments_of_one_s_own_are_imported_on_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "my_walks.py").write_text(
        """
import gymnasium
import numpy as np


class Walk(gymnasium.Env):
    observation_space, action_space = gymnasium.spaces.Discrete(3), gymnasium.spaces.Discrete(2)
    P = {s: {a: [(1.0, min(s + a, 2), float(s == 1 and a), s + a >= 2)] for a in (0, 1)} for s in range(3)}
    initial_state_distrib = np.array([1.0, 0.0, 0.0])


gymnasium.register("Walk-v7", Walk)
""",
        encoding="utf-8",
    )
    task = tmp_path / "walk.toml"
    task.write_text('[environment]\nid = "Walk-v7"\n[[rule]]\nltlf = "!action_0"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    assert ask("check", task).exit_code == 2
    assert ask("--import", "my_walks", "check", task).exit_code == 0
    assert "cannot import no_such_module" in ask("--import", "no_such_module", "check", task).stderr
    task.write_text('[environment]\nid = "my_walks:Walk-v7"\n', encoding="utf-8")
    result = ask("check", task)
    assert result.exit_code == 2
    assert "supremal --import my_walks ..." in result.stderr


def test_what_supremal_init_writes_is_a_task(tmp_path: Path) -> None:
    path = tmp_path / "task.toml"
    assert ask("init", path).exit_code == 0
    assert told("check", path, code=1)["verdict"] == "enforceable_in_part"
    assert told("rules", path)["findings"] == []
    assert told("synthesize", path)["supervisor"]["states"] > 0
    again = ask("init", path.with_suffix(""))
    assert again.exit_code == 2
    assert "task.toml exists already" in again.stderr


# --- runs that end before their time ------------------------------------------------------------------------


def without_times(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((path / "result.json").read_text(encoding="utf-8"))
    del found["check"]["seconds"]
    for learner in ("training", "baseline"):
        del found[learner]["seconds"], found[learner]["steps_per_second"]
    return found


def start(out: Path, *more: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "supremal", "run", str(EXAMPLES / "taxi.toml"), "--episodes", "700000"]
    command += ["--checkpoint", "0.05", *more, *(() if "--resume" in more else ("--out", str(out)))]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def killed_at(process: subprocess.Popen[str], line: str, how: signal.Signals) -> str:
    """Send a signal once the process has printed ``line``, and return all that it prints after."""
    assert process.stdout is not None
    for said in process.stdout:
        if said.startswith(line):
            process.send_signal(how)
            break
    rest = process.stdout.read()
    process.wait()
    return rest


def test_a_run_that_is_killed_goes_on_as_if_it_had_not_been(tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    with start(whole) as process:
        assert process.wait() == 0
    with start(cut) as process:
        killed_at(process, "  supervised 1: 140,000", signal.SIGKILL)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cut.partial", "whole"]
    refused = ask("run", EXAMPLES / "taxi.toml", "--out", cut)
    assert refused.exit_code == 2
    assert "go on with it by --resume" in refused.stderr
    with start(cut, "--resume", str(cut)) as process:
        killed_at(process, "  baseline 1: 140,000", signal.SIGKILL)
    with start(cut, "--resume", f"{cut}.partial") as process:
        assert process.wait() == 0
    assert without_times(cut) == without_times(whole)
    for name in ("curves.csv", "task.toml"):
        assert (cut / name).read_bytes() == (whole / name).read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cut", "whole"]
    assert not (cut / "checkpoints").exists()
    again = ask("run", EXAMPLES / "taxi.toml", "--resume", cut)
    assert again.exit_code == 2
    assert "is no run that was stopped" in again.stderr


def test_a_run_that_was_stopped_by_ctrl_c_goes_on(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with start(out) as process:
        rest = killed_at(process, "  supervised 1: 140,000", signal.SIGINT)
        assert process.returncode == 130, rest
    assert json.loads((out / "result.json").read_text(encoding="utf-8"))["partial"]
    with start(out, "--resume", str(out)) as process:
        assert process.wait() == 0
    assert not json.loads((out / "result.json").read_text(encoding="utf-8"))["partial"]


def test_another_task_cannot_go_on_with_a_run(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with start(out) as process:
        killed_at(process, "  supervised 1: 140,000", signal.SIGKILL)
    result = ask("run", EXAMPLES / "frozen_lake.toml", "--resume", out)
    assert result.exit_code == 2
    assert "another model" in result.stderr
    assert (tmp_path / "run.partial" / "checkpoints").exists()


def test_several_seeds_are_told_together(tmp_path: Path) -> None:
    found = told(
        "run", EXAMPLES / "taxi.toml", *FEW, "--seeds", "5", "--out", tmp_path / "run", "--log", "csv"
    )
    over = found["over_seeds"]
    for curve in ("score", "completion", "regret"):
        assert len(over[curve]["mean"]) == len(found["training"][curve])
        for low, mean, high in zip(over[curve]["low"], over[curve]["mean"], over[curve]["high"], strict=True):
            assert low <= mean <= high
    assert over["gap"]["low"] <= over["gap"]["mean"] <= over["gap"]["high"]
    assert "interquartile mean of 5 seeds" in (tmp_path / "run" / "score.svg").read_text(encoding="utf-8")
    logs = tmp_path / "run" / "logs"
    assert sorted(path.name for path in logs.iterdir()) == [
        "baseline-0",
        *(f"supervised-{k}" for k in range(5)),
    ]
    assert "rollout/ep_rew_mean" in (logs / "supervised-0" / "progress.csv").read_text(encoding="utf-8")


def test_what_needs_something_uncontrollable_to_get_on_is_run(tmp_path: Path) -> None:
    path = tmp_path / "wait.toml"
    path.write_text(
        '[[plant]]\ntransitions = """\nuncontrollable d\nmarked e\ns -go-> w\nw -idle-> w\nw -d-> e\n"""\n'
        "[environment]\nchances = { d = 0.5 }\n",
        encoding="utf-8",
    )
    found = told("run", path, *FEW, "--out", tmp_path / "run")
    assert found["optimal"]["steps_undisturbed"] is None
    assert found["optimal"]["completion_ever"] == pytest.approx(1.0)


def test_shaping_changes_what_is_told_and_not_what_is_best(tmp_path: Path) -> None:
    """A short way earns 1, a long one 1.5: at γ = 0.95 the long one is best, however the rewards are told."""
    text = """
[[plant]]
transitions = [["s", "quick", "q"], ["s", "long", "a"], ["a", "step", "b"], ["b", "step", "c"]]
marked = ["q", "c"]
[environment]
chances = {}
labels = { short = { "plant 1" = "q" }, far = { "plant 1" = "c" } }
[reward_machine]
edges = [["u", "short & !far", "v", 1.0], ["u", "far", "v", 1.5]]
shaping = SHAPING
[learner]
gamma = 0.95
"""
    for number, shaping in enumerate(("false", "true", "0.1")):
        path = tmp_path / f"{number}.toml"
        path.write_text(text.replace("SHAPING", shaping), encoding="utf-8")
        found = told("run", path, "--episodes", "2000", "--out", tmp_path / f"run{number}")
        assert found["optimal"]["value"] == pytest.approx(1.5 * 0.95**2)
        assert found["greedy"]["gap"] == pytest.approx(0)
        assert found["shaped"] == (shaping != "false")


def test_a_run_goes_on_with_what_it_was_asked_for(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with start(out, "--seed", "5") as process:
        killed_at(process, "  supervised 1: 140,000", signal.SIGKILL)
    found = told("run", EXAMPLES / "taxi.toml", "--resume", out)
    assert (found["seed"], found["training"]["episodes"]) == (5, 700_000)

"""``supremal monitor``, and the judging beneath it, against the definitions of the book."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st

import book
from strategies import models, words
from supremal import Alphabet, Automaton, from_text
from supremal.cli import main
from supremal.rules.patterns import absence, exactly
from supremal.rules.rule import Rule
from supremal.task.judging import Bench, Broken, Unforeseen, bench_of, judge
from supremal.task.reading import read_task
from supremal.task.task import Options, Task

GALLERY = Path(__file__).parents[1] / "examples" / "gallery"
AGENT = GALLERY / "tool_agent"
TASK = """
[events]
controllable = ["ask", "act"]
uncontrollable = ["yes", "no"]
[[rule]]
name = "asked"
ltlf = "G (act -> Y yes)"
[[rule]]
name = "replied"
pattern = "response"
trigger = "ask"
reaction = ["yes", "no"]
"""


def monitor(folder: Path, traces: str | bytes, *more: str, task: str = TASK) -> Result:
    (folder / "task.toml").write_text(task, encoding="utf-8")
    (folder / "traces.jsonl").write_bytes(traces.encode() if isinstance(traces, str) else traces)
    return ask(folder / "task.toml", folder / "traces.jsonl", *more)


def ask(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["monitor", *(str(argument) for argument in arguments)])


def found_in(result: Result) -> list[dict[str, Any]]:
    traces: list[dict[str, Any]] = json.loads(result.stdout)["traces"]
    return traces


# --- the command ------------------------------------------------------------------------------------------


def test_kept_broken_and_pending(tmp_path: Path) -> None:
    traces = '["ask", "yes", "act"]\n\n{"id": "rude", "events": ["act"], "model": "any"}\n["ask"]\n[]\n'
    result = monitor(tmp_path, traces)
    assert result.exit_code == 1
    assert result.output.splitlines() == [
        "line 1: kept",
        "rude (line 3): broken",
        "  event 1: act breaks asked",
        "  event 1: act is disabled: it breaks asked in its state 0",
        "line 4: pending",
        "  at the end: replied is not satisfied yet",
        "line 5: kept",
        "4 traces: 2 kept, 1 broken, 1 pending",
    ]
    assert found_in(monitor(tmp_path, traces, "--json"))[1] == {
        "id": "rude",
        "line": 3,
        "events": 1,
        "verdict": "broken",
        "broken": [{"rule": "asked", "position": 1, "event": "act"}],
        "pending": [],
        "disabled": {
            "position": 1,
            "event": "act",
            "text": "act is disabled: it breaks asked in its state 0",
        },
        "unforeseen": None,
    }


@pytest.mark.parametrize("traces", ["", '["ask", "no"]', "\ufeff[]\r\n", '["ask"]\n'])
def test_nothing_broken(traces: str, tmp_path: Path) -> None:
    assert monitor(tmp_path, traces).exit_code == 0


@pytest.mark.parametrize(
    ("line", "place", "told"),
    [
        ('["ask"', ":2:7", "this is not JSON"),
        ('["aks"]', ":2", "event 1 is \"aks\", which the task does not have; did you mean 'ask'?"),
        ('["ask", 3]', ":2", "event 2 is 3; a string is needed"),
        ('{"event": ["ask"]}', ":2", "the object has no key 'events'; its keys are event"),
        ('{"events": "ask"}', ":2", 'events is "ask"; a list is needed'),
        ('"ask"', ":2", "an array of events, or an object with the key 'events' is needed"),
        ('{"id": "a", "id": "b", "events": []}', ":2", "key 'id' stands twice"),
        ("[" * 100_000, ":2", "nested too deeply"),
        (f'["{"a" * (1 << 20)}"]', ":2", "the line is longer than 1 MiB"),
        (b'["\xff"]', ":2", "not UTF-8"),
    ],
)
def test_what_is_no_trace_is_told_with_its_line(
    line: str | bytes, place: str, told: str, tmp_path: Path
) -> None:
    result = monitor(tmp_path, b'["act"]\n' + (line.encode() if isinstance(line, str) else line))
    assert result.exit_code == 2
    assert f"traces.jsonl{place}: " in result.output
    assert told in result.output
    assert "Traceback" not in result.output


def test_files_that_are_not_there(tmp_path: Path) -> None:
    result = ask(AGENT / "task.toml", tmp_path / "none.jsonl")
    assert result.exit_code == 2
    assert "give a file with one trace a line" in result.output
    assert ask(tmp_path / "none.toml", AGENT / "traces.jsonl").exit_code == 2


def test_the_supervisor_steps_in_before_a_rule_breaks() -> None:
    result = ask(AGENT / "task.toml", AGENT / "traces.jsonl", "--json")
    assert result.exit_code == 1
    found = {trace["id"]: trace for trace in found_in(result)}
    ran_out, lucky = found["out of retries"], found["lucky"]
    assert ran_out["disabled"]["position"] == 9 < ran_out["broken"][0]["position"] == 13
    assert lucky["verdict"] == "kept"
    assert lucky["disabled"]["event"] == "pay"
    surprise = found["a tool that nobody called"]
    assert surprise["unforeseen"] == {"plant": "tool", "position": 3, "event": "ok"}
    assert surprise["disabled"] is None
    for trace in found.values():
        if trace["broken"] and trace["unforeseen"] is None:
            assert trace["disabled"]["position"] <= min(broken["position"] for broken in trace["broken"])


def test_where_there_is_no_supervisor_to_ask(tmp_path: Path) -> None:
    (tmp_path / "traces.jsonl").write_text('["pickup"]', encoding="utf-8")
    result = ask(GALLERY / "taxi" / "task.toml", tmp_path / "traces.jsonl")
    assert "event 1: pickup breaks petrol first" in result.output
    assert "No supervisor was asked: the task's states are not in a trace." in result.output
    cannot = '[events]\nuncontrollable = ["no"]\n[[rule]]\npattern = "absence"\nof = "no"\n'
    result = monitor(tmp_path, '["no"]', task=cannot)
    assert "No supervisor was asked: the task's rules cannot be kept." in result.output


# --- the judging ------------------------------------------------------------------------------------------


SIGMA = Alphabet(("a", "b"))


def test_of_several_plants_the_first_surprise_is_told() -> None:
    plants = (
        from_text("name one \n 0 -a-> 1 \n 1 -a-> 2", alphabet=SIGMA),
        from_text("name two \n 0 -a-> 1", alphabet=SIGMA),
    )
    found = judge(bench_of(Task("t", SIGMA, plants=plants)), ("a", "a", "b"))
    assert found.unforeseen == Unforeseen("two", 2, "a")


def test_where_nothing_has_to_be_completed_nothing_is_pending() -> None:
    rule = Rule("once", exactly("a", 1, alphabet=SIGMA))
    closed = Task("t", SIGMA, rules=(rule,), options=Options(nonblocking=False))
    assert judge(bench_of(closed), ()).verdict == "kept"
    assert judge(bench_of(Task("t", SIGMA, rules=(rule,))), ()).pending == ("once",)


def test_a_rule_that_no_word_satisfies_is_broken_from_the_start() -> None:
    never = from_text("marked done \n 0 -b-> 0 \n done -b-> 0", alphabet=SIGMA)
    task = Task("t", SIGMA, rules=(Rule("never", never), Rule("no a", absence("a", alphabet=SIGMA))))
    found = judge(bench_of(task), ("b", "a"))
    assert found.broken == (Broken("never", 0, ""), Broken("no a", 2, "a"))


def _first(word: tuple[str, ...], machine: book.Machine) -> int:
    """The position of the first event that leads out of a machine; 0 if none does."""
    seen: tuple[str, ...] = ()
    for position, event in enumerate(word, 1):
        seen = (*seen, event) if event in machine.events else seen
        if book.after(machine, seen) is None:
            return position
    return 0


@given(models(), words())
def test_judging_is_as_defined(model: tuple[Automaton, Automaton], happened: list[str]) -> None:
    plant, rule = model
    task = Task("t", plant.alphabet, plants=(plant,), rules=(Rule("r", rule),))
    word = tuple(happened)
    found, kept = judge(bench_of(task), word), book.trim(book.read(rule))
    if kept.initial is None:
        assert found.broken == (Broken("r", 0, ""),)
        return
    breaks = _first(word, kept)
    assert [broken.position for broken in found.broken] == ([breaks] if breaks else [])
    here = book.after(kept, book.project(word, kept.events))
    assert bool(found.pending) == (not breaks and here not in kept.marked)
    surprise = _first(word, book.read(plant))
    assert (found.unforeseen.position if found.unforeseen else 0) == surprise
    behaviour = book.supcon(book.read(plant), book.read(rule), nonblocking=True)
    if behaviour.initial is not None:
        refused = _first(word, behaviour)
        told = found.refused.position if found.refused else 0
        assert told == (refused if not surprise or refused < surprise else 0)


@given(st.data())
def test_who_obeys_the_supervisor_is_never_blamed(data: st.DataObject) -> None:
    bench: Bench = AGENT_BENCH
    assert bench.disabled is not None
    run, word = bench.disabled.supervisor.monitor(), []
    for _ in range(data.draw(st.integers(0, 30))):
        if not run.enabled:
            break
        word.append(data.draw(st.sampled_from(run.enabled)))
        assert run.observe(word[-1:])
    found = judge(bench, tuple(word))
    assert not found.broken
    assert found.refused is None
    assert found.unforeseen is None


AGENT_BENCH = bench_of(read_task(AGENT / "task.toml"))

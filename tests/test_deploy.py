"""Exported supervisors: JSON there and back; Python, C and structured text beside the Monitor."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import assume, given
from hypothesis import settings as examples
from hypothesis import strategies as st

import structured_text
from strategies import plants, specifications
from supremal import (
    Alphabet,
    Automaton,
    AutomatonError,
    FormatError,
    ModelError,
    Monitor,
    from_text,
    from_transitions,
    is_same_language,
    sync,
    synthesize,
)
from supremal.cli.export import export_command
from supremal.cli.models import read
from supremal.deploy.build import hash_model, make_controller
from supremal.deploy.code import LANGUAGES, c_text, identifiers, python_text, st_text
from supremal.deploy.controller import Component, Controller, JointMonitor
from supremal.deploy.document import controller_text, read_controller
from supremal.deploy.vectors import find_difference
from supremal.formats.documents import write
from supremal.formats.model import Model
from supremal.synthesis.supervisor import Supervisor
from supremal.verifier import digest

ROOT = Path(__file__).parents[1]
STEPS = 10_000
CELL = ROOT / "examples" / "manufacturing_cell.toml"
MACHINE = (
    "name machine{0} \n marked idle \n uncontrollable end{0} \n idle -start{0}-> busy \n busy -end{0}-> idle"
)
BUFFER = (
    "name buffer{0} \n marked empty \n uncontrollable end{0} \n "
    "empty -end{0}-> full \n full -start{1}-> empty"
)
ODD = ('say"', "back\\slash", "*/end", "??/", "é-∀", "😀", "it's$", "int", "INT", "{{x}}", "%s", "a_", "(*")
DRIVER = r"""
#include <stdio.h>
#define {1}_SELF_TEST
#include "controller.h"
int main(void) {{
    {0}_supervisor s;
    unsigned event;
    if ({0}_self_test() != 0) {{
        return 1;
    }}
    {0}_reset(&s);
    while (scanf("%u", &event) == 1) {{
        int ok = 1;
        if (event == {1}_N_EVENTS) {{
            {0}_reset(&s);
        }} else {{
            ok = {0}_step(&s, event);
        }}
        putchar('0' + ok);
        putchar('0' + {0}_marked(&s));
        for (unsigned e = 0; e < {1}_N_EVENTS; e++) {{
            putchar('0' + {0}_enabled(&s, e));
        }}
        putchar('\n');
    }}
    return {0}_event_of("no such event") != {1}_N_EVENTS;
}}
"""


def line_of(count: int) -> tuple[list[Automaton], list[Automaton]]:
    """Machines in a row, with a buffer between each two."""
    machines = [from_text(MACHINE.format(k)) for k in range(count)]
    return machines, [from_text(BUFFER.format(k, k + 1)) for k in range(count - 1)]


@cache
def cell(*, modular: bool = False) -> Controller:
    subject = read([CELL], closed=False, must_act=False, max_states=None)
    return make_controller(subject.plants, subject.rules, name="cell", must_act=True, modular=modular)


def odd() -> Controller:
    """A controller whose names are all odd."""
    sigma = Alphabet(ODD, frozenset({"*/end", "😀"}))
    arrows = [(f"q{k}", name, f"q{(k + 1) % len(ODD)}") for k, name in enumerate(ODD)]
    plant = from_transitions(sigma, [*arrows, ("q0", "😀", "q\n*/0")], name='p"\n*/ (* ??/ \\')
    return make_controller([plant], [], name='an\n"odd" *) */ name \\')


CONTROLLERS = {
    "line": lambda: make_controller(*line_of(3), name="line"),
    "tables": lambda: make_controller(*line_of(3), name="2 tables", modular=True),
    "odd": odd,
    "still": lambda: make_controller([from_text("initial here \n events never")], [], name="still"),
    "cell": cell,
}


@pytest.fixture(scope="module", params=list(CONTROLLERS))
def controller(request: pytest.FixtureRequest) -> Controller:
    return CONTROLLERS[request.param]()


def random_run(controller: Controller, steps: int, seed: int) -> list[tuple[int, str]]:
    """Events, E for a reset, each with what the monitor says: allowed, marked, and each event if enabled."""
    rng = np.random.default_rng(seed)
    events, monitor, found = controller.alphabet.names, JointMonitor(controller), []
    known: dict[tuple[tuple[int, ...], str | None], tuple[tuple[str, ...], str]] = {}

    def look() -> tuple[tuple[str, ...], str]:
        here = monitor.state, monitor.lost_at
        if here not in known:
            enabled = monitor.enabled
            shown = "".join(str(int(event in enabled)) for event in events)
            known[here] = enabled, f"{int(monitor.marked)}{shown}"
        return known[here]

    for kind, draw in rng.random((steps, 2)).tolist():
        enabled, _ = look()
        ok, e = True, len(events)
        if not enabled or kind < 0.02:
            monitor.reset()
        else:
            choices = enabled if kind < 0.95 else events  # now and then any event, enabled or not
            event = choices[int(draw * len(choices))]
            ok, e = monitor.step(event), events.index(event)
        found.append((e, f"{int(ok)}{look()[1]}"))
    return found


def load(text: str) -> dict[str, Any]:
    ast.parse(text, feature_version=(3, 8))
    assert text.isascii()
    space: dict[str, Any] = {"__name__": "exported"}
    exec(compile(text, "exported.py", "exec"), space)  # noqa: S102 - running what was written is the test
    return space


def compiled(text: str, name: str, folder: Path) -> Path:
    assert text.isascii()
    prefix = identifiers([name])[0]
    (folder / "controller.h").write_text(text)
    (folder / "driver.c").write_text(DRIVER.format(prefix.lower(), prefix))
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]
    subprocess.run(["gcc", *strict, "-o", "driver", "driver.c"], cwd=folder, check=True)
    return folder / "driver"


def test_python_does_what_the_monitor_does(controller: Controller) -> None:
    exported = load(python_text(controller))
    assert exported["self_test"]() > 0
    run, events = exported["Supervisor"](), controller.alphabet.names
    for e, wanted in random_run(controller, STEPS, seed=1):
        ok = run.reset() is None if e == len(events) else run.step(events[e])
        enabled = run.enabled()
        shown = "".join(str(int(event in enabled)) for event in events)
        assert f"{int(ok)}{int(run.marked())}{shown}" == wanted


def test_c_does_what_the_monitor_does(controller: Controller, tmp_path: Path) -> None:
    driver = compiled(c_text(controller), controller.name, tmp_path)
    run = random_run(controller, STEPS, seed=2)
    asked = "\n".join(str(e) for e, _ in run)
    done = subprocess.run([driver], input=asked, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [wanted for _, wanted in run]


def test_a_million_events_of_the_cell(tmp_path: Path) -> None:
    controller = cell()
    run, events = random_run(controller, 1_000_000, seed=4), controller.alphabet.names
    asked = "\n".join(str(e) for e, _ in run)
    driver = compiled(c_text(controller), controller.name, tmp_path)
    done = subprocess.run([driver], input=asked, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [wanted for _, wanted in run]

    exported, shown = load(python_text(controller))["Supervisor"](), dict[Any, str]()
    for e, wanted in run:
        ok = exported.reset() is None if e == len(events) else exported.step(events[e])
        here = *exported.state, exported.lost_at
        if here not in shown:
            enabled = exported.enabled()
            shown[here] = f"{int(exported.marked())}{''.join(str(int(event in enabled)) for event in events)}"
        assert f"{int(ok)}{shown[here]}" == wanted


def test_the_c_of_the_page_compiles_as_printed(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "deploy.md").read_text(encoding="utf-8")
    include, body = page.split("```c\n")[1].split("```")[0].split("\n", 1)
    (tmp_path / "cell.h").write_text(c_text(cell()))
    (tmp_path / "page.c").write_text(f"{include}\nint main(void) {{\n{body}\nreturn 0;\n}}\n")
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    subprocess.run(["gcc", *strict, "-o", "page", "page.c"], cwd=tmp_path, check=True)
    subprocess.run([tmp_path / "page"], check=True)


def test_structured_text_does_what_the_monitor_does(controller: Controller) -> None:
    blocks = structured_text.read(st_text(controller))
    name = f"FB_{identifiers([controller.name])[0]}"
    assert list(blocks) == [name, f"{name}_TEST"]
    test = structured_text.Instance(blocks, f"{name}_TEST")
    while not test.values["FINISHED"]:
        test()
    assert test.values["PASSED"], test.values["AT_STEP"]
    block, events = structured_text.Instance(blocks, name), len(controller.alphabet)
    for e, wanted in random_run(controller, 300, seed=3):
        block(RESTART=e == events, HAPPENED=-1 if e == events else e)
        said = [block.values["ALLOWED"], block.values["IS_MARKED"], *block.values["ENABLED"]]
        assert "".join(str(int(value)) for value in said) == wanted
    before = dict(block.values)
    block(RESTART=False, HAPPENED=-1)
    assert block.values["ENABLED"] == before["ENABLED"]
    block(RESTART=False, HAPPENED=events)
    assert (block.values["ALLOWED"], block.values["LOST"]) == (False, before["LOST"])


def test_the_tests_of_a_small_controller_take_every_transition() -> None:
    controller = make_controller(*line_of(3))
    run, taken = JointMonitor(controller), set()
    for vector in controller.vectors:
        run.reset()
        for event, enabled in zip(vector.word, vector.enabled, strict=False):
            taken |= {(run.state, event)} if event in enabled else set()
            run.step(event)
    assert len(taken) == controller.components[0].supervisor.automaton.n_transitions


def test_a_self_test_finds_a_wrong_table() -> None:
    controller = make_controller(*line_of(2), name="line")
    space = load(python_text(controller))
    space["MOVES"][0].clear()
    with pytest.raises(AssertionError, match="is right"):
        space["self_test"]()
    text = st_text(controller)
    wrong = text.replace(
        "LEADS_TO : ARRAY [0..7] OF INT := [\n        1,", "LEADS_TO : ARRAY [0..7] OF INT := [\n        0,"
    )
    assert wrong != text
    test = structured_text.Instance(structured_text.read(wrong), "FB_LINE_TEST")
    while not test.values["FINISHED"]:
        test()
    assert not test.values["PASSED"]


def test_json_there_and_back(controller: Controller, tmp_path: Path) -> None:
    path = tmp_path / "controller.json"
    text = controller_text(controller)
    path.write_text(text, encoding="utf-8")
    back = read_controller(path)
    assert controller_text(back) == text
    assert all(write(back) == write(controller) for write in LANGUAGES.values())
    assert random_run(back, 300, seed=4) == random_run(controller, 300, seed=4)


def test_one_table_is_the_monitor_of_the_supervisor() -> None:
    machines, buffers = line_of(3)
    controller = make_controller(machines, buffers)
    monitor, joint = Monitor(synthesize(machines, buffers)), JointMonitor(controller)
    rng = np.random.default_rng(0)
    for _ in range(500):
        assert joint.enabled == monitor.enabled
        event = str(rng.choice(controller.alphabet.names))
        assert joint.step(event) == monitor.observe([event])
        if joint.lost_at is not None:
            assert joint.lost_at == monitor.lost_at
            joint.reset(), monitor.reset()
    assert controller.model == hash_model(machines, buffers, nonblocking=True, must_act=False)
    assert controller.model != hash_model(machines, buffers[:1], nonblocking=True, must_act=False)


@examples(max_examples=30)
@given(
    st.lists(plants(3), min_size=1, max_size=2),
    st.lists(specifications(3), min_size=1, max_size=2),
    st.booleans(),
)
def test_tables_side_by_side_are_the_one_table(
    parts: list[Automaton],
    rules: list[Automaton],
    nonblocking: bool,  # noqa: FBT001 - drawn by Hypothesis
) -> None:
    one = make_controller(parts, rules, nonblocking=nonblocking)
    several = make_controller(parts, rules, nonblocking=nonblocking, modular=True)
    assume(not several.is_empty)
    if nonblocking and several.nonblocking is False:
        monitor = JointMonitor(several)
        assert all(monitor.step(event) for event in several.blocked_after or ())
        return
    together = sync(*(component.supervisor.automaton for component in several.components))
    whole = one.components[0].supervisor.automaton
    closed = [replace(a, marked=np.ones(a.n_states, np.bool_)) for a in (together, whole)]
    assert is_same_language(*closed)
    assert is_same_language(together, whole)


def test_many_tables_where_one_would_be_too_large() -> None:
    machines, buffers = line_of(12)
    controller = make_controller(machines, buffers, max_states=1_000)
    assert len(controller.components) == 11
    assert controller.n_states == 66
    assert controller.nonblocking is None
    with pytest.raises(AutomatonError, match="more than 5"):
        make_controller(machines, buffers, max_states=5)


def test_several_tables_that_block_say_so() -> None:
    modular = cell(modular=True)
    assert modular.nonblocking is False
    assert modular.acts is None
    run = JointMonitor(modular)
    assert all(run.step(event) for event in modular.blocked_after or ())
    assert cell().nonblocking is True
    assert cell().acts is True


def test_reasons_name_rule_and_event() -> None:
    controller = make_controller(*line_of(2))
    why = next(why for why in controller.reasons if why.text.startswith("start0"))
    assert (why.rules, why.through, why.kind) == (("buffer0",), ("end0",), "uncontrollable")
    run = load(python_text(controller))["Supervisor"]()
    assert [run.step(event) for event in ("start0", "end0")] == [True, True]
    assert run.disabled() == {"start0": [why.text]}


def test_jsonl(tmp_path: Path) -> None:
    path = tmp_path / "line.py"
    path.write_text(python_text(make_controller(*line_of(2))))
    asked = [
        '{"reset": true}',
        '"start0"',
        '{"event": "end0"}',
        "nonsense",
        '"stop"',
        "[1]",
        '"start0"',
        '"end0"',
    ]
    done = subprocess.run(
        [sys.executable, "-I", path], input="\n".join(asked), capture_output=True, text=True, check=True
    )
    said = [json.loads(line) for line in done.stdout.splitlines()]
    assert said[0]["enabled"] == ["start0"]
    assert [row.get("ok") for row in said] == [True, True, True, None, None, None, False, False]
    assert said[2]["enabled"] == ["start1"]
    assert "not JSON" in said[3]["error"]
    assert "unknown event 'stop'; known: start0" in said[4]["error"]
    assert "needed" in said[5]["error"]
    assert (said[7]["enabled"], said[7]["lost_at"]) == ([], "start0")
    tested = subprocess.run(
        [sys.executable, "-I", path, "--self-test"], capture_output=True, text=True, check=True
    )
    assert tested.stdout.startswith("ok: ")
    assert subprocess.run([sys.executable, path, "--help"], capture_output=True, check=False).returncode == 2


def changed(document: dict[str, Any], path: str, value: Any) -> str:
    """The document with another value, and the hash that goes with it."""
    *way, last = path.split("/")
    here: Any = document
    for key in way:
        here = here[int(key) if key.isdigit() else key]
    here[int(last) if last.isdigit() else last] = value
    if path != "sha256":
        document["sha256"] = digest(document)
    return json.dumps(document)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("format", "other", "this is no controller"),
        ("version", 2, "version 2; version 1 is needed"),
        ("extra", 1, "unknown key 'extra'"),
        ("sha256", "0", "it was changed"),
        ("name", 3, "a string is needed"),
        ("uncontrollable/0", "end9", "unknown event 'end9'; did you mean"),
        ("events/1", "start0", "names 'start0' twice"),
        ("model/nonblocking", 1, "true or false is needed"),
        ("proved/acts", "yes", "true or false is needed"),
        ("components", [], "no component knows the event 'end0'"),
        ("components/0/states", [], "at least one is needed"),
        ("components/0/states/0/enabled/start0", 99, "a whole number from 0 to 5 is needed"),
        ("components/0/states/0/enabled/stop", 0, "unknown event 'stop'"),
        ("components/0/states/0/disabled/start0", 0, "where it is enabled"),
        ("components/0/states/0/disabled/start1", 7, "the reason of 'start1'"),
        ("components/0/states/0/enabled/start0", 2, "test 1 is not kept: after start0"),
        ("components/0/states/0/marked", False, "are allowed and not marked"),
        ("tests/0/ok", True, "test 1 is not kept"),
        ("tests/0/marked", [], "entries of 'enabled' and of 'marked' are needed"),
        ("reasons/0/rules", "buffer", "a list is needed"),
    ],
)
def test_what_is_wrong_in_a_document_is_said(path: str, value: Any, message: str, tmp_path: Path) -> None:
    document = json.loads(controller_text(make_controller(*line_of(2))))
    place = tmp_path / "controller.json"
    place.write_text(changed(document, path, value))
    with pytest.raises(FormatError, match=f"controller.json: .*{message}"):
        read_controller(place)


def test_what_cannot_be_a_controller() -> None:
    with pytest.raises(ModelError, match="there are no events"):
        make_controller([], [])
    hidden = Automaton(Alphabet(("a",), frozenset(), frozenset("a")), [[0]], [True])
    with pytest.raises(ModelError, match="'a' cannot be observed"):
        make_controller([hidden], [])
    loop = Automaton(Alphabet(("a",)), [[0]], [True])
    with pytest.raises(AutomatonError, match="follows 'a' in state 0, where it is disabled"):
        Component("c", Supervisor(loop, [[0]], [[False]]), np.empty((0, 3), np.int64))


def test_a_difference_is_told() -> None:
    controller = make_controller(*line_of(2))
    assert find_difference(controller) is None
    first = controller.vectors[0]
    wrong = replace(controller, vectors=(first._replace(enabled=((), *first.enabled[1:])),))
    assert find_difference(wrong) == (
        "test 1 is not kept: after nothing the tables are allowed and marked, with start0 enabled, "
        "where the test has allowed and marked, with nothing enabled"
    )


def export(*arguments: str | Path) -> Any:
    return CliRunner().invoke(export_command, [str(a) for a in arguments])


@pytest.mark.parametrize("language", list(LANGUAGES))
def test_command(language: str, tmp_path: Path) -> None:
    model, out = tmp_path / "line.json", tmp_path / "out"
    model.write_text(write(Model(*map(tuple, line_of(3)))), encoding="utf-8")
    done = export(model, "--to", language, "-o", out)
    assert done.exit_code == 0, done.output
    assert "18 states, 6 events" in done.output
    first = out.read_bytes()
    assert "Note" not in done.output
    assert isinstance(export(model, "--to", language, "-o", out).exception, Exception)
    done = export(model, "--to", language, "-o", out, "--force", "--modular", "--name", "line")
    assert "12 states in 2 tables" in done.output
    assert out.read_bytes() != first
    assert export(model, "--to", language, "-o", out, "--force").exit_code == 0
    assert out.read_bytes() == first


def test_command_says_what_is_not_promised(tmp_path: Path) -> None:
    done = export(CELL, "--to", "json", "-o", tmp_path / "cell.json", "--modular")
    assert "it may block: after n1 item" in done.output
    assert "leave out --modular" in done.output
    assert "something to choose" in done.output
    model = tmp_path / "line.json"
    model.write_text(write(Model(*map(tuple, line_of(12)))), encoding="utf-8")
    done = export(model, "--to", "c", "-o", tmp_path / "line.h", "--max-states", 500)
    assert "more than 500 states, so each has its own" in done.output
    assert "too many states to say" in done.output


def test_command_has_nothing_to_write(tmp_path: Path) -> None:
    never = from_text("name never \n events fault \n uncontrollable fault \n initial calm")
    model, out = tmp_path / "m.json", tmp_path / "m.h"
    model.write_text(write(Model((from_text("uncontrollable fault \n on -fault-> on"),), (never,))))
    done = export(model, "--to", "c", "-o", out)
    assert (done.exit_code, out.exists()) == (1, False)
    assert "cannot be kept" in done.output
    run = tmp_path / "run"
    run.mkdir()
    (run / "task.toml").write_text('[events]\ncontrollable = ["a"]\n')
    assert export(run, "--to", "json", "-o", tmp_path / "run.json").exit_code == 0
    assert read_controller(tmp_path / "run.json").name == "run"

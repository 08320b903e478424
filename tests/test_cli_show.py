"""`supremal show`, as a user meets it."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from supremal import from_text
from supremal.cli import main
from supremal.formats import Model, write_model

EXAMPLES = Path(__file__).parents[1] / "examples"
TASK = """
[events]
controllable = ["start", "repair"]
uncontrollable = ["finish", "breakdown"]

[[plant]]
name = "machine"
transitions = [
    ["idle", "start", "busy"], ["busy", "finish", "idle"],
    ["busy", "breakdown", "down"], ["down", "repair", "idle"],
]
marked = ["idle"]

[[rule]]
name = "two repairs"
pattern = "at_most"
of = "repair"
times = 2
"""


def show(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["show", *map(str, arguments)])


def said(result: Result) -> str:
    """Return what a user reads of a mistake, in one line."""
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    return " ".join(result.output.split())


@pytest.fixture
def task(tmp_path: Path) -> Path:
    path = tmp_path / "machine.toml"
    path.write_text(TASK, encoding="utf-8")
    return path


@pytest.fixture
def chain(tmp_path: Path) -> Path:
    path = tmp_path / "chain.json"
    chain = from_text("name chain\n" + "\n".join(f"q{k} -next-> q{k + 1}" for k in range(100)))
    write_model(path, Model((chain,), ()))
    return path


def test_the_parts_of_a_task_are_listed(task: Path) -> None:
    result = show(task)
    assert result.exit_code == 0
    lines = [line.split("  ") for line in result.output.splitlines()[1:]]
    assert [[word.strip() for word in line if word.strip()] for line in lines] == [
        ["machine", "plant"],
        ["two repairs", "rule"],
        ["supervisor", "supervisor"],
    ]


def test_a_part_is_told_as_a_table(task: Path) -> None:
    result = show(task, "--part", "machine")
    assert result.exit_code == 0
    assert "states: 3, 1 of them marked" in result.output
    assert "of which nobody controls finish, breakdown" in result.output
    rows = [line.split() for line in result.output.splitlines()]
    assert ["→", "idle", "*", "start", "busy"] in rows
    assert ["busy", "finish!", "→", "idle", "*"] in rows


def test_the_supervisor_of_a_task_is_made_and_told(task: Path) -> None:
    result = show(task, "--part", "supervisor")
    assert result.exit_code == 0
    assert "supervisor" in result.output
    assert "breakdown!" in result.output


def test_reward_machines_are_told_and_drawn(tmp_path: Path) -> None:
    result = show(EXAMPLES / "pickup_delivery.toml", "--part", "rewards")
    assert result.exit_code == 0
    assert "i1 & !i2 & !i3, -8" in result.output
    out = tmp_path / "rewards.dot"
    assert show(EXAMPLES / "pickup_delivery.toml", "--part", "rewards", "-o", out).exit_code == 0
    assert out.read_text(encoding="utf-8").startswith("digraph")
    around = show(EXAMPLES / "pickup_delivery.toml", "--part", "rewards", "--around", "u_0")
    assert "a reward machine is shown whole; leave --around out" in said(around)


@pytest.mark.parametrize(("ending", "start"), [("svg", b"<svg"), ("png", b"\x89PNG"), ("dot", b"digraph")])
def test_a_part_is_drawn(task: Path, ending: str, start: bytes) -> None:
    out = task.with_suffix(f".{ending}")
    result = show(task, "--part", "supervisor", "-o", out)
    assert (result.exit_code, result.output) == (0, f"Wrote {out}.\n")
    assert out.read_bytes().startswith(start)
    assert sorted(path.name for path in task.parent.iterdir()) == sorted([task.name, out.name])


def test_a_picture_of_the_supervisor_has_what_is_disabled(task: Path, tmp_path: Path) -> None:
    out = tmp_path / "supervisor.svg"
    assert show(task, "--part", "supervisor", "-o", out).exit_code == 0
    assert "(disabled)" in out.read_text(encoding="utf-8")


def test_a_model_of_one_part_needs_no_choice(chain: Path) -> None:
    result = show(chain, "--rows", 3)
    assert result.exit_code == 0
    assert "and 97 more: --rows 100 shows them all" in " ".join(result.output.split())


def test_of_what_is_large_a_part_is_drawn_and_said_so(chain: Path, tmp_path: Path) -> None:
    out = tmp_path / "part.svg"
    result = show(chain, "-o", out)
    assert result.exit_code == 0
    assert "101 states are too many to draw: this is what lies around the initial state" in result.output
    assert "of 101 states: those within" in out.read_text(encoding="utf-8")
    result = show(chain, "-o", out, "--force", "--around", "q50")
    assert result.output == f"Wrote {out}.\n"
    assert "steps of q50" in out.read_text(encoding="utf-8")
    assert "steps of q50" in show(chain, "--around", "50").output  # no state is called so: its number
    whole = tmp_path / "whole.dot"
    assert show(chain, "-o", whole).output == f"Wrote {whole}.\n"  # Graphviz may draw it all
    assert "q100" in whole.read_text(encoding="utf-8")


def test_a_run_is_shown_by_its_task(task: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    run.mkdir()
    (run / "task.toml").write_bytes(task.read_bytes())
    assert show(run).output == show(task).output


def test_parts_of_the_same_name_are_told_apart(tmp_path: Path) -> None:
    path = tmp_path / "two.json"
    lamp = from_text("name lamp \n dark -on-> lit")
    write_model(path, Model((lamp, lamp), ()))
    names = [line.split()[0] for line in show(path).output.splitlines()[1:]]
    assert len(set(names)) == len(names) == 2
    assert all(show(path, "--part", name).exit_code == 0 for name in names)


def test_mistakes_say_what_would_be_right(task: Path, chain: Path, tmp_path: Path) -> None:
    assert "has no part 'machin'; did you mean 'machine'?" in said(show(task, "--part", "machin"))
    assert "has 3 parts; choose with --part: machine, two repairs" in said(
        show(task, "-o", tmp_path / "a.svg")
    )
    assert "is no picture; give it one of the endings" in said(show(chain, "-o", tmp_path / "a.gif"))
    assert "has no state 'q500'; did you mean" in said(show(chain, "--around", "q500"))
    assert "has no state 500; its states are 0 to 100" in said(show(chain, "--around", "500"))
    assert "cannot write" in said(show(chain, "-o", tmp_path / "nowhere" / "a.svg"))
    assert "folder without a task.toml" in said(show(tmp_path))
    assert "cannot read" in said(show(tmp_path / "nothing.json"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["chain.json", "machine.toml"]


def test_a_file_that_is_there_is_kept(chain: Path, tmp_path: Path) -> None:
    out = tmp_path / "kept.svg"
    out.write_text("mine", encoding="utf-8")
    assert "exists already" in said(show(chain, "-o", out))
    assert out.read_text(encoding="utf-8") == "mine"


def test_a_task_of_events_alone_has_nothing_to_show(tmp_path: Path) -> None:
    path = tmp_path / "nothing.toml"
    path.write_text('[events]\ncontrollable = ["a"]\n', encoding="utf-8")
    assert "has nothing to show: no plant, no rule, no reward machine" in said(show(path))

"""``supremal export``: a task's supervisor as JSON, Python, C or structured text, to run without supremal."""

from __future__ import annotations

from pathlib import Path
from secrets import token_hex
from typing import TYPE_CHECKING, Final

import click

from supremal.cli.check import NO

if TYPE_CHECKING:
    from supremal.deploy.controller import Controller

_ENDINGS: Final = {"json": ".json", "python": ".py", "c": ".h", "st": ".st"}
"""The languages, and what files in them are called."""


@click.command("export")
@click.argument("task", type=click.Path(path_type=Path))
@click.option("--to", "language", type=click.Choice(list(_ENDINGS)), required=True, help="The language.")
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    help="The file to write  [default: called as TASK, in this folder]",
)
@click.option("--name", help="What the supervisor is called  [default: as TASK]")
@click.option("--modular", is_flag=True, help="One table a rule, side by side, in place of one for all.")
@click.option(
    "--max-states",
    type=click.IntRange(min=1),
    default=100_000,
    show_default=True,
    help="The most states of one product; where all rules have more, there is one table a rule.",
)
@click.option("--force", is_flag=True, help="Replace the file if it is there.")
@click.pass_context
def export_command(
    ctx: click.Context,
    task: Path,
    language: str,
    out: Path | None,
    name: str | None,
    modular: bool,
    max_states: int,
    force: bool,
) -> None:
    """Write the supervisor of a task file, a model file or the folder of a run, to run without supremal.

    Exit code 0: written; 1: the rules cannot be kept, so there is nothing to write; 2: bad input or output.
    """
    from supremal.cli.models import read
    from supremal.deploy.build import make_controller
    from supremal.deploy.code import LANGUAGES
    from supremal.task.copy import TASK

    called = task.resolve().stem
    target = out or Path(f"{called}{_ENDINGS[language]}")
    _check_place(target, force=force)
    source = task / TASK if (task / TASK).is_file() else task
    subject = read([source], closed=False, must_act=False, max_states=max_states)
    controller = make_controller(
        subject.plants,
        subject.rules,
        name=name or called,
        nonblocking=subject.options.nonblocking,
        must_act=subject.options.must_act,
        modular=modular,
        max_states=max_states,
    )
    if controller.is_empty:
        click.echo("The rules cannot be kept: nothing is written. Ask supremal check for the reason.")
        ctx.exit(NO)
    _write(target, LANGUAGES[language](controller))
    click.echo(f"Wrote {target}: {_sizes(controller)}.")
    for note in _notes(controller, asked=modular, max_states=max_states):
        click.echo(f"Note: {note}", err=True)


def _check_place(path: Path, *, force: bool) -> None:
    from supremal.cli.models import OutputError

    if path.exists() and not force:
        message = f"{path} exists already; choose another file with --out, or replace it with --force"
        raise OutputError(message)


def _write(path: Path, text: str) -> None:
    """Write a file beside its place, and then move it there."""
    from supremal.cli.models import OutputError

    work = path.with_name(f".{path.name}.{token_hex(4)}")
    try:
        work.write_bytes(text.encode("utf-8", "surrogatepass"))
        work.replace(path)
    except OSError as error:
        message = f"cannot write {path}: {error.strerror}; choose another file with --out"
        raise OutputError(message) from None
    finally:
        work.unlink(missing_ok=True)


def _sizes(controller: Controller) -> str:
    tables, events = len(controller.components), len(controller.alphabet)
    side_by_side = f" in {tables} tables, side by side" if tables > 1 else ""
    tested = sum(len(vector.word) + 1 for vector in controller.vectors)
    return f"{controller.n_states:,} states{side_by_side}, {events} events; its self-test has {tested} steps"


def _notes(controller: Controller, *, asked: bool, max_states: int) -> list[str]:
    """Say what a controller of several tables does not promise."""
    notes = []
    if len(controller.components) > 1 and not asked:
        notes.append(
            f"one table for all rules would have more than {max_states:,} states, so each has its own."
        )
    nonblocking, must_act = controller.asked
    if nonblocking and controller.blocked_after is not None:
        notes.append(
            f"it keeps all rules, but it may block: after {' '.join(controller.blocked_after)} "
            "nothing marked can be reached any more."
        )
        if asked:
            notes.append("one table for all rules does not block: leave out --modular.")
    elif nonblocking and controller.nonblocking is None:
        notes.append("it keeps all rules, but may block: the tables together have too many states to say.")
    if must_act and controller.acts is None:
        notes.append(
            "that there is always something to choose is proved for one table only, and here it is not."
        )
    return notes

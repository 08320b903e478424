"""``supremal show``: a model as a table, or as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

if TYPE_CHECKING:
    from supremal.automata.automaton import Automaton
    from supremal.cli._parts import Part, Shown
    from supremal.decisions.reward_machine import RewardMachine

_LAYOUTS: Final = ("auto", "circle", "layered", "graphviz")


@click.command("show")
@click.argument("file", metavar="MODEL|TASK|RUN", type=click.Path(path_type=Path))
@click.option("--part", "name", metavar="NAME", help="What of it; left out, where there are several: a list.")
@click.option("-o", "--out", type=click.Path(path_type=Path), help="A picture to write: .svg, .png or .dot.")
@click.option("--around", metavar="STATE", help="Only what lies around a state, as far as 60 states allow.")
@click.option(
    "--layout", type=click.Choice(_LAYOUTS), default="auto", show_default=True, help="Of a picture."
)
@click.option("--rows", type=click.IntRange(min=1), default=40, show_default=True, help="Rows of the table.")
@click.option("--force", is_flag=True, help="Replace the file if it is there.")
def show_command(
    file: Path, name: str | None, out: Path | None, around: str | None, layout: str, rows: int, force: bool
) -> None:
    """Show a plant, a rule, a reward machine or the supervisor: as a table, or with -o as a picture.

    It reads a model file, a task file (.toml) or the folder of a run.  A picture has up to 60 states; of what
    is larger it is what lies around the initial state, or the one that is asked for.
    """
    from supremal.cli._parts import find_part, parts_of

    if out is not None:
        _check_place(out, force=force)
    parts = parts_of(file)
    part = find_part(parts, name, file)
    if part is not None and out is None:
        _tell(part.name, part.make(), around, rows)
    elif part is not None and out is not None:
        _draw(part, out, around, layout)
    elif out is None:
        _list(parts)
    else:
        from supremal.cli.models import InputError

        message = f"{file} has {len(parts)} parts; choose with --part: {', '.join(one.name for one in parts)}"
        raise InputError(message)


def _check_place(out: Path, *, force: bool) -> None:
    from supremal.cli.models import OutputError
    from supremal.show.pictures import ENDINGS

    if out.suffix.lower() not in ENDINGS:
        message = f"{out} is no picture; give it one of the endings {', '.join(ENDINGS)}"
        raise OutputError(message)
    if out.exists() and not force:
        message = f"{out} exists already; choose another file with --out, or replace it with --force"
        raise OutputError(message)


def _list(parts: list[Part]) -> None:
    """Print what there is to choose from."""
    click.secho("Choose one with --part:", bold=True)
    width = max(len(part.name) for part in parts)
    for part in parts:
        click.echo(f"  {part.name:{width}}  {part.kind}")


def _tell(name: str, model: Shown, around: str | None, most: int) -> None:
    """Print a model as a table."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from supremal.show.neighbourhood import neighbourhood
    from supremal.show.tables import facts_of, rows_of

    automaton = _table_of(model)
    console = Console()
    console.print(Text(name, style="bold"))
    for key, value in facts_of(automaton).items():
        console.print(Text(f"  {key}: {value}"))
    states = None
    if around is not None:
        near = neighbourhood(_drawn(automaton), _state(automaton, around))
        states = near.states.tolist()
        console.print(Text(f"  {near}"))
    rows = rows_of(automaton, states)
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for head in ("  from", "event" if not hasattr(automaton, "edges") else "guard, reward", "to"):
        table.add_column(head, overflow="fold")
    for row in rows[:most]:
        table.add_row(*(Text(cell) for cell in (f"  {row.source}", row.what, row.target)))
    if rows:
        console.print(table)
    if len(rows) > most:
        console.print(Text(f"  and {len(rows) - most:,} more: --rows {len(rows)} shows them all"))


def _table_of(model: Shown) -> Automaton | RewardMachine:
    """Return what a table shows of a model: of a supervisor the supervised behaviour."""
    from supremal.synthesis.supervisor import Supervisor

    return model.automaton if isinstance(model, Supervisor) else model


def _drawn(model: Automaton | RewardMachine) -> Automaton:
    """Return the automaton that has neighbourhoods.

    Raises
    ------
    InputError
        If it is a reward machine.
    """
    from supremal.automata.automaton import Automaton
    from supremal.cli.models import InputError

    if isinstance(model, Automaton):
        return model
    message = "a reward machine is shown whole; leave --around out"
    raise InputError(message)


def _state(model: Automaton | RewardMachine, said: str) -> int | str:
    """Return the state that is meant: by its name, or where none is called so by its number."""
    automaton = _drawn(model)
    return int(said) if said.isdecimal() and said not in automaton.state_names else said


def _draw(part: Part, out: Path, around: str | None, layout: str) -> None:
    """Write a picture, and say what of the model it has."""
    from supremal.automata.automaton import Automaton
    from supremal.cli.models import OutputError
    from supremal.show.diagram import MAX_STATES
    from supremal.show.pictures import save_picture
    from supremal.synthesis.supervisor import Supervisor

    model = part.make()
    seen, options = _table_of(model), dict[str, Any](title=part.name, layout=layout)
    if around is not None:
        options["around"] = _state(seen, around)
    elif isinstance(seen, Automaton) and seen.n_states > MAX_STATES and out.suffix.lower() != ".dot":
        options["around"] = 0
        said = f"{seen.n_states:,} states are too many to draw: this is what lies around the initial state"
        click.echo(f"Note: {said}; --around draws another part.", err=True)
    if isinstance(model, Supervisor):
        options["plant"] = part.plants()
    try:
        save_picture(out, model, **options)
    except OSError as error:
        message = f"cannot write {out}: {error.strerror}; choose another file with --out"
        raise OutputError(message) from None
    click.echo(f"Wrote {out}.")

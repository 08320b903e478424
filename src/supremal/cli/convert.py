"""``supremal convert``: from one model file to another."""

from __future__ import annotations

from pathlib import Path

import click

from supremal.errors import FormatError
from supremal.formats import FORMATS, Model, read_model, write_model
from supremal.formats.files import find_ending, find_losses


def _known() -> str:
    """Return the formats, as the help lists them."""
    width = max(map(len, FORMATS))
    return "\n".join(["\b", *(f"{ending:{width}}  {form.about}" for ending, form in FORMATS.items())])


@click.command(epilog=_known())
@click.argument("source", type=click.Path(exists=True, path_type=Path))
@click.argument("target", type=click.Path(path_type=Path))
@click.option("--from", "source_form", metavar="ENDING", help="The format of SOURCE  [default: its ending]")
@click.option("--to", "target_form", metavar="ENDING", help="The format of TARGET  [default: its ending]")
@click.option("--force", is_flag=True, help="Replace TARGET if it is there.")
def convert(
    source: Path, target: Path, source_form: str | None, target_form: str | None, force: bool
) -> None:
    """Write the model in SOURCE to TARGET, in the format that its ending stands for."""
    find_ending(str(target), target_form)
    if target.exists() and not force:
        message = "the file exists already; choose another name, or replace it with --force"
        raise FormatError(message, path=str(target))
    try:
        model = read_model(source, form=source_form)
        write_model(target, model, form=target_form)
    except OSError as error:
        message = error.strerror or str(error)
        raise FormatError(message, path=str(error.filename or target)) from None
    files = ", one automaton a file" if target.is_dir() else ""
    click.echo(f"Wrote {target}: {_sizes(model)}{files}.")
    losses = find_losses(str(target), model, target_form)
    if losses:
        click.echo(f"Note: {losses}.", err=True)


def _sizes(model: Model) -> str:
    parts = (*model.plants, *model.specs)
    counts = {
        "plant": len(model.plants),
        "spec": len(model.specs),
        "state": sum(part.n_states for part in parts),
        "transition": sum(part.n_transitions for part in parts),
    }
    return ", ".join(f"{number:,} {what}{'' if number == 1 else 's'}" for what, number in counts.items())

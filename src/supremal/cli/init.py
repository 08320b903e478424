"""``supremal init``: a task file to start from."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import click

from supremal.cli.models import OutputError


@click.command()
@click.argument("file", type=click.Path(path_type=Path), default="task.toml")
def init(file: Path) -> None:
    """Write a task file to start from: a small one that works, with comments on what else it can say.

    FILE is its name, task.toml if left out; without an ending, it gets .toml.
    """
    if not file.suffix:
        file = file.with_suffix(".toml")  # what tells a task from a model
    text = files("supremal.task").joinpath("starter.toml").read_text(encoding="utf-8")
    try:
        with file.open("x", encoding="utf-8", newline="\n") as stream:
            stream.write(text)
    except FileExistsError:
        message = f"{file} exists already; give another name: supremal init other.toml"
        raise OutputError(message) from None
    except OSError as error:
        message = f"cannot write {file}: {error.strerror}; give another name"
        raise OutputError(message) from None
    click.echo(f"Wrote {file}. Next: supremal rules {file}, and supremal check {file}")

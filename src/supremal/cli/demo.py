"""``supremal demo``: the paper's experiment, end to end."""

from __future__ import annotations

from importlib.resources import as_file, files
from typing import Any, Final

import click

from supremal.cli.run import Wishes, perform, run_options

_TASKS: Final = {"default": "pickup_delivery.toml", "published": "pickup_delivery_published.toml"}


@click.command()
@click.option("--preset", type=click.Choice(tuple(_TASKS)), default="default", show_default=True,
              help="The paper's text, or the program that drew its curves.")  # fmt: skip
@run_options
@click.pass_context
def demo(ctx: click.Context, /, preset: str, **wishes: Any) -> None:  # noqa: ANN401 - the options of a run
    """Run the paper's experiment: `supremal run` on one of the task files that come with supremal."""
    with as_file(files("supremal").joinpath("examples")) as folder:
        ctx.exit(perform(folder / _TASKS[preset], Wishes(**wishes)))

"""``supremal demo``: the paper's experiment, end to end."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Final

import click
from rich.console import Console

from supremal.cli.progress import Reporter
from supremal.cli.text import describe
from supremal.show.figures import check_figures
from supremal.task.experiment import run
from supremal.task.folder import new_folder
from supremal.task.publish import publish
from supremal.task.summary import summary
from supremal.task.task import PRESETS, Preset, pickup_delivery

STOPPED: Final = 130
"""The exit code after Ctrl-C."""


@click.command()
@click.option("--preset", type=click.Choice(PRESETS), default="default", show_default=True,
              help="The paper's text, or the program that drew its curves.")  # fmt: skip
@click.option("--episodes", type=click.IntRange(min=1), help="Episodes of each learner  [default: 500000]")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The first seed.")
@click.option("--seeds", type=click.IntRange(min=1), default=1, show_default=True,
              help="How many seeds, counted up from the first.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), help="The folder to write  [default: runs/<id>]")
@click.option("--json", "as_json", is_flag=True, help="Print what result.json holds, and nothing else.")
@click.pass_context
def demo(
    ctx: click.Context,
    preset: Preset,
    episodes: int | None,
    seed: int,
    seeds: int,
    out: Path | None,
    as_json: bool,
) -> None:
    """Run the paper's experiment: check, supervise, train, evaluate, report."""
    check_figures()
    console = Console(quiet=as_json)
    task = pickup_delivery(preset)
    if episodes is not None:
        task = replace(task, settings=replace(task.settings, episodes=episodes))
    stamp = f"{datetime.now().astimezone():%Y%m%d-%H%M%S}"
    folder = out or Path("runs") / f"{task.name}-{preset}-{seed}-{stamp}"
    with new_folder(folder) as work, Reporter(console, task.settings.episodes, quiet=as_json) as reporter:
        experiment = run(
            task, range(seed, seed + seeds), on_stage=reporter.stage, on_episodes=reporter.progress
        )
        reporter.stage("writing the report")
        result = summary(experiment)
        publish(work, experiment, result)
    if as_json:
        click.echo(json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False))
    else:
        describe(console, result, folder)
    if experiment.partial:
        ctx.exit(STOPPED)

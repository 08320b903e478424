"""``supremal run``: check a task, supervise, train, evaluate, report."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, Final, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

STOPPED: Final = 130
"""The exit code after Ctrl-C."""


def run_options(command: Command) -> Command:
    """Add what `run` and `demo` ask alike; what is left out is as the task file says."""
    for option in (
        click.option(
            "--json", "as_json", is_flag=True, help="Print what result.json holds, and nothing else."
        ),
        click.option(
            "--out", type=click.Path(path_type=Path), help="The folder to write  [default: runs/<id>]"
        ),
        click.option(
            "--seeds", type=click.IntRange(min=1), help="How many seeds, counted up from the first."
        ),
        click.option("--seed", type=click.IntRange(min=0), help="The first seed."),
        click.option("--episodes", type=click.IntRange(min=1), help="Episodes of each learner."),
    ):
        command = option(command)
    return command


@click.command("run")
@click.argument("task", type=click.Path(path_type=Path))
@run_options
@click.pass_context
def run_command(
    ctx: click.Context,
    task: Path,
    episodes: int | None,
    seed: int | None,
    seeds: int | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Check the rules of a task file, train under their supervisor, evaluate exactly, and write a report.

    Exit code 0: done, no rule was broken; 1: the rules cannot be kept, so nothing is trained; 2: bad input.
    """
    ctx.exit(perform(task, episodes=episodes, seed=seed, seeds=seeds, out=out, as_json=as_json))


def perform(
    path: Path, *, episodes: int | None, seed: int | None, seeds: int | None, out: Path | None, as_json: bool
) -> int:
    """Run the task in a file, tell what came out, and return the exit code."""
    from rich.console import Console

    from supremal.cli.check import NO, tell
    from supremal.cli.progress import Reporter
    from supremal.cli.text import describe
    from supremal.show.figures import check_figures
    from supremal.task.experiment import check, run
    from supremal.task.findings import document
    from supremal.task.folder import new_folder
    from supremal.task.publish import publish
    from supremal.task.reading import read_task
    from supremal.task.summary import summary

    check_figures()
    console = Console(quiet=as_json)
    task = read_task(path)
    settings = replace(task.settings, episodes=episodes or task.settings.episodes)
    first = task.seed if seed is None else seed
    task = replace(task, settings=settings, seed=first, seeds=seeds or task.seeds)
    stamp = f"{datetime.now().astimezone():%Y%m%d-%H%M%S}"
    folder = out or task.out or Path("runs") / f"{task.name}-{task.seed}-{stamp}"
    with Reporter(console, settings.episodes, quiet=as_json) as reporter:
        reporter.stage("checking the rules")
        findings = check(task)
        if findings.verdict == "not_enforceable":
            if as_json:
                click.echo(json.dumps({"check": document(findings)}, indent=2, ensure_ascii=False))
            else:
                tell(findings)
            return NO
        with new_folder(folder) as work:
            experiment = run(task, findings, on_stage=reporter.stage, on_episodes=reporter.progress)
            reporter.stage("writing the report")
            result = summary(experiment)
            publish(work, experiment, result)
    if as_json:
        click.echo(json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False))
    else:
        describe(console, result, folder)
    return STOPPED if experiment.partial else 0

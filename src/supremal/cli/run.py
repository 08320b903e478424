"""``supremal run``: check a task, supervise, train, evaluate, report."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click

if TYPE_CHECKING:
    from supremal.task.task import Task

Command = TypeVar("Command", bound=Callable[..., Any])

STOPPED: Final = 130
"""The exit code after Ctrl-C."""

_POINTS: Final = 50
"""The points of a curve where there are fewer episodes than an interval has."""


def run_options(command: Command) -> Command:
    """Add what `run` and `demo` ask alike; what is left out is as the task file says."""
    folder, count = click.Path(path_type=Path), click.IntRange(min=1)
    every = click.FloatRange(min=0, min_open=True)
    logs = click.Choice(("csv", "tensorboard"))
    for option in (
        click.option(
            "--json", "as_json", is_flag=True, help="Print what result.json holds, and nothing else."
        ),
        click.option("--log", "logs", type=logs, multiple=True, help="Write the curves for other tools too."),
        click.option("--resume", type=folder, help="Go on with the run in this folder: stopped or killed."),
        click.option(
            "--checkpoint", type=every, default=30, show_default=True, help="Seconds between two checkpoints."
        ),
        click.option("--out", type=folder, help="The folder to write  [default: runs/<id>]"),
        click.option("--seeds", type=count, help="How many seeds, counted up from the first."),
        click.option("--seed", type=click.IntRange(min=0), help="The first seed."),
        click.option("--episodes", type=count, help="Episodes of each learner."),
    ):
        command = option(command)
    return command


@dataclass(frozen=True, slots=True)
class Wishes:
    """What the command line asks of a run."""

    episodes: int | None
    seed: int | None
    seeds: int | None
    out: Path | None
    as_json: bool
    checkpoint: float
    resume: Path | None
    logs: tuple[str, ...]


@click.command("run")
@click.argument("task", type=click.Path(path_type=Path))
@run_options
@click.pass_context
def run_command(ctx: click.Context, /, task: Path, **wishes: Any) -> None:  # noqa: ANN401 - the options
    """Check the rules of a task file, train under their supervisor, evaluate exactly, and write a report.

    Exit code 0: done, no rule was broken; 1: the rules cannot be kept, so nothing is trained; 2: bad input.
    """
    ctx.exit(perform(task, Wishes(**wishes)))


def perform(path: Path, wishes: Wishes) -> int:
    """Run the task in a file, tell what came out, and return the exit code."""
    from rich.console import Console

    from supremal.cli.check import NO, tell
    from supremal.cli.progress import Reporter
    from supremal.cli.text import describe
    from supremal.show.figures import check_figures
    from supremal.task.experiment import check, run
    from supremal.task.findings import document
    from supremal.task.folder import run_folder, write_config
    from supremal.task.keeper import Keeper
    from supremal.task.publish import publish, write_logs
    from supremal.task.summary import summary

    check_figures()
    as_json, console = wishes.as_json, Console(quiet=wishes.as_json)
    task, folder = _asked(path, wishes)
    with Reporter(console, task.settings.episodes, quiet=as_json) as reporter:
        reporter.stage("checking the rules")
        findings = check(task)
        if findings.verdict == "not_enforceable":
            if as_json:
                click.echo(json.dumps({"check": document(findings)}, indent=2, ensure_ascii=False))
            else:
                tell(findings)
            return NO
        with run_folder(folder, resume=wishes.resume is not None) as work:
            write_config(work, task)
            keeper = Keeper(work, timedelta(seconds=wishes.checkpoint))
            experiment = run(
                task, findings, keeper=keeper, on_stage=reporter.stage, on_episodes=reporter.progress
            )
            reporter.stage("writing the report")
            result = summary(experiment)
            publish(work, experiment, result)
            write_logs(work, experiment, wishes.logs)
            if not experiment.partial:
                keeper.clear()
    if as_json:
        click.echo(json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False))
    else:
        describe(console, result, folder)
    return STOPPED if experiment.partial else 0


def _asked(path: Path, wishes: Wishes) -> tuple[Task, Path]:
    """Return the task as the command line changes it, and the folder of the run."""
    from supremal.task.folder import final_place, read_config
    from supremal.task.reading import read_task

    task = read_task(path)
    before = read_config(final_place(wishes.resume)) if wishes.resume else {}

    def asked(wish: int | None, key: str, left_out: int) -> int:
        kept = before.get(key)
        return wish if wish is not None else kept if isinstance(kept, int) else left_out

    settings = before.get("settings")
    learned = settings.get("episodes") if isinstance(settings, dict) else None
    episodes = wishes.episodes or (learned if isinstance(learned, int) else task.settings.episodes)
    interval = asked(None, "interval", task.interval)
    task = replace(
        task,
        settings=replace(task.settings, episodes=episodes),
        seed=asked(wishes.seed, "seed", task.seed),
        seeds=asked(wishes.seeds, "seeds", task.seeds),
        interval=interval if interval <= episodes else max(1, episodes // _POINTS),
    )
    if wishes.resume is not None:
        return task, final_place(wishes.resume)
    stamp = f"{datetime.now().astimezone():%Y%m%d-%H%M%S}"
    return task, wishes.out or task.out or Path("runs") / f"{task.name}-{task.seed}-{stamp}"

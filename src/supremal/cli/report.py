"""``supremal report``: the page of a run, or of a task that nothing was learned of, made again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from supremal.errors import FormatError, MDPError

if TYPE_CHECKING:
    from supremal.task.findings import Findings
    from supremal.task.task import Task


@click.command("report")
@click.argument("source", metavar="RUN|TASK", type=click.Path(path_type=Path))
@click.option("--out", "-o", type=click.Path(path_type=Path), help="The file  [default: RUN/report.html]")
@click.option("--seed", type=click.IntRange(min=0), help="The seed of the first episode that is played.")
@click.option("--episodes", type=click.IntRange(min=1, max=50), default=3, show_default=True,
              help="How many episodes are played, their seeds counted up.")  # fmt: skip
def report_command(source: Path, out: Path | None, seed: int | None, episodes: int) -> None:
    """Write the report of the run in folder RUN again, or that of a TASK file (.toml) as it stands.

    The report of a run takes its numbers from result.json and its policy from learned.npz; the report of a
    task says whether its rules can be kept, what is given up, and plays what is allowed.
    """
    from supremal.task.page import page_of

    learned = source.is_dir()
    place = out or (source / "report.html" if learned else source.with_suffix(".html"))
    if not learned and out is None and place.exists():
        message = "the file exists already; name the one to write with --out"
        raise FormatError(message, path=str(place))
    task, findings, result, policy = _run(source) if learned else _task(source)
    first = seed if seed is not None else int(result.get("seed", task.seed))
    try:
        page = page_of(task, findings, result, policy, seed=first, episodes=episodes)
    except MDPError as error:
        raise FormatError(str(error), path=str(source / "learned.npz" if learned else source)) from None
    _write(place, page)
    click.echo(f"Written to {place}.")


def _run(folder: Path) -> tuple[Task, Findings, dict[str, Any], Any]:
    """Return what the folder of a run says: its task, what the check finds, its numbers and its policy."""
    from supremal.cli.certify import read_policy
    from supremal.task.experiment import check
    from supremal.task.reading import read_task

    result = _read_result(folder / "result.json")
    task = read_task(folder / "task.toml")
    return task, check(task), result, read_policy(folder / "learned.npz", None)


def _task(path: Path) -> tuple[Task, Findings, dict[str, Any], None]:
    """Return what a task file says, and what the check finds."""
    from supremal.task.findings import plants_of, study
    from supremal.task.page import checked
    from supremal.task.reading import read_task

    task = read_task(path)
    rules = tuple(rule.automaton for rule in task.rules)
    findings = study(plants_of(task), rules, task.options)
    return task, findings, checked(task, findings), None


def _read_result(path: Path) -> dict[str, Any]:
    """Return what ``result.json`` holds."""
    wanted = {
        "supremal",
        "settings",
        "check",
        "training",
        "baseline",
        "greedy",
        "optimal",
        "over_seeds",
        "seeds",
    }
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        message = f"cannot read it: {error.strerror}; the folder of a finished run is needed"
        raise FormatError(message, path=str(path)) from None
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict) or not wanted <= found.keys():
        message = "it is no result of a run; what `supremal run` has written is needed"
        raise FormatError(message, path=str(path))
    return found


def _write(place: Path, page: str) -> None:
    """Write the page beside its place and move it there, so that nobody finds half of one."""
    beside = place.with_name(place.name + ".partial")
    try:
        beside.write_text(page, encoding="utf-8")
        beside.replace(place)
    except OSError as error:
        message = f"cannot write it: {error.strerror}; choose another file with --out"
        raise FormatError(message, path=str(place)) from None

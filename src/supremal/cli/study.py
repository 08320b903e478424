"""``supremal study``: a grid or a random search over the settings of a task, with several seeds each."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from supremal.cli.check import NO
from supremal.cli.run import STOPPED

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from supremal.studies.ranking import Place
    from supremal.studies.results import Results
    from supremal.studies.study import Study


@click.command("study")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--out", "-o", type=click.Path(path_type=Path), help="The Parquet file  [default: runs/<name>.parquet]"
)
@click.option("--jobs", type=click.IntRange(min=0), is_flag=False, flag_value=0, default=1, metavar="[N]",
              help="How many to learn at a time; without N one a core  [default: 1]")  # fmt: skip
@click.option("--ray", "address", metavar="ADDRESS", help="Run on a Ray cluster: local, auto, or host:port.")
@click.option("--halving", is_flag=True, help="With --ray: give poor settings fewer seeds.")
@click.option(
    "--rows", type=click.IntRange(min=1), default=10, show_default=True, help="How many settings to show."
)
@click.option("--json", "as_json", is_flag=True, help="Print the best settings as JSON, and nothing else.")
@click.pass_context
def study_command(
    ctx: click.Context,
    study: Path,
    out: Path | None,
    jobs: int,
    address: str | None,
    halving: bool,
    rows: int,
    as_json: bool,
) -> None:
    """Learn a task with many settings and seeds, and say which settings are best.

    Every result is written to one Parquet file as it comes; after Ctrl-C, or after it was killed, the same
    command goes on.  Exit code 0: done; 1: the rules cannot be kept in any setting; 2: bad input.
    """
    from rich.console import Console

    from supremal.studies.ranking import rank
    from supremal.studies.reading import read_study
    from supremal.studies.results import Results

    if halving and address is None:
        message = "--halving is Ray Tune's; say where to run it with --ray, for example --ray local"
        raise click.UsageError(message)
    asked = read_study(study)
    results = Results(out or Path("runs") / f"{asked.name}.parquet", asked)
    console = Console(quiet=as_json)
    finished = _run(console, results, jobs, address, halving=halving)
    places = rank(results, rows)
    if as_json:
        click.echo(json.dumps(_document(results, places), indent=2, allow_nan=False, default=str))
    else:
        _tell(console, results, places, finished=finished)
    there = [results.rows[cell] for cell in asked.cells if cell in results.rows]
    if not finished:
        ctx.exit(STOPPED)
    if all(row.verdict == "not_enforceable" for row in there):
        ctx.exit(NO)


def _run(console: Console, results: Results, jobs: int, address: str | None, *, halving: bool) -> bool:
    """Run what is missing, with a bar on a terminal; return whether it came to an end."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    from supremal.studies.cluster import run_on_cluster
    from supremal.studies.running import run_study

    count, total = len(results.missing), len(results.study.cells)
    if not count:
        return True
    console.print(f"{count:,} of {total:,} results to come ...", style="dim", highlight=False)
    hidden = console.quiet or not console.is_terminal
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=hidden) as bar:
        task = bar.add_task("", total=count)
        if address is None:
            return run_study(results, jobs=jobs or os.cpu_count() or 1, on_row=lambda _: bar.advance(task))
        return run_on_cluster(results, address, halving=halving, on_row=lambda _: bar.advance(task))


def _document(results: Results, places: list[Place]) -> dict[str, Any]:
    study = results.study
    return {
        "study": study.name,
        "task": study.task,
        "file": str(results.path),
        "settings": len(study.settings),
        "seeds": list(study.seeds),
        "missing": len(results.missing),
        "metric": study.metric,
        "best": [
            {
                "setting": place.setting,
                "values": study.settings[place.setting].values,
                "mean": place.mean,
                "low": place.low,
                "high": place.high,
            }
            for place in places
        ],
    }


def _tell(console: Console, results: Results, places: list[Place], *, finished: bool) -> None:
    study, missing = results.study, len(results.missing)
    console.print(_table(results, places))
    if not finished:
        console.print(f"Stopped; {missing:,} results are missing. The same command goes on.", style="bold")
    elif missing:
        console.print(f"{missing:,} results were left out: poor settings got fewer seeds.")
    console.print(
        f"{len(study.settings):,} settings, {len(study.seeds):,} seeds each. Written to {results.path}",
        soft_wrap=True,
        highlight=False,
    )


def _table(results: Results, places: list[Place]) -> Table:
    """Return the best settings, with what varies in them."""
    from rich.table import Table

    study = results.study
    table = Table(box=None, pad_edge=False, header_style="dim")
    names = _short(key for key in study.settings[0].values if _varies(study, key))
    for name in ("setting", *names.values(), study.metric, "95 %"):
        table.add_column(name, justify="right")
    for place in places:
        values = study.settings[place.setting].values
        if place.mean is None:
            numbers = ("–", "")
        else:
            numbers = (f"{place.mean:.6g}", f"{place.low:.6g} to {place.high:.6g}")
        table.add_row(str(place.setting), *(str(values[key]) for key in names), *numbers)
    return table


def _varies(study: Study, key: str) -> bool:
    return any(setting.values[key] != study.settings[0].values[key] for setting in study.settings)


def _short(keys: Iterable[str]) -> dict[str, str]:
    """Return what a table calls each key: its last part, where no other ends so."""
    last = {key: key.rpartition(".")[2] for key in keys}
    count = Counter(last.values())
    return {key: name if count[name] == 1 else key for key, name in last.items()}

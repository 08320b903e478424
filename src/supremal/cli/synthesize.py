"""``supremal synthesize``: the closest behaviour that can be kept, what it gives up, and why."""

from __future__ import annotations

import json
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from supremal.cli.check import NO, model_options, tell

if TYPE_CHECKING:
    from supremal.synthesis.explain import Disabled
    from supremal.synthesis.given_up import GivenUp
    from supremal.task.findings import Findings


@click.command("synthesize")
@model_options
@click.option(
    "--rows", type=click.IntRange(min=0), default=10, show_default=True, help="Disabled events to explain."
)
@click.option("--all", "every", is_flag=True, help="Explain all disabled events.")
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), help="The model file to write the supervisor to."
)
@click.option("--force", is_flag=True, help="Replace that file if it is there.")
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON, and nothing else.")
@click.pass_context
def synthesize_command(
    ctx: click.Context,
    models: tuple[Path, ...],
    closed: bool,
    must_act: bool,
    max_states: int | None,
    rows: int,
    every: bool,
    out: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Build the least restrictive supervisor, and say what it gives up and why.

    A TASK is one file (.toml).  Several MODEL files are one model: all their plants, all their rules.  Exit
    code 0: there is a supervisor; 1: there is none, the rules cannot be kept; 2: bad input.
    """
    from supremal.cli.models import check_place, read, write
    from supremal.synthesis.explain import disabled_in
    from supremal.task.findings import document, study

    if out is not None:
        check_place(out, force=force)
    subject = read(models, closed=closed, must_act=must_act, max_states=max_states)
    findings = study(subject.plants, subject.rules, subject.options)
    disabled = disabled_in(findings.causes, findings.supervisor, findings.state)
    shown = len(disabled) if every else rows
    if as_json:
        said = document(findings) | {"disabled": _table(disabled, shown)}
        click.echo(json.dumps(said, indent=2, allow_nan=False, ensure_ascii=False))
    else:
        tell(findings, worst_case=subject.worst_case)
        _tell_lost(findings)
        _tell_disabled(disabled, shown)
    if out is not None and not findings.supervisor.is_empty:
        write(findings, out)
    if findings.supervisor.is_empty:
        ctx.exit(NO)


def _table(disabled: Disabled, shown: int) -> dict[str, Any]:
    from supremal.task.findings import reason_document

    return {
        "count": len(disabled),
        "events": [
            {"event": e, "disabled": no, "enabled": yes} for e, (no, yes) in disabled.counts().items()
        ],
        "reasons": [reason_document(reason) for reason in islice(disabled, shown)],
    }


def _tell_lost(findings: Findings) -> None:
    """Print what is given up."""
    if findings.given_up is None:
        click.echo("  given up: too many states to say; a larger --max-states may do")
    elif findings.given_up:
        all_of_it = "all that would satisfy the rules is " if findings.supervisor.is_empty else ""
        click.echo(f"  {all_of_it}given up, the shortest words first:")
        points: dict[tuple[str, ...], list[GivenUp]] = {}
        for lost in findings.given_up:
            points.setdefault(lost.word[: (lost.kept or 0) + 1], []).append(lost)
        for first, *others in points.values():
            click.echo(f"    {first}{f' (and {len(others)} like it)' if others else ''}")
    elif findings.verdict == "enforceable_in_part":
        click.echo("  given up: nothing but ways from which nothing marked can be reached")


def _tell_disabled(disabled: Disabled, shown: int) -> None:
    """Print how often each event is disabled, and why, the shortest words first."""
    if not len(disabled):
        return
    click.echo(f"  disabled events: {len(disabled):,}")
    for event, (no, yes) in disabled.counts().items():
        click.echo(f"    {event} in {no:,} of the {no + yes:,} states where it is possible")
    for reason in islice(disabled, shown):
        click.echo(f"    - {reason}")
    if len(disabled) > shown:
        click.echo(f"    and {len(disabled) - shown:,} more: --all explains all of them")

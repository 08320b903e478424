"""``supremal monitor``: what has happened, judged by the rules of a task."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from supremal.cli.check import NO

if TYPE_CHECKING:
    from supremal.task.judging import Bench, Judgement, Verdict
    from supremal.task.task import Task
    from supremal.task.traces import Trace

    Judged = tuple[Trace, Judgement]


@click.command("monitor")
@click.argument("task", metavar="TASK", type=click.Path(path_type=Path))
@click.argument("traces", metavar="TRACES", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print what was found as JSON, and nothing else.")
@click.pass_context
def monitor_command(ctx: click.Context, task: Path, traces: Path, as_json: bool) -> None:
    """Judge traces by the rules of a task file: kept, broken (where, and which rule), or pending at the end.

    TRACES has one trace a line: a JSON array of the names of events, or an object with such an array under
    "events" and, if it has a name, that under "id".  Where the task has plants, what its supervisor would
    have disabled is told too.

    Exit code 0: no rule was broken; 1: some was; 2: bad input.
    """
    from supremal.cli.models import InputError
    from supremal.task.judging import bench_of, judge
    from supremal.task.reading import read_task
    from supremal.task.traces import read_traces

    asked = read_task(task)
    try:
        read = list(read_traces(traces, asked.alphabet))
    except OSError as error:
        message = f"cannot read {traces}: {error.strerror}; give a file with one trace a line"
        raise InputError(message) from None
    bench = bench_of(asked)
    judged = [(trace, judge(bench, trace.word)) for trace in read]
    if as_json:
        click.echo(json.dumps(_document(asked, bench, judged), indent=2, ensure_ascii=False))
    else:
        for line in _text(asked, bench, judged):
            click.echo(line)
    if any(judgement.broken for _, judgement in judged):
        ctx.exit(NO)


# --- the document -----------------------------------------------------------------------------------------


def _document(task: Task, bench: Bench, judged: Iterable[Judged]) -> dict[str, Any]:
    return {
        "task": task.name,
        "supervised": bench.disabled is not None,
        "traces": [_trace(trace, judgement) for trace, judgement in judged],
    }


def _trace(trace: Trace, judgement: Judgement) -> dict[str, Any]:
    from dataclasses import asdict

    refused, unforeseen = judgement.refused, judgement.unforeseen
    return {
        "id": trace.name or None,
        "line": trace.line,
        "events": len(trace.word),
        "verdict": judgement.verdict,
        "broken": [asdict(broken) for broken in judgement.broken],
        "pending": list(judgement.pending),
        "disabled": refused
        and {"position": refused.position, "event": refused.event, "text": str(refused.reason)},
        "unforeseen": unforeseen and asdict(unforeseen),
    }


# --- the terminal -----------------------------------------------------------------------------------------


def _text(task: Task, bench: Bench, judged: list[Judged]) -> Iterator[str]:
    """Tell the traces one by one, then how many there are of each kind."""
    for trace, judgement in judged:
        yield click.style(f"{trace}: {judgement.verdict}", bold=True)
        yield from (f"  {line}" for line in _told(judgement))
    if bench.disabled is None:
        why = "states are not in a trace" if task.model == "environment" else "rules cannot be kept"
        yield f"No supervisor was asked: the task's {why}."
    counts: Counter[Verdict] = Counter(judgement.verdict for _, judgement in judged)
    said = ", ".join(f"{counts[verdict]:,} {verdict}" for verdict in ("kept", "broken", "pending"))
    yield f"{len(judged):,} trace{'' if len(judged) == 1 else 's'}: {said}"


def _told(judgement: Judgement) -> Iterator[str]:
    """Tell what there is to say about one trace, in the order in which it happened."""
    said = [
        (broken.position, f"{broken.event} breaks {broken.rule}" if broken.event else _never(broken.rule))
        for broken in judgement.broken
    ]
    if judgement.refused is not None:
        said.append((judgement.refused.position, str(judgement.refused.reason)))
    if judgement.unforeseen is not None:
        found = judgement.unforeseen
        said.append((found.position, f"{found.event} is not foreseen: {found.plant} cannot do it"))
    yield from (f"event {position}: {text}" for position, text in sorted(said))
    yield from (f"at the end: {rule} is not satisfied yet" for rule in judgement.pending)


def _never(rule: str) -> str:
    return f"no word at all satisfies {rule}"

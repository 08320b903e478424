"""``supremal check``: whether the rules of a model can be kept as they stand."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click

if TYPE_CHECKING:
    from supremal.automata.automaton import Automaton
    from supremal.task.findings import Findings, Question

Command = TypeVar("Command", bound=Callable[..., Any])

NO: Final = 1
"""The exit code of an answer that is no."""

VERDICTS: Final = {
    "enforceable": "The rules can be kept as they stand.",
    "enforceable_in_part": "The rules can be kept in part: a supervisor has to forbid more than they do.",
    "not_enforceable": "The rules cannot be kept.",
}
"""What each verdict says."""
_ANSWERS: Final = (
    ("controllable", "not controllable"),
    ("nonblocking", "blocking"),
    ("one can always act", "one can get stuck"),
)


def model_options(command: Command) -> Command:
    """Add what `check` and `synthesize` ask alike: the model, and how it is to be read."""
    closed = "Leave the marked states out of it: nothing has to be completed."
    must_act = "Where an event can be chosen, one has to be: no resting for ever."
    max_states = "The most states of the product  [default: what fits]"
    for option in (
        click.option("--max-states", type=click.IntRange(min=1), help=max_states),
        click.option("--must-act", is_flag=True, help=must_act),
        click.option("--closed", is_flag=True, help=closed),
        click.argument(
            "models", metavar="TASK|MODEL...", nargs=-1, required=True, type=click.Path(path_type=Path)
        ),
    ):
        command = option(command)
    return command


@click.command()
@model_options
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON, and nothing else.")
@click.pass_context
def check(
    ctx: click.Context,
    models: tuple[Path, ...],
    closed: bool,
    must_act: bool,
    max_states: int | None,
    as_json: bool,
) -> None:
    """Check whether rules can be kept as they stand, and if not, show the shortest word.

    A TASK is one file (.toml).  Several MODEL files are one model: all their plants, all their rules.  Exit
    code 0: they can; 1: they cannot, or only in part; 2: bad input.
    """
    from supremal.cli.models import read
    from supremal.task.findings import document, study

    subject = read(models, closed=closed, must_act=must_act, max_states=max_states)
    findings = study(subject.plants, subject.rules, subject.options, lost=as_json)
    if as_json:
        click.echo(json.dumps(document(findings), indent=2, allow_nan=False, ensure_ascii=False))
    else:
        tell(findings, worst_case=subject.worst_case)
    if findings.verdict != "enforceable":
        ctx.exit(NO)


def tell(findings: Findings, *, worst_case: bool = False) -> None:
    """Print the verdict, and what holds for each rule and for all of them together."""
    supervisor = findings.supervisor.automaton
    click.secho(VERDICTS[findings.verdict], bold=True)
    if worst_case:
        click.echo("  This holds whatever happens: no plant is given, so any event may come at any time.")
    for plant in findings.plants:
        click.echo(f"  plant {plant.name}: {_states(plant)}")
    for rule, (controllable, nonblocking) in zip(findings.rules, findings.each, strict=True):
        _answer(f"rule {rule.name}: {_states(rule)}", controllable, nonblocking)
    _answer("all together:", findings.controllable, findings.nonblocking, findings.can_act)
    if findings.guilty is not None:
        click.echo(f"  {findings.guilty}")
    if findings.reason:
        click.echo(f"  {findings.reason}")
    else:
        click.echo(f"  supervisor: {_states(supervisor)}, {supervisor.n_transitions:,} transitions")


def _states(automaton: Automaton) -> str:
    count = automaton.n_states
    return "1 state" if count == 1 else f"{count:,} states"


def _answer(what: str, *questions: Question) -> None:
    """Print the answers that were found, then the witness of each that is no."""
    known = [
        (yes if question.holds else no, question.witness)
        for question, (yes, no) in zip(questions, _ANSWERS, strict=False)
        if question.holds is not None
    ]
    said = ", ".join(word for word, _ in known) or "too many states to say"
    click.echo(f"  {what}{' ' if what.endswith(':') else ', '}{said}")
    for _, witness in known:
        if witness is not None:
            click.echo(f"    {witness}")

"""``supremal rules``: what each rule of a task says, with examples, and what is worth a second look."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from supremal.cli.check import NO

if TYPE_CHECKING:
    from supremal.automata.alphabet import Alphabet
    from supremal.automata.automaton import Automaton
    from supremal.rules.rule import Rule
    from supremal.task.task import Task

_PRODUCT: Final = 1_000_000
"""The most states of a product that a question may take, if the task does not say."""

_STATES: Final = 20
"""States that are told on the terminal; ``--json`` has all."""

_EVENTS: Final = 20
"""Events of a word that are told."""

_FEW: Final = 3
"""So many events are named, even where most events do the same."""


@click.command()
@click.argument("task", metavar="TASK", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print what was found as JSON, and nothing else.")
@click.pass_context
def rules(ctx: click.Context, task: Path, as_json: bool) -> None:
    """Say what each rule of a task file means, with examples, and what is worth a second look.

    Exit code 0: no contradiction was found; 1: the rules contradict each other, or what can happen; 2: bad
    input.
    """
    from supremal.task.reading import read_task

    read = read_task(task)
    said = document(read)
    if as_json:
        click.echo(json.dumps(said, indent=2, allow_nan=False, ensure_ascii=False))
    else:
        for line in text(read, said):
            click.echo(line)
    if any(finding["kind"] == "contradiction" for finding in said["findings"]):
        ctx.exit(NO)


# --- the document -----------------------------------------------------------------------------------------


def document(task: Task) -> dict[str, Any]:
    """Return what there is to say about the rules of a task, ready for JSON."""
    from dataclasses import asdict

    from supremal.rules.lint import lint
    from supremal.task.findings import plants_of

    findings = lint(
        task.rules,
        plants_of(task),
        nonblocking=task.options.nonblocking,
        max_states=task.options.max_states or _PRODUCT,
    )
    return {
        "task": task.name,
        "rules": [_rule(rule) for rule in task.rules],
        "findings": [asdict(finding) for finding in findings],
    }


def _rule(rule: Rule) -> dict[str, Any]:
    """Return what one rule says; its automaton is laid out as in a model file."""
    from dataclasses import replace

    from supremal.formats.documents import write
    from supremal.formats.model import Model
    from supremal.rules.about import classify, example_words

    automaton, words = replace(rule.automaton, name=rule.name), example_words(rule.automaton)
    return {
        "name": rule.name,
        "form": rule.form,
        "text": rule.text,
        "sentence": rule.sentence,
        "class": classify(automaton),
        "states": automaton.n_states,
        "transitions": automaton.n_transitions,
        "accepted": [list(word) for word in words.accepted],
        "rejected": [list(word) for word in words.rejected],
        "automaton": json.loads(write(Model((automaton,), ())))["plants"][0],
    }


# --- the terminal -----------------------------------------------------------------------------------------


def text(task: Task, said: dict[str, Any]) -> Iterator[str]:
    """Tell the rules of a task, and what was ``said`` about them, line by line."""
    for rule, about in zip(task.rules, said["rules"], strict=True):
        yield click.style(f"rule {rule.name}", bold=True)
        yield from (f"  {line}" for line in _told(rule, about))
        yield from (f"    {line}" for line in _ways(rule.automaton, task.alphabet))
    yield click.style("worth a second look:" if said["findings"] else "nothing odd was found", bold=True)
    for finding in said["findings"]:
        yield f"  - {finding['text']}"


def _told(rule: Rule, about: dict[str, Any]) -> Iterator[str]:
    """Tell a rule in words and examples."""
    from supremal.rules.about import MEANING

    if rule.sentence:
        yield rule.sentence
    yield f"{rule.form}: {rule.text}" if rule.text else f"given as {rule.form}"
    yield f"{about['class']}: {MEANING[about['class']]}"
    yield f"accepts {_spelled(about['accepted'])}"
    yield f"rejects {_spelled(about['rejected'])}"
    yield f"{_count(about['states'], 'state')}, {_count(about['transitions'], 'transition')}"


def _count(number: int, noun: str) -> str:
    return f"1 {noun}" if number == 1 else f"{number:,} {noun}s"


def _spelled(words: Sequence[Sequence[str]]) -> str:
    """Spell words, the empty one as ε, and of long ones the beginning."""
    spelled = [
        " ".join(word[:_EVENTS]) + (f" … ({len(word):,} events)" if len(word) > _EVENTS else "")
        for word in words
    ]
    return "; ".join(word or "ε" for word in spelled) or "no word"


def _ways(automaton: Automaton, alphabet: Alphabet) -> Iterator[str]:
    """Tell where the events of ``alphabet`` lead from each state; those that most events take come last."""
    from supremal.automata.compose import extend
    from supremal.rules.finding import listed

    wide = extend(automaton, alphabet, stand_still=True)
    for state, row in enumerate(wide.delta[:_STATES].tolist()):
        yield f"{wide.state_name(state)}{'' if wide.marked[state] else ' (not satisfied)'}"
        ways: dict[int, list[str]] = {}
        for event, target in zip(wide.alphabet, row, strict=True):
            ways.setdefault(target, []).append(event)
        most = max(ways, key=lambda target: (len(ways[target]), target == state), default=state)
        rest = ways.pop(most, []) if most == state or len(ways[most]) > _FEW else []
        for target, events in ways.items():
            yield f"  {listed(events, 'or')}{_leads(wide, state, target)}"
        if rest:
            yield f"  any {'other ' if ways else ''}event{_leads(wide, state, most)}"
    if wide.n_states > _STATES:
        yield f"and {wide.n_states - _STATES:,} more states: --json has all"


def _leads(automaton: Automaton, source: int, target: int) -> str:
    if target == source:
        return ": stays"
    return f" → {automaton.state_name(target)}" if target >= 0 else ": breaks the rule"

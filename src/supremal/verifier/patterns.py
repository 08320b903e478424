"""Patterns: a table of the expressions that they stand for, and three that are told step by step.

In an expression a word stands for the events of that argument, or for a number; ``sequence`` for its events,
one after another, and ``counting`` for those of its events that neither begin nor end the time.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from typing import Any, Final, TypeAlias

from .expressions import Expression, Terms
from .texts import NONE, Budget, Meaning, known, refuse

Events: TypeAlias = frozenset[str]
Step: TypeAlias = Callable[[int, str], int | None]

TEMPLATES: Final[dict[str, str]] = {
    "absence": "[^of]*",
    "exactly": "[^of]* (of [^of]*){times}",
    "at_most": "[^of]* (of [^of]*){0,times}",
    "at_least": "([^of]* of){times} .*",
    "first": "of .*",
    "last": ".* of",
    "responded_existence": "[^trigger]* | .* partner .*",
    "precedence": "[^cause effect]* (cause .*)?",
    "response": "[^trigger]* | .* reaction [^trigger]*",
    "succession": "([^trigger]* | .* reaction [^trigger]*) & [^trigger reaction]* (trigger .*)?",
    "alternate_precedence": "([^effect]* cause [^effect]* effect)* [^effect]*",
    "alternate_response": "[^trigger]* (trigger [^trigger]* reaction [^trigger]*)*",
    "alternate_succession": "([^trigger reaction] | trigger [^trigger reaction]* reaction)*",
    "chain_precedence": "([^effect] | cause effect)*",
    "chain_response": "([^trigger] | trigger reaction)*",
    "chain_succession": "([^trigger reaction] | trigger reaction)*",
    "not_coexistence": "[^one]* | [^other]*",
    "not_succession": "~(.* trigger .* forbidden .*)",
    "not_chain_succession": "~(.* trigger forbidden .*)",
    "between before": "[^closing]* | [^forbidden closing]* closing .*",
    "between after": "~(.* opening .* forbidden .*)",
    "between between": "~(.* opening [^closing]* forbidden [^closing]* closing .*)",
    "between until": "~(.* opening [^closing]* forbidden .*)",
    "priority": "~(.* request [^high]* low .*)",
    "never_sequence": "~(.* sequence .*)",
    "only_sequence": "([^trigger] | trigger sequence)*",
    "alternation": "([^one other] | one [^one other]* other)* (one [^one other]*)?",
    "within": "([^trigger] | trigger ([^reaction counting]* counting){0,limit} "
    "[^reaction counting]* reaction)*",
}


def wait_at_least(trigger: Events, delayed: Events, counting: Events, count: int) -> tuple[Step, int]:
    """Count, from each trigger on, how many events are still to be waited for."""

    def step(left: int, event: str) -> int | None:
        if event in trigger:
            return count
        return None if left and event in delayed else max(left - (event in counting), 0)

    return step, 0


def counter(
    up: Events, down: Events, maximum: int, minimum: int = 0, start: int | None = None
) -> tuple[Step, int]:
    """Keep the level, which stays between its ends."""
    first = minimum if start is None else start
    if not minimum <= first <= maximum:
        refuse("minimum <= start <= maximum is needed")

    def step(level: int, event: str) -> int | None:
        after = level + (event in up) - (event in down)
        return after if minimum <= after <= maximum else None

    return step, first


def mutex(enter: list[Events], leave: list[Events]) -> tuple[Step, int]:
    """Keep who is inside, `NONE` if nobody; nobody else may enter then."""
    pairs = list(zip(enter, leave, strict=True))

    def step(inside: int, event: str) -> int | None:
        if inside != NONE and event in pairs[inside][1]:
            return NONE
        entering = next((k for k, (enters, _) in enumerate(pairs) if event in enters), inside)
        return entering if inside in (NONE, entering) else None

    return step, NONE


WALKS: Final = {walk.__name__: walk for walk in (wait_at_least, counter, mutex)}


def pattern_meaning(text: str, sigma: Events, budget: Budget) -> Meaning:
    """Return which words over ``sigma`` the call of a pattern allows."""
    called, given = read_call(text)
    if called == "between":
        called = f"between {given.pop('scope', 'between')}"
    known(called, TEMPLATES.keys() | WALKS.keys())
    terms = Terms(budget)
    if given.get("start", 0) is None:
        del given["start"]
    arguments = {name: _argument(name, value, sigma) for name, value in given.items()}
    if "counting" in arguments:
        ends = [arguments[end] for end in ("trigger", "reaction", "delayed") if end in arguments]
        arguments["counting"] = arguments["counting"] - frozenset[str]().union(*ends)
    if called in WALKS:
        for value in arguments.values():
            for events in value if isinstance(value, list) else [value]:
                if isinstance(events, frozenset):
                    terms.set(events)  # so that its events are told apart
        return terms.meaning(terms.walk(*WALKS[called](**arguments)))
    template = TEMPLATES[called]
    names: dict[str, Events] = {}
    for name, value in arguments.items():
        if not re.search(rf"\b{name}\b", TEMPLATES[called]):
            refuse(f"{called.split()[0]} takes no {name}")
        meant = name
        if isinstance(value, list):
            steps = {f"{name}{i}": events for i, events in enumerate(value)}
            meant = " ".join(steps)
            names |= steps
        elif isinstance(value, int):
            meant = str(value)
        else:
            names[name] = value
        template = re.sub(rf"\b{name}\b", meant, template)
    return terms.meaning(Expression(template, terms, sigma, names).term)


def read_call(text: str) -> tuple[str, dict[str, Any]]:
    """Read a call with keyword arguments, such as ``response(trigger='a', reaction=['b', 'c'])``."""
    try:
        call = ast.parse(text, mode="eval").body
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and not call.args:
            return call.func.id, {str(one.arg): ast.literal_eval(one.value) for one in call.keywords}
    except (SyntaxError, ValueError, MemoryError):
        pass
    return refuse("a call of a pattern is needed, such as absence(of='a')")


def _argument(name: str, value: Any, sigma: Events) -> Any:  # noqa: ANN401 - arguments of all kinds
    """Return a number as it is, for names the set of them, and a list of sets where their order matters."""
    if type(value) is int and value >= 0:
        return value
    if name == "counting" and value == "all":
        return sigma
    names = [value] if isinstance(value, str) else value
    if isinstance(names, list) and name in ("sequence", "enter", "leave"):
        return [_argument("", one, sigma) for one in names]
    if not isinstance(names, list) or not names or not all(isinstance(one, str) for one in names):
        refuse(f"{value!r} is no event or list of events")
    return frozenset(known(one, sigma) for one in names)

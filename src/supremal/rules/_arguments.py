"""What the arguments of a pattern have to be; a `ValueError` says what is wrong with one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from inspect import Parameter as Inspected
from itertools import combinations
from typing import Annotated, Any, Final, Literal, TypeAlias

import numpy as np

from supremal.automata.alphabet import Alphabet
from supremal.errors import RuleError, suggest
from supremal.rules._derive import MAX_STATES

Kind = Literal["events", "sequence", "lists", "number", "choice", "counting"]
REQUIRED: Final = Inspected.empty
"""The default of a parameter that has none."""

MAX_LENGTH: Final = 1_000
"""The most events of a sequence, and the most processes."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """What one argument of a pattern has to be.

    Parameters
    ----------
    kind
        ``events``: one name or several, any of which is meant.  ``sequence``: up to 1,000 names in their
        order, any of them as often as you like.  ``lists``: up to 1,000 ``events``.  ``number``: a whole
        number from 0 to 10,000.  ``choice``: one of ``choices``.  ``counting``: "all", or ``events``.
    choices
        What can be chosen.
    default
        What it is where it is left out; `REQUIRED` where it cannot be.
    """

    kind: Kind
    choices: tuple[str, ...] = ()
    default: object = REQUIRED


Events: TypeAlias = Annotated[str | Iterable[str], Parameter("events")]
Word: TypeAlias = Annotated[str | Sequence[str], Parameter("sequence")]
Lists: TypeAlias = Annotated[Sequence[str | Iterable[str]], Parameter("lists")]
Number: TypeAlias = Annotated[int, Parameter("number")]
Counting: TypeAlias = Annotated[str | Iterable[str], Parameter("counting")]


def check_alphabet(alphabet: object) -> None:
    """Raise a `RuleError` unless this is an alphabet: what a rule is made over, however it is written."""
    if not isinstance(alphabet, Alphabet):
        message = f"alphabet is {alphabet!r:.60}; an Alphabet is needed: Alphabet([...])"
        raise RuleError(message)


def clean(known: Parameter, value: object, alphabet: Alphabet | None) -> object:
    """Return ``value`` as its kind has it, with events as tuples.

    Without an ``alphabet`` any name is that of an event.
    """
    match known.kind:
        case "events":
            return _set(value, alphabet)
        case "sequence":
            return _short(_names(value, alphabet))
        case "counting":
            return value if value == "all" else _set(value, alphabet, "all")
        case "lists":
            if isinstance(value, Iterable) and not isinstance(value, str):
                return _short(tuple(_set(names, alphabet) for names in value))
            right = "a list is needed, with an event or a list of events for each process"
        case "number":
            if (
                isinstance(value, int | np.integer)
                and not isinstance(value, bool)
                and 0 <= value <= MAX_STATES
            ):
                return int(value)
            right = f"a whole number from 0 to {MAX_STATES:,} is needed"
        case "choice":
            if value in known.choices:
                return value
            right = suggest(str(value), known.choices)
    message = f"is {value!r}; {right}"
    raise ValueError(message)


def _names(value: object, alphabet: Alphabet | None, *words: str) -> tuple[str, ...]:
    """Return the names of events; ``words`` would be right as well."""
    names: tuple[Any, ...] = (value,)
    if isinstance(value, Iterable) and not isinstance(value, str):
        names = tuple(value)
    if not names or not all(isinstance(name, str) for name in names):
        choices = ", ".join([*map(repr, words), "the name of an event"])
        message = f"is {value!r}; {choices}, or a list of names, is needed"
        raise ValueError(message)
    for name in names:
        if alphabet is not None and name not in alphabet:
            message = f"has the unknown event {name!r}; {suggest(name, [*words, *alphabet])}"
            raise ValueError(message)
    return names


def _set(value: object, alphabet: Alphabet | None, *words: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(_names(value, alphabet, *words)))


def _short(values: tuple[object, ...]) -> tuple[object, ...]:
    if not 0 < len(values) <= MAX_LENGTH:
        message = f"has the length {len(values):,}; 1 to {MAX_LENGTH:,} is needed"
        raise ValueError(message)
    return values


def check_apart(parameters: Mapping[str, Parameter], values: Mapping[str, Any]) -> None:
    """Check that no event stands in two arguments."""
    parts = [key for key, known in parameters.items() if known.kind in ("events", "sequence")]
    for one, other in combinations(parts, 2):
        shared = set(values[one]).intersection(values[other])
        if shared:
            message = f"{one} and {other} share the event {min(shared)!r}; take it out of one of them"
            raise ValueError(message)

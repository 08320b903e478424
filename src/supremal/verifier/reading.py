"""Reading a certificate: strict JSON, the shape of each part, what refers to what, and exact numbers."""

from __future__ import annotations

import hashlib
import json
import sys
from collections import Counter
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache
from typing import Any, Final, TypeAlias

from .texts import NONE

FORMAT: Final = "supremal certificate"
VERSION: Final = 1

_RULE: Final = {"name": str, "form": str, "text": str, "events": [str], "delta": [[int]], "marked": [int]}
_MACHINE: Final = {"states": [str], "propositions": [str], "edges": [(str, str, str, float)]}
_SHAPE: Final[dict[str, Any]] = {
    "format": str,
    "version": int,
    "made_by": str,
    "task": str,
    "events": [str],
    "uncontrollable": [str],
    "actions": [str],
    "propositions": [str],
    "words": [[str]],
    "gamma": float,
    "nonblocking": bool,
    "rules": [_RULE],
    "reward_machine": object,
    "initial": [(int, float)],
    "environment": [(bool, bool, int, [(int, [(float, int, float, int)])])],
    "states": [([int], [int], int, int, float, float)],
    "claims": {"value_at_least": float, "optimum_at_most": float, "gap_at_most": float, "words": [str]},
    "sha256": str,
}
_TYPES: Final = {int: "a whole number", str: "a text", bool: "true or false"}

Failure: TypeAlias = tuple[str, str]
"""Where something is false, and what is wrong and would be right."""


class UnreadableError(Exception):
    """What was read is no certificate; the message says where and what would be right."""


def read_document(text: str) -> object:
    """Return what a text in JSON holds; a key may stand only once in an object."""
    try:
        return json.loads(text, object_pairs_hook=_object)
    except ValueError as error:
        message = f"it is no JSON: {getattr(error, 'msg', error)}"
    except RecursionError:
        message = "it is no certificate: nested too deeply"
    raise UnreadableError(message)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        message = "a key stands twice in an object"
        raise ValueError(message)
    return found


def check_document(document: object) -> dict[str, Any]:
    """Return ``document`` if it is laid out as a certificate."""
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        message = f"it is no certificate; an object with format {FORMAT!r} is needed"
        raise UnreadableError(message)
    if document.get("version") != VERSION:
        message = f"version {document.get('version')!r} is not known; this program reads {VERSION}"
        raise UnreadableError(message)
    _check_shape(document, _SHAPE)
    if document["reward_machine"] is not None:
        _check_shape(document["reward_machine"], _MACHINE, "reward_machine")
    return document


def _check_shape(value: Any, shape: Any, *where: object) -> None:  # noqa: ANN401 - that is what is checked
    """Raise an `UnreadableError` where ``value`` is not laid out as ``shape``, which shows it by types."""
    parts: Iterable[tuple[Any, Any]] = ()
    if isinstance(shape, dict):
        right = isinstance(value, dict) and value.keys() == shape.keys()
        wanted, parts = f"an object with {', '.join(shape)}", shape.items()
    elif isinstance(shape, list):
        right, wanted = isinstance(value, list), "a list"
        parts = [(i, shape[0]) for i in range(len(value) if right else 0)]
    elif isinstance(shape, tuple):
        right, wanted = isinstance(value, list) and len(value) == len(shape), f"a list of {len(shape)}"
        parts = enumerate(shape)
    elif shape is float:
        right = type(value) in (int, float) and abs(value) <= sys.float_info.max
        wanted = "a finite number"
    else:
        right, wanted = shape is object or type(value) is shape, _TYPES.get(shape, "")
    if not right:
        message = f"{' '.join(map(str, where)) or 'the file'}: {wanted} is needed"
        raise UnreadableError(message)
    for key, part in parts:
        _check_shape(value[key], part, *where, key)


def references(document: Mapping[str, Any]) -> Iterator[Failure]:
    """Yield each name that is not known, or stands twice, and each number that is one of nothing."""
    actions, events, ends = len(document["actions"]), document["events"], len(document["environment"])
    propositions, words = document["propositions"], document["words"]
    for key in ("events", "actions", "propositions"):
        yield from _twice(key, document[key])
    for names in (document["uncontrollable"], *words):
        yield from _unknown("words", names, events)
    sizes = [ends]
    for rule in document["rules"]:
        where, size = f"rule {rule['name']!r}", len(rule["delta"])
        sizes.append(size)
        yield from _twice(where, rule["events"])
        yield from _outside(where, rule["marked"], 0, size)
        for row in rule["delta"]:
            yield from _outside(where, row, NONE, size)
            if len(row) != len(rule["events"]):
                yield where, f"a row has {len(row)} entries; one for each event is needed"
    machine = document["reward_machine"]
    sizes.append(len(machine["states"]) if machine else 1)
    if machine:
        yield from _twice("reward_machine", machine["states"])
        yield from _unknown("reward_machine", machine["propositions"], propositions)
        for edge in machine["edges"]:
            yield from _unknown("reward_machine", edge[:4:2], machine["states"])
    yield from _twice("initial", [s for s, _ in document["initial"]])
    yield from _outside("initial", [s for s, _ in document["initial"]], 0, ends)
    for s, (_, _, label, choices) in enumerate(document["environment"]):
        where = f"environment state {s}"
        yield from _outside(where, [label], 0, 1 << len(propositions))
        yield from _twice(where, [action for action, _ in choices])
        yield from _outside(where, [action for action, _ in choices], 0, actions)
        for _, outcomes in choices:
            yield from _outside(where, [to for _, to, _, _ in outcomes], NONE, ends)
            yield from _outside(where, [word for *_, word in outcomes], 0, len(words))
    yield from _twice("states", [tuple(row[0]) for row in document["states"]])
    for i, (at, enabled, action, *_) in enumerate(document["states"]):
        if len(at) != len(sizes) or not all(0 <= q < size for q, size in zip(at, sizes, strict=True)):
            yield f"state {i}", f"is {at}; {len(sizes)} numbers, each below that of {sizes}, are needed"
        yield from _outside(f"state {i}", enabled, 0, actions)
        yield from _outside(f"state {i}", [action], NONE, actions)


def _twice(where: str, names: Iterable[Hashable]) -> Iterator[Failure]:
    yield from (
        (where, f"{name!r} stands {n} times; once is right") for name, n in Counter(names).items() if n > 1
    )


def _unknown(where: str, names: Iterable[str], among: Sequence[str]) -> Iterator[Failure]:
    yield from (
        (where, f"{name!r} is not known; known: {', '.join(among)}") for name in names if name not in among
    )


def _outside(where: str, numbers: Iterable[int], least: int, end: int) -> Iterator[Failure]:
    yield from ((where, f"{n}; {least} to {end - 1} is possible") for n in numbers if not least <= n < end)


def digest(document: Mapping[str, Any]) -> str:
    """Return the SHA-256 of all but ``sha256``, as JSON in ASCII with sorted keys and no blanks.

    Examples
    --------
    >>> digest({"b": 0.1, "a": 1, "sha256": "any"}) == hashlib.sha256(b'{"a":1,"b":0.1}').hexdigest()
    True
    """
    content = {key: value for key, value in document.items() if key != "sha256"}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()


@cache
def exact(number: float) -> Fraction:
    """Return the decimal that a number is written as."""
    return Fraction(repr(number))

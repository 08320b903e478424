"""A task document with other values in some places."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import replace
from typing import Any, Final

from supremal.errors import ModelError, suggest
from supremal.formats.toml import Document, KeyPath

TABLES: Final = ("events", "plant", "environment", "rule", "reward_machine", "learner", "check")
"""The tables of a task file whose keys can vary: all that a result depends on, besides seeds."""


def changed(document: Document, values: Mapping[str, Any]) -> Document:
    r"""Return ``document`` with the value at each key of ``values``; the tables on the way are made.

    A key is that of messages: names, and numbers of tables from 1, with dots between.

    Raises
    ------
    ModelError
        If the document has no such place; the message begins with the key.

    Examples
    --------
    >>> from supremal.formats.toml import parse_toml
    >>> task = parse_toml("[[rule]]\nof = 'a'")
    >>> changed(task, {"rule.1.of": "b", "learner.alpha": 0.5}).data
    {'rule': [{'of': 'b'}], 'learner': {'alpha': 0.5}}
    """
    data, places = deepcopy(document.data), dict(document.places)
    for key, value in values.items():
        path = _put(data, key, value)
        inside = [place for place in places if place[: len(path)] == path != place]
        for place in inside:
            del places[place]
    return replace(document, data=data, places=places)


def _put(data: dict[str, Any], key: str, value: Any) -> KeyPath:  # noqa: ANN401 - whatever TOML has
    """Put ``value`` where ``key`` says; return its path."""
    first, *_ = parts = key.split(".")
    if first not in TABLES:
        message = f"{key}: a study varies keys of {', '.join(TABLES)}; {suggest(first, TABLES)}"
        raise ModelError(message)
    at: Any = data
    path: KeyPath = ()
    for i, part in enumerate(parts):
        place: str | int = part
        if isinstance(at, list):
            place = int(part) - 1 if part.isdecimal() else -1
            if not 0 <= place < len(at):
                above = ".".join(parts[:i])
                message = f"{key}: {above!r} of the task has {len(at)} parts; give the number of one, from 1"
                raise ModelError(message)
        elif not isinstance(at, dict):
            message = f"{key}: {'.'.join(parts[:i])!r} of the task is no table; leave out what follows it"
            raise ModelError(message)
        path = (*path, place)
        if i == len(parts) - 1:
            at[place] = value
        else:
            at = at.setdefault(place, {}) if isinstance(at, dict) else at[place]
    return path

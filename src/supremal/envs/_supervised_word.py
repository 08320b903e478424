"""What a user's function may return as the word of a step."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from supremal.errors import MDPError


def as_word(word: Any) -> tuple[str, ...]:  # noqa: ANN401 - whatever a user's function returned
    """Return a word as a tuple; raise an `MDPError` if it is none."""
    if isinstance(word, str) or not isinstance(word, Iterable):
        message = (
            f"the word of a step is {word!r}; a tuple of event names is needed, () where nothing happened"
        )
        raise MDPError(message)
    return tuple(word)


def check_name(name: object) -> None:
    """Raise an `MDPError` if this cannot be the name of an event."""
    if not isinstance(name, str):
        message = f"the word of a step has {name!r}; names of events are needed"
        raise MDPError(message)

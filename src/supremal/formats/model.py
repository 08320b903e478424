"""What every format reads and writes: a `Model`, from a file that is not trusted."""

from __future__ import annotations

from importlib.resources.abc import Traversable
from os import PathLike
from pathlib import Path
from typing import Final, NamedTuple, TypeAlias

from supremal.automata.automaton import Automaton

MAX_BYTES: Final = 64 << 20
"""The largest file that is read: 64 MiB."""

MAX_STATES: Final = 2_000_000
"""The most states that a file can ask for by a number alone, which takes it a few bytes."""

MAX_CELLS: Final = 1 << 27
"""The most entries, states times events, of the table of an automaton that is read: 512 MiB."""

Source: TypeAlias = str | PathLike[str] | Traversable
"""A path, or a file inside a package."""


class Model(NamedTuple):
    """A model: what can happen (``plants``) and what is wanted (``specs``), each the `sync` of its parts."""

    plants: tuple[Automaton, ...]
    specs: tuple[Automaton, ...]


def opened(source: Source) -> Traversable:
    """Return ``source`` as something that can be opened."""
    return Path(source) if isinstance(source, str | PathLike) else source


def read_bytes(source: Source, most: int) -> bytes:
    """Return what ``source`` holds, up to one byte more than the ``most`` that a reader takes."""
    with opened(source).open("rb") as stream:
        raw: bytes = stream.read(most + 1)
    return raw


def too_large(most: int) -> str:
    """Say that a file is larger than ``most`` bytes."""
    return f"the file is larger than {most >> 20} MiB, the most that is read; split the model"


def size_problem(states: int, events: int) -> str:
    """Say that a table of so many states and events is too large; nothing where it is not.

    Examples
    --------
    >>> size_problem(3, 2), size_problem(2_000_000, 1_000)[:38]
    ('', '2,000,000 states times 1,000 events ma')
    """
    if states * events <= MAX_CELLS:
        return ""
    return (
        f"{states:,} states times {events:,} events make a table of more than {MAX_CELLS:,} entries, "
        "the most that is read; split the model"
    )

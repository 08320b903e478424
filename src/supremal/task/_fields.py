"""Fields: the values of a document as they are read, each with its place.

A *reader* is a function that takes a `Field` and returns what it says, or fails at its place.  So a table is
read key by key, ``take(table, "episodes", whole(1), 500_000)``, and every message names the file, the line
and column, the key, what is wrong there and what would be right.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, time
from typing import Any, Final, NoReturn, TypeVar

from supremal.automata.alphabet import Alphabet
from supremal.errors import suggest
from supremal.formats.toml import Document, KeyPath, Place
from supremal.task._slips import Slips

T = TypeVar("T")
U = TypeVar("U")
Reader = Callable[["Field"], T]

_WIDEST: Final = 60


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """A value of a document, and the keys and elements that lead to it."""

    document: Document
    path: KeyPath
    value: Any

    @property
    def name(self) -> str:
        """How messages call it: keys and numbers of tables, from 1, with dots between."""
        path = list(self.path)
        while path and isinstance(path[-1], int) and not isinstance(self.value, dict):
            path.pop()
        return ".".join(str(part + 1) if isinstance(part, int) else part for part in path)

    def fail(self, problem: str, *, at: int | None = None, key: bool = False) -> NoReturn:
        """Raise a `FormatError` at the value, ``at`` characters into a string, or at the ``key``."""
        place = self.document.places.get(self.path, Place(0, 0))
        offset = place.key if key else place.value
        if at is not None and place.text >= 0:
            offset = place.text + at
        self.document.fail(f"{self.name}: {problem}" if self.path else problem, offset)

    def wrong(self, right: str) -> NoReturn:
        """Say that the value is not ``right``."""
        self.fail(f"is {shown(self.value)}; {right} is needed")

    def __contains__(self, key: str) -> bool:
        return key in self.value

    def __getitem__(self, key: str | int) -> Field:
        return Field(self.document, (*self.path, key), self.value[key])

    def elements(self) -> list[Field]:
        """Return the elements of a list."""
        if not isinstance(self.value, list):
            self.wrong("a list")
        return [self[k] for k in range(len(self.value))]


def shown(value: object) -> str:
    """Return ``value`` as a message shows it, much as TOML has it."""
    match value:
        case bool():
            text = str(value).lower()
        case str():
            text = repr(value)
        case dict():
            text = "a table"
        case list():
            text = f"[{', '.join(map(shown, value[:_WIDEST]))}]"
        case date() | time():
            text = "a date" if isinstance(value, date) else "a time"
        case _:
            text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= _WIDEST else f"{text[: _WIDEST - 3]}..."


# --- readers ----------------------------------------------------------------------------------------------


def anything(field: Field) -> Field:
    """Read whatever is there."""
    return field


def text(field: Field) -> str:
    """Read a string."""
    if not isinstance(field.value, str):
        field.wrong("a string")
    return field.value


def name(field: Field) -> str:
    """Read a string that says something."""
    if not text(field).strip():
        field.wrong("a name")
    return text(field)


def switch(field: Field) -> bool:
    """Read true or false."""
    if not isinstance(field.value, bool):
        field.wrong("true or false")
    return field.value


def number(field: Field) -> float:
    """Read a finite number."""
    value = field.value
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) < 1e300:
        field.wrong("a finite number")
    return float(value)


def whole(least: int = 0) -> Reader[int]:
    """Return a reader of whole numbers from ``least``."""

    def read(field: Field) -> int:
        value = field.value
        if not isinstance(value, int) or isinstance(value, bool) or not least <= value < 1 << 63:
            field.wrong(f"a whole number from {least}")
        return value

    return read


def one_of(choices: Collection[str], page: str = "") -> Reader[Any]:
    """Return a reader of one of some words; ``page`` tells of all of them, where they are many."""

    def read(field: Field) -> str:
        if text(field) not in choices:
            right = suggest(field.value, choices)
            more = f" ({page} has them all)" if page and right.startswith("known: ") else ""
            field.fail(f"is {shown(field.value)}; {right}{more}")
        return text(field)

    return read


def event(field: Field) -> str:
    """Read the name of an event."""
    if name(field).split() != [field.value]:
        field.wrong("a name without white space")
    return name(field)


def event_of(alphabet: Alphabet | None) -> Reader[str]:
    """Return a reader of events, of ``alphabet`` where there is one."""

    def read(field: Field) -> str:
        if alphabet is not None and text(field) not in alphabet:
            field.fail(f"unknown event {shown(field.value)}; {suggest(field.value, alphabet)}")
        return event(field)

    return read


def distinct(read: Reader[str]) -> Reader[tuple[str, ...]]:
    """Return a reader of lists of names, each of which stands there once."""

    def read_all(field: Field) -> tuple[str, ...]:
        seen: dict[str, None] = {}
        for element in field.elements():
            if read(element) in seen:
                element.fail(f"names {shown(element.value)} twice; name each once")
            seen[element.value] = None
        return tuple(seen)

    return read_all


def called(field: Field, default: str = "") -> str:
    """Read the ``name`` of a table among others; if there is no ``default``, that is its kind and number."""
    kind, place = field.path
    return take(field, "name", name, default or f"{kind} {int(place) + 1}")


def table(field: Field) -> Field:
    """Read a table."""
    if not isinstance(field.value, dict):
        field.wrong("a table")
    return field


def tables(field: Field) -> list[Field]:
    """Read an array of tables."""
    if not isinstance(field.value, list) or not all(isinstance(part, dict) for part in field.value):
        field.fail(f"is {shown(field.value)}; tables with the header [[{field.name}]] are needed")
    return field.elements()


def table_of(read: Reader[T]) -> Reader[dict[str, T]]:
    """Return a reader of tables whose keys are anybody's choice."""
    return lambda field: {key: read(table(field)[key]) for key in table(field).value}


# --- tables -----------------------------------------------------------------------------------------------


def take(parent: Field, key: str, read: Reader[T], default: U) -> T | U:
    """Read what a table says under ``key``, ``default`` if it says nothing."""
    return read(parent[key]) if key in parent else default


def need(parent: Field, key: str, read: Reader[T], right: str) -> T:
    """Read what a table has to say under ``key``; ``right`` is what it would be."""
    if key not in parent:
        parent.fail(f"has no {key!r}; {right} is needed", key=True)
    return read(parent[key])


def check_keys(parent: Field, known: Iterable[str]) -> None:
    """Fail at the keys of a table that are not ``known``."""
    choices, slips = list(known), Slips()
    for key in table(parent).value:
        if key not in choices:
            with slips.noting():
                right = suggest(key, choices, limit=len(choices))
                parent[key].fail(f"unknown key {key!r}; {right}", key=True)
    slips.check()


def take_all(parent: Field, readers: Mapping[str, Reader[Any]]) -> dict[str, Any]:
    """Read what a table says under these keys, each of which it may leave out, and no others."""
    slips, said = Slips(), dict[str, Any]()
    with slips.noting():
        check_keys(parent, readers)
    for key, read in readers.items():
        if key in table(parent):
            with slips.noting():
                said[key] = read(parent[key])
    slips.check()
    return said


def read_each(fields: Iterable[Field], read: Reader[T]) -> list[T]:
    """Return what each of ``fields`` says; what is wrong in several is told together."""
    slips, said = Slips(), list[T]()
    for field in fields:
        with slips.noting():
            said.append(read(field))
    slips.check()
    return said


def choose(parent: Field, ways: Sequence[str], also: Iterable[str] = ()) -> str:
    """Return which of the keys ``ways`` a table has: exactly one."""
    found = [key for key in ways if key in table(parent)]
    if len(found) == 1:
        return found[0]
    listed = f"{', '.join(ways[:-1])} or {ways[-1]}"
    if found:
        parent[found[1]].fail(f"stands beside {found[0]!r}; exactly one of {listed} is needed", key=True)
    check_keys(parent, (*ways, *also))  # most likely one of them is misspelt
    return parent.fail(f"has none of {listed}; exactly one is needed", key=True)

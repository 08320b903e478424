"""Slips: what is wrong with what a document says, told with its place."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from supremal.errors import FormatError, ModelError, SupremalError

if TYPE_CHECKING:
    from supremal.task._fields import Field

MAX_SHOWN: Final = 10
"""The most slips that one message tells."""


@contextmanager
def placed(field: Field, *quoted: Field, table: Field | None = None) -> Iterator[None]:
    """Put the place of ``field`` in front of what turns out to be wrong with what it says.

    Where the message has a key of one of the tables ``quoted`` in quotes, or begins with a key of ``table``,
    the place of that is taken instead.
    """
    try:
        yield
    except SupremalError as error:
        if isinstance(error, FormatError) and error.path == field.document.path:
            raise  # it has its place
        message = str(error)
        for inner in quoted:
            for key in inner.value:
                if repr(key) in message:
                    inner[key].fail(message)
        key, _, rest = message.partition(" ")
        if table is not None and key in table:
            table[key].fail(rest if rest.startswith(("is ", "has ", "names ")) else message)
        field.fail(message, key=isinstance(field.value, dict))


@contextmanager
def placed_in(field: Field) -> Iterator[None]:
    """Find the place of what is wrong in the text of ``field``, which is called ``field.name`` meanwhile."""
    try:
        yield
    except FormatError as error:
        lines = field.value.split("\n")
        before = sum(len(line) + 1 for line in lines[: max(error.line - 1, 0)])
        field.fail(error.message, at=before + max(error.column - 1, 0))
    except ModelError as error:
        field.fail(str(error).removeprefix(f"{field.name}: "))


class SlipsError(FormatError):
    """Several slips in one; ``found`` has each of them."""

    found: tuple[FormatError, ...] = ()


class Slips:
    """What is wrong with a document, part by part; a part may have slips of its own."""

    def __init__(self) -> None:
        self.found: list[FormatError] = []

    @contextmanager
    def noting(self) -> Iterator[None]:
        """Note a slip, and go on behind the ``with``."""
        try:
            yield
        except SlipsError as error:
            self.found += error.found
        except FormatError as error:
            self.found.append(error)

    def check(self) -> None:
        """Raise all that was found as one `FormatError`, in the order of its places."""
        if not self.found:
            return
        first, *others = sorted(self.found, key=lambda error: (error.line, error.column))
        lines = [first.message, *map(str, others[: MAX_SHOWN - 1])]
        if len(others) >= MAX_SHOWN:
            lines.append(f"and {len(others) - MAX_SHOWN + 1} more")
        together = SlipsError("\n".join(lines), path=first.path, line=first.line, column=first.column)
        together.found = tuple(self.found)
        raise together

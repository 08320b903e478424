"""A page of text that is read, and the place in it where something is wrong.

While all goes well a place is one number, the offset in the text; line and column are counted when they are
needed, which is once.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, NamedTuple, NoReturn

from supremal.errors import FormatError
from supremal.formats import model

NOWHERE: Final = -1
"""The place of what is wrong with the whole file."""

_WORD: Final = re.compile(r"\S+")
_NUMBER: Final = re.compile(r"[0-9]{1,9}")
_SHOWN: Final = 40


class Word(NamedTuple):
    """A word, and where it stands."""

    text: str
    where: int


class Page:
    r"""A text from ``path``.

    Examples
    --------
    >>> page = Page("a.fsm", "2\n\nidle 1 x")
    >>> page.at(10)
    'a.fsm:3:8'
    """

    def __init__(self, path: str, text: str = "") -> None:
        self.path, self.text = path, text

    def place(self, where: int) -> tuple[int, int]:
        """Return line and column of an offset, counted from 1."""
        return self.text.count("\n", 0, where) + 1, where - self.text.rfind("\n", 0, where)

    def at(self, where: int) -> str:
        """Return path, line and column, as they stand in front of a message."""
        return self.path if where == NOWHERE else ":".join([self.path, *map(str, self.place(where))])

    def fail(self, message: str, where: int = NOWHERE) -> NoReturn:
        """Raise a `FormatError`."""
        line, column = (0, 0) if where == NOWHERE else self.place(where)
        raise FormatError(message, path=self.path, line=line, column=column)

    def lines(self) -> Iterator[Word]:
        """Give the lines, each with the offset at which it begins."""
        begin = 0
        for line in self.text.split("\n"):
            yield Word(line, begin)
            begin += len(line) + 1

    def number(self, word: Word, what: str, most: int) -> int:
        """Return the number that ``word`` is, which has to be at most ``most``."""
        if not _NUMBER.fullmatch(word.text) or int(word.text) > most:
            self.fail(f"{what} is {shown(word.text)}; a whole number from 0 to {most} is needed", word.where)
        return int(word.text)


def decode(raw: bytes, path: str) -> Page:
    """Return a file's bytes as a page, if they are not too many and UTF-8."""
    if len(raw) > model.MAX_BYTES:
        raise FormatError(model.too_large(model.MAX_BYTES), path=path)
    try:
        return Page(path, raw.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        message = f"byte {error.start} is not UTF-8; save the file in that encoding"
        raise FormatError(message, path=path, line=raw.count(b"\n", 0, error.start) + 1) from None


def words(line: Word) -> list[Word]:
    """Return the words of ``line``, each with its own offset."""
    return [Word(found[0], line.where + found.start()) for found in _WORD.finditer(line.text)]


def shown(text: str) -> str:
    """Return ``text`` as a message shows it: quoted, and not too long."""
    return repr(text if len(text) <= _SHOWN else f"{text[:_SHOWN]}...")

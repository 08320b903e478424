"""Where things stand in a TOML text: the offset of every key, value and element.

Python's `tomllib` says what a text means and not where it says so, which a message about a value needs.  This
scanner goes through the same text beside it and understands as little as it can: what is a key, where a
value begins and ends, and which table a header opens.  Where a text is no TOML it stops; `tomllib` says why.

It goes first, because it bounds what `tomllib` does not: how deep brackets and dotted keys nest, and how
long a number may be.
"""

from __future__ import annotations

import re
import tomllib
from contextlib import suppress
from typing import Final, NamedTuple, TypeAlias

KeyPath: TypeAlias = tuple[str | int, ...]
"""The keys, and the numbers of elements from 0, that lead to a value."""

MAX_DEPTH: Final = 30
"""The most keys and elements that lead to a value."""

MAX_PLAIN: Final = 100
"""The most characters of a value without quotes."""

_BLANK: Final = re.compile(r"(?:[ \t\r\n]++|#[^\n]*+)*+")
_SPACE: Final = re.compile(r"[ \t]*+")
_BARE: Final = re.compile(r"[\w-]+")
_PLAIN: Final = re.compile(r"[^\s,\]}#=\[{][^,\]}#\n]*+")
_STOPS: Final = {
    '"': re.compile(r'\\.|"', re.DOTALL),
    "'": re.compile(r"'"),
    '"""': re.compile(r'\\.|"{3,5}', re.DOTALL),
    "'''": re.compile(r"'{3,5}"),
}


class Place(NamedTuple):
    """Offsets: of a key (an element, a header), of its value, and of what a string says.

    ``text`` is -1 where the value is no string, or says something else than what stands there.
    """

    key: int
    value: int
    text: int = -1


class RefusedError(Exception):
    """Something that no file needs; ``at`` is its offset."""

    def __init__(self, message: str, at: int) -> None:
        self.at = at
        super().__init__(message)


_TOO_DEEP: Final = f"more than {MAX_DEPTH} levels of brackets and dots; fewer are needed"
_TOO_LONG: Final = (
    f"more than {MAX_PLAIN} characters without quotes; a string needs quotes, a number fewer digits"
)


def find_places(text: str) -> dict[KeyPath, Place]:
    r"""Return the place of every key and element of a TOML ``text``, as far as it is TOML.

    Linear in the text.

    Raises
    ------
    RefusedError
        If something nests too deeply, or a number is too long.

    Examples
    --------
    >>> find_places("[[rule]]\nof = ['a', 'b']")
    {('rule',): Place(key=0, value=0, text=-1),
     ('rule', 0): Place(key=0, value=0, text=-1),
     ('rule', 0, 'of'): Place(key=9, value=14, text=-1),
     ('rule', 0, 'of', 0): Place(key=15, value=15, text=16),
     ('rule', 0, 'of', 1): Place(key=20, value=20, text=21)}
    """
    scanner = _Scanner(text)
    with suppress(_NoTomlError):
        scanner.document()
    return scanner.places


class _NoTomlError(Exception):
    """The text is no TOML."""


class _Scanner:
    """Recursive descent, no deeper than `MAX_DEPTH`; ``at`` is how far the text has been read."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0
        self.places: dict[KeyPath, Place] = {}
        self.sizes: dict[KeyPath, int] = {}  # of the arrays of tables that [[...]] makes

    def document(self) -> None:
        table: KeyPath = ()
        while self.skip(_BLANK) < len(self.text):
            if self.text[self.at] == "[":
                table = self.header()
            else:
                self.pair(table)

    def skip(self, pattern: re.Pattern[str]) -> int:
        match = pattern.match(self.text, self.at)
        if match is None:
            raise _NoTomlError
        self.at = match.end()
        return self.at

    def take(self, sign: str) -> bool:
        found = self.text.startswith(sign, self.at)
        self.at += len(sign) * found
        return found

    def expect(self, sign: str) -> None:
        if not self.take(sign):
            raise _NoTomlError

    def header(self) -> KeyPath:
        """Read [a.b] or [[a.b]]; return the path of the table that it opens."""
        begin = self.at
        many = self.take("[[")
        if not many:
            self.expect("[")
        *parents, (last, _) = self.key()
        self.expect("]]" if many else "]")
        path: KeyPath = ()
        for part, at in parents:
            path = self.within((*path, part))
            self.implied(path, at)
        path = (*path, last)
        place = Place(begin, begin)
        if many:
            self.places.setdefault(path, place)
            self.sizes[path] = self.sizes.get(path, 0) + 1
            path = self.within(path)
        self.places[path] = place
        return path

    def within(self, path: KeyPath) -> KeyPath:
        """Return the path of what ``path`` stands for in a header: of an array of tables the last."""
        return (*path, self.sizes[path] - 1) if path in self.sizes else path

    def implied(self, path: KeyPath, at: int) -> None:
        """Note a table that a longer key speaks of, unless it has been seen."""
        if path not in self.places:
            self.places[path] = Place(at, at)

    def pair(self, table: KeyPath) -> None:
        """Read ``key = value`` in ``table``."""
        path = table
        *parents, (last, begin) = self.key()
        for part, at in parents:
            path = (*path, part)
            self.implied(path, at)
        self.expect("=")
        self.skip(_SPACE)
        self.value((*path, last), begin)

    def key(self) -> list[tuple[str, int]]:
        """Read a key with its dots; return each part and where it begins."""
        parts = []
        while True:
            begin = self.skip(_SPACE)
            if self.text.startswith(('"', "'"), begin):
                parts.append((self.quoted(), begin))
            else:
                self.skip(_BARE)
                parts.append((self.text[begin : self.at], begin))
            if len(parts) > MAX_DEPTH:
                raise RefusedError(_TOO_DEEP, begin)
            self.skip(_SPACE)
            if not self.take("."):
                return parts

    def quoted(self) -> str:
        begin, inside = self.at, self.string()
        if inside >= 0:
            return self.text[inside : self.at - 1]
        try:
            decoded: str = tomllib.loads(f"key = {self.text[begin : self.at]}")["key"]
        except ValueError:
            raise _NoTomlError from None
        return decoded

    def value(self, path: KeyPath, begin: int) -> None:
        """Read a value, whose key (for an element: itself) stands at ``begin``."""
        if len(path) > MAX_DEPTH:
            raise RefusedError(_TOO_DEEP, begin)
        start = self.at
        self.places[path] = Place(begin, start)
        if self.take("["):
            self.elements(path)
        elif self.take("{"):
            self.pairs(path)
        elif self.text.startswith(('"', "'"), start):
            self.places[path] = Place(begin, start, self.string())
        else:
            self.skip(_PLAIN)
            if len(self.text[start : self.at].rstrip()) > MAX_PLAIN:
                raise RefusedError(_TOO_LONG, start)

    def elements(self, path: KeyPath) -> None:
        size = 0
        while self.skip(_BLANK) < len(self.text) and not self.take("]"):
            self.value((*path, size), self.at)
            size += 1
            self.skip(_BLANK)
            self.take(",")

    def pairs(self, path: KeyPath) -> None:
        while self.skip(_BLANK) < len(self.text) and not self.take("}"):
            self.pair(path)
            self.skip(_BLANK)
            self.take(",")

    def string(self) -> int:
        """Read a string; return where what it says begins, -1 where it has escapes."""
        begin = self.at
        quote = self.text[begin : begin + 3]
        quote = quote if quote in _STOPS else quote[:1]
        inside = self.at = begin + len(quote)
        plain = True
        while True:
            stop = _STOPS[quote].search(self.text, self.at)
            if stop is None:
                raise _NoTomlError
            self.at = stop.end()
            if stop[0][0] != "\\":
                break
            plain = False
        if not plain:
            return -1
        return inside + (len(quote) == 3 and self.text.startswith("\n", inside))

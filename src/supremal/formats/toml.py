"""TOML, read with the place of everything that it says.

`tomllib` reads the text; `supremal.formats._toml_places` finds where each key and value stands, so that what
is wrong with a value can be told with its line and column.

Source: TOML 1.0.0, toml.io.
"""

from __future__ import annotations

import re
import tomllib
from codecs import BOM_UTF8
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, NoReturn

from supremal.errors import FormatError
from supremal.formats._toml_places import MAX_DEPTH, KeyPath, Place, RefusedError, find_places
from supremal.formats.model import Source, read_bytes, too_large

__all__ = ["MAX_BYTES", "MAX_DEPTH", "Document", "KeyPath", "Place", "parse_toml", "read_toml"]

MAX_BYTES: Final = 1 << 20
"""The largest TOML file that is read, 1 MiB: people write it."""

_WHERE: Final = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")


@dataclass(frozen=True, slots=True, eq=False)
class Document:
    r"""What a TOML text says, and where.

    Parameters
    ----------
    path
        What messages call it.
    text
        The text, its lines ended by ``\n``.
    data
        What it says.
    places
        The offsets of each key and element.
    """

    path: str
    text: str
    data: dict[str, Any]
    places: Mapping[KeyPath, Place]

    def fail(self, message: str, offset: int) -> NoReturn:
        """Raise a `FormatError` with the line and column of ``offset``."""
        line = self.text.count("\n", 0, offset) + 1
        column = offset - self.text.rfind("\n", 0, offset)
        raise FormatError(message, path=self.path, line=line, column=column)


def read_toml(source: Source) -> Document:
    """Return what a TOML file says, and where.

    Raises
    ------
    FormatError
        If it is no TOML, too large, or nests too deeply; gives line and column.
    OSError
        If it cannot be read.
    """
    path, raw = str(source), read_bytes(source, MAX_BYTES)
    if len(raw) > MAX_BYTES:
        raise FormatError(too_large(MAX_BYTES), path=path)
    raw = raw.removeprefix(BOM_UTF8)
    try:
        text = raw.decode()
    except UnicodeDecodeError as error:
        good = raw[: error.start].decode()
        message = f"byte {error.start} is not UTF-8; save the file in that encoding"
        Document(path, good, {}, {}).fail(message, len(good))
    return parse_toml(text, path)


def parse_toml(text: str, path: str = "<text>") -> Document:
    r"""Return what a TOML ``text`` says, and where; errors are those of `read_toml`.

    Examples
    --------
    >>> document = parse_toml("[light]\nstates = ['dark', 'lit']")
    >>> document.data, document.places["light", "states", 1].value
    ({'light': {'states': ['dark', 'lit']}}, 26)
    """
    text = text.replace("\r\n", "\n")
    document = Document(path, text, {}, {})
    try:
        places = find_places(text)
        data = tomllib.loads(text)
    except RefusedError as error:
        document.fail(str(error), error.at)
    except tomllib.TOMLDecodeError as error:
        _fail_decoding(document, str(error))
    return Document(path, text, data, places)


def _fail_decoding(document: Document, said: str) -> NoReturn:
    """Say what `tomllib` has said, with the place that it puts at the end of its message."""
    where = _WHERE.search(said)
    problem = said[: where.start()] if where else said
    message = f"this is not TOML: {problem[:1].lower()}{problem[1:]}"
    if where and where[1]:
        line, column = int(where[1]), int(where[2])
        if problem == "Invalid value" and document.text.split("\n")[line - 1][column - 1 :][:1].isalpha():
            message += " (a text needs quotes)"
        raise FormatError(message, path=document.path, line=line, column=column) from None
    document.fail(message, len(document.text))

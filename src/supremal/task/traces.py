"""Traces: words of events that have happened, one a line of a file (JSON Lines).

A line is an array of the names of events, or an object that has one under ``events`` and may have a name
under ``id``; what else an object says is left alone, so that the log of a program can be read as it stands.

Source: the format of lines is that of https://jsonlines.org: UTF-8, one JSON value a line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Final

from supremal.automata.alphabet import Alphabet
from supremal.automata.words import Word
from supremal.errors import FormatError, suggest
from supremal.formats._json import WrongError, fail, list_of, parse, shown, text_of

_MOST: Final = 1 << 20
"""The most bytes of a line."""


@dataclass(frozen=True, slots=True)
class Trace:
    """What has happened, in order.

    Parameters
    ----------
    line
        Where it stands in its file, from 1.
    word
        The events.
    name
        Its ``id``; "" where it has none.
    """

    line: int
    word: Word
    name: str = ""

    def __str__(self) -> str:
        return f"{self.name} (line {self.line})" if self.name else f"line {self.line}"


def read_traces(path: str | PathLike[str], alphabet: Alphabet) -> Iterator[Trace]:
    r"""Yield the traces in a file, a line at a time; empty lines are none.

    Parameters
    ----------
    path
        The file.
    alphabet
        The events that a trace may have.

    Raises
    ------
    FormatError
        If a line is no trace, or has an event that is not in ``alphabet``; gives the line.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from supremal import Alphabet
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "traces.jsonl")
    ...     _ = file.write_text('["go", "stop"]\n{"id": "second", "events": ["go"]}\n')
    ...     for trace in read_traces(file, Alphabet(("go", "stop"))):
    ...         print(trace, *trace.word)
    line 1 go stop
    second (line 2) go
    """
    with Path(path).open("rb") as file:
        line = 0
        while raw := file.readline(_MOST + 1):
            line += 1
            if raw.strip():
                yield _trace(raw, str(path), line, alphabet)


def _trace(raw: bytes, path: str, line: int, alphabet: Alphabet) -> Trace:
    try:
        if len(raw) > _MOST:
            fail(f"the line is longer than {_MOST >> 20} MiB, the most that is read; split the trace")
        said = parse(raw, path, _MOST)
        name, events = _parts(said)
        word = tuple(text_of(event, f"event {at}") for at, event in enumerate(events, 1))
        for at, event in enumerate(word, 1):
            if event not in alphabet:
                fail(
                    f"event {at} is {shown(event)}, which the task does not have; {suggest(event, alphabet)}"
                )
    except WrongError as error:
        raise FormatError(str(error), path=path, line=line) from None
    except FormatError as error:
        raise FormatError(error.message, path=path, line=line, column=error.column) from None
    return Trace(line, word, name)


def _parts(said: object) -> tuple[str, list[object]]:
    """Return the name and the events of a line."""
    if isinstance(said, list):
        return "", said
    if not isinstance(said, dict):
        fail(f"the line is {shown(said)}; an array of events, or an object with the key 'events' is needed")
    if "events" not in said:
        fail(f"the object has no key 'events'; its keys are {', '.join(said) or 'none'}")
    name = said.get("id", "")
    return name if isinstance(name, str) else shown(name), list_of(said["events"], "events")

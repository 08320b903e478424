"""What the texts of rules share: their tokens, the steps they may take, and what a meaning is."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any, Final, NamedTuple, NoReturn

NONE: Final = -1
LIMIT: Final = 3_000_000
"""How many steps the meaning of one rule's text may take: some seconds."""

_LONGEST: Final = 100_000


class TextError(Exception):
    """A text of a rule or a guard cannot be read."""


class TooLargeError(Exception):
    """The meaning of a text is too large to work out."""


def refuse(problem: str) -> NoReturn:
    """Raise a `TextError`."""
    raise TextError(problem)


def known(name: str, names: Collection[str]) -> str:
    """Return ``name`` if it is one of ``names``."""
    return name if name in names else refuse(f"{name!r} is not known")


class Budget:
    """How many steps are left."""

    def __init__(self) -> None:
        self.left = LIMIT

    def spend(self, steps: int) -> None:
        """Take some of them, or raise a `TooLargeError`."""
        self.left -= steps
        if self.left < 0:
            message = f"too large to check: more than {LIMIT:,} steps; split the rule into smaller ones"
            raise TooLargeError(message)


class Meaning(NamedTuple):
    """Which words a text allows: follow ``step`` from ``start``, event by event, and ask ``accepts``.

    ``sets`` are the sets of events that it tells apart; ``backwards``: a word is read from its end.
    """

    start: Any
    step: Callable[[Any, str], Any]
    accepts: Callable[[Any], bool]
    sets: Iterable[frozenset[str]]
    backwards: bool


class Reader:
    """The ``tokens`` of a text, the next one last: signs, names with a quote before them, "" at the end.

    ``spellings`` has the sign that a plain word or another sign stands for.
    """

    def __init__(self, text: str, signs: str, spellings: Mapping[str, str] | None = None) -> None:
        if len(text) > _LONGEST:
            refuse(f"it has {len(text):,} characters; {_LONGEST:,} are allowed")
        spelt = spellings or {}
        tokens = []
        for match in re.finditer(rf"""\s*(?:({signs})|(\w+)|"([^"]*)"|'([^']*)'|(\S))""", text):
            kind, said = match.lastindex, match[match.lastindex or 0]
            if kind == 5:
                refuse(f"unexpected {said!r}")
            plain = said if kind == 1 else f'"{said}'
            tokens.append(spelt.get(said, plain) if kind in (1, 2) else plain)
        self.tokens = ["", *reversed(tokens)]

    def _next(self) -> str:
        return self.tokens.pop() if self.tokens[-1] else refuse("it ends too early")

    def _take(self, sign: str) -> bool:
        return self.tokens[-1] == sign and bool(self.tokens.pop())

    def _expect(self, sign: str) -> None:
        if not self._take(sign):
            refuse(f"{sign!r} is missing")

    def _expect_end(self) -> None:
        if self.tokens[-1]:
            said = self._next().removeprefix('"')
            refuse(f"unexpected {said!r}")

    def _name(self, names: Collection[str]) -> str:
        token = self._next()
        return known(token[1:], names) if token[0] == '"' else refuse(f"unexpected {token!r}")

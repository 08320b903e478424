"""Reading a text: it is split into tokens, and a parser takes these one after another.

The parsers of this room are recursive descents.  What they share stands here: names of events, plain or in
quotes; errors that say where; and a bound on the depth, so that no text overflows the stack.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, NamedTuple, NoReturn

from supremal.automata.alphabet import Alphabet
from supremal.errors import FormatError, suggest

NAME: Final = r"""\w+|"[^"]*"|'[^']*'"""
"""How the name of an event is written: letters, digits and _ as they stand, any other name in quotes."""

MAX_LENGTH: Final = 100_000
"""The most characters of a text."""

MAX_DEPTH: Final = 100
"""The deepest nesting: with up to six calls a level, Python's own limit is far."""

_SHOWN: Final = 60


class Token(NamedTuple):
    """A piece of a text: its kind, what it says (a name without its quotes) and its place, from 0."""

    kind: str
    text: str
    at: int


class Scanner:
    r"""The tokens of a text, and how far they have been read.

    Parameters
    ----------
    text
        What to read; blanks may stand between tokens.
    pattern
        What a token is.  Each alternative is a named group, and its name the kind of the token: a ``name``
        is an event and loses its quotes, a ``sign`` can be asked for with `take` and `expect`.
    path
        What messages call the text.
    wanted
        What would be right, for every message: "an expression of ... is needed".

    Raises
    ------
    FormatError
        If the text is too long, or some of it is no token; gives line and column.

    Examples
    --------
    >>> pattern = re.compile(rf"(?P<name>{NAME})|(?P<sign>[()])")
    >>> scanner = Scanner("(a 'b-c')", pattern, path="example", wanted="names are needed")
    >>> scanner.take("("), scanner.next().text, scanner.next().text, scanner.take("(")
    (True, 'a', 'b-c', False)
    >>> scanner.expect(")"), scanner.token.kind
    (None, 'end')
    """

    def __init__(self, text: str, pattern: re.Pattern[str], *, path: str, wanted: str) -> None:
        self.text, self.path, self.wanted = text, path, wanted
        if len(text) > MAX_LENGTH:
            message = f"{len(text):,} characters; a text may have {MAX_LENGTH:,}, so split it into several"
            raise FormatError(message, path=path, line=1, column=MAX_LENGTH + 1)
        self._tokens = self._split(pattern)
        self._next = 0
        self._depth = 0

    def _split(self, pattern: re.Pattern[str]) -> list[Token]:
        tokens, at, text = [], 0, self.text
        while at < len(text):
            if text[at].isspace():
                at += 1
                continue
            match = pattern.match(text, at)
            if match is None or match.lastgroup is None:
                sign = text[at]
                problem = "a quote that is not closed" if sign in "'\"" else f"unexpected {sign!r}"
                self.fail(problem, at)
            kind, piece = match.lastgroup, match[0]
            if kind == "name" and piece[0] in "'\"":
                piece = piece[1:-1]
            tokens.append(Token(kind, piece, at))
            at = match.end()
        return [*tokens, Token("end", "", len(text))]

    @property
    def token(self) -> Token:
        """The token that comes next; the last one is of kind ``end``."""
        return self._tokens[self._next]

    def next(self) -> Token:
        """Take the next token, whatever it is; the end can be taken for ever."""
        token = self._tokens[self._next]
        self._next += token.kind != "end"
        return token

    def sees(self, *signs: str) -> bool:
        """Whether the next token is one of these ``signs``."""
        token = self._tokens[self._next]
        return token.kind == "sign" and token.text in signs

    def take(self, *signs: str) -> bool:
        """Take the next token if it is one of these ``signs``; return whether it was."""
        found = self.sees(*signs)
        self._next += found
        return found

    def expect(self, sign: str) -> None:
        """Take the next token, which has to be this ``sign``."""
        if not self.take(sign):
            self.fail(f"{sign!r} is missing")

    def event(self, token: Token, alphabet: Alphabet) -> str:
        """Return the event that ``token`` names; fail with a suggestion if ``alphabet`` does not have it."""
        if token.text not in alphabet:
            known = suggest(token.text[:_SHOWN], alphabet)
            message = f"unknown event {short(token.text)!r}; {known}"
            self._raise(message, token.at)
        return token.text

    @contextmanager
    def level(self) -> Iterator[None]:
        """One level deeper, for as long as the ``with`` lasts."""
        self._depth += 1
        if self._depth > MAX_DEPTH:
            self.fail(f"more than {MAX_DEPTH} levels of nesting")
        yield
        self._depth -= 1

    def fail(self, problem: str, at: int | None = None) -> NoReturn:
        """Raise a `FormatError` at place ``at``, or at the next token."""
        place = self.token.at if at is None else at
        self._raise(f"{problem} in {short(self.text)!r}; {self.wanted}", place)

    def fail_unexpected(self) -> NoReturn:
        """Raise a `FormatError` that the next token cannot stand where it does."""
        kind, text, _ = self.token
        self.fail("it ends too early" if kind == "end" else f"unexpected {short(text)!r}")

    def _raise(self, message: str, at: int) -> NoReturn:
        line = self.text.count("\n", 0, at) + 1
        column = at - self.text.rfind("\n", 0, at)
        raise FormatError(message, path=self.path, line=line, column=column)


def short(text: str) -> str:
    """Return ``text``, cut where it is too long for a message.

    Examples
    --------
    >>> short("a b"), len(short("a" * 1000))
    ('a b', 63)
    """
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "..."

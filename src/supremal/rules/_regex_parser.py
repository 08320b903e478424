"""The syntax of expressions: a text becomes a program in postfix, operands before their operator.

A program is run on a stack, once with terms and once with phrases, so neither needs to recurse, however deep
the expression.  The grammar stands in `supremal.rules.regex`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.rules._scan import NAME, Scanner, Token

MAX_COUNT: Final = 100_000
"""The largest m and n of {m,n}."""

_TOKEN: Final = re.compile(rf"(?P<name>{NAME})|(?P<count>\{{[^{{}}]*\}})|(?P<sign>[().|&~*+?\[\]^])")
_COUNT: Final = re.compile(r"\{\s*([0-9]{1,9})\s*(,?)\s*([0-9]{1,9})?\s*\}")
_WANTED: Final = (
    "events, with blanks between them, and . | & ~ * + ? {m,n} [a b] [^a b] ( ) are possible; "
    "the name of an event that has other signs stands in quotes"
)
_REPEATS: Final = {"*": (0, NONE), "+": (1, NONE), "?": (0, 1)}


@dataclass(frozen=True, slots=True)
class Events:
    """One event: of ``names``, or any but these."""

    names: tuple[str, ...]
    others: bool = False


@dataclass(frozen=True, slots=True)
class Repeat:
    """The last operand ``least`` to ``most`` times; `NONE`: as often as you like."""

    least: int
    most: int


@dataclass(frozen=True, slots=True)
class Complement:
    """The words that the last operand does not match."""


Op = Literal["then", "or", "and"]


@dataclass(frozen=True, slots=True)
class Join:
    """The last ``parts`` operands joined; none of them after one another: the empty word."""

    op: Op
    parts: int


Step = Events | Repeat | Complement | Join


def parse(text: str, alphabet: Alphabet, *, path: str) -> list[Step]:
    """Return the program of an expression.

    Raises
    ------
    FormatError
        If the text does not parse or names an unknown event; gives line and column.

    Examples
    --------
    >>> parse("a .*", Alphabet(("a", "b")), path="example")[1:]
    [Events(names=(), others=True), Repeat(least=0, most=-1), Join(op='then', parts=2)]
    """
    parser = _Parser(Scanner(text, _TOKEN, path=path, wanted=_WANTED), alphabet)
    parser.expression()
    if parser.scan.token.kind != "end":
        parser.scan.fail_unexpected()
    return parser.program


class _Parser:
    """Recursive descent; every method appends the program of what it has read."""

    def __init__(self, scan: Scanner, alphabet: Alphabet) -> None:
        self.scan, self.alphabet = scan, alphabet
        self.program: list[Step] = []

    def join(self, op: Op, parts: int) -> None:
        if parts != 1:
            self.program.append(Join(op, parts))

    def expression(self) -> None:
        self.term()
        parts = 1
        while self.scan.take("|"):
            self.term()
            parts += 1
        self.join("or", parts)

    def term(self) -> None:
        self.sequence()
        parts = 1
        while self.scan.take("&"):
            self.sequence()
            parts += 1
        self.join("and", parts)

    def sequence(self) -> None:
        self.factor()
        parts = 1
        while self.scan.token.kind == "name" or self.scan.sees("(", "[", ".", "~"):
            self.factor()
            parts += 1
        self.join("then", parts)

    def factor(self) -> None:
        complements = 0
        while self.scan.take("~"):
            complements += 1
        self.atom()
        while self.scan.token.kind == "count" or self.scan.sees(*_REPEATS):
            token = self.scan.next()
            self.program.append(Repeat(*(_REPEATS.get(token.text) or self.count(token))))
        self.program += [Complement()] * complements

    def atom(self) -> None:
        if self.scan.token.kind == "name":
            self.program.append(Events((self.event(),)))
        elif self.scan.take("."):
            self.program.append(Events((), others=True))
        elif self.scan.take("["):
            others = self.scan.take("^")
            names = [self.event()]
            while not self.scan.take("]"):
                names.append(self.event())
            self.program.append(Events(tuple(dict.fromkeys(names)), others))
        elif self.scan.take("("):
            if self.scan.take(")"):
                self.join("then", 0)
                return
            with self.scan.level():
                self.expression()
            self.scan.expect(")")
        else:
            self.scan.fail_unexpected()

    def event(self) -> str:
        if self.scan.token.kind != "name":
            self.scan.fail_unexpected()
        return self.scan.event(self.scan.next(), self.alphabet)

    def count(self, token: Token) -> tuple[int, int]:
        match = _COUNT.fullmatch(token.text)
        if match is None or (match[3] and not match[2]):
            self.scan.fail(f"{token.text!r} is no count, which is {{m}}, {{m,}} or {{m,n}},", token.at)
        least = int(match[1])
        most = int(match[3]) if match[3] else NONE if match[2] else least
        if max(least, most) > MAX_COUNT:
            self.scan.fail(f"{token.text} counts further than {MAX_COUNT:,}", token.at)
        if NONE != most < least:
            self.scan.fail(f"{token.text} asks for at least {least} and at most {most}", token.at)
        return least, most

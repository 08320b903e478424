"""Reading a formula: from its text to a tree of the operators as they were written.

The grammar is in `supremal.rules.ltlf`.  Each tree remembers where something in it looks ahead, since what
looks back may not contain that.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.rules._scan import NAME, Scanner, Token, short

AHEAD: Final = ("X", "N", "F", "G", "U", "W", "R", "M")
BACK: Final = ("Y", "Z", "O", "H", "S", "B", "T")
MAX_BOUND: Final = 100_000
"""The largest k of ``F[<=k]``."""

_SPELLINGS: Final = {
    "WX": "N",
    **dict.fromkeys(("not", "~", "¬"), "!"),
    **dict.fromkeys(("and", "&&", "∧"), "&"),
    **dict.fromkeys(("or", "||", "∨"), "|"),
    **dict.fromkeys(("=>", "→"), "->"),
    **dict.fromkeys(("<=>", "↔"), "<->"),
}
_TIGHTNESS: Final = {"<->": 0, "->": 1, "|": 2, "&": 3, **dict.fromkeys("UWRMSBT", 4)}
_UNARY: Final = ("!", *"XNFGYZOH")
_BOUNDED: Final = (*"FGUWRMOHSBT",)
_WORDS: Final = ("true", "false", "not", "and", "or", "WX", *AHEAD, *BACK)
_BOUND: Final = re.compile(r"\[\s*<=\s*([0-9]{1,9})\s*\]")
_TOKEN: Final = re.compile(
    rf"(?P<bound>\[\s*<=[^\]]*\]?)|(?P<sign>(?:{'|'.join(_WORDS)})\b|<->|<=>|->|=>|&&|\|\||[][()!~&|¬∧∨→↔])"
    rf"|(?P<name>{NAME})"
)


@dataclass(frozen=True, slots=True)
class Tree:
    """A formula as it was written.

    Parameters
    ----------
    op
        ``event``, ``true``, ``false``, a connective or a temporal operator, in one spelling each.
    parts
        What it is applied to; as many as were written of ``&`` and ``|``.
    events
        Those of an ``event``: one of them has to happen.
    bound
        The k of ``[<=k]``, None where there is none.
    ahead
        Where in the text something in it looks ahead, `NONE` where nothing does.
    """

    op: str
    parts: tuple[Tree, ...] = ()
    events: tuple[str, ...] = ()
    bound: int | None = None
    ahead: int = NONE

    def walk(self) -> list[Tree]:
        """Return this tree and all trees in it, wholes before parts."""
        found, rest = list[Tree](), [self]
        while rest:
            tree = rest.pop()
            found.append(tree)
            rest += tree.parts
        return found


def parse(text: str, alphabet: Alphabet | None = None, *, path: str = "formula") -> Tree:
    """Return the tree of ``text``; without an ``alphabet`` any name is that of an event.

    Raises
    ------
    FormatError
        If the text does not parse; gives line and column.
    """
    wanted = "a formula of events, ! & | -> <-> and operators such as G, F[<=5], U and O is needed"
    clashes = [f'"{word}"' for word in _WORDS if alphabet and word in alphabet and word in text]
    if clashes:
        wanted += f"; an event that is named like an operator has to be quoted: {', '.join(clashes)}"
    parser = _Parser(Scanner(text, _TOKEN, path=path, wanted=wanted), alphabet)
    tree = parser.formula()
    if parser.tokens.token.kind != "end":
        parser.tokens.fail_unexpected()
    return tree


class _Parser:
    """Recursive descent; every method returns the tree of what it has read."""

    def __init__(self, tokens: Scanner, alphabet: Alphabet | None) -> None:
        self.tokens, self.alphabet = tokens, alphabet

    def formula(self, loosest: int = 0) -> Tree:
        """Read operators that bind at least as tightly as ``loosest``, and what they are applied to."""
        with self.tokens.level():
            left = self.factor()
            while (tightness := _TIGHTNESS.get(self.sign(), -1)) >= loosest:
                op, place = self.sign(), self.tokens.next().at
                if op in "&|":  # any number of parts: a long list is no deep nesting
                    parts = [left, self.formula(tightness + 1)]
                    while self.sign() == op:
                        self.tokens.next()
                        parts.append(self.formula(tightness + 1))
                    left = self.tree(op, place, *parts)
                else:
                    bound = self.bound(op)
                    left = self.tree(op, place, left, self.formula(tightness), bound=bound)
        return left

    def factor(self) -> Tree:
        op, token = self.sign(), self.tokens.token
        if token.kind != "name" and op not in ("(", "[", "true", "false", *_UNARY):
            self.tokens.fail_unexpected()
        self.tokens.next()
        if token.kind == "name":
            return Tree("event", events=(self.event(token),))
        if op == "(":
            inside = self.formula()
            self.tokens.expect(")")
            return inside
        if op == "[":
            return self.one_of(token.at)
        if op in ("true", "false"):
            if self.alphabet and op in self.alphabet:
                self.tokens.fail(f"{op!r} is a constant and an event", token.at)
            return Tree(op)
        bound = self.bound(op)
        with self.tokens.level():
            return self.tree(op, token.at, self.factor(), bound=bound)

    def one_of(self, place: int) -> Tree:
        """Read the events of a list whose bracket was opened at ``place``."""
        events: list[str] = []
        while not self.tokens.take("]"):
            token = self.tokens.token
            if token.kind != "name" and token.text not in _WORDS:
                self.tokens.fail_unexpected()
            if token.text.isdigit() and self.alphabet and token.text not in self.alphabet:
                self.tokens.fail(f"{short(token.text)!r} is no event, and a bound is written [<=k],")
            events.append(self.event(self.tokens.next()))
        if not events:
            self.tokens.fail("'[]' names no event", place)
        return Tree("event", events=tuple(dict.fromkeys(events)))

    def event(self, token: Token) -> str:
        return token.text if self.alphabet is None else self.tokens.event(token, self.alphabet)

    def sign(self) -> str:
        """Return the next token in its one spelling, "" where it is no sign."""
        kind, text, _ = self.tokens.token
        return _SPELLINGS.get(text, text) if kind == "sign" else ""

    def bound(self, op: str) -> int | None:
        """Read the bound of ``op``, if there is one."""
        kind, text, _ = self.tokens.token
        if kind != "bound":
            return None
        if op not in _BOUNDED:
            self.tokens.fail(f"{op!r} takes no bound")
        match = _BOUND.fullmatch(text)
        if match is None or int(match[1]) > MAX_BOUND:
            self.tokens.fail(f"{short(text)!r} is no bound, which is [<=k] with k from 0 to {MAX_BOUND:,},")
        self.tokens.next()
        return int(match[1])

    def tree(self, op: str, place: int, *parts: Tree, bound: int | None = None) -> Tree:
        """Return a tree; fail where ``op``, written at ``place``, looks back on what looks ahead."""
        ahead = place if op in AHEAD else max((part.ahead for part in parts), default=NONE)
        if op in BACK and ahead != NONE:
            problem = (
                f"{op!r} looks back and may not contain what looks ahead; put that outside, as in "
                "G (a -> O b),"
            )
            self.tokens.fail(problem, ahead)
        return Tree(op, parts, bound=bound, ahead=ahead)

"""Regular expressions: the derivative of a term by an event is what may follow that event.

    ∂(set) = () or nothing    ∂(x | y) = ∂x | ∂y    ∂(x & y) = ∂x & ∂y    ∂(~x) = ~∂x
    ∂(x{m,n}) = ∂x x{m-1,n-1}    ∂(x y) = ∂x y, and | ∂y where x has the empty word

Terms that differ only in the order of ``|`` and ``&`` are one term, so that there are finitely many.

Source: Brzozowski, "Derivatives of regular expressions", JACM 11 (1964).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from .texts import Budget, Meaning, Reader, refuse

NOTHING, EMPTY, ALL = 0, 1, 2
"""The terms of no word, of the empty word, and of all words."""

_COUNTS: Final = {"*": (0, math.inf), "+": (1, math.inf), "?": (0, 1)}


class Terms:
    """Terms by number, each once: an operator and its operands, and whether it has the empty word.

    ``set`` (of events), ``or``, ``and``, ``then``, ``not``, ``repeat`` (x, least, most), and ``walk``
    (step, state): the words that a function, which returns None where it breaks, can follow.
    """

    def __init__(self, budget: Budget) -> None:
        self.budget = budget
        self.number: dict[tuple[Any, ...], int] = {}
        self.terms: list[tuple[Any, ...]] = []
        self.empty: list[bool] = []
        self.after: dict[tuple[int, str], int] = {}
        for op, empty in (("or", False), ("then", True), ("and", True)):  # of no operands
            self.make(op, empty=empty)

    def make(self, op: str, *args: Any, empty: bool) -> int:  # noqa: ANN401 - operands of all kinds
        """Return the number of a term."""
        self.budget.spend(1 + len(args))
        term = self.number.setdefault((op, *args), len(self.terms))
        if term == len(self.terms):
            self.terms.append((op, *args))
            self.empty.append(empty)
        return term

    def set(self, events: frozenset[str]) -> int:
        """Return the term of one event of a set."""
        self.budget.spend(len(events))
        return self.make("set", events, empty=False)

    def walk(self, step: Callable[[Any, str], Any], state: object) -> int:
        """Return the term of the words that ``step`` can follow from ``state``."""
        return NOTHING if state is None else self.make("walk", step, state, empty=True)

    def join(self, op: str, parts: Iterable[int]) -> int:
        """Return the union ("or") or intersection ("and")."""
        zero, over = (ALL, any) if op == "or" else (NOTHING, all)
        flat = set(self.flat(op, parts))
        if zero in flat or len(flat) == 1:
            return zero if zero in flat else flat.pop()
        return self.make(op, *sorted(flat), empty=over(self.empty[part] for part in flat))

    def then(self, parts: Iterable[int]) -> int:
        """Return the words of the parts, one after another."""
        flat = self.flat("then", parts)
        if NOTHING in flat:
            return NOTHING
        if len(flat) == 1:
            return flat[0]
        if flat and self.terms[flat[0]][0] == "or":
            return self.join("or", [self.then([part, *flat[1:]]) for part in self.terms[flat[0]][1:]])
        return self.make("then", *flat, empty=all(self.empty[part] for part in flat))

    def flat(self, op: str, parts: Iterable[int]) -> list[int]:
        """Take parts of the same operator apart."""
        terms = self.terms
        return [one for part in parts for one in (terms[part][1:] if terms[part][0] == op else (part,))]

    def repeat(self, term: int, least: int, most: float) -> int:
        """Return ``least`` to ``most`` words of a term."""
        if most == 0 or term == EMPTY or (term == NOTHING and least == 0):
            return EMPTY
        least = 0 if self.empty[term] else least
        return self.make("repeat", term, least, most, empty=least == 0)

    def invert(self, term: int) -> int:
        """Return the words that a term does not have."""
        if self.terms[term][0] == "not":
            return int(self.terms[term][1])
        return ALL - term if term in (NOTHING, ALL) else self.make("not", term, empty=not self.empty[term])

    def derive(self, term: int, event: str) -> int:
        """Return what may follow ``event``."""
        self.budget.spend(1)
        if (term, event) not in self.after:
            self.after[term, event] = self._derive(event, *self.terms[term])
        return self.after[term, event]

    def _derive(self, event: str, op: str, *args: Any) -> int:  # noqa: ANN401 - as in `make`
        match op:
            case "set":
                return EMPTY if event in args[0] else NOTHING
            case "not":
                return self.invert(self.derive(args[0], event))
            case "repeat":
                part, least, most = args
                return self.then([self.derive(part, event), self.repeat(part, max(least - 1, 0), most - 1)])
            case "walk":
                return self.walk(args[0], args[0](args[1], event))
            case "or" | "and":
                return self.join(op, [self.derive(part, event) for part in args])
        ways: list[int] = []
        for i, part in enumerate(args):
            ways.append(self.then([self.derive(part, event), *args[i + 1 :]]))
            if not self.empty[part]:
                break
        return self.join("or", ways)

    def meaning(self, term: int) -> Meaning:
        """Return which words a term has."""
        sets = [args[0] for op, *args in self.terms if op == "set"]
        return Meaning(term, self.derive, self.empty.__getitem__, sets, backwards=False)


class Expression(Reader):
    """Reading an expression, in which ``names`` stand for sets of events among ``sigma``."""

    def __init__(
        self, text: str, terms: Terms, sigma: frozenset[str], names: Mapping[str, frozenset[str]]
    ) -> None:
        super().__init__(text, r"\{[^{}]*\}|[().|&~*+?\[\]^]")
        self.terms, self.sigma, self.names = terms, sigma, names
        terms.budget.spend(len(text))
        self.term = self._either()
        self._expect_end()

    def _either(self) -> int:
        parts = [self._both()]
        while self._take("|"):
            parts.append(self._both())
        return self.terms.join("or", parts)

    def _both(self) -> int:
        parts = [self._sequence()]
        while self._take("&"):
            parts.append(self._sequence())
        return self.terms.join("and", parts)

    def _sequence(self) -> int:
        parts = [self._factor()]
        while self.tokens[-1] and self.tokens[-1][0] in '"([.~':
            parts.append(self._factor())
        return self.terms.then(parts)

    def _factor(self) -> int:
        inverted = False
        while self._take("~"):
            inverted = not inverted
        term = self._atom()
        while self.tokens[-1] and self.tokens[-1][0] in "*+?{":
            term = self.terms.repeat(term, *_count(self._next()))
        return self.terms.invert(term) if inverted else term

    def _atom(self) -> int:
        if self._take("("):
            term = EMPTY if self.tokens[-1] == ")" else self._either()
            self._expect(")")
            return term
        if self._take("."):
            return self.terms.set(self.sigma)
        if not self._take("["):
            return self.terms.set(self.names[self._name(self.names)])
        others = self._take("^")
        events = self.names[self._name(self.names)]
        while not self._take("]"):
            events |= self.names[self._name(self.names)]
        return self.terms.set(self.sigma - events if others else events)


def _count(text: str) -> tuple[int, float]:
    if text in _COUNTS:
        return _COUNTS[text]
    least, comma, most = (part.strip() for part in text[1:-1].partition(","))
    for word in (least, most or least):
        if not re.fullmatch("[0-9]{1,9}", word):
            refuse(f"{word!r} is no count")
    high = int(most) if most else math.inf if comma else int(least)
    if high < int(least):
        refuse(f"{text} asks for at least {least} and at most {most}")
    return int(least), high


def expression_meaning(text: str, sigma: frozenset[str], budget: Budget) -> Meaning:
    """Return which words over ``sigma`` an expression allows."""
    terms = Terms(budget)
    return terms.meaning(Expression(text, terms, sigma, {e: frozenset({e}) for e in sigma}).term)

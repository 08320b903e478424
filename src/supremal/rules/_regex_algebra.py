"""The algebra of expressions: terms, each of which exists once, and their derivatives.

Terms that are *similar* are one: | and & associate, commute and do not mind repetition; nothing, the empty
word and everything are units or zeros; sets of events merge; stars of stars and complements of complements
fold; and (r | s) t is r t | s t, which keeps derivatives flat.  Up to that a term has finitely many.

No method recurses over terms: they may nest as deep as they like.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from functools import reduce
from typing import Final

from supremal._arrays import NONE
from supremal.rules._derive import Budget

NOTHING: Final = 0
"""The term that matches no word."""

EMPTY: Final = 1
"""The term that matches the empty word only."""


class Algebra:
    """Terms over classes of events.  A term is a number; equal terms have equal numbers.

    Parameters
    ----------
    kinds
        How many classes of events there are.
    budget
        What all the work may take, in steps of about a microsecond and 200 bytes at most.

    Examples
    --------
    >>> algebra = Algebra(2, Budget(1000, "example"))
    >>> a, b = algebra.events({0}), algebra.events({1})
    >>> ab = algebra.join("then", [a, b])
    >>> algebra.derivative(ab, 0) == b, algebra.derivative(ab, 1) == NOTHING
    (True, True)
    """

    def __init__(self, kinds: int, budget: Budget) -> None:
        self._spend = budget.spend
        self._number: dict[tuple[str, tuple[int, ...]], int] = {}
        self._ops: list[str] = []
        self._args: list[tuple[int, ...]] = []
        self._empty: list[bool] = []
        self._after: list[dict[int, int]] = [{} for _ in range(kinds)]
        self._all = (1 << kinds) - 1
        self._term("events", (0,), empty=False)
        self._term("empty", (), empty=True)
        self._everything = self.repeat(self.events((), others=True), 0, NONE)

    def _term(self, op: str, args: tuple[int, ...], *, empty: bool) -> int:
        """Return the number of a term; ``empty``: whether it matches the empty word."""
        self._spend(1 + len(args))
        term = self._number.setdefault((op, args), len(self._ops))
        if term == len(self._ops):
            self._ops.append(op)
            self._args.append(args)
            self._empty.append(empty)
        return term

    def accepts_empty(self, term: int) -> bool:
        """Whether ``term`` matches the empty word."""
        return self._empty[term]

    def events(self, kinds: Iterable[int], *, others: bool = False) -> int:
        """Return the term of one event of ``kinds``, or of any but these."""
        mask = sum(1 << kind for kind in set(kinds))
        return self._events(self._all ^ mask if others else mask)

    def _events(self, mask: int) -> int:
        return self._term("events", (mask,), empty=False)

    def complement(self, term: int) -> int:
        """Return the term of the words that ``term`` does not match."""
        if self._ops[term] == "not":
            return self._args[term][0]
        if term == NOTHING:
            return self._everything
        if term == self._everything:
            return NOTHING
        return self._term("not", (term,), empty=not self._empty[term])

    def repeat(self, term: int, least: int, most: int) -> int:
        """Return the term of ``least`` to ``most`` words of ``term`` in a row; `NONE`: any number."""
        if term == NOTHING:
            return NOTHING if least else EMPTY
        if term == EMPTY or most == 0:
            return EMPTY
        if self._empty[term]:
            least = 0
        if most == 1 and (least == 1 or self._empty[term]):
            return term
        if self._ops[term] == "repeat":
            inner, low, high = self._args[term]
            if low <= 1 and (high == NONE or (most == NONE and least <= 1)):  # r**, r+*, (r?)+, ...
                term, least, most = inner, low * least, NONE
        return self._term("repeat", (term, least, most), empty=least == 0)

    def join(self, op: str, terms: Sequence[int]) -> int:
        """Return ``terms`` one after the other ("then"), any of them ("or"), or all at once ("and")."""
        if op == "or":
            return self._set(op, terms, unit=NOTHING, zero=self._everything)
        if op == "and":
            return self._set(op, terms, unit=self._everything, zero=NOTHING)
        joined = EMPTY
        for term in reversed(terms):
            joined = self._then(term, joined)
        return joined

    def _then(self, left: int, right: int) -> int:
        if NOTHING in (left, right):
            return NOTHING
        if EMPTY in (left, right):
            return right if left == EMPTY else left
        if self._ops[left] == "or":
            return self.join("or", [self._then(part, right) for part in self._args[left]])
        return self._term("then", (left, right), empty=self._empty[left] and self._empty[right])

    def _set(self, op: str, terms: Sequence[int], *, unit: int, zero: int) -> int:
        """Return the term of | or & of a set of terms."""
        parts: set[int] = set()
        for term in terms:
            parts.update(self._args[term] if self._ops[term] == op else (term,))
        self._spend(len(parts))
        masks = [part for part in parts if self._ops[part] == "events"]
        if len(masks) > 1:
            merge = operator.or_ if op == "or" else operator.and_
            parts.difference_update(masks)
            parts.add(self._events(reduce(merge, (self._args[part][0] for part in masks))))
        parts.discard(unit)
        if zero in parts:
            return zero
        if len(parts) <= 1:
            return parts.pop() if parts else unit
        empty = (any if op == "or" else all)(self._empty[part] for part in parts)
        return self._term(op, tuple(sorted(parts)), empty=empty)

    def derivative(self, term: int, kind: int) -> int:
        """Return the term of what may follow an event of ``kind``: its operands' derivatives first."""
        after = self._after[kind]
        stack = [term]
        while stack:
            waiting = [part for part in self._operands(stack[-1]) if part not in after]
            if waiting:
                stack += waiting
            else:
                top = stack.pop()
                after[top] = self._derived(top, kind, after)
        return after[term]

    def _operands(self, term: int) -> tuple[int, ...]:
        """Return the parts of ``term`` whose derivatives make up its own."""
        args = self._args[term]
        match self._ops[term]:
            case "events" | "empty":
                return ()
            case "then":
                return args if self._empty[args[0]] else args[:1]
            case "repeat":
                return args[:1]
        return args

    def _derived(self, term: int, kind: int, after: dict[int, int]) -> int:
        """Return the derivative of ``term``, given those of its operands."""
        self._spend(2)  # as much as two terms, by the clock
        op, args = self._ops[term], self._args[term]
        match op:
            case "events":
                return EMPTY if args[0] >> kind & 1 else NOTHING
            case "empty":
                return NOTHING
            case "then":
                first = self._then(after[args[0]], args[1])
                return self.join("or", [first, after[args[1]]]) if self._empty[args[0]] else first
            case "repeat":
                part, least, most = args
                return self._then(after[part], self.repeat(part, max(least - 1, 0), most - (most > 0)))
            case "not":
                return self.complement(after[args[0]])
        return self.join(op, [after[part] for part in args])

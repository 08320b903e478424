r"""What is still owed: positive combinations of obligations, in a form that is unique.

An obligation is a formula about the rest of a word, φ U[<=k] ψ or its dual R, and has a *level* that says how
strict it is: k for U, which is the easier the later it ends, and -k for R, which is the easier the sooner it
ends.  So of two obligations that differ in k alone, the one of the lower level implies the other.

A *clause* gives a level to each family of obligations, `FREE` to those that are not owed: all the others are
owed at once.  Two clauses together are their minimum, and one implies the other iff it is ≤ in every place.
*Owed* is a set of clauses of which one has to be met.  A clause that implies another is of no use beside it,
so only the greatest are kept, and two sets are equal iff neither asks for more than the other: that is the
normal form of a distributive lattice.  Of many deadlines of one family, a clause has the strictest alone.

Source: Birkhoff, *Lattice Theory*, 3rd ed. (1967), chapter III, free distributive lattices.
"""

from __future__ import annotations

from collections.abc import Iterable
from operator import le
from typing import Final, TypeAlias

from supremal.rules._derive import Budget
from supremal.rules._ltlf_formulas import UNBOUNDED

FREE: Final = UNBOUNDED + 1
"""The level of an obligation that is not owed."""

_STEPS_A_CALL: Final = 3  # by the clock

Clause: TypeAlias = tuple[int, ...]
Owed: TypeAlias = frozenset[Clause]

LOST: Final[Owed] = frozenset()
"""No way is left to meet what is owed."""


class Lattice:
    """The sets of clauses over ``families`` families.

    Examples
    --------
    Within 5 or within 3 is within 5, and within 5 and within 3 is within 3:

    >>> lattice = Lattice(1, Budget(100, "example"))
    >>> three, five = lattice.obligation(0, 3), lattice.obligation(0, 5)
    >>> lattice.any_of([three, five]) == five, lattice.all_of([three, five]) == three
    (True, True)
    """

    def __init__(self, families: int, budget: Budget) -> None:
        self._families, self._budget = families, budget
        self._steps = 1 + families // 32  # of looking at one clause
        self.met: Owed = frozenset([(FREE,) * families])

    def obligation(self, family: int, level: int) -> Owed:
        """Return a single obligation."""
        return frozenset([(FREE,) * family + (level,) + (FREE,) * (self._families - family - 1)])

    def constant(self, truth: object) -> Owed:
        """Return what is met already, or lost."""
        return self.met if truth else LOST

    def all_of(self, parts: Iterable[Owed]) -> Owed:
        """Return what is owed where all ``parts`` are."""
        sure, choices = list[Clause](self.met), list[Owed]()
        for part in parts:
            if not part:
                return LOST
            if len(part) == 1:  # by far most are
                sure += part
            else:
                choices.append(part)
        self._budget.spend(_STEPS_A_CALL + len(sure) * self._steps)
        owed = {tuple(map(min, *sure))} if len(sure) > 1 else set(sure)
        for choice in choices:
            self._budget.spend(len(owed) * len(choice) * self._steps)
            owed = self._greatest(tuple(map(min, c, d)) for c in owed for d in choice)
        return frozenset(owed)

    def any_of(self, parts: Iterable[Owed]) -> Owed:
        """Return what is owed where one of ``parts`` is."""
        self._budget.spend(_STEPS_A_CALL)
        return frozenset(self._greatest(clause for part in parts for clause in part))

    def _greatest(self, clauses: Iterable[Clause]) -> set[Clause]:
        """Return the clauses that imply no other."""
        distinct = set(clauses)
        if len(distinct) < 2:
            return distinct
        kept: list[Clause] = []
        for clause in sorted(distinct, key=sum, reverse=True):  # what a clause implies has a greater sum
            self._budget.spend(len(kept))
            if not any(all(map(le, clause, other)) for other in kept):
                kept.append(clause)
        return set(kept)

r"""Progression: what a formula leaves to be done when an event has happened.

A formula at a moment is either decided by the event that happens there or says something about the moments
that follow, and what it says is a combination of *obligations* (see `supremal.rules._ltlf_obligations`):

    (X φ)     leaves  true U[<=0] φ: there is a next moment, and φ holds at it
    (φ U ψ)   leaves  what ψ leaves, or what φ leaves together with φ U ψ
    (φ U[<=k] ψ)      the same with φ U[<=k-1] ψ, and for k = 0 what ψ leaves

and dually for negations.  At the end of the word an obligation of U is not met, and one of R is.

Formulas that look back are decided by the event and the memory that `supremal.rules._ltlf_past` carries; a
*letter* is the event together with their truth.  What each node leaves after a letter is computed once.

Source: Bacchus, Kabanza, "Planning for temporally extended goals", AAAI 1996, for progression; De Giacomo,
Vardi, "Linear temporal logic and linear dynamic logic on finite traces", IJCAI 2013, for LTLf.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple, TypeAlias

from supremal.rules._derive import Budget
from supremal.rules._ltlf_formulas import LOOKING_BACK, TRUE, UNBOUNDED, Formulas
from supremal.rules._ltlf_obligations import FREE, LOST, Lattice, Owed
from supremal.rules._ltlf_past import Memory, Past

_OWING: Final = ("next", "until")
_STEPS_A_DERIVATIVE: Final = 5
"""What a derivative costs, besides what comes out of it."""

State: TypeAlias = tuple[Memory, Owed]


class _Family(NamedTuple):
    """Obligations that differ in their level alone: left U right, or left R right where it is ``dual``."""

    left: int
    right: int
    dual: int


class _Letter(NamedTuple):
    """What each formula leaves after a letter, and each obligation: a family and a level."""

    formulas: dict[int, Owed]
    obligations: dict[tuple[int, int], Owed]


class Progression:
    """The derivatives of one formula.

    Parameters
    ----------
    core, formula
        The formula.
    events
        One event of each class.
    budget
        What unfolding may cost.
    """

    def __init__(self, core: Formulas, formula: int, events: Sequence[str], budget: Budget) -> None:
        self._core, self._events, self._budget = core, events, budget
        # Before the first event the formula is owed at the next moment; it says whether that has to come.
        weak = core.holds_on_nothing(formula)
        begin = core.at_next(formula ^ weak) ^ weak
        self._order = sorted(core.inside(begin))  # parts before wholes
        self._past = Past(core, {f >> 1 for f in self._order if core.node(f).op in LOOKING_BACK})
        self._families = list({self._family(f): None for f in self._order if core.node(f).op in _OWING})
        self._place = {family: place for place, family in enumerate(self._families)}
        self._lattice = Lattice(len(self._families), budget)
        self._letters: dict[tuple[int, tuple[bool, ...]], _Letter] = {}
        self.start: State = self._past.start, self._lattice.obligation(*self._owing(begin))

    def derive(self, state: State, kind: int) -> State:
        """Return what is left of ``state`` when an event of class ``kind`` has happened."""
        memory, owed = state
        if owed in (LOST, self._lattice.met):
            return state
        self._budget.spend(_STEPS_A_DERIVATIVE)
        memory, truths = self._past.step(memory, self._events[kind])
        letter = self._letters.get((kind, truths)) or self._read(kind, truths)
        left = self._lattice.any_of(
            [
                self._lattice.all_of(
                    [self._after(letter, place, level) for place, level in enumerate(clause) if level != FREE]
                )
                for clause in owed
            ]
        )
        return ((), left) if left in (LOST, self._lattice.met) else (memory, left)

    def accepts(self, state: State) -> bool:
        """Tell whether nothing has to happen any more: some clause owes no U."""
        return any(
            all(level == FREE or family.dual for level, family in zip(clause, self._families, strict=True))
            for clause in state[1]
        )

    def _read(self, kind: int, truths: tuple[bool, ...]) -> _Letter:
        """Compute what each formula leaves after a letter."""
        core, lattice = self._core, self._lattice
        looking_back = dict(zip(self._past.roots, truths, strict=True))
        letter = self._letters[kind, truths] = _Letter({}, {})
        self._budget.spend(len(self._order))
        for formula in self._order:
            op, _, events, _ = core.node(formula)
            negated = formula & 1
            match op:
                case "true":
                    left = lattice.constant(not negated)
                case "event":
                    left = lattice.constant((self._events[kind] in events) ^ negated)
                case "previous" | "since":
                    left = lattice.constant(looking_back[formula >> 1] ^ negated)
                case "and":
                    lefts = [letter.formulas[part] for part in core.parts(formula)]
                    left = lattice.any_of(lefts) if negated else lattice.all_of(lefts)
                case "next":
                    left = lattice.obligation(*self._owing(formula))
                case "until":
                    left = self._after(letter, *self._owing(formula))
            letter.formulas[formula] = left
        return letter

    def _after(self, letter: _Letter, place: int, level: int) -> Owed:
        """Return what the obligation of family ``place`` and ``level`` leaves."""
        known = letter.obligations.get((place, level))
        if known is not None:
            return known
        family, lattice = self._families[place], self._lattice
        left = letter.formulas[family.right]
        if level:
            nearer = level
            if abs(level) != UNBOUNDED:
                nearer += 1 if family.dual else -1
            stays = [letter.formulas[family.left], lattice.obligation(place, nearer)]
            if family.dual:
                left = lattice.all_of([left, lattice.any_of(stays)])
            else:
                left = lattice.any_of([left, lattice.all_of(stays)])
        letter.obligations[place, level] = left
        return left

    def _family(self, formula: int) -> _Family:
        """Return the family of an obligation; X φ is true U[<=0] φ."""
        dual = formula & 1
        left, right = (TRUE ^ dual, *self._core.parts(formula))[-2:]
        return _Family(left, right, dual)

    def _owing(self, formula: int) -> tuple[int, int]:
        """Return the place of the family of an obligation, and its level."""
        node = self._core.node(formula)
        level = 0 if node.op == "next" else node.bound
        return self._place[self._family(formula)], -level if formula & 1 else level

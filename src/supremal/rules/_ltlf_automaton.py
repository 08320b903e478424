"""From a formula to its automaton, by progression, or part by part.

A small formula is progressed as a whole.  A large one that is a conjunction or a disjunction is taken apart:
the minimal automata of its parts are combined one after the other, and what comes out is minimised each time.
So the choices in one part are not multiplied with those in another before it is known that they matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from typing import Final

import numpy as np

from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.boolean import language_union, meet
from supremal.automata.minimise import minimise
from supremal.automata.reduce import trim
from supremal.errors import AutomatonError, RuleError
from supremal.rules._derive import Budget, derived
from supremal.rules._ltlf_formulas import Formulas
from supremal.rules._ltlf_progression import Progression

_SMALL: Final = 24
"""The most formulas inside one that is progressed as a whole."""

_STEPS_AN_AUTOMATON: Final = 500
"""What minimising an automaton costs, however small it is."""

_ENTRIES_A_STEP: Final = 4
"""Entries of a product's table that cost as much as a step of progression."""


class Unfolding:
    """The automata of the formulas of ``core``, over the classes of events.

    Parameters
    ----------
    core
        The formulas.
    events
        One event of each class.
    budget
        The steps that all may take together; it knows the name of the rule.
    max_states
        The most states of each automaton, before it is minimised.
    """

    def __init__(self, core: Formulas, events: Sequence[str], budget: Budget, max_states: int) -> None:
        self._core, self._events, self._budget, self._max_states = core, events, budget, max_states
        self._classes = np.arange(len(events), dtype=np.int32)
        self._alphabet = Alphabet(tuple(map(str, range(len(events)))))

    def automaton(self, formula: int) -> Automaton:
        """Return the minimal automaton of ``formula``."""
        needed, rest = set[int](), [formula]
        while rest:
            part = rest.pop()
            if part not in needed:
                needed.add(part)
                rest += self._apart(part)
        known: dict[int, Automaton] = {}
        for whole in sorted(needed):  # parts before wholes
            parts = [known[part] for part in self._apart(whole)]
            known[whole] = self._together(parts, union=whole & 1) if parts else self._progressed(whole)
        return known[formula]

    def _apart(self, formula: int) -> list[int]:
        """Return the parts that a large conjunction or disjunction is taken apart into; of others none."""
        large = sum(1 for _ in islice(self._core.inside(formula), _SMALL + 1)) > _SMALL
        return self._core.parts(formula) if large and self._core.node(formula).op == "and" else []

    def _progressed(self, formula: int) -> Automaton:
        self._budget.spend(_STEPS_AN_AUTOMATON)
        progression = Progression(self._core, formula, self._events, self._budget)
        return derived(
            progression.start,
            progression.derive,
            progression.accepts,
            alphabet=self._alphabet,
            classes=self._classes,
            name=self._budget.name,
            max_states=self._max_states,
        )

    def _together(self, parts: Sequence[Automaton], *, union: int) -> Automaton:
        """Return the minimal automaton of the union or the intersection of ``parts``."""
        combine = language_union if union else meet
        whole = parts[0]
        for part in parts[1:]:
            room = self._budget.left * _ENTRIES_A_STEP // max(len(self._events), 1)
            limit = min(self._max_states, room)
            try:
                product = combine(whole, part, max_states=limit)
            except AutomatonError:
                message = (
                    f"rule {self._budget.name!r} unfolds to more than {limit:,} states where its parts come "
                    "together; split it into several rules, or raise max_states"
                )
                raise RuleError(message) from None
            self._budget.spend(_STEPS_AN_AUTOMATON + product.delta.size // _ENTRIES_A_STEP)
            whole = minimise(trim(product))
        return whole

"""One run of a supervised environment: in which state the supervisor is, and what has gone wrong.

As long as only happens what the supervisor allows, a run is one number, the supervisor's state.  A run
*leaves* the supervisor where an event happens that it does not have: one that the plant cannot follow, or
one that is disabled.  From there each plant and each rule is followed on its own.  A rule that breaks counts
as a violation and starts again from its initial state, as in `supremal.learning.monitors`; a plant that
cannot follow is lost.  Where none is, and the states of all parts are again those of some state of the
supervisor, the run is back in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from functools import cached_property

import numpy as np

from supremal._arrays import NONE
from supremal.envs._supervised_model import Masks, SupervisedModel
from supremal.envs._supervised_word import check_name


class Run:
    """One run of a model.

    Parameters
    ----------
    model
        Shared, never changed.

    Notes
    -----
    ``state`` is the supervisor's, `NONE` outside of it; ``surprise`` is the first event that happened
    although the plant said that it could not, or although it was disabled and not chosen.
    """

    def __init__(self, model: SupervisedModel) -> None:
        self.model = model
        automaton = model.supervisor.automaton
        self._column = {name: e for e, name in enumerate(automaton.alphabet)}
        self._target = automaton.delta.reshape(-1).item  # plain integers
        self._width = len(automaton.alphabet)
        self._takes_part = model.causes.product.takes_part
        self.reset()

    def reset(self) -> None:
        """Go back to the initial state."""
        self.state = 0
        self.surprise: str | None = None
        self._outside: list[int] = []

    @property
    def parts(self) -> list[int]:
        """The state of each plant and each rule; `NONE` for a plant that is lost."""
        if self.state == NONE:
            return list(self._outside)
        parts: list[int] = self.model.supervisor.automaton.origin[self.state].tolist()
        return parts

    @property
    def owed(self) -> int:
        """How many rules are not satisfied where the run is."""
        states = self.parts[len(self.model.plants) :]
        return sum(not rule.marked[q] for rule, q in zip(self.model.rules, states, strict=True))

    def observe(self, word: Sequence[str], chosen: str = "") -> int:
        """Follow the events that occurred, in order; return how many rules they broke.

        Parameters
        ----------
        word
            An event that no part knows touches nothing.
        chosen
            The event of the action that the agent chose.
        """
        state = self.state
        if state == NONE:
            return self._follow(word)
        for k, name in enumerate(word):
            try:
                event = self._column[name]
            except (KeyError, TypeError):
                check_name(name)
                continue
            to = self._target(state * self._width + event)
            if to == NONE:
                self.state = state
                self._outside, self.state = self.parts, NONE
                self.surprise = self.surprise or (name if name != chosen else None)
                return self._follow(word[k:])
            state = to
        self.state = state
        return 0

    def look_ahead(self) -> Masks:
        """Return which actions break no rule at once, ``int8 [A]``; plants are not asked."""
        states, rules = self.parts[len(self.model.plants) :], self.model.rules
        takes_part = (self._takes_part[self._column[event]][1] for event in self.model.events)
        return np.array(
            [all(rules[k].delta[states[k], c] != NONE for k, c in parts) for parts in takes_part], np.int8
        )

    def _follow(self, word: Sequence[str]) -> int:
        """Follow ``word`` outside the supervisor, part by part."""
        parts, plants, rules = self._outside, self.model.plants, self.model.rules
        broken = 0
        for name in word:
            check_name(name)
            if name not in self._column:
                continue
            in_plants, in_rules = self._takes_part[self._column[name]]
            for k, column in in_plants:
                if parts[k] != NONE:
                    parts[k] = int(plants[k].delta[parts[k], column])
                    if parts[k] == NONE:
                        self.surprise = self.surprise or name
            for k, column in in_rules:
                to = int(rules[k].delta[parts[len(plants) + k], column])
                broken += to == NONE
                parts[len(plants) + k] = max(to, 0)
        self.state = self._numbers.get(tuple(parts), NONE)
        return broken

    def another(self) -> Run:
        """Return another run of the same model, in the initial state."""
        _ = self._numbers  # made once for all of them
        other = copy(self)
        other.reset()
        return other

    @cached_property
    def _numbers(self) -> dict[tuple[int, ...], int]:
        """The state of the supervisor that parts in these states make."""
        return {tuple(parts): s for s, parts in enumerate(self.model.supervisor.automaton.origin.tolist())}

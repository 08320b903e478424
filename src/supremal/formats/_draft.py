"""An automaton that is being read: events, states and transitions in the order in which a file has them."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import numpy as np

from supremal._arrays import NONE, Ints, Longs
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.build import empty
from supremal.errors import AutomatonError, suggest
from supremal.formats._page import NOWHERE, Page, shown
from supremal.formats.model import size_problem


class Draft:
    """An automaton from ``page``.

    ``events`` and ``states`` number the names; ``initial`` and ``marked`` hold numbers of states.

    Examples
    --------
    >>> draft = Draft(Page("light.fsm"), "light")
    >>> dark, on = draft.state("dark"), draft.event("on")
    >>> draft.edge(dark, on, draft.state("lit"))
    >>> draft.initial = dark
    >>> draft.automaton()
    <Automaton 'light': 2 states, 1 transitions, 1 events>
    """

    def __init__(self, page: Page, name: str) -> None:
        self.page, self.name = page, name
        self.events: dict[str, int] = {}
        self.uncontrollable: set[str] = set()
        self.unobservable: set[str] = set()
        self.states: dict[str, int] = {}
        self.marked: set[int] = set()
        self.initial: int | None = None
        self.named = True
        self._edges = [array("q") for _ in range(4)]

    def event(
        self, name: str, where: int = NOWHERE, *, controllable: bool = True, observable: bool = True
    ) -> int:
        """Add an event and return its number."""
        if name in self.events:
            self.page.fail(f"event {shown(name)} stands twice in the alphabet; name it once", where)
        if not controllable:
            self.uncontrollable.add(name)
        if not observable:
            self.unobservable.add(name)
        return self.events.setdefault(name, len(self.events))

    def state(self, name: str, where: int = NOWHERE) -> int:
        """Add a state and return its number."""
        if name in self.states:
            self.page.fail(f"state {shown(name)} stands twice; name each state once", where)
        return self.states.setdefault(name, len(self.states))

    def number_states(self, count: int, names: Sequence[str] = ()) -> None:
        """Take the numbers below ``count`` for states, with ``names`` where there are any."""
        self.named = bool(names)
        self.states = {name: s for s, name in enumerate(names or map(str, range(count)))}

    def find_event(self, name: str, where: int) -> int:
        """Return the number of an event that has been added."""
        if name not in self.events:
            self.page.fail(f"unknown event {shown(name)}; {suggest(name, self.events)}", where)
        return self.events[name]

    def find_state(self, name: str, where: int) -> int:
        """Return the number of a state that has been added."""
        if name not in self.states:
            self.page.fail(f"unknown state {shown(name)}; {suggest(name, self.states)}", where)
        return self.states[name]

    def edge(self, source: int, event: int, target: int, where: int = NOWHERE) -> None:
        """Add a transition; it may be added again."""
        for column, value in zip(self._edges, (source, event, target, where), strict=True):
            column.append(value)

    def edges(self, source: int, events: Ints, target: int, where: int) -> None:
        """Add a transition for each of several events."""
        for column, values in zip(self._edges, (source, events, target, where), strict=True):
            column.frombytes(np.broadcast_to(np.asarray(values, np.int64), events.shape).tobytes())

    def start(self, state: int, where: int) -> None:
        """Make ``state`` the initial one, of which there is only one."""
        if self.initial is not None:
            names = list(self.states)
            self.page.fail(
                f"automaton {self.name!r} has two initial states, {names[self.initial]!r} and "
                f"{names[state]!r}; it is deterministic with one",
                where,
            )
        self.initial = state

    def automaton(self) -> Automaton:
        """Return the automaton; without an initial state it is the empty one, as its languages are."""
        sigma = Alphabet(tuple(self.events), frozenset(self.uncontrollable), frozenset(self.unobservable))
        if self.initial is None:
            return empty(sigma, name=self.name)
        states, events = len(self.states), len(sigma)
        problem = size_problem(states, events)
        if problem:
            self.page.fail(f"automaton {self.name!r}: {problem}")
        source, event, target, where = (np.array(part, np.int64) for part in self._edges)
        self._check_deterministic(source * events + event, target, where)
        order = np.arange(states)
        order[: self.initial + 1] = np.roll(order[: self.initial + 1], 1)  # the initial state comes first
        place = np.empty(states, np.int64)
        place[order] = np.arange(states)
        delta: Ints = np.full((states, events), NONE, np.int32)
        delta[place[source], event] = place[target]
        is_marked = np.zeros(states, np.bool_)
        is_marked[place[list(self.marked)]] = True
        names = list(self.states)
        state_names = tuple(names[s] for s in order) if self.named else ()
        return Automaton(sigma, delta, is_marked, state_names=state_names, name=self.name)

    def _check_deterministic(self, cell: Longs, target: Longs, where: Longs) -> None:
        """Check that no entry of the table is to hold two states; name the transition that comes second."""
        order = np.argsort(cell, kind="stable")
        first, second = order[:-1], order[1:]
        twice = np.flatnonzero((cell[first] == cell[second]) & (target[first] != target[second]))
        if not twice.size:
            return
        k = twice[np.argmin(second[twice])]
        names, events = list(self.states), list(self.events)
        s, e = divmod(int(cell[second[k]]), len(events))
        message = (
            f"{self.page.at(int(where[second[k]]))}: automaton {self.name!r} is not deterministic: event "
            f"{events[e]!r} leads from state {names[s]!r} to both {names[target[first[k]]]!r} and "
            f"{names[target[second[k]]]!r}; keep one of the two"
        )
        raise AutomatonError(message)

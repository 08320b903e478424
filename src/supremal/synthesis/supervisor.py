"""Supervisors, and monitors: one run of a supervisor beside the real system.

Source: section II of the paper: a supervisor maps what happened so far to the events that it enables, and
always enables the uncontrollable ones.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from supremal._arrays import NONE, Bools, Ints, frozen
from supremal.automata.automaton import Automaton
from supremal.errors import AlphabetError, AutomatonError


@dataclass(frozen=True, slots=True, eq=False)
class Supervisor:
    """What `synthesize` returns: the supervised behaviour, and which events it enables.

    Parameters
    ----------
    automaton
        The behaviour of plant and supervisor together; empty where no supervisor exists.
    plant_state
        ``int32 [S, P]``: the state of each of the P plants in each of its states.
    enabled
        ``bool [S, E]``: the control pattern.  Uncontrollable events are always enabled, but for a tick that a
        forcible event pre-empts (see `synthesize_timed`).
    """

    automaton: Automaton
    plant_state: Ints
    enabled: Bools

    def __post_init__(self) -> None:
        object.__setattr__(self, "plant_state", frozen(self.plant_state, np.int32, 2))
        object.__setattr__(self, "enabled", frozen(self.enabled, np.bool_, 2))
        states, shape = self.automaton.n_states, self.automaton.delta.shape
        if self.enabled.shape != shape or len(self.plant_state) != states:
            message = (
                f"supervisor: enabled has shape {self.enabled.shape} and plant_state has "
                f"{len(self.plant_state)} rows; the automaton needs {shape} and {states} rows"
            )
            raise AutomatonError(message)

    @property
    def is_empty(self) -> bool:
        """Whether there is no way to keep the specification."""
        return self.automaton.n_states == 0

    def monitor(self) -> Monitor:
        """Return a new run, in the initial state."""
        return Monitor(self)


class Monitor:
    r"""One run of a supervisor: say what happened, ask what is enabled.

    Parameters
    ----------
    supervisor
        Shared, never changed.

    Notes
    -----
    An event outside the alphabet does not touch the monitor.  One that the supervised behaviour does not
    have (a disabled event that happened all the same, or an uncontrollable one that the plant's model rules
    out) makes it *lost*: it keeps that event in ``lost_at`` and enables no controllable event any more.

    Examples
    --------
    >>> from supremal import Monitor, from_text, synthesize
    >>> door = from_text("shut -open-> ajar \n ajar -close-> shut")
    >>> monitor = Monitor(synthesize(door, door))
    >>> monitor.enabled
    ('open',)
    >>> monitor.observe(["open"]), monitor.enabled
    (True, ('close',))
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self.supervisor = supervisor
        self.reset()

    def reset(self) -> None:
        """Go back to the initial state."""
        self.state = NONE if self.supervisor.is_empty else 0
        self.lost_at: str | None = None

    @property
    def enabled(self) -> tuple[str, ...]:
        """The events that may happen next: enabled, and possible in the supervised behaviour."""
        automaton = self.supervisor.automaton
        if self.state == NONE:
            return ()
        possible = self.supervisor.enabled[self.state] & (automaton.delta[self.state] != NONE)
        return automaton.alphabet.spell(np.flatnonzero(possible).tolist())

    def observe(self, word: Iterable[str]) -> bool:
        """Follow the events that occurred, in order; tell whether all of them were allowed.

        Raises
        ------
        AlphabetError
            If ``word`` is a string, whose letters would all be taken for foreign events.
        """
        if isinstance(word, str):
            message = f"a word is a sequence of event names, got the string {word!r}; write [{word!r}]"
            raise AlphabetError(message)
        automaton = self.supervisor.automaton
        for name in word:
            if name not in automaton.alphabet or self.state == NONE:
                continue
            self.state = automaton.run([name], self.state)
            if self.state == NONE:
                self.lost_at = name
        return self.state != NONE

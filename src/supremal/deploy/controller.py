"""A controller: a supervisor as it is deployed, one table or several side by side.

With several tables an event is enabled where each table that knows it enables it, and it moves those; this is
the synchronous composition, carried out while it runs instead of beforehand.  So n tables take the sum of
their sizes, where one would take the product.

Source: Wonham, Ramadge, "Modular supervisory control of discrete-event systems", Math. Control Signals
Systems 1 (1988), the conjunction of supervisors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from supremal._arrays import NONE, Longs, frozen
from supremal.automata.alphabet import Alphabet
from supremal.errors import AutomatonError
from supremal.synthesis.supervisor import Monitor, Supervisor


class Why(NamedTuple):
    """Why an event is disabled.

    Parameters
    ----------
    kind
        That of a `Reason`.
    rules
        The rules that would break.
    through
        The uncontrollable events through which.
    text
        The same in words.
    """

    kind: str
    rules: tuple[str, ...]
    through: tuple[str, ...]
    text: str


class Vector(NamedTuple):
    """A test: a word from the start, and what has to be seen before it and after each of its events.

    Parameters
    ----------
    word
        Only its last event may be one that is refused.
    ok
        Whether all of it is allowed.
    enabled, marked
        One entry more than there are events; nothing is enabled or marked after a refused one.
    """

    word: tuple[str, ...]
    ok: bool
    enabled: tuple[tuple[str, ...], ...]
    marked: tuple[bool, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Component:
    """One table of a controller.

    Parameters
    ----------
    name
        What it enforces.
    supervisor
        Its automaton follows exactly what it enables.
    disabled
        ``int64 [N, 3]``: a state, the number of an event that is disabled there though the plants could
        follow it, and the number of the reason, `NONE` where it was not looked for.
    """

    name: str
    supervisor: Supervisor
    disabled: Longs

    def __post_init__(self) -> None:
        object.__setattr__(self, "disabled", frozen(self.disabled, np.int64, 2))
        automaton, enabled = self.supervisor.automaton, self.supervisor.enabled
        wrong = np.argwhere((automaton.delta != NONE) & ~enabled)
        if len(wrong):
            state, event = wrong[0].tolist()
            message = (
                f"component {self.name!r}: its automaton follows {automaton.alphabet.names[event]!r} in "
                f"state {state}, where it is disabled; leave that transition out, or enable it"
            )
            raise AutomatonError(message)


@dataclass(frozen=True, slots=True, eq=False)
class Controller:
    """A supervisor as it is deployed.

    Parameters
    ----------
    name
        What files and messages call it.
    alphabet
        The events of all components.
    components
        The tables, of which each has a say in the events that it knows.
    reasons
        What ``disabled`` of the components refers to.
    model
        The SHA-256 of what it was made from, in base 16; see `hash_model`.
    asked
        Whether it was meant to be nonblocking, and to leave a choice wherever there is one.
    nonblocking, acts
        Whether it is so: True or False where that is proved, None where it is not known.
    blocked_after
        A shortest word after which nothing marked can be reached, where it is not nonblocking.
    vectors
        What a copy of it in any language has to do.
    """

    name: str
    alphabet: Alphabet
    components: tuple[Component, ...]
    reasons: tuple[Why, ...]
    model: str
    asked: tuple[bool, bool]
    nonblocking: bool | None
    acts: bool | None
    blocked_after: tuple[str, ...] | None = None
    vectors: tuple[Vector, ...] = ()

    @property
    def is_empty(self) -> bool:
        """Whether there is no way to keep the rules."""
        return any(component.supervisor.is_empty for component in self.components)

    @property
    def n_states(self) -> int:
        """The number of states of all tables."""
        return sum(component.supervisor.automaton.n_states for component in self.components)


class JointMonitor:
    r"""One run of a controller: a `Monitor` of each component, side by side.

    Once an event happened that was not enabled, it is lost: nothing is enabled until it is reset.

    Examples
    --------
    >>> from supremal import from_text
    >>> from supremal.deploy.build import make_controller
    >>> door = from_text("shut -open-> ajar \n ajar -close-> shut")
    >>> run = JointMonitor(make_controller([door], []))
    >>> run.enabled, run.step("open"), run.enabled, run.step("open"), run.enabled, run.lost_at
    (('open',), True, ('close',), False, (), 'open')
    """

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.monitors = [Monitor(component.supervisor) for component in controller.components]
        self.lost_at: str | None = None

    def reset(self) -> None:
        """Go back to the start."""
        self.lost_at = None
        for monitor in self.monitors:
            monitor.reset()

    @property
    def state(self) -> tuple[int, ...]:
        """The state of each component."""
        return tuple(monitor.state for monitor in self.monitors)

    @property
    def enabled(self) -> tuple[str, ...]:
        """The events that may happen next, in the order of the alphabet."""
        if self.lost_at is not None:
            return ()
        sights = [(m.supervisor.automaton.alphabet, frozenset(m.enabled)) for m in self.monitors]
        return tuple(
            event
            for event in self.controller.alphabet
            if all(event in enabled or event not in sigma for sigma, enabled in sights)
        )

    @property
    def marked(self) -> bool:
        """Whether what has to be completed is."""
        return self.lost_at is None and all(
            bool(monitor.supervisor.automaton.marked[monitor.state]) for monitor in self.monitors
        )

    def step(self, event: str) -> bool:
        """Follow an event that happened; tell whether it was enabled.

        Raises
        ------
        AlphabetError
            If no component knows it.
        """
        self.controller.alphabet.index(event)
        followed = [monitor.observe([event]) for monitor in self.monitors]
        if self.lost_at is None and not all(followed):
            self.lost_at = event
        return self.lost_at is None

"""Automata: what can happen, one event after another.

G = (Q, Σ, δ, q0, Qm) is deterministic and δ is partial.  It generates L(G), the words that δ is defined
for, and marks Lm(G) ⊆ L(G), those that end in Qm.

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., section 2.2; section II
of the paper.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from supremal._arrays import NONE, Bools, Ints, frozen
from supremal.automata.alphabet import Alphabet
from supremal.errors import AutomatonError


def _itself() -> Ints:
    return np.empty((0, 0), np.int32)


@dataclass(frozen=True, slots=True, eq=False)
class Automaton:
    """A deterministic automaton; state 0 is the initial one.

    Parameters
    ----------
    alphabet
        The E events.
    delta
        ``int32 [S, E]``: the next state, `NONE` (-1) where the event is not possible.
    marked
        ``bool [S]``.
    origin
        ``int32 [S, K]``: the state of each of the K parts that this automaton was composed from; left
        out: it is its own only part.
    state_names
        A name a state, or () where states have numbers only.
    name
        What messages and pictures call it.

    Raises
    ------
    AutomatonError
        If shapes do not fit or δ leads out of the automaton.

    Notes
    -----
    The empty automaton has S = 0; both of its languages are empty.  Compare languages with
    `is_same_language`: two automata are equal only when they are the same object.

    Examples
    --------
    >>> Automaton(Alphabet(("a", "b")), [[1, -1], [-1, 0]], [True, False], name="turns")
    <Automaton 'turns': 2 states, 2 transitions, 2 events>
    """

    alphabet: Alphabet
    delta: Ints
    marked: Bools
    origin: Ints = field(default_factory=_itself)
    state_names: tuple[str, ...] = ()
    name: str = ""

    def __post_init__(self) -> None:
        try:
            delta = frozen(self.delta, np.int32, 2)
            marked = frozen(self.marked, np.bool_, 1)
            own = np.shape(self.origin) == (0, 0)
            states = delta.shape[0]
            origin = frozen(np.arange(states)[:, None] if own else self.origin, np.int32, 2)
        except ValueError as error:
            message = f"automaton {self.name!r}: {error}"
            raise AutomatonError(message) from None
        events = len(self.alphabet)
        for what, got, want in (
            ("delta", delta.shape, (states, events)),
            ("marked", marked.shape, (states,)),
            ("origin", origin.shape[:1], (states,)),
            ("state_names", (len(self.state_names) or states,), (states,)),
        ):
            if got != want:
                message = f"automaton {self.name!r}: {what} has shape {got}, {want} is needed"
                raise AutomatonError(message)
        if delta.size and not (delta.min() >= NONE and delta.max() < states):
            s, e = np.argwhere((delta < NONE) | (delta >= states))[0]
            message = (
                f"automaton {self.name!r}: event {self.alphabet.names[e]!r} leads from state {s} to "
                f"{delta[s, e]}; a state from 0 to {states - 1} is needed, or {NONE} for none"
            )
            raise AutomatonError(message)
        object.__setattr__(self, "delta", delta)
        object.__setattr__(self, "marked", marked)
        object.__setattr__(self, "origin", origin)
        object.__setattr__(self, "state_names", tuple(self.state_names))

    @property
    def n_states(self) -> int:
        """The number of states, S."""
        return int(self.delta.shape[0])

    @property
    def n_transitions(self) -> int:
        """The number of pairs of a state and an event for which δ is defined."""
        return int(np.count_nonzero(self.delta != NONE))

    def state_name(self, state: int) -> str:
        """Return the name of ``state``, its number where it has none."""
        return self.state_names[state] if self.state_names else str(state)

    def run(self, word: Iterable[str], state: int = 0) -> int:
        """Return δ*(word, state): where ``word`` leads, `NONE` where it is not possible.

        Raises
        ------
        AlphabetError
            If the word has an event that is not in the alphabet.
        """
        if self.n_states == 0:
            return NONE
        for name in word:
            event = self.alphabet.index(name)
            if state != NONE:
                state = int(self.delta[state, event])
        return state

    def accepts(self, word: Iterable[str]) -> bool:
        """Tell whether ``word`` is in the marked language."""
        state = self.run(word)
        return state != NONE and bool(self.marked[state])

    def __repr__(self) -> str:
        called = f" {self.name!r}" if self.name else ""
        return (
            f"<Automaton{called}: {self.n_states} states, {self.n_transitions} transitions, "
            f"{len(self.alphabet)} events>"
        )

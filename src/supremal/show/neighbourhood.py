"""What lies around a state: of an automaton that is too large to draw, the part that one looks at.

The neighbourhood of radius k has the states that k transitions reach from it, whichever way each of them is
followed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal._graph import of_table, reverse
from supremal.automata.automaton import Automaton
from supremal.errors import AutomatonError, suggest

_EDGES: Final = 100  # transitions that one can still follow in a picture
_CROWD: Final = 24  # the states that are taken of a crowd around one


@dataclass(frozen=True, slots=True, eq=False)
class Neighbourhood:
    """A part of an automaton.

    Parameters
    ----------
    automaton
        The whole.
    centre
        The state around which it lies.
    steps
        Its radius.
    states
        ``int32 [K]``: its states in ascending order; without the initial state, the centre comes first.
    open
        ``bool [K]``: which of them have edges from or to other states.
    complete
        Whether it has all states within its radius.
    """

    automaton: Automaton
    centre: int
    steps: int
    states: Ints
    open: Bools
    complete: bool

    def __str__(self) -> str:
        some = "" if self.complete else "some of "
        steps = f"{self.steps} step{'' if self.steps == 1 else 's'}"
        name = self.automaton.state_name(self.centre)
        size = f"{len(self.states):,} of {self.automaton.n_states:,} states"
        return f"{size}: {some}those within {steps} of {name}"


def neighbourhood(automaton: Automaton, state: int | str, *, most: int = 60) -> Neighbourhood:
    r"""Return the largest neighbourhood of ``state`` with at most ``most`` states and 100 transitions.

    Where even radius 1 has more states, it has 24 of them; radius 1 may have more transitions.

    Raises
    ------
    AutomatonError
        If there is no such state.

    Notes
    -----
    Time is linear in the transitions of the automaton.

    Examples
    --------
    >>> from supremal import from_text
    >>> chain = from_text("\n".join(f"{k} -next-> {k + 1}" for k in range(100)))
    >>> print(neighbourhood(chain, "50", most=8))
    7 of 101 states: those within 3 steps of 50
    """
    centre = find_state(automaton, state)
    start, source = reverse(*of_table(automaton.delta))
    inside = np.zeros(automaton.n_states, np.bool_)
    inside[centre] = True
    shell, steps, complete = np.array([centre]), 0, True
    while shell.size:
        before = [source[start[s] : start[s + 1]] for s in shell.tolist()]
        near = np.concatenate([automaton.delta[shell].ravel(), *before])
        near = np.unique(near[near != NONE])
        shell = near[~inside[near]]
        if inside.sum() + shell.size > most:
            if steps == 0:
                inside[shell[: min(most, _CROWD) - 1]] = True
                steps, complete = 1, False
            break
        inside[shell] = True
        if steps and _transitions(automaton, inside) > _EDGES:
            inside[shell] = False
            break
        steps += bool(shell.size)
    states = np.flatnonzero(inside).astype(np.int32)
    if not inside[0]:
        states = np.concatenate([[centre], states[states != centre]]).astype(np.int32)
    out = automaton.delta[states]
    leads_out = ((out != NONE) & ~inside[out]).any(axis=1)
    led_to = np.array([not inside[source[start[s] : start[s + 1]]].all() for s in states.tolist()], np.bool_)
    return Neighbourhood(automaton, centre, steps, states, leads_out | led_to, complete)


def _transitions(automaton: Automaton, inside: Bools) -> int:
    """Return how many transitions lead from one state inside to another."""
    out = automaton.delta[inside]
    return int(np.count_nonzero((out != NONE) & inside[out]))


def find_state(automaton: Automaton, state: int | str) -> int:
    """Return the number of a state that is given by its number or its name.

    Raises
    ------
    AutomatonError
        If there is none.
    """
    called = f"automaton {automaton.name!r}"
    if isinstance(state, str):
        names = automaton.state_names or tuple(map(str, range(automaton.n_states)))
        if state not in names:
            message = f"{called} has no state {state!r}; {suggest(state, names)}"
            raise AutomatonError(message)
        return names.index(state)
    if not 0 <= state < automaton.n_states:
        message = f"{called} has no state {state}; its states are 0 to {automaton.n_states - 1}"
        raise AutomatonError(message)
    return int(state)


def numbers_of(automaton: Automaton, states: Bools | Iterable[int | str]) -> list[int]:
    """Return the numbers of states that are given one by one, or by a mask ``bool [S]``.

    Raises
    ------
    AutomatonError
        If there is no such state, or the mask is of another length.
    """
    if isinstance(states, np.ndarray) and states.dtype == np.bool_:
        if states.shape != (automaton.n_states,):
            message = (
                f"automaton {automaton.name!r}: a mask of states has shape {states.shape}, "
                f"({automaton.n_states},) is needed"
            )
            raise AutomatonError(message)
        return [int(s) for s in np.flatnonzero(states)]
    return [find_state(automaton, state) for state in states]

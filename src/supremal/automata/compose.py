"""Synchronous composition: parts that run side by side and agree on the events they share.

A ∥ B moves by an event when every part that has it in its alphabet can; parts that do not have it stand
still.  Its marked states are those where all parts are marked.

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., section 2.3.2.
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Ints
from supremal.automata.alphabet import Alphabet, union
from supremal.automata.automaton import Automaton
from supremal.automata.explore import explore


def sync(*parts: Automaton, max_states: int | None = None) -> Automaton:
    r"""Return the synchronous composition of ``parts``, reachable states only, in breadth-first order.

    Parameters
    ----------
    parts
        ``origin`` of the result has the columns of their origins side by side.  The composition of none
        is Σ* over no event, the neutral element.
    max_states
        The most states that the result may have; left out: what fits the machine.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another.
    AutomatonError
        If the result would have more than ``max_states`` states.

    Notes
    -----
    Time is linear in the transitions of the result times the parts that share an event; the product is
    explored once, no intermediate one is built.

    Examples
    --------
    >>> from supremal import from_text, sync
    >>> up = from_text("low -fill-> high")
    >>> down = from_text("ready -fill-> ready")
    >>> sync(up, down).n_states
    2
    """
    product, states = components(*parts, max_states=max_states)
    origin = np.hstack([states[:, :0], *(part.origin[states[:, k]] for k, part in enumerate(parts))])
    return Automaton(product.alphabet, product.delta, product.marked, origin, name=product.name)


def components(*parts: Automaton, max_states: int | None = None) -> tuple[Automaton, Ints]:
    """Return the composition of ``parts`` and ``int32 [S, K]``, the state of each part in each state."""
    graph = explore(parts, max_states=max_states)
    name = " ∥ ".join(part.name for part in parts if part.name)
    return Automaton(graph.alphabet, graph.delta(), graph.marked, name=name), graph.states


def extend(automaton: Automaton, alphabet: Alphabet, *, stand_still: bool) -> Automaton:
    """Return ``automaton`` over the union of its alphabet and ``alphabet``.

    The events it did not know loop on every state (``stand_still``, which is what `sync` does with them)
    or are not possible.
    """
    merged = union(automaton.alphabet, alphabet)
    states = automaton.n_states
    delta = np.full((states, len(merged)), NONE, np.int32)
    if stand_still:
        delta[:] = np.arange(states)[:, None]
    delta[:, : len(automaton.alphabet)] = automaton.delta
    return Automaton(merged, delta, automaton.marked, automaton.origin, automaton.state_names, automaton.name)

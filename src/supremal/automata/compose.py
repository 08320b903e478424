"""Synchronous composition: parts that run side by side and agree on the events they share.

A ∥ B moves by an event when every part that has it in its alphabet can; parts that do not have it stand
still.  Its marked states are those where all parts are marked.

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., section 2.3.2.
"""

from __future__ import annotations

from math import prod
from typing import Final

import numpy as np

from supremal._arrays import NONE, Ints, Longs
from supremal.automata import _kernels
from supremal.automata.alphabet import Alphabet, union
from supremal.automata.automaton import Automaton
from supremal.automata.build import empty, universal
from supremal.errors import AutomatonError

MAX_STATES: Final = 50_000_000
"""The default bound on the states of a product."""

_DIRECT: Final = 1 << 26
_WIDEST: Final = 1 << 62


def sync(*parts: Automaton, max_states: int = MAX_STATES) -> Automaton:
    """Return the synchronous composition of ``parts``, reachable states only, in breadth-first order.

    Parameters
    ----------
    parts
        ``origin`` of the result has the columns of their origins side by side.  The composition of none
        is Σ* over no event, the neutral element.
    max_states
        The most states that the result may have.

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


def components(*parts: Automaton, max_states: int = MAX_STATES) -> tuple[Automaton, Ints]:
    """Return the composition of ``parts`` and ``int32 [S, K]``, the state of each part in each state."""
    if not parts:
        return universal(Alphabet(())), np.empty((1, 0), np.int32)
    alphabet = union(*(part.alphabet for part in parts))
    name = " ∥ ".join(part.name for part in parts if part.name)
    sizes = [part.n_states for part in parts]
    if 0 in sizes:
        return empty(alphabet, name=name), np.empty((0, len(parts)), np.int32)
    if prod(sizes) >= _WIDEST:
        head, states = components(*parts[:2], max_states=max_states)
        product, rest = components(head, *parts[2:], max_states=max_states)
        return product, np.concatenate([states[rest[:, 0]], rest[:, 1:]], axis=1)

    stride = np.array([prod(sizes[k + 1 :]) for k in range(len(parts))], np.int64)
    size = np.array(sizes, np.int64)
    start, part, column = _participants(alphabet, parts)
    keys, delta = _kernels.explore(
        np.concatenate([p.delta.reshape(-1) for p in parts]),
        np.cumsum([0, *(p.delta.size for p in parts[:-1])], dtype=np.int64),
        np.array([len(p.alphabet) for p in parts], np.int64),
        size,
        stride,
        start,
        part,
        column,
        prod(sizes) if prod(sizes) <= _DIRECT else 0,
        max_states,
    )
    if len(keys) > max_states:
        named = ", ".join(f"{p.name or f'part {k}'} ({p.n_states})" for k, p in enumerate(parts))
        message = f"the product of {named} states has more than {max_states:,}; raise max_states or split it"
        raise AutomatonError(message)
    states = (keys[:, None] // stride % size).astype(np.int32)
    marked = np.all([p.marked[states[:, k]] for k, p in enumerate(parts)], axis=0)
    return Automaton(alphabet, delta, marked, name=name), states


def _participants(alphabet: Alphabet, parts: tuple[Automaton, ...]) -> tuple[Longs, Ints, Ints]:
    """For every event the parts that move by it and its column in each, as one sparse table."""
    pairs = [
        [(k, part.alphabet.index(name)) for k, part in enumerate(parts) if name in part.alphabet]
        for name in alphabet
    ]
    start = np.cumsum([0, *map(len, pairs)], dtype=np.int64)
    flat = np.array([pair for row in pairs for pair in row], np.int32).reshape(-1, 2)
    return start, flat[:, 0].copy(), flat[:, 1].copy()


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

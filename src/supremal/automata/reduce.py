"""Verbs that keep a part of an automaton, or complete what is missing in it.

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., sections 2.3.1 and 2.3.4.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._graph import coreachable_to, first_seed, of_table, reachable_from, search
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.subsets import subset_automaton
from supremal.errors import AutomatonError


def reachable(automaton: Automaton) -> Bools:
    """Return which states some word leads to, ``bool [S]``."""
    return reachable_from(*of_table(automaton.delta), first_seed(automaton.n_states))


def coreachable(automaton: Automaton) -> Bools:
    """Return from which states some word leads to a marked state, ``bool [S]``."""
    return coreachable_to(*of_table(automaton.delta), automaton.marked)


def keep(automaton: Automaton, states: Bools) -> Automaton:
    """Return ``automaton`` cut down to ``states`` (``bool [S]``) that are reachable through them.

    Where the initial state goes, all goes.
    """
    inside = reachable_from(*of_table(automaton.delta), first_seed(automaton.n_states), states)
    return _renumbered(automaton, np.flatnonzero(inside))


def breadth_first(automaton: Automaton, root: int = 0) -> Automaton:
    """Return what is reachable from state ``root``, which becomes the initial one, in breadth-first order.

    The order is that of the shortest words to the states, words of one length in the order of the alphabet:
    automata that differ in the numbers of their states only become the same table.
    """
    seeds = np.zeros(automaton.n_states, np.bool_)
    seeds[root : root + 1] = True
    order, _ = search(*of_table(automaton.delta), seeds, np.ones_like(seeds))
    return _renumbered(automaton, order)


def _renumbered(automaton: Automaton, order: NDArray[np.integer]) -> Automaton:
    """Return the states ``order`` of an automaton, in that order, and the transitions among them."""
    number = np.full(automaton.n_states + 1, NONE, np.int32)  # the last entry renames NONE to itself
    number[order] = np.arange(len(order))
    names = tuple(automaton.state_names[s] for s in order) if automaton.state_names else ()
    return Automaton(
        automaton.alphabet,
        number[automaton.delta[order]],
        automaton.marked[order],
        automaton.origin[order],
        names,
        automaton.name,
    )


def trim(automaton: Automaton) -> Automaton:
    """Return the part that is reachable and coreachable; its generated language is the closure of Lm.

    Examples
    --------
    >>> from supremal import from_text, trim
    >>> trim(from_text('''
    ...     marked done
    ...     start -ok-> done
    ...     start -bad-> stuck
    ... '''))
    <Automaton: 2 states, 1 transitions, 2 events>
    """
    return keep(automaton, coreachable(automaton))


def mark_all(automaton: Automaton) -> Automaton:
    """Return ``automaton`` with every state marked: its marked language is its generated one."""
    return replace(automaton, marked=np.ones(automaton.n_states, np.bool_))


def prefix_closure(automaton: Automaton) -> Automaton:
    """Return an automaton that marks the prefixes of the words that ``automaton`` marks."""
    return mark_all(trim(automaton))


def complete(automaton: Automaton, *, trap: str = "trap", marked: bool = False) -> Automaton:
    """Return ``automaton`` with every missing transition led to a new state ``trap``, which it never leaves.

    The trap is there even if no transition is missing; ``marked`` marks it.
    """
    names = automaton.state_names or tuple(str(s) for s in range(automaton.n_states))
    while trap in names:
        trap += "'"
    return replace(add_trap(automaton, marked=marked), state_names=(*names, trap))


def add_trap(automaton: Automaton, *, marked: bool = False) -> Automaton:
    """Return what `complete` does, without names for the states."""
    states, events = automaton.delta.shape
    delta = np.vstack([automaton.delta, np.full((1, events), states, np.int32)])
    delta[delta == NONE] = states
    own = np.append(automaton.origin, np.full((1, automaton.origin.shape[1]), NONE), axis=0)
    return Automaton(automaton.alphabet, delta, np.append(automaton.marked, marked), own, name=automaton.name)


def complement(automaton: Automaton) -> Automaton:
    """Return an automaton that marks exactly the words over its alphabet that ``automaton`` does not.

    Examples
    --------
    >>> from supremal import complement, from_text
    >>> complement(from_text("0 -a-> 1")).accepts(["a", "a"])
    True
    """
    total = complete(automaton)
    return replace(total, marked=~total.marked)


def determinise(
    alphabet: Alphabet,
    transitions: Iterable[tuple[int, int, int]],
    initial: Iterable[int],
    marked: Iterable[int],
    *,
    name: str = "",
) -> Automaton:
    """Return the subset automaton of a nondeterministic one.

    Parameters
    ----------
    alphabet
        The events.
    transitions
        Triples (from, event, to) of numbers; event `NONE` is silent.
    initial, marked
        The initial and the marked states.
    name
        What to call the result.

    Raises
    ------
    AutomatonError
        If a number is none of a state or an event, or the sets do not fit the machine.

    Notes
    -----
    A state stands for the set of states that a word can lead to; up to 2^S of them.  Source: Cassandras,
    Lafortune, section 2.3.4; see `supremal.automata.subsets`.
    """
    source, event, target = np.array([*transitions], np.int64).reshape(-1, 3).T
    start, goal = np.array([*initial], np.int64), np.array([*marked], np.int64)
    numbers = np.concatenate([source, target, start, goal])
    states = 1 + int(numbers.max(initial=-1))
    strange = np.append(numbers[numbers < 0], event[(event < NONE) | (event >= len(alphabet))])
    if strange.size:
        message = (
            f"automaton {name!r}: {strange[0]} is no number of a state (0, 1, ...) or of an event "
            f"(0 to {len(alphabet) - 1}, {NONE} for a silent move)"
        )
        raise AutomatonError(message)
    is_silent = event == NONE
    is_initial, is_marked = np.zeros((2, states), np.bool_)
    is_initial[start] = is_marked[goal] = True
    return subset_automaton(
        alphabet,
        _grouped((source * len(alphabet) + event)[~is_silent], target[~is_silent], states * len(alphabet)),
        _grouped(source[is_silent], target[is_silent], states),
        is_initial,
        is_marked,
        name=name,
    )


def _grouped(key: Longs, value: Longs, size: int) -> tuple[Longs, Ints]:
    """Return ``start [size + 1]`` and the values in the order of their keys."""
    start = np.append(0, np.cumsum(np.bincount(key, minlength=size)))
    return start, value[np.argsort(key, kind="stable")].astype(np.int32)

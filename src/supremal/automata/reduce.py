"""Verbs that keep a part of an automaton, or complete what is missing in it.

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., sections 2.3.1 and 2.3.4.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal._graph import coreachable_to, first_seed, of_table, reachable_from
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton


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
    number = np.full(automaton.n_states + 1, NONE, np.int32)  # the last entry renames NONE to itself
    number[:-1][inside] = np.arange(np.count_nonzero(inside))
    names = tuple(automaton.state_names[s] for s in np.flatnonzero(inside)) if automaton.state_names else ()
    return Automaton(
        automaton.alphabet,
        number[automaton.delta[inside]],
        automaton.marked[inside],
        automaton.origin[inside],
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
    states, events = automaton.delta.shape
    delta = np.vstack([automaton.delta, np.full((1, events), states)])
    delta[delta == NONE] = states
    names = automaton.state_names or tuple(str(s) for s in range(states))
    while trap in names:
        trap += "'"
    own = np.append(automaton.origin, np.full((1, automaton.origin.shape[1]), NONE), axis=0)
    return Automaton(
        automaton.alphabet, delta, np.append(automaton.marked, marked), own, (*names, trap), automaton.name
    )


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

    Notes
    -----
    A state stands for the set of states that a word can lead to; up to 2^S of them.  Source: Cassandras,
    Lafortune, section 2.3.4.
    """
    moves: dict[int, list[list[int]]] = {}
    silent: dict[int, list[int]] = {}
    for s, e, t in transitions:
        if e == NONE:
            silent.setdefault(s, []).append(t)
        else:
            moves.setdefault(s, [[] for _ in alphabet])[e].append(t)

    def closed(states: Iterable[int]) -> frozenset[int]:
        found = set(states)
        stack = list(found)
        while stack:
            fresh = set(silent.get(stack.pop(), ())) - found
            found |= fresh
            stack += fresh
        return frozenset(found)

    goal = frozenset(marked)
    order = {closed(initial): 0}
    rows: list[list[int]] = []
    queue = list(order)
    for subset in queue:  # grows while it is walked through
        row = []
        for e in range(len(alphabet)):
            reached = closed(t for s in subset if s in moves for t in moves[s][e])
            if reached and reached not in order:
                order[reached] = len(order)
                queue.append(reached)
            row.append(order[reached] if reached else NONE)
        rows.append(row)
    delta: Ints = np.array(rows, np.int32).reshape(len(rows), len(alphabet))
    is_marked = np.array([bool(subset & goal) for subset in queue], np.bool_)
    return Automaton(alphabet, delta, is_marked, name=name)

"""Comparing languages, with the shortest word that tells them apart; and automata, state by state.

All of these compare *marked* languages, but for `is_isomorphic`; compare `mark_all` of two automata for the
generated ones.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from supremal._arrays import Bools
from supremal._graph import first_seed, of_table, path_to, search
from supremal.automata.alphabet import union
from supremal.automata.automaton import Automaton
from supremal.automata.compose import components, extend
from supremal.automata.reduce import add_trap, breadth_first


def shortest_word(automaton: Automaton, goals: Bools) -> tuple[str, ...] | None:
    """Return a shortest word to one of ``goals`` (``bool [S]``), None where none is reachable.

    Among words of one length it is the first in the order of the alphabet.  Linear in the transitions.
    """
    start, target = of_table(automaton.delta)
    everywhere = np.ones(automaton.n_states, np.bool_)
    order, via = search(start, target, first_seed(automaton.n_states), everywhere)
    found = order[goals[order]]
    if not found.size:
        return None
    events = len(automaton.alphabet)
    return automaton.alphabet.spell(edge % events for edge in path_to(int(found[0]), via, start))


def find_not_included(inner: Automaton, outer: Automaton) -> tuple[str, ...] | None:
    """Return a shortest word that ``inner`` marks and ``outer`` does not, None where there is none.

    Examples
    --------
    >>> from supremal import find_not_included, from_text
    >>> find_not_included(from_text("0 -a-> 0"), from_text("0 -a-> 1"))
    ('a', 'a')
    """
    known = extend(inner, outer.alphabet, stand_still=False)
    product, states = components(known, add_trap(extend(outer, inner.alphabet, stand_still=False)))
    outside = ~np.append(outer.marked, False)[states[:, 1]]  # the trap is the last state of ``outer``
    return shortest_word(product, known.marked[states[:, 0]] & outside)


def is_included(inner: Automaton, outer: Automaton) -> bool:
    """Tell whether every word that ``inner`` marks is marked by ``outer``."""
    return find_not_included(inner, outer) is None


def find_difference(a: Automaton, b: Automaton) -> tuple[str, ...] | None:
    """Return a shortest word that exactly one of ``a`` and ``b`` marks, None where there is none."""
    words = [w for w in (find_not_included(a, b), find_not_included(b, a)) if w is not None]
    return min(words, key=len) if words else None


def is_same_language(a: Automaton, b: Automaton) -> bool:
    """Tell whether ``a`` and ``b`` mark the same words."""
    return find_difference(a, b) is None


def is_isomorphic(a: Automaton, b: Automaton) -> bool:
    r"""Tell whether ``a`` and ``b`` are the same up to the numbers and names of their reachable states.

    Events are matched by name, whatever their order.  Two automata are isomorphic after `minimise` exactly
    when they have the same events and both of their languages are the same.

    Raises
    ------
    AlphabetError
        If an event is controllable (observable) in one and not in the other.

    Notes
    -----
    Linear in the tables: numbered breadth first, isomorphic automata are the same table.

    Examples
    --------
    >>> from supremal import from_text, is_isomorphic
    >>> is_isomorphic(from_text("0 -a-> 1 \n 1 -b-> 0"), from_text("events b \n x -a-> y \n y -b-> x"))
    True
    """
    union(a.alphabet, b.alphabet)
    if set(a.alphabet) != set(b.alphabet):
        return False
    columns = [b.alphabet.index(name) for name in a.alphabet]
    one = breadth_first(a)
    two = breadth_first(replace(b, alphabet=a.alphabet, delta=b.delta[:, columns]))
    return np.array_equal(one.delta, two.delta) and np.array_equal(one.marked, two.marked)

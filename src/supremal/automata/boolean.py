r"""Languages as sets: intersection, union, difference; the complement is in `supremal.automata.reduce`.

Here an event that an automaton does not have in its alphabet is *not possible* in it, as in sets of words:
meet(A, B) generates L(A) ∩ L(B) and marks Lm(A) ∩ Lm(B).  In the synchronous composition A ∥ B such an event
leaves A standing still; the two are the same where the alphabets are.

For ∩ the parts move together, and where one cannot go on all is over.  For ∪ and \ a part that cannot go on
is out of the game, in its trap, while the other goes on.

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., section 2.3.2, where meet is
the product ×; Wonham, Cai, *Supervisory Control of Discrete-Event Systems* (2019), chapters 2 and 3.
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import Bools, Ints
from supremal.automata.alphabet import Alphabet, union
from supremal.automata.automaton import Automaton
from supremal.automata.build import empty
from supremal.automata.compose import components, extend
from supremal.automata.reduce import add_trap, keep
from supremal.errors import AutomatonError


def meet(*parts: Automaton, max_states: int | None = None) -> Automaton:
    r"""Return the intersection of ``parts``: what all of them can do, marked where all are.

    Parameters
    ----------
    parts
        One or more.  ``origin`` of the result has the columns of their origins side by side.
    max_states
        The most states that the result may have; left out: what fits the machine.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another.
    AutomatonError
        If there is no part, or the result would have more than ``max_states`` states.

    Notes
    -----
    Its alphabet is the union of theirs, its states are in breadth-first order.  Linear in the states of the
    result times the events, and the transitions times the parts.

    Examples
    --------
    An event that one part does not know is not possible; in `sync` that part would wait.

    >>> from supremal import from_text, meet, sync
    >>> a, b = from_text("0 -go-> 1 \n 1 -log-> 1"), from_text("0 -go-> 1")
    >>> meet(a, b).run(["go", "log"]), sync(a, b).run(["go", "log"])
    (-1, 1)
    """
    if not parts:
        message = "meet of no automaton: at least one is needed (all words over which alphabet?)"
        raise AutomatonError(message)
    alphabet = union(*(part.alphabet for part in parts))
    wide = [extend(part, alphabet, stand_still=False) for part in parts]
    product, states = components(*wide, max_states=max_states)
    return _named(product, product.marked, _origins(wide, states), " ∩ ", parts)


def language_union(*parts: Automaton, max_states: int | None = None) -> Automaton:
    r"""Return the union of ``parts``: what any of them can do, marked where any is.

    Parameters
    ----------
    parts
        ``origin`` of the result has the columns of their origins side by side, `NONE` where a part cannot go
        on.  The union of none is the empty language over no event.
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
    Linear in the states of the result times the events, and the transitions times the parts.

    Examples
    --------
    >>> from supremal import from_text, language_union
    >>> both = language_union(from_text("0 -a-> 1"), from_text("0 -b-> 1 \n 1 -b-> 2"))
    >>> both.accepts(["a"]), both.accepts(["b", "b"]), both.accepts(["a", "b"])
    (True, True, False)
    """
    if not parts:
        return empty(Alphabet(()))
    alphabet = union(*(part.alphabet for part in parts))
    wide = [add_trap(extend(part, alphabet, stand_still=False)) for part in parts]
    product, states = components(*wide, max_states=max_states)
    marked: Bools = np.zeros(product.n_states, np.bool_)
    alive: Bools = np.zeros(product.n_states, np.bool_)
    for k, part in enumerate(wide):
        marked |= part.marked[states[:, k]]
        alive |= states[:, k] != part.n_states - 1  # the last state is the trap
    return keep(_named(product, marked, _origins(wide, states), " ∪ ", parts), alive)


def difference(a: Automaton, b: Automaton, *, max_states: int | None = None) -> Automaton:
    r"""Return what ``a`` can do, marked where ``a`` is marked and ``b`` is not: Lm(a) \ Lm(b).

    It generates L(a); `trim` it for the prefixes of the difference alone.

    Parameters
    ----------
    a, b
        ``origin`` of the result has the columns of their origins side by side, `NONE` where ``b`` cannot
        follow.
    max_states
        The most states that the result may have; left out: what fits the machine.

    Raises
    ------
    AlphabetError
        If an event is controllable in one and not in the other.
    AutomatonError
        If the result would have more than ``max_states`` states.

    Notes
    -----
    Linear in the states of the result times the events.

    Examples
    --------
    >>> from supremal import difference, from_text
    >>> rest = difference(from_text("0 -a-> 0"), from_text("marked 2 \n 0 -a-> 1 \n 1 -a-> 2"))
    >>> [rest.accepts(["a"] * n) for n in range(5)]
    [True, True, False, True, True]
    """
    alphabet = union(a.alphabet, b.alphabet)
    wide = [extend(a, alphabet, stand_still=False), add_trap(extend(b, alphabet, stand_still=False))]
    product, states = components(*wide, max_states=max_states)
    marked = wide[0].marked[states[:, 0]] & ~wide[1].marked[states[:, 1]]
    return _named(product, marked, _origins(wide, states), " \\ ", (a, b))


def _origins(parts: list[Automaton], states: Ints) -> Ints:
    """Return the columns of the origins of ``parts`` side by side, in ``states [S, K]`` of their product."""
    origin: Ints = np.hstack([part.origin[states[:, k]] for k, part in enumerate(parts)])
    return origin


def _named(
    product: Automaton, marked: Bools, origin: Ints, sign: str, parts: tuple[Automaton, ...]
) -> Automaton:
    name = sign.join(part.name for part in parts) if all(part.name for part in parts) else ""
    return Automaton(product.alphabet, product.delta, marked, origin, name=name)

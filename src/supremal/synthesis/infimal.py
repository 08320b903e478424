"""The least that has to be allowed: the infimal closed controllable superlanguage.

Prefix-closed controllable languages are closed under intersection as well as under union.  So besides the
supremal sublanguage of K, the most that can be kept of it, there is a least closed controllable language that
holds all of K: K↓ = K̄Σu* ∩ L(G), what the plant may do on its own account after a word of K̄.  It tells what a
specification would have to allow for being kept whole.

Source: Lafortune, Chen, "The infimal closed controllable superlanguage and its application in supervisory
control", IEEE Trans. Automatic Control 35 (1990).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import union
from supremal.automata.automaton import Automaton
from supremal.automata.compose import components, extend, sync
from supremal.automata.explore import as_parts
from supremal.automata.reduce import complete, mark_all, trim


def infimal_controllable(
    plant: Automaton | Sequence[Automaton],
    spec: Automaton | Sequence[Automaton],
    *,
    max_states: int | None = None,
) -> Automaton:
    r"""Return the infimal closed controllable superlanguage of ``spec`` in ``plant``.

    Parameters
    ----------
    plant
        What can happen: one automaton, or several that run side by side.
    spec
        K: one automaton, or several that all have to hold.  What of it the plant cannot do does not count.
    max_states
        The most states that the product may have; left out: what fits the machine.

    Returns
    -------
    Automaton
        All states are marked, as the language is closed.  ``origin`` has a column for each plant and one for
        the trimmed specification, `NONE` (-1) once that is left.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another.
    AutomatonError
        If the product has more than ``max_states`` states.

    Notes
    -----
    Linear in the transitions of the product.

    Examples
    --------
    >>> from supremal import from_text
    >>> from supremal.synthesis.infimal import infimal_controllable
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> spec = from_text("uncontrollable fault \n 0 -start-> 1 \n 1 -stop-> 0 \n 0 -fault-> 0")
    >>> infimal_controllable(plant, spec).run(["start", "fault"])
    2
    """
    plants, closure = as_parts(plant), trim(sync(*as_parts(spec)))
    trap = closure.n_states
    if trap:
        alphabet = union(*(part.alphabet for part in (*plants, closure)))
        closure = complete(extend(closure, alphabet, stand_still=True))
        left = (closure.delta == trap) & closure.alphabet.controllable
        closure = replace(closure, delta=np.where(left, np.int32(NONE), closure.delta))
    product, states = components(*plants, closure, max_states=max_states)
    states[:, -1][states[:, -1] == trap] = NONE
    return mark_all(replace(product, origin=states))

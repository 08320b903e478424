"""The closest behaviour that can be kept: the supremal controllable sublanguage.

K↑ = ∪ {Kᵢ ⊆ K : Kᵢ is controllable} is itself controllable, so it is the one least restrictive behaviour that
a supervisor can enforce (the paper, after Theorem 1).  On the product of plant and specification it is a
greatest fixpoint: take out the states from which uncontrollable events alone can break the specification,
then those from which no marked state can be reached through what is left, until nothing more goes.

Source: Wonham, Ramadge, "On the supremal controllable sublanguage of a given language", SIAM J. Control
Optim. 25 (1987).
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal._graph import of_table, reachable_from, reverse
from supremal.automata.automaton import Automaton
from supremal.automata.compose import MAX_STATES, components, extend
from supremal.automata.reduce import keep
from supremal.synthesis.supervisor import Supervisor
from supremal.synthesis.verify import escapes


def synthesize(
    plant: Automaton, spec: Automaton, *, nonblocking: bool = True, max_states: int = MAX_STATES
) -> Supervisor:
    r"""Return the supervisor of the supremal controllable sublanguage of ``spec`` in ``plant``.

    Parameters
    ----------
    plant
        What can happen.
    spec
        What may happen; its marked states, together with the plant's, are what must stay reachable.
    nonblocking
        False gives the prefix-closed one, for which marked states play no part.
    max_states
        The most states that the product may have.

    Returns
    -------
    Supervisor
        The empty one where nothing can be enforced.

    Raises
    ------
    AlphabetError
        If an event is controllable in one and not in the other.
    AutomatonError
        If the product has more than ``max_states`` states.

    Notes
    -----
    Time is linear in the transitions of the product for each round of the fixpoint, of which there are at
    most as many as states; usually two or three.

    Examples
    --------
    >>> from supremal import from_text, synthesize
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> never_at_fault = from_text("events fault \n uncontrollable fault \n initial ok \n ok -tick-> ok")
    >>> synthesize(plant, never_at_fault, nonblocking=False).monitor().enabled
    ('tick',)
    """
    lifted = extend(plant, spec.alphabet, stand_still=True)
    product, states = components(lifted, spec, max_states=max_states)
    good: Bools = ~np.any(escapes(product, lifted, states[:, 0]), axis=1)
    uncontrollable = ~product.alphabet.controllable
    forced = reverse(*of_table(np.where(uncontrollable, product.delta, np.int32(NONE))))
    back = reverse(*of_table(product.delta)) if nonblocking else None
    while True:
        good = ~reachable_from(*forced, ~good)
        alive = reachable_from(*back, product.marked, good) if back else good
        if np.array_equal(alive, good):
            break
        good = alive
    return _supervisor(product, states, good)


def _supervisor(product: Automaton, states: Ints, good: Bools) -> Supervisor:
    """Cut the product down to ``good`` and read the control pattern off it."""
    numbered = Automaton(product.alphabet, product.delta, product.marked, states, name=product.name)
    behaviour = keep(numbered, good)
    enabled = (behaviour.delta != NONE) | ~product.alphabet.controllable
    return Supervisor(behaviour, behaviour.origin[:, 0], enabled)

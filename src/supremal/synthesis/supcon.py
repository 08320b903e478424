"""The closest behaviour that can be kept: the supremal controllable sublanguage.

K↑ = ∪ {Kᵢ ⊆ K : Kᵢ is controllable} is itself controllable, so it is the one least restrictive behaviour that
a supervisor can enforce (the paper, after Theorem 1).  On the product of plant and specification it is a
greatest fixpoint: take out the states from which uncontrollable events alone can break the specification,
then those from which no marked state can be reached through what is left, until nothing more goes.

Source: Wonham, Ramadge, "On the supremal controllable sublanguage of a given language", SIAM J. Control
Optim. 25 (1987).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal.automata.automaton import Automaton
from supremal.automata.explore import Exploration, as_parts, explore
from supremal.synthesis import _kernels
from supremal.synthesis.supervisor import Supervisor


def synthesize(
    plant: Automaton | Sequence[Automaton],
    spec: Automaton | Sequence[Automaton],
    *,
    nonblocking: bool = True,
    must_act: bool = False,
    max_states: int | None = None,
) -> Supervisor:
    r"""Return the supervisor of the supremal controllable sublanguage of ``spec`` in ``plant``.

    Parameters
    ----------
    plant
        What can happen: one automaton, or several that run side by side.
    spec
        What may happen: one automaton, or several that all have to hold.  Its marked states, together with
        the plant's, are what must stay reachable.
    nonblocking
        False gives the prefix-closed one, for which marked states play no part.
    must_act
        Whether a state in which the plant offers controllable events must keep one of them, as for an agent
        that has to choose.
    max_states
        The most states that the product may have; left out: what fits the machine.

    Returns
    -------
    Supervisor
        The empty one where nothing can be enforced.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another.
    AutomatonError
        If the product has more than ``max_states`` states.

    Notes
    -----
    The product is explored once, and not beyond a state in which something uncontrollable breaks a rule.
    Then each round of the fixpoint is linear in the transitions; there are at most as many rounds as states,
    usually two or three, and one if ``nonblocking`` is False.

    Examples
    --------
    >>> from supremal import from_text, synthesize
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> never_at_fault = from_text("events fault \n uncontrollable fault \n initial ok \n ok -tick-> ok")
    >>> synthesize(plant, never_at_fault, nonblocking=False).monitor().enabled
    ('tick',)
    """
    plants, specs = as_parts(plant), as_parts(spec)
    graph = explore(plants, specs, max_states=max_states)
    cause, _ = find_removed(graph, nonblocking=nonblocking, must_act=must_act)
    name = " ∥ ".join(part.name for part in (*plants, *specs) if part.name)
    return cut_out(graph, cause == _kernels.KEPT, graph.states, plants=len(plants), name=name)[0]


def find_removed(graph: Exploration, *, nonblocking: bool, must_act: bool) -> tuple[_kernels.Causes, Ints]:
    """Return why each state of a product has to go, and after which, as `_kernels.remove` does."""
    states, free = graph.bad.size, graph.alphabet.controllable
    left = np.full(states, NONE, np.int32)
    if must_act:
        acting = np.repeat(np.arange(states), np.diff(graph.start))[free[graph.event]]
        left[graph.offers] = np.bincount(acting, minlength=states)[graph.offers]
    into, source = _kernels.turn_round(graph.start, graph.event, graph.target, free)
    marked = graph.marked if nonblocking else np.ones(states, np.bool_)
    return _kernels.remove(graph.start, into, source, marked, graph.bad, left)


def cut_out(
    graph: Exploration, kept: Bools, states: Ints, *, plants: int, name: str
) -> tuple[Supervisor, Ints]:
    """Return what is ``kept`` of a product as a supervisor, and the product's state in each of its states.

    ``states [S, K]`` are those of the parts, of which the first ``plants`` are plants.
    """
    free = graph.alphabet.controllable
    number = np.full(kept.size, NONE, np.int32)
    order = _kernels.reach(graph.start, graph.target, kept, number)
    delta = np.full((order.size, free.size), NONE, np.int32)
    enabled = np.repeat(~free[None], order.size, axis=0)
    _kernels.fill(graph.start, graph.event, graph.target, order, number, delta, enabled)
    parts = states[order]
    plant_state = parts[:, :plants].copy()
    for array in (delta, enabled, parts, plant_state):
        array.flags.writeable = False  # so that they are not copied again
    behaviour = Automaton(graph.alphabet, delta, graph.marked[order], parts, name=name)
    return Supervisor(behaviour, plant_state, enabled), order

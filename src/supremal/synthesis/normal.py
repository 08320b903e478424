"""The closest behaviour that can be kept without seeing everything.

Observable languages are not closed under union, so there is no supremal one; normal ones are (see
`supremal.synthesis.observation`).  Where all controllable events are observable, the supremal controllable
and normal sublanguage is the supremal controllable and observable one.  Elsewhere it may be smaller than some
controllable and observable ones: it never disables an event that cannot be seen.

A normal K̄ is P⁻¹(T) ∩ L(G) for T = P(K̄), so the supremal one is found on the observer, whose states are the
estimates, the sets of states that the system may be in: take out the estimates that hold a state outside of
K̄, those that lead to one by an uncontrollable event, and those with a state from which no marked one can be
reached through what is left, until nothing more goes.

Source: Cho, Marcus, "On supremal languages of classes of sublanguages that arise in supervisor synthesis
problems with partial observation", Math. Control Signals Systems 2 (1989); Brandt, Garg, Kumar, Lin, Marcus,
Wonham, "Formulas for calculating supremal controllable and normal sublanguages", Systems & Control Letters 15
(1990); Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., section 3.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal._graph import coreachable_to, of_table, reachable_from, reverse
from supremal.automata.automaton import Automaton
from supremal.automata.compose import components
from supremal.automata.explore import as_parts, explore
from supremal.automata.reduce import keep
from supremal.synthesis._plants import possible, with_outside
from supremal.synthesis.observation import observer
from supremal.synthesis.supervisor import Supervisor


def synthesize_normal(
    plant: Automaton | Sequence[Automaton],
    spec: Automaton | Sequence[Automaton],
    *,
    nonblocking: bool = True,
    max_states: int | None = None,
) -> Supervisor:
    r"""Return the supervisor of the supremal controllable and normal sublanguage of ``spec`` in ``plant``.

    Where all controllable events are observable it is the supremal controllable and observable one.

    Parameters
    ----------
    plant
        What can happen: one automaton, or several that run side by side.
    spec
        What may happen: one automaton, or several that all have to hold.
    nonblocking
        False gives the prefix-closed one, for which marked states play no part.
    max_states
        The most states that the product, and its observer, may have; left out: what fits the machine.

    Returns
    -------
    Supervisor
        What it enables depends only on what is seen; an event that is not seen is always enabled.  To follow
        a system of which only the observable events are known, run `observer` of its ``automaton``.

    Raises
    ------
    AlphabetError
        If an event is controllable (observable) in one part and not in another.
    AutomatonError
        If there would be more than ``max_states`` states.

    Notes
    -----
    Linear in the sizes of the estimates for each round of the fixpoint; there can be 2^S estimates.

    Examples
    --------
    >>> from supremal import Alphabet, from_text
    >>> from supremal.synthesis.normal import synthesize_normal
    >>> from supremal.synthesis.observation import observer
    >>> sigma = Alphabet(("a", "leak", "b"), {"leak"}, unobservable=frozenset({"leak"}))
    >>> plant = from_text("0 -a-> 1 \n 0 -leak-> 2 \n 1 -b-> 3 \n 2 -a-> 4 \n 4 -b-> 3", alphabet=sigma)
    >>> spec = from_text("0 -a-> 1 \n 0 -leak-> 2 \n 1 -b-> 3 \n 2 -a-> 4", alphabet=sigma)
    >>> observer(synthesize_normal(plant, spec).automaton)
    <Automaton: 2 states, 1 transitions, 2 events>
    """
    plants, specs = as_parts(plant), as_parts(spec)
    graph = explore(plants, specs, max_states=max_states)
    product = Automaton(graph.alphabet, graph.delta(), graph.marked)
    can = possible(plants, graph.states, graph.alphabet)
    # A bad state was not explored: all that it is good for is to spoil the estimates that hold it.
    wider = with_outside(product, can & (product.delta == NONE) & ~graph.bad[:, None])
    estimates = observer(wider, max_states=max_states)
    whole, members = components(wider, estimates)
    where = members[:, 1]
    good = np.ones(estimates.n_states, np.bool_)
    good[where[np.append(graph.bad, True)[members[:, 0]]]] = False
    forced = reverse(*of_table(np.where(estimates.alphabet.controllable, np.int32(NONE), estimates.delta)))
    while True:
        good = ~reachable_from(*forced, ~good)
        alive = (
            coreachable_to(*of_table(whole.delta), whole.marked, good[where]) if nonblocking else good[where]
        )
        blocked = np.unique(where[good[where] & ~alive])
        if not blocked.size:
            break
        good[blocked] = False
    states = np.vstack([graph.states, np.full((1, graph.states.shape[1]), NONE)])[members[:, 0]]
    kept = keep(replace(whole, origin=np.hstack([states, where[:, None]])), good[where])
    return _supervisor(kept, estimates.delta, good, plants, specs)


def _supervisor(
    kept: Automaton, seen: Ints, good: Bools, plants: Sequence[Automaton], specs: Sequence[Automaton]
) -> Supervisor:
    """Read the control pattern off the estimates, the last column of ``origin``."""
    alphabet = kept.alphabet
    where = kept.origin[:, -1]
    enabled = np.ones(kept.delta.shape, np.bool_)
    visible = [e for e, name in enumerate(alphabet) if name not in alphabet.unobservable]
    leads = np.append(good, False)[seen]  # NONE reads the last entry
    enabled[:, visible] = leads[where]
    enabled |= ~alphabet.controllable
    name = " ∥ ".join(part.name for part in (*plants, *specs) if part.name)
    behaviour = replace(kept, origin=kept.origin[:, :-1], name=name)
    return Supervisor(behaviour, behaviour.origin[:, : len(plants)], enabled)

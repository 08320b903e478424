"""Can a specification be kept?  Controllability and nonblocking, with the shortest word that says no.

K is controllable with respect to a plant G iff K̄Σu ∩ L(G) ⊆ K̄, K̄ the prefix closure of K: whatever nobody
controls never leads out of K̄ (Theorem 1 of the paper).  K here is the *marked* language of the specification,
so its automaton is trimmed first.

Events that only the specification knows are possible in the plant at any time; events that only the plant
knows do not touch the specification.

Source: Ramadge, Wonham, "Supervisory control of a class of discrete event processes", SIAM J. Control Optim.
25 (1987); Cassandras, Lafortune, sections 3.4 and 3.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from supremal._arrays import NONE
from supremal._graph import first_seed, path_to, search
from supremal.automata.alphabet import union
from supremal.automata.automaton import Automaton
from supremal.automata.compare import shortest_word
from supremal.automata.compose import components
from supremal.automata.explore import as_parts, explore
from supremal.automata.reduce import coreachable, reachable, trim


@dataclass(frozen=True, slots=True)
class Violation:
    """The shortest proof that a specification cannot be kept.

    After ``word``, which the specification allows, the plant is in ``plant_state`` and the trimmed
    specification in ``spec_state``; there the uncontrollable ``event`` can happen and the specification
    forbids it.
    """

    word: tuple[str, ...]
    event: str
    plant_state: str
    spec_state: str

    def __str__(self) -> str:
        after = f"after {' '.join(self.word)}" if self.word else "at once"
        return (
            f"{after}, {self.event} can happen (plant in state {self.plant_state}), which nobody controls "
            f"and the specification forbids in its state {self.spec_state}"
        )


def find_uncontrollable(
    plant: Automaton | Sequence[Automaton], spec: Automaton | Sequence[Automaton]
) -> Violation | None:
    r"""Return the shortest violation of controllability, None if ``spec`` is controllable.

    Parameters
    ----------
    plant
        What can happen: one automaton, or several that run side by side.
    spec
        What may happen: one automaton, or several that all have to hold.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another.

    Notes
    -----
    Linear in the transitions of the product.

    Examples
    --------
    >>> from supremal import find_uncontrollable, from_text
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> spec = from_text("uncontrollable fault \n 0 -start-> 1 \n 1 -stop-> 0 \n 0 -fault-> 0")
    >>> find_uncontrollable(plant, spec)
    Violation(word=('start',), event='fault', plant_state='busy', spec_state='1')
    """
    plants, specs = as_parts(plant), as_parts(spec)
    product, spec_states = components(*specs)
    closure = trim(replace(product, origin=spec_states))
    graph = explore(plants, [closure])
    order, via = search(
        graph.start, graph.target, first_seed(len(graph.bad)), np.ones(len(graph.bad), np.bool_)
    )
    found = order[graph.bad[order]]
    if not found.size:
        return None
    state = int(found[0])
    word = graph.event[path_to(state, via, graph.start)]
    states = graph.states[state].tolist()
    return Violation(
        word=graph.alphabet.spell(word.tolist()),
        event=_escape(plants, closure, states),
        plant_state=_spell(plants, states[:-1]),
        spec_state=_spell(specs, closure.origin[states[-1]].tolist()),
    )


def _spell(parts: Sequence[Automaton], states: Sequence[int]) -> str:
    """Return the names of the states of ``parts``."""
    return ", ".join(part.state_name(q) for part, q in zip(parts, states, strict=True))


def _escape(plants: Sequence[Automaton], closure: Automaton, states: Sequence[int]) -> str:
    """Return the first uncontrollable event that all plants can follow and the specification cannot."""
    parts = [*plants, closure]
    uncontrollable = union(*(part.alphabet for part in parts)).uncontrollable

    def can(part: Automaton, state: int, name: str) -> bool:
        return name not in part.alphabet or part.run([name], state) != NONE

    return next(
        name
        for name in closure.alphabet
        if name in uncontrollable
        and all(can(part, q, name) for part, q in zip(plants, states, strict=False))
        and not can(closure, states[-1], name)
    )


def is_controllable(plant: Automaton | Sequence[Automaton], spec: Automaton | Sequence[Automaton]) -> bool:
    """Tell whether ``spec`` is controllable with respect to ``plant``."""
    return find_uncontrollable(plant, spec) is None


def find_blocking(automaton: Automaton) -> tuple[str, ...] | None:
    """Return a shortest word after which no marked state can be reached any more, None if there is none."""
    return shortest_word(automaton, reachable(automaton) & ~coreachable(automaton))


def is_nonblocking(automaton: Automaton) -> bool:
    """Tell whether from every reachable state a marked one can be reached."""
    return find_blocking(automaton) is None

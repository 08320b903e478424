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

from dataclasses import dataclass

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal.automata.automaton import Automaton
from supremal.automata.compare import shortest_word
from supremal.automata.compose import components, extend
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


def escapes(product: Automaton, plant: Automaton, plant_state: Ints) -> Bools:
    """Return where an uncontrollable event is possible in the plant and not in the product; ``bool [S, E]``.

    ``plant_state [S]`` is the state of ``plant``, which knows all events of the product, in each of its
    states.
    """
    columns = [plant.alphabet.index(name) for name in product.alphabet]
    possible = plant.delta[:, columns][plant_state] != NONE
    out: Bools = possible & (product.delta == NONE) & ~product.alphabet.controllable
    return out


def find_uncontrollable(plant: Automaton, spec: Automaton) -> Violation | None:
    r"""Return the shortest violation of controllability, None if ``spec`` is controllable.

    Linear in the transitions of the product.

    Raises
    ------
    AlphabetError
        If an event is controllable in one and not in the other.

    Examples
    --------
    >>> from supremal import find_uncontrollable, from_text
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> spec = from_text("uncontrollable fault \n 0 -start-> 1 \n 1 -stop-> 0 \n 0 -fault-> 0")
    >>> print(find_uncontrollable(plant, spec))
    after start, fault can happen (plant in state busy), which nobody controls and the specification
    forbids in its state 1
    """
    lifted, closure = extend(plant, spec.alphabet, stand_still=True), trim(spec)
    product, states = components(lifted, closure)
    wrong = escapes(product, lifted, states[:, 0])
    word = shortest_word(product, np.any(wrong, axis=1))
    if word is None:
        return None
    state = product.run(word)
    plant_state, spec_state = states[state].tolist()
    event = product.alphabet.names[int(np.argmax(wrong[state]))]
    kept = np.flatnonzero(reachable(spec) & coreachable(spec))  # the caller's numbers of its states
    return Violation(word, event, plant.state_name(plant_state), spec.state_name(int(kept[spec_state])))


def is_controllable(plant: Automaton, spec: Automaton) -> bool:
    """Tell whether ``spec`` is controllable with respect to ``plant``."""
    return find_uncontrollable(plant, spec) is None


def find_blocking(automaton: Automaton) -> tuple[str, ...] | None:
    """Return a shortest word after which no marked state can be reached any more, None if there is none."""
    return shortest_word(automaton, reachable(automaton) & ~coreachable(automaton))


def is_nonblocking(automaton: Automaton) -> bool:
    """Tell whether from every reachable state a marked one can be reached."""
    return find_blocking(automaton) is None

"""What the plants can do, and where that leaves a specification: what every kind of synthesis asks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton


def possible(plants: Sequence[Automaton], states: Ints, alphabet: Alphabet) -> Bools:
    """Return which events of ``alphabet`` all plants can follow that know them; ``bool [S, E]``.

    Column k of ``states`` is the state of plant k; further columns are not looked at.  What no plant knows is
    possible at any time.
    """
    can = np.ones((len(states), len(alphabet)), np.bool_)
    for k, plant in enumerate(plants):
        known = [e for e, name in enumerate(plant.alphabet) if name in alphabet]
        columns = [alphabet.index(plant.alphabet.names[e]) for e in known]
        can[:, columns] &= plant.delta[:, known][states[:, k]] != NONE
    return can


def with_outside(automaton: Automaton, breaks: Bools) -> Automaton:
    """Return ``automaton`` with one more state, which nothing leaves and all that ``breaks`` leads to."""
    delta = np.where(breaks, np.int32(automaton.n_states), automaton.delta)
    last = np.full((1, delta.shape[1]), NONE, np.int32)
    return Automaton(automaton.alphabet, np.vstack([delta, last]), np.append(automaton.marked, False))

"""A decision process as a language generator: the plant that Theorem 1 speaks of.

The paper reads the MDP as (S, A, Σ, L, r, p, γ) and lets δ(σ, s) = s' where an action labelled σ leads from s
to s' with positive probability.  Outcomes here are words, so that a word of several events passes through
states in between, and a silent outcome is a silent move; where this makes the generator nondeterministic, its
subset automaton is returned.  Probabilities and rewards play no part.
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Ints
from supremal.automata.automaton import Automaton
from supremal.automata.reduce import determinise
from supremal.decisions.mdp import TabularMDP


def plant_automaton(mdp: TabularMDP, *, name: str = "plant") -> Automaton:
    """Return the automaton of the words of events that ``mdp`` can produce.

    Its marked states are those of ``mdp``.  Linear in the outcomes where the generator is deterministic,
    exponential in the states at worst where it is not.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes, plant_automaton
    >>> lamp = from_outcomes(
    ...     [(0, "on", 1, 0.9, ("on",)), (0, "on", 0, 0.1, ("on", "fuse"))],
    ...     alphabet=Alphabet(("on", "fuse"), uncontrollable=frozenset({"fuse"})),
    ... )
    >>> plant_automaton(lamp).accepts(["on", "fuse", "on"])
    False
    """
    moves, states = _moves(mdp)
    start = np.flatnonzero(mdp.initial)
    order = np.argsort(moves[:, 0] * (len(mdp.alphabet) + 1) + moves[:, 1], kind="stable")
    moves = moves[order]
    same = (moves[1:, :2] == moves[:-1, :2]).all(axis=1) & (moves[1:, 2] != moves[:-1, 2])
    marked = np.append(mdp.marked, np.zeros(states - mdp.n_states, np.bool_))
    if same.any() or (moves[:, 1] == NONE).any() or start.size > 1:
        triples = (tuple(move) for move in moves.tolist())
        return determinise(mdp.alphabet, triples, start.tolist(), np.flatnonzero(marked).tolist(), name=name)
    number = np.arange(states)  # the initial state becomes state 0
    number[[0, start[0]]] = number[[start[0], 0]]
    delta = np.full((states, len(mdp.alphabet)), NONE, np.int32)
    delta[number[moves[:, 0]], moves[:, 1]] = number[moves[:, 2]]
    return Automaton(mdp.alphabet, delta, marked[number], name=name)


def _moves(mdp: TabularMDP) -> tuple[Ints, int]:
    """Return rows (from, event or `NONE`, to), and the number of states with those in between."""
    source = np.repeat(np.arange(mdp.n_states), np.diff(mdp.row[:: mdp.n_actions]))
    live = ~mdp.terminal[source]
    length = np.array([len(word) for word in mdp.words])
    first = np.array([word[0] if word else NONE for word in mdp.words])
    short = live & (length[mdp.word] <= 1)
    rows = [np.stack([source[short], first[mdp.word[short]], mdp.next_state[short]], axis=1)]
    states = mdp.n_states
    between: dict[tuple[int, tuple[int, ...]], int] = {}
    for o in np.flatnonzero(live & ~short).tolist():
        word = mdp.words[mdp.word[o]]
        at, passed = int(source[o]), []
        for i, event in enumerate(word[:-1], 1):
            key = (int(source[o]), word[:i])
            to = between.setdefault(key, states + len(between))
            passed.append((at, event, to))
            at = to
        passed.append((at, word[-1], int(mdp.next_state[o])))
        rows.append(np.array(passed))
    return np.unique(np.concatenate(rows), axis=0), states + len(between)

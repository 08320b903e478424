"""Random decision processes, small, from a seed; and the definitions that kernels are compared with.

Everything here is on explicit lists and sets, so that it can be read against the book.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product as combinations

import numpy as np

from supremal import Alphabet, Automaton, Outcome, TabularMDP, from_outcomes, from_transitions

SIGMA = Alphabet(("a", "b", "u"), uncontrollable=frozenset({"u"}))


def random_process(seed: int, *, states: int = 5, silent: bool = False) -> TabularMDP:
    """Return a process in which every outcome has a word; state 0 starts, some states end."""
    rng = np.random.default_rng(seed)
    terminal = [s for s in range(1, states) if rng.random() < 0.3] or [states - 1]
    lines = []
    for s in range(states):
        for action in ("a", "b"):
            if s in terminal or (action == "b" and rng.random() < 0.3):
                continue
            outcomes = rng.choice(states, size=rng.integers(1, 3), replace=False)
            prob = rng.dirichlet(np.ones(len(outcomes)) * 3)
            for i, (t, p) in enumerate(zip(outcomes.tolist(), prob.tolist(), strict=True)):
                words = [(action,), (action, "u"), ("u",), *([()] if silent else [])]
                word = (action,) if i == 0 else words[rng.integers(len(words))]
                lines.append(Outcome(s, action, t, p, word, float(rng.integers(-5, 3))))
    marked = [s for s in terminal if rng.random() < 0.8]
    labels = {s: [name for name in "xy" if rng.random() < 0.5] for s in range(states)}
    return from_outcomes(
        lines,
        alphabet=SIGMA,
        actions=("a", "b"),
        terminal=terminal,
        marked=marked,
        labels=labels,
        propositions="xy",
    )


WORDS = [
    (),
    ("a",),
    ("b",),
    ("u",),
    ("a", "u"),
    ("u", "a"),
    ("a", "b"),
    ("a", "a"),
    ("b", "u", "a"),
    ("b", "u", "b"),
]


def wild_process(seed: int, *, states: int = 5) -> TabularMDP:
    """Return a process with any words, dead ends, several starts, and an action that is no event."""
    rng = np.random.default_rng(seed)
    tame = rng.random() < 0.5  # most words begin with the action
    terminal = [s for s in range(states) if rng.random() < 0.2]
    lines = []
    for s in range(states):
        choices = [a for a in ("a", "b", "go") if rng.random() < (0.5 if a == "go" else 0.75)]
        surprises = [
            (WORDS[rng.choice([0, 3, 5])], int(rng.integers(states))) for _ in range(rng.integers(2))
        ]
        for action in choices if s not in terminal else []:
            found = dict.fromkeys(surprises)
            for _ in range(rng.integers(not surprises, 3)):
                words = [w for w in WORDS if w[:1] == (action,)] if tame and action != "go" else WORDS
                found[words[rng.integers(len(words))], int(rng.integers(states))] = None
            lines += [Outcome(s, action, t, 1 / len(found), word) for word, t in found]
    mdp = from_outcomes(
        lines,
        alphabet=SIGMA,
        actions=("a", "b", "go"),
        terminal=[*terminal, states - 1],
        marked=[s for s in range(states) if rng.random() < 0.3],
    )
    starts = rng.permutation(mdp.n_states)[: rng.choice([1, 1, 1, 2])]
    return replace(mdp, initial=np.isin(np.arange(mdp.n_states), starts) / starts.size)


def random_rule(seed: int, *, states: int = 3, owing: float = 0.0) -> Automaton:
    """Return a partial automaton over some of the events; ``owing`` is the share of unmarked states."""
    rng = np.random.default_rng(seed)
    names = [name for name in SIGMA if rng.random() < 0.8] or ["a"]
    alphabet = Alphabet(tuple(names), SIGMA.uncontrollable & set(names))
    triples = [
        (str(q), name, str(rng.integers(states)))
        for q in range(states)
        for name in names
        if rng.random() < 0.75
    ]
    numbers = [str(q) for q in range(states)]
    marked = [number for number in numbers if rng.random() >= owing]
    return from_transitions(alphabet, triples, states=numbers, marked=marked, name=f"rule{seed}")


def outcomes_of(mdp: TabularMDP, s: int, a: int) -> list[tuple[int, float, float, tuple[str, ...]]]:
    """Return (next state, probability, reward, word) for each outcome."""
    at = mdp.outcomes(s, a)
    return [
        (int(mdp.next_state[o]), float(mdp.prob[o]), float(mdp.reward[o]), mdp.spell(int(mdp.word[o])))
        for o in range(at.start, at.stop)
    ]


def feasible_pairs(mdp: TabularMDP) -> list[tuple[int, int]]:
    """Return the pairs of a state that is not terminal and a feasible action."""
    pairs = combinations(range(mdp.n_states), range(mdp.n_actions))
    return [(s, a) for s, a in pairs if not mdp.terminal[s] and outcomes_of(mdp, s, a)]


def follow(rule: Automaton, q: int, word: tuple[str, ...]) -> int:
    """Return where ``word`` leads from ``q``, -1 if it breaks the rule."""
    for name in word:
        if q >= 0 and name in rule.alphabet:
            q = int(rule.delta[q, rule.alphabet.index(name)])
    return q


def arrive(mdp: TabularMDP, rule: Automaton, q: int, word: tuple[str, ...], t: int) -> int:
    """Return where ``word`` leads from ``q``: to -1 if it breaks the rule, or ends in ``t`` and owes it."""
    q = follow(rule, q, word)
    return -1 if q >= 0 and mdp.terminal[t] and not rule.marked[q] else q


def is_safe_mask(mdp: TabularMDP, broken: set[int], mask: set[tuple[int, int]], *, nonblocking: bool) -> bool:
    """Tell whether ``mask`` keeps every state from which it enables something safe, by definition."""
    acting = {s for s, _ in mask}
    safe = {s for s in range(mdp.n_states) if s not in broken and (mdp.terminal[s] or s in acting)}
    if any(t not in safe for s, a in mask for t, *_ in outcomes_of(mdp, s, a)):
        return False
    if not nonblocking:
        return True
    alive = {s for s in safe if mdp.terminal[s] or mdp.marked[s]}
    while True:
        more = {s for s, a in mask if any(t in alive for t, *_ in outcomes_of(mdp, s, a))}
        if more <= alive:
            return acting <= alive
        alive |= more


def matrices(mdp: TabularMDP, policy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return P and the expected rewards of a deterministic policy, zero in terminal states."""
    p, r = np.zeros((mdp.n_states, mdp.n_states)), np.zeros(mdp.n_states)
    for s in range(mdp.n_states):
        if not mdp.terminal[s] and policy[s] >= 0:
            for t, prob, reward, _ in outcomes_of(mdp, s, int(policy[s])):
                p[s, t] += prob
                r[s] += prob * reward
    return p, r

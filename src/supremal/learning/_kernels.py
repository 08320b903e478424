"""Algorithm 1 on flat arrays.

One draw of 53 random bits decides whether to explore and, where it does, which way: given that u < ε, u / ε
is again uniform.  A second is drawn only where an action has several outcomes.  The best action of the next
state is found once, for the bootstrap, and kept for the choice that follows.

The generator is SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA
2014): its state moves by a constant, so that it lives in a register.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from supremal._arrays import Bools, Floats, Ints
from supremal._jit import kernel

_GOLDEN: Final = np.uint64(0x9E3779B97F4A7C15)
_MIX_1: Final = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2: Final = np.uint64(0x94D049BB133111EB)
_30: Final = np.uint64(30)
_27: Final = np.uint64(27)
_31: Final = np.uint64(31)
_11: Final = np.uint64(11)
_UNIT: Final = 2.0**-53


@kernel
def uniform(state: np.uint64) -> float:
    """Return the number in [0, 1) that a generator in ``state`` gives."""
    z = (state ^ (state >> _30)) * _MIX_1
    z = (z ^ (z >> _27)) * _MIX_2
    return float((z ^ (z >> _31)) >> _11) * _UNIT


@kernel
def pick(weights: Floats, first: int, end: int, u: float) -> int:
    """Return which of ``weights[first:end]``, which sum to 1, the number ``u`` in [0, 1) falls on."""
    k = first
    while k < end - 1 and u >= weights[k]:
        u -= weights[k]
        k += 1
    return k


@kernel
def find_best(q: Floats, first: int, end: int) -> int:
    """Return where ``q[first:end]`` is largest, the first such place."""
    best, top = first, q[first]
    for c in range(first + 1, end):
        if q[c] > top:
            best, top = c, q[c]
    return best


@kernel
def q_learning(
    choice: Ints,
    outcome: Ints,
    target: Ints,
    prob: Floats,
    reward: Floats,
    word: Ints,
    marked: Bools,
    start_state: Ints,
    start_prob: Floats,
    rule_next: Ints,
    rule_breaks: Ints,
    alpha: float,
    gamma: float,
    epsilon: float,
    limit: int,
    q: Floats,
    random: np.ndarray,
    returns: Floats,
    lengths: Ints,
    completed: Bools,
    violations: Ints,
) -> None:
    """Run one episode for each entry of ``returns``, teaching ``q``, one number for each choice.

    ``choice`` to ``word`` are those of `supremal.decisions.planning.Choices`; a state ends the episode where
    it has no choice.  ``rule_next`` and ``rule_breaks [M, W]`` are the joint monitor of the rules.
    ``random[0]`` is the generator's state.
    """
    rng = random[0]
    for episode in range(returns.shape[0]):
        rng += _GOLDEN
        s = start_state[pick(start_prob, 0, start_prob.shape[0], uniform(rng))]
        monitor = 0
        score = 0.0
        broken = 0
        steps = 0
        done = marked[s]
        first, end = choice[s], choice[s + 1]
        best = find_best(q, first, end)
        while steps < limit and first < end:
            c = best
            rng += _GOLDEN
            u = uniform(rng)
            if u < epsilon:
                c = first + min(int(u / epsilon * (end - first)), end - first - 1)
            o = outcome[c]
            if outcome[c + 1] - o > 1:
                rng += _GOLDEN
                o = pick(prob, o, outcome[c + 1], uniform(rng))
            r = reward[o]
            broken += rule_breaks[monitor, word[o]]
            monitor = rule_next[monitor, word[o]]
            score += r
            steps += 1
            before, s = s, target[o]
            first, end = choice[s], choice[s + 1]
            if first == end:
                q[c] += alpha * (r - q[c])
            else:
                best = find_best(q, first, end)
                q[c] += alpha * (r + gamma * q[best] - q[c])
                if s == before:
                    best = find_best(q, first, end)
            done = done or marked[s]
        returns[episode] = score
        lengths[episode] = steps
        completed[episode] = done
        violations[episode] = broken
    random[0] = rng

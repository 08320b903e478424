"""Algorithm 1 and its relatives on flat arrays.

One draw of 53 random bits decides whether to explore and, where it does, which way: given that u < ε, u / ε
is again uniform.  A second is drawn only where an action has several outcomes, and a third where one of two
tables is to be taught.  The best action of the next state is found once, for the bootstrap, and kept for the
choice that follows.

The generator is SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA
2014): its state moves by a constant, so that it lives in a register, and SARSA can look at the draw that
will choose the next action before that action is taken.

The algorithms differ in one line, `future`.  `learner` makes a kernel of each, since a branch in the inner
loop is dear: 46 million steps a second become 35 where the algorithm is an argument.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Final

import numpy as np

from supremal._arrays import Bools, Floats, Ints, Longs
from supremal._jit import kernel

_GOLDEN: Final = np.uint64(0x9E3779B97F4A7C15)
_MIX_1: Final = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2: Final = np.uint64(0x94D049BB133111EB)
_30: Final = np.uint64(30)
_27: Final = np.uint64(27)
_31: Final = np.uint64(31)
_11: Final = np.uint64(11)
_UNIT: Final = 2.0**-53

Q_LEARNING: Final = 0
DOUBLE: Final = 1
SARSA: Final = 2
EXPECTED: Final = 3


@kernel
def uniform(state: np.uint64) -> float:
    """Return the number in [0, 1) that a generator in ``state`` gives."""
    z = (state ^ (state >> _30)) * _MIX_1
    z = (z ^ (z >> _27)) * _MIX_2
    return float((z ^ (z >> _31)) >> _11) * _UNIT


@kernel
def pick(step: np.ndarray, first: int, end: int, u: float) -> int:
    """Return on which of ``step[first:end]``, whose chances sum to 1, the number ``u`` in [0, 1) falls."""
    k = first
    while k < end - 1 and u >= step[k]["prob"]:
        u -= step[k]["prob"]
        k += 1
    return k


@kernel
def find_best(q: Floats, first: int, count: int) -> int:
    """Return where ``q[first : first + count]`` is largest, the first such place."""
    best = 0
    if count:
        top = q[first]
        for i in range(1, count):
            value = q[first + i]
            if value > top:
                best, top = i, value
    return first + best


@kernel
def find_best_of_two(q: Floats, size: int, first: int, count: int) -> int:
    """Return where the sum of two tables, each of ``size`` choices, is largest."""
    best = 0
    if count:
        top = float(q[first]) + float(q[first + size])
        for i in range(1, count):
            value = float(q[first + i]) + float(q[first + size + i])
            if value > top:
                best, top = i, value
    return first + best


@kernel
def choose(best: int, first: int, count: int, epsilon: float, u: float) -> int:
    """Return the ε-greedy choice that the draw ``u`` makes."""
    return first + min(int(u / epsilon * count), count - 1) if u < epsilon else best


@kernel
def future(
    algorithm: int, q: Floats, other: int, best: int, first: int, count: int, epsilon: float, u: float
) -> float:
    """Return what the next state is worth, with its choices ``first`` to ``first + count``.

    ``best`` is the best of them.  Double Q-learning takes the ``other`` table's word for what it is worth; in
    Q-learning both tables are the same one, 0.  ``u`` is the draw that chooses the next action.
    """
    if algorithm == SARSA:
        return float(q[choose(best, first, count, epsilon, u)])
    if algorithm == EXPECTED:
        total = 0.0
        for c in range(first, first + count):
            total += q[c]
        return (1 - epsilon) * float(q[best]) + epsilon * (total / count)
    return float(q[other + best])


@kernel
def teach(
    algorithm: int,
    counted: bool,  # noqa: FBT001 - known when a learner is compiled
    step: np.ndarray,
    o: int,
    c: int,
    own: int,
    other: int,
    q: Floats,
    visits: Longs,
    alpha: float,
    power: float,
    gamma: float,
    epsilon: float,
    u: float,
) -> int:
    """Move what choice ``c`` is worth towards what outcome ``o`` says; return the best choice after it.

    ``own`` is where the table that learns begins in ``q``, ``other`` where the one that is asked does.
    """
    x = step[o]
    goal, first, count = float(x["reward"]), int(x["first"]), x["count"]
    best = first
    if count:
        best = find_best(q, own + first, count) - own
        goal += gamma * future(algorithm, q, other, best, first, count, epsilon, u)
    at = own + c
    if counted:
        visits[at] += 1
        alpha = float(visits[at]) ** -power
    old = float(q[at])
    q[at] = old + alpha * (goal - old)
    return best


@cache
def learner(algorithm: int, *, lessons: bool, counted: bool) -> Callable[..., None]:
    """Return the kernel of an algorithm, with or without counterfactual lessons and counted visits."""

    @kernel
    def learn(
        outcome: Ints,
        step: np.ndarray,
        start: np.ndarray,
        verdict: Longs,
        owed: Ints,
        group: Longs,
        bound: Longs,
        member: Longs,
        owner: Ints,
        alpha: Floats,
        epsilon: Floats,
        power: float,
        gamma: float,
        limit: int,
        until: int,
        progress: np.ndarray,
        q: Floats,
        visits: Longs,
        returns: Floats,
        lengths: Ints,
        completed: Bools,
        violations: Ints,
    ) -> None:
        """Run episodes up to number ``until``, teaching ``q``, one number for each choice and table.

        ``outcome`` to ``owed`` are those of `supremal.learning.course.Course`, ``group`` to ``owner`` those
        of `supremal.learning.counterfactual.Lessons`.  ``alpha`` and ``epsilon`` have an entry for each of
        these episodes, ``returns`` to ``violations`` one for every episode.  ``progress`` is the generator's
        state and the number of episodes that have been run.
        """
        rng = progress[0]
        size = outcome.shape[0] - 1
        letters = verdict.shape[0] // owed.shape[0]
        begun = np.int64(progress[1])
        for episode in range(begun, until):
            a, e = alpha[episode - begun], epsilon[episode - begun]
            rng += _GOLDEN
            x = start[pick(start, 0, start.shape[0], uniform(rng))]
            first, count, done = x["first"], x["count"], np.int64(x["letter"])
            monitor, broken, score, steps, own, other = 0, 0, 0.0, 0, 0, 0
            best = find_best(q, first, count)
            if algorithm == DOUBLE:
                best = find_best_of_two(q, size, first, count)
            while steps < limit and count:
                rng += _GOLDEN
                c = choose(best, first, count, e, uniform(rng))
                o = int(outcome[c])
                if outcome[c + 1] - o > 1:
                    rng += _GOLDEN
                    o = pick(step, o, outcome[c + 1], uniform(rng))
                if algorithm == DOUBLE:
                    rng += _GOLDEN
                    own, other = (size, 0) if uniform(rng) < 0.5 else (0, size)
                x = step[o]
                said = verdict[monitor + x["letter"]]
                monitor = said >> 32
                broken += (said & 0xFFFFFFFF) >> 1
                done |= said & 1
                score += x["reward"]
                steps += 1
                before, first, count = first, x["first"], x["count"]
                u = uniform(rng + _GOLDEN)
                if lessons:
                    for k in range(bound[group[o]], bound[group[o] + 1]):
                        m = member[k]
                        c = int(owner[m])
                        teach(algorithm, counted, step, m, c, own, other, q, visits, a, power, gamma, e, u)
                    best = find_best(q, first, count)
                else:
                    best = teach(algorithm, counted, step, o, c, own, other, q, visits, a, power, gamma, e, u)
                    if first == before and algorithm != SARSA:
                        best = find_best(q, first, count)
                if algorithm == DOUBLE:
                    best = find_best_of_two(q, size, first, count)
            if algorithm == SARSA:
                rng += _GOLDEN  # the draw of the action that was not taken
            returns[episode] = score
            lengths[episode] = steps
            completed[episode] = done == 1
            if count == 0:
                broken += owed[monitor // letters]
            violations[episode] = broken
        progress[0] = rng
        progress[1] = until

    return learn

"""Kernels that solve a discounted process as a whole, or one part after another.

Arrays are those of `supremal.decisions._planning_kernels`, with unsigned indices.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from supremal._arrays import NONE, Floats, Longs
from supremal._jit import kernel
from supremal.decisions._planning_kernels import Naturals, bellman, take

_EPS: Final = float(np.finfo(np.float64).eps)
_SWEEPS: Final = 20
_ENOUGH: Final = 0.1


@kernel
def follow(
    start: Naturals,
    target: Naturals,
    prob: Floats,
    gain: Floats,
    gamma: float,
    value: Floats,
    fading: Floats,
) -> tuple[float, float]:
    """Sweep over ``value`` in place; return the largest change, and Σ change · ``fading``."""
    change = along = 0.0
    for s in range(value.shape[0]):
        total = 0.0
        for o in range(start[s], start[s + 1]):
            total += prob[o] * value[target[o]]
        total = gain[s] + gamma * total
        change = max(change, abs(total - value[s]))
        along += (total - value[s]) * fading[s]
        value[s] = total
    return change, along


@kernel
def fade(
    start: Naturals, target: Naturals, prob: Floats, gamma: float, shape: Floats, fading: Floats
) -> float:
    """Sweep over ``shape`` with nothing earned, in place; write the loss to ``fading``, return its |·|²."""
    squares = 0.0
    for s in range(shape.shape[0]):
        total = 0.0
        for o in range(start[s], start[s + 1]):
            total += prob[o] * shape[target[o]]
        fading[s] = shape[s] - gamma * total
        squares += fading[s] * fading[s]
        shape[s] = gamma * total
    return squares


@kernel
def approach(
    choice: Naturals,
    outcome: Naturals,
    target: Naturals,
    prob: Floats,
    gain: Floats,
    gamma: float,
    tolerance: float,
    rounds: int,
    patience: float,
    value: Floats,
) -> bool:
    """Improve ``value`` by modified policy iteration, in place; every state has a choice.

    A round improves the policy in one sweep and follows it for some.  It ends when no value changes by more
    than ``tolerance``, or by more than rounding does, and gives up, for which it returns False, where a round
    leaves more than ``patience`` of the change.

    Let G v + h be a sweep, d the change that it makes of v, and w a shape.  Had v + c w been swept, then the
    change were d - c (w - G w), which is least for c = <d, w - G w> / |w - G w|².  So c G w is added after
    each sweep.  The next shape is G w, which tends to what fades most slowly.
    """
    best, shape, fading = np.full(value.shape[0], NONE), np.ones(value.shape[0]), np.empty(value.shape[0])
    for _ in range(rounds):
        change, changed = bellman(choice, outcome, target, prob, gain, gamma, value, value, best)
        finest = max(tolerance, 2 * _EPS * np.max(np.abs(value)))
        if change <= finest:
            break
        if changed:
            start, to, weight, earned = take(outcome, target, prob, gain, best)
            if np.max(shape) <= _EPS:  # a policy that leaves at once has no shape
                shape[:] = 1.0
            squares = fade(start, to, weight, gamma, shape, fading)
        step, goal = change, max(_ENOUGH * change if changed else 0.0, finest)
        for _ in range(_SWEEPS):
            step, along = follow(start, to, weight, earned, gamma, value, fading)
            value += along / squares * shape
            if step <= goal:
                break
        if step > patience * change:
            return False
    return True


@kernel
def cut_out(
    states: Naturals,
    place: Longs,
    choice: Naturals,
    outcome: Naturals,
    target: Naturals,
    prob: Floats,
    gain: Floats,
    gamma: float,
    value: Floats,
) -> tuple[Naturals, Naturals, Naturals, Floats, Floats]:
    """Return the process of some ``states``, numbered as there; what others are worth is earned on leaving.

    A choice is taken until its state is left.  ``place [S]`` is `NONE` outside, before and after.
    """
    choices = edges = 0
    for j, s in enumerate(states):
        place[s] = j
        choices += choice[s + 1] - choice[s]
        edges += outcome[choice[s + 1]] - outcome[choice[s]]
    first, begin = np.zeros(states.shape[0] + 1, np.uint32), np.zeros(choices + 1, np.uint32)
    to, weight, earned = np.empty(edges, np.uint32), np.empty(edges), np.empty(choices)
    k = n = 0
    for j, s in enumerate(states):
        for c in range(choice[s], choice[s + 1]):
            total, leaves = gain[c], 1.0
            for o in range(outcome[c], outcome[c + 1]):
                if target[o] == s:
                    leaves -= gamma * prob[o]
                elif place[target[o]] != NONE:
                    to[n], weight[n] = place[target[o]], prob[o]
                    n += 1
                else:
                    total += gamma * prob[o] * value[target[o]]
            weight[begin[k] : n] /= leaves
            earned[k] = total / leaves
            k += 1
            begin[k] = n
        first[j + 1] = k
    place[states] = NONE
    return first, begin, to[:n], weight[:n], earned


@kernel
def settle(
    order: Naturals,
    bounds: Longs,
    choice: Naturals,
    outcome: Naturals,
    target: Naturals,
    prob: Floats,
    gain: Floats,
    gamma: float,
    tolerance: float,
    rounds: int,
    value: Floats,
) -> None:
    """Solve one component after the other; component i is ``order[bounds[i] : bounds[i + 1]]``."""
    place = np.full(value.shape[0], NONE)
    for i in range(bounds.shape[0] - 1):
        states = order[bounds[i] : bounds[i + 1]]
        part = cut_out(states, place, choice, outcome, target, prob, gain, gamma, value)
        if states.shape[0] > 1:
            inside = value[states]
            approach(*part, gamma, tolerance, rounds, np.inf, inside)
            value[states] = inside
        elif part[4].shape[0]:
            value[states[0]] = np.max(part[4])

"""One step of a learner whose table grows: learn from where the last action led, and choose the next one.

States are numbered as they come.  As in `supremal.learning._kernels`, one draw decides whether to explore and
which way, and SARSA looks at it before the action that it chooses is taken.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Longs
from supremal._hash import find_row
from supremal._jit import kernel
from supremal.learning._kernels import _GOLDEN, DOUBLE, EXPECTED, SARSA, choose, uniform

ROW: Final = 0
ACTION: Final = 1
COUNT: Final = 2
"""What ``at`` holds: the state and the action that were last, `NONE` at a start; and how many states."""


@kernel
def find_enabled_best(q: Floats, row: int, tables: int, enabled: Bools) -> int:
    """Return the enabled action with the largest sum over the first ``tables``, `NONE` if none is enabled."""
    best, top = NONE, 0.0
    for a in range(enabled.shape[0]):
        if enabled[a]:
            value = float(q[0, row, a])
            if tables > 1:
                value += float(q[1, row, a])
            if best == NONE or value > top:
                best, top = a, value
    return best


@kernel
def nth_enabled(enabled: Bools, n: int) -> int:
    """Return the enabled action that has ``n`` enabled ones before it."""
    a = 0
    while n > 0 or not enabled[a]:
        n -= enabled[a]
        a += 1
    return a


@kernel
def next_action(best: int, enabled: Bools, epsilon: float, u: float) -> int:
    """Return the ε-greedy action that the draw ``u`` makes."""
    if u >= epsilon:
        return best
    return nth_enabled(enabled, choose(0, 0, enabled.sum(), epsilon, u))


@kernel
def future(
    algorithm: int, q: Floats, other: int, row: int, best: int, enabled: Bools, epsilon: float, u: float
) -> float:
    """Return what a state is worth; ``best`` is the best action of the table that learns."""
    if algorithm == SARSA:
        return float(q[0, row, next_action(best, enabled, epsilon, u)])
    if algorithm == EXPECTED:
        total, count = 0.0, 0
        for a in range(enabled.shape[0]):
            if enabled[a]:
                total += q[0, row, a]
                count += 1
        return (1 - epsilon) * float(q[0, row, best]) + epsilon * (total / count)
    return float(q[other, row, best])


@kernel
def advance(
    algorithm: int,
    slots: Longs,
    key: Longs,
    enabled: Bools,
    over: bool,  # noqa: FBT001 - a kernel takes scalars by place
    reward: float,
    at: Longs,
    random: np.ndarray,
    q: Floats,
    visits: Longs,
    allowed: Bools,
    alpha: float,
    power: float,
    gamma: float,
    epsilon: float,
) -> int:
    """Teach ``q [T, capacity, A]`` the last step; return the next action, `NONE` if there is none.

    The step earned ``reward`` and led to the state with this ``key``, where these actions are ``enabled``,
    or, if it is ``over``, to the end.  ``allowed [capacity, A]`` keeps what was enabled in each state.  Rates
    are ``alpha``, or by ``visits`` where ``power`` is not 0.  There has to be room for one more state.
    """
    row, best, u, tables = NONE, NONE, 0.0, q.shape[0]
    own, other = 0, 0
    if algorithm == DOUBLE:
        random[0] += _GOLDEN
        own, other = (1, 0) if uniform(random[0]) < 0.5 else (0, 1)
    if not over:
        slot = find_row(slots, key)
        if slots[slot, 0] == 0:
            at[COUNT] += 1
            slots[slot, 0] = at[COUNT]
            slots[slot, 1:] = key
        row = slots[slot, 0] - 1
        allowed[row] = enabled
        best = find_enabled_best(q[own:], row, 1, enabled)
        if best == NONE:
            return NONE
        random[0] += _GOLDEN
        u = uniform(random[0])
    if at[ROW] != NONE:
        s, a = at[ROW], at[ACTION]
        goal = reward
        if not over:
            goal += gamma * future(algorithm, q, other, row, best, enabled, epsilon, u)
        if power > 0:
            visits[own, s, a] += 1
            alpha = float(visits[own, s, a]) ** -power
        q[own, s, a] += alpha * (goal - q[own, s, a])
    if over:
        at[ROW] = NONE
        return NONE
    if algorithm != SARSA or tables > 1:
        best = find_enabled_best(q, row, tables, enabled)
    at[ROW] = row
    at[ACTION] = next_action(best, enabled, epsilon, u)
    return int(at[ACTION])

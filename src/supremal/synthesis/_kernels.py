"""The fixpoint of synthesis: worklists over the explored product, and cutting out what is left."""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._jit import kernel


@kernel
def turn_round(start: Longs, event: Ints, target: Ints, free: Bools) -> tuple[Longs, Ints]:
    """Return the reversed edges; the source s of an edge that nobody controls stands as ``~s``.

    ``free [E]`` tells which events are controllable.
    """
    states = start.shape[0] - 1
    into = np.zeros(states + 1, np.int64)
    for t in target:
        into[t + 1] += 1
    for t in range(states):
        into[t + 1] += into[t]
    fill = into[:-1].copy()
    source = np.empty(target.shape[0], np.int32)
    for s in range(states):
        for k in range(start[s], start[s + 1]):
            t = target[k]
            source[fill[t]] = s if free[event[k]] else ~s
            fill[t] += 1
    return into, source


@kernel
def shrink(into: Longs, source: Ints, marked: Bools, good: Bools, left: Ints) -> None:
    """Take states out of ``good`` until what is left is controllable and nonblocking.

    ``left [S]`` counts the controllable edges of the states that must keep one and is `NONE` elsewhere.
    """
    states = good.shape[0]
    queue = np.empty(states, np.int32)
    alive = np.zeros(states, np.bool_)
    tail = 0
    for s in range(states):
        if left[s] == 0:
            good[s] = False
        if not good[s]:
            queue[tail] = s
            tail += 1
    while True:
        head = 0
        while head < tail:
            t = queue[head]
            head += 1
            for k in range(into[t], into[t + 1]):
                forced = source[k] < 0
                s = ~source[k] if forced else source[k]
                if not good[s]:
                    continue
                if not forced and left[s] > 0:
                    left[s] -= 1
                    forced = left[s] == 0
                if forced:
                    good[s] = False
                    queue[tail] = s
                    tail += 1
        tail = find_blocked(into, source, marked, good, alive, queue)
        if tail == 0:
            return


@kernel
def find_blocked(into: Longs, source: Ints, marked: Bools, good: Bools, alive: Bools, queue: Ints) -> int:
    """Take out of ``good`` what cannot reach a marked state through it; queue it, return how much."""
    states = good.shape[0]
    tail = 0
    for s in range(states):
        alive[s] = good[s] and marked[s]
        if alive[s]:
            queue[tail] = s
            tail += 1
    head = 0
    while head < tail:
        t = queue[head]
        head += 1
        for k in range(into[t], into[t + 1]):
            s = source[k] if source[k] >= 0 else ~source[k]
            if good[s] and not alive[s]:
                alive[s] = True
                queue[tail] = s
                tail += 1
    count = 0
    for s in range(states):
        if good[s] and not alive[s]:
            good[s] = False
            queue[count] = s
            count += 1
    return count


@kernel
def reach(start: Longs, target: Ints, good: Bools, number: Ints) -> Ints:
    """Return the ``good`` states reachable through good ones, nearest first; ``number`` numbers them."""
    states = good.shape[0]
    order = np.empty(states, np.int32)
    count = 0
    if states > 0 and good[0]:
        number[0] = 0
        order[0] = 0
        count = 1
    head = 0
    while head < count:
        for k in range(start[order[head]], start[order[head] + 1]):
            t = target[k]
            if good[t] and number[t] == NONE:
                number[t] = count
                order[count] = t
                count += 1
        head += 1
    return order[:count]


@kernel
def fill(
    start: Longs, event: Ints, target: Ints, order: Ints, number: Ints, delta: Ints, enabled: Bools
) -> None:
    """Write the edges between numbered states to ``delta [len(order), E]``, and that they are ``enabled``."""
    for i in range(order.shape[0]):
        for k in range(start[order[i]], start[order[i] + 1]):
            to = number[target[k]]
            delta[i, event[k]] = to
            if to != NONE:
                enabled[i, event[k]] = True

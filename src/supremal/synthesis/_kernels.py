"""The fixpoint of synthesis, which remembers why each state goes, and cutting out what is left."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._jit import kernel

KEPT: Final = 0
ESCAPES: Final = 1
FORCED: Final = 2
STUCK: Final = 3
BLOCKED: Final = 4

Causes = NDArray[np.int8]


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
def remove(
    start: Longs,
    into: Longs,
    source: Ints,
    marked: Bools,
    bad: Bools,
    left: Ints,
) -> tuple[Causes, Ints]:
    """Take states out until what is left is controllable and nonblocking; return why each goes, after which.

    ``cause [S]`` is `KEPT` or why: `ESCAPES` from a rule by something uncontrollable at once (those that are
    ``bad``), is `FORCED` by something uncontrollable to ``after [S]``, is `STUCK` because no controllable
    event is left, the last of which led to ``after`` (`NONE`: the rules allow none), or is `BLOCKED`, where
    ``after`` is the next state on the shortest way to one that went earlier or that has no edges (`NONE`: it
    has none itself, or there is no such way).  So following ``after`` never goes round in a circle.

    Queues are first in, first out; so within one round ``after`` spells the shortest way to the end.  Edges
    are given by where they ``start`` and, turned round, as `turn_round` returns them.
    """
    states = marked.shape[0]
    cause = np.full(states, KEPT, np.int8)
    after = np.full(states, NONE, np.int32)
    queue = np.empty(states, np.int32)
    tail = 0
    for s in range(states):
        if bad[s] or left[s] == 0:
            cause[s] = ESCAPES if bad[s] else STUCK
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
                if cause[s] != KEPT:
                    continue
                if forced:
                    cause[s] = FORCED
                elif left[s] > 0:
                    left[s] -= 1
                    if left[s] == 0:
                        cause[s] = STUCK
                if cause[s] != KEPT:
                    after[s] = t
                    queue[tail] = s
                    tail += 1
        tail = block(start, into, source, marked, cause, after, queue)
        if tail == 0:
            return cause, after


@kernel
def block(
    start: Longs, into: Longs, source: Ints, marked: Bools, cause: Causes, after: Ints, queue: Ints
) -> int:
    """Find what cannot reach a marked state through what is kept; put it in ``queue``, return how much."""
    states = marked.shape[0]
    alive = np.zeros(states, np.bool_)
    tail = 0
    for s in range(states):
        if cause[s] == KEPT and marked[s]:
            alive[s] = True
            queue[tail] = s
            tail += 1
    head = 0
    while head < tail:
        for k in range(into[queue[head]], into[queue[head] + 1]):
            s = source[k] if source[k] >= 0 else ~source[k]
            if cause[s] == KEPT and not alive[s]:
                alive[s] = True
                queue[tail] = s
                tail += 1
        head += 1
    count = 0
    for s in range(states):
        if cause[s] == KEPT and not alive[s]:
            queue[count] = s
            count += 1
    if count == 0:
        return 0
    exits = np.empty(states, np.int32)
    tail = 0
    for t in range(states):
        if cause[t] != KEPT or start[t] == start[t + 1]:
            exits[tail] = t
            tail += 1
    head = 0
    while head < tail:  # what has gone already or has no edges, then what leads there, nearest first
        t = exits[head]
        head += 1
        for k in range(into[t], into[t + 1]):
            s = source[k] if source[k] >= 0 else ~source[k]
            if cause[s] == KEPT and not alive[s] and after[s] == NONE and start[s] < start[s + 1]:
                after[s] = t
                exits[tail] = s
                tail += 1
    for i in range(count):
        cause[queue[i]] = BLOCKED
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

"""The fixpoint of synthesis once more, remembering why each state goes; and distances, for shortest words."""

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
def remove(
    start: Longs,
    into: Longs,
    source: Ints,
    marked: Bools,
    bad: Bools,
    left: Ints,
) -> tuple[Causes, Ints]:
    """Take out states as `_kernels.shrink` does; return why each goes, and which one it goes after.

    ``cause [S]`` is `KEPT` or why: `ESCAPES` from a rule by something uncontrollable at once (those that are
    ``bad``), is `FORCED` by something uncontrollable to ``after [S]``, is `STUCK` because no controllable
    event is left, the last of which led to ``after`` (`NONE`: the rules allow none), or is `BLOCKED`, where
    ``after`` is the next state on the shortest way to one that went earlier or that has no edges (`NONE`: it
    has none itself, or there is no such way).  So following ``after`` never goes round in a circle.

    Queues are first in, first out; so within one round ``after`` spells the shortest way to the end.  Edges
    are given by where they ``start`` and, turned round, as `_kernels.turn_round` returns them.
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
    count = 0
    for s in range(states):
        if cause[s] == KEPT and not alive[s]:
            cause[s] = BLOCKED
            queue[count] = s
            count += 1
    return count


@kernel
def follow(delta: Ints, start: Longs, event: Ints, target: Ints) -> Ints:
    """Return the state of a graph in which each state of ``delta [S, E]`` finds it, `NONE` where it cannot.

    The states of ``delta`` are all reachable from the first, which is beside the first of the graph.
    """
    image = np.full(delta.shape[0], NONE, np.int32)
    queue = np.empty(delta.shape[0], np.int32)
    image[:1] = 0
    queue[:1] = 0
    tail = min(1, delta.shape[0])
    head = 0
    while head < tail:
        i = queue[head]
        head += 1
        for k in range(start[image[i]], start[image[i] + 1]):
            j = delta[i, event[k]]
            if j != NONE and image[j] == NONE and target[k] != NONE:
                image[j] = target[k]
                queue[tail] = j
                tail += 1
    return image


@kernel
def parents(delta: Ints) -> tuple[Ints, Ints]:
    """Return the state before each state of ``delta [S, E]`` on a shortest word to it, and the event between.

    All states are reachable from the first; it has `NONE` for both.
    """
    parent = np.full(delta.shape[0], NONE, np.int32)
    last = np.full(delta.shape[0], NONE, np.int32)
    queue = np.zeros(delta.shape[0], np.int32)
    tail = min(1, delta.shape[0])
    head = 0
    while head < tail:
        s = queue[head]
        head += 1
        for e in range(delta.shape[1]):
            t = delta[s, e]
            if t > 0 and parent[t] == NONE:
                parent[t] = s
                last[t] = e
                queue[tail] = t
                tail += 1
    return parent, last


@kernel
def leaving(start: Longs, target: Ints, kept: Bools, away: Ints) -> Ints:
    """Return how far the end is from each ``kept`` state by an edge to one that is not; `NONE`: it has none.

    ``away [S]`` is how far the end is from there.
    """
    ready = np.full(kept.shape[0], NONE, np.int32)
    for s in range(kept.shape[0]):
        if not kept[s]:
            continue
        for k in range(start[s], start[s + 1]):
            t = target[k]
            if not kept[t] and away[t] != NONE and (ready[s] == NONE or away[t] + 1 < ready[s]):
                ready[s] = away[t] + 1
    return ready


@kernel
def distances(into: Longs, source: Ints, ready: Ints, seeds: Longs, allowed: Bools) -> Ints:
    """Return how far each state is from the end through ``allowed`` states, `NONE` where it is not reached.

    ``ready [S]`` is how far the end is without going through any of them, `NONE` where there is no such way;
    ``seeds`` are the states that have one, the nearest first.
    """
    away = np.full(ready.shape[0], NONE, np.int32)
    queue = np.empty(ready.shape[0], np.int32)
    head = 0
    tail = 0
    i = 0
    while i < seeds.shape[0] or head < tail:
        if head == tail or (i < seeds.shape[0] and ready[seeds[i]] <= away[queue[head]]):
            t = seeds[i]
            i += 1
            if away[t] != NONE:
                continue
            away[t] = ready[t]
        else:
            t = np.int64(queue[head])
            head += 1
        for k in range(into[t], into[t + 1]):
            s = source[k] if source[k] >= 0 else ~source[k]
            if not allowed[s] or away[s] != NONE or (ready[s] != NONE and ready[s] <= away[t] + 1):
                continue
            away[s] = away[t] + 1
            queue[tail] = s
            tail += 1
    return away

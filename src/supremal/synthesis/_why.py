"""Walks over graphs of products that explanations are read off: images, shortest words, distances."""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._jit import kernel


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

"""Reachability, the one algorithm under all rooms.

A graph is a pair of arrays: the edges out of node ``s`` are ``target[start[s] : start[s + 1]]``, where
``NONE`` is an edge that is not there.  A dense transition table ``delta [S, E]`` is such a graph as it
stands (see `of_table`); edge ``k`` then is event ``k % E`` out of state ``k // E``.

Breadth-first search gives reachable sets, shortest words and, on the reversed graph, coreachable sets;
each in time linear in the edges.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._jit import kernel

UNREACHED: Final = -2


def of_table(delta: Ints) -> tuple[Longs, Ints]:
    """Return the graph of a dense transition table ``delta [S, E]``, without copying it."""
    states, events = delta.shape
    return np.arange(states + 1, dtype=np.int64) * events, delta.reshape(-1)


@kernel
def reverse(start: Longs, target: Ints) -> tuple[Longs, Ints]:
    """Turn every edge round; the sources of the edges into node ``t``, in ascending order."""
    nodes = start.shape[0] - 1
    reversed_start = np.zeros(nodes + 1, np.int64)
    for k in range(target.shape[0]):
        if target[k] != NONE:
            reversed_start[target[k] + 1] += 1
    for t in range(nodes):
        reversed_start[t + 1] += reversed_start[t]
    fill = reversed_start[:-1].copy()
    source = np.empty(reversed_start[nodes], np.int32)
    for s in range(nodes):
        for k in range(start[s], start[s + 1]):
            t = target[k]
            if t != NONE:
                source[fill[t]] = s
                fill[t] += 1
    return reversed_start, source


@kernel
def search(start: Longs, target: Ints, seeds: Bools, allowed: Bools) -> tuple[Ints, Longs]:
    """Breadth-first search from ``seeds`` through ``allowed`` nodes.

    Returns ``order``, the nodes reached, nearest first, and ``via [S]``, the edge by which each was first
    reached: `NONE` for a seed, `UNREACHED` for the rest.  Following ``via`` back from a node spells the
    shortest path to it, the first such in the order of edges.
    """
    nodes = start.shape[0] - 1
    via = np.full(nodes, UNREACHED, np.int64)
    queue = np.empty(nodes, np.int32)
    tail = 0
    for s in range(nodes):
        if seeds[s] and allowed[s]:
            via[s] = NONE
            queue[tail] = s
            tail += 1
    head = 0
    while head < tail:
        s = queue[head]
        head += 1
        for k in range(start[s], start[s + 1]):
            t = target[k]
            if t != NONE and via[t] == UNREACHED and allowed[t]:
                via[t] = k
                queue[tail] = t
                tail += 1
    return queue[:tail].copy(), via


def reachable_from(start: Longs, target: Ints, seeds: Bools, allowed: Bools | None = None) -> Bools:
    """Return the nodes that a path through ``allowed`` nodes leads to from ``seeds``; ``bool [S]``."""
    if allowed is None:
        allowed = np.ones(seeds.shape[0], np.bool_)
    reached: Bools = search(start, target, seeds, allowed)[1] != UNREACHED
    return reached


def coreachable_to(start: Longs, target: Ints, goals: Bools, allowed: Bools | None = None) -> Bools:
    """Return the nodes that have a path through ``allowed`` nodes to ``goals``; ``bool [S]``."""
    back_start, source = reverse(start, target)
    return reachable_from(back_start, source, goals, allowed)


def path_to(node: int, via: Longs, start: Longs) -> list[int]:
    """Spell the edges of the shortest path that `search` found to ``node``."""
    edges: list[int] = []
    while via[node] != NONE:
        edge = int(via[node])
        edges.append(edge)
        node = int(np.searchsorted(start, edge, side="right")) - 1
    return edges[::-1]


def first_seed(nodes: int) -> Bools:
    """Return the seeds that hold node 0 alone (none of an empty graph)."""
    seeds = np.zeros(nodes, np.bool_)
    seeds[:1] = True
    return seeds

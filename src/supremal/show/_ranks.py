"""Ranks: how far along each node of a drawing stands.

A picture reads best where most edges lead the same way.  An order of the nodes is sought in which few edges
lead back (to find the fewest is the feedback arc set problem, which is NP-hard): a breadth-first and a
depth-first order, each improved by moving one node at a time.  Then the ranks are the longest paths along the
edges that lead forward, and nodes are pulled to where their edges are short.

Source: Sugiyama, Tagawa, Toda, "Methods for visual understanding of hierarchical system structures", IEEE
Trans. Syst. Man Cybern. 11 (1981), steps 1 and 2; Gansner, Koutsofios, North, Vo, "A technique for drawing
directed graphs", IEEE Trans. Softw. Eng. 19 (1993), section 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

_PASSES: Final = 8

Arc = tuple[int, int]


def ranks(nodes: int, arcs: Sequence[Arc]) -> list[int]:
    """Return the rank of each of ``nodes``, from 0 on; node 0 comes first, and no arc stays in a rank.

    Examples
    --------
    >>> ranks(4, [(0, 1), (1, 2), (2, 0), (1, 3)])
    [0, 1, 2, 2]
    """
    order = _order(nodes, arcs)
    at = {node: i for i, node in enumerate(order)}
    return _short(nodes, [(a, b) if at[a] < at[b] else (b, a) for a, b in arcs])


def _order(nodes: int, arcs: Sequence[Arc]) -> list[int]:
    """Return the order, of the two that are tried, in which fewer arcs lead back."""

    def backward(order: Sequence[int]) -> int:
        at = {node: i for i, node in enumerate(order)}
        return sum(at[a] > at[b] for a, b in arcs)

    return min((_sifted(start(nodes, arcs), arcs) for start in (_breadth_first, _depth_first)), key=backward)


def _successors(nodes: int, arcs: Sequence[Arc]) -> list[list[int]]:
    after: list[list[int]] = [[] for _ in range(nodes)]
    for a, b in arcs:
        after[a].append(b)
    return after


def _breadth_first(nodes: int, arcs: Sequence[Arc]) -> list[int]:
    after, seen = _successors(nodes, arcs), dict[int, None]()
    for root in range(nodes):
        queue = [root] if root not in seen else []
        seen.setdefault(root)
        for node in queue:
            fresh = [n for n in dict.fromkeys(after[node]) if n not in seen]
            seen |= dict.fromkeys(fresh)
            queue += fresh
    return list(seen)


def _depth_first(nodes: int, arcs: Sequence[Arc]) -> list[int]:
    """Return the nodes in reversed postorder: without a cycle no arc leads back, but for those to node 0."""
    after, left = _successors(nodes, arcs), list[int]()
    seen: set[int] = set()
    for root in range(nodes):
        stack = [(root, iter(after[root]))] if root not in seen else []
        seen.add(root)
        while stack:
            following = next((n for n in stack[-1][1] if n not in seen), None)
            if following is None:
                left.append(stack.pop()[0])
            else:
                seen.add(following)
                stack.append((following, iter(after[following])))
    order = left[::-1]
    order.remove(0)
    return [0, *order]


def _sifted(order: list[int], arcs: Sequence[Arc]) -> list[int]:
    """Move each node but the first to where the fewest arcs lead back, until nothing is gained."""
    out = np.zeros((len(order), len(order)), np.int64)
    for a, b in arcs:
        out[a, b] += 1
    for _ in range(_PASSES):
        before = list(order)
        for node in before[1:]:
            here = order.index(node)
            rest = order[:here] + order[here + 1 :]
            # gain[i]: the arcs that lead back where node stands before the i-th of the rest
            step = out[node, rest] - out[rest, node]
            gain = np.concatenate([[0], np.cumsum(step)])
            best = 1 + int(np.argmin(gain[1:]))
            if gain[best] < gain[here]:
                order = [*rest[:best], node, *rest[best:]]
        if order == before:
            break
    return order


def _short(nodes: int, arcs: Sequence[Arc]) -> list[int]:
    """Return the rank of each node, so that arcs, which have no cycle, lead up and are short."""
    after, before = _successors(nodes, arcs), _successors(nodes, [(b, a) for a, b in arcs])
    order, waiting = [], [len(sources) for sources in before]
    ready = [n for n in range(nodes) if not waiting[n]]
    for node in ready:
        order.append(node)
        for target in after[node]:
            waiting[target] -= 1
            if not waiting[target]:
                ready.append(target)
    rank = [0] * nodes
    for node in order:
        rank[node] = max((rank[n] + 1 for n in before[node]), default=0)
    for _ in range(_PASSES):
        moved = False
        for node in (*order[::-1], *order):
            low = max((rank[n] + 1 for n in before[node]), default=0)
            high = min((rank[n] - 1 for n in after[node]), default=low)
            pull = len(after[node]) - len(before[node])
            goal = high if pull > 0 and node else low if pull < 0 else rank[node]
            moved |= goal != rank[node]
            rank[node] = goal
        if not moved:
            break
    return rank

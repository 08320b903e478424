"""A drawing on a circle: where the nodes of a small diagram stand, and the curves between them.

The paper draws its automata on a circle with the trap in the middle, and so do we: all nodes stand on an
ellipse, in the order in which the fewest edges cross, and a sink that many edges lead to stands in the
centre.  Edges are quadratic curves whose bend is chosen by coordinate descent: an edge goes straight unless a
node or another edge is in the way, and an edge that has a way back leaves it room.

Everything is deterministic: candidates are tried in a fixed order and ties go to the first.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from math import atan2, cos, hypot, pi, sin
from typing import Final

import numpy as np

from supremal._arrays import Floats
from supremal.show._curves import Curve, Drawing, Link, between, bezier, crossings, entry_arrow, leaves, loop
from supremal.show._labels import settle

_SEARCHED: Final = 7  # rings up to this size are tried in every order
_ROUTED: Final = 48  # graphs with more edges are drawn straight
_SINGLE: Final = (0.0, 0.13, -0.13, 0.25, -0.25, 0.38, -0.38)
_PAIRED: Final = (0.16, 0.24, 0.33, 0.42)
_GAP: Final = 10.0
_TURNS: Final = 24  # the directions that a loop may take
_STRETCHES: Final = (1.0, 1.12, 1.26, 1.42, 1.6)


def circle(radius: Sequence[float], links: Sequence[Link]) -> Drawing:
    """Return the drawing on the smallest ring, of a few that are tried, on which all labels have room."""
    tries = []
    for stretch in _STRETCHES:
        where = place(radius, links, stretch=stretch)
        curves, entry = route(where, radius, links)
        labels, clash = settle(where, radius, links, curves, entry)
        tries.append(Drawing(where, curves, entry, labels, clash))
        if clash < 1:
            break
    return min(tries, key=lambda drawing: round(drawing.clash))


def place(radius: Sequence[float], links: Sequence[Link], *, stretch: float = 1.0) -> Floats:
    """Return the centre of each node, ``float64 [N, 2]``; node 0 is the initial one.

    ``stretch`` makes the ring larger.
    """
    nodes = len(radius)
    if nodes == 1:
        return np.zeros((1, 2))
    middle = _centre(nodes, links)
    ring = _ring([n for n in range(nodes) if n != middle], links)
    rx, ry = _axes(ring, radius, links, centred=middle is not None)
    start = pi if len(ring) != 4 else pi / 2  # four stand as a diamond, read from its top
    where = np.zeros((nodes, 2))
    for at, node in enumerate(ring):
        angle = start - 2 * pi * at / len(ring)
        where[node] = stretch * rx * cos(angle), -stretch * ry * sin(angle)
    return where


def _centre(nodes: int, links: Sequence[Link]) -> int | None:
    """Return the sink that the most nodes, at least three, lead to; None if there is none."""
    into = [0] * nodes
    for link in links:
        into[link.target] += link.source != link.target
    leaves = {link.source for link in links if link.source != link.target}
    sinks = [n for n in range(1, nodes) if n not in leaves and into[n] >= 3 and nodes >= 5]
    return max(sinks, key=lambda n: (into[n], -n)) if sinks else None


def _ring(nodes: list[int], links: Sequence[Link]) -> list[int]:
    """Return ``nodes`` in the order in which the fewest chords cross, then the most edges go clockwise."""
    ends = [(k.source, k.target) for k in links if k.source != k.target]
    chords = [(a, b) for a, b in ends if a in nodes and b in nodes]

    def cost(order: list[int]) -> tuple[int, int, int]:
        at = {node: i for i, node in enumerate(order)}
        ends = [(at[a], at[b]) for a, b in chords]
        spans = [tuple(sorted(end)) for end in ends]
        crossing = sum(
            a < c < b < d or c < a < d < b for i, (a, b) in enumerate(spans) for c, d in spans[i + 1 :]
        )
        length = sum(min(b - a, len(order) - b + a) for a, b in spans)
        forward = sum((b - a) % len(order) == 1 for a, b in ends)
        return crossing, length, -forward

    if not chords or len(nodes) > 16:
        return nodes
    if len(nodes) <= _SEARCHED:
        first, *rest = nodes
        return min(([first, *order] for order in permutations(rest)), key=cost)
    best, value = nodes, cost(nodes)
    for _ in range(3):
        for i in range(1, len(nodes)):
            for j in range(i + 1, len(nodes)):
                other = [*best[:i], *best[i : j + 1][::-1], *best[j + 1 :]]
                if cost(other) < value:
                    best, value = other, cost(other)
    return best


def _axes(
    ring: list[int], radius: Sequence[float], links: Sequence[Link], *, centred: bool
) -> tuple[float, float]:
    """Return the half-axes of an ellipse on which neighbours and their labels have room."""
    size = max(radius)
    wide = max((k.w for k in links if k.source != k.target), default=0.0)
    high = max((k.h for k in links if k.source != k.target), default=0.0)
    if len(ring) == 2:
        return size + max(wide, 60.0) / 2 + 16, 0.0
    dense = max(sum(k.source != k.target for k in links) / len(ring) - 1, 0.0)
    chord = (2 * size + 58 + min(high, 40.0)) * (1.0 + min(0.25 * dense, 0.5) * (not centred))
    round_ = max(chord / (2 * sin(pi / len(ring))), 2 * size + 62 + min(wide, 60.0) / 2 if centred else 78.0)
    return round_ + min(max(wide - 40.0, 0.0), 130.0) * 0.62, round_


def route(where: Floats, radius: Sequence[float], links: Sequence[Link]) -> tuple[list[Curve], Curve]:
    """Return the curve of each of ``links``, and the arrow that points at the initial node."""
    between = [k for k, link in enumerate(links) if link.source != link.target]
    pairs = {(links[k].source, links[k].target) for k in between}
    choices = {k: _PAIRED if (links[k].target, links[k].source) in pairs else _SINGLE for k in between}
    curves = {k: _arc(where, radius, links[k], choices[k][0]) for k in between}
    for _ in range(3 if len(between) <= _ROUTED else 0):
        for k in between:
            others = np.array([curves[j].points for j in between if j != k]).reshape(-1, 41, 2)
            arcs = [_arc(where, radius, links[k], bend) for bend in choices[k]]
            costs = [_crowded(arc, where, radius, links[k], others) for arc in arcs]
            bent = [cost + 12 * abs(bend) for cost, bend in zip(costs, choices[k], strict=True)]
            curves[k] = arcs[int(np.argmin(bent))]
    drawn = [curve.points for curve in curves.values()]
    centre = where.mean(axis=0)
    entry = _entry_of(where, radius, drawn)
    drawn.append(entry.points)
    for k, link in enumerate(links):
        if link.source == link.target:
            at, r = where[link.source], radius[link.source]
            loops = [loop(at, r, angle) for angle in _around(_outward(at, centre, pi / 2))]
            curves[k] = _freest(loops, where, link.source, drawn)
            drawn.append(curves[k].points)
    return [curves[k] for k in range(len(links))], entry


def _entry_of(where: Floats, radius: Sequence[float], drawn: Sequence[Floats]) -> Curve:
    """Return the arrow at the initial node: from outside, and rather from the left."""
    home = _outward(where[0], where.mean(axis=0), pi)
    home = pi if cos(home) < 0.5 else home
    return _freest([entry_arrow(where[0], radius[0], angle) for angle in _around(home)], where, 0, drawn)


def _around(home: float) -> list[float]:
    """Return all directions, those close to ``home`` first."""
    return [home + (step + 1) // 2 * (-1) ** step * 2 * pi / _TURNS for step in range(_TURNS)]


def _freest(options: Sequence[Curve], where: Floats, node: int, drawn: Sequence[Floats]) -> Curve:
    """Return the curve at ``node`` that keeps away from all that is there; early options are preferred."""
    there = np.vstack([np.empty((0, 2)), *drawn, np.delete(where, node, axis=0)])

    def cost(rank: int) -> float:
        far = options[rank].points[6:-6]
        near = np.hypot(*(far[:, None] - there[None, :]).transpose(2, 0, 1)).min(axis=1, initial=99.0)
        return 2.2 * ((rank + 1) // 2) + 0.4 * float(np.maximum(16 - near, 0.0).sum())

    return options[min(range(len(options)), key=cost)]


def _outward(point: Floats, centre: Floats, otherwise: float) -> float:
    dx, dy = point - centre
    return atan2(-dy, dx) if hypot(dx, dy) > 1 else otherwise


def _arc(where: Floats, radius: Sequence[float], link: Link, bend: float) -> Curve:
    """Return the curve of a link that leaves the straight line by ``bend`` of its length, to its left."""
    a, b = where[link.source], where[link.target]
    dx, dy = b - a
    control = (a + b) / 2 + bend * np.array([dy, -dx])
    whole = bezier(a, control, b, n=161)
    t0 = leaves(np.hypot(*(whole - a).T), radius[link.source] + 1)
    t1 = 1 - leaves(np.hypot(*(whole - b).T)[::-1], radius[link.target] + 2.5)
    t0, t1 = (t0, t1) if t0 < t1 else (0.0, 1.0)
    q0, q1 = (1 - t0) * a + t0 * control, (1 - t0) * control + t0 * b
    p1 = q0 + (q1 - q0) * t1  # the control point of the part from t0 to t1 (its blossom)
    p0, p2 = ((1 - t) ** 2 * a + 2 * t * (1 - t) * control + t**2 * b for t in (t0, t1))
    return between(p0, (p1,), p2)


def _crowded(curve: Curve, where: Floats, radius: Sequence[float], link: Link, others: Floats) -> float:
    """Return what a curve costs: nodes that it comes close to, curves that it crosses or follows."""
    cost = 9.0 * crossings(curve.points, others)
    for node, centre in enumerate(where):
        if node not in (link.source, link.target):
            near = float(np.hypot(*(curve.points - centre).T).min())
            cost += 2.0 * max(radius[node] + _GAP - near, 0.0)
    apart = curve.points[None, 8:-8:2, None] - others[:, None, 8:-8:2]
    close = np.hypot(apart[..., 0], apart[..., 1]).min(axis=(1, 2), initial=99.0)
    return cost + 0.5 * float(np.maximum(14 - close, 0.0).sum())

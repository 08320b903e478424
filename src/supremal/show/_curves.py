"""The parts of a drawing: links, the curves that they become, and how curves are made, cut and crossed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import atan2, comb, cos, sin
from typing import Final

import numpy as np

from supremal._arrays import Floats

_HEAD: Final = 9.0  # how long an arrow head is


@dataclass(frozen=True, slots=True)
class Link:
    """An edge from node ``source`` to node ``target``; ``w`` and ``h`` are the size of its label."""

    source: int
    target: int
    w: float = 0.0
    h: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A drawn edge: ``path`` in SVG's words, ``points [N, 2]`` along it, and ``tip``, the arrow's end."""

    path: str
    points: Floats
    tip: tuple[float, float]
    angle: float


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """Where everything stands: nodes ``where [N, 2]``, a curve and a label ``labels [E, 2]`` for each link.

    ``entry`` is the arrow at node 0; ``clash`` is how deep the worst label lies on something.
    """

    where: Floats
    curves: list[Curve]
    entry: Curve
    labels: Floats
    clash: float


def bezier(*control: Floats, n: int = 41) -> Floats:
    """Return ``n`` points along the Bézier curve of these control points."""
    return _bernstein(len(control) - 1, n) @ np.array(control)


@cache
def _bernstein(degree: int, n: int) -> Floats:
    t = np.linspace(0, 1, n)
    return np.column_stack([comb(degree, k) * (1 - t) ** (degree - k) * t**k for k in range(degree + 1)])


def leaves(far: Floats, limit: float) -> float:
    """Return where along 0 to 1 a curve, ``far`` from its start at even steps, first is ``limit`` away."""
    at = int(np.argmax(far >= limit))
    if at == 0:
        return 0.0
    return float(at - 1 + (limit - far[at - 1]) / (far[at] - far[at - 1])) / (len(far) - 1)


def loop(at: Floats, radius: float, angle: float) -> Curve:
    """Return a self-loop of a node at ``at`` that points to ``angle``."""
    spread, reach = 7.5 / radius, radius + 44
    start, *hands, end = (
        at + far * np.array([cos(angle + turn), -sin(angle + turn)])
        for turn, far in ((spread, radius + 1), (spread, reach), (-spread, reach), (-spread, radius + 2.5))
    )
    return between(start, hands, end)


def entry_arrow(at: Floats, radius: float, angle: float) -> Curve:
    """Return the arrow from nowhere to the initial node."""
    way = np.array([cos(angle), -sin(angle)])
    return between(at + (radius + 30) * way, (at + (radius + 16) * way,), at + (radius + 2.5) * way)


def between(start: Floats, hands: Sequence[Floats], end: Floats) -> Curve:
    """Return the Bézier curve from ``start`` to ``end`` with one or two ``hands`` as control points."""
    points = bezier(start, *hands, end)
    dx, dy = end - hands[-1]
    angle = atan2(dy, dx)
    back = end - 0.8 * _HEAD * np.array([cos(angle), sin(angle)])  # the line ends inside the arrow head
    middle = " ".join(f"{x:.1f},{y:.1f}" for x, y in hands)
    kind = "Q" if len(hands) == 1 else "C"
    path = f"M{start[0]:.1f},{start[1]:.1f} {kind}{middle} {back[0]:.1f},{back[1]:.1f}"
    return Curve(path, points, (float(end[0]), float(end[1])), angle)


def through(pieces: Sequence[Floats]) -> Curve:
    """Return the curve of several cubic ``pieces``, each four control points ``[4, 2]``, end to end."""
    points = np.vstack([bezier(*piece, n=13) for piece in pieces])
    *_, hand, end = pieces[-1]
    dx, dy = end - hand
    angle = atan2(dy, dx)
    back = end - 0.8 * _HEAD * np.array([cos(angle), sin(angle)])
    steps = []
    for piece in (*pieces[:-1], np.array([*pieces[-1][:3], back])):
        level = abs(piece[:, 0] - piece[0, 0]).max() < 0.05 or abs(piece[:, 1] - piece[0, 1]).max() < 0.05
        corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in (piece[3:] if level else piece[1:]))
        steps.append(f"{'L' if level else 'C'}{corners}")
    start = pieces[0][0]
    path = f"M{start[0]:.1f},{start[1]:.1f} {' '.join(steps)}"
    return Curve(path, points, (float(end[0]), float(end[1])), angle)


def rest_of(cubic: Floats, first: float) -> Floats:
    """Return the control points ``[4, 2]`` of what follows ``first``, from 0 to 1, of a cubic curve."""
    level, last = cubic, [cubic[-1]]
    for _ in range(3):
        level = (1 - first) * level[:-1] + first * level[1:]
        last.append(level[-1])
    return np.array(last[::-1])


def head(curve: Curve) -> str:
    """Return the path of the arrow head at the end of ``curve``."""
    x, y = curve.tip
    corners = [(x, y)]
    for side in (0.36, -0.36):
        a = curve.angle + side
        corners.append((x - _HEAD * cos(a), y - _HEAD * sin(a)))
    return "M" + " L".join(f"{u:.1f},{v:.1f}" for u, v in corners) + " Z"


def crossings(one: Floats, others: Floats) -> int:
    """Return how often the polyline ``one [N, 2]`` crosses ``others [M, N, 2]``."""
    a, b = one[:-1:4, None], one[4::4, None]
    c, d = others[:, None, :-1:4], others[:, None, 4::4]

    def side(p: Floats, q: Floats, r: Floats) -> Floats:
        cross: Floats = (q - p)[..., 0] * (r - p)[..., 1] - (q - p)[..., 1] * (r - p)[..., 0]
        return cross

    apart = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
    return int(np.count_nonzero(apart))

"""The curves of a layered drawing.

An edge crosses each layer at right angles, in the place of its item, and turns between two layers.  Where it
meets a node it aims at the centre, so that the arrows at a node fan out; where that would run through a
label, another node or a loop, it aims less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import pi
from typing import Final

import numpy as np

from supremal._arrays import Floats
from supremal.show._curves import Curve, Link, bezier, leaves, loop, rest_of, through
from supremal.show._layers import Layers

_AIMS: Final = (0.9, 0.45, 0.0)  # how much an edge aims at the centre of its node, those tried first
_APART: Final = 6.0  # between an edge and a loop


@dataclass(frozen=True, slots=True, eq=False)
class _Obstacles:
    """What no curve should run through: nodes ``where [N, 2]``, points of loops and the corners of labels."""

    where: Floats
    radius: Floats
    loops: Floats
    low: Floats
    high: Floats

    def hit(self, points: Floats, node: int) -> int:
        """Return how many of ``points [P, 2]`` lie on something other than ``node``."""
        inside = (points[:, None] > self.low).all(axis=2) & (points[:, None] < self.high).all(axis=2)
        near = np.hypot(*(points[:, None] - self.where).transpose(2, 0, 1)) < self.radius + 4
        near[:, node] = False
        touched = np.hypot(*(points[:, None] - self.loops).transpose(2, 0, 1)) < _APART
        return sum(int(np.count_nonzero(found)) for found in (inside, near, touched))


def routed(
    radius: Sequence[float], links: Sequence[Link], layers: Layers, at: Floats, thick: Floats, labels: Floats,
    *, upright: bool,
) -> list[Curve]:  # fmt: skip
    """Return the curve of each link."""
    half = np.array([[link.w, link.h] for link in links]).reshape(-1, 2) / 2
    places = at[: len(radius), ::-1] if upright else at[: len(radius)]
    out = 0.0 if upright else pi / 2
    loops = [
        loop(places[link.source], radius[link.source], out) if link.source == link.target else None
        for link in links
    ]
    round_ = np.vstack([np.empty((0, 2)), *(curve.points for curve in loops if curve is not None)])
    obstacles = _Obstacles(places, np.array(radius), round_, labels - half, labels + half)
    reach = np.zeros(len(at))  # of the layer of each item, to either side
    for layer in layers.layers:
        reach[list(layer)] = thick[list(layer)].max() / 2
    curves = []
    for link, chain, looped in zip(links, layers.chains, loops, strict=True):
        if looped is not None:
            curves.append(looped)
            continue
        way = 1.0 if at[chain[-1], 0] > at[chain[0], 0] else -1.0
        stops = [at[item] + (way * side * reach[item], 0.0) for item in chain[1:-1] for side in (-1, 1)]
        turned = [stop[::-1] for stop in stops] if upright else stops
        axis = int(upright)
        first = _end(places[link.source], turned[0], radius[link.source] + 1, obstacles, link.source, axis)
        last = _end(places[link.target], turned[-1], radius[link.target] + 2.5, obstacles, link.target, axis)
        middle = [_bend(a, b, axis) for a, b in pairwise(turned) if np.abs(a - b).max() > 0.05]
        curves.append(through([first, *middle, last[::-1]]))
    return curves


def _bend(a: Floats, b: Floats, axis: int, aim: float = 0.0) -> Floats:
    """Return the cubic that meets ``b`` along ``axis``, and leaves ``a`` so, but for its ``aim`` at ``b``."""
    step = (b - a) / 2
    along = np.where(np.arange(2) == axis, step, 0.0)
    return np.array([a, a + along + aim * (step - along), b - along, b])


def _end(
    node: Floats, stop: Floats, distance: float, obstacles: _Obstacles, number: int, axis: int
) -> Floats:
    """Return the cubic from the rim of a node to ``stop``: of a few, the first that hits the least."""
    found: dict[int, Floats] = {}
    for aim in _AIMS:
        whole = _bend(node, stop, axis, aim)
        far = np.hypot(*(bezier(*whole, n=81) - node).T)
        piece = rest_of(whole, leaves(far, distance))
        hit = obstacles.hit(bezier(*piece, n=17)[:-1], number)
        found.setdefault(hit, piece)
        if not hit:
            break
    return found[min(found)]

"""Where the labels of a diagram's edges stand.

A small candidate-position search: each label may stand beside its curve, on either side, at some places
along it, or on the line.  A place costs what it covers (other labels, nodes, other curves) and how far it is
from the middle; every label in turn takes its cheapest place, until nothing moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from supremal._arrays import Floats
from supremal.show._curves import Curve, Link

_ALONG: Final = (20, 17, 23, 14, 26, 11, 29, 8, 32)  # of 41 points
_AWAY: Final = (4.0, 8.0, 13.0)
_ROUNDS: Final = 6
_CAREFUL: Final = 120  # with more labels there is no room to look for
_NODE: Final = 60.0
_LABEL: Final = 80.0
_LINE: Final = 2.4
_AIR: Final = 18.0  # what labels would like between them


def candidates(curve: Curve, link: Link) -> tuple[Floats, Floats]:
    """Return the possible centres of the label of ``curve``, ``[K, 2]``, and what each costs by itself."""
    places, costs = [], []
    for rank, at in enumerate(_ALONG):
        point = curve.points[at]
        dx, dy = curve.points[at + 1] - curve.points[at - 1]
        size = np.hypot(dx, dy) or 1.0
        normal = np.array([dy, -dx]) / size
        half = np.array([link.w / 2, link.h / 2])
        if link.source == link.target:  # round: the nearest corner or side of the label stands at the point
            reach = np.clip(1.6 * normal, -1, 1) * half
        else:  # straight: the label is moved away until it no longer touches the line
            reach = np.abs(normal) @ half * normal
        for side in (1, -1):
            for away in _AWAY:
                places.append(point + side * (reach + away * normal))
                costs.append(0.8 * rank + 0.35 * (away - _AWAY[0]))
        places.append(point)
        costs.append(0.8 * rank + 7.0)
    return np.array(places), np.array(costs)


def covered(centres: Floats, w: float, h: float, boxes: Floats) -> Floats:
    """Return how much each of ``boxes [M, 4]`` (x, y, w, h) overlaps a label at each centre; ``[K, M]``."""
    dx = (w + boxes[:, 2]) / 2 - np.abs(centres[:, None, 0] - boxes[:, 0])
    dy = (h + boxes[:, 3]) / 2 - np.abs(centres[:, None, 1] - boxes[:, 1])
    overlap: Floats = np.minimum(np.maximum(dx, 0), np.maximum(dy, 0))
    return overlap


def touching(centres: Floats, w: float, h: float, points: Floats, margin: Floats | float) -> Floats:
    """Return how deep circles of radius ``margin`` at ``points [M, 2]`` reach into a label; ``[K, M]``."""
    dx = np.maximum(np.abs(centres[:, None, 0] - points[:, 0]) - w / 2, 0)
    dy = np.maximum(np.abs(centres[:, None, 1] - points[:, 1]) - h / 2, 0)
    depth: Floats = np.maximum(margin - np.hypot(dx, dy), 0)
    return depth


def settle(
    where: Floats, radius: Sequence[float], links: Sequence[Link], curves: Sequence[Curve], entry: Curve
) -> tuple[Floats, float]:
    """Return the centre of each label, ``[E, 2]``, and what the worst of them covers (0: nothing)."""
    margin = np.array(radius) + 3
    along = np.array([curve.points for curve in curves]).reshape(-1, 41, 2)
    own = np.full(len(links), _LINE)
    careful = len(links) <= _CAREFUL
    options, fixed = [], []
    for k, (curve, link) in enumerate(zip(curves, links, strict=True)):
        places, cost = candidates(curve, link)
        hard = touching(places, link.w, link.h, where, margin).sum(axis=1) * _NODE
        hard += np.minimum(touching(places, link.w, link.h, entry.points, 4.0).sum(axis=1), 9) * _LINE
        if careful:
            inside = touching(places, link.w, link.h, along.reshape(-1, 2), 2.5) > 0
            own[k] = _LINE / 2  # to stand on its own line is half as bad
            hard += np.count_nonzero(inside.reshape(len(places), -1, 41), axis=2) @ own
            own[k] = _LINE
        options.append(places)
        fixed.append(cost + hard)
    chosen = [int(np.argmin(cost)) for cost in fixed]
    sizes = np.array([[link.w + 6, link.h] for link in links]).reshape(-1, 2)
    for _ in range(_ROUNDS if careful else 1):
        before = list(chosen)
        for k, link in enumerate(links):
            centres = np.array([options[j][chosen[j]] for j in range(len(links)) if j != k]).reshape(-1, 2)
            others = np.hstack([centres, np.delete(sizes, k, axis=0)])
            clash = covered(options[k], link.w, link.h, others).sum(axis=1)
            close = covered(options[k], link.w + _AIR, link.h + _AIR, others).sum(axis=1)
            chosen[k] = int(np.argmin(fixed[k] + _LABEL * clash + 0.35 * close))
        if chosen == before:
            break
    centres = np.array([options[k][chosen[k]] for k in range(len(links))]).reshape(-1, 2)
    return centres, worst(centres, links, where, margin - 3)


def worst(centres: Floats, links: Sequence[Link], where: Floats, radius: Floats) -> float:
    """Return how deep the worst label lies on a node or on another label; 0 where none does."""
    sizes = np.array([[link.w, link.h] for link in links]).reshape(-1, 2)
    boxes, found = np.hstack([centres, sizes]), 0.0
    for k, (w, h) in enumerate(sizes.tolist()):
        at = centres[k : k + 1]
        found = max(found, float(touching(at, w, h, where, radius).max(initial=0)))
        found = max(found, float(covered(at, w, h, boxes[:k]).max(initial=0)))
    return found


def on_lines(centres: Floats, links: Sequence[Link], curves: Sequence[Curve]) -> list[bool]:
    """Tell of each label whether some curve runs beneath it."""
    points = np.vstack([curve.points for curve in curves])
    halves = np.array([[link.w / 2, link.h / 2] for link in links]).reshape(-1, 2)
    return [
        bool((np.abs(points - at) < half).all(axis=1).any()) for at, half in zip(centres, halves, strict=True)
    ]

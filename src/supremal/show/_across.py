"""Where the items of a layered drawing stand across their layers.

Items keep their order and their distance, and the sum of w |y_a - y_b| over all joined pairs is to be small,
with large weights w in the middle of an edge, so that long edges are straight.  With squares in place of
distances that is, for one layer and the others as they are, an isotonic regression, which the pool of
adjacent violators solves exactly.  So the layers are solved in turn, and after some rounds the weights of
long edges are set anew each time, to w / |y_a - y_b|, which turns squares into distances.  Short edges keep
their squares: a node stands between its neighbours.

Source: Gansner, Koutsofios, North, Vo, "A technique for drawing directed graphs", IEEE Trans. Softw. Eng. 19
(1993), section 4, for the weights; Barlow, Bartholomew, Bremner, Brunk, *Statistical Inference under Order
Restrictions* (1972), for the regression; Schlossmacher, "An iterative technique for absolute deviations curve
fitting", J. Am. Stat. Assoc. 68 (1973), for the weights set anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from supremal._arrays import NONE, Floats, Longs
from supremal.show._layers import Layers

_SHORT: Final = 3.0  # the weight of a pair on an edge between two ranks,
_END: Final = 0.5  # at an end of a long edge,
_MIDDLE: Final = 8.0  # and in its middle
_SQUARES: Final = 24  # rounds before the distances of long edges count as they are
_EVEN: Final = 2.0  # closer than this, they count as squares
_ALIKE: Final = 7.0  # where two ends of a segment stand so close, they are brought in line
_SPRING: Final = 12.0  # the distance at which a short edge pulls as if distances counted


@dataclass(frozen=True, slots=True, eq=False)
class Sizes:
    """Of each item: how far it reaches on both sides of its line, and how thick a layer it needs."""

    before: Floats
    after: Floats
    thick: Floats


def places(layers: Layers, sizes: Sizes, nodes: int, *, rounds: int) -> Floats:
    """Return where the line of each of I items stands within its layer, ``float64 [I]``."""
    items = [list(layer) for layer in layers.layers]
    offsets = [
        np.concatenate([[0.0], np.cumsum(sizes.after[row[:-1]] + sizes.before[row[1:]])]) for row in items
    ]
    y, place = np.zeros(layers.items), np.zeros(layers.items, np.int64)
    for row, offset in zip(items, offsets, strict=True):
        y[row] = offset - offset[-1] / 2
        place[row] = np.arange(len(row))
    joined = _joined(layers, nodes)
    for turn in range(rounds):
        for at in range(len(items)) if turn % 2 == 0 else reversed(range(len(items))):
            row = items[at]
            pull, total = 1e-9 * y[row], np.full(len(row), 1e-9)  # what nothing pulls stays
            for here, there, weight in joined[at]:
                far = np.abs(y[here] - y[there]) + _EVEN
                w = weight / np.where(weight == _SHORT, _SPRING, far) if turn >= _SQUARES else weight
                pull += np.bincount(place[here], w * y[there], len(row))
                total += np.bincount(place[here], w, len(row))
            y[row] = offsets[at] + isotonic(pull / total - offsets[at], total)
    _straighten(y, layers, sizes)
    return y


def _joined(layers: Layers, nodes: int) -> list[list[tuple[Longs, Longs, Floats]]]:
    """Return for each layer the pairs out of it: items here, items in a layer beside it, and weights."""
    short = [item for chain in layers.chains if len(chain) == 3 for item in chain[1:-1]]
    found: list[list[tuple[Longs, Longs, Floats]]] = [[] for _ in layers.layers]
    for at, pairs in enumerate(layers.segments()):
        brief, ends = np.isin(pairs, short).any(axis=1), (pairs < nodes).any(axis=1)
        weights = np.where(brief, _SHORT, np.where(ends, _END, _MIDDLE))
        left, right = pairs.T
        found[at].append((left, right, weights))
        found[at + 1].append((right, left, weights))
    return found


def _straighten(y: Floats, layers: Layers, sizes: Sizes) -> None:
    """Move the items of each edge, as far along it as their neighbours let them, to one place."""
    above, below = np.full((2, layers.items), NONE)
    for layer in layers.layers:
        above[list(layer[1:])], below[list(layer[:-1])] = layer[:-1], layer[1:]

    def room(item: int) -> tuple[float, float]:
        a, b = above[item], below[item]
        return (
            -np.inf if a == NONE else y[a] + sizes.after[a] + sizes.before[item],
            np.inf if b == NONE else y[b] - sizes.before[b] - sizes.after[item],
        )

    for chain in layers.chains:
        run: list[int] = []
        low, high = -np.inf, np.inf
        for item in chain[1:-1]:
            least, most = room(item)
            if run and max(low, least) > min(high, most):
                y[run] = np.clip(np.median(y[run]), low, high)
                run, low, high = [], -np.inf, np.inf
            run.append(item)
            low, high = max(low, least), min(high, most)
        if run:
            y[run] = np.clip(np.median(y[run]), low, high)
    for chain in layers.chains:
        for a, b in pairwise(chain):
            if abs(y[a] - y[b]) < _ALIKE:
                y[b] = np.clip(y[a], *room(b))


def isotonic(values: Floats, weights: Floats) -> Floats:
    """Return the ascending values closest to ``values`` in weighted squares: pool adjacent violators.

    Examples
    --------
    >>> isotonic(np.array([1.0, 3.0, 2.0, 4.0]), np.ones(4)).tolist()
    [1.0, 2.5, 2.5, 4.0]
    """
    blocks: list[tuple[float, float, int]] = []
    for value, weight in zip(values.tolist(), weights.tolist(), strict=True):
        mean, total, count = value, weight, 1
        while blocks and blocks[-1][0] > mean:
            other, heavy, many = blocks.pop()
            mean = (mean * total + other * heavy) / (total + heavy)
            total, count = total + heavy, count + many
        blocks.append((mean, total, count))
    return np.repeat([mean for mean, _, _ in blocks], [count for _, _, count in blocks])

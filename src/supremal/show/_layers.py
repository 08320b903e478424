"""Layers: which rank each node of a drawing stands in, and in which order within it.

An edge becomes a chain of items, one a layer, and there are two layers a rank: between the ranks of its ends
each edge has an item that is as large as its label, and so labels have a place that nothing else has.  Each
layer is sorted, again and again, so that few edges cross: by the means of the neighbours in the layer that
the sweep comes from, and then each item is moved to where the fewest edges of both sides cross.

Source: Sugiyama, Tagawa, Toda, "Methods for visual understanding of hierarchical system structures", IEEE
Trans. Syst. Man Cybern. 11 (1981), step 3; Gansner, Koutsofios, North, Vo, "A technique for drawing directed
graphs", IEEE Trans. Softw. Eng. 19 (1993), for labels that are items; Matuszewski, Schönfeld, Molitor, "Using
sifting for k-layer straightline crossing minimization", Graph Drawing 1999.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from supremal._arrays import Longs
from supremal.show._curves import Link
from supremal.show._ranks import Arc, ranks

_SWEEPS: Final = 24
_SIFTED: Final = 6
_PATIENCE: Final = 4  # sweeps without a better order before the search ends


@dataclass(frozen=True, slots=True, eq=False)
class Layers:
    """The items of a drawing, layer by layer.

    Parameters
    ----------
    layers
        The items of each layer, in order.  Items 0 to N-1 are the nodes; even layers hold nodes.
    chains
        For each link the items that it runs through, from source to target; () for a loop.
    label
        For each link the item of its label; -1 for a loop.
    """

    layers: tuple[tuple[int, ...], ...]
    chains: tuple[tuple[int, ...], ...]
    label: tuple[int, ...]

    @property
    def items(self) -> int:
        """How many items there are."""
        return sum(map(len, self.layers))

    def segments(self) -> list[Longs]:
        """Return the pairs of items that are joined between each layer and the next, ``int64 [K, 2]``."""
        layer = {item: at for at, items in enumerate(self.layers) for item in items}
        found: list[list[Arc]] = [[] for _ in self.layers[1:]]
        for chain in self.chains:
            for a, b in pairwise(chain):
                found[min(layer[a], layer[b])].append((a, b) if layer[a] < layer[b] else (b, a))
        return [np.array(pairs, np.int64).reshape(-1, 2) for pairs in found]

    def crossings(self) -> int:
        """Return how often edges cross."""
        place = _places(self.layers, self.items)
        return sum(_crossing(place, pairs) for pairs in self.segments())


def layers_of(nodes: int, links: Sequence[Link]) -> Layers:
    """Return the layers of a graph whose node 0 comes first.

    Notes
    -----
    Up to 30 sweeps, each quadratic in the edges between two layers.
    """
    arcs = [(link.source, link.target) for link in links if link.source != link.target]
    return _sorted(_chained(nodes, links, ranks(nodes, arcs)))


def _chained(nodes: int, links: Sequence[Link], rank: Sequence[int]) -> Layers:
    layer = [2 * r for r in rank]
    chains: list[tuple[int, ...]] = []
    labels = []
    for link in links:
        a, b = layer[link.source], layer[link.target]
        if link.source == link.target:
            chains.append(())
            labels.append(-1)
            continue
        between = range(a + 1, b) if a < b else range(a - 1, b, -1)
        first = len(layer)
        layer += between
        chains.append((link.source, *range(first, len(layer)), link.target))
        middle = (len(between) - 1) // 2
        labels.append(first + (middle if between[middle] % 2 else middle + 1))
    found: list[list[int]] = [[] for _ in range(max(layer) + 1)]
    for item in _walked(nodes, chains, len(layer)):
        found[layer[item]].append(item)
    return Layers(tuple(map(tuple, found)), tuple(chains), tuple(labels))


def _walked(nodes: int, chains: Sequence[tuple[int, ...]], items: int) -> list[int]:
    """Return the items in the order of a depth-first walk along the chains, from node 0."""
    near: list[list[int]] = [[] for _ in range(items)]
    for chain in chains:
        for a, b in pairwise(chain):
            near[a].append(b)
            near[b].append(a)
    seen = dict[int, None]()
    for root in range(nodes):
        stack = [root]
        while stack:
            item = stack.pop()
            if item not in seen:
                seen[item] = None
                stack += reversed(near[item])
    return list(seen)


def _places(layers: Sequence[Sequence[int]], items: int) -> Longs:
    place = np.zeros(items, np.int64)
    for layer in layers:
        place[list(layer)] = np.arange(len(layer))
    return place


def _crossing(place: Longs, pairs: Longs) -> int:
    a, b = place[pairs.T]
    return int(np.count_nonzero((a[:, None] < a) & (b[:, None] > b)))


def _sorted(start: Layers) -> Layers:
    """Sweep over the layers, there and back, and keep the order in which the fewest edges cross."""
    segments = start.segments()
    layers, place = [list(layer) for layer in start.layers], _places(start.layers, start.items)
    best, fewest = start.layers, start.crossings()
    for resort, sweeps in ((_by_means, _SWEEPS), (_sifted, _SIFTED)):
        layers, tired = [list(layer) for layer in best], 0
        place[:] = _places(layers, start.items)
        for sweep in range(sweeps):
            if not fewest or tired > _PATIENCE:
                break
            for at in range(len(layers)) if sweep % 2 == 0 else reversed(range(len(layers))):
                # the pairs of an item here and one in the layer that the sweep comes from, or goes to
                sides = [segments[at - 1][:, ::-1] if at else segments[0][:0], *segments[at : at + 1]]
                layers[at] = resort(layers[at], sides[:: 1 if sweep % 2 == 0 else -1], place, sweep)
                place[layers[at]] = np.arange(len(layers[at]))
            crossing = sum(_crossing(place, pairs) for pairs in segments)
            tired += 1
            if crossing < fewest:
                best, fewest, tired = tuple(map(tuple, layers)), crossing, 0
    return Layers(best, start.chains, start.label)


def _by_means(layer: list[int], sides: Sequence[Longs], place: Longs, sweep: int) -> list[int]:
    """Return ``layer`` sorted by the means of the neighbours on the side that the sweep comes from."""
    here, there = sides[0].T
    count = np.bincount(here, minlength=len(place))
    mean = np.bincount(here, place[there], len(place)) / np.maximum(count, 1)
    turned = 1 if sweep % 4 < 2 else -1  # which of equal ones comes first
    return sorted(layer, key=lambda item: (mean[item] if count[item] else place[item], turned * place[item]))


def _sifted(layer: list[int], sides: Sequence[Longs], place: Longs, sweep: int) -> list[int]:  # noqa: ARG001
    """Return ``layer`` after each item has moved to where the fewest edges of both sides cross."""
    cost = np.zeros((len(layer), len(layer)))
    for here, there in (side.T for side in sides if len(side)):
        owner = np.zeros((len(here), len(layer)))
        owner[np.arange(len(here)), place[here]] = 1
        cost += owner.T @ (place[there][:, None] > place[there]) @ owner  # [u, v]: where u comes before v
    order = list(range(len(layer)))
    for one in range(len(layer)):
        here = order.index(one)
        rest = order[:here] + order[here + 1 :]
        crossing = np.concatenate([[0.0], np.cumsum(cost[rest, one] - cost[one, rest])])
        best = int(np.argmin(crossing))
        if crossing[best] < crossing[here]:
            order = [*rest[:best], one, *rest[best:]]
    return [layer[at] for at in order]

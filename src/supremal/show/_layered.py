"""A layered drawing: coordinates for `supremal.show._layers`.

Each layer is as thick as its largest item, and two are the further apart the steeper the edges between them.
Layers run from left to right or from top to bottom, whichever fits a page better.  A label stands beside the
line of its edge, in a place of its layer that is its own; of two edges that lead there and back, one label
stands on either side of both.  Therefore no two labels touch, no label touches a node, and no edge runs
through a label but where it turns between two layers.

Source: Gansner, Koutsofios, North, Vo, "A technique for drawing directed graphs", IEEE Trans. Softw. Eng. 19
(1993).
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Final

import numpy as np

from supremal._arrays import NONE, Floats
from supremal.show._across import Sizes, places
from supremal.show._curves import Drawing, Link, entry_arrow
from supremal.show._labels import worst
from supremal.show._layers import Layers
from supremal.show._routes import routed

_ROUGH: Final = 8  # rounds before it is decided which way the layers run
_ROUNDS: Final = 44
_NODES: Final = 13.0  # the air on either side of a node
_TEXTS: Final = 4.0
_LINES: Final = 6.0
_BESIDE: Final = 3.0  # between a line and its label
_NARROW: Final = 26.0  # the least and the most between two layers
_BROAD: Final = 84.0
_STEEP: Final = 0.34
_REACH: Final = 35.0  # how far a loop stands out of its node
_PAGE: Final = (1100.0, 760.0)


def layered(radius: Sequence[float], links: Sequence[Link], layers: Layers) -> Drawing:
    """Return the drawing of ``layers``.

    Notes
    -----
    Some fifty rounds, each linear in the items.
    """
    tries = []
    for upright in (False, True):
        sizes = _sizes(radius, links, layers, upright=upright)
        across = places(layers, sizes, len(radius), rounds=_ROUGH)
        long = _along(layers, sizes, across).max()
        broad = (across + sizes.after).max() - (across - sizes.before).min()
        wide, high = (broad, long) if upright else (long, broad)
        tries.append((max(wide / _PAGE[0], high / _PAGE[1]), upright, sizes))
    _, upright, sizes = min(tries, key=lambda one: one[:2])
    across = places(layers, sizes, len(radius), rounds=_ROUNDS)
    at = np.column_stack([_along(layers, sizes, across), across])
    labels = _labels(radius, links, layers, at, upright=upright)
    where = at[: len(radius)]
    if upright:
        where, labels = where[:, ::-1], labels[:, ::-1]
    curves = routed(radius, links, layers, at, sizes.thick, labels, upright=upright)
    entry = entry_arrow(where[0], radius[0], pi / 2 if upright else pi)
    return Drawing(where, curves, entry, labels, worst(labels, links, where, np.array(radius)))


def _sizes(radius: Sequence[float], links: Sequence[Link], layers: Layers, *, upright: bool) -> Sizes:
    nodes = len(radius)
    before, after = np.full((2, layers.items), _LINES)
    thick = np.zeros(layers.items)
    before[:nodes] = after[:nodes] = np.array(radius) + _NODES
    thick[:nodes] = 2 * np.array(radius)
    for link, item, side in zip(links, layers.label, _sides(links, layers, upright=upright), strict=True):
        across, along = (link.w, link.h) if upright else (link.h, link.w)
        if item == NONE:
            node = link.source
            (after if upright else before)[node] += _REACH + across + _BESIDE
            thick[node] = max(thick[node], along)
        else:
            (before if side < 0 else after)[item] = across + _BESIDE + _TEXTS
            thick[item] = along + 2 * _BESIDE
    return Sizes(before, after, thick)


def _sides(links: Sequence[Link], layers: Layers, *, upright: bool) -> list[int]:
    """Return for each link whether its label stands before its line (-1) or after it (1).

    Of two that lead there and back, one label stands on either side of both.
    """
    place = {item: at for layer in layers.layers for at, item in enumerate(layer)}
    back = {(link.target, link.source): item for link, item in zip(links, layers.label, strict=True)}
    sides = []
    for link, item in zip(links, layers.label, strict=True):
        other = back.get((link.source, link.target), NONE)
        paired = NONE not in (item, other)
        sides.append((1 if place[item] > place[other] else -1) if paired else 1 if upright else -1)
    return sides


def _along(layers: Layers, sizes: Sizes, across: Floats) -> Floats:
    """Return where the layer of each item stands."""
    along, at = np.zeros(layers.items), 0.0
    joined = [np.empty((0, 2), np.int64), *layers.segments()]
    thick = [float(sizes.thick[list(layer)].max()) for layer in layers.layers]
    for k, (layer, pairs) in enumerate(zip(layers.layers, joined, strict=True)):
        if k:
            steep = float(np.abs(np.diff(across[pairs])).max(initial=0.0))
            at += (thick[k - 1] + thick[k]) / 2 + float(np.clip(_STEEP * steep, _NARROW, _BROAD))
        along[list(layer)] = at
    return along


def _labels(
    radius: Sequence[float], links: Sequence[Link], layers: Layers, at: Floats, *, upright: bool
) -> Floats:
    """Return the centre of each label, along and across."""
    centres = []
    for link, item, side in zip(links, layers.label, _sides(links, layers, upright=upright), strict=True):
        half = (link.w if upright else link.h) / 2
        if item == NONE:
            out = radius[link.source] + _REACH + half
            centres.append(at[link.source] + (0.0, out if upright else -out))
        else:
            centres.append(at[item] + (0.0, side * (_BESIDE + half)))
    return np.array(centres).reshape(-1, 2)

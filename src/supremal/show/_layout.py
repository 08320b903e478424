"""Which drawing a graph gets: on a circle, in layers, or as Graphviz lays it out.

Up to a dozen nodes a circle shows best what comes round again.  What leads from a beginning to ends is read
in layers, and so is what is larger, has labels that find no room on the circle,
or edges that cross more often there.

Graphviz is used where it is asked for, and not by "auto": the same model then gives the same picture on every
machine, and its pictures are no better (``tests/test_diagrams.py`` counts crossings and overlapping labels).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal, get_args

import numpy as np

from supremal.errors import ModelError, suggest
from supremal.show._circle import circle
from supremal.show._curves import Drawing, Link, crossings
from supremal.show._graphviz import graphviz
from supremal.show._layered import layered
from supremal.show._layers import layers_of
from supremal.show._ranks import ranks

Layout = Literal["auto", "circle", "layered", "graphviz"]

_ROUND: Final = 12  # with more nodes nothing is drawn on a circle, if not asked for
_RIM: Final = 4  # points at either end of a curve, where those of one node may meet
_LONG: Final = 6  # with as many nodes, what has no way back is drawn in layers


def arrange(radius: Sequence[float], links: Sequence[Link], layout: Layout = "auto") -> Drawing:
    """Return the drawing of a graph whose nodes have these radii.

    Raises
    ------
    ModelError
        If there is no such layout, or Graphviz is asked for and not there, or does not answer in time.
    """
    if layout not in get_args(Layout):
        message = f"there is no layout {layout!r}; {suggest(layout, get_args(Layout))}"
        raise ModelError(message)
    if layout == "circle":
        return circle(radius, links)
    if layout == "graphviz":
        return graphviz(radius, links)
    return _auto(radius, links) if layout == "auto" else layered(radius, links, layers_of(len(radius), links))


def _auto(radius: Sequence[float], links: Sequence[Link]) -> Drawing:
    layers = layers_of(len(radius), links)
    if len(radius) <= _ROUND and not _is_long(len(radius), links):
        drawing = circle(radius, links)
        if drawing.clash < 1 and _crossings(drawing) <= layers.crossings():
            return drawing
    return layered(radius, links, layers)


def _crossings(drawing: Drawing) -> int:
    """Return how often curves cross, loops left out."""
    drawn = np.array([curve.points[_RIM:-_RIM] for curve in drawing.curves])
    return sum(crossings(curve, drawn[:k]) for k, curve in enumerate(drawn))


def _is_long(nodes: int, links: Sequence[Link]) -> bool:
    """Tell whether nothing but loops ever leads back, and there is some way to go."""
    arcs = [(link.source, link.target) for link in links if link.source != link.target]
    rank = ranks(nodes, arcs)
    return nodes >= _LONG and all(rank[a] < rank[b] for a, b in arcs)

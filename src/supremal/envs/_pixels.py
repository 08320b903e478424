"""The pick-up and delivery grid as an array of pixels.

A picture is painted shape by shape.  A shape is the distance to its edge, negative inside; within half a
pixel of the edge colours mix, which is all there is to smooth edges.  Letters are strokes of a round pen.
Lengths are in cells, from the bottom left of the grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from math import cos, radians, sin
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import Floats
from supremal.envs._draw import items_at
from supremal.envs._grid import HEADINGS, HEIGHT, START, WALLS, WIDTH
from supremal.envs.pickup_delivery import GridState, decode

Colour: TypeAlias = tuple[float, float, float]
Spot: TypeAlias = tuple[float, float]

_PAPER: Final[Colour] = (1.0, 1.0, 1.0)
_INK: Final[Colour] = (0.13, 0.15, 0.19)
_FAINT: Final[Colour] = (0.88, 0.89, 0.91)
_GOAL: Final[Colour] = (0.89, 0.94, 0.87)
_GOAL_INK: Final[Colour] = (0.45, 0.62, 0.42)
_AGENT: Final[Colour] = (0.23, 0.25, 0.33)
_ITEM: Final[tuple[Colour, ...]] = ((0.00, 0.45, 0.70), (0.80, 0.36, 0.05), (0.00, 0.50, 0.37))
_MARGIN: Final = 0.3
_TRAY: Final = 1.2  # to the right of the grid, for what is carried
_SLOTS: Final = tuple((WIDTH + _MARGIN + _TRAY / 2, HEIGHT / 2 + 1.0 * k) for k in (1, 0, -1))
_CROWD: Final[dict[int, tuple[Spot, ...]]] = {
    1: ((0.0, 0.0),),
    2: ((-0.23, 0.0), (0.23, 0.0)),
    3: ((-0.23, 0.2), (0.23, 0.2), (0.0, -0.22)),
}
_BESIDE: Final[tuple[Spot, ...]] = ((0.28, 0.29), (0.28, -0.29), (-0.33, 0.0))
"""Where items lie on the agent's cell, ahead of it and to its right."""
_AHEAD: Final = ((0, 1), (1, 0), (0, -1), (-1, 0))


def pixels(code: int, *, cell: int = 40) -> NDArray[np.uint8]:
    """Draw state number ``code`` as a picture, ``uint8 [H, W, 3]``.

    An item at home is a filled disc, a dropped one a ring; what is carried lies in the tray on the right.

    Parameters
    ----------
    code
        See `encode`.
    cell
        The pixels a cell.

    Examples
    --------
    >>> from supremal.envs import PickupDelivery
    >>> pixels(PickupDelivery().start).shape
    (304, 432, 3)
    """
    state = decode(code)
    sheet = _blank(cell)
    sheet = sheet._replace(image=sheet.image.copy())
    if (state.x, state.y) != START:
        _letter(sheet, "S", _middle(*START), 0.5, _GOAL_INK)
    _agent(sheet, _middle(state.x, state.y), HEADINGS.index(state.heading))
    for y in range(HEIGHT):
        for x in range(WIDTH):
            _items(sheet, state, x, y)
    for item, place in enumerate(state.items):
        if place == "carried":
            _token(sheet, _SLOTS[item], 0.32, item, hollow=False)
    return np.rint(sheet.image * 255).astype(np.uint8)


def _middle(x: int, y: int) -> Spot:
    return x + 0.5, y + 0.5


class _Sheet(NamedTuple):
    """A picture, or a part of one: ``image [H, W, 3]``, where its pixels are, and how large a cell is."""

    image: Floats
    x: Floats
    y: Floats
    cell: int


@cache
def _blank(cell: int) -> _Sheet:
    """Return what all pictures share: the grid, its walls, S and the empty tray."""
    rows = round((HEIGHT + 2 * _MARGIN) * cell)
    columns = round((WIDTH + 2 * _MARGIN + _TRAY) * cell)
    x = (np.arange(columns) + 0.5) / cell - _MARGIN
    y = HEIGHT + _MARGIN - (np.arange(rows) + 0.5) / cell
    image = np.broadcast_to(np.array(_PAPER), (rows, columns, 3)).copy()
    sheet = _Sheet(image, *np.meshgrid(x, y), cell)
    goal_x, goal_y = _middle(*START)
    square = np.maximum(np.abs(sheet.x - goal_x), np.abs(sheet.y - goal_y)) - 0.5
    _paint(sheet, square, _GOAL)
    lines = [((u, 0), (u, HEIGHT)) for u in range(WIDTH + 1)] + [
        ((0, v), (WIDTH, v)) for v in range(HEIGHT + 1)
    ]
    for line in lines:
        _paint(sheet, _stroke(sheet, line) - 1 / cell, _FAINT)
    for corners in WALLS:
        _paint(sheet, _stroke(sheet, corners) - 0.05, _INK)
    for slot in _SLOTS:
        _paint(sheet, np.abs(_disc(sheet, slot, 0.32)) - 1 / cell, _FAINT)
    return sheet


def _items(sheet: _Sheet, state: GridState, x: int, y: int) -> None:
    """Paint what lies on cell (x, y), smaller where it shares the cell."""
    items = items_at(state, x, y)
    spots, size = _CROWD.get(len(items), ()), 0.33 if len(items) == 1 else 0.21
    if (x, y) == (state.x, state.y):
        u, v = _AHEAD[HEADINGS.index(state.heading)]
        spots, size = tuple((u * ahead + v * aside, v * ahead - u * aside) for ahead, aside in _BESIDE), 0.17
    for item, (right, up) in zip(items, spots, strict=False):
        centre = (x + 0.5 + right, y + 0.5 + up)
        _token(sheet, centre, size, item - 1, hollow=state.items[item - 1] == "dropped")


def _token(sheet: _Sheet, centre: Spot, size: float, item: int, *, hollow: bool) -> None:
    """Paint an item as a disc with its number, or as a ring if ``hollow``."""
    part = _around(sheet, centre, size + 0.1)
    _paint(part, _disc(part, centre, size + 0.04), _PAPER)  # a hem, where it covers the agent
    _paint(part, _disc(part, centre, size), _ITEM[item])
    if hollow:
        _paint(part, _disc(part, centre, 0.8 * size), _PAPER)
    _letter(part, str(item + 1), centre, size, _ITEM[item] if hollow else _PAPER)


def _agent(sheet: _Sheet, centre: Spot, heading: int) -> None:
    """Paint the agent: an arrow head."""
    part = _around(sheet, centre, 0.5)
    ahead_x, ahead_y = _AHEAD[heading]
    right, up = part.x - centre[0], part.y - centre[1]
    ahead, aside = right * ahead_x + up * ahead_y, np.abs(right * ahead_y - up * ahead_x)
    flank = 0.917 * aside + 0.399 * ahead - 0.136  # from the tip back to the wings
    notch = -0.460 * aside - 0.888 * ahead - 0.124  # and from there to the notch between them
    _paint(part, np.maximum(flank, notch) - 0.015, _AGENT)


# --- shapes -------------------------------------------------------------------------------------------------


def _around(sheet: _Sheet, centre: Spot, reach: float) -> _Sheet:
    """Return the part of ``sheet`` within ``reach`` of ``centre``; painting on it paints on the sheet."""
    columns = np.flatnonzero(np.abs(sheet.x[0] - centre[0]) <= reach)
    rows = np.flatnonzero(np.abs(sheet.y[:, 0] - centre[1]) <= reach)
    part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    return _Sheet(sheet.image[part], sheet.x[part], sheet.y[part], sheet.cell)


def _paint(sheet: _Sheet, distance: Floats, colour: Colour) -> None:
    """Paint the shape whose edge is ``distance`` away from each pixel."""
    cover = np.clip(0.5 - distance * sheet.cell, 0, 1)[:, :, None]
    sheet.image[:] += cover * (np.array(colour) - sheet.image)


def _disc(sheet: _Sheet, centre: Spot, radius: float) -> Floats:
    distance: Floats = np.hypot(sheet.x - centre[0], sheet.y - centre[1]) - radius
    return distance


def _stroke(sheet: _Sheet, points: Sequence[Spot]) -> Floats:
    """Return the distance to a line along ``points``."""
    nearest = np.full(sheet.x.shape, np.inf)
    for (ax, ay), (bx, by) in pairwise(points):
        right, up = sheet.x - ax, sheet.y - ay
        along_x, along_y = bx - ax, by - ay
        share = np.clip((right * along_x + up * along_y) / (along_x**2 + along_y**2), 0, 1)
        nearest = np.minimum(nearest, np.hypot(right - share * along_x, up - share * along_y))
    return nearest


def _letter(sheet: _Sheet, letter: str, centre: Spot, size: float, colour: Colour) -> None:
    """Write ``letter``, ``size`` high, with a round pen."""
    part = _around(sheet, centre, size)
    for stroke in _PEN[letter]:
        points = [(centre[0] + size * u, centre[1] + size * v) for u, v in stroke]
        _paint(part, _stroke(part, points) - 0.085 * size, colour)


def _arc(centre: Spot, radii: Spot, start: float, end: float) -> tuple[Spot, ...]:
    """Return points along an ellipse, from angle ``start`` to ``end``, in degrees from the right."""
    angles = [radians(start + (end - start) * k / 12) for k in range(13)]
    return tuple((centre[0] + radii[0] * cos(a), centre[1] + radii[1] * sin(a)) for a in angles)


_PEN: Final = {
    "1": (((-0.2, 0.28), (0.05, 0.5), (0.05, -0.5)),),
    "2": ((*_arc((0.0, 0.21), (0.27, 0.29), 165, -35), (-0.28, -0.5), (0.3, -0.5)),),
    "3": (_arc((0.0, 0.25), (0.25, 0.25), 150, -90), _arc((0.0, -0.25), (0.28, 0.25), 90, -150)),
    "S": ((*_arc((0.0, 0.25), (0.26, 0.25), 30, 270), *_arc((0.0, -0.25), (0.28, 0.25), 90, -150)[1:]),),
}

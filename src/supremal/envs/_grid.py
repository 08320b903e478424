"""The ground of the pick-up and delivery grid: cells, walls, and where a move leads.

A *cell* is the number ``y * 9 + x``, counted from the bottom left; a *pose* is ``cell * 4 + heading`` with
headings up, right, down, left.  Walls lie between cells, on the lines of the figure; a move is not possible
where it would cross one.  The border is a wall like any other, so no move needs a second check.

Source: section IV of the paper and its figure.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final, TypeAlias

from supremal._arrays import NONE

WIDTH: Final = 9
HEIGHT: Final = 7
CELLS: Final = WIDTH * HEIGHT
HEADINGS: Final = ("up", "right", "down", "left")
HEADS: Final = len(HEADINGS)
POSES: Final = CELLS * HEADS
MOVES: Final = ("l", "r", "f", "b")

Point: TypeAlias = tuple[int, int]
Side: TypeAlias = tuple[Point, Point]

START: Final[Point] = (6, 0)
HOMES: Final[tuple[Point, ...]] = ((0, 6), (8, 6), (6, 3))
"""The cells where items 1, 2 and 3 wait."""

WALLS: Final[tuple[tuple[Point, ...], ...]] = (
    ((0, 0), (9, 0), (9, 7), (0, 7), (0, 0)),
    ((3, 2), (3, 0), (4, 0), (4, 2)),
    ((2, 3), (0, 3), (0, 4), (2, 4)),
    ((3, 5), (3, 7), (4, 7), (4, 5)),
    ((5, 3), (6, 3), (6, 4), (5, 4)),
    ((8, 3), (7, 3), (7, 4), (8, 4)),
)
"""The thick lines of the figure, corner by corner: the border, then the five pockets."""

_STEPS: Final = ((0, 1), (1, 0), (0, -1), (-1, 0))  # one cell in each heading


def cell_at(x: int, y: int) -> int:
    """Return the number of the cell in column ``x`` and row ``y``."""
    return y * WIDTH + x


def pose_at(x: int, y: int, heading: int) -> int:
    """Return the number of the pose in column ``x`` and row ``y``, facing ``heading``."""
    return cell_at(x, y) * HEADS + heading


def side(x: int, y: int, heading: int) -> Side:
    """Return the unit line that a move out of cell (x, y) towards ``heading`` crosses, lower end first."""
    lines: tuple[Side, ...] = (
        ((x, y + 1), (x + 1, y + 1)),
        ((x + 1, y), (x + 1, y + 1)),
        ((x, y), (x + 1, y)),
        ((x, y), (x, y + 1)),
    )
    return lines[heading]


def _unit_lines(corners: tuple[Point, ...]) -> Iterator[Side]:
    """Cut a line along ``corners`` into lines of length 1, each with its lower end first."""
    for one, two in pairwise(corners):
        (x, y), (end_x, end_y) = min(one, two), max(one, two)
        if x == end_x:
            yield from (((x, v), (x, v + 1)) for v in range(y, end_y))
        else:
            yield from (((u, y), (u + 1, y)) for u in range(x, end_x))


WALL_SIDES: Final[frozenset[Side]] = frozenset(line for corners in WALLS for line in _unit_lines(corners))
"""All walls, cut into unit lines."""


def _target(pose: int, move: int) -> int:
    """Return the pose after ``move``, `NONE` where a wall is in the way."""
    cell, heading = divmod(pose, HEADS)
    y, x = divmod(cell, WIDTH)
    facing = (heading + (-1, 1, 0, 0)[move]) % 4  # l and r turn first
    towards = (facing + 2) % 4 if MOVES[move] == "b" else facing
    if side(x, y, towards) in WALL_SIDES:
        return NONE
    step_x, step_y = _STEPS[towards]
    return pose_at(x + step_x, y + step_y, facing)


MOVE: Final = tuple(tuple(_target(pose, move) for move in range(len(MOVES))) for pose in range(POSES))
"""The pose after each of l, r, f, b; `NONE` where the move is not possible."""

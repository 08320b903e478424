"""The load of the pick-up and delivery grid: where the three items are.

Each item is at home, carried or dropped; all dropped items lie on one cell, and where one is dropped, those
that are not are carried, for a drop needs all three in hand.  Besides, it matters whether the three were all
in hand at the last epoch already: while they are *fresh* nothing can fall.  That gives 8 sets carried from
home, 1 fresh one, and 7 dropped sets times 63 cells: 450 loads, each with a number.

Picking up and putting down are two tables over loads and the events p1, p2, p3, d1, d2, d3: `EVENT_CELL`
says on which cell the agent has to stand, `AFTER` which load results.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from supremal._arrays import NONE
from supremal.envs._grid import CELLS, HOMES, cell_at

HOME, CARRIED, DROPPED = 0, 1, 2
ITEMS: Final = (0, 1, 2)


class Load(NamedTuple):
    """Where each item is, on which cell the dropped ones lie, and whether all three were just collected."""

    items: tuple[int, int, int]
    cell: int = NONE
    fresh: bool = False


def _set(bits: int, inside: int, outside: int) -> tuple[int, int, int]:
    one, two, three = (inside if bits >> item & 1 else outside for item in ITEMS)
    return one, two, three


LOADS: Final = (
    *(Load(_set(bits, CARRIED, HOME)) for bits in range(8)),
    Load((CARRIED, CARRIED, CARRIED), fresh=True),
    *(Load(_set(bits, DROPPED, CARRIED), cell) for bits in range(1, 8) for cell in range(CELLS)),
)
"""All loads; that of number 0 is where an episode starts."""

NUMBER: Final = {load: k for k, load in enumerate(LOADS)}
ALL: Final = NUMBER[Load((CARRIED, CARRIED, CARRIED))]
FRESH: Final = NUMBER[Load((CARRIED, CARRIED, CARRIED), fresh=True)]


def _moved(load: Load, item: int, to: int, cell: int) -> int:
    """Return the number of ``load`` with ``item`` now at home, carried or dropped on ``cell``."""
    one, two, three = (to if k == item else load.items[k] for k in ITEMS)
    items = (one, two, three)
    return NUMBER[Load(items, cell if DROPPED in items else NONE, items == (CARRIED, CARRIED, CARRIED))]


def _pick(load: Load, item: int) -> tuple[int, int]:
    """Return where ``item`` is to be picked up, and the load after that."""
    if load.items[item] == CARRIED:
        return NONE, NONE
    where = load.cell if load.items[item] == DROPPED else cell_at(*HOMES[item])
    return where, _moved(load, item, CARRIED, load.cell)


def _put_down(load: Load, item: int) -> tuple[int, int]:
    """Return where ``item`` may be put down, beside what was dropped, and the load after that."""
    if load.items[item] != CARRIED or load.cell == NONE:
        return NONE, NONE
    return load.cell, _moved(load, item, DROPPED, load.cell)


_EVENTS: Final = tuple(
    (*(_pick(load, item) for item in ITEMS), *(_put_down(load, item) for item in ITEMS)) for load in LOADS
)
EVENT_CELL: Final = tuple(tuple(cell for cell, _ in row) for row in _EVENTS)
"""On which cell each of p1, p2, p3, d1, d2, d3 is possible, `NONE` where on none."""
AFTER: Final = tuple(tuple(load for _, load in row) for row in _EVENTS)
"""The load after each of p1, p2, p3, d1, d2, d3."""

SETTLED: Final = tuple(ALL if k == FRESH else k for k in range(len(LOADS)))
"""The load after a move: what was fresh is so no longer."""
FALLEN: Final = tuple(NUMBER[Load((DROPPED, CARRIED, CARRIED), cell)] for cell in range(CELLS))
"""The load after d_u on each cell: item 1 lies there."""
CARRIES: Final = tuple(sum(1 << item for item in ITEMS if load.items[item] == CARRIED) for load in LOADS)
"""The items carried, as bits."""

_PROGRAM: Final = {
    (DROPPED, CARRIED, CARRIED): 4,
    (DROPPED, DROPPED, CARRIED): 5,
    (DROPPED, DROPPED, DROPPED): 0,
    (CARRIED, DROPPED, DROPPED): 1,
    (CARRIED, CARRIED, DROPPED): 2,
}
RECOVERY: Final = tuple(_PROGRAM.get(load.items, NONE) for load in LOADS)
"""What the published program does next about a drop: d2, d3, p1, p2, p3, as a column of `AFTER`."""
IN_ORDER: Final = tuple(
    RECOVERY[k] != NONE if DROPPED in load.items else CARRIES[k] in (0b000, 0b001, 0b011, 0b111)
    for k, load in enumerate(LOADS)
)
"""Whether the published program goes on with a load: items in the order 1, 2, 3, or its own recovery."""

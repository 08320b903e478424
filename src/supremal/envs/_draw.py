"""The pick-up and delivery grid as a text."""

from __future__ import annotations

from typing import Final

from supremal.envs._grid import HEADINGS, HEIGHT, HOMES, START, WALL_SIDES, WIDTH, Side
from supremal.envs.pickup_delivery import GridState, decode, describe

_ARROWS: Final = dict(zip(HEADINGS, "▲▶▼◀", strict=True))
_CROSSINGS: Final = "·╹╺┗╻┃┏┣╸┛━┻┓┫┳╋"  # by the walls that meet there: 1 up, 2 right, 4 down, 8 left
_ROOM: Final = 5  # letters a cell


def draw(code: int) -> str:
    """Draw state number ``code`` as text: the walls, S, the agent as an arrow, and the items that lie about.

    Examples
    --------
    >>> from supremal.envs import PickupDelivery
    >>> print(draw(PickupDelivery().start))
    ┏━━━━━━━━━━━━━━━━━┳━━━━━┳━━━━━━━━━━━━━━━━━━━━━━━━━━━━━┓
    ┃  1              ┃     ┃                          2  ┃
    ┃     ·     ·     ┃     ┃     ·     ·     ·     ·     ┃
    ┃                 ┃     ┃                             ┃
    ┃     ·     ·     ╹     ╹     ·     ·     ·     ·     ┃
    ┃                                                     ┃
    ┣━━━━━━━━━━━╸     ·     ·     ╺━━━━━┓     ┏━━━━━╸     ┃
    ┃                                   ┃  3  ┃           ┃
    ┣━━━━━━━━━━━╸     ·     ·     ╺━━━━━┛     ┗━━━━━╸     ┃
    ┃                                                     ┃
    ┃     ·     ·     ╻     ╻     ·     ·     ·     ·     ┃
    ┃                 ┃     ┃                             ┃
    ┃     ·     ·     ┃     ┃     ·     ·     ·     ·     ┃
    ┃                 ┃     ┃              ▲S             ┃
    ┗━━━━━━━━━━━━━━━━━┻━━━━━┻━━━━━━━━━━━━━━━━━━━━━━━━━━━━━┛
    at (6, 0) facing up; carries nothing
    """
    state = decode(code)
    lines = []
    for y in range(HEIGHT, -1, -1):
        lines.append(
            "".join(_crossing(x, y) + _level(((x, y), (x + 1, y))) for x in range(WIDTH + 1)).rstrip()
        )
        if y:
            row = "".join(_upright(x, y - 1) + _inside(state, x, y - 1) for x in range(WIDTH))
            lines.append(row + _upright(WIDTH, y - 1))
    return "\n".join([*lines, describe(code)])


def items_at(state: GridState, x: int, y: int) -> list[int]:
    """Return the items that lie on cell (x, y), each 1, 2 or 3."""
    lies = {"home": HOMES, "dropped": [state.drop] * 3, "carried": [None] * 3}
    return [k + 1 for k, place in enumerate(state.items) if lies[place][k] == (x, y)]


def _crossing(x: int, y: int) -> str:
    meeting: tuple[Side, ...] = (
        ((x, y), (x, y + 1)),
        ((x, y), (x + 1, y)),
        ((x, y - 1), (x, y)),
        ((x - 1, y), (x, y)),
    )
    return _CROSSINGS[sum(1 << k for k, line in enumerate(meeting) if line in WALL_SIDES)]


def _level(line: Side) -> str:
    return ("━" if line in WALL_SIDES else " ") * _ROOM


def _upright(x: int, y: int) -> str:
    return "┃" if ((x, y), (x, y + 1)) in WALL_SIDES else " "


def _inside(state: GridState, x: int, y: int) -> str:
    agent = _ARROWS[state.heading] if (x, y) == (state.x, state.y) else ""
    goal = "S" if (x, y) == START else ""
    return (agent + goal + "".join(map(str, items_at(state, x, y)))).center(_ROOM)

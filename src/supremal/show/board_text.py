"""The board of a playback as text, for a terminal: a cell is a few letters, and walls are lines."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import floor
from typing import Final

from supremal.show.board import Board, Place, Token

_ARROWS: Final = "↑→↓←"
_SHAPES: Final = {"disc": "o", "square": "@"}
_LEAST: Final = 3
"""The least width of a cell."""


def board_text(board: Board, places: Sequence[Place | None] = ()) -> str:
    """Return a map with its tokens as lines of text; what is beside the map is told below it.

    Parameters
    ----------
    board
        What to draw.
    places
        Where the tokens are; None, or left out: nowhere.

    Examples
    --------
    >>> lane = Board(((0, 0), (1, 0), (2, 0)), (Token("agent", "arrow"),), walls=(((1, 0), (1, 1)),))
    >>> print(board_text(lane, [Place(0.5, 0.5, angle=90)]))
     → | .   .
    """
    stand = dict.fromkeys(board.cells, ".")
    stand |= {cell: tile.sign for cell, tile in board.tiles.items() if tile.sign.strip()}
    here: dict[tuple[int, int], list[str]] = {}
    beside = []
    for token, place in zip(board.tokens, places, strict=False):
        if place is None:
            continue
        cell = floor(place.x), floor(place.y)
        if cell in stand:
            here.setdefault(cell, []).append(_sign(token, place))
        else:
            beside.append(token.name)
    stand |= {cell: "".join(signs) for cell, signs in here.items()}
    lines = _lines(stand, _edges(board))
    return "\n".join(lines + ([f"beside it: {', '.join(beside)}"] if beside else []))


def _sign(token: Token, place: Place) -> str:
    if token.shape == "arrow":
        return _ARROWS[round(place.angle / 90) % 4]
    sign = token.sign or _SHAPES[token.shape]
    return f"({sign})" if place.look == "hollow" else sign


def _edges(board: Board) -> set[tuple[int, int, bool]]:
    """Return the walls cell by cell: a corner, and whether it goes down from there or to the right."""
    edges = set()
    for corners in board.walls:
        for (x0, y0), (x1, y1) in pairwise(corners):
            left, right = sorted((round(x0), round(x1)))
            top, bottom = sorted((round(y0), round(y1)))
            edges |= {(left, y, True) for y in range(top, bottom)}
            edges |= {(x, top, False) for x in range(left, right)}
    return edges


def _lines(stand: dict[tuple[int, int], str], edges: set[tuple[int, int, bool]]) -> list[str]:
    """Return the rows of cells, with the walls between them."""
    across = range(min(x for x, _ in stand), max(x for x, _ in stand) + 1)
    down = range(min(y for _, y in stand), max(y for _, y in stand) + 1)
    wide = max(_LEAST, *map(len, stand.values()))
    lines = []
    for y in (*down, down.stop):
        ways = [(x, y, False) in edges for x in across]
        if any(ways):
            lines.append(" " + " ".join(("-" if wall else " ") * wide for wall in ways))
        if y < down.stop:
            row = [
                ("|" if (x, y, True) in edges else " ") + stand.get((x, y), "").center(wide) for x in across
            ]
            lines.append("".join(row) + ("|" if (across.stop, y, True) in edges else ""))
    framed = any(line[:1] == "|" for line in lines)
    return [(line if framed else line[1:]).rstrip() for line in lines]

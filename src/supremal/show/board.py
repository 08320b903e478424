"""The board of a playback: a map of cells that stays, and tokens that move on it.

The map is one SVG.  A step of a playback says only where its tokens are, which the page's script puts into
effect; so an episode takes some bytes a step, and any environment that lives on cells has a picture.
Lengths are in cells; x counts to the right and y down.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple

from supremal.show._text import escape

CELL: Final = 40
"""The units of the drawing that a cell takes."""
_MARGIN: Final = 0.35
_SHAPES: Final = {
    "arrow": '<path d="M0-15L11 13L0 7L-11 13Z"/>',
    "disc": '<circle r="13"/>',
    "square": '<rect x="-13" y="-13" width="26" height="26" rx="4"/>',
}

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Token:
    """Something that moves; ``sign`` is written on it, and stays upright."""

    name: str
    shape: Literal["arrow", "disc", "square"] = "disc"
    sign: str = ""


class Tile(NamedTuple):
    """What is written on a cell, and what kind of cell it is."""

    sign: str
    kind: Literal["", "goal", "hole"] = ""


class Place(NamedTuple):
    """Where a token is: its middle, the angle it is turned by (clockwise), its size, and how it looks.

    ``look`` is "" or "hollow".
    """

    x: float
    y: float
    angle: float = 0.0
    size: float = 1.0
    look: Literal["", "hollow"] = ""


@dataclass(frozen=True, slots=True)
class Board:
    """A map of cells, and the tokens on it.

    Parameters
    ----------
    cells
        The cells that there are, each (x, y) of its upper left corner.
    tiles
        What some of them are.
    walls
        Lines that nothing passes, from corner to corner.
    tokens
        What moves.
    slots
        Places beside the map where tokens may be, each the middle of one.
    title
        What screen readers call it.
    """

    cells: tuple[tuple[int, int], ...]
    tokens: tuple[Token, ...]
    tiles: Mapping[tuple[int, int], Tile] = field(default_factory=dict)
    walls: tuple[tuple[Point, ...], ...] = ()
    slots: tuple[Point, ...] = ()
    title: str = "The map"


def board_svg(board: Board, start: Sequence[Place | None] = ()) -> str:
    """Return a picture of ``board`` as the text of one ``<svg>`` element.

    Parameters
    ----------
    board
        What to draw.
    start
        Where the tokens are; None, or left out: nowhere.

    Examples
    --------
    >>> lane = Board(((0, 0), (1, 0)), (Token("agent"),), {(1, 0): Tile("G", "goal")})
    >>> svg = board_svg(lane, [Place(0.5, 0.5)])
    >>> svg.count('class="cell"'), svg.count('class="token disc"'), ">G<" in svg
    (2, 1, True)
    """
    parts = [_rect(x, y, "cell") for x, y in board.cells]
    parts += [_rect(x, y, f"tile {tile.kind}") for (x, y), tile in board.tiles.items() if tile.kind]
    parts += [
        _sign(x + 0.5, y + 0.5, f"ground {kind}".rstrip(), sign)
        for (x, y), (sign, kind) in board.tiles.items()
    ]
    parts += [f'<circle class="slot" cx="{x * CELL:g}" cy="{y * CELL:g}" r="14"/>' for x, y in board.slots]
    parts += [f'<path class="wall" d="{_path(corners)}"/>' for corners in board.walls]
    placed = [*start, *[None] * (len(board.tokens) - len(start))]
    parts += [_token(token, place) for token, place in zip(board.tokens, placed, strict=True)]
    left, top, right, bottom = _frame(board)
    size = f"{left * CELL:g} {top * CELL:g} {(right - left) * CELL:g} {(bottom - top) * CELL:g}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="sm-board" role="img" viewBox="{size}" '
        f'aria-label="{escape(board.title)}">{"".join(parts)}</svg>'
    )


def spread_out(tokens: Mapping[int, Point], count: int) -> list[Place | None]:
    """Return the places of ``count`` tokens of which some are at points; those at the same one are smaller.

    Examples
    --------
    >>> spread_out({0: (1, 1), 2: (1, 1)}, 3)
    [Place(x=0.78, y=1, angle=0.0, size=0.6, look=''), None, Place(x=1.22, y=1, angle=0.0, size=0.6, look='')]
    """
    there: dict[Point, list[int]] = {}
    for k, point in tokens.items():
        there.setdefault(point, []).append(k)
    places: list[Place | None] = [None] * count
    for (x, y), sharing in there.items():
        for at, k in enumerate(sharing):
            aside = 0.44 * (at - (len(sharing) - 1) / 2)
            places[k] = Place(x + aside, y, size=1.0 if len(sharing) == 1 else 0.6)
    return places


def _rect(x: float, y: float, css: str) -> str:
    return f'<rect class="{css}" x="{x * CELL:g}" y="{y * CELL:g}" width="{CELL}" height="{CELL}"/>'


def _sign(x: float, y: float, css: str, sign: str) -> str:
    return f'<text class="{css}" x="{x * CELL:g}" y="{y * CELL:g}">{escape(sign)}</text>'


def _path(corners: Iterable[Point]) -> str:
    return "M" + "L".join(f"{x * CELL:g} {y * CELL:g}" for x, y in corners)


def _token(token: Token, place: Place | None) -> str:
    css, style = f"token {token.shape}", "display:none"
    if place is not None:
        css += f" {place.look}" if place.look else ""
        style = f"transform:translate({place.x * CELL:g}px,{place.y * CELL:g}px) scale({place.size:g})"
    turn = f' style="transform:rotate({place.angle:g}deg)"' if place and place.angle else ""
    sign = f"<text>{escape(token.sign)}</text>" if token.sign else ""
    return (
        f'<g class="{css}" style="{style}"><title>{escape(token.name)}</title>'
        f'<g class="shape"{turn}>{_SHAPES[token.shape]}</g>{sign}</g>'
    )


def _frame(board: Board) -> tuple[float, float, float, float]:
    """Return left, top, right and bottom of all that is drawn, with a margin."""
    x = [x for x, _ in board.cells] + [x - 0.5 for x, _ in board.slots]
    y = [y for _, y in board.cells] + [y - 0.5 for _, y in board.slots]
    return min(x) - _MARGIN, min(y) - _MARGIN, max(x) + 1 + _MARGIN, max(y) + 1 + _MARGIN

"""How a map of cells is drawn with matplotlib: colours, what stands on cells, walls, arrows and the scale."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import floor, log10
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from supremal._arrays import Floats
from supremal.show import _matplotlib as mpl
from supremal.show._scale import limits, tick_labels, ticks
from supremal.show.board import Board

if TYPE_CHECKING:
    from supremal.show.heatmaps import Arrow

_INK: Final = "#1b2530"
_FAINT: Final = "#5c6773"
_HATCH: Final = "#d3d8dd"
_HOLE: Final = "#eceff2"
_GOAL: Final = "#dfeeda"
_COLOURS: Final = "Blues"
_PALE: Final = 0.1
"""How far up the colours begin, so that the least is told apart from paper."""
_DARK: Final = 0.55
"""The share of the scale above which what is written on a cell is white."""
_WRITTEN: Final = 150
_FAINTEST: Final = 0.08
"""Arrows of a smaller share are left out."""
_WIDE: Final = 5.2
_CELL: Final = (0.36, 0.8)
_PAD: Final = 0.1
_TITLE: Final = 0.32
_SCALE: Final = 1.2
_LETTER: Final = 0.105
"""Inches: of the cells of a map, of a cell, around all, above it, beside it, and of a letter of the title."""
_ARROW: Final = np.array(
    [[0, 0.065], [0.58, 0.065], [0.58, 0.2], [1, 0], [0.58, -0.2], [0.58, -0.065], [0, -0.065]]
)
"""An arrow of length 1, to the right."""
_ALONE: Final = 0.62
"""The length of an arrow that is alone on its cell, in cells."""
_REACH: Final = 0.4
"""That of one of several with all of the share; they begin around the middle."""
_ROUND: Final = 0.17
_RING: Final = np.array([(np.cos(t), np.sin(t)) for t in np.linspace(0, 2 * np.pi, 40)])


def draw_map(
    board: Board, heat: Floats | None, arrows: Sequence[Arrow], *, title: str, unit: str
) -> mpl.Figure:
    """Return the figure of a map; see `supremal.show.heatmaps.save_heatmap`."""
    x, y = np.array(board.cells).T
    width, height = int(np.ptp(x)) + 1, int(np.ptp(y)) + 1
    cell = min(max(_WIDE / max(width, height), _CELL[0]), _CELL[1])
    aside = _SCALE if heat is not None and np.isfinite(heat).any() else 0.0
    wide = max(cell * width + aside, _LETTER * len(title)) + 2 * _PAD
    high = cell * height + (_TITLE if title else 0.0) + 2 * _PAD
    figure = mpl.new_figure(wide, high)
    figure.set_layout_engine("none")  # all sizes are known
    axes = figure.add_axes((_PAD / wide, _PAD / high, cell * width / wide, cell * height / high))
    axes.set(xlim=(x.min(), x.max() + 1), ylim=(y.max() + 1, y.min()))
    axes.set_axis_off()
    shares = _shares(heat, len(board.cells))
    if heat is not None and aside:
        mesh = _paint(axes, board, heat)
        gauge = figure.add_axes(
            ((_PAD + cell * width + 0.16) / wide, _PAD / high, 0.17 / wide, cell * height / high)
        )
        _dress(figure.colorbar(mesh, cax=gauge), heat, unit)
    _ground(axes, board, shares, 72 * cell, {arrow.cell for arrow in arrows})
    if heat is not None and not arrows and len(board.cells) <= _WRITTEN:
        _numbers(axes, board, heat, shares, 72 * cell)
    _point(axes, board, arrows)
    for corners in board.walls:
        axes.plot(
            *zip(*corners, strict=True),
            color=_INK,
            linewidth=2.4,
            solid_capstyle="projecting",
            zorder=5,
            clip_on=False,
        )
    if title:
        axes.set_title(title, loc="left", color=_INK, fontweight="bold", fontsize=12, pad=9)
    return figure


def _shares(heat: Floats | None, cells: int) -> Floats:
    """Return how dark each cell is, from 0 to 1, nan where it has no colour."""
    if heat is None or not np.isfinite(heat).any():
        return np.full(cells, np.nan)
    known = np.where(np.isfinite(heat), heat, np.nan)
    low, span = np.nanmin(known), np.ptp(known[np.isfinite(known)])
    return np.asarray(_PALE + (1 - _PALE) * ((known - low) / span if span else known - low), np.float64)


def _ends(heat: Floats) -> tuple[float, float]:
    """Return where the scale starts and ends."""
    known = heat[np.isfinite(heat)]
    low, high = float(known.min()), float(known.max())
    return low, high if high > low else low + 1.0


def _paint(axes: mpl.Axes, board: Board, heat: Floats) -> Any:  # noqa: ANN401 - what the scale is made of
    """Paint the cells."""
    x, y = np.array(board.cells).T
    grid = np.full((int(np.ptp(y)) + 1, int(np.ptp(x)) + 1), np.nan)
    grid[y - y.min(), x - x.min()] = np.where(np.isfinite(heat), heat, np.nan)
    low, high = _ends(heat)
    return axes.pcolormesh(
        np.arange(x.min(), x.max() + 2),
        np.arange(y.min(), y.max() + 2),
        np.ma.masked_invalid(grid),
        cmap=_COLOURS,
        vmin=low - _PALE / (1 - _PALE) * (high - low),
        vmax=high,
        edgecolors="white",
        linewidth=1.0,
    )


def _dress(bar: Any, heat: Floats, unit: str) -> None:  # noqa: ANN401 - matplotlib's scale
    """Set the ends and ticks of the scale, and write its unit."""
    low, high = _ends(heat)
    bar.ax.set_ylim(low, high)
    marks = [tick for tick in ticks(*limits([low, high])) if low <= tick <= high]
    bar.set_ticks(marks, labels=tick_labels(marks))
    bar.ax.tick_params(colors=_FAINT, length=0, labelsize=9.5)
    bar.outline.set_visible(False)
    if unit:
        bar.set_label(unit, color=_FAINT, fontsize=10)


def _ground(axes: mpl.Axes, board: Board, shares: Floats, cell: float, pointed: set[int]) -> None:
    """Draw what cells without a colour look like, and write the sign of each tile, aside where more is."""
    for place, share in zip(board.cells, shares, strict=True):
        kind = board.tiles[place].kind if place in board.tiles else ""
        if np.isnan(share):
            square = np.add(place, [(0, 0), (1, 0), (1, 1), (0, 1)])
            colour = {"goal": _GOAL, "hole": _HOLE}.get(kind, "white")
            hatched: dict[str, Any] = {} if kind or not np.isfinite(shares).any() else {"hatch": "////"}
            axes.fill(*square.T, facecolor=colour, edgecolor=_HATCH, linewidth=0.8, zorder=1.2, **hatched)
    for (x, y), tile in board.tiles.items():
        number = board.cells.index((x, y))
        share = shares[number]
        aside = number in pointed or not np.isnan(share)
        axes.text(
            x + (0.17 if aside else 0.5),
            y + (0.2 if aside else 0.52),
            tile.sign,
            color="white" if share > _DARK else _FAINT,
            fontsize=(0.19 if aside else 0.34) * cell,
            fontweight="bold",
            ha="center",
            va="center",
            zorder=4,
        )


def _numbers(axes: mpl.Axes, board: Board, heat: Floats, shares: Floats, cell: float) -> None:
    """Write what each cell has."""
    largest = np.abs(heat[np.isfinite(heat)]).max(initial=0.0)
    digits = max(0, 2 - floor(log10(largest))) if largest else 0
    for (x, y), value, share in zip(board.cells, heat, shares, strict=True):
        if np.isfinite(value):
            text = f"{value:,.{min(digits, 4)}f}".replace("-", "\u2212")
            axes.text(
                x + 0.5,
                y + 0.53,
                text,
                color="white" if share > _DARK else _INK,
                fontsize=min(0.24, 1.15 / len(text)) * cell,
                ha="center",
                va="center",
                zorder=4,
            )


def _point(axes: mpl.Axes, board: Board, arrows: Sequence[Arrow]) -> None:
    """Draw the arrows, the area of each as its share."""
    shown = [arrow for arrow in arrows if arrow.share >= _FAINTEST]
    together = Counter(arrow.cell for arrow in shown)
    rings = {arrow.cell: _ROUND * arrow.share**0.5 for arrow in shown if arrow.x == arrow.y == 0}
    for cell, x, y, share in shown:
        middle = np.add(board.cells[cell], 0.5)
        if x == y == 0:
            ring = middle + rings[cell] * _RING
            axes.plot(*ring.T, color="white", linewidth=3.4, zorder=4)
            axes.plot(*ring.T, color=_INK, linewidth=1.8, zorder=4.1)
            continue
        along = _ALONE * (_ARROW - [0.5, 0])
        if together[cell] > 1:
            along = _REACH * share**0.5 * _ARROW + [0.03 + rings.get(cell, 0.0), 0]
        turned = along @ np.array([[x, y], [-y, x]])
        axes.fill(*(middle + turned).T, color="white", linewidth=1.6, joinstyle="round", zorder=4.2)
        axes.fill(*(middle + turned).T, facecolor=_INK, linewidth=0, zorder=4.3)

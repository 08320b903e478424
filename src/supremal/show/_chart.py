"""Learning curves as inline SVG, written by hand, so that a report needs no plotting library.

One panel, horizontal grid lines only, a legend above it, and for each series a style that does not rest on
colour: the main curve is strong, the second dotted, reference points are open diamonds with their value
beside them.  Each point tells its numbers in a tooltip.  The ink is the text colour of the page, which may
set the CSS variables ``--chart-ink``, ``-paper``, ``-main``, ``-second`` and ``-font``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Final, Literal

from supremal.errors import ModelError
from supremal.show._scale import limits, number, tick_labels, ticks
from supremal.show._text import escape

_W: Final = 460.0
_H: Final = 300.0
_LEFT: Final = 72.0
_RIGHT: Final = 24.0
_TOP: Final = 62.0
_BOTTOM: Final = 42.0
_ROW: Final = 18.0  # of the legend
_TOLD: Final = 150  # curves with more points tell no numbers
_FEW: Final = 4  # up to so many reference points show their value
_LAYERS: Final = ("second", "main", "reference")  # from the back
_BESIDE: Final = (
    (0, -11, "mid"), (0, 20, "mid"), (9, 4, "start"), (-9, 4, "end"),
    (4, -11, "start"), (-4, -11, "end"), (4, 20, "start"), (-4, 20, "end"),
)  # fmt: skip

_STYLE: Final = """
.sm-chart{--c-paper:var(--chart-paper,Canvas);--c-main:var(--chart-main,#1684c4);
--c-second:var(--chart-second,#b07d3c);color:var(--chart-ink,currentColor)}
.sm-chart text{font:12px var(--chart-font,system-ui,-apple-system,"Segoe UI",sans-serif);fill:currentColor;
fill-opacity:.74;font-variant-numeric:tabular-nums}
.sm-chart .title{font-size:14.5px;font-weight:650;fill-opacity:1}.sm-chart .key{fill-opacity:1}
.sm-chart .end{text-anchor:end}.sm-chart .mid{text-anchor:middle}
.sm-chart .grid{stroke:currentColor;stroke-opacity:.13}.sm-chart .base{stroke:currentColor;stroke-opacity:.6}
.sm-chart .curve{fill:none;stroke-linejoin:round;stroke-linecap:round}
.sm-chart .curve.main{stroke:var(--c-main);stroke-width:2.4}
.sm-chart .curve.second{stroke:var(--c-second);stroke-width:2;stroke-dasharray:.1 4}
.sm-chart .pale{opacity:.4}.sm-chart .curve.main.pale{stroke-width:1.4}
.sm-chart .band{opacity:.2;fill:var(--c-second)}.sm-chart .band.main{fill:var(--c-main)}
.sm-chart .dot.main{fill:var(--c-main)}.sm-chart .dot.second{fill:var(--c-second)}
.sm-chart .spot{fill:currentColor;fill-opacity:0}.sm-chart .spot:hover{fill-opacity:.3}
.sm-chart .reference{fill:var(--c-paper);stroke:currentColor;stroke-width:1.5}
.sm-chart .value{fill-opacity:1;paint-order:stroke;stroke:var(--c-paper);stroke-width:4px;
stroke-linejoin:round}
"""


@dataclass(frozen=True, slots=True)
class Series:
    """One curve, or a few points to compare it with.

    Parameters
    ----------
    label
        What the legend calls it; with none it is drawn pale and stands in no legend (one seed of many).
    x, y
        The points, as many of each.  A y that is None is a gap.
    style
        "main", "second" (muted: the baseline) or "reference" (single points, such as published ones).
    band
        The ends of an interval around each point, shaded; None: there is none.

    Raises
    ------
    ModelError
        If x, y and band differ in length or the style is unknown.
    """

    label: str
    x: Sequence[float]
    y: Sequence[float | None]
    style: Literal["main", "second", "reference"] = "main"
    band: Sequence[tuple[float, float]] | None = None

    def __post_init__(self) -> None:
        if len(self.x) != len(self.y):
            message = f"series {self.label!r} has {len(self.x)} x and {len(self.y)} y; as many are needed"
            raise ModelError(message)
        if self.band is not None and len(self.band) != len(self.x):
            message = f"series {self.label!r} has {len(self.x)} x, {len(self.band)} ends; as many are needed"
            raise ModelError(message)
        if self.style not in ("main", "second", "reference"):
            message = f"series {self.label!r} has style {self.style!r}; main, second or reference is needed"
            raise ModelError(message)

    def stretches(self) -> list[list[tuple[float, float]]]:
        """Return the points, one list for each stretch without a gap."""
        parts: list[list[tuple[float, float]]] = [[]]
        for x, y in zip(self.x, self.y, strict=True):
            if y is None or not isfinite(y):
                parts.append([])
            else:
                parts[-1].append((float(x), float(y)))
        return [part for part in parts if part]

    def points(self) -> list[tuple[float, float]]:
        """Return all points that are there."""
        return [point for part in self.stretches() for point in part]


@dataclass(frozen=True, slots=True)
class Panel:
    """The axes: where a value stands on the page."""

    x: tuple[float, float]
    y: tuple[float, float]

    def across(self, x: float) -> float:
        """Return where ``x`` stands, from the left."""
        return _LEFT + (x - self.x[0]) / (self.x[1] - self.x[0]) * (_W - _LEFT - _RIGHT)

    def up(self, y: float) -> float:
        """Return where ``y`` stands, from the top."""
        return _H - _BOTTOM - (y - self.y[0]) / (self.y[1] - self.y[0]) * (_H - _TOP - _BOTTOM)


def panel_of(series: Sequence[Series], ylim: tuple[float, float] | None) -> Panel:
    """Return the axes that hold all of ``series``."""
    points = [point for one in series for point in one.points()]
    bounds = [y for one in series for ends in one.band or () for y in ends]
    return Panel(limits([x for x, _ in points]), limits([*(y for _, y in points), *bounds], ylim))


def beside(panel: Panel, x: float, y: float, series: Sequence[Series]) -> tuple[float, float, str]:
    """Return where to write the value of the point (x, y): the offset, and the anchor of the text.

    It is the place of a few around the point that covers the least of the curves.
    """
    u, v, wide = panel.across(x), panel.up(y), 6.6 * len(number(y))
    dots = [
        (panel.across(a + (c - a) * t / 8), panel.up(b + (d - b) * t / 8))
        for one in series
        if one.style != "reference"
        for part in one.stretches()
        for (a, b), (c, d) in pairwise(part)
        for t in range(8)
    ]

    def cost(option: tuple[float, float, str]) -> float:
        dx, dy, anchor = option
        left = u + dx - {"start": 0.0, "mid": wide / 2, "end": wide}[anchor]
        base = v + dy
        outside = left < _LEFT - 4 or left + wide > _W - 2 or base > _H - _BOTTOM or base < _TOP + 6
        covered = sum(left - 2 < a < left + wide + 2 and base - 13 < b < base + 4 for a, b in dots)
        return 100 * outside + covered

    return min(_BESIDE, key=cost)


def curves_svg(
    series: Sequence[Series],
    *,
    xlabel: str,
    ylabel: str,
    ylim: tuple[float, float] | None = None,
    title: str = "",
) -> str:
    """Return the chart of ``series`` as the text of one ``<svg>`` element.

    Parameters
    ----------
    series
        What to draw, in the order of the legend.
    xlabel, ylabel
        What the axes show.
    ylim
        The ends of the y-axis; left out: round numbers around the data.
    title
        What stands above the chart; left out: ``ylabel``.

    Examples
    --------
    >>> curves_svg([Series("here", [1, 2], [-9.0, -3.0])], xlabel="episode", ylabel="score")[:4]
    '<svg'
    """
    panel = panel_of(series, ylim)
    legend, above = _legend(series)
    head = f'<text class="title" x="1" y="{16 - above}">{escape(title or ylabel)}</text>'
    body = [_axes(panel, xlabel), head, legend]
    if not any(one.points() for one in series):
        middle = f'x="{(_LEFT + _W - _RIGHT) / 2:.0f}" y="{(_TOP + _H - _BOTTOM) / 2:.0f}"'
        body.append(f'<text class="mid" {middle}>no data yet</text>')
    for one in sorted(series, key=lambda one: (_LAYERS.index(one.style), bool(one.label))):
        reference = one.style == "reference"
        body.append(_points(one, panel, ylabel, series) if reference else _curve(one, panel, ylabel))
    style = " ".join(_STYLE.split("\n")).strip()
    name = escape(f"{title or ylabel}: {ylabel} over {xlabel}" if title else f"{ylabel} over {xlabel}")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="sm-chart" role="img" aria-label="{name}" '
        f'viewBox="0 {-above:.0f} {_W:.0f} {_H + above:.0f}" width="{_W:.0f}" height="{_H + above:.0f}">'
        f"<title>{name}</title>"
        f"<desc>{escape(_told(series))}</desc><style>{style}</style>{''.join(body)}</svg>"
    )


def _told(series: Sequence[Series]) -> str:
    told = []
    for one in series:
        points = one.points() if one.label else []
        if one.style == "reference":
            told.append(f"{one.label}: " + ", ".join(f"{number(y)} at {number(x)}" for x, y in points))
        elif points:
            (a, b), (c, d) = points[0], points[-1]
            told.append(f"{one.label}: from {number(b)} at {number(a)} to {number(d)} at {number(c)}")
    return "; ".join(told) or "no data yet"


def _axes(panel: Panel, xlabel: str) -> str:
    parts = []
    right, base = _W - _RIGHT, _H - _BOTTOM
    for tick, said in _marks(panel.y):
        y = panel.up(tick)
        parts.append(f'<line class="grid" x1="{_LEFT}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}"/>')
        parts.append(f'<text class="end" x="{_LEFT - 8}" y="{y + 4:.1f}">{said}</text>')
    parts.append(f'<line class="base" x1="{_LEFT}" x2="{right}" y1="{base}" y2="{base}"/>')
    for tick, said in _marks(panel.x):
        x = panel.across(tick)
        parts.append(f'<line class="base" x1="{x:.1f}" x2="{x:.1f}" y1="{base}" y2="{base + 4}"/>')
        parts.append(f'<text class="mid" x="{x:.1f}" y="{base + 18}">{said}</text>')
    parts.append(f'<text class="end" x="{right}" y="{_H - 4}">{escape(xlabel)}</text>')
    return "".join(parts)


def _marks(ends: tuple[float, float]) -> zip[tuple[float, str]]:
    """Return the ticks of an axis, and what stands at each."""
    marks = ticks(*ends)
    return zip(marks, tick_labels(marks), strict=True)


def _legend(series: Sequence[Series]) -> tuple[str, float]:
    """Return the legend, its last row where the panel leaves room, and how much it stands out above."""
    named = [one for one in series if one.label]
    wide = [24 + 6.3 * len(one.label) + 18 for one in named]
    x, row = 1.0, 0
    places = []
    for step in wide:
        if x + step - 18 > _W and x > 1:
            x, row = 1.0, row + 1
        places.append((x, row))
        x += step
    parts = []
    for one, (left, at) in zip(named, places, strict=True):
        y = 36 - _ROW * (row - at)
        mark = f'<line class="curve {one.style}" x1="{left:.0f}" x2="{left + 19:.0f}" y1="{y}" y2="{y}"/>'
        if one.style == "reference":
            mark = _diamond(left + 10, y)
        parts.append(f'{mark}<text class="key" x="{left + 24:.0f}" y="{y + 4}">{escape(one.label)}</text>')
    return "".join(parts), _ROW * row


def _diamond(x: float, y: float) -> str:
    return f'<path class="reference" d="M{x:.1f},{y - 5:.1f} l5,5 l-5,5 l-5,-5 Z"/>'


def _curve(one: Series, panel: Panel, ylabel: str) -> str:
    parts = [_band(one, panel)]
    stretches = one.stretches()
    css = one.style if one.label else f"{one.style} pale"
    for part in stretches:
        places = " ".join(f"{panel.across(x):.1f},{panel.up(y):.1f}" for x, y in part)
        if len(part) > 1:
            parts.append(f'<polyline class="curve {css}" points="{places}"/>')
        else:
            u, v = places.split(",")
            parts.append(f'<circle class="dot {css}" cx="{u}" cy="{v}" r="3"/>')
    if sum(map(len, stretches)) <= _TOLD:
        for x, y in one.points():
            place = f'cx="{panel.across(x):.1f}" cy="{panel.up(y):.1f}"'
            told = escape(f"{one.label or 'one more'}, {number(x)}: {ylabel} {number(y)}")
            parts.append(f'<circle class="spot" {place} r="4"><title>{told}</title></circle>')
    frame = f"{_LEFT - 4} {_TOP - 4} {_W - _LEFT - _RIGHT + 8} {_H - _TOP - _BOTTOM + 8}"
    left, top, wide, high = frame.split()
    place = f'x="{left}" y="{top}" width="{wide}" height="{high}" viewBox="{frame}"'
    return f"<svg {place}>{''.join(parts)}</svg>"  # cuts off what lies beyond the axes


def _band(one: Series, panel: Panel) -> str:
    """Return the interval around a curve, shaded."""
    if not one.band:
        return ""
    low = [(panel.across(x), panel.up(ends[0])) for x, ends in zip(one.x, one.band, strict=True)]
    high = [(panel.across(x), panel.up(ends[1])) for x, ends in zip(one.x, one.band, strict=True)]
    places = " ".join(f"{x:.1f},{y:.1f}" for x, y in [*low, *reversed(high)])
    return f'<polygon class="band {one.style}" points="{places}"/>'


def _points(one: Series, panel: Panel, ylabel: str, series: Sequence[Series]) -> str:
    points = one.points()
    parts = []
    for x, y in points:
        u, v = panel.across(x), panel.up(y)
        told = escape(f"{one.label}, {number(x)}: {ylabel} {number(y)}")
        value = ""
        if len(points) <= _FEW:
            dx, dy, anchor = beside(panel, x, y, series)
            value = f'<text class="value {anchor}" x="{u + dx:.1f}" y="{v + dy:.1f}">{number(y)}</text>'
        parts.append(f"<g><title>{told}</title>{_diamond(u, v)}{value}</g>")
    return "".join(parts)

"""A scene as PNG, with the fonts that come with matplotlib: it looks alike on every machine."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from functools import cache
from typing import Any, Final, Literal

import numpy as np

from supremal.show import _matplotlib as mpl
from supremal.show._ink import FILE, RUNS, STOPPING, Style, style_of
from supremal.show._scene import Circle, Group, Mark, Path, Scene, Words
from supremal.show._text import LEADING, SIZE, Line

Slant = Literal["normal", "italic"]

_STEP: Final = re.compile(r"([MLQCZ])([^MLQCZ]*)")
_NUMBER: Final = re.compile(r"-?[0-9.]+")
_LOWERED: Final = 0.22 * SIZE  # a subscript
_FRONT: Final = 10


def png_of(scene: Scene, *, scale: float = 2.0) -> bytes:
    """Return a scene as the bytes of a PNG, with ``scale`` pixels for each unit of the drawing.

    Raises
    ------
    MissingDependencyError
        If matplotlib is not installed.
    """
    with mpl.house_style(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # a box is drawn in its place
        axes = mpl.bare_axes(*scene.frame)
        for order, group in enumerate(scene.groups):
            for mark in group.marks:
                for outline, style in _outlines(group, mark):
                    _paint(axes, outline, style, group, _FRONT + order)
        return mpl.png_bytes(axes, scale)


def _outlines(group: Group, mark: Mark) -> Iterator[tuple[mpl.Outline, Style]]:
    """Return the outlines that a mark consists of, and the style of each."""
    style = style_of(group.css, mark.css)
    match mark:
        case Path(_, d):
            yield _outline(d), style
        case Circle(_, x, y, r):
            yield mpl.Outline.circle((x, y), r), style
        case Words(_, x, y, lines):
            first = y - LEADING * (len(lines) - 1) / 2 + 0.33 * SIZE
            for at, line in enumerate(lines):
                yield from _written(line, x, first + at * LEADING, style)


def _outline(d: str) -> mpl.Outline:
    """Return a path in SVG's words as one of matplotlib's."""
    kinds = {
        "M": mpl.Outline.MOVETO,
        "L": mpl.Outline.LINETO,
        "Q": mpl.Outline.CURVE3,
        "C": mpl.Outline.CURVE4,
    }
    corners: list[tuple[float, float]] = []
    codes: list[Any] = []
    for letter, numbers in _STEP.findall(d):
        if letter == "Z":
            corners.append(corners[0])
            codes.append(mpl.Outline.CLOSEPOLY)
            continue
        values = [float(number) for number in _NUMBER.findall(numbers)]
        points = list(zip(values[::2], values[1::2], strict=True))
        corners += points
        codes += [kinds[letter]] * len(points)
    return mpl.Outline(corners, codes)


def _written(line: Line, x: float, y: float, style: Style) -> Iterator[tuple[mpl.Outline, Style]]:
    """Return the outlines of the runs of a line of text whose base line is at y."""
    pieces, wide = [], 0.0
    for run in line:
        look = dict(style)
        for name in (run.style, "sub" if run.sub else ""):
            look |= RUNS.get(name, {})
        if run.text.strip():
            text = _letters(run.text, *_font(look))
            pieces.append((text, wide, _LOWERED if run.sub else 0.0, look))
        # spaces have no outline: how long a run is, a letter after it tells
        ends = [_letters(text, *_font(look)).vertices[:, 0].max() for text in (f"{run.text}x", "x")]
        wide += float(ends[0] - ends[1])
    left = x if style.get("text-anchor") == "start" else x - wide / 2
    for text, offset, down, look in pieces:
        placed = np.column_stack([left + offset + text.vertices[:, 0], y + down - text.vertices[:, 1]])
        yield mpl.Outline(placed, text.codes), look


@cache
def _letters(text: str, family: str, slant: Slant, weight: str, size: float) -> mpl.TextPath:
    font = mpl.FontProperties(family=[family, "DejaVu Sans"], style=slant, weight=weight)
    return mpl.TextPath((0, 0), text, prop=font, size=size)


def _font(look: Style) -> tuple[str, Slant, str, float]:
    """Return the family, the slant, the weight and the size that a style asks for."""
    font = look["font"]
    size = look.get("font-size") or font.split("px")[0].split()[-1]
    return (
        "DejaVu Sans Mono" if "mono" in font else "DejaVu Sans" if "sans" in font else "STIXGeneral",
        "italic" if font.startswith("italic") and look.get("font-style") != "normal" else "normal",
        "bold" if font.startswith("700") or look.get("font-weight") == "600" else "normal",
        float(size.removesuffix("px")),
    )


def _paint(axes: mpl.Axes, outline: mpl.Outline, style: Style, group: Group, order: int) -> None:
    own = FILE["stop"] if set(STOPPING) & set(group.css.split()) else FILE["ink"]

    def colour(name: str) -> str | tuple[str, float]:
        said = style.get(name, "none")
        if said == "none":
            return "none"
        return own if said == "own" else FILE[said], float(style.get(f"{name}-opacity", 1))

    look: dict[str, Any] = {"linewidth": float(style.get("stroke-width", 1)), "joinstyle": "round"}
    if "stroke-dasharray" in style:
        look["linestyle"] = (0, [float(n) / look["linewidth"] for n in style["stroke-dasharray"].split()])
    else:
        look["capstyle"] = style.get("stroke-linecap", "butt")
    colours = {"facecolor": colour("fill"), "edgecolor": colour("stroke")}
    axes.add_artist(mpl.PathPatch(outline, zorder=order, **colours, **look))

"""The one module that imports matplotlib, through its object interface: no pyplot, no display, no state.

Files come out the same for the same figure: text becomes paths, identifiers have a fixed salt, and neither a
date nor a version is written into them.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from supremal.errors import MissingDependencyError

try:
    from matplotlib import style
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure
    from matplotlib.font_manager import FontProperties
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline
    from matplotlib.textpath import TextPath
except ImportError:
    package = "matplotlib"
    raise MissingDependencyError(package, extra="plot", purpose="drawing figures") from None

__all__ = [
    "Axes",
    "Figure",
    "FontProperties",
    "Outline",
    "PathPatch",
    "TextPath",
    "bare_axes",
    "house_style",
    "new_figure",
    "png_bytes",
    "write",
]

_RC: Final[Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib, so that figures look alike everywhere
    "font.size": 11,
    "axes.unicode_minus": True,
    "svg.hashsalt": "supremal",
    "svg.fonttype": "path",
    "path.simplify": False,
    "text.parse_math": False,  # a dollar is a dollar
}


def house_style() -> AbstractContextManager[None]:
    """Return a context in which figures are drawn in our style, whatever the settings of the user."""
    return style.context(["default", _RC])


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of ``width`` × ``height`` inches."""
    return Figure(figsize=(width, height), layout="constrained", facecolor="white")


def bare_axes(left: float, top: float, width: float, height: float) -> Axes:
    """Return axes that fill a figure and show nothing by themselves: one unit is one point, y points down."""
    figure = Figure(figsize=(width / 72, height / 72), facecolor="white")
    axes = figure.add_axes((0, 0, 1, 1), frameon=False)
    axes.set(xlim=(left, left + width), ylim=(top + height, top), xticks=[], yticks=[])
    return axes


def png_bytes(axes: Axes, scale: float) -> bytes:
    """Return the figure of ``axes`` as a PNG with ``scale`` pixels a point."""
    figure, buffer = axes.get_figure(root=True), BytesIO()
    if figure is None:  # pragma: no cover - `bare_axes` made one
        return b""
    FigureCanvasAgg(figure)
    figure.savefig(buffer, dpi=72 * scale, metadata={"Software": None})
    return buffer.getvalue()


def write(figure: Figure, stem: Path) -> list[Path]:
    """Write ``figure`` to ``stem`` + ``.png`` and ``.svg``; return both paths."""
    png, svg = (stem.with_name(stem.name + ending) for ending in (".png", ".svg"))
    FigureCanvasAgg(figure)
    figure.savefig(png, dpi=200, metadata={"Software": None})
    FigureCanvasSVG(figure)
    figure.savefig(svg, metadata={"Date": None, "Creator": None})
    return [png, svg]

"""The one module that imports matplotlib, through its object interface: no pyplot, no display, no state.

Files come out the same for the same figure: text becomes paths, identifiers have a fixed salt, and neither a
date nor a version is written into them.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Final

from supremal.errors import MissingDependencyError

try:
    from matplotlib import style
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure
except ImportError:
    package = "matplotlib"
    raise MissingDependencyError(package, extra="plot", purpose="drawing figures") from None

__all__ = ["Axes", "house_style", "new_figure", "write"]

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


def write(figure: Figure, stem: Path) -> list[Path]:
    """Write ``figure`` to ``stem`` + ``.png`` and ``.svg``; return both paths."""
    png, svg = (stem.with_name(stem.name + ending) for ending in (".png", ".svg"))
    FigureCanvasAgg(figure)
    figure.savefig(png, dpi=200, metadata={"Software": None})
    FigureCanvasSVG(figure)
    figure.savefig(svg, metadata={"Date": None, "Creator": None})
    return [png, svg]

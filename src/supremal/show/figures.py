"""Figures: the two learning curves of the paper, as files and as inline SVG.

`save_curves` writes PNG and SVG and needs matplotlib (the extra ``plot``); `curves_svg` needs nothing.  Both
draw the same `Series`, in the same style.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from supremal.show._chart import Panel, Series, beside, curves_svg, panel_of
from supremal.show._scale import number, tick_labels, ticks

if TYPE_CHECKING:
    from supremal.show._matplotlib import Axes

__all__ = ["Series", "check_figures", "curves_svg", "save_curves"]

_INK: Final = "#1b2530"
_FEW: Final = 4  # up to so many reference points show their value
_WIDE: Final = 6.0  # inches
_LEGEND: Final[dict[str, Any]] = {
    "frameon": False,
    "borderaxespad": 0.3,
    "borderpad": 0.0,
    "handlelength": 1.5,
    "handletextpad": 0.6,
    "columnspacing": 1.4,
    "labelcolor": _INK,
    "fontsize": 9.5,
}
_POINTS: Final = 0.88  # a unit of the inline chart, in points of the figure
_FAINT: Final = "#5c6773"
_GRID: Final = "#e3e7eb"
_STYLES: Final[dict[str, dict[str, Any]]] = {
    "main": {"color": "#0072b2", "linewidth": 2.2, "zorder": 3, "solid_capstyle": "round"},
    "second": {"color": "#a8743a", "linewidth": 1.6, "linestyle": (0, (1, 1.4)), "zorder": 2},
    "reference": {
        "color": _INK,
        "linestyle": "none",
        "marker": "D",
        "markersize": 7,
        "markerfacecolor": "white",
        "markeredgewidth": 1.4,
        "zorder": 4,
        "clip_on": False,
    },
}


def check_figures() -> None:
    """Raise a `MissingDependencyError` if `save_curves` could not draw; to be asked before long work."""
    import_module("supremal.show._matplotlib")


def save_curves(
    path_stem: str | PathLike[str],
    series: Sequence[Series],
    *,
    xlabel: str,
    ylabel: str,
    ylim: tuple[float, float] | None = None,
    title: str = "",
) -> list[Path]:
    """Write the chart of ``series`` to ``path_stem`` + ``.png`` and ``.svg``, and return both paths.

    The same series give the same bytes.  Folders are made where they are missing.

    Parameters
    ----------
    path_stem
        The path without its ending.
    series, xlabel, ylabel, ylim, title
        As in `curves_svg`.

    Raises
    ------
    MissingDependencyError
        If matplotlib is not installed.
    """
    from supremal.show import _matplotlib  # an extra: only who saves a figure needs it

    stem = Path(path_stem)
    stem.parent.mkdir(parents=True, exist_ok=True)
    with _matplotlib.house_style():
        figure = _matplotlib.new_figure(_WIDE, 3.8)
        axes = figure.add_subplot()
        _draw(axes, series, panel_of(series, ylim))
        axes.set_xlabel(xlabel, color=_FAINT, loc="right")
        if title:
            axes.set_ylabel(ylabel, color=_FAINT)
        _head(axes, title or ylabel, [one.label for one in series if one.label and one.points()])
        return _matplotlib.write(figure, stem)


def _draw(axes: Axes, series: Sequence[Series], panel: Panel) -> None:
    for one in series:
        _plot(axes, one)
        if one.style == "reference" and len(one.points()) <= _FEW:
            _write_values(axes, panel, one, series)
    _dress(axes, panel.x, panel.y)


def _head(axes: Axes, title: str, labels: Sequence[str]) -> None:
    """Write the title, and below it the legend."""
    columns, rows = _columns(labels)
    pad = 11 + 16 * max(rows, 1)
    axes.set_title(title, loc="left", color=_INK, fontweight="bold", fontsize=12, pad=pad)
    if rows:
        legend = axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, **_LEGEND)
        legend.set_in_layout(False)  # it must not take width from the axes


def _columns(labels: Sequence[str]) -> tuple[int, int]:
    """Return in how many columns and rows a legend of ``labels`` fits over the axes."""
    if not labels:
        return 1, 0
    wide, room = [34 + 5.0 * len(label) for label in labels], 72 * _WIDE - 46
    columns = len(labels) if sum(wide) <= room else max(1, int(room // max(wide)))
    return columns, -(-len(labels) // columns)


def _plot(axes: Axes, one: Series) -> None:
    label = one.label or None
    if one.band:
        low, high = zip(*one.band, strict=True)
        axes.fill_between(one.x, low, high, color=_STYLES[one.style]["color"], alpha=0.2, linewidth=0)
    for part in one.stretches():
        xs, ys = zip(*part, strict=True)
        style = dict(_STYLES[one.style]) | ({} if one.label else {"alpha": 0.4, "linewidth": 1.2})
        if len(part) == 1 and one.style != "reference":
            style |= {"marker": "o", "markersize": 4}
        axes.plot(xs, ys, label=label, **style)
        label = None


def _write_values(axes: Axes, panel: Panel, one: Series, series: Sequence[Series]) -> None:
    for x, y in one.points():
        dx, dy, anchor = beside(panel, x, y, series)
        axes.annotate(
            number(y),
            (x, y),
            xytext=(_POINTS * dx, -_POINTS * dy),
            textcoords="offset points",
            ha={"start": "left", "mid": "center", "end": "right"}[anchor],
            va="baseline",
            fontsize=9.5,
            color=_INK,
            zorder=5,
            annotation_clip=False,
        )


def _dress(axes: Axes, x: tuple[float, float], y: tuple[float, float]) -> None:
    """Set the ends and ticks of the axes, and take away what is not needed."""
    axes.set(xlim=x, ylim=y)
    axes.set_xticks(ticks(*x), tick_labels(ticks(*x)))
    axes.set_yticks(ticks(*y), tick_labels(ticks(*y)))
    axes.tick_params(colors=_FAINT, length=3, labelsize=10)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="y", color=_GRID, linewidth=0.9)
    axes.set_axisbelow(True)
    for side in ("top", "left", "right"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_color(_FAINT)

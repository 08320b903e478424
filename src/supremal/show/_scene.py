"""A picture as a list of marks, which are written as SVG or painted as PNG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

from supremal.show._ink import FILE, PAGE, style_sheet
from supremal.show._text import Line, as_svg, escape

Frame: TypeAlias = tuple[float, float, float, float]


class Path(NamedTuple):
    """A path in SVG's words, all of them absolute: M, L, Q, C and Z."""

    css: str
    d: str


class Circle(NamedTuple):
    """A circle."""

    css: str
    x: float
    y: float
    r: float


class Words(NamedTuple):
    """Lines of text, centred on (x, y); text of the class ``key`` starts there."""

    css: str
    x: float
    y: float
    lines: Sequence[Line]


Mark: TypeAlias = Path | Circle | Words


class Group(NamedTuple):
    """Marks that belong together; ``css`` are its classes, ``told`` is what a tooltip says of it."""

    css: str
    marks: tuple[Mark, ...]
    told: str = ""


@dataclass(frozen=True, slots=True)
class Scene:
    """A picture.

    Parameters
    ----------
    title, described
        What it is called, and what it says in words, for those who do not see it.
    frame
        What is seen of it: left, top, width and height.
    groups
        What is drawn, from the back.
    """

    title: str
    described: str
    frame: Frame
    groups: tuple[Group, ...]


def svg_of(scene: Scene, *, alone: bool = False) -> str:
    """Return a scene as the text of one ``<svg>`` element; ``alone`` in a file it has colours of its own."""
    x, y, w, h = scene.frame
    ground = f"M{x:.1f},{y:.1f} L{x + w:.1f},{y:.1f} L{x + w:.1f},{y + h:.1f} L{x:.1f},{y + h:.1f} Z"
    body = _group(Group("", (Path("ground", ground),))) if alone else ""
    body += "".join(map(_group, scene.groups))
    title = escape(scene.title)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="sm-diagram" role="img" aria-label="{title}" '
        f'viewBox="{x:.1f} {y:.1f} {w:.1f} {h:.1f}" width="{w:.0f}" height="{h:.0f}">'
        f"<title>{title}</title><desc>{escape(scene.described)}</desc>"
        f"<style>{style_sheet(FILE if alone else PAGE)}</style>{body}</svg>"
    )


def _group(group: Group) -> str:
    css = f' class="{group.css}"' if group.css else ""
    told = f"<title>{escape(group.told)}</title>" if group.told else ""
    return f"<g{css}>{told}{''.join(map(_mark, group.marks))}</g>"


def _mark(mark: Mark) -> str:
    match mark:
        case Path(css, d):
            return f'<path class="{css}" d="{d}"/>'
        case Circle(css, x, y, r):
            return f'<circle class="{css}" cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}"/>'
        case Words(css, x, y, lines):
            return as_svg(lines, x, y, css)

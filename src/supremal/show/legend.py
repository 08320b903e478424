"""The legend of a diagram: the signs that it uses, and no others."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Final

import numpy as np

from supremal.show._curves import between
from supremal.show._scene import Group, Scene, Words
from supremal.show._shapes import arrow, cross, node
from supremal.show._text import Run, width

SIGNS: Final = {
    "initial": "initial state",
    "plain": "can be forbidden",
    "free": "nobody controls it",
    "mixed": "some of its events nobody controls",
    "disabled": "disabled",
    "marked": "marked",
    "trap": "trap: nothing leads on",
    "current": "current state",
    "focus": "the state that was asked for",
    "removed": "removed",
    "open": "has edges that are not shown",
}
"""The signs, in the order of a legend, and what each means."""

_CLASSES: Final = re.compile(r'<g class="((?:edge|state)(?: [a-z]+)*)"')
_EDGES: Final = ("initial", "plain", "free", "mixed", "disabled")
_ROW: Final = 26.0
_SAMPLE: Final = 34.0  # how wide a sample is
_GAP: Final = 20.0  # between two signs
_LEAST: Final = 320.0  # as wide as a legend may always be
_AIR: Final = 10.0


def signs_of(*pictures: str) -> tuple[str, ...]:
    r"""Return the keys of `SIGNS` that the SVG of diagrams uses.

    That an edge is plain is a sign only where others are not.

    Examples
    --------
    >>> from supremal import from_text
    >>> from supremal.show.diagram import automaton_svg
    >>> signs_of(automaton_svg(from_text("uncontrollable fault \n up -fault-> down \n down -mend-> up")))
    ('initial', 'plain', 'free')
    """
    return _signs(classes for picture in pictures for classes in _CLASSES.findall(picture))


def signs_in(scene: Scene) -> tuple[str, ...]:
    """Return the keys of `SIGNS` that a scene uses."""
    return _signs(group.css for group in scene.groups if group.css.startswith(("edge", "state")))


def _signs(groups: Iterable[str]) -> tuple[str, ...]:
    found = {name for classes in groups for name in classes.split()}
    if found & {"free", "mixed"}:
        found.add("plain")
    return tuple(sign for sign in SIGNS if sign in found)


def with_legend(scene: Scene, note: str = "") -> Scene:
    """Return a scene with a legend beneath it, and a ``note`` before that.

    A picture that has no sign but the arrow at its initial state needs no legend.
    """
    signs = signs_in(scene)
    x, y, w, h = scene.frame
    left, at, groups = x + _AIR, y + h + _AIR, list[Group]()
    if note:
        groups.append(_words(note, left, at))
        w = max(w, _long(note) + 2 * _AIR)
        at += _ROW
    wide = max(w, _LEAST)
    if signs == ("initial",):
        signs = ()
    for sign in signs:
        step = _SAMPLE + 8 + _long(SIGNS[sign])
        if left > x + _AIR and left + step > x + wide - _AIR:
            left, at = x + _AIR, at + _ROW
        groups += [_sample(sign, left, at), _words(SIGNS[sign], left + _SAMPLE + 8, at)]
        w = max(w, left + step + _AIR - x)
        left += step + _GAP
    if signs:
        at += _ROW
    high = at - y - _AIR / 2 if groups else h
    return replace(scene, frame=(x, y, w, high), groups=(*scene.groups, *groups))


def _long(text: str) -> float:
    return width((Run(text),), 13.5)


def _words(text: str, x: float, y: float) -> Group:
    return Group("", (Words("key", x, y, [(Run(text),)]),))


def _sample(sign: str, x: float, y: float) -> Group:
    """Return the sign as it looks in the picture, only smaller."""
    if sign not in _EDGES:
        return Group(f"state {sign}", node((x + _SAMPLE / 2, y), 10.0, f"state {sign}"))
    curve = between(np.array([x, y]), [np.array([x + _SAMPLE / 2, y])], np.array([x + _SAMPLE, y]))
    struck = (cross(curve),) if sign == "disabled" else ()
    return Group(f"edge {sign}", (*arrow(curve), *struck))

"""The shapes of a diagram's signs: nodes, arrows, hatching, crosses, and the plates that text stands on."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin, sqrt
from typing import Final

from supremal.show._curves import Curve, head
from supremal.show._scene import Circle, Mark, Path, Words
from supremal.show._text import box

_RING: Final = 4.0  # between a node's rim and the ring of a marked state
_HATCH: Final = 7.0  # between two lines of hatching
_CROSS: Final = 5.0  # half as long as a cross is wide


def arrow(curve: Curve) -> tuple[Mark, ...]:
    """Return an edge with its head."""
    return Path("line", curve.path), Path("head", head(curve))


def cross(curve: Curve) -> Path:
    """Return the cross that strikes an edge through, at its middle."""
    x, y = curve.points[len(curve.points) // 2].tolist()
    left, right, top, bottom = x - _CROSS, x + _CROSS, y - _CROSS, y + _CROSS
    strokes = ((left, top, right, bottom), (left, bottom, right, top))
    return Path("cross", " ".join(f"M{a:.1f},{b:.1f} L{c:.1f},{d:.1f}" for a, b, c, d in strokes))


def on_plate(words: Words) -> tuple[Mark, ...]:
    """Return text on a plate that hides what runs beneath it.

    A halo around the letters would be prettier, but that of each run covers the end of the run before.
    """
    w, h = box(words.lines)
    left, right, top, bottom = words.x - w / 2, words.x + w / 2, words.y - h / 2 + 2, words.y + h / 2 - 2
    corners = ((left, top), (right, top), (right, bottom), (left, bottom))
    return Path("plate", "M" + " L".join(f"{x:.1f},{y:.1f}" for x, y in corners) + " Z"), words


def node(at: Sequence[float], radius: float, css: str) -> tuple[Mark, ...]:
    """Return the outline of a state whose group has these classes: a circle, or an octagon for a trap."""
    x, y = at
    kinds = css.split()
    outline = _octagon if "trap" in kinds else Circle
    marks: list[Mark] = [outline("node", x, y, radius)]
    if "removed" in kinds:
        marks.append(_hatching(x, y, radius))
    if "marked" in kinds:
        marks.append(outline("ring", x, y, radius - _RING))
    return tuple(marks)


def _octagon(css: str, x: float, y: float, r: float) -> Path:
    corners = [(x + r * cos(pi / 8 + k * pi / 4), y + r * sin(pi / 8 + k * pi / 4)) for k in range(8)]
    return Path(css, "M" + " L".join(f"{u:.1f},{v:.1f}" for u, v in corners) + " Z")


def _hatching(x: float, y: float, r: float) -> Path:
    """Return parallel chords of a circle, from bottom left to top right."""
    steps = []
    count = int(r / _HATCH)
    for k in range(-count, count + 1):
        far = k * _HATCH  # of the chord from the centre
        half = sqrt(max(r * r * 0.92 - far * far, 0.0))
        u, v = x + far / sqrt(2), y + far / sqrt(2)
        d = half / sqrt(2)
        steps.append(f"M{u - d:.1f},{v + d:.1f} L{u + d:.1f},{v - d:.1f}")
    return Path("hatch", " ".join(steps))

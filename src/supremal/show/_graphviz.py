r"""A drawing by Graphviz, where its program ``dot`` is installed.

What it is told is sizes, no name: nodes are circles as large as ours, and each label is a box as large as
ours.  What it answers is coordinates.  So pictures look the same whoever laid them out, and nothing that
stands in a model ever reaches the other program.

Source: Gansner, Koutsofios, North, Vo, "A technique for drawing directed graphs", IEEE Trans. Softw. Eng. 19
(1993); *Output formats*, https://graphviz.org/docs/outputs/json/, for what it answers.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from math import pi
from typing import Any, Final

import numpy as np

from supremal._arrays import Floats
from supremal.errors import ModelError
from supremal.show._curves import Curve, Drawing, Link, entry_arrow, through
from supremal.show._labels import worst

_SECONDS: Final = 5.0
_MOST: Final = 2_000  # nodes and links together
_INCH: Final = 72.0
_AIR: Final = 8.0


def graphviz(radius: Sequence[float], links: Sequence[Link]) -> Drawing:
    """Return the drawing that ``dot`` makes.

    Raises
    ------
    ModelError
        If ``dot`` is not there, takes more than five seconds, or the graph is larger than it is asked for.
    """
    if len(radius) + len(links) > _MOST:
        message = f"{len(radius):,} states and {len(links):,} edges are too many for Graphviz; draw a part"
        raise ModelError(message)
    document = _answer("\n".join(_question(radius, links)))
    high = float(document["bb"].split(",")[3])

    def points(text: str) -> Floats:
        found = np.array([pair.split(",")[-2:] for pair in text.split()], float)
        return found * (1.0, -1.0) + (0.0, high)  # its y-axis points up

    nodes = sorted(document["objects"], key=lambda node: int(node["name"]))[1:]  # the first is the start
    drawn = sorted(document["edges"], key=lambda edge: int(edge["id"]))[1:]
    where = np.vstack([points(node["pos"]) for node in nodes])
    labels = np.array([points(edge["lp"])[0] for edge in drawn]).reshape(-1, 2)
    curves = [_curve(points(edge["pos"])) for edge in drawn]
    entry = entry_arrow(where[0], radius[0], pi)
    return Drawing(where, curves, entry, labels, worst(labels, links, where, np.array(radius)))


def _question(radius: Sequence[float], links: Sequence[Link]) -> Iterator[str]:
    yield "digraph {"
    yield f'rankdir=LR; ranksep="{36 / _INCH:.3f}"; nodesep="{22 / _INCH:.3f}";'
    yield 'node [shape=circle, fixedsize=true, label=""]; edge [arrowsize=0.5];'
    yield '-1 [width="0.01", style=invis];'
    for k, r in enumerate(radius):
        yield f'{k} [width="{2 * r / _INCH:.4f}"];'
    yield "-1 -> 0 [id=-1, style=invis];"
    for k, link in enumerate(links):
        size = f'WIDTH="{link.w + _AIR:.0f}" HEIGHT="{link.h:.0f}"'
        box = f'<<TABLE BORDER="0" FIXEDSIZE="TRUE" {size}><TR><TD></TD></TR></TABLE>>'
        yield f"{link.source} -> {link.target} [id={k}, label={box}];"
    yield "}"


def _answer(question: str) -> Any:  # noqa: ANN401 - what JSON gives
    program = shutil.which("dot")
    if program is None:
        message = "Graphviz is not there: no program `dot` is found; install it, or leave the layout out"
        raise ModelError(message)
    try:
        done = subprocess.run(  # noqa: S603 - our own numbers, and no shell
            [program, "-Tjson0"], input=question, capture_output=True, text=True, timeout=_SECONDS, check=True
        )
        return json.loads(done.stdout)
    except subprocess.TimeoutExpired:
        message = f"Graphviz took more than {_SECONDS:g} seconds; leave the layout out, or draw a part"
    except (subprocess.CalledProcessError, OSError, ValueError) as error:
        message = f"Graphviz failed ({error}); leave the layout out"
    raise ModelError(message)


def _curve(points: Floats) -> Curve:
    """Return the curve of a position: the tip of the arrow, then the control points of cubic pieces."""
    tip, *rest = points
    pieces = [np.array(rest[k : k + 4]) for k in range(0, len(rest) - 1, 3)]
    end = rest[-1]
    pieces.append(np.array([end, end + (tip - end) / 3, end + 2 * (tip - end) / 3, tip]))
    return through(pieces)

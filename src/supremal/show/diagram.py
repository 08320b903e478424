"""Automata and reward machines as pictures: inline SVG that needs nothing else.

The signs are those of the textbooks.  An arrow from nowhere points at the initial state; a double ring marks
a state; a dashed edge is one that nobody controls, a dash-dotted one carries both kinds of events.  A trap
(the paper's s_a, or an unmarked state that is never left) is an octagon, the sign for "stop".

The ink is the text colour of the page.  A page may set the CSS variables ``--diagram-ink``, ``-paper``,
``-stop`` and ``-free``; without them all colours can be read on light and on dark ground.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Final

import numpy as np

from supremal._arrays import NONE, Floats
from supremal.automata.automaton import Automaton
from supremal.decisions.reward_machine import RewardMachine
from supremal.show._labels import settle
from supremal.show._layout import Curve, Link, head, place, route
from supremal.show._text import (
    Line,
    Run,
    as_svg,
    box,
    escape,
    event_label,
    guard_label,
    shorten,
    symbol,
    width,
)

MAX_STATES: Final = 60
"""Automata with more states are told in numbers, not drawn."""
_SMALL: Final = 12  # up to here a larger ring is tried where labels do not fit
_PAD: Final = 10.0

_STYLE: Final = """
.sm-diagram{--d-paper:var(--diagram-paper,Canvas);--d-stop:var(--diagram-stop,#c9561d);--d-free:var(--diagram-free,#1f82b5);
color:var(--diagram-ink,currentColor)}
.sm-diagram .node{fill:currentColor;fill-opacity:.05;stroke:currentColor;stroke-width:1.4}
.sm-diagram .ring{fill:none;stroke:currentColor;stroke-width:1.1}.sm-diagram .trap{color:var(--d-stop)}
.sm-diagram .edge path{fill:none;stroke:currentColor;stroke-width:1.4;stroke-linecap:round}
.sm-diagram .edge path.head{fill:currentColor;stroke:none}
.sm-diagram .edge.free path{stroke-dasharray:5.5 4.5}.sm-diagram .edge.mixed path{stroke-dasharray:9 4 1.5 4}
.sm-diagram .edge.stop{color:var(--d-stop)}.sm-diagram .edge.stop path{stroke-width:1.1}
.sm-diagram text{font-family:"STIX Two Text",Cambria,Georgia,"Times New Roman",serif;text-anchor:middle;
fill:currentColor}
.sm-diagram .name,.sm-diagram .label{font-size:14px;font-style:italic}.sm-diagram .sub{font-size:10px}
.sm-diagram .label{paint-order:stroke;stroke:var(--d-paper);stroke-width:5px;stroke-linejoin:round}
.sm-diagram .set{font-style:normal}.sm-diagram .label .free{fill:var(--d-free);font-weight:600}
.sm-diagram .guard,.sm-diagram .reward{font:11.2px ui-monospace,"SF Mono","DejaVu Sans Mono",monospace}
.sm-diagram .guard{fill-opacity:.78}.sm-diagram .reward{font-weight:700}
.sm-diagram .notice{font:15px system-ui,sans-serif}
"""


@dataclass(frozen=True, slots=True)
class _Node:
    name: str
    ring: bool = False
    trap: bool = False


@dataclass(frozen=True, slots=True)
class _Edge:
    source: int
    target: int
    lines: tuple[Line, ...]
    told: str
    kind: str = ""


def automaton_svg(automaton: Automaton, *, title: str = "") -> str:
    r"""Return a picture of ``automaton`` as the text of one ``<svg>`` element.

    Parameters
    ----------
    automaton
        What to draw; with more than 60 states the picture only says how large it is.
    title
        What screen readers and tooltips call it; left out: its name.

    Examples
    --------
    >>> from supremal import from_text
    >>> svg = automaton_svg(from_text("dark -on-> lit \n lit -off-> dark"), title="A lamp")
    >>> svg.startswith("<svg"), "A lamp" in svg
    (True, True)
    """
    title = title or automaton.name or "Automaton"
    if automaton.n_states > MAX_STATES:
        size = f"{automaton.n_states:,} states, {automaton.n_transitions:,} transitions"
        return _notice(title, f"{size}: too large to draw")
    if automaton.n_states == 0:
        return _notice(title, "the empty automaton: no state, no word")
    traps = _traps(automaton)
    some = bool((~automaton.marked).any())
    nodes = [
        _Node(automaton.state_name(s), some and bool(automaton.marked[s]), s in traps)
        for s in range(automaton.n_states)
    ]
    return _draw(nodes, _event_edges(automaton, traps), title)


def reward_machine_svg(machine: RewardMachine, *, title: str = "") -> str:
    """Return a picture of ``machine`` as the text of one ``<svg>`` element.

    An edge says its guard, as it was written, and its reward.  ``title`` is as in `automaton_svg`.
    """
    title = title or machine.name or "Reward machine"
    if len(machine.states) > MAX_STATES:
        size = f"{len(machine.states):,} states, {len(machine.edges):,} edges"
        return _notice(title, f"{size}: too large to draw")
    number = {name: u for u, name in enumerate(machine.states)}
    merged: dict[tuple[int, int], dict[float, list[str]]] = {}
    for edge in machine.edges:
        earned = merged.setdefault((number[edge.source], number[edge.target]), {})
        earned.setdefault(edge.reward, []).append(edge.guard)
    edges = [
        _Edge(
            u,
            v,
            tuple(line for reward, guards in earned.items() for line in guard_label(guards, reward)),
            " or ".join(f"{' | '.join(guards)}, reward {reward:g}" for reward, guards in earned.items()),
        )
        for (u, v), earned in merged.items()
    ]
    return _draw([_Node(name) for name in machine.states], edges, title)


def _traps(automaton: Automaton) -> frozenset[int]:
    """Return the states drawn as "stop": s_a, and what is unmarked and never left, if any state is marked."""
    loops = automaton.delta == np.arange(automaton.n_states)[:, None]
    stuck = ~automaton.marked & (loops | (automaton.delta == NONE)).all(axis=1) & automaton.marked.any()
    named = [automaton.state_name(s).rstrip("'") == "s_a" for s in range(automaton.n_states)]
    return frozenset(np.flatnonzero(stuck | named).tolist())


def _event_edges(automaton: Automaton, traps: frozenset[int]) -> list[_Edge]:
    """Return one edge for each source and target, with all events that lead there."""
    sigma = automaton.alphabet
    merged: dict[tuple[int, int], list[str]] = {}
    for s, e in np.argwhere(automaton.delta != NONE).tolist():
        merged.setdefault((s, int(automaton.delta[s, e])), []).append(sigma.names[e])
    edges = []
    for (s, t), events in merged.items():
        free = sum(name in sigma.uncontrollable for name in events)
        kind = "" if not free else "free" if free == len(events) else "mixed"
        if t in traps:
            kind = f"{kind} stop".strip()
        lines = event_label(events, sigma.names, sigma.uncontrollable)
        edges.append(_Edge(s, t, lines, ", ".join(events), kind))
    return edges


def _draw(nodes: Sequence[_Node], edges: Sequence[_Edge], title: str) -> str:
    radius = [_radius(node) for node in nodes]
    links = [Link(edge.source, edge.target, *box(edge.lines)) for edge in edges]
    stretches = (1.0, 1.12, 1.26, 1.42, 1.6) if len(nodes) <= _SMALL else (1.0,)
    tries = []
    for stretch in stretches:
        where = place(radius, links, stretch=stretch)
        curves, entry = route(where, radius, links)
        labels, clash = settle(where, radius, links, curves, entry)
        tries.append((round(clash), stretch, where, curves, entry, labels))
        if clash < 1:
            break
    _, _, where, curves, entry, labels = min(tries, key=lambda one: one[:2])
    parts = [_edge_svg(edge, curve) for edge, curve in zip(edges, curves, strict=True)]
    parts.append(f'<g class="edge initial">{_arrow(entry)}</g>')
    parts += [_node_svg(node, at, r) for node, at, r in zip(nodes, where.tolist(), radius, strict=True)]
    for edge, (x, y) in zip(edges, labels.tolist(), strict=True):
        label = as_svg(edge.lines, x, y, "label")
        parts.append(f"<g><title>{escape(_told(edge, nodes))}</title>{label}</g>")
    described = f"{len(nodes)} states; the initial one is {nodes[0].name}. " + "; ".join(
        _told(edge, nodes) for edge in edges
    )
    return _svg(title, described, _frame(where, radius, links, labels, [*curves, entry]), "".join(parts))


def _told(edge: _Edge, nodes: Sequence[_Node]) -> str:
    return f"{nodes[edge.source].name} \u2192 {nodes[edge.target].name}: {edge.told}"


def _radius(node: _Node) -> float:
    half = width(symbol(shorten(node.name, 9))) / 2
    return max(17.0, half + 8) + (4.0 if node.ring else 0.0)


def _arrow(curve: Curve) -> str:
    return f'<path d="{curve.path}"/><path class="head" d="{head(curve)}"/>'


def _edge_svg(edge: _Edge, curve: Curve) -> str:
    return f'<g class="{" ".join(["edge", *edge.kind.split()])}">{_arrow(curve)}</g>'


def _node_svg(node: _Node, at: Sequence[float], radius: float) -> str:
    x, y = at

    def outline(r: float, css: str) -> str:
        if not node.trap:
            return f'<circle class="{css}" cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}"/>'
        corners = [(x + r * cos(pi / 8 + k * pi / 4), y + r * sin(pi / 8 + k * pi / 4)) for k in range(8)]
        return f'<polygon class="{css}" points="{" ".join(f"{u:.1f},{v:.1f}" for u, v in corners)}"/>'

    rings = outline(radius, "node") + (outline(radius - 4, "ring") if node.ring else "")
    name = as_svg([symbol(shorten(node.name, 9))], x, y, "name")
    css = "state" + (" marked" if node.ring else "") + (" trap" if node.trap else "")
    return f'<g class="{css}"><title>{escape(node.name)}</title>{rings}{name}</g>'


def _frame(
    where: Floats, radius: Sequence[float], links: Sequence[Link], labels: Floats, curves: Sequence[Curve]
) -> tuple[float, float, float, float]:
    """Return the smallest view box around all that is drawn."""
    r = np.array(radius)[:, None]
    half = np.array([[link.w / 2, link.h / 2] for link in links]).reshape(-1, 2)
    points = [where - r, where + r, labels - half, labels + half, *(curve.points for curve in curves)]
    low, high = np.vstack(points).min(axis=0) - _PAD, np.vstack(points).max(axis=0) + _PAD
    return (*low.tolist(), *(high - low).tolist())


def _notice(title: str, text: str) -> str:
    words = as_svg([(Run(text),)], 230, 40, "notice")
    return _svg(title, text, (0, 0, 460, 80), words)


def _svg(title: str, described: str, frame: tuple[float, ...], body: str) -> str:
    x, y, w, h = frame
    style = " ".join(_STYLE.split("\n")).strip()
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="sm-diagram" role="img" aria-label="{escape(title)}" '
        f'viewBox="{x:.1f} {y:.1f} {w:.1f} {h:.1f}" width="{w:.0f}" height="{h:.0f}">'
        f"<title>{escape(title)}</title><desc>{escape(described)}</desc><style>{style}</style>{body}</svg>"
    )

"""Automata and reward machines as pictures: inline SVG that needs nothing else.

The signs are those of the textbooks.  An arrow from nowhere points at the initial state; a double ring marks
a state; a dashed edge is one that nobody controls, a dash-dotted one carries both kinds of events.  A trap
(the paper's s_a, or an unmarked state that is never left) is an octagon, the sign for "stop".  The current
state is filled, what was removed is hatched, and a disabled edge is crossed out.

The ink is the text colour of the page.  A page may set the CSS variables ``--diagram-ink``, ``-paper``,
``-stop`` and ``-free``; without them all colours can be read on light and on dark ground.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Final, TypeAlias

import numpy as np

from supremal._arrays import NONE, Bools
from supremal.automata.automaton import Automaton
from supremal.decisions.reward_machine import RewardMachine
from supremal.errors import AutomatonError
from supremal.show._curves import Drawing, Link
from supremal.show._labels import on_lines
from supremal.show._layout import Layout, arrange
from supremal.show._scene import Frame, Group, Scene, Words, svg_of
from supremal.show._shapes import arrow, cross, node, on_plate
from supremal.show._text import (
    LEADING,
    Line,
    Run,
    box,
    event_label,
    guard_label,
    in_lines,
    width,
)
from supremal.show.legend import with_legend
from supremal.show.neighbourhood import find_state, neighbourhood, numbers_of

MAX_STATES: Final = 60
"""Of automata with more states a part is drawn, or they are told in numbers."""

State: TypeAlias = int | str
_TOLD: Final = 400  # letters of what is said of an edge
_PAD: Final = 10.0


@dataclass(frozen=True, slots=True)
class _Node:
    name: str
    signs: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Edge:
    source: int
    target: int
    lines: tuple[Line, ...]
    told: str
    signs: tuple[str, ...] = ()


def automaton_svg(
    automaton: Automaton,
    *,
    title: str = "",
    layout: Layout = "auto",
    around: State | None = None,
    current: State | None = None,
    removed: Bools | Iterable[State] | None = None,
    enabled: Bools | None = None,
    legend: bool = False,
) -> str:
    r"""Return a picture of ``automaton`` as the text of one ``<svg>`` element.

    Parameters
    ----------
    automaton
        What to draw; with more than 60 states the picture only says how large it is, if not ``around``
        something.
    title
        What screen readers and tooltips call it; left out: its name.
    layout
        "circle", "layered" or "graphviz", where that is installed; "auto" chooses one of the first two, and
        gives the same picture on every machine.
    around
        A state, by its number or name: only what lies around it is drawn, as far as 60 states allow.
    current
        A state that is filled: where a run is.
    removed
        ``bool [S]``, or the states themselves: drawn hatched, and their edges light.
    enabled
        ``bool [S, E]``: edges of other events are crossed out.
    legend
        Whether it has a legend, of the signs that it uses.

    Raises
    ------
    AutomatonError
        If there is no such state, or a mask does not fit.
    ModelError
        If there is no such layout, or Graphviz fails where it is asked for.

    Notes
    -----
    Of 60 states with 120 edges in about a second of one core, with 200 edges in two.

    Examples
    --------
    >>> from supremal import from_text
    >>> svg = automaton_svg(from_text("dark -on-> lit \n lit -off-> dark"), title="A lamp", current="lit")
    >>> svg.startswith("<svg"), "A lamp" in svg
    (True, True)
    """
    return svg_of(
        automaton_scene(
            automaton, title=title, layout=layout, around=around, current=current, removed=removed,
            enabled=enabled, legend=legend,
        )
    )  # fmt: skip


def automaton_scene(
    automaton: Automaton,
    *,
    title: str = "",
    layout: Layout = "auto",
    around: State | None = None,
    current: State | None = None,
    removed: Bools | Iterable[State] | None = None,
    enabled: Bools | None = None,
    legend: bool = False,
) -> Scene:
    """Return the picture that `automaton_svg` writes, as marks."""
    title = title or automaton.name or "Automaton"
    if automaton.n_states == 0:
        return _notice(title, "the empty automaton: no state, no word")
    now = None if current is None else find_state(automaton, current)
    gone = np.isin(np.arange(automaton.n_states), numbers_of(automaton, () if removed is None else removed))
    enabled = _checked(automaton, enabled)
    if around is not None:
        near = neighbourhood(automaton, around, most=MAX_STATES)
        kept, note, opened, focus = near.states.tolist(), str(near), near.open, near.centre
    elif automaton.n_states > MAX_STATES:
        size = f"{automaton.n_states:,} states, {automaton.n_transitions:,} transitions"
        return _notice(title, f"{size}: too large to draw")
    else:
        kept, note, opened, focus = list(range(automaton.n_states)), "", np.zeros(0, np.bool_), None
    traps = _traps(automaton, kept) - set(np.flatnonzero(gone).tolist())
    some = bool((~automaton.marked).any())
    nodes = []
    for at, s in enumerate(kept):
        signs = {
            "marked": some and automaton.marked[s],
            "open": opened.size and opened[at],
            "focus": s == focus,
            "current": s == now,
            "removed": gone[s],
            "trap": s in traps,
        }
        nodes.append(_Node(automaton.state_name(s), tuple(name for name, has in signs.items() if has)))
    edges = _event_edges(automaton, kept, traps, gone, enabled)
    scene = _scene(nodes, edges, title, layout, entered=kept[0] == 0)
    return with_legend(scene, note) if legend or note else scene


def reward_machine_svg(
    machine: RewardMachine,
    *,
    title: str = "",
    layout: Layout = "auto",
    current: State | None = None,
    legend: bool = False,
) -> str:
    """Return a picture of ``machine`` as the text of one ``<svg>`` element.

    An edge says its guard, as it was written, and its reward.  The arguments are those of `automaton_svg`.
    """
    return svg_of(machine_scene(machine, title=title, layout=layout, current=current, legend=legend))


def machine_scene(
    machine: RewardMachine,
    *,
    title: str = "",
    layout: Layout = "auto",
    current: State | None = None,
    legend: bool = False,
) -> Scene:
    """Return the picture that `reward_machine_svg` writes, as marks."""
    title = title or machine.name or "Reward machine"
    if len(machine.states) > MAX_STATES:
        size = f"{len(machine.states):,} states, {len(machine.edges):,} edges"
        return _notice(title, f"{size}: too large to draw")
    number = {name: u for u, name in enumerate(machine.states)}
    now = number.get(current, current) if isinstance(current, str) else current
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
    nodes = [_Node(name, ("current",) if u == now else ()) for u, name in enumerate(machine.states)]
    scene = _scene(nodes, edges, title, layout)
    return with_legend(scene) if legend else scene


# --- what there is to draw --------------------------------------------------------------------------------


def _checked(automaton: Automaton, enabled: Bools | None) -> Bools:
    if enabled is None:
        return np.ones(automaton.delta.shape, np.bool_)
    if np.shape(enabled) != automaton.delta.shape:
        message = (
            f"automaton {automaton.name!r}: enabled has shape {np.shape(enabled)}, "
            f"{automaton.delta.shape} is needed"
        )
        raise AutomatonError(message)
    return np.asarray(enabled, np.bool_)


def _traps(automaton: Automaton, kept: Sequence[int]) -> frozenset[int]:
    """Return the states drawn as "stop": s_a, and what is unmarked and never left, if any state is marked."""
    delta = automaton.delta[kept]
    loops = delta == np.array(kept)[:, None]
    stuck = ~automaton.marked[kept] & (loops | (delta == NONE)).all(axis=1) & automaton.marked.any()
    named = [automaton.state_name(s).rstrip("'") == "s_a" for s in kept]
    return frozenset(np.array(kept)[stuck | named].tolist())


def _event_edges(
    automaton: Automaton, kept: Sequence[int], traps: frozenset[int], gone: Bools, enabled: Bools
) -> list[_Edge]:
    """Return one edge for each source, target and way of drawing, with all events that lead there."""
    sigma, place = automaton.alphabet, {s: at for at, s in enumerate(kept)}
    merged: dict[tuple[int, int, bool], list[str]] = {}
    for at, e in np.argwhere(automaton.delta[kept] != NONE).tolist():
        s = kept[at]
        t = int(automaton.delta[s, e])
        if t in place:
            merged.setdefault((s, t, bool(enabled[s, e])), []).append(sigma.names[e])
    edges = []
    for (s, t, allowed), events in merged.items():
        free = sum(name in sigma.uncontrollable for name in events)
        signs = {
            "free": free == len(events),
            "mixed": 0 < free < len(events),
            "disabled": not allowed and not gone[s],
            "gone": gone[s] or gone[t] or not allowed,
            "stop": t in traps,
        }
        lines = event_label(events, sigma.names, sigma.uncontrollable)
        told = _cut(", ".join(events)) + ("" if allowed else " (disabled)")
        edges.append(
            _Edge(place[s], place[t], lines, told, tuple(sign for sign, has in signs.items() if has))
        )
    return edges


def _cut(text: str) -> str:
    return text if len(text) <= _TOLD else f"{text[:_TOLD]}…"


# --- where it stands, and with which marks ----------------------------------------------------------------


def _scene(
    nodes: Sequence[_Node], edges: Sequence[_Edge], title: str, layout: Layout, *, entered: bool = True
) -> Scene:
    radius = [_radius(node) for node in nodes]
    links = [Link(edge.source, edge.target, *box(edge.lines)) for edge in edges]
    drawing = arrange(radius, links, layout)
    groups = []
    for edge, curve in zip(edges, drawing.curves, strict=True):
        struck = (cross(curve),) if "disabled" in edge.signs else ()
        groups.append(Group(" ".join(["edge", *edge.signs]), (*arrow(curve), *struck)))
    if entered:
        groups.append(Group("edge initial", arrow(drawing.entry)))
    for one, (x, y), r in zip(nodes, drawing.where.tolist(), radius, strict=True):
        css = " ".join(["state", *one.signs])
        name = Words("name", x, y, in_lines(one.name))
        written = on_plate(name) if "removed" in one.signs else (name,)
        groups.append(Group(css, (*node((x, y), r, css), *written), one.name))
    crossed = on_lines(drawing.labels, links, (*drawing.curves, drawing.entry))
    for edge, (x, y), on_line in zip(edges, drawing.labels.tolist(), crossed, strict=True):
        label = Words("label", x, y, edge.lines)
        css = "gone" if "gone" in edge.signs else ""
        groups.append(Group(css, on_plate(label) if on_line else (label,), _told(edge, nodes)))
    initial = f"; the initial one is {nodes[0].name}" if entered else ""
    described = f"{len(nodes)} states{initial}. " + "; ".join(_told(edge, nodes) for edge in edges)
    return Scene(title, described, _frame(drawing, radius, links), tuple(groups))


def _told(edge: _Edge, nodes: Sequence[_Node]) -> str:
    return f"{nodes[edge.source].name} \u2192 {nodes[edge.target].name}: {edge.told}"


def _radius(one: _Node) -> float:
    lines = in_lines(one.name)
    half = hypot(max(map(width, lines)) / 2, LEADING * (len(lines) - 1) / 2)
    return max(17.0, half + 8) + (4.0 if "marked" in one.signs else 0.0)


def _frame(drawing: Drawing, radius: Sequence[float], links: Sequence[Link]) -> Frame:
    """Return the smallest frame around all that is drawn."""
    r = np.array(radius)[:, None]
    half = np.array([[link.w / 2, link.h / 2] for link in links]).reshape(-1, 2)
    where, labels, curves = drawing.where, drawing.labels, (*drawing.curves, drawing.entry)
    points = [where - r, where + r, labels - half, labels + half, *(curve.points for curve in curves)]
    low, high = np.vstack(points).min(axis=0) - _PAD, np.vstack(points).max(axis=0) + _PAD
    return float(low[0]), float(low[1]), float(high[0] - low[0]), float(high[1] - low[1])


def _notice(title: str, text: str) -> Scene:
    words = Words("notice", 230, 40, [(Run(text),)])
    return Scene(title, text, (0, 0, 460, 80), (Group("", (words,)),))

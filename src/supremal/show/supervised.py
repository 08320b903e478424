"""A supervisor as a picture: what stays, and what it takes away.

Without the plant the picture is that of the supervised behaviour.  With it, the plant's transitions that the
supervisor disables are drawn too, crossed out.  Where each state of the plant belongs to one state of the
supervisor, the picture is the plant itself, with what was removed hatched; where the supervisor has to
remember more than the plant, an edge that is disabled ends in a hatched state that says where the plant would
then be, and the plant is not followed further.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools
from supremal.automata.automaton import Automaton
from supremal.automata.explore import as_parts
from supremal.errors import ModelError
from supremal.show._layout import Layout
from supremal.show._scene import Scene, svg_of
from supremal.show.diagram import MAX_STATES, State, automaton_scene
from supremal.synthesis.supervisor import Supervisor

_FOLLOWED: Final = 2_000


def supervisor_svg(
    supervisor: Supervisor,
    plant: Automaton | Sequence[Automaton] | None = None,
    *,
    title: str = "",
    layout: Layout = "auto",
    around: State | None = None,
    current: State | None = None,
    legend: bool = False,
) -> str:
    r"""Return a picture of ``supervisor`` as the text of one ``<svg>`` element.

    Parameters
    ----------
    supervisor
        What to draw.
    plant
        What it was synthesized for; left out, or for a supervisor of more than 2,000 states: what it disables
        is not drawn.
    title, layout, around, current, legend
        As in `automaton_svg`; states are those of the supervisor.

    Raises
    ------
    ModelError
        If the supervisor was synthesized for another number of plants, or for others.

    Examples
    --------
    >>> from supremal import from_text, synthesize
    >>> plant = from_text("idle -start-> busy \n busy -stop-> idle \n busy -push-> hot \n hot -stop-> idle")
    >>> rule = from_text("events push \n cool -start, stop-> cool")
    >>> "busy → hot: push (disabled)" in supervisor_svg(synthesize(plant, rule), plant)
    True
    """
    scene = supervisor_scene(
        supervisor, plant, title=title, layout=layout, around=around, current=current, legend=legend
    )
    return svg_of(scene)


def supervisor_scene(
    supervisor: Supervisor,
    plant: Automaton | Sequence[Automaton] | None = None,
    *,
    title: str = "",
    layout: Layout = "auto",
    around: State | None = None,
    current: State | None = None,
    legend: bool = False,
) -> Scene:
    """Return the picture that `supervisor_svg` writes, as marks."""
    whole, removed, enabled = supervisor.automaton, None, None
    if plant is not None and 0 < whole.n_states <= _FOLLOWED:
        whole, removed, enabled = with_removed(supervisor, as_parts(plant))
    return automaton_scene(
        whole, title=title or "Supervisor", layout=layout, around=around, current=current,
        removed=removed, enabled=enabled, legend=legend,
    )  # fmt: skip


def with_removed(supervisor: Supervisor, plants: Sequence[Automaton]) -> tuple[Automaton, Bools, Bools]:
    """Return the supervised behaviour with what the supervisor takes away put back beside it.

    Returns
    -------
    automaton
        The states of the supervisor, then those that were removed; their names are the plants'.
    removed
        ``bool [S]``.
    enabled
        ``bool [S, E]``: whether a transition is one of the supervised behaviour, or leaves a removed state.
    """
    kept = supervisor.automaton
    _check(supervisor, plants)
    rows = [tuple(row) for row in supervisor.plant_state.tolist()]
    unique = len(set(rows)) == len(rows)
    number = {row: s for s, row in enumerate(rows)} if unique else {}
    followed = list(rows)
    delta = [kept.delta[s].copy() for s in range(kept.n_states)]
    for s, row in enumerate(followed):  # grows while it is gone through
        if s >= kept.n_states:
            delta.append(np.full(len(kept.alphabet), NONE, np.int32))
            if not unique or len(followed) > MAX_STATES:
                continue
        for e, name in enumerate(kept.alphabet):
            target = _step(plants, row, name)
            if delta[s][e] == NONE and target is not None:
                if target not in number:
                    number[target] = len(followed)
                    followed.append(target)
                delta[s][e] = number[target]
    table = np.array(delta)
    removed = np.arange(len(followed)) >= kept.n_states
    enabled = np.ones(table.shape, np.bool_)
    enabled[: kept.n_states] = kept.delta != NONE
    marked = np.array([all(p.marked[q] for p, q in zip(plants, row, strict=True)) for row in followed])
    marked[: kept.n_states] = kept.marked
    names = tuple(_name(kept, plants, s, row, unique=unique) for s, row in enumerate(followed))
    return Automaton(kept.alphabet, table, marked, state_names=names, name=kept.name), removed, enabled


def _check(supervisor: Supervisor, plants: Sequence[Automaton]) -> None:
    columns = supervisor.plant_state.shape[1]
    if len(plants) != columns:
        message = f"this supervisor was synthesized for {columns} plants, and {len(plants)} are given"
        raise ModelError(message)
    for k, plant in enumerate(plants):
        last = int(supervisor.plant_state[:, k].max())
        if last >= plant.n_states or not set(plant.alphabet) <= set(supervisor.automaton.alphabet):
            message = (
                f"plant {plant.name or k + 1} has {plant.n_states} states and the events "
                f"{', '.join(plant.alphabet)}; it is not the one that this supervisor was synthesized for"
            )
            raise ModelError(message)


def _step(plants: Sequence[Automaton], row: tuple[int, ...], event: str) -> tuple[int, ...] | None:
    """Return where the plants go by ``event``, None where they cannot."""
    target = tuple(
        plant.run([event], q) if event in plant.alphabet else q for plant, q in zip(plants, row, strict=True)
    )
    return None if NONE in target else target


def _name(kept: Automaton, plants: Sequence[Automaton], s: int, row: tuple[int, ...], *, unique: bool) -> str:
    """Return what state ``s`` is called: after the plants' states, if that tells it from all others."""
    if s < kept.n_states and (kept.state_names or not unique):
        return kept.state_name(s)
    return ", ".join(plant.state_name(q) for plant, q in zip(plants, row, strict=True))

"""A controller as plain numbers: what the generated programs have in common.

The states of all components are numbered through, and the transitions out of state q, in the order of the
events, are entries ``row[q]`` to ``row[q + 1] - 1`` of ``event`` and ``target``.  A component that does not
know an event has no say in it.  So a step takes time linear in the transitions out of the current states, and
the tables take no room for what is not possible.

The tests are one run: event number E stands for going back to the start.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from supremal._arrays import NONE
from supremal.deploy.controller import Controller


class Tables(NamedTuple):
    """C components of S states and T transitions in all, over E events.

    Parameters
    ----------
    first
        ``[C]``: the initial state of each.
    row
        ``[S + 1]``.
    event, target
        ``[T]``.
    marked
        ``[S]``: 1 or 0.
    knows
        ``[C, E]``: 1 or 0, the events of one component after those of another.
    """

    first: list[int]
    row: list[int]
    event: list[int]
    target: list[int]
    marked: list[int]
    knows: list[int]


class Run(NamedTuple):
    """The N events of all tests, one after another.

    Parameters
    ----------
    event
        ``[N]``: an event, or E for going back to the start.
    ok, marked
        ``[N]``: 1 or 0, whether it is allowed, and whether the state after it is marked.
    row, enabled
        ``[N + 1]``, and the events that are enabled after event k: entries ``row[k]`` to ``row[k + 1] - 1``.
    """

    event: list[int]
    ok: list[int]
    marked: list[int]
    row: list[int]
    enabled: list[int]


def tables_of(controller: Controller) -> Tables:
    r"""Return the tables of ``controller``.

    Examples
    --------
    >>> from supremal import from_text
    >>> from supremal.deploy.build import make_controller
    >>> tables_of(make_controller([from_text("shut -open-> ajar \n ajar -close-> shut")], []))[:4]
    ([0], [0, 1, 2], [0, 1], [1, 0])
    """
    tables = Tables([], [0], [], [], [], [])
    for component in controller.components:
        automaton, begin = component.supervisor.automaton, len(tables.marked)
        order = [
            automaton.alphabet.index(e) if e in automaton.alphabet else NONE for e in controller.alphabet
        ]
        delta = np.pad(automaton.delta, ((0, 0), (0, 1)), constant_values=NONE)[:, order]
        states, events = np.nonzero(delta != NONE)
        counts = np.bincount(states, minlength=automaton.n_states).tolist()
        tables.first.append(begin)
        tables.row.extend(list(accumulate(counts, initial=tables.row[-1]))[1:])
        tables.event.extend(events.tolist())
        tables.target.extend((delta[states, events] + begin).tolist())
        tables.marked.extend(automaton.marked.astype(int).tolist())
        tables.knows.extend(int(e != NONE) for e in order)
    return tables


def run_of(controller: Controller) -> Run:
    """Return the tests of ``controller`` as one run."""
    numbers = {event: e for e, event in enumerate(controller.alphabet)}
    run = Run([], [], [], [0], [])
    for vector in controller.vectors:
        for k, (enabled, marked) in enumerate(zip(vector.enabled, vector.marked, strict=True)):
            run.event.append(numbers[vector.word[k - 1]] if k else len(numbers))
            run.ok.append(int(vector.ok or k < len(vector.word)))
            run.marked.append(int(marked))
            run.enabled.extend(numbers[event] for event in enabled)
            run.row.append(len(run.enabled))
    return run


def wrapped(entries: Iterable[object], width: int = 100) -> list[str]:
    """Return ``entries``, with commas between them, in lines of ``width`` characters.

    Examples
    --------
    >>> wrapped([10, 20, 30], width=8)
    ['10, 20,', '30']
    """
    lines, line = [], ""
    for entry in entries:
        if line and len(line) + len(str(entry)) + 2 > width:
            lines.append(line + ",")
            line = ""
        line += f"{', ' if line else ''}{entry}"
    return [*lines, line]

"""The table that a finite environment of Gymnasium carries along.

``P[s][a]`` lists what action a in state s can lead to, (probability, next state, reward, terminated);
``initial_state_distrib`` says where episodes start.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from operator import index
from typing import Any, Final, NamedTuple, NoReturn

import numpy as np

from supremal._arrays import Bools, Floats, Longs
from supremal.errors import MDPError

TOLERANCE: Final = 1e-6
"""How far a sum of probabilities may be from 1: tables may hold rounded thirds."""


class Steps(NamedTuple):
    """The entries of a table that have a positive probability, by state and action; each ``[N]``."""

    state: Longs
    action: Longs
    prob: Floats
    next_state: Longs
    reward: Floats
    over: Bools

    def where(self, mask: Bools) -> Steps:
        """Return the entries of a mask ``bool [N]``."""
        return Steps(*(column[mask] for column in self))  # type: ignore[arg-type] # each keeps its type


def read_table(core: Any) -> tuple[Steps, Floats]:  # noqa: ANN401 - somebody's environment
    """Return the table of an environment without wrappers, and its initial distribution ``[S]``.

    Raises
    ------
    MDPError
        If it has none, hides a part of its state, or the table is not as Gymnasium's are.
    """
    kind = type(core).__name__
    if not (hasattr(core, "P") and hasattr(core, "initial_state_distrib")):
        message = (
            f"{kind} is no finite model: a table P[state][action] and initial_state_distrib are needed, as "
            "FrozenLake, CliffWalking and Taxi have them, or a method model(); else use from_outcomes"
        )
        raise MDPError(message)
    if getattr(core, "fickle_passenger", False):
        message = (
            f"{kind} with fickle_passenger=True: whether the passenger will change the destination is drawn "
            "at the start and kept out of the state, so that its table is not the whole model; leave it out"
        )
        raise MDPError(message)
    steps = _steps(core.P)
    return steps, _initial(core.initial_state_distrib, steps)


def _steps(table: Any) -> Steps:  # noqa: ANN401 - somebody's table
    rows = []
    where = "P"
    try:
        for s, choices in _items(table):
            for a, entries in _items(choices):
                where = f"P[{s}][{a}]"
                for prob, to, reward, over in entries:
                    rows.append((index(s), index(a), float(prob), index(to), float(reward), bool(over)))
    except (TypeError, ValueError):
        _fail(where)
    if not rows:
        _fail("P")
    steps = Steps(*(np.array(column) for column in zip(*sorted(rows), strict=True)))
    sound = (steps.prob >= 0) & (steps.prob <= 1 + TOLERANCE) & np.isfinite(steps.reward)
    sound &= (steps.state >= 0) & (steps.action >= 0) & (steps.next_state >= 0)
    if not sound.all():
        k = int(sound.argmin())
        _fail(f"P[{steps.state[k]}][{steps.action[k]}]")
    return steps.where(steps.prob > 0)


def _items(table: Any) -> Iterable[tuple[Any, Any]]:  # noqa: ANN401 - a mapping or a list
    return table.items() if isinstance(table, Mapping) else enumerate(table)


def _fail(where: str) -> NoReturn:
    message = (
        f"{where} is not as in Gymnasium's toy texts: P[state][action] lists (probability, next state, "
        "reward, terminated), with numbers of states and actions from 0"
    )
    raise MDPError(message)


def _initial(distribution: Any, steps: Steps) -> Floats:  # noqa: ANN401 - somebody's array
    try:
        start: Floats = np.array(distribution, np.float64).reshape(-1)
    except (TypeError, ValueError):
        message = f"initial_state_distrib is {distribution!r}; a probability for each state is needed"
        raise MDPError(message) from None
    known = 1 + int(max(steps.state.max(), steps.next_state.max()))
    if len(start) < known:
        message = f"initial_state_distrib has {len(start)} entries; P has {known} states"
        raise MDPError(message)
    if not (abs(start.sum() - 1) <= TOLERANCE and start.min() >= 0):
        message = f"initial_state_distrib sums to {start.sum():g}; probabilities that sum to 1 are needed"
        raise MDPError(message)
    start /= start.sum()
    return start

"""Reward machines: what a history of states is worth.

R = ⟨U, u0, δu, δr⟩ over propositions P reads the label L(s') after each epoch and moves from u to
δu(u, L(s')); the reward of the epoch is δr(u, L(s')), that of the edge whose guard is true.  Where no guard
of u is true the machine stays, with the reward of its self-loop (0 if it has none).

Source: Toro Icarte, Klassen, Valenzano, McIlraith, "Using reward machines for high-level task specification
and decomposition in reinforcement learning", ICML 2018; section II of the paper.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from supremal._arrays import NONE, Floats, Ints, frozen
from supremal.decisions.guards import check_propositions, truth_table
from supremal.errors import RuleError, suggest

_MAX_CELLS: Final = 1 << 26  # of one table: half a gibibyte of rewards
_MAX_WORK: Final = 1 << 34  # letters of guards times labels: some seconds


class Edge(NamedTuple):
    """One edge of a reward machine."""

    source: str
    guard: str
    target: str
    reward: float


@dataclass(frozen=True, slots=True, eq=False)
class RewardMachine:
    """A reward machine with U states over n propositions.

    Make one with `reward_machine`, which checks the edges.

    Parameters
    ----------
    states
        The U names; state 0 is initial.
    propositions
        The n names; bit i of a label is proposition i.
    edges
        What it was made from.
    delta
        ``int32 [U, 2 ** n]``: the next state for each label.
    reward
        ``float64 [U, 2 ** n]``: the reward of that step.
    name
        What messages and pictures call it.
    """

    states: tuple[str, ...]
    propositions: tuple[str, ...]
    edges: tuple[Edge, ...]
    delta: Ints
    reward: Floats
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "delta", frozen(self.delta, np.int32, 2))
        object.__setattr__(self, "reward", frozen(self.reward, np.float64, 2))

    def step(self, state: int, true: Iterable[str]) -> tuple[int, float]:
        """Return the next state and the reward when the propositions ``true`` hold."""
        label = sum(1 << self.propositions.index(name) for name in set(true) if name in self.propositions)
        return int(self.delta[state, label]), float(self.reward[state, label])

    def __repr__(self) -> str:
        called = f" {self.name!r}" if self.name else ""
        return f"<RewardMachine{called}: {len(self.states)} states, {len(self.edges)} edges>"


def reward_machine(
    propositions: Sequence[str],
    edges: Iterable[Edge | tuple[str, str, str, float]],
    *,
    initial: str | None = None,
    name: str = "",
) -> RewardMachine:
    """Return the reward machine with these ``edges``, each (from, guard, to, reward).

    Parameters
    ----------
    propositions
        The names that guards may use.
    edges
        See `supremal.decisions.guards` for the grammar of a guard.
    initial
        The initial state; left out: the first one named.
    name
        What to call it.

    Raises
    ------
    FormatError
        If a guard does not parse; gives its column.
    RuleError
        If two guards out of one state can both be true and lead apart or earn different rewards, a state
        with loops of different rewards has a case that no guard covers, or the tables would be too large.

    Examples
    --------
    >>> coffee = reward_machine(["c", "o"], [
    ...     ("start", "c", "carrying", 0.0),
    ...     ("carrying", "o", "done", 1.0),
    ... ])
    >>> coffee.step(1, {"o"})
    (2, 1.0)
    """
    listed = [Edge(*edge) for edge in edges]
    names = dict.fromkeys([initial] if initial is not None else [])
    for edge in listed:
        names.update({edge.source: None, edge.target: None})
    if not names:
        message = f"reward machine {name!r} has no state; give it an edge"
        raise RuleError(message)
    states = tuple(names)
    if initial is not None and listed and initial not in {s for e in listed for s in (e.source, e.target)}:
        message = (
            f"reward machine {name!r}: initial state {initial!r} has no edge; {suggest(initial, states[1:])}"
        )
        raise RuleError(message)
    number = {state: u for u, state in enumerate(states)}
    check_size(name, len(states), [edge.guard for edge in listed], propositions)
    size = 1 << len(propositions)
    delta = np.repeat(np.arange(len(states), dtype=np.int32)[:, None], size, axis=1)
    reward = np.zeros((len(states), size))
    taken = np.full((len(states), size), NONE, np.int32)  # which edge claims a label
    loops: dict[int, set[float]] = {}
    for k, edge in enumerate(listed):
        path = f"guard of {edge.source} → {edge.target}"
        true = truth_table(edge.guard, propositions, path=path)
        u, v = number[edge.source], number[edge.target]
        if not np.isfinite(edge.reward):
            message = f"reward machine {name!r}: {path} has reward {edge.reward}; a finite number is needed"
            raise RuleError(message)
        clash = np.flatnonzero(true & (taken[u] != NONE) & ((delta[u] != v) | (reward[u] != edge.reward)))
        if clash.size:
            _fail_both(name, listed[taken[u, clash[0]]], edge, _true_in(int(clash[0]), propositions))
        delta[u, true], reward[u, true], taken[u, true] = v, edge.reward, k
        if u == v:
            loops.setdefault(u, set()).add(edge.reward)
    for u, earned in loops.items():
        idle = np.flatnonzero(taken[u] == NONE)
        if idle.size and len(earned) > 1:
            message = (
                f"reward machine {name!r}: no guard of {states[u]} is true for "
                f"{_true_in(int(idle[0]), propositions)}, and its loops have different rewards "
                f"({', '.join(f'{r:g}' for r in sorted(earned))}); give that case an edge of its own"
            )
            raise RuleError(message)
        reward[u, idle] = min(earned)
    return RewardMachine(states, tuple(propositions), tuple(listed), delta, reward, name)


def check_size(name: str, states: int, guards: Iterable[str], propositions: Sequence[str]) -> None:
    """Raise a `RuleError` if the tables of a machine would not fit, or take long to fill."""
    check_propositions(propositions)
    letters = sum(map(len, guards))
    if states << len(propositions) > _MAX_CELLS or letters << len(propositions) > _MAX_WORK:
        message = (
            f"reward machine {name!r}: {states:,} states and guards of {letters:,} letters are too many for "
            f"{len(propositions)} propositions; use fewer of them"
        )
        raise RuleError(message)


def none_of(guards: Iterable[str], propositions: Sequence[str]) -> str | None:
    """Return a formula that is true where none of ``guards`` is, None where one of them is always true.

    Examples
    --------
    >>> none_of(["a", "b & !a"], ["a", "b"])
    '!(a) & !(b & !a)'
    >>> none_of(["a", "!a"], ["a", "b"]) is None
    True
    """
    texts = list(dict.fromkeys(guards))
    covered = np.zeros(1 << len(propositions), np.bool_)
    for text in texts:
        covered |= truth_table(text, propositions)
    return None if covered.all() else " & ".join(f"!({text})" for text in texts) or "true"


def _true_in(label: int, propositions: Sequence[str]) -> str:
    """Return the propositions that are true in ``label``, as messages say them."""
    return "{" + ", ".join(p for i, p in enumerate(propositions) if label >> i & 1) + "}"


def _fail_both(name: str, one: Edge, two: Edge, true: str) -> None:
    goals = [f"to {edge.target}" for edge in (one, two)]
    if one.target == two.target:
        goals = [f"{goal}, reward {edge.reward:g}" for goal, edge in zip(goals, (one, two), strict=True)]
    message = (
        f"reward machine {name!r}: in state {one.source} both guards {one.guard!r} ({goals[0]}) and "
        f"{two.guard!r} ({goals[1]}) are true for {true}; make them exclude each other"
    )
    raise RuleError(message)

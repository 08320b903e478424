"""Reward machines: what a history of states is worth.

R = ⟨U, u0, δu, δr⟩ over propositions P reads the label L(s') after each epoch and moves from u to
δu(u, L(s')); the reward of the epoch is that of the edge (u, u').  Where no guard of u is true the machine
stays, with the reward of its self-loop (0 if it has none).

Source: Toro Icarte, Klassen, Valenzano, McIlraith, "Using reward machines for high-level task specification
and decomposition in reinforcement learning", ICML 2018; section II of the paper.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from supremal._arrays import Floats, Ints, frozen
from supremal.decisions.guards import check_propositions, truth_table
from supremal.errors import RuleError, suggest


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
        ``float64 [U, U]``: the reward of each edge, 0 where there is none.
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
        after = int(self.delta[state, label])
        return after, float(self.reward[state, after])

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
        If two guards out of one state can both be true and lead apart, or two edges between the same two
        states have different rewards.

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
    check_propositions(propositions)
    size = 1 << len(propositions)
    delta = np.repeat(np.arange(len(states), dtype=np.int32)[:, None], size, axis=1)
    taken = np.full((len(states), size), -1, np.int32)  # which edge claims a label
    reward = np.full((len(states), len(states)), np.nan)
    for k, edge in enumerate(listed):
        path = f"guard of {edge.source} → {edge.target}"
        true = truth_table(edge.guard, propositions, path=path)
        u, v = number[edge.source], number[edge.target]
        clash = np.flatnonzero(true & (taken[u] >= 0) & (delta[u] != v))
        if clash.size:
            _fail_both(name, listed[taken[u, clash[0]]], edge, propositions, int(clash[0]))
        if not np.isfinite(edge.reward):
            message = f"reward machine {name!r}: {path} has reward {edge.reward}; a finite number is needed"
            raise RuleError(message)
        if not np.isnan(reward[u, v]) and reward[u, v] != edge.reward:
            message = (
                f"reward machine {name!r}: two edges {edge.source} → {edge.target} have rewards "
                f"{reward[u, v]:g} and {edge.reward:g}; give both the same, or add a state"
            )
            raise RuleError(message)
        delta[u, true], taken[u, true], reward[u, v] = v, k, edge.reward
    return RewardMachine(states, tuple(propositions), tuple(listed), delta, np.nan_to_num(reward), name)


def _fail_both(name: str, one: Edge, two: Edge, propositions: Sequence[str], label: int) -> None:
    true = [p for i, p in enumerate(propositions) if label >> i & 1]
    message = (
        f"reward machine {name!r}: in state {one.source} both guards {one.guard!r} (to {one.target}) and "
        f"{two.guard!r} (to {two.target}) are true for {{{', '.join(true)}}}; make them exclude each other"
    )
    raise RuleError(message)

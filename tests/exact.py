"""Decision processes by their definitions, in exact fractions: every policy is tried.

All numbers of a `small_process` are dyadic, so that doubles hold them exactly, and what is proved of the
fractions is proved of the process that the solvers see.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product
from math import inf
from typing import TypeAlias

import numpy as np

from supremal import Alphabet, Outcome, TabularMDP, from_outcomes

Number: TypeAlias = Fraction | float
Step: TypeAlias = tuple[Fraction, int, Fraction]  # probability, next state, reward
Policy: TypeAlias = tuple[int, ...]
SIGMA = Alphabet(("a", "b"))


def small_process(seed: int, *, states: int = 4, rewards: Sequence[int] = (-2, -1, 0)) -> TabularMDP:
    """Return a process of a few states with probabilities in eighths; some states end."""
    rng = np.random.default_rng(seed)
    ends = [s for s in range(1, states) if rng.random() < 0.25] or [states - 1]
    lines = []
    for s in range(states):
        for action in SIGMA:
            if s in ends or (action == "b" and rng.random() < 0.25):
                continue
            parts = rng.multinomial(8, rng.dirichlet(np.ones(states) * 0.5))
            lines += [
                Outcome(s, action, t, part / 8, (action,), float(rng.choice(rewards)))
                for t, part in enumerate(parts.tolist())
                if part
            ]
    return from_outcomes(lines, alphabet=SIGMA, actions=("a", "b"), terminal=ends)


def steps(mdp: TabularMDP, s: int, a: int) -> list[Step]:
    """The outcomes of an action; none where the episode has ended."""
    at = mdp.outcomes(s, a)
    return [
        (Fraction(mdp.prob[o]), int(mdp.next_state[o]), Fraction(mdp.reward[o]))
        for o in range(at.start, at.stop)
    ]


def policies(mdp: TabularMDP, enabled: np.ndarray | None = None) -> Iterator[Policy]:
    """Every policy that picks one action a state, -1 where there is none."""
    mask = mdp.feasible if enabled is None else enabled
    yield from product(*([-1] if not row.any() else np.flatnonzero(row).tolist() for row in mask))


def chain(mdp: TabularMDP, policy: Policy) -> list[list[Step]]:
    """The outcomes out of each state under a policy."""
    return [[] if a < 0 else steps(mdp, s, a) for s, a in enumerate(policy)]


def leads(moves: list[list[Step]], s: int) -> set[int]:
    """The states that a path leads to from s, itself too."""
    found, todo = {s}, [s]
    while todo:
        for _, t, _ in moves[todo.pop()]:
            if t not in found:
                found.add(t)
                todo.append(t)
    return found


def solve(matrix: list[list[Fraction]], right: list[Fraction]) -> list[Fraction]:
    """Gauss and Jordan, in fractions."""
    n = len(right)
    rows = [[*row, b] for row, b in zip(matrix, right, strict=True)]
    for i in range(n):
        pivot = next(j for j in range(i, n) if rows[j][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for j in range(n):
            if j != i:
                rows[j] = [x - rows[j][i] * y for x, y in zip(rows[j], rows[i], strict=True)]
    return [row[n] for row in rows]


def fixpoint(
    moves: list[list[Step]], free: set[int], gamma: Fraction, known: Sequence[Number]
) -> list[Number]:
    """The v with v = r + γ P v in the ``free`` states and ``known`` elsewhere."""
    order = sorted(free)
    matrix = [
        [Fraction(s == t) - gamma * sum(p for p, u, _ in moves[s] if u == t) for t in order] for s in order
    ]
    right = [
        sum((p * r + (gamma * p * known[t] if t not in free else 0) for p, t, r in moves[s]), Fraction(0))
        for s in order
    ]
    value = list(known)
    for s, x in zip(order, solve(matrix, right), strict=True):
        value[s] = x
    return value


def discounted(mdp: TabularMDP, policy: Policy, gamma: Fraction) -> list[Number]:
    """What a policy is worth from each state."""
    moves = chain(mdp, policy)
    return fixpoint(moves, {s for s in range(mdp.n_states) if moves[s]}, gamma, [Fraction(0)] * mdp.n_states)


def reaching(mdp: TabularMDP, policy: Policy, target: set[int]) -> list[Number]:
    """The probability that a policy ever reaches ``target``."""
    moves = [[(p, t, Fraction(0)) for p, t, _ in out] for out in chain(mdp, policy)]
    free = {s for s in range(mdp.n_states) if s not in target and leads(moves, s) & target}
    return fixpoint(moves, free, Fraction(1), [Fraction(s in target) for s in range(mdp.n_states)])


def total(mdp: TabularMDP, policy: Policy) -> list[Number] | None:
    """The expected total of a policy from each state, ±∞ too; None where gains and losses cancel for ever."""
    moves = chain(mdp, policy)
    worth: dict[int, Number] = {}
    for s in range(mdp.n_states):
        inside = leads(moves, s)
        if moves[s] and all(s in leads(moves, t) for t in inside):  # s is recurrent
            earned = mean(moves, sorted(inside))
            if earned:
                worth[s] = inf if earned > 0 else -inf
            elif any(r for t in inside for _, _, r in moves[t]):
                return None
            else:
                worth[s] = Fraction(0)
    value: list[Number] = [worth.get(s, Fraction(0)) for s in range(mdp.n_states)]
    free = set()
    for s in range(mdp.n_states):
        if moves[s] and s not in worth:
            found = {worth[t] for t in leads(moves, s) if t in worth} & {inf, -inf}
            if len(found) > 1:
                return None
            value[s] = found.pop() if found else value[s]
            if value[s] == 0:
                free.add(s)
    return fixpoint(moves, free, Fraction(1), value)


def mean(moves: list[list[Step]], states: list[int]) -> Fraction:
    """The mean reward in a recurrent class: x P = x, Σ x = 1, then Σ x r."""
    n = len(states)
    rows = [[Fraction(1)] * n] + [
        [sum((p for p, u, _ in moves[s] if u == t), Fraction(0)) - (s == t) for s in states]
        for t in states[1:]
    ]
    share = solve(rows, [Fraction(1)] + [Fraction(0)] * (n - 1))
    return sum((x * p * r for x, s in zip(share, states, strict=True) for p, _, r in moves[s]), Fraction(0))


def best(values: Sequence[Sequence[Number]]) -> list[Number]:
    """The largest number for each state."""
    return [max(column) for column in zip(*values, strict=True)]


def least(values: Sequence[Sequence[Number]]) -> list[Number]:
    """The least number for each state."""
    return [min(column) for column in zip(*values, strict=True)]


def encloses(lower: np.ndarray, exact: Sequence[Number], upper: np.ndarray) -> bool:
    """Tell whether every exact number lies between its bounds, with no allowance."""
    return all(
        low <= float(x) <= high if abs(x) == inf else Fraction(low) <= x <= Fraction(high)
        for low, x, high in zip(lower.tolist(), exact, upper.tolist(), strict=True)
    )

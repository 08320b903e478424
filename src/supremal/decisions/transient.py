"""The best expected total of a process that ends: stochastic shortest paths.

Every undiscounted question becomes the same one.  States that are as good as each other, or already solved,
are put together, and what is left is a process with one end, state 0, in which a policy either ends with
probability 1 or is worth -∞.  There policy iteration from a policy that ends stays among such policies
and finds the best.

The *bound* rests on a weight w ≥ 1 + P w for every choice that is nearly the best.  If a sweep moves no value
by more than δ, then v + δ w lies above what any choice makes of it, and v - δ w below what the policy makes
of it; so the optimum lies in between.  A choice that is worse than the best by more than δ w need not be
looked at.  The largest expected number of steps over those nearly best choices is such a w.

Source: Bertsekas, Tsitsiklis, "An analysis of stochastic shortest path problems", Math. Oper. Res. 16 (1991);
Haddad, Monmege, "Interval iteration algorithm for MDPs and IMDPs", TCS 735 (2018), for why end components
have to be collapsed first.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal._graph import coreachable_to
from supremal.decisions import _planning_kernels as kernels
from supremal.decisions.chains import Chain, largest, rounding
from supremal.decisions.planning import Choices, Discounted, iterate
from supremal.errors import ConvergenceError

END: Final = 0
"""The state of a quotient in which all that is solved is put together."""

_NO_STOPS: Final = np.empty(0, np.int32)
_ROUNDS: Final = 20
_TRUSTED: Final = 0.5


class ImproperError(Exception):
    """A policy that never ends is worth as much as one that does, or more.

    ``choices`` are those that it takes for ever; ``even`` tells whether it is as much, up to rounding.
    """

    def __init__(self, choices: Ints | Longs, *, even: bool = False) -> None:
        self.choices, self.even = choices, even
        super().__init__("a policy never ends")


def quotient(choices: Choices, group: Ints, kept: Bools, worth: Floats, stops: Ints = _NO_STOPS) -> Choices:
    """Return the process whose states are groups of states.

    Parameters
    ----------
    choices
        A process.
    group
        ``int32 [S]``: the new number of each state, `END` where it is solved.
    kept
        ``bool [C]``: the choices that are kept; each becomes one of its state's group, and ``action`` of the
        result is what it was.
    worth
        ``float64 [S]``: what each state in `END` is worth; an outcome that leads there earns it.
    stops
        Groups with one more choice: to end, with nothing earned.  Its ``action`` is `NONE`.
    """
    own, ended = choices.action.size, group[choices.target] == END
    state = np.append(group[choices.state], stops)
    taken = np.append(np.flatnonzero(kept & (state[:own] != END)), own + np.arange(stops.size))
    taken = taken[np.argsort(state[taken], kind="stable")]
    counts = np.append(np.diff(choices.outcome), np.ones(stops.size, np.int64))[taken]
    outcome = np.append(0, np.cumsum(counts))
    first = np.append(choices.outcome, np.repeat(choices.outcome[-1:], stops.size))[taken]
    at = np.repeat(first - outcome[:-1], counts) + np.arange(outcome[-1])
    reward = choices.reward + np.where(ended, worth[choices.target], 0.0)
    return Choices(
        choice=np.searchsorted(state[taken], np.arange(group.max(initial=0) + 2)).astype(np.int32),
        action=np.where(taken < own, taken, NONE).astype(np.int32),
        outcome=outcome.astype(np.int32),
        target=np.append(group[choices.target], np.int32(END))[at],
        prob=np.append(choices.prob, 1.0)[at],
        reward=np.append(reward, 0.0)[at],
        word=np.append(choices.word, np.int32(NONE))[at],
    )


def best_totals(choices: Choices, first: Longs) -> tuple[Floats, Longs, Floats]:
    """Return the largest expected totals until `END`, the choices that have them, and bounds of the error.

    Parameters
    ----------
    choices
        A quotient in which each policy ends with probability 1, or is worth -∞.
    first
        ``int64 [S]``: the choices of a policy that ends.

    Raises
    ------
    ImproperError
        If ``choices`` turn out not to be such a quotient.
    ConvergenceError
        If it takes so long to end that doubles cannot tell.
    """
    gain, _ = kernels.expected(choices.outcome, choices.prob, choices.reward)
    model = Discounted(choices, gain, 1.0, 1.0)
    value, best = iterate(model, first, np.zeros(first.size), check_ends)
    behind = value[choices.state] - kernels.action_values(*model.flat, value)
    delta = max(largest(behind[best[best != NONE]]), -float(behind.min(initial=0.0)))
    delta += rounding(choices.fan, largest(choices.reward), largest(value))
    return value, best, delta * _weight(choices, best, behind, delta)


def check_ends(chain: Chain, best: Longs) -> None:
    """Raise an `ImproperError` if ``chain`` does not end with probability 1."""
    ending = coreachable_to(chain.start, chain.target, np.diff(chain.start) == 0)
    if not ending.all():
        raise ImproperError(best[~ending])


def _weight(choices: Choices, best: Longs, behind: Floats, delta: float) -> Floats:
    """Return w ≥ 1 + P w for all choices that are ``behind`` by no more than δ w at its largest."""
    near, steps = 0.0, np.ones(best.size)
    same = np.arange(best.size, dtype=np.int32)
    for _ in range(_ROUNDS):
        near = max(2 * near, 4 * delta * largest(steps))
        close = quotient(choices, same, behind <= near, np.zeros(best.size))
        close = replace(close, reward=np.ones(close.target.size))
        counting = Discounted(close, np.ones(close.action.size), 1.0, 1.0)
        try:
            steps, _ = iterate(counting, _renumbered(best, close), steps, check_ends)
        except ImproperError as error:
            raise ImproperError(close.action[error.choices], even=True) from None
        after = kernels.action_values(*counting.flat, steps)
        missing = float((after - steps[close.state]).max(initial=0.0)) + rounding(
            close.fan, 1, largest(steps)
        )
        if not missing < _TRUSTED:
            break
        if 2 * delta * largest(steps) / (1 - missing) <= near:
            return steps / (1 - missing)
    message = f"an expected total is beyond double precision: about {largest(steps):.3g} steps"
    raise ConvergenceError(message, steps)


def _renumbered(best: Longs, taken: Choices) -> Longs:
    """Return a policy in the numbers of the choices that a `quotient` has kept."""
    number = np.full(max(taken.action.max(initial=0), best.max(initial=0)) + 2, NONE, np.int64)
    number[taken.action] = np.arange(taken.action.size)
    number[NONE] = NONE
    return number[best]

"""Exact planning.

*Value iteration* applies (T v)(s) = max over the enabled a of Σ p (r + γ v(s')), a contraction by γ < 1, so
that for any v whatever ‖v* - v‖ ≤ ‖T v - v‖ / (1 - γ).  The bound returned is that of the last sweep, plus
what rounding can add to it; it does not rest on how the values were found.

Source: Puterman, *Markov Decision Processes*, section 6.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints
from supremal.decisions import _kernels
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.safety import check_mask
from supremal.errors import MDPError

_EPS: Final = float(np.finfo(np.float64).eps)
MAX_SWEEPS: Final = 1_000_000
"""After so many sweeps an iteration gives up with a `ConvergenceError`."""


@dataclass(frozen=True, slots=True, eq=False)
class Choices:
    """The enabled actions of a process as flat arrays, which kernels walk through.

    State s has the choices ``choice[s]`` to ``choice[s + 1]``; choice c is action ``action[c]``, its outcomes
    are ``outcome[c]`` to ``outcome[c + 1]`` of ``target``, ``prob``, ``reward`` and ``word``.
    """

    choice: Ints
    action: Ints
    outcome: Ints
    target: Ints
    prob: Floats
    reward: Floats
    word: Ints


def enabled_choices(mdp: TabularMDP, enabled: Bools | None = None) -> Choices:
    """Return the choices of ``mdp`` under a mask; terminal states have none.

    Raises
    ------
    MDPError
        If the mask is no supervisor of ``mdp`` (see `check_mask`).
    """
    mask = mdp.feasible if enabled is None else enabled
    check_mask(mdp, mask)
    mask = mask & ~mdp.terminal[:, None]
    slots = np.flatnonzero(mask)
    counts = np.diff(mdp.row)
    kept = np.repeat(mask.reshape(-1), counts)
    return Choices(
        np.append(0, np.cumsum(mask.sum(axis=1))).astype(np.int32),
        (slots % mdp.n_actions).astype(np.int32),
        np.append(0, np.cumsum(counts[slots])).astype(np.int32),
        mdp.next_state[kept],
        mdp.prob[kept],
        mdp.reward[kept],
        mdp.word[kept],
    )


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """What `value_iteration` returns.

    Parameters
    ----------
    q
        ``float64 [S, A]``: the value of each enabled action, -inf elsewhere.
    value
        ``float64 [S]``: the optimal values, 0 in terminal states.
    policy
        ``int32 [S]``: the best action, the first of equal ones; `NONE` where there is none.
    bound
        No value is further than this from the exact one.
    gamma
        The discount factor.
    """

    q: Floats
    value: Floats
    policy: Ints
    bound: float
    gamma: float


def greedy(q: Floats) -> Ints:
    """Return the best action in each row of ``q [S, A]``, the first of equals; `NONE` where all are -inf."""
    best: Ints = q.argmax(axis=1).astype(np.int32)
    best[~np.isfinite(q).any(axis=1)] = NONE
    return best


def value_iteration(
    mdp: TabularMDP, *, gamma: float, enabled: Bools | None = None, tolerance: float = 1e-10
) -> Plan:
    """Return optimal values and an optimal policy for the discounted return.

    Parameters
    ----------
    mdp
        The process.
    gamma
        The discount factor, in [0, 1).
    enabled
        ``bool [S, A]``: the mask of a supervisor; left out: every feasible action.
    tolerance
        Sweeps go on until the bound is below it, or rounding lets it fall no further.

    Raises
    ------
    MDPError
        If γ is out of its range or the mask leaves a reachable state without an action.

    Notes
    -----
    Each sweep is linear in the outcomes; about log(tolerance) / log(γ) of them at most.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes, value_iteration
    >>> step = from_outcomes([(0, "go", 1, 1.0, ("go",), 5.0)], alphabet=Alphabet(("go",)), terminal=[1])
    >>> value_iteration(step, gamma=0.9).value.tolist()
    [5.0, 0.0]
    """
    check_gamma(gamma)
    choices = enabled_choices(mdp, enabled)
    model = (choices.outcome, choices.target, choices.prob, choices.reward, gamma)
    value = np.zeros(mdp.n_states)
    previous = np.inf
    for _ in range(MAX_SWEEPS):
        change = _kernels.bellman(choices.choice, *model, value)
        if change <= tolerance * (1 - gamma) or (change >= previous and change <= 1e-9 * np.abs(value).max()):
            break
        previous = change
    flat = np.empty(len(choices.action))
    _kernels.action_values(*model, value, flat)
    state = np.repeat(np.arange(mdp.n_states), np.diff(choices.choice))
    q = np.full((mdp.n_states, mdp.n_actions), -np.inf)
    q[state, choices.action] = flat
    policy = greedy(q)
    has_choice = policy != NONE
    best = np.where(has_choice, q.max(axis=1, initial=-np.inf), 0.0)
    residual = float(np.abs(best - value).max(initial=0.0))
    fan = int(np.diff(choices.outcome).max(initial=0))
    bound = float((residual + rounding(fan, choices.reward, value)) / (1 - gamma))
    for array in (q, best, policy):
        array.flags.writeable = False
    return Plan(q, best, policy, bound, gamma)


def check_gamma(gamma: float) -> None:
    """Raise an `MDPError` if ``gamma`` is no discount factor."""
    if not 0 <= gamma < 1:
        message = f"gamma is {gamma}; a number from 0 up to, not including, 1 is needed"
        raise MDPError(message)


def rounding(fan: int, reward: Floats, value: Floats) -> float:
    """Return what rounding can add to one sweep over sums of ``fan`` outcomes."""
    return float((fan + 4) * _EPS * (np.abs(reward).max(initial=0.0) + np.abs(value).max(initial=0.0)))

"""Exact planning for the discounted return.

*Value iteration* applies (T v)(s) = max over the enabled a of Σ p (r + γ v(s')), a contraction by γ < 1, so
that for any v whatever ‖v* - T v‖ ≤ γ ‖T v - v‖ / (1 - γ).  The bound returned is that of one last sweep,
plus what rounding can add to it; it does not rest on how the values were found.

They are found by *modified policy iteration*: a sweep that improves the policy, then some that follow it, in
place.  In a process without an end all values rise together, by about 1 - γ of what is missing, while
their differences settle as fast as the process forgets where it was.  What fades so slowly has one shape,
nearly the same everywhere.  It is followed beside the values, and after each sweep as much of it is added as
makes the change least; that leaves the differences to be found.  Where a process forgets too slowly for
that, or ends, it is taken apart into strong components, and what lies downstream is solved first: with a
reward machine, that of its last states.  Each is cut out, numbered in the order of its sweeps, from the
states found last to the first, as news travels backwards, and not touched again once its own changes are
small.  What is left after some rounds falls to policy iteration, see `supremal.decisions.policy_iteration`.

Memory beside the process, result included: 240 bytes a state with four actions of three outcomes each, and
about 10 for each outcome more, measured with half a million states; a mask copies 24 bytes an outcome.

Source: Puterman, *Markov Decision Processes*, sections 6.3 and 6.5; Bertsekas, *Dynamic Programming and
Optimal Control* II, section 2.3 (shifts of whole components); Saad, *Iterative Methods for Sparse Linear
Systems*, section 5.3 (minimal residuals).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal.decisions import _planning_kernels as kernels
from supremal.decisions import _settling_kernels as settling
from supremal.decisions._planning_kernels import Naturals
from supremal.decisions.chains import (
    EPS,
    Chain,
    change_of,
    largest,
    rounding,
    sinks_first,
    solve,
    system,
)
from supremal.decisions.components import strong_components
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.safety import check_mask
from supremal.errors import ConvergenceError, MDPError

_ROUNDS: Final = 100
_NEARLY: Final = 4.0
MAX_POLICIES: Final = 10_000
_PATIENCE: Final = 0.5


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

    def __post_init__(self) -> None:
        for field in fields(self):
            getattr(self, field.name).flags.writeable = False

    @property
    def state(self) -> Ints:
        """The state of each choice, ``int32 [C]``."""
        return np.repeat(np.arange(len(self.choice) - 1, dtype=np.int32), np.diff(self.choice))

    @property
    def fan(self) -> int:
        """The most outcomes that a choice has."""
        return int(np.diff(self.outcome).max(initial=0))


def enabled_choices(mdp: TabularMDP, enabled: Bools | None = None) -> Choices:
    """Return the choices of ``mdp`` under a mask; terminal states have none.

    Raises
    ------
    MDPError
        If the mask is no supervisor of ``mdp`` (see `check_mask`).
    """
    mask = mdp.feasible if enabled is None else enabled
    if enabled is not None:
        check_mask(mdp, mask)
    mask = mask & ~mdp.terminal[:, None]
    before = np.append(0, np.cumsum(mask)).astype(np.int32)
    choice = before[np.arange(mdp.n_states + 1) * mdp.n_actions]
    if enabled is None and (np.diff(choice) == 0)[~mdp.terminal].any():
        check_mask(mdp, mdp.feasible)
    slots = np.flatnonzero(mask)
    counts = np.diff(mdp.row)
    outcome = np.append(0, np.cumsum(counts[slots])).astype(np.int32)
    all_kept = outcome[-1] == len(mdp.next_state)
    kept = slice(None) if all_kept else np.repeat(mask.reshape(-1), counts)
    return Choices(
        choice,
        np.broadcast_to(np.arange(mdp.n_actions, dtype=np.int32), mask.shape)[mask],
        outcome,
        mdp.next_state[kept],
        mdp.prob[kept],
        mdp.reward[kept],
        mdp.word[kept],
    )


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Optimal values, and a policy that has them.

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

    def __post_init__(self) -> None:
        for array in (self.q, self.value, self.policy):
            array.flags.writeable = False


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
    Each sweep is linear in the outcomes; usually some tens suffice, if not, some sparse linear systems.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes, value_iteration
    >>> step = from_outcomes([(0, "go", 1, 1.0, ("go",), 5.0)], alphabet=Alphabet(("go",)), terminal=[1])
    >>> value_iteration(step, gamma=0.9).value.tolist()
    [5.0, 0.0]
    """
    model = discounted(mdp, gamma, enabled)
    value = np.zeros(mdp.n_states)
    settle(model, value, tolerance=tolerance, rounds=_ROUNDS)
    plan = plan_of(mdp, model, value)
    rest = rounding(model.choices.fan, largest(model.choices.reward), largest(plan.value))
    if plan.bound <= max(tolerance, _NEARLY * rest / (1 - gamma)):
        return plan
    guess = value if largest(value) * (1 - gamma) <= largest(model.gain) else np.zeros(mdp.n_states)
    return plan_of(mdp, model, iterate(model, best_choices(model, value), guess)[0])


@dataclass(frozen=True, slots=True, eq=False)
class Discounted:
    """A process under a mask with the expected reward ``gain [C]`` of each choice and a discount factor.

    ``modulus`` is γ times the largest sum of probabilities, which need not be 1 to the last bit.
    """

    choices: Choices
    gain: Floats
    gamma: float
    modulus: float

    @property
    def flat(self) -> tuple[Naturals, Naturals, Floats, Floats, float]:
        """The arguments that all kernels share."""
        c = self.choices
        return c.outcome.view(np.uint32), c.target.view(np.uint32), c.prob, self.gain, self.gamma


def discounted(mdp: TabularMDP, gamma: float, enabled: Bools | None) -> Discounted:
    """Check ``gamma`` and the mask, and lay out what kernels need."""
    check_gamma(gamma)
    choices = enabled_choices(mdp, enabled)
    gain, mass = kernels.expected(choices.outcome, choices.prob, choices.reward)
    modulus = float(gamma * mass * (1 + choices.fan * EPS))
    if modulus >= 1:
        message = f"gamma is {gamma!r}, too near 1 for probabilities that sum to {mass!r}; normalise them"
        raise MDPError(message)
    return Discounted(choices, gain, gamma, modulus)


def plan_of(mdp: TabularMDP, model: Discounted, value: Floats) -> Plan:
    """Take one last sweep over ``value``, and bound its distance from the optimum."""
    choices = model.choices
    q = np.full((mdp.n_states, mdp.n_actions), -np.inf)
    best, policy = np.empty(mdp.n_states), np.empty(mdp.n_states, np.int32)
    change = kernels.look_ahead(
        choices.choice.view(np.uint32), *model.flat, value, choices.action, q, best, policy
    )
    slack = rounding(choices.fan, largest(choices.reward), largest(value))
    bound = (model.modulus * change + slack) / (1 - model.modulus)
    return Plan(q, best, policy, bound, model.gamma)


def settle(model: Discounted, value: Floats, *, tolerance: float, rounds: int) -> None:
    """Improve ``value``: all at once, or, where news is slow to spread, component by component."""
    choices = model.choices
    choice = choices.choice.view(np.uint32)
    change = tolerance * (1 - model.gamma) / 2
    endless = bool(np.diff(choices.choice).all())
    if endless and settling.approach(choice, *model.flat, change, rounds, _PATIENCE, value):
        return
    component = strong_components(choices.outcome[choices.choice].astype(np.int64), choices.target)
    bounds = np.append(0, np.cumsum(np.bincount(component)))
    order = sinks_first(component).astype(np.uint32)
    settling.settle(order, bounds, choice, *model.flat, change, rounds, value)


def best_choices(model: Discounted, value: Floats) -> Longs:
    """Return the choice that is greedy with ``value`` in each state, `NONE` where there is none."""
    q = kernels.action_values(*model.flat, value)
    choice = model.choices.choice.view(np.uint32)
    return kernels.improve(choice, q, np.full(value.size, NONE, np.int64), 0.0)[0]


def iterate(
    model: Discounted, best: Longs, value: Floats, check: Callable[[Chain, Longs], None] = lambda *_: None
) -> tuple[Floats, Longs]:
    """Return the value of an optimal policy, and the choice that it takes in each state, `NONE` without one.

    ``best`` is the first policy, ``value`` a guess of what it is worth; ``check`` is shown the chain of every
    policy, and the policy, before it is evaluated.
    """
    choices, seen = model.choices, set[int]()
    for _ in range(MAX_POLICIES):
        start, target, prob, gain = kernels.take(*model.flat[:4], best)
        chain = Chain(start.astype(np.int64), target.view(np.int32), prob)
        check(chain, best)
        value = value + solve(system(chain, model.gamma), change_of(chain, gain, model.gamma, value))
        q = kernels.action_values(*model.flat, value)
        slack = 2 * rounding(choices.fan, largest(choices.reward), largest(value))
        better, changed = kernels.improve(choices.choice.view(np.uint32), q, best, slack)
        known = hash(better.tobytes())
        if not changed or known in seen:  # with exact numbers none comes back: these are equally good
            return value, best
        seen.add(known)
        best = better
    message = f"policy iteration has not come to an end after {MAX_POLICIES:,} policies"
    raise ConvergenceError(message, value)


def check_gamma(gamma: float) -> None:
    """Raise an `MDPError` if ``gamma`` is no discount factor."""
    if not 0 <= gamma < 1:
        message = f"gamma is {gamma}; a number from 0 up to, not including, 1 is needed"
        raise MDPError(message)

"""Optimal reach probabilities, totals and steps, without a discount.

In three steps.  The graph decides all that does not depend on numbers, see `supremal.decisions.reachability`.
End components in which a policy may stay for nothing are put together, since from inside one every way out
is as near as any other: with them Bellman's equation has many solutions, without them one.  And what is left
is a process that ends, whose totals `supremal.decisions.transient` finds and bounds.

* *Reaching*, at best: 1 where some policy is sure to, 0 where none can; at worst: 1 where all are sure to, 0
  where some policy can avoid it.  In between one earns the probability of stepping to where it is 1.
* *Total reward*: to stay for ever where nothing is earned or lost is worth 0.  Where no policy is sure to end
  or to come to such a place, the total is -∞.  If a policy that stays for ever turns out to be
  better than one that ends, it is +∞, which is an error, and so is a stay in which gains and losses cancel.
* *Steps*: the total of 1 an epoch, at least or at most; ∞ where it may not end.

Source: Baier, Katoen, *Principles of Model Checking*, section 10.6; de Alfaro, "Computing minimum and maximum
reachability times in probabilistic systems", CONCUR 1999; Puterman, *Markov Decision Processes*, chapter 7.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Final, NoReturn

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal._graph import reachable_from, reverse, search
from supremal.decisions.components import any_outcome, end_components
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import Choices, enabled_choices
from supremal.decisions.reachability import (
    almost_sure,
    avoidable,
    check_target,
    edges_of,
    nearer,
    unavoidable,
    unreachable,
)
from supremal.decisions.transient import END, ImproperError, best_totals, quotient
from supremal.errors import MDPError

_NAMED: Final = 5


@dataclass(frozen=True, slots=True, eq=False)
class Optimum:
    """An optimal number for each state, and a policy that has it.

    Parameters
    ----------
    value
        ``float64 [S]``: the numbers.
    lower, upper
        ``float64 [S]``: the exact ones are no less and no more.
    policy
        ``int32 [S]``: an optimal action for each state; `NONE` where there is none.
    """

    value: Floats
    lower: Floats
    upper: Floats
    policy: Ints

    def __post_init__(self) -> None:
        for field in fields(self):
            getattr(self, field.name).flags.writeable = False


def reach_probability(
    mdp: TabularMDP, target: Bools, *, enabled: Bools | None = None, maximise: bool = True
) -> Optimum:
    """Return the largest (or least) probability of ever reaching ``target``.

    Parameters
    ----------
    mdp
        The process.
    target
        ``bool [S]``: the states to reach.
    enabled
        ``bool [S, A]``: the mask of a supervisor; left out: every feasible action.
    maximise
        Whether the policy is to reach them or to avoid them.

    Raises
    ------
    MDPError
        If ``target`` has another shape, or the mask leaves a reachable state without an action.
    ConvergenceError
        If it takes so many steps to decide that doubles cannot tell.

    Notes
    -----
    Policy iteration: some ten sparse linear systems in the states between 0 and 1.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> toss = from_outcomes(
    ...     [
    ...         (0, "toss", 1, 0.25, ("toss",)), (0, "toss", 2, 0.25, ("toss",)),
    ...         (0, "toss", 0, 0.5, ("toss",)), (0, "stay", 0, 1.0, ("stay",)),
    ...     ],
    ...     alphabet=Alphabet(("toss", "stay")), terminal=[1, 2],
    ... )
    >>> goal = np.array([False, True, False])
    >>> reach_probability(toss, goal).value.tolist()
    [0.5, 1.0, 0.0]
    >>> reach_probability(toss, goal, maximise=False).value.tolist()
    [0.0, 1.0, 0.0]
    """
    check_target(mdp, target)
    choices = enabled_choices(mdp, enabled)
    choices = replace(choices, reward=np.zeros(choices.target.size))
    policy = first_of(choices, np.ones(choices.action.size, np.bool_))
    if maximise:
        never = unreachable(choices, target)
        surely, way = almost_sure(choices, target)
        policy = np.where(way != NONE, way, policy)
    else:
        never = avoidable(choices, target)
        surely = unavoidable(choices, target, never)
        way = first_of(choices, ~any_outcome(choices.outcome, ~never[choices.target]))
        policy = np.where(never & (way != NONE), way, policy)
    open_states = ~(never | surely)
    staying = open_states[choices.state] & ~any_outcome(choices.outcome, ~open_states[choices.target])
    parts, inner = end_components(choices.choice, choices.outcome, choices.target, staying)
    sign = 1.0 if maximise else -1.0
    worth = np.where(surely, sign, 0.0)
    group = _groups(open_states, parts)
    small = quotient(choices, group, ~inner, worth)
    end = np.arange(len(small.choice) - 1) == END
    value, best, error = best_totals(small, almost_sure(small, end)[1])
    value, error = _spread(value, error, group, worth)
    policy = _unfold(choices, inner, small.action[best[best != NONE]], policy)
    return _optimum(choices, sign * value, error, policy, highest=1.0, lowest=0.0)


def total_reward(mdp: TabularMDP, *, enabled: Bools | None = None, maximise: bool = True) -> Optimum:
    """Return the largest (or least) expected total of the rewards, without a discount.

    Parameters
    ----------
    mdp
        The process.
    enabled
        ``bool [S, A]``: the mask of a supervisor; left out: every feasible action.
    maximise
        Whether rewards are to be earned, or are costs to be kept low.

    Returns
    -------
    Optimum
        Where the start does not lead, values are nan and ``policy`` is `NONE`; -∞ (or ∞) where no policy
        is sure to end and so what is lost has no end.

    Raises
    ------
    MDPError
        If the total from the start is infinite, or is undefined since gains and losses cancel for ever; names
        states and actions.  If the mask leaves a reachable state without an action.
    ConvergenceError
        If episodes are so long that doubles cannot tell.

    Notes
    -----
    Policy iteration from a policy that is sure to end: some ten sparse linear systems.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> toss = from_outcomes(
    ...     [(0, "toss", 0, 0.75, ("toss",), -1.0), (0, "toss", 1, 0.25, ("toss",), -1.0)],
    ...     alphabet=Alphabet(("toss",)), terminal=[1],
    ... )
    >>> total_reward(toss).value.tolist()
    [-4.0, 0.0]
    """
    choices = enabled_choices(mdp, enabled)
    sign = 1.0 if maximise else -1.0
    return _total(mdp, replace(choices, reward=sign * choices.reward), sign, strict=True)


def expected_steps(mdp: TabularMDP, *, enabled: Bools | None = None, maximise: bool = False) -> Optimum:
    """Return the least (or largest) expected number of epochs until an episode ends.

    Parameters
    ----------
    mdp
        The process.
    enabled
        ``bool [S, A]``: the mask of a supervisor; left out: every feasible action.
    maximise
        Whether the policy is the slowest.

    Returns
    -------
    Optimum
        ∞ where no policy (or not every policy) is sure to end; nan where the start does not lead.

    Raises
    ------
    MDPError
        If the mask leaves a reachable state without an action.
    ConvergenceError
        If episodes are so long that doubles cannot tell.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> walk = from_outcomes(
    ...     [(0, "go", 1, 1.0, ("go",)), (1, "go", 2, 1.0, ("go",)), (1, "wait", 1, 1.0, ("wait",))],
    ...     alphabet=Alphabet(("go", "wait")), terminal=[2],
    ... )
    >>> expected_steps(walk).value.tolist(), expected_steps(walk, maximise=True).value.tolist()
    ([2.0, 1.0, 0.0], [inf, inf, 0.0])
    """
    choices = enabled_choices(mdp, enabled)
    sign = 1.0 if maximise else -1.0
    choices = replace(choices, reward=np.full(choices.target.size, sign))
    endless = np.zeros(mdp.n_states, np.bool_)
    if maximise:
        ends = np.diff(choices.choice) == 0
        endless = ~unavoidable(choices, ends, avoidable(choices, ends))
    return _total(mdp, choices, sign, endless=endless)


def _total(
    mdp: TabularMDP, choices: Choices, sign: float, *, endless: Bools | None = None, strict: bool = False
) -> Optimum:
    """Return ``sign`` times the largest expected totals; ∞ where ``endless``."""
    endless = np.zeros(mdp.n_states, np.bool_) if endless is None else endless
    reached = reachable_from(*edges_of(choices), mdp.initial > 0)
    ends = np.diff(choices.choice) == 0
    idle = reached[choices.state] & ~any_outcome(choices.outcome, choices.reward != 0)
    parts, inner = end_components(choices.choice, choices.outcome, choices.target, idle)
    surely, way = almost_sure(choices, ends | (parts != NONE))
    lost = reached & ~surely & ~endless
    _check_lost(mdp, choices, lost, strict=strict)
    open_states = reached & surely & ~ends & ~endless
    group = _groups(open_states, parts)
    worth = np.zeros(mdp.n_states)
    kept = ~inner & ~any_outcome(choices.outcome, ~surely[choices.target])
    small = quotient(choices, group, kept, worth, np.unique(group[parts != NONE]))
    stop = np.flatnonzero(small.action == NONE)
    first = np.full(group.max(initial=0) + 1, NONE, np.int64)
    leading = np.flatnonzero((small.action != NONE) & (way[choices.state[small.action]] == small.action))
    first[small.state[leading]] = leading
    first[small.state[stop]] = stop
    try:
        value, best, error = best_totals(small, first)
    except ImproperError as improper:
        _fail_endless(mdp, choices, small.action[improper.choices], even=improper.even)
    worth[lost], worth[~reached], worth[endless & reached] = -np.inf, np.nan, np.inf
    value, error = _spread(value, error, group, worth)
    chosen = small.action[best[best != NONE]]
    policy = np.where(inner.any() & (parts != NONE), first_of(choices, inner), way)
    policy = np.where(policy == NONE, first_of(choices, np.ones(inner.size, np.bool_)), policy)
    policy = _unfold(choices, inner, chosen[chosen != NONE], policy)
    return _optimum(choices, sign * value, error, np.where(reached, policy, NONE))


def _check_lost(mdp: TabularMDP, choices: Choices, lost: Bools, *, strict: bool) -> None:
    """Raise an `MDPError` if what no policy is sure to leave is not worth -∞, or is where all begins."""
    staying = lost[choices.state] & ~any_outcome(choices.outcome, ~lost[choices.target])
    _, inner = end_components(choices.choice, choices.outcome, choices.target, staying)
    gains = np.flatnonzero(inner & any_outcome(choices.outcome, choices.reward > 0))
    if gains.size:
        c = gains[0]
        message = (
            f"the total is not defined: no policy is sure to end after state {choices.state[c]}, where "
            f"{mdp.actions[choices.action[c]]!r} can be repeated for ever at a gain; give it a way to a "
            "terminal state, or use value_iteration with gamma < 1"
        )
        raise MDPError(message)
    start = np.flatnonzero(lost & (mdp.initial > 0))
    if strict and start.size:
        message = (
            f"the total from initial state {start[0]} is infinite: no policy is sure to reach a terminal "
            "state, and what it costs to go on has no end; use value_iteration with gamma < 1"
        )
        raise MDPError(message)


def _fail_endless(mdp: TabularMDP, choices: Choices, taken: Ints, *, even: bool) -> NoReturn:
    """Raise the `MDPError` for a stay that is worth as much as to end, or more."""
    pairs = [f"{mdp.actions[choices.action[c]]!r} in {choices.state[c]}" for c in taken[:_NAMED]]
    what = "undefined: gains and losses cancel" if even else "infinite: there is a gain to be made"
    more = ", ..." if taken.size > _NAMED else ""
    message = (
        f"the total is {what} for ever by {', '.join(pairs)}{more}; use value_iteration with gamma < 1, or a "
        "mask without them"
    )
    raise MDPError(message)


def first_of(choices: Choices, among: Bools) -> Longs:
    """Return the first choice of each state that is ``among`` some, ``int64 [S]``; `NONE` where none is."""
    first = np.full(len(choices.choice) - 1, NONE, np.int64)
    picked = np.flatnonzero(among)[::-1]
    first[choices.state[picked]] = picked
    return first


def _groups(open_states: Bools, parts: Ints) -> Ints:
    """Return numbers of groups: one for each of ``parts`` and each other open state; the rest is `END`."""
    together = int(parts.max(initial=NONE)) + 1
    group = np.full(parts.size, END, np.int32)
    single = open_states & (parts == NONE)
    group[single] = together + 1 + np.arange(single.sum())
    group[parts != NONE] = parts[parts != NONE] + 1
    return group


def _spread(value: Floats, error: Floats, group: Ints, worth: Floats) -> tuple[Floats, Floats]:
    """Give every state the value of its group and its error; in `END` its worth and none."""
    solved = group == END
    return np.where(solved, worth, value[group]), np.where(solved, 0.0, error[group])


def _unfold(choices: Choices, inner: Bools, chosen: Ints, policy: Longs) -> Longs:
    """Return the ``policy`` that takes the ``chosen`` choices, and in a component the way to one of them."""
    exits = np.zeros(policy.size, np.bool_)
    exits[choices.state[chosen]] = True
    start, target = edges_of(choices, inner)
    order = search(*reverse(start, target), exits, np.ones(policy.size, np.bool_))[0]
    way = nearer(choices, inner, order)
    result = np.where((way != NONE) & ~exits, way, policy)
    result[choices.state[chosen]] = chosen
    return result


def _optimum(
    choices: Choices,
    value: Floats,
    error: Floats,
    policy: Longs,
    *,
    lowest: float = -np.inf,
    highest: float = np.inf,
) -> Optimum:
    return Optimum(
        value=np.clip(value, lowest, highest) + 0.0,  # no -0.0
        lower=np.clip(value - error, lowest, highest),
        upper=np.clip(value + error, lowest, highest),
        policy=np.append(choices.action, np.int32(NONE))[policy],
    )

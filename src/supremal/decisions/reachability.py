"""What the graph of a process decides: which sets are reached surely, and which never.

For a set T of target states and a mask there are four questions, and none of them depends on the numbers:

* *prob0*, maximal: no policy reaches T, which is to say that no path leads there;
* *prob0*, minimal: some policy avoids T for ever; the others are those that all choices may bring nearer;
* *prob1*, minimal: all policies reach T; no path that avoids T leads to where T can be avoided for ever;
* *prob1*, maximal: some policy reaches T with probability 1; the largest set that some choices stay in and
  lead from to T.

A state that has no choice, such as a terminal one, avoids T for ever unless it is in T.

Source: Baier, Katoen, *Principles of Model Checking*, section 10.6.1, algorithms 45 and 46; de Alfaro,
*Formal Verification of Probabilistic Systems*, Stanford (1997).
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal._graph import coreachable_to, reverse, search
from supremal._jit import kernel
from supremal.decisions.components import any_outcome
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import Choices, enabled_choices
from supremal.errors import MDPError


def prob0(mdp: TabularMDP, target: Bools, *, enabled: Bools | None = None, maximise: bool = True) -> Bools:
    """Return the states whose maximal (or minimal) probability of reaching ``target`` is 0.

    Parameters
    ----------
    mdp
        The process.
    target
        ``bool [S]``: the states to reach.
    enabled
        ``bool [S, A]``: the mask of a supervisor; left out: every feasible action.
    maximise
        Whether the policy is the best or the worst for reaching them.

    Returns
    -------
    bool [S]

    Raises
    ------
    MDPError
        If ``target`` has another shape, or the mask leaves a reachable state without an action.

    Notes
    -----
    Linear in the outcomes.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> fork = from_outcomes(
    ...     [(0, "go", 1, 1.0, ("go",)), (0, "stay", 0, 1.0, ("stay",))],
    ...     alphabet=Alphabet(("go", "stay")), terminal=[1],
    ... )
    >>> prob0(fork, fork.terminal).tolist(), prob0(fork, fork.terminal, maximise=False).tolist()
    ([False, False], [True, False])
    """
    choices = enabled_choices(mdp, enabled)
    check_target(mdp, target)
    return unreachable(choices, target) if maximise else avoidable(choices, target)


def prob1(mdp: TabularMDP, target: Bools, *, enabled: Bools | None = None, maximise: bool = True) -> Bools:
    """Return the states whose maximal (or minimal) probability of reaching ``target`` is 1.

    Parameters, errors and result are those of `prob0`.

    Notes
    -----
    Linear in the outcomes; where it maximises, for each round, at most S of them and usually two or three.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> fork = from_outcomes(
    ...     [(0, "go", 1, 1.0, ("go",)), (0, "stay", 0, 1.0, ("stay",))],
    ...     alphabet=Alphabet(("go", "stay")), terminal=[1],
    ... )
    >>> prob1(fork, fork.terminal).tolist(), prob1(fork, fork.terminal, maximise=False).tolist()
    ([True, True], [False, True])
    """
    choices = enabled_choices(mdp, enabled)
    check_target(mdp, target)
    if maximise:
        return almost_sure(choices, target)[0]
    return unavoidable(choices, target, avoidable(choices, target))


def check_target(mdp: TabularMDP, target: Bools) -> None:
    """Raise an `MDPError` if ``target`` is no set of states of ``mdp``."""
    if np.shape(target) != (mdp.n_states,) or np.asarray(target).dtype != np.bool_:
        message = (
            f"the target has shape {np.shape(target)} and type {np.asarray(target).dtype}; "
            f"bool ({mdp.n_states},) is needed"
        )
        raise MDPError(message)


def edges_of(choices: Choices, allowed: Bools | None = None) -> tuple[Longs, Ints]:
    """Return the graph of states whose edges are the outcomes of the ``allowed`` choices, ``bool [C]``."""
    start = choices.outcome[choices.choice].astype(np.int64)
    if allowed is None:
        return start, choices.target
    kept = np.repeat(allowed, np.diff(choices.outcome))
    return start, np.where(kept, choices.target, np.int32(NONE))


def unreachable(choices: Choices, target: Bools) -> Bools:
    """Return the states from which no path leads to ``target``."""
    return ~coreachable_to(*edges_of(choices), target)


def avoidable(choices: Choices, target: Bools) -> Bools:
    """Return the states from which some policy avoids ``target`` for ever."""
    states = target.size
    padded = np.append(choices.outcome, np.repeat(choices.outcome[-1:], states)).astype(np.int64)
    into, by = reverse(padded, choices.target)
    fresh = np.empty(states, np.int32)
    fresh[: target.sum()] = np.flatnonzero(target)
    left = np.diff(choices.choice)
    forced = target.copy()
    _force(
        into, by, choices.state, left, np.zeros(choices.action.size, np.bool_), forced, fresh, target.sum()
    )
    return ~forced


@kernel
def _force(
    into: Longs, by: Ints, state: Ints, left: Ints, risky: Bools, forced: Bools, fresh: Ints, count: int
) -> None:
    """Add to ``forced`` the states whose every choice may lead there, beginning with ``fresh[:count]``.

    ``by[into[t] : into[t + 1]]`` are the choices with an outcome in t; ``left [S]`` counts those not risky.
    """
    head = 0
    while head < count:
        t = fresh[head]
        head += 1
        for k in range(into[t], into[t + 1]):
            c = by[k]
            s = state[c]
            if not risky[c]:
                risky[c] = True
                left[s] -= 1
                if left[s] == 0 and not forced[s]:
                    forced[s] = True
                    fresh[count] = s
                    count += 1


def unavoidable(choices: Choices, target: Bools, avoid: Bools) -> Bools:
    """Return the states from which all policies reach ``target``, given those that can `avoid` it."""
    return ~coreachable_to(*edges_of(choices), avoid, ~target)


def almost_sure(choices: Choices, target: Bools) -> tuple[Bools, Longs]:
    """Return the states from which some policy reaches ``target`` with probability 1, and such a policy.

    The policy, ``int64 [S]``, is the choice to take in each of them, one that may lead nearer and never
    leaves them; `NONE` elsewhere, and in ``target``.
    """
    inside = np.ones(target.size, np.bool_)
    while True:
        allowed = ~any_outcome(choices.outcome, ~inside[choices.target]) & ~target[choices.state]
        order = search(*reverse(*edges_of(choices, allowed)), target, inside)[0]
        if order.size == inside.sum():
            break
        inside = np.zeros(target.size, np.bool_)
        inside[order] = True
    return inside, nearer(choices, allowed, order)


def nearer(choices: Choices, allowed: Bools, order: Ints) -> Longs:
    """Return for each state of ``order`` the allowed choice most likely to lead to an earlier one of it."""
    states = len(choices.choice) - 1
    rank = np.full(states, states, np.int64)
    rank[order] = np.arange(order.size)
    ahead = rank[choices.target] < np.repeat(rank[choices.state], np.diff(choices.outcome))
    chance = np.where(allowed, total_of(choices.outcome, np.where(ahead, choices.prob, 0.0)), 0.0)
    helpful = np.flatnonzero(chance > 0)
    helpful = helpful[np.argsort(chance[helpful], kind="stable")]
    best = np.full(states, NONE, np.int64)
    best[choices.state[helpful]] = helpful  # the last to be written is the likeliest
    return best


def total_of(outcome: Ints, numbers: Floats) -> Floats:
    """Return the sum of ``numbers [O]`` over the outcomes of each choice, each of which has some."""
    return np.add.reduceat(numbers, outcome[:-1]) if outcome.size > 1 else np.empty(0)

"""Exact evaluation of a policy: what it is worth, how long it takes, and what can go wrong.

A policy turns a decision process into a Markov chain; all that follows is on its states reachable from the
start.

* Discounted value: sweeps of v = g + γ P v, with the bound that a contraction gives.
* Reaching a set: 0 and 1 where the graph alone decides, interval iteration from below and above elsewhere.
* Expected totals: sweeps from below, and an upper bound that one more sweep proves (it only falls).
* Completion within N epochs: N steps of the distribution.

Source: Puterman, *Markov Decision Processes*, chapter 6; Baier, Katoen, *Principles of Model Checking*,
section 10.1; Haddad, Monmege, "Interval iteration algorithm for MDPs and IMDPs", TCS 735 (2018); Hartmanns,
Kaminski, "Optimistic value iteration", CAV 2020.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal._graph import coreachable_to, reachable_from
from supremal.decisions import _kernels
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import MAX_SWEEPS, check_gamma, rounding
from supremal.decisions.product import broken_states
from supremal.errors import ConvergenceError, MDPError

_PRECISION: Final = 1e-12
_ROW_TOLERANCE: Final = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """What `evaluate` returns, all from the initial distribution.

    Parameters
    ----------
    value
        Expected discounted return.
    bound
        ``value`` is no further than this from the exact number.
    expected_return
        Expected undiscounted return of an episode; nan where it may never end.
    expected_steps
        Expected number of epochs of an episode; inf where it may never end.
    completion_within
        ``float64 [N + 1]``: the probability that a marked state has been reached within n epochs.
    completion
        The probability that one is ever reached.
    violation
        The probability that a rule is ever broken.
    precision
        The other numbers are no further than this from the exact ones, relatively where above 1.
    """

    value: float
    bound: float
    expected_return: float
    expected_steps: float
    completion_within: Floats
    completion: float
    violation: float
    precision: float


@dataclass(frozen=True, slots=True, eq=False)
class _Chain:
    """A Markov chain of n states in sparse form; state s has no edge where an episode ends."""

    start: Longs
    source: Longs
    target: Ints
    prob: Floats
    gain: Floats
    initial: Floats
    marked: Bools
    broken: Bools

    @property
    def ends(self) -> Bools:
        ends: Bools = np.diff(self.start) == 0
        return ends

    def expect(self, values: Floats) -> float:
        return float(self.initial @ values)


def evaluate(mdp: TabularMDP, policy: Ints | Floats, *, gamma: float, horizon: int = 0) -> Evaluation:
    """Evaluate ``policy`` exactly.

    Parameters
    ----------
    mdp
        The process; where it is a `product` with rules, their violation is evaluated too.
    policy
        ``int [S]``, an action for each state, or ``float [S, A]``, a distribution for each.  Only the states
        that it reaches need one.
    gamma
        The discount factor, in [0, 1).
    horizon
        N of ``completion_within``.

    Raises
    ------
    MDPError
        If the policy takes an infeasible action in a state that it reaches, or γ is out of its range.
    ConvergenceError
        If an iteration does not come to rest within a million sweeps.

    Notes
    -----
    Each sweep is linear in the edges of the chain.

    Examples
    --------
    >>> from supremal import Alphabet, evaluate, from_outcomes
    >>> toss = from_outcomes(
    ...     [(0, "toss", 0, 0.5, ("tails",), -1.0), (0, "toss", 1, 0.5, ("heads",), -1.0)],
    ...     alphabet=Alphabet(("heads", "tails"), uncontrollable=frozenset({"heads", "tails"})),
    ...     terminal=[1],
    ... )
    >>> result = evaluate(toss, [0, 0], gamma=0.9, horizon=2)
    >>> round(result.expected_steps, 9), result.completion_within.tolist()
    (2.0, [0.0, 0.5, 0.75])
    """
    check_gamma(gamma)
    chain = _chain(mdp, _weights(mdp, policy))
    value, bound = _discounted(chain, gamma)
    ever, ever_gap = _reach(chain, chain.marked)
    violation, violation_gap = _reach(chain, chain.broken)
    steps, total, total_gap = np.inf, np.nan, 0.0
    if coreachable_to(chain.start, chain.target, chain.ends).all():  # so it ends with probability 1
        steps, steps_gap = _total(chain, np.where(chain.ends, 0.0, 1.0))
        up, up_gap = _total(chain, np.maximum(chain.gain, 0.0))
        down, down_gap = _total(chain, np.maximum(-chain.gain, 0.0))
        total, total_gap = up - down, max(steps_gap, up_gap, down_gap)
    return Evaluation(
        value=value,
        bound=bound,
        expected_return=total,
        expected_steps=steps,
        completion_within=_within(chain, horizon),
        completion=ever,
        violation=violation,
        precision=max(ever_gap, violation_gap, total_gap),
    )


def _weights(mdp: TabularMDP, policy: Ints | Floats) -> Floats:
    """Return the policy as a distribution over the actions of each state, ``[S, A]``."""
    given = np.asarray(policy)
    shape = (mdp.n_states, mdp.n_actions)
    if given.shape == shape:
        return given.astype(np.float64)
    if given.shape != shape[:1] or given.dtype.kind not in "iu":
        message = f"the policy has shape {given.shape}; int {shape[:1]} or float {shape} is needed"
        raise MDPError(message)
    weights = np.zeros(shape)
    chosen = np.flatnonzero(given != NONE)
    if chosen.size and not (given[chosen].min() >= 0 and given[chosen].max() < mdp.n_actions):
        message = f"the policy holds {given.min()} to {given.max()}; actions are 0 to {mdp.n_actions - 1}"
        raise MDPError(message)
    weights[chosen, given[chosen]] = 1.0
    return weights


def _chain(mdp: TabularMDP, weights: Floats) -> _Chain:
    """Return the chain that a policy induces, cut down to what it reaches."""
    counts = np.diff(mdp.row)
    prob = mdp.prob * np.repeat(weights.reshape(-1), counts)
    prob[np.repeat(np.repeat(mdp.terminal, mdp.n_actions), counts)] = 0.0
    start = mdp.row[:: mdp.n_actions]
    reached = reachable_from(start, np.where(prob > 0, mdp.next_state, np.int32(NONE)), mdp.initial > 0)
    states = np.flatnonzero(reached)
    open_states = states[~mdp.terminal[states]]
    mass = np.where(mdp.feasible[open_states], weights[open_states], 0.0).sum(axis=1)
    wrong = np.flatnonzero(~(np.abs(mass - 1) <= _ROW_TOLERANCE) | (weights[open_states].min(axis=1) < 0))
    if wrong.size:
        message = (
            f"the policy gives feasible actions probability {mass[wrong[0]]:.6g} in state "
            f"{open_states[wrong[0]]}, which it reaches; 1 is needed"
        )
        raise MDPError(message)
    origin = np.repeat(np.arange(mdp.n_states), np.diff(start))
    edges = np.flatnonzero(reached[origin] & (prob > 0))
    number = np.full(mdp.n_states, NONE, np.int32)
    number[states] = np.arange(states.size)
    source = number[origin[edges]].astype(np.int64)
    return _Chain(
        start=np.searchsorted(source, np.arange(states.size + 1)).astype(np.int64),
        source=source,
        target=number[mdp.next_state[edges]],
        prob=prob[edges],
        gain=np.bincount(source, prob[edges] * mdp.reward[edges], states.size).astype(np.float64),
        initial=mdp.initial[states],
        marked=mdp.marked[states],
        broken=broken_states(mdp)[states],
    )


def _discounted(chain: _Chain, gamma: float) -> tuple[float, float]:
    """Return the expected discounted return and its bound."""
    value = np.zeros(chain.gain.size)
    change = previous = np.inf
    for _ in range(MAX_SWEEPS):
        change = _sweep(chain, chain.gain, gamma, ~chain.ends, value)
        if change == 0 or change >= previous:
            break
        previous = change
    fan = int(np.diff(chain.start).max(initial=0))
    slack = rounding(fan, chain.gain, value)
    return chain.expect(value), float((gamma * change + slack) / (1 - gamma))


def _reach(chain: _Chain, goals: Bools) -> tuple[float, float]:
    """Return the probability of ever reaching ``goals``, and how far it may be off."""
    can = coreachable_to(chain.start, chain.target, goals)
    may_miss = coreachable_to(chain.start, chain.target, ~can, ~goals)
    low = np.where(can & ~may_miss | goals, 1.0, 0.0)
    high = np.where(can, 1.0, 0.0)
    free = can & may_miss & ~goals
    zero = np.zeros(low.size)
    previous = np.inf
    for _ in range(MAX_SWEEPS):
        gap = float((high - low).max(initial=0.0))
        if gap <= _PRECISION:
            break
        moved = max(_sweep(chain, zero, 1.0, free, low), _sweep(chain, zero, 1.0, free, high))
        if moved == 0 or (moved >= previous and gap < 1e-9):
            break
        previous = moved
    else:
        message = f"the probability of reaching is known to {gap:.3g} only after {MAX_SWEEPS:,} sweeps"
        raise ConvergenceError(message, (low, high))
    return chain.expect(low + high) / 2, gap / 2


def _total(chain: _Chain, cost: Floats) -> tuple[float, float]:
    """Return the expected total of ``cost`` ≥ 0 until the certain end, and how far it may be off."""
    free = ~chain.ends
    low = np.zeros(cost.size)
    wanted = _PRECISION
    for _ in range(MAX_SWEEPS):
        change = _sweep(chain, cost, 1.0, free, low)
        if change > wanted * max(1.0, float(low.max(initial=0.0))):
            continue
        for margin in (1e-11, 1e-10, 1e-9, 1e-8):
            high = np.where(free, low + margin * (1.0 + low), 0.0)
            above = high.copy()
            _sweep(chain, cost, 1.0, free, above)
            if (above <= high).all():
                return chain.expect(low), margin
        wanted /= 4
        if change == 0:
            break
    message = "an expected total does not come to rest; episodes are too long for double precision"
    raise ConvergenceError(message, low)


def _within(chain: _Chain, horizon: int) -> Floats:
    """Return the probability of having reached a marked state within 0, 1, …, ``horizon`` epochs."""
    arrived = np.empty(horizon + 1)
    mass: Floats = chain.initial.copy()
    for n in range(horizon + 1):
        arrived[n] = mass[chain.marked].sum()
        mass[chain.marked] = 0.0
        moved = np.bincount(chain.target, chain.prob * mass[chain.source], mass.size)
        mass = moved.astype(np.float64)  # of no edges it counts in whole numbers
    return np.minimum(np.cumsum(arrived), 1.0)


def _sweep(chain: _Chain, gain: Floats, gamma: float, free: Bools, value: Floats) -> float:
    return _kernels.sweep(chain.start, chain.target, chain.prob, gain, gamma, free, value)

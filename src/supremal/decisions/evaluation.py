"""Exact evaluation of a policy: what it is worth, how long it takes, and what can go wrong.

A policy turns a decision process into a Markov chain; all that follows is on its states reachable from the
start.  Where the chain is sure to end, or γ < 1, every number is an expected total (see
`supremal.decisions.chains`) and comes with its bound:

* the discounted value, of the rewards with γ;
* the return and the steps of an episode, of the rewards and of ones;
* the probability of reaching a set, of that of stepping into it, over the states that can reach it and can
  miss it: elsewhere it is 0 or 1, and the graph alone decides.

Completion within N epochs takes N steps of the distribution.

Source: Puterman, *Markov Decision Processes*, chapter 6; Baier, Katoen, *Principles of Model Checking*,
section 10.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints
from supremal._graph import coreachable_to, reachable_from
from supremal.decisions.chains import Chain, expected_total, resolvent, within
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import check_gamma
from supremal.decisions.product import broken_states
from supremal.errors import MDPError

_ROW_TOLERANCE: Final = 1e-9
_SUM_ERROR: Final = 1e-15


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
    violations
        ``float64 [K]``, a number for each column of the process's ``origin``: in that of a rule of the
        `product`, the probability that this rule is broken, alone or with others at once; in those of the
        environment that of any; in that of a reward machine 0.
    """

    value: float
    bound: float
    expected_return: float
    expected_steps: float
    completion_within: Floats
    completion: float
    violation: float
    precision: float
    violations: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Induced:
    """The chain of a policy on the states that it reaches; ``gain [n]`` is what each of them earns."""

    chain: Chain
    gain: Floats
    scale: float
    initial: Floats
    states: np.ndarray

    @property
    def ends(self) -> Bools:
        ends: Bools = np.diff(self.chain.start) == 0
        return ends


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
        If episodes are so long that double precision cannot tell whether they end.

    Notes
    -----
    Linear in the edges of the chain for each iteration of a solver: one where it has no cycles, usually some
    tens where it has.

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
    run = _induce(mdp, policy_weights(mdp, policy))
    open_states = ~run.ends
    value, bound = _total(run, open_states, run.gain, gamma)
    ever, ever_gap = _reach(run, mdp.marked[run.states])
    sinks = {hit.tobytes(): _reach(run, hit) for hit in (mdp.origin[run.states] == NONE).T}
    violation, violation_gap = _reach(run, broken_states(mdp)[run.states])
    steps, total, gaps = np.inf, np.nan, [ever_gap, violation_gap, *(gap for _, gap in sinks.values())]
    if coreachable_to(run.chain.start, run.chain.target, run.ends).all():  # so it ends with probability 1
        steps, steps_gap = _total(run, open_states, np.ones(open_states.size))
        total, total_gap = _total(run, open_states, run.gain)
        gaps += [steps_gap / max(1.0, steps), total_gap / max(1.0, abs(total))]
    return Evaluation(
        value=value,
        bound=bound,
        expected_return=total,
        expected_steps=steps,
        completion_within=_within(run, mdp.marked[run.states], horizon),
        completion=ever,
        violation=violation,
        precision=max(gaps),
        violations=np.array([sinks[hit.tobytes()][0] for hit in (mdp.origin[run.states] == NONE).T]),
    )


def policy_weights(mdp: TabularMDP, policy: Ints | Floats) -> Floats:
    """Return a policy, ``int [S]`` or ``float [S, A]``, as a distribution over the actions of each state.

    Raises
    ------
    MDPError
        If its shape or an action does not fit.
    """
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


def _induce(mdp: TabularMDP, weights: Floats) -> _Induced:
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
    chain = Chain(
        np.searchsorted(source, np.arange(states.size + 1)).astype(np.int64),
        number[mdp.next_state[edges]],
        prob[edges],
    )
    reward = mdp.reward[edges]
    gain = np.bincount(source, prob[edges] * reward, states.size).astype(np.float64)
    return _Induced(chain, gain, float(np.abs(reward).max(initial=0.0)), mdp.initial[states], states)


def _total(run: _Induced, among: Bools, gain: Floats, gamma: float = 1.0) -> tuple[float, float]:
    """Return the expected total of ``gain`` until some states are left, and how far it may be off."""
    value, error = expected_total(resolvent(within(run.chain, among), gamma), gain[among], scale=run.scale)
    start = run.initial[among]
    total = float(start @ value)
    return total, float(start @ error) + _SUM_ERROR * float(start @ np.abs(value)) * np.count_nonzero(start)


def _reach(run: _Induced, goals: Bools) -> tuple[float, float]:
    """Return the probability of ever reaching ``goals``, and how far it may be off."""
    chain = run.chain
    can = coreachable_to(chain.start, chain.target, goals)
    may_miss = coreachable_to(chain.start, chain.target, ~can, ~goals)
    sure = goals | can & ~may_miss
    free = can & may_miss & ~goals
    step = np.bincount(chain.source, chain.prob * sure[chain.target], goals.size).astype(np.float64)
    part, gap = _total(run, free, step) if free.any() else (0.0, 0.0)
    return min(float(run.initial[sure].sum()) + part, 1.0), gap


def _within(run: _Induced, marked: Bools, horizon: int) -> Floats:
    """Return the probability of having reached a marked state within 0, 1, …, ``horizon`` epochs."""
    arrived = np.empty(horizon + 1)
    mass: Floats = run.initial.copy()
    source = run.chain.source
    for n in range(horizon + 1):
        arrived[n] = mass[marked].sum()
        mass[marked] = 0.0
        moved = np.bincount(run.chain.target, run.chain.prob * mass[source], mass.size)
        mass = moved.astype(np.float64)  # of no edges it counts in whole numbers
    return np.minimum(np.cumsum(arrived), 1.0)

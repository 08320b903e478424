"""The whole: a random process, rules and a reward machine, planned, learned and certified.

What is best is decided by trying every deterministic policy under the supervisor, in fractions; all numbers
are dyadic, so that doubles hold them exactly.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from fractions import Fraction
from math import prod
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st

import exact
from processes import random_process, random_rule
from strategies import SEEDS
from supremal import (
    RewardMachine,
    Settings,
    TabularMDP,
    evaluate,
    product,
    q_learning,
    reward_machine,
    safe_actions,
    value_iteration,
    verifier,
)
from supremal.decisions.certificate import certify
from supremal.decisions.optimum import expected_steps, reach_probability
from supremal.decisions.policy_iteration import policy_iteration
from supremal.decisions.safety import reachable_states
from supremal.learning.settings import ALGORITHMS
from supremal.rules.rule import Rule

GAMMA = Fraction(7, 8)
LABELS = ("x & y", "x & !y", "!x & y", "!x & !y")
LEARNERS = [
    Settings(episodes=40, episode_steps=8, epsilon=0.5, algorithm=algorithm, counterfactual=counterfactual)
    for algorithm in ALGORITHMS
    for counterfactual in (False, True)
    if not (counterfactual and algorithm == "sarsa")
]


@dataclass(frozen=True)
class Whole:
    """A process, rules and a machine; their product, and the mask in the states that it lets be reached."""

    environment: TabularMDP
    rules: list[Rule]
    machine: RewardMachine
    mdp: TabularMDP
    mask: np.ndarray

    @property
    def n_policies(self) -> int:
        return prod(max(count, 1) for count in self.mask.sum(axis=1).tolist())


def random_machine(seed: int) -> RewardMachine:
    """A machine of two states that says of every label where it leads, and what it is worth."""
    rng = np.random.default_rng(seed)
    edges = [
        (state, guard, str(rng.choice(["one", "two"])), float(rng.integers(-12, 9)) / 4)
        for state in ("one", "two")
        for guard in LABELS
    ]
    return reward_machine("xy", edges)


def whole_of(seed: int, *, states: int = 4) -> Whole:
    """The product of a seed; nothing is enabled where its rules cannot be kept."""
    process = random_process(seed, states=states, silent=True)
    outcomes = np.repeat(np.diff(process.row), np.diff(process.row))  # of each action one or two
    eighths = np.clip(np.round(process.prob * 8), 1, 7) / 8
    environment = replace(process, prob=np.where(outcomes > 1, eighths, 1.0))
    rules = [Rule(f"rule {k}", random_rule(seed + k, states=2, owing=0.2)) for k in range(2)]
    machine = random_machine(seed)
    mdp = product(environment, [rule.automaton for rule in rules], machine)
    mask = safe_actions(mdp)
    return Whole(environment, rules, machine, mdp, mask & reachable_states(mdp, mask)[:, None])


@st.composite
def wholes(draw: st.DrawFn) -> Whole:
    """Those in which the rules leave something to choose, but not too many policies to try."""
    seed = draw(SEEDS)
    while True:
        whole = whole_of(seed)
        if 2 <= whole.n_policies <= 24:
            return whole
        seed += 1


@examples(max_examples=30)
@given(wholes())
def test_the_planner_finds_the_best_of_all_policies(whole: Whole) -> None:
    every = list(exact.policies(whole.mdp, whole.mask))
    truth = exact.best([exact.discounted(whole.mdp, policy, GAMMA) for policy in every])
    for solver in (value_iteration, policy_iteration):
        plan = solver(whole.mdp, gamma=float(GAMMA), enabled=whole.mask)
        assert plan.bound < 1e-9
        assert exact.encloses(plan.value - plan.bound, truth, plan.value + plan.bound)
        assert exact.discounted(whole.mdp, tuple(plan.policy.tolist()), GAMMA) == truth


@examples(max_examples=30)
@given(wholes())
def test_under_the_mask_an_end_or_a_marked_state_can_always_be_reached(whole: Whole) -> None:
    goals = (whole.mdp.marked | whole.mdp.terminal) & (whole.mdp.origin >= 0).all(axis=1)
    found = reach_probability(whole.mdp, goals, enabled=whole.mask)
    reached = reachable_states(whole.mdp, whole.mask)
    assert (found.value[reached] == 1).all()
    ends = set(np.flatnonzero(goals).tolist())
    every = [exact.reaching(whole.mdp, policy, ends) for policy in exact.policies(whole.mdp, whole.mask)]
    best = exact.best(every)
    assert all(best[s] == 1 for s in np.flatnonzero(reached))


@examples(max_examples=25)
@given(wholes(), SEEDS)
def test_no_learner_breaks_a_rule_or_beats_the_best(whole: Whole, seed: int) -> None:
    rules = [rule.automaton for rule in whole.rules]
    plan = value_iteration(whole.mdp, gamma=float(GAMMA), enabled=whole.mask)
    best = float(plan.value @ whole.mdp.initial)
    for settings in LEARNERS:
        learned = q_learning(
            whole.mdp,
            enabled=whole.mask,
            rules=rules,
            settings=settings,
            seed=seed,
            environment=whole.environment,
        )
        assert learned.violations.sum() == 0
        assert np.isfinite(learned.q[whole.mask]).all()
        assert np.isneginf(learned.q[~whole.mask]).all()
        greedy = evaluate(whole.mdp, learned.policy, gamma=float(GAMMA))
        assert greedy.violation == 0
        assert greedy.value <= best + plan.bound + greedy.bound


def falsified(document: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The certificate with a better value; with an action that is not safe, in the mask and as the choice."""
    found = {}
    (start, _), *_ = document["initial"]
    first = next(i for i, row in enumerate(document["states"]) if row[0] == [start, 0, 0, 0])
    if not document["environment"][start][0]:
        better = copy.deepcopy(document)
        better["states"][first][4] += 0.01
        for claim in ("value_at_least", "optimum_at_most"):
            better["claims"][claim] += 0.01
        found["value"] = better
    for i, (origin, enabled, *_) in enumerate(document["states"]):
        feasible = [a for a, _ in document["environment"][origin[0]][3]]
        for action in set(feasible) - set(enabled):
            for name, place, said in (("mask", 1, sorted([*enabled, action])), ("policy", 2, action)):
                other = copy.deepcopy(document)
                other["states"][i][place] = said
                found[f"{name} {i} {action}"] = other
    return found


@examples(max_examples=25)
@given(wholes(), st.sampled_from(LEARNERS))
def test_what_is_learned_is_certified_and_what_is_made_up_is_not(whole: Whole, settings: Settings) -> None:
    learned = q_learning(whole.mdp, enabled=whole.mask, settings=settings, environment=whole.environment)
    document = certify(
        whole.environment, whole.rules, whole.machine, learned.policy, gamma=float(GAMMA), name="whole"
    )
    assert verifier.verify(document).verdict == "valid"
    value = evaluate(whole.mdp, learned.policy, gamma=float(GAMMA)).value
    assert abs(document["claims"]["value_at_least"] - value) < 1e-8
    for what, other in falsified(document).items():
        failed = {statement for statement, *_ in verifier.verify(other).failures}
        assert failed - {"hash"}, what


def test_equally_good_policies_do_not_take_turns() -> None:
    """Rounding made each of two seem better than the other, for ever."""
    whole = whole_of(392, states=12)
    found = expected_steps(whole.mdp, enabled=whole.mask, maximise=True)
    assert found.lower[0] <= 90 <= found.upper[0]
    assert found.upper[0] - found.lower[0] < 1e-9

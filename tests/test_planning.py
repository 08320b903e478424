"""Every solver against textbooks, against all policies in exact fractions, and against another program."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from itertools import chain as chained
from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import exact
import storm
from book import named, table
from processes import random_process
from supremal import (
    Alphabet,
    ConvergenceError,
    MDPError,
    TabularMDP,
    evaluate,
    from_outcomes,
    value_iteration,
)
from supremal.decisions.components import end_components, strong_components
from supremal.decisions.horizon import finite_horizon
from supremal.decisions.optimum import expected_steps, reach_probability, total_reward
from supremal.decisions.planning import discounted, enabled_choices, settle
from supremal.decisions.policy_iteration import policy_iteration
from supremal.decisions.reachability import prob0, prob1

pytestmark = pytest.mark.engine
SEEDS = range(60)
SMALL = st.integers(0, 2**32)
CASES = table("planning")


def model(case: dict[str, Any]) -> TabularMDP:
    actions = list(dict.fromkeys(line[1] for line in case["outcomes"]))
    return from_outcomes(
        [(s, a, t, p, (a,), r) for s, a, t, p, r in case["outcomes"]],
        alphabet=Alphabet(tuple(actions)),
        terminal=case.get("terminal", []),
    )


def subset(mdp: TabularMDP, states: list[int]) -> np.ndarray:
    return np.isin(np.arange(mdp.n_states), states)


def some_target(mdp: TabularMDP, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).random(mdp.n_states) < 0.3


def some_mask(mdp: TabularMDP, seed: int) -> np.ndarray:
    """Take away one of two actions in some states."""
    mask = mdp.feasible & (np.random.default_rng(seed).random(mdp.feasible.shape) < 0.6)
    return np.where(mask.any(axis=1, keepdims=True), mask, mdp.feasible)


# --- textbooks --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", [value_iteration, policy_iteration])
@pytest.mark.parametrize("case", named([case for case in CASES if "gamma" in case]))
def test_discounted_textbook_models(case: dict[str, Any], solver: Any) -> None:
    mdp = model(case)
    plan = solver(mdp, gamma=case["gamma"])
    assert np.abs(plan.value - case["value"]).max() <= plan.bound + 1e-14
    assert plan.bound < 1e-9
    assert [mdp.actions[a] for a in plan.policy] == case["policy"]


@pytest.mark.parametrize("case", named([case for case in CASES if "target" in case]))
def test_undiscounted_textbook_models(case: dict[str, Any]) -> None:
    mdp = model(case)
    target = subset(mdp, case["target"])
    results = {
        "maximum": lambda: reach_probability(mdp, target),
        "minimum": lambda: reach_probability(mdp, target, maximise=False),
        "total": lambda: total_reward(mdp),
        "steps": lambda: expected_steps(mdp),
    }
    for key, run in results.items():
        for name, first in ((key, slice(None)), (f"start_{key}", slice(1))):
            if name in case:
                found = run()
                assert (found.lower <= found.value).all()
                assert (found.value <= found.upper).all()
                assert (found.upper - found.lower).max() < 1e-12
                assert found.value[first] == pytest.approx(case[name], abs=1e-14)


# --- all policies, in fractions ---------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_discounted_values_are_the_best_of_all_policies(seed: int) -> None:
    mdp, gamma = exact.small_process(seed, rewards=(-3, 0, 2)), Fraction(7, 8)
    mask = some_mask(mdp, seed) if seed % 2 else None
    truth = exact.best([exact.discounted(mdp, policy, gamma) for policy in exact.policies(mdp, mask)])
    for solver in (value_iteration, policy_iteration):
        plan = solver(mdp, gamma=float(gamma), enabled=mask)
        assert exact.encloses(plan.value - plan.bound, truth, plan.value + plan.bound)
        assert plan.bound < 1e-9
        assert exact.discounted(mdp, tuple(plan.policy.tolist()), gamma) == truth


@pytest.mark.parametrize("maximise", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_reach_probabilities_are_those_of_all_policies(seed: int, maximise: bool) -> None:  # noqa: FBT001
    mdp = exact.small_process(seed)
    target = some_target(mdp, seed)
    goals = set(np.flatnonzero(target).tolist())
    every = [exact.reaching(mdp, policy, goals) for policy in exact.policies(mdp)]
    truth = exact.best(every) if maximise else exact.least(every)
    assert prob0(mdp, target, maximise=maximise).tolist() == [x == 0 for x in truth]
    assert prob1(mdp, target, maximise=maximise).tolist() == [x == 1 for x in truth]
    found = reach_probability(mdp, target, maximise=maximise)
    assert exact.encloses(found.lower, truth, found.upper)
    assert (found.upper - found.lower).max() < 1e-12
    assert exact.reaching(mdp, tuple(found.policy.tolist()), goals) == truth


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("seed", SEEDS)
def test_totals_of_costs_are_those_of_all_policies(seed: int, sign: int) -> None:
    mdp = exact.small_process(seed, rewards=(-2 * sign, -sign, 0))
    every = [exact.total(mdp, policy) for policy in exact.policies(mdp)]
    truth = exact.best(every) if sign > 0 else exact.least(every)
    if abs(truth[0]) == math.inf:
        with pytest.raises(MDPError, match="the total from initial state 0 is infinite"):
            total_reward(mdp, maximise=sign > 0)
        return
    found = total_reward(mdp, maximise=sign > 0)
    known = ~np.isnan(found.value)
    kept = [x for x, there in zip(truth, known, strict=True) if there]
    assert exact.encloses(found.lower[known], kept, found.upper[known])
    assert known[0]
    attained = exact.total(mdp, tuple(found.policy.tolist()))
    assert [x for x, there in zip(attained, known, strict=True) if there] == kept


@pytest.mark.parametrize("seed", range(200))
def test_totals_of_gains_and_losses_are_exact_or_refused(seed: int) -> None:
    mdp = exact.small_process(seed, rewards=(-2, -1, 0, 1))
    every = [exact.total(mdp, policy) for policy in exact.policies(mdp)]
    try:
        found = total_reward(mdp)
    except MDPError as error:
        assert "total" in str(error)  # noqa: PT017
        values = [value for value in every if value is not None]
        best = exact.best(values) if values else [math.inf]
        assert None in every or math.inf in best or best[0] == -math.inf
        return
    truth = exact.best([value for value in every if value is not None])
    known = ~np.isnan(found.value)
    kept = [x for x, there in zip(truth, known, strict=True) if there]
    assert exact.encloses(found.lower[known], kept, found.upper[known])


@pytest.mark.parametrize("maximise", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_steps_are_those_of_all_policies(seed: int, maximise: bool) -> None:  # noqa: FBT001
    mdp = exact.small_process(seed, rewards=(1,))
    every = [exact.total(mdp, policy) for policy in exact.policies(mdp)]
    truth = exact.best(every) if maximise else exact.least(every)
    found = expected_steps(mdp, maximise=maximise)
    known = ~np.isnan(found.value)
    kept = [x for x, there in zip(truth, known, strict=True) if there]
    assert exact.encloses(found.lower[known], kept, found.upper[known])


@pytest.mark.parametrize("seed", SEEDS)
def test_finite_horizons_are_backward_induction(seed: int) -> None:
    mdp, gamma = exact.small_process(seed, rewards=(-3, 0, 2)), Fraction(3, 4)
    plan = finite_horizon(mdp, 4, gamma=float(gamma))
    value = [Fraction(0)] * mdp.n_states
    for n in range(5):
        assert exact.encloses(plan.value[n] - plan.bound, value, plan.value[n] + plan.bound)
        choices = [
            {a: sum(p * (r + gamma * value[t]) for p, t, r in exact.steps(mdp, s, a)) for a in row}
            for s, row in enumerate(np.flatnonzero(row).tolist() for row in mdp.feasible)
        ]
        if n < 4:
            value = [max(q.values(), default=Fraction(0)) for q in choices]
            best = [[a for a in q if q[a] == value[s]] or [-1] for s, q in enumerate(choices)]
            assert all(a in best[s] for s, a in enumerate(plan.policy[n].tolist()))


# --- the graph --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_strong_components_are_classes_of_states_that_reach_each_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    edges = [sorted(set(rng.integers(0, 9, rng.integers(0, 4)).tolist())) for _ in range(9)]
    start = np.cumsum([0, *(len(out) for out in edges)])
    target = np.array([t for out in edges for t in out], np.int32)
    component = strong_components(start, target)
    moves = [[(Fraction(1), t, Fraction(0)) for t in out] for out in edges]
    paths = [exact.leads(moves, s) for s in range(9)]
    for s in range(9):
        for t in range(9):
            assert (component[s] == component[t]) == (t in paths[s] and s in paths[t])
            assert t not in paths[s] or component[t] <= component[s]


@pytest.mark.parametrize("seed", SEEDS)
def test_end_components_are_the_largest_closed_sets(seed: int) -> None:
    mdp = exact.small_process(seed)
    choices = enabled_choices(mdp)
    pairs = list(zip(choices.state.tolist(), choices.action.tolist(), strict=True))
    found: list[set[tuple[int, int]]] = []
    for chosen in chained.from_iterable(combinations(pairs, n) for n in range(1, len(pairs) + 1)):
        states = {s for s, _ in chosen}
        moves = [[x for s, a in chosen if s == here for x in exact.steps(mdp, s, a)] for here in range(4)]
        if all(exact.leads(moves, s) == states for s in states):
            found.append(set(chosen))
    largest = [one for one in found if not any(one < other for other in found)]
    component, inner = end_components(
        choices.choice, choices.outcome, choices.target, np.ones(len(pairs), np.bool_)
    )
    for one in largest:
        numbers = {int(component[s]) for s, _ in one}
        assert len(numbers) == 1
        assert numbers.pop() >= 0
    assert {pair for pair, kept in zip(pairs, inner, strict=True) if kept} == set().union(*largest)
    assert component.max() + 1 == len(largest)


# --- properties -------------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(SMALL, st.sampled_from([0.0, 0.5, 0.9, 0.99, 0.9999]))
def test_policy_iteration_and_value_iteration_agree(seed: int, gamma: float) -> None:
    mdp = random_process(seed, states=6)
    one, two = value_iteration(mdp, gamma=gamma), policy_iteration(mdp, gamma=gamma)
    assert np.abs(one.value - two.value).max() <= one.bound + two.bound
    assert max(one.bound, two.bound) < 1e-6


@settings(max_examples=40)
@given(SMALL, SMALL)
def test_a_mask_never_helps(seed: int, other: int) -> None:
    mdp = exact.small_process(seed)
    mask, target = some_mask(mdp, other), some_target(mdp, other)
    plan, bare = value_iteration(mdp, gamma=0.9, enabled=mask), value_iteration(mdp, gamma=0.9)
    assert (plan.value - plan.bound <= bare.value + bare.bound).all()
    assert (reach_probability(mdp, target, enabled=mask).lower <= reach_probability(mdp, target).upper).all()
    assert (
        reach_probability(mdp, target, enabled=mask, maximise=False).upper
        >= reach_probability(mdp, target, maximise=False).lower
    ).all()


@settings(max_examples=40)
@given(SMALL)
def test_discounted_values_tend_to_the_total(seed: int) -> None:
    mdp = exact.small_process(seed)
    steps = expected_steps(mdp, maximise=True)
    if not np.isfinite(steps.value[~np.isnan(steps.value)]).all():
        return
    total, near = total_reward(mdp), policy_iteration(mdp, gamma=1 - 1e-7)
    known = ~np.isnan(total.value)
    most = 2 * steps.value[known].max() ** 2 * 1e-7 * 10
    assert np.abs(total.value - near.value)[known].max() <= most + near.bound + 1e-9


@settings(max_examples=40)
@given(SMALL)
def test_the_policies_are_worth_what_is_promised(seed: int) -> None:
    mdp = exact.small_process(seed)
    plan = policy_iteration(mdp, gamma=0.9)
    assert evaluate(mdp, plan.policy, gamma=0.9).value == pytest.approx(plan.value[0], abs=1e-11)
    steps = expected_steps(mdp)
    again = evaluate(mdp, steps.policy, gamma=0.9)
    assert again.expected_steps == pytest.approx(steps.value[0], rel=1e-11)


# --- hard ones --------------------------------------------------------------------------------------------


def ladder(rungs: int) -> TabularMDP:
    """Climb up or fall to the start, left or right: one end or the other, after 2^rungs tosses or so."""
    names = ("toss",)
    lines = []
    for side in (0, 1):
        at = [0, *range(1 + side * rungs, 1 + (side + 1) * rungs)]
        lines += [(s, "toss", t, 0.5, names) for s, t in pairwise(at[1:])]
        lines += [(s, "toss", 0, 0.5, names) for s in at[1:-1]]
        lines.append((0, "toss", at[1], 0.5, names))
    return from_outcomes(lines, alphabet=Alphabet(names), terminal=[rungs, 2 * rungs])


def test_a_long_way_does_not_deceive() -> None:
    mdp = ladder(24)
    target = subset(mdp, [24])
    found = reach_probability(mdp, target)
    assert found.lower[0] <= 0.5 <= found.upper[0]
    assert found.upper[0] - found.lower[0] < 1e-6
    steps = expected_steps(mdp)
    counted = replace(mdp, reward=np.ones(len(mdp.reward)))
    truth = exact.total(counted, tuple(np.where(mdp.terminal, -1, 0).tolist()))
    assert exact.encloses(steps.lower, truth, steps.upper)
    assert steps.value[0] > 2**24


def test_what_doubles_cannot_tell_is_refused() -> None:
    mdp = ladder(64)
    with pytest.raises(ConvergenceError, match="beyond double precision"):
        reach_probability(mdp, subset(mdp, [64]))


def wide(side: int) -> TabularMDP:
    """A square to cross, with a wind that blows to the side."""
    lines = []
    for s in range(side * side - 1):
        x, y = divmod(s, side)
        moves = [(1, 0), (0, 1), (-1, 0), (0, -1)]
        to = [min(max(x + dx, 0), side - 1) * side + min(max(y + dy, 0), side - 1) for dx, dy in moves]
        for a, name in enumerate("nesw"):
            lines += [(s, name, to[a], 0.75, (name,), -1.0), (s, name, to[(a + 1) % 4], 0.25, (name,), -1.0)]
    return from_outcomes(lines, alphabet=Alphabet(tuple("nesw")), terminal=[side * side - 1])


def random_layers(states: int, layers: int) -> TabularMDP:
    """Two actions of two outcomes each, within a layer but for a few; the last layer goes on for ever."""
    rng = np.random.default_rng(states)
    size = states // layers
    lines = []
    for s in range(states):
        for name in "ab":
            leap = rng.random(2) < 0.05
            to = np.minimum((s // size + leap) * size + rng.integers(0, size, 2), states - 1)
            p, reward = rng.random(), rng.random()
            lines += [
                (s, name, int(to[0]), p, (name,), reward),
                (s, name, int(to[1]), 1 - p, (name,), reward),
            ]
    return from_outcomes(lines, alphabet=Alphabet(("a", "b")))


@pytest.mark.parametrize("gamma", [0.9, 0.999, 1 - 1e-6])
@pytest.mark.parametrize("layers", [1, 4, 10])
def test_parts_that_leak_unevenly_are_found_too(layers: int, gamma: float) -> None:
    mdp = random_layers(120, layers)
    one, two = value_iteration(mdp, gamma=gamma), policy_iteration(mdp, gamma=gamma)
    assert np.abs(one.value - two.value).max() <= one.bound + two.bound
    assert one.bound <= max(1e-10, 1e-12 / (1 - gamma) ** 2)


def test_news_that_goes_round_a_ring_arrives() -> None:
    states, gamma = 200, 0.999
    ring = from_outcomes(
        [(s, "go", (s + 1) % states, 1.0, ("go",), float(s == 0)) for s in range(states)],
        alphabet=Alphabet(("go",)),
    )
    plan = value_iteration(ring, gamma=gamma)
    truth = gamma ** ((states - np.arange(states)) % states) / (1 - gamma**states)
    assert np.abs(plan.value - truth).max() <= plan.bound + 1e-14
    assert plan.bound < 1e-9


def test_a_first_policy_that_leaves_at_once_does_no_harm() -> None:
    out, go = ("out",), ("go",)
    lines = [(0, "out", 2, 1.0, out, 10.0), (0, "go", 1, 1.0, go, 0.0)]
    lines += [(1, "out", 2, 1.0, out, 1.0), (1, "go", 0, 1.0, go, 0.5)]
    mdp = from_outcomes(lines, alphabet=Alphabet(("out", "go")), terminal=[2])
    model, value = discounted(mdp, 0.5, None), np.zeros(3)
    settle(model, value, tolerance=1e-10, rounds=9)
    assert value.tolist() == [10.0, 5.5, 0.0]


def test_all_roads_lead_to_the_same_values() -> None:
    mdp = wide(7)
    total, steps = total_reward(mdp), expected_steps(mdp)
    np.testing.assert_allclose(total.value, -steps.value, rtol=1e-12)
    np.testing.assert_allclose(total.value, policy_iteration(mdp, gamma=1 - 1e-9).value, rtol=1e-6)
    for gamma in (0.9, 0.999):
        one, two = value_iteration(mdp, gamma=gamma), policy_iteration(mdp, gamma=gamma)
        np.testing.assert_allclose(one.value, two.value, atol=one.bound + two.bound)
        assert one.bound < 1e-7


# --- another program --------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(12))
def test_storm_finds_the_same(seed: int) -> None:
    pytest.importorskip("stormpy", minversion="2")
    mdp = exact.small_process(seed, states=30)
    handed = storm.hand_over(replace(mdp, reward=-mdp.reward), mdp.terminal)
    for maximise, word in ((True, "max"), (False, "min")):
        found = reach_probability(mdp, mdp.terminal, maximise=maximise)
        assert found.value == pytest.approx(storm.ask(handed, f'P{word}=? [F "target"]'), abs=1e-8)
    total = total_reward(mdp)
    known = ~np.isnan(total.value)
    costs = storm.ask(handed, 'R{"r"}min=? [C]')
    assert -total.value[known] == pytest.approx(costs[known], rel=1e-8, abs=1e-8)


# --- what is refused --------------------------------------------------------------------------------------


def looping(*rewards: float) -> TabularMDP:
    """A ring of states, one a reward, with a way out of the first."""
    n = len(rewards)
    lines = [(s, "go", (s + 1) % n, 1.0, ("go",), r) for s, r in enumerate(rewards)]
    return from_outcomes(
        [*lines, (0, "leave", n, 1.0, ("leave",), 0.0)], alphabet=Alphabet(("go", "leave")), terminal=[n]
    )


def test_totals_without_end_are_refused_by_name() -> None:
    with pytest.raises(
        MDPError, match="infinite: there is a gain to be made for ever by 'go' in 0, 'go' in 1"
    ):
        total_reward(looping(2.0, -1.0))
    with pytest.raises(MDPError, match="undefined: gains and losses cancel for ever by 'go' in 0, 'go' in 1"):
        total_reward(looping(1.0, -1.0))
    with pytest.raises(MDPError, match="infinite: there is a gain"):
        total_reward(looping(2.0, -1.0), enabled=np.array([[True, True], [True, False], [False, False]]))
    assert total_reward(looping(1.0, -2.0)).value.tolist() == [0.0, -2.0, 0.0]
    assert total_reward(looping(0.0, 0.0)).value.tolist() == [0.0, 0.0, 0.0]
    stuck = from_outcomes([(0, "go", 0, 1.0, ("go",), 1.0)], alphabet=Alphabet(("go",)))
    with pytest.raises(MDPError, match="no policy is sure to end after state 0, where 'go' can be repeated"):
        total_reward(stuck)


def test_bad_questions_say_what_is_wrong() -> None:
    mdp = exact.small_process(0)
    for ask in (reach_probability, prob0, prob1):
        with pytest.raises(
            MDPError, match=r"the target has shape \(3,\) and type bool; bool \(4,\) is needed"
        ):
            ask(mdp, np.zeros(3, np.bool_))
    with pytest.raises(MDPError, match="steps is -1"):
        finite_horizon(mdp, -1)
    with pytest.raises(MDPError, match="gamma is 1.5"):
        finite_horizon(mdp, 3, gamma=1.5)
    with pytest.raises(MDPError, match="gamma is 1"):
        policy_iteration(mdp, gamma=1.0)

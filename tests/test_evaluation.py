"""Policies against their definitions in exact fractions, and each rule's violation."""

from __future__ import annotations

from fractions import Fraction
from math import isinf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import exact
from processes import random_process, random_rule
from supremal import (
    Alphabet,
    TabularMDP,
    evaluate,
    from_outcomes,
    from_text,
    mark_all,
    product,
    value_iteration,
)
from supremal.decisions.chains import Chain, expected_total, resolvent
from supremal.decisions.product import broken_states

pytestmark = pytest.mark.engine
SEEDS = range(40)


def first_actions(mdp: TabularMDP) -> np.ndarray:
    return np.where(mdp.feasible.any(axis=1), mdp.feasible.argmax(axis=1), -1)


@pytest.mark.parametrize("seed", SEEDS)
def test_every_number_is_within_its_bound_of_the_exact_one(seed: int) -> None:
    mdp, gamma = exact.small_process(seed), Fraction(7, 8)
    policy = tuple(first_actions(mdp).tolist())
    got = evaluate(mdp, np.array(policy), gamma=float(gamma))
    assert abs(Fraction(got.value) - exact.discounted(mdp, policy, gamma)[0]) <= got.bound
    assert got.bound < 1e-12
    marked = set(np.flatnonzero(mdp.marked).tolist())
    assert abs(Fraction(got.completion) - exact.reaching(mdp, policy, marked)[0]) <= got.precision
    ends = exact.reaching(mdp, policy, set(np.flatnonzero(mdp.terminal).tolist()))[0] == 1
    assert isinf(got.expected_steps) != ends
    if ends:
        total = exact.total(mdp, policy)
        assert total is not None
        assert abs(Fraction(got.expected_return) - total[0]) <= got.precision * max(1, abs(total[0]))


@pytest.mark.parametrize("seed", SEEDS)
def test_each_rule_has_its_own_probability_of_being_broken(seed: int) -> None:
    rules = [random_rule(seed), random_rule(seed + 1000)]
    model = product(random_process(seed), rules)
    policy = first_actions(model)
    if (policy < 0).any() and (policy < 0).tolist() != model.terminal.tolist():
        return
    got = evaluate(model, policy, gamma=0.9)
    everywhere = tuple(policy.tolist())
    for column in range(1, 3):
        sinks = set(np.flatnonzero(model.origin[:, column] == -1).tolist())
        assert got.violations[column] == pytest.approx(float(exact.reaching(model, everywhere, sinks)[0]))
    assert got.violations[0] == got.violation
    assert got.violation == pytest.approx(
        float(exact.reaching(model, everywhere, set(np.flatnonzero(broken_states(model)).tolist()))[0])
    )


def test_rules_broken_at_once_count_each() -> None:
    sigma = Alphabet(("a", "b"))
    mdp = from_outcomes(
        [(0, "go", 1, 0.5, ("a",)), (0, "go", 1, 0.25, ("b",)), (0, "go", 1, 0.25, ("a", "b"))],
        alphabet=sigma,
        terminal=[1],
    )
    no_a, no_b = from_text("0 -b-> 0", alphabet=sigma), from_text("0 -a-> 0", alphabet=sigma)
    got = evaluate(product(mdp, [mark_all(no_a), mark_all(no_b)]), [0, 0, 0, 0], gamma=0.9)
    assert got.violation == 1.0
    assert got.violations.tolist() == [1.0, 0.75, 0.5]


@settings(max_examples=40)
@given(st.integers(0, 2**32))
def test_a_sure_distribution_is_its_policy(seed: int) -> None:
    mdp = random_process(seed)
    policy = value_iteration(mdp, gamma=0.9).policy
    sure = (np.arange(mdp.n_actions) == policy[:, None]).astype(np.float64)
    one, two = evaluate(mdp, policy, gamma=0.9, horizon=5), evaluate(mdp, sure, gamma=0.9, horizon=5)
    assert one.value == two.value
    assert one.expected_steps == two.expected_steps
    assert one.completion_within.tolist() == two.completion_within.tolist()


@settings(max_examples=40)
@given(st.integers(0, 2**32))
def test_a_mixture_is_worth_what_its_chain_is(seed: int) -> None:
    mdp = random_process(seed)
    rng = np.random.default_rng(seed)
    weights = np.where(mdp.feasible, rng.dirichlet(np.ones(2), mdp.n_states), 0.0)
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-300)
    matrix, reward = np.zeros((5, 5)), np.zeros(5)
    for s in range(5):
        for a in range(2):
            at = mdp.outcomes(s, a)
            np.add.at(matrix[s], mdp.next_state[at], weights[s, a] * mdp.prob[at])
            reward[s] += weights[s, a] * (mdp.prob[at] @ mdp.reward[at])
    truth = np.linalg.solve(np.eye(5) - 0.9 * matrix, reward)
    assert evaluate(mdp, weights, gamma=0.9).value == pytest.approx(truth[0], abs=1e-12)


@pytest.mark.parametrize("states", [1, 2, 40, 300])
def test_a_fair_walk_is_left_after_as_many_steps_as_the_book_says(states: int) -> None:
    """Feller, An Introduction to Probability Theory, chapter XIV: z (n - z) from z, until 0 or n."""
    inside = np.arange(states)
    source = np.concatenate([inside[1:], inside[:-1]])
    target = np.concatenate([inside[:-1], inside[1:]])
    order = np.argsort(source, kind="stable")
    start = np.searchsorted(source[order], np.arange(states + 1)).astype(np.int64)
    chain = Chain(start, target[order].astype(np.int32), np.full(order.size, 0.5))
    value, error = expected_total(resolvent(chain), np.ones(states))
    truth = (inside + 1) * (states - inside)
    assert (np.abs(value - truth) <= error).all()
    assert (error <= 1e-9 * truth).all()

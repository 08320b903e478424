"""The paper's experiment: what has to come out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from supremal import find_uncontrollable, safe_actions, universal
from supremal.task.experiment import Experiment, run
from supremal.task.summary import interval_means, summary
from supremal.task.task import Preset, pickup_delivery


def experiment(preset: Preset) -> Experiment:
    return run(pickup_delivery(preset), [0])


@pytest.fixture(scope="module")
def default() -> Experiment:
    return experiment("default")


@pytest.fixture(scope="module")
def published() -> Experiment:
    return experiment("published")


def test_both_rules_can_be_kept_on_the_grid_and_the_recovery_needs_it(default: Experiment) -> None:
    check = summary(default)["check"]
    assert check["verdict"] == "enforceable"
    assert [rule["controllable"] for rule in check["rules"]] == [True, True]
    assert [rule["without_plant"]["controllable"] for rule in check["rules"]] == [True, False]
    recovery = default.task.rules[1].automaton
    witness = find_uncontrollable(universal(recovery.alphabet), recovery)
    assert witness is not None
    assert (witness.word, witness.event, witness.spec_state) == (("d_u",), "d_u", "w1")


def test_the_greedy_policy_is_exactly_optimal(default: Experiment) -> None:
    result = summary(default)
    optimal, greedy = result["optimal"], result["greedy"]
    assert abs(greedy["gap"]) <= optimal["bound"] + greedy["bound"] < 1e-9
    assert greedy["completion"] == optimal["completion_within_limit"] == 1.0
    assert greedy["violation_probability"] == 0.0
    assert optimal["expected_steps"] == pytest.approx(41, abs=1e-8)
    assert optimal["steps_without_drop"] == pytest.approx(35, abs=1e-8)


def test_no_rule_is_broken_in_training_and_many_are_without_the_mask(default: Experiment) -> None:
    result = summary(default)
    assert result["training"]["violations"] == 0
    assert result["training"]["steps"] == default.results[0].lengths.sum() > 10_000_000
    assert result["training"]["final_epsilon"] == pytest.approx(0.0192, abs=5e-5)
    assert result["baseline"]["violations"] > 100_000
    assert result["baseline"]["greedy"]["violation_probability"] > 0.5


def test_on_the_grid_one_step_lookahead_is_enough(default: Experiment) -> None:
    np.testing.assert_array_equal(safe_actions(default.model, lookahead="one_step"), default.enabled)


def test_the_published_curves_come_out(published: Experiment) -> None:
    training = summary(published)["training"]
    assert training["score"][0] == pytest.approx(-980, abs=15)
    assert training["completion"][0] == pytest.approx(0, abs=0.002)
    assert training["completion"][-1] > 0.9
    assert training["score"][-1] > -310
    assert training["violations"] == 0


def test_intervals_average_and_the_last_may_be_short() -> None:
    assert interval_means(np.arange(5), 2).tolist() == [0.5, 2.5, 4.0]
    assert interval_means(np.empty(0)).tolist() == []


def test_a_task_can_be_run_shorter_and_on_several_seeds() -> None:
    task = pickup_delivery()
    short = run(replace(task, settings=replace(task.settings, episodes=200)), [1, 2])
    assert [entry["seed"] for entry in summary(short)["per_seed"]] == [1, 2]
    assert summary(short)["training"]["completion"] == [short.results[0].completed.mean()]

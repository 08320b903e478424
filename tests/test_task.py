"""The paper's experiment: what has to come out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from supremal import (
    find_uncontrollable,
    is_same_language,
    meet,
    prefix_closure,
    safe_actions,
    universal,
)
from supremal.envs import PickupDelivery
from supremal.errors import MDPError, ModelError
from supremal.rules.patterns import never_sequence, only_sequence
from supremal.task.comparison import comparison
from supremal.task.experiment import Experiment, check, run
from supremal.task.reading import read_task
from supremal.task.summary import interval_means, summary
from supremal.task.task import REPORTABLE, Reported, Task

EXAMPLES = Path(__file__).parents[1] / "examples"


def experiment(task: Task) -> Experiment:
    return run(task, check(task))


@pytest.fixture(scope="module")
def default() -> Experiment:
    return experiment(read_task(EXAMPLES / "pickup_delivery.toml"))


@pytest.fixture(scope="module")
def published() -> Experiment:
    return experiment(read_task(EXAMPLES / "pickup_delivery_published.toml"))


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
    assert optimal["steps_undisturbed"] == pytest.approx(35, abs=1e-8)


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
    assert interval_means(np.empty(0), 2).tolist() == []


def test_a_task_can_be_run_shorter_and_on_several_seeds(default: Experiment) -> None:
    settings = replace(default.task.settings, episodes=200)
    short = run(replace(default.task, settings=settings, seed=1, seeds=2), default.findings)
    assert [entry["seed"] for entry in summary(short)["per_seed"]] == [1, 2]
    assert summary(short)["training"]["completion"] == [short.results[0].completed.mean()]


def test_the_task_file_says_what_the_environment_does(default: Experiment, published: Experiment) -> None:
    for task, preset in ((default.task, "default"), (published.task, "published")):
        machine, own = task.reward_machine, PickupDelivery(preset=preset).reward_machine()  # type: ignore[arg-type]
        assert machine is not None
        assert (machine.states, machine.propositions) == (own.states, own.propositions)
        np.testing.assert_array_equal(machine.delta, own.delta)
        np.testing.assert_array_equal(machine.reward, own.reward)


def test_the_paper_s_automata_are_patterns(default: Experiment) -> None:
    sigma = default.task.alphabet
    turns, recovery = (rule.automaton for rule in default.task.rules)
    own = turns.alphabet
    both = [never_sequence([turn, turn], alphabet=own) for turn in ("l", "r")]
    assert is_same_language(meet(*both), turns)
    pattern = only_sequence("d_u", ["d2", "d3", "p1", "p2", "p3"], alphabet=sigma)
    assert is_same_language(prefix_closure(pattern), recovery)


def test_what_a_source_may_report_is_in_every_summary(default: Experiment) -> None:
    result = summary(default)
    rows = [Reported(key, "said", key, style="answer") for key in REPORTABLE]
    assert all(row["here"] != "–" for row in comparison(result, rows))
    with pytest.raises(ModelError, match=r"a result has no 'greedy.gab'; did you mean 'greedy.gap'"):
        Reported("gap", 0.0, "greedy.gab")
    with pytest.raises(ModelError, match="'check.verdict' is no number; give style = \"answer\""):
        Reported("kept", "yes", "check.verdict")


def test_without_chances_there_is_nothing_to_learn(default: Experiment) -> None:
    with pytest.raises(MDPError, match=r"has no \[environment\], so nothing can be learned; say how likely"):
        check(replace(default.task, environment=None))

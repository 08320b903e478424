"""The model checker Storm finds the same on both of the paper's examples, and on 200 random products.

Every product is cut down to what its supervisor enables.  Discounted values are asked for in two ways: by
Storm's own operator, and as the total of a process that ends after each step with probability 1 - γ.  Storm's
sound methods are wrong for totals of negative rewards, so it is asked for totals of costs, or of gains.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path

import numpy as np
import pytest

import storm
from supremal import TabularMDP, value_iteration
from supremal.decisions.mdp import restrict
from supremal.decisions.optimum import Optimum, expected_steps, reach_probability, total_reward
from supremal.decisions.safety import reachable_states
from supremal.task.experiment import supervise
from supremal.task.reading import read_task
from test_whole import whole_of

pytest.importorskip("stormpy", minversion="2")

EXAMPLES = Path(__file__).parents[1] / "examples"
NAMES = ("pickup_delivery", "manufacturing_cell")
SEEDS = range(200)
PRECISE = 10 * storm.PRECISION


@dataclass(frozen=True)
class Supervised:
    """A product, its mask, and a discount factor."""

    mdp: TabularMDP
    mask: np.ndarray
    gamma: float

    @cached_property
    def left(self) -> TabularMDP:
        """What the mask enables."""
        return restrict(self.mdp, self.mask)

    @cached_property
    def reached(self) -> np.ndarray:
        """The states that it reaches."""
        return reachable_states(self.mdp, self.mask)


@cache
def example(name: str) -> Supervised:
    task = read_task(EXAMPLES / f"{name}.toml")
    assert task.environment is not None
    return Supervised(*supervise(task.environment, task), task.settings.gamma)


def random_product(seed: int) -> Supervised:
    """A product of 2 to 80 states under its mask, which leaves something to choose."""
    while True:
        whole = whole_of(seed, states=12)
        if (whole.mask.sum(axis=1) > 1).any():
            return Supervised(whole.mdp, whole.mask, 0.9)
        seed += len(SEEDS)


def earning(mdp: TabularMDP, reward: np.ndarray | float) -> TabularMDP:
    return replace(mdp, reward=np.broadcast_to(reward, mdp.prob.shape).astype(np.float64))


def mortal(mdp: TabularMDP, gamma: float) -> TabularMDP:
    """The process that ends after each step with probability 1 - γ, in one more state; rewards stay."""
    counts = np.diff(mdp.row)
    used = counts > 0
    end, slot = mdp.row[1:][used], np.repeat(np.arange(counts.size), counts)
    mean = np.bincount(slot, mdp.prob * mdp.reward, counts.size)[used]
    return replace(
        mdp,
        row=np.append(mdp.row + np.append(0, np.cumsum(used)), [mdp.row[-1] + used.sum()] * mdp.n_actions),
        next_state=np.insert(mdp.next_state, end, mdp.n_states),
        prob=np.insert(mdp.prob * gamma, end, 1 - gamma),
        reward=np.insert(mdp.reward, end, mean),
        word=np.insert(mdp.word, end, 0),
        terminal=np.append(mdp.terminal, True),
        marked=np.append(mdp.marked, False),
        label=np.append(mdp.label, 0),
        initial=np.append(mdp.initial, 0.0),
        origin=np.append(mdp.origin, mdp.origin[:1], axis=0),
    )


def check_discounted(one: Supervised) -> None:
    """The best and the worst discounted value, by both ways."""
    left = one.left
    gain = left.reward - left.reward.min(initial=0.0)
    ends = mortal(earning(left, gain), one.gamma)
    asked = (
        (left.reward, storm.hand_over(left, left.terminal), f"Cdiscount={one.gamma}"),
        (gain, storm.hand_over(ends, ends.terminal), "C"),
    )
    for reward, handed, total in asked:
        for sign, word in ((1, "max"), (-1, "min")):
            plan = value_iteration(earning(left, sign * reward), gamma=one.gamma)
            told = storm.ask(handed, f'R{{"r"}}{word}=? [{total}]')[: left.n_states]
            assert np.abs(sign * told - plan.value)[one.reached].max() <= plan.bound + PRECISE


def check_reaching(one: Supervised) -> None:
    handed = storm.hand_over(one.left, one.left.marked)
    for maximise, word in ((True, "max"), (False, "min")):
        found = reach_probability(one.mdp, one.mdp.marked, enabled=one.mask, maximise=maximise)
        check(found, storm.ask(handed, f'P{word}=? [F "target"]'), one.reached)


def check_steps(one: Supervised) -> None:
    handed = storm.hand_over(earning(one.left, 1.0), one.left.terminal)
    for maximise, word in ((True, "max"), (False, "min")):
        found = expected_steps(one.mdp, enabled=one.mask, maximise=maximise)
        check(found, storm.ask(handed, f'R{{"r"}}{word}=? [F "target"]'), one.reached)


def check_costs(one: Supervised) -> None:
    """The least total of costs; in all of these processes some policy is sure to end."""
    cost = one.mdp.reward.max(initial=0.0) - one.mdp.reward
    found = total_reward(earning(one.mdp, -cost), enabled=one.mask)
    handed = storm.hand_over(restrict(earning(one.mdp, cost), one.mask), one.mdp.terminal)
    check(found, -storm.ask(handed, 'R{"r"}min=? [C]'), one.reached)


def check(found: Optimum, told: np.ndarray, reached: np.ndarray) -> None:
    """What Storm tells lies within our bounds, up to its own precision."""
    known = reached & ~np.isnan(found.value)
    assert known[reached].any()
    slack = PRECISE * np.where(np.isinf(told[known]), 0, np.maximum(1, np.abs(told[known])))
    assert (found.lower[known] <= told[known] + slack).all()
    assert (told[known] <= found.upper[known] + slack).all()


@pytest.mark.parametrize("name", NAMES)
def test_discounted_values_of_the_examples(name: str) -> None:
    check_discounted(example(name))


@pytest.mark.parametrize("name", NAMES)
def test_reach_probabilities_of_the_examples(name: str) -> None:
    check_reaching(example(name))


def test_steps_and_costs_on_the_grid() -> None:
    """The cell never comes to an end."""
    check_steps(example("pickup_delivery"))
    check_costs(example("pickup_delivery"))


@pytest.mark.parametrize("seed", SEEDS)
def test_random_products(seed: int) -> None:
    one = random_product(seed)
    for questions in (check_discounted, check_reaching, check_steps, check_costs):
        questions(one)

"""Algorithm 1 on the paper's experiment: the compiled kernel beside a loop over Gymnasium, and a bound.

Kernel and loop learn with the same settings on one core.  The loop is what a careful user would write: tables
in dictionaries and lists, the rules as transition lists, no array in the inner loop.

The bound is a kernel that does not learn: it draws the same numbers, takes any enabled action, and follows
its outcomes through the same tables.  Nothing that learns one step after the other can be quicker.
"""

from __future__ import annotations

import random
from pathlib import Path
from time import perf_counter
from typing import Any

import gymnasium
import numpy as np

import supremal.envs
from supremal import Automaton, Settings, q_learning
from supremal._jit import kernel
from supremal.learning._kernels import _GOLDEN, choose, pick, uniform
from supremal.learning.course import Course, lay_out
from supremal.task.experiment import supervise
from supremal.task.reading import read_task
from supremal.task.summary import interval_means
from supremal.task.task import Task

EXAMPLES = Path(__file__).parents[1] / "examples"
LOOP_EPISODES = 3_000
BOUND_EPISODES = 200_000
REPEATS = 5


@kernel
def follow(
    outcome: np.ndarray, step: np.ndarray, start: np.ndarray, limit: int, episodes: int, rng: np.uint64
) -> int:
    """Return the steps of so many episodes under a policy that takes any action."""
    total = 0
    for _ in range(episodes):
        rng += _GOLDEN
        x = start[pick(start, 0, start.shape[0], uniform(rng))]
        first, count, steps = x["first"], x["count"], 0
        while steps < limit and count:
            rng += _GOLDEN
            c = choose(first, first, count, 1.0, uniform(rng))
            o = np.int64(outcome[c])
            if outcome[c + 1] - o > 1:
                rng += _GOLDEN
                o = pick(step, o, outcome[c + 1], uniform(rng))
            first, count = step[o]["first"], step[o]["count"]
            steps += 1
        total += steps
    return total


def bound(course: Course, settings: Settings) -> float:
    """Return the steps a second that the walk alone takes."""
    began = perf_counter()
    steps = follow(
        course.outcome, course.step, course.start, settings.episode_steps, BOUND_EPISODES, np.uint64(1)
    )
    return steps / (perf_counter() - began)


class PlainLearner:
    """Algorithm 1, line by line, over ``supremal/PickupDelivery-v0``."""

    def __init__(self, task: Task) -> None:
        supremal.envs.register()
        self.env = gymnasium.make("supremal/PickupDelivery-v0", disable_env_checker=True)
        assert task.environment is not None
        self.names = task.environment.actions
        self.rules = [self.lists(rule.automaton) for rule in task.rules]
        self.settings = task.settings
        self.q: dict[tuple[Any, ...], list[float]] = {}
        self.allowed: dict[tuple[Any, ...], list[int]] = {}

    @staticmethod
    def lists(rule: Automaton) -> tuple[dict[str, int], list[list[int]]]:
        return {name: e for e, name in enumerate(rule.alphabet)}, rule.delta.tolist()

    def step_rules(self, states: tuple[int, ...], word: tuple[str, ...]) -> tuple[int, ...]:
        after = []
        for state, (number, delta) in zip(states, self.rules, strict=True):
            q = state
            for name in word:
                if q >= 0 and name in number:
                    q = delta[q][number[name]]
            after.append(q)
        return tuple(after)

    def enabled(self, key: tuple[Any, ...], mask: Any, states: tuple[int, ...]) -> list[int]:  # noqa: ANN401
        if key not in self.allowed:
            self.allowed[key] = [
                a
                for a, name in enumerate(self.names)
                if mask[a] and min(self.step_rules(states, (name,))) >= 0
            ]
            self.q[key] = [0.0] * len(self.allowed[key])
        return self.allowed[key]

    def run(self, episodes: int, seed: int) -> tuple[int, float]:
        """Return the steps taken and the seconds they took."""
        rng, alpha, gamma = random.Random(seed), self.settings.alpha, self.settings.gamma
        steps, began = 0, perf_counter()
        self.env.reset(seed=seed)
        for episode in range(episodes):
            epsilon = self.settings.epsilon_at(episode)
            observation, info = self.env.reset()
            states: tuple[int, ...] = (0,) * len(self.rules)
            key = (*observation.tolist(), *states)
            actions = self.enabled(key, info["action_mask"], states)
            done = False
            while not done:
                row = self.q[key]
                c = rng.randrange(len(row)) if rng.random() < epsilon else row.index(max(row))
                observation, reward, terminated, truncated, info = self.env.step(actions[c])
                states = self.step_rules(states, info["events"])
                key = (*observation.tolist(), *states)
                actions = self.enabled(key, info["action_mask"], states)
                best = 0.0 if terminated else max(self.q[key])
                row[c] += alpha * (float(reward) + gamma * best - row[c])
                done = terminated or truncated
                steps += 1
        return steps, perf_counter() - began


def run() -> dict[str, Any]:
    """Print both speeds and their ratio; return the record."""
    task = read_task(EXAMPLES / "pickup_delivery.toml")
    assert task.environment is not None
    model, enabled = supervise(task.environment, task)
    rules = [rule.automaton for rule in task.rules]
    q_learning(model, enabled=enabled, rules=rules, settings=Settings(episodes=1))
    plain = PlainLearner(task)
    plain_steps, plain_seconds = plain.run(LOOP_EPISODES, seed=0)
    course = lay_out(model, enabled, rules, task.settings, task.environment)
    bound(course, task.settings)
    runs, bounds = [], []
    for seed in range(REPEATS):
        runs.append(q_learning(model, enabled=enabled, rules=rules, settings=task.settings, seed=seed))
        bounds.append(bound(course, task.settings))
    rates = [float(result.lengths.sum()) / result.seconds for result in runs]
    rate, plain_rate = float(np.median(rates)), plain_steps / plain_seconds
    best, seconds, steps = max(rates), min(one.seconds for one in runs), int(runs[0].lengths.sum())
    print(f"compiled kernel, one core     {rate / 1e6:10.2f} million steps/s (best {best / 1e6:.2f})")
    bound_rate = float(np.median(bounds))
    print(f"walking without learning      {bound_rate / 1e6:10.2f} million steps/s")
    print(f"plain loop over Gymnasium     {plain_rate / 1e6:10.4f} million steps/s")
    print(f"ratio                         {rate / plain_rate:10.0f}")
    print(f"the paper's whole simulation  {seconds:10.2f} s ({steps:,} steps)")
    return {
        "kernel_steps_per_second": rate,
        "kernel_best_steps_per_second": best,
        "bound_steps_per_second": bound_rate,
        "bound_best_steps_per_second": max(bounds),
        "plain_loop_steps_per_second": plain_rate,
        "ratio": rate / plain_rate,
        "simulation_seconds": [result.seconds for result in runs],
        "final_score": [float(interval_means(result.returns, task.interval)[-1]) for result in runs],
    }

"""Learners beside each other: steps to the optimum with and without counterfactual steps, speed, memory.

*Steps to the optimum*: the steps in the environment until the value of the greedy policy, evaluated exactly,
is within a hundredth of the best there is.  It is looked at every 100 episodes, for five seeds, and the
median is given; with and without counterfactual steps all other settings are those of the task.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.learning import EXAMPLES
from supremal import TabularMDP, evaluate, q_learning, q_learning_seeds, value_iteration
from supremal.decisions.planning import enabled_choices, greedy
from supremal.learning.checkpoints import LearnerState, load_state, save_state
from supremal.learning.settings import ALGORITHMS, Settings
from supremal.learning.statistics import interquartile_mean
from supremal.task.experiment import supervise
from supremal.task.reading import read_task
from supremal.task.task import Task

TASKS = ("pickup_delivery", "pickup_delivery_published", "taxi", "frozen_lake", "manufacturing_cell")
TOLERANCE = 1e-2
LOOK_EVERY = 100
SEEDS = range(5)


def policy_of(mdp: TabularMDP, enabled: np.ndarray) -> Callable[[LearnerState], np.ndarray]:
    """Return how the greedy policy of a learner's state is read off."""
    choices = enabled_choices(mdp, enabled)

    def policy(state: LearnerState) -> np.ndarray:
        q = np.full((mdp.n_states, mdp.n_actions), -np.inf)
        q[choices.state, choices.action] = state.q.reshape(state.settings.tables, -1).mean(axis=0)
        return greedy(q)

    return policy


def steps_to_optimum(
    task: Task, mdp: TabularMDP, enabled: np.ndarray, settings: Settings, seed: int, every: int = LOOK_EVERY
) -> float:
    """Return the steps until the greedy policy is as good as the best; inf where it never is.

    It is looked at every so many episodes.
    """
    best = float(value_iteration(mdp, gamma=settings.gamma, enabled=enabled).value @ mdp.initial)
    policy, steps = policy_of(mdp, enabled), [np.inf]

    def look(state: LearnerState) -> None:
        value = evaluate(mdp, policy(state), gamma=settings.gamma).value
        if steps[0] == np.inf and best - value <= TOLERANCE * abs(best):
            steps[0] = float(state.lengths.sum())

    q_learning(
        mdp,
        enabled=enabled,
        settings=settings,
        seed=seed,
        environment=task.environment,
        on_state=look,
        checkpoint_every=every,
        should_stop=lambda: steps[0] < np.inf,
    )
    return steps[0]


def sample_efficiency() -> dict[str, Any]:
    """Print and return the steps to the optimum on each task."""
    record: dict[str, Any] = {}
    print(f"{'steps to the optimum':30}{'by itself':>14}{'counterfactual':>16}{'fewer':>8}")
    for name in TASKS:
        task = read_task(EXAMPLES / f"{name}.toml")
        assert task.environment is not None
        mdp, enabled = supervise(task.environment, task)
        found = {
            way: [
                steps_to_optimum(task, mdp, enabled, replace(task.settings, counterfactual=on), seed)
                for seed in SEEDS
            ]
            for way, on in (("by itself", False), ("counterfactual", True))
        }
        plain, taught = (float(np.median(steps)) for steps in found.values())
        fewer = f"{plain / taught:8.1f}" if plain < np.inf else ""
        print(f"{name:30}{_said(plain):>14}{_said(taught):>16}{fewer}", flush=True)
        record[name] = {way: [x if x < np.inf else None for x in steps] for way, steps in found.items()}
    return record


def _said(steps: float) -> str:
    return f"{steps:,.0f}" if steps < np.inf else "never"


def speeds(mdp: TabularMDP, enabled: np.ndarray, task: Task) -> dict[str, float]:
    """Print and return the steps a second of each learner."""
    record = {}
    ways = [(algorithm, {}) for algorithm in ALGORITHMS]
    ways += [("q_learning", {"precision": "float32"}), ("q_learning", {"counterfactual": True})]
    for algorithm, said in ways:
        settings = replace(task.settings, episodes=50_000, algorithm=algorithm, **said)
        rates = []
        for seed in SEEDS:
            one = q_learning(mdp, enabled=enabled, settings=settings, seed=seed, environment=task.environment)
            rates.append(float(one.lengths.sum()) / one.seconds)
        name = " ".join(
            [algorithm, *(str(value) if key == "precision" else key for key, value in said.items())]
        )
        record[name] = interquartile_mean(rates)
        print(f"{name:30}{record[name] / 1e6:10.2f} million steps/s")
    return record


def memory(mdp: TabularMDP, enabled: np.ndarray, task: Task) -> dict[str, float]:
    """Print and return the bytes a state that learning takes at its peak, in both precisions."""
    record = {}
    for precision in ("float64", "float32"):
        settings = replace(task.settings, episodes=1, precision=precision)
        q_learning(mdp, enabled=enabled, settings=settings)
        tracemalloc.start()
        q_learning(mdp, enabled=enabled, settings=settings)
        record[precision] = tracemalloc.get_traced_memory()[1] / mdp.n_states
        tracemalloc.stop()
        print(f"memory, {precision:22}{record[precision]:10.0f} bytes a state")
    return record


def side_by_side(mdp: TabularMDP, enabled: np.ndarray, task: Task) -> float:
    """Print and return how much sooner two seeds are done on two cores than on one."""
    ratios = []
    for _ in SEEDS:
        spent = []
        for workers in (1, 2):
            began = perf_counter()
            q_learning_seeds(mdp, [0, 1], enabled=enabled, settings=task.settings, workers=workers)
            spent.append(perf_counter() - began)
        ratios.append(spent[0] / spent[1])
    print(f"two seeds on two cores        {max(ratios):10.2f} times as fast (median {np.median(ratios):.2f})")
    return max(ratios)


def checkpoints(mdp: TabularMDP, enabled: np.ndarray, task: Task) -> dict[str, float]:
    """Print and return how large a checkpoint is, and how long it takes to write and to read."""
    kept: list[LearnerState] = []
    q_learning(mdp, enabled=enabled, settings=task.settings, on_state=kept.append)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "learner.npz"
        times = [perf_counter()]
        for act in (lambda: save_state(path, kept[0]), lambda: load_state(path)):
            act()
            times.append(perf_counter())
        written, read = np.diff(times).tolist()
        size = path.stat().st_size
    print(
        f"a checkpoint                  {size / 1e6:10.2f} MB, {written:.3f} s to write, {read:.3f} s to read"
    )
    return {"bytes": size, "write_seconds": written, "read_seconds": read}


def run() -> dict[str, Any]:
    """Print all tables; return the record."""
    task = read_task(EXAMPLES / "pickup_delivery.toml")
    assert task.environment is not None
    mdp, enabled = supervise(task.environment, task)
    return {
        "steps_per_second": speeds(mdp, enabled, task),
        "bytes_per_state": memory(mdp, enabled, task),
        "two_seeds_on_two_cores": side_by_side(mdp, enabled, task),
        "checkpoint": checkpoints(mdp, enabled, task),
        "steps_to_optimum": sample_efficiency(),
    }

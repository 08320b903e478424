"""Thirty seeds of the paper's experiment, with each learner, and with the published program's own settings.

*Optimal*: the greedy policy's value, evaluated exactly, is the best there is, within the bounds of both.
*To the optimum*: the steps until it is within a hundredth for the first time; the median.  *Score*: what an
episode of the last interval earned, exploring steps and all; *regret*: what all of them earned less than the
best policy within as many steps would have.  Both are interquartile means.  Intervals hold 95 %, by the
bootstrap over seeds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.learners import steps_to_optimum
from benchmarks.learning import EXAMPLES
from supremal import TabularMDP, evaluate, q_learning_seeds, value_iteration
from supremal.decisions.horizon import finite_horizon
from supremal.learning.q_learning import QResult
from supremal.learning.settings import ALGORITHMS, Settings
from supremal.learning.statistics import bootstrap_interval, interquartile_mean, regret
from supremal.task.experiment import supervise
from supremal.task.reading import read_task
from supremal.task.summary import interval_means
from supremal.task.task import Task

TASKS = {"pickup_delivery": 100, "pickup_delivery_published": 1_000}
"""Their files, and after how many episodes each is looked at again."""
SEEDS = range(30)
RESAMPLES = 1000
COUNTERFACTUAL = "q_learning, counterfactual"
WAYS: dict[str, dict[str, Any]] = {name: {"algorithm": name} for name in ALGORITHMS}
WAYS[COUNTERFACTUAL] = {"counterfactual": True}
Statistic = Callable[[np.ndarray], float]


def ratio_of_medians(scores: np.ndarray) -> float:
    """Return how many times the second column goes into the first."""
    one, other = np.median(scores, axis=0)
    return float(one / other)


def spread(scores: Sequence[float] | np.ndarray, statistic: Statistic = interquartile_mean) -> list[float]:
    """Return a statistic of the runs, and the ends of its interval."""
    given = np.asarray(scores, np.float64)
    return [float(statistic(given)), *bootstrap_interval(given, statistic, resamples=RESAMPLES)]


def gaps(mdp: TabularMDP, enabled: np.ndarray, gamma: float, results: list[QResult]) -> dict[str, Any]:
    """Return how many greedy policies are as good as the best, and by how much the worst falls short."""
    plan = value_iteration(mdp, gamma=gamma, enabled=enabled)
    found = [evaluate(mdp, result.policy, gamma=gamma) for result in results]
    short = [float(plan.value @ mdp.initial) - one.value for one in found]
    optimal = [gap <= plan.bound + one.bound for gap, one in zip(short, found, strict=True)]
    return {"optimal": int(sum(optimal)), "largest_gap": max(short), "bound": plan.bound}


def learned(task: Task, mdp: TabularMDP, enabled: np.ndarray, settings: Settings) -> dict[str, Any]:
    """Return what thirty runs came to."""
    results = q_learning_seeds(
        mdp,
        SEEDS,
        enabled=enabled,
        rules=[rule.automaton for rule in task.rules],
        settings=settings,
        environment=task.environment,
    )
    best = finite_horizon(mdp, settings.episode_steps, enabled=enabled).value[-1] @ mdp.initial
    curves = np.array([interval_means(result.returns, task.interval) for result in results])
    return {
        **gaps(mdp, enabled, settings.gamma, results),
        "violations": int(sum(result.violations.sum() for result in results)),
        "score": spread(curves[:, -1]),
        "regret": spread([regret(one.returns, best, interval=settings.episodes)[-1] for one in results]),
        "curve": [[round(x, 2) for x in spread(point)] for point in curves.T],
    }


def told(name: str, found: dict[str, Any]) -> str:
    """Return a row of the table."""
    steps, low, high = (f"{x:,.0f}" for x in found["steps"])
    score, regret_ = (found[key] for key in ("score", "regret"))
    return (
        f"{name:28}{found['optimal']:>4} of {len(SEEDS)}{steps:>12} ({low}–{high})"
        f"{score[0]:10.1f} ({score[1]:.1f}–{score[2]:.1f})"
        f"{regret_[0] / 1e6:9.3f} ({regret_[1] / 1e6:.3f}–{regret_[2] / 1e6:.3f})"
    )


def run() -> dict[str, Any]:
    """Print the tables; return the record."""
    record: dict[str, Any] = {"seeds": len(SEEDS)}
    for name, every in TASKS.items():
        task = read_task(EXAMPLES / f"{name}.toml")
        assert task.environment is not None
        mdp, enabled = supervise(task.environment, task)
        print(f"{task.name:28}{'optimal':>10}{'to the optimum':>16}{'score':>20}{'regret, millions':>24}")
        record[task.name] = rows = {}
        for way, said in WAYS.items():
            settings = replace(task.settings, **said)
            look = partial(steps_to_optimum, task, mdp, enabled, settings, every=every)
            with ThreadPoolExecutor() as pool:
                arrived = list(pool.map(look, SEEDS))
            assert max(arrived) < np.inf
            rows[way] = {"arrived": arrived, "steps": spread(arrived, np.median)}
            rows[way] |= learned(task, mdp, enabled, settings)
            print(told(way, rows[way]), flush=True)
        both = np.array([rows[way]["arrived"] for way in ("q_learning", COUNTERFACTUAL)]).T
        rows["fewer_steps"] = fewer = spread(both, ratio_of_medians)
        print("counterfactual steps need {:.2f} times fewer steps ({:.2f}–{:.2f})".format(*fewer))
    return record

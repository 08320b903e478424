"""One cell of a study: learn with a setting and a seed, and evaluate the greedy policy exactly.

What cells have in common is made once: a *world* is a task's product and its supervisor's mask, which all
settings share that change nothing but the learner.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock
from time import perf_counter
from typing import Final

import numpy as np

from supremal._arrays import Bools
from supremal.decisions.evaluation import evaluate
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import value_iteration
from supremal.decisions.product import product
from supremal.learning.q_learning import q_learning
from supremal.studies.study import Cell, Study
from supremal.task.experiment import check, rules_of, supervise
from supremal.task.task import Task

_KEPT: Final = 2
"""The worlds that are kept; cells come in the order of settings, so that few are in use at a time."""


@dataclass(frozen=True, slots=True)
class Row:
    """What came out of a cell; the numbers are None where the rules cannot be kept, or where not finite.

    Parameters
    ----------
    setting, seed
        The cell.
    verdict
        Whether the rules can be kept, as `supremal check` says it.
    value, gap
        What the greedy policy is worth, discounted, and how much less than the best.
    expected_return, expected_steps
        Those of an episode of the greedy policy.
    completion
        The probability that it completes the task within the steps of an episode.
    score
        What an episode of the training earned in the mean.
    violations, steps
        Rules broken while learning, and the steps that it took.
    seconds
        The time that the cell took, without making its world.
    """

    setting: int
    seed: int
    verdict: str
    value: float | None = None
    gap: float | None = None
    expected_return: float | None = None
    expected_steps: float | None = None
    completion: float | None = None
    score: float | None = None
    violations: int | None = None
    steps: int | None = None
    seconds: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """A task's ``model``, the one that is ``taught`` (rewards may be told earlier), and the mask of both."""

    verdict: str
    model: TabularMDP
    taught: TabularMDP
    enabled: Bools


class Worlds:
    """Makes worlds, and what is best in them, and keeps the last few; threads may share it.

    Parameters
    ----------
    model
        Gives the task of a number.
    """

    def __init__(self, model: Callable[[int], Task]) -> None:
        self._model, self._lock = model, Lock()
        self._kept: dict[int, tuple[Task, World | None]] = {}
        self._best: dict[tuple[int, float], float] = {}

    def get(self, number: int) -> tuple[Task, World | None]:
        """Return a task and its world; None where its rules cannot be kept."""
        with self._lock:
            found = self._kept.pop(number, None)
            if found is None:
                task = self._model(number)
                found = task, make_world(task)
            self._kept[number] = found  # the last in use
            while len(self._kept) > _KEPT:
                del self._kept[next(iter(self._kept))]
            return found

    def best(self, number: int, world: World, gamma: float) -> float:
        """Return what the best policy is worth."""
        with self._lock:
            if (number, gamma) not in self._best:
                plan = value_iteration(world.model, gamma=gamma, enabled=world.enabled)
                self._best[number, gamma] = float(world.model.initial @ plan.value)
            return self._best[number, gamma]


def make_world(task: Task) -> World | None:
    """Return the product of ``task`` and its supervisor; None where its rules cannot be kept."""
    verdict = check(task).verdict
    if task.environment is None or verdict == "not_enforceable":
        return None
    model, enabled = supervise(task.environment, task)
    taught = model if task.shaped is None else product(task.environment, rules_of(task), task.shaped)
    return World(verdict, model, taught, enabled)


def learn_cell(
    study: Study, worlds: Worlds, cell: Cell, should_stop: Callable[[], bool] | None = None
) -> Row | None:
    """Return what comes out of a cell, the same wherever and whenever; None where it was stopped.

    Raises
    ------
    MDPError
        If the task cannot be learned with the setting.
    """
    number, seed = cell
    setting = study.settings[number]
    task, world = worlds.get(setting.model)
    if world is None:
        return Row(number, seed, "not_enforceable")
    learner = setting.learner
    best = worlds.best(setting.model, world, learner.gamma)
    began = perf_counter()
    result = q_learning(
        world.taught,
        enabled=world.enabled,
        rules=rules_of(task),
        environment=task.environment,
        settings=learner,
        seed=seed,
        should_stop=should_stop,
    )
    if not result.finished:
        return None
    greedy = evaluate(world.model, result.policy, gamma=learner.gamma, horizon=learner.episode_steps)
    return Row(
        setting=number,
        seed=seed,
        verdict=world.verdict,
        value=greedy.value,
        gap=best - greedy.value,
        expected_return=_finite(greedy.expected_return),
        expected_steps=_finite(greedy.expected_steps),
        completion=float(greedy.completion_within[-1]),
        score=float(result.returns.mean()),
        violations=int(result.violations.sum()),
        steps=int(result.lengths.sum()),
        seconds=perf_counter() - began,
    )


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None

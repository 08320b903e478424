"""A study: a task, what varies in it, and the seeds that each setting is learned with.

A *setting* gives a value to every key that varies.  A *cell* is a setting and a seed; what comes out of it is
a function of the two alone, so it does not matter where, when and in which order cells are run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

from supremal.learning.settings import Settings
from supremal.task.task import Task

Metric: TypeAlias = Literal["gap", "value", "expected_return", "expected_steps", "completion", "score"]
Cell: TypeAlias = tuple[int, int]
"""The number of a setting, from 0, and a seed."""

LOWER_IS_BETTER: Final[dict[Metric, bool]] = {
    "gap": True,
    "value": False,
    "expected_return": False,
    "expected_steps": True,
    "completion": False,
    "score": False,
}
"""What settings can be ranked by, and whether a smaller number is better."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One of the settings of a study.

    Parameters
    ----------
    values
        What it gives to each key that varies.
    model
        The number of the task that it is learned on, among the study's ``models``.
    learner
        What the learner is set to.
    """

    values: dict[str, Any]
    model: int
    learner: Settings


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """What `read_study` returns.

    Parameters
    ----------
    name
        What files and messages call it.
    task
        The path of the task file.
    settings, seeds
        Each of the one is learned with each of the other.
    models
        The task as the settings change it, once for all that change nothing but the learner.
    metric
        What settings are ranked by.
    fingerprint
        A hash of all that the results depend on, besides the seeds.
    """

    name: str
    task: str
    settings: tuple[Setting, ...]
    seeds: tuple[int, ...]
    models: tuple[Task, ...]
    metric: Metric
    fingerprint: str

    @property
    def cells(self) -> list[Cell]:
        """All that there is to run, in order."""
        return [(number, seed) for number in range(len(self.settings)) for seed in self.seeds]

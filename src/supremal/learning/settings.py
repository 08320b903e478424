"""What a learner is set to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, get_args

import numpy as np

from supremal.decisions.planning import check_gamma
from supremal.errors import MDPError, suggest
from supremal.learning.schedules import Schedule

Algorithm: TypeAlias = Literal["q_learning", "double_q_learning", "sarsa", "expected_sarsa"]
Precision: TypeAlias = Literal["float64", "float32"]
Rate: TypeAlias = float | Schedule

ALGORITHMS: Final[tuple[Algorithm, ...]] = get_args(Algorithm)
PRECISIONS: Final[tuple[Precision, ...]] = get_args(Precision)


@dataclass(frozen=True, slots=True)
class Settings:
    """What a learner is set to; the defaults are those of the paper's experiment.

    Parameters
    ----------
    episodes, episode_steps
        How many episodes, and the most steps of one.
    alpha
        The learning rate, in (0, 1], or a `Schedule` of it.
    gamma
        The discount factor, in [0, 1).
    epsilon
        The chance of an exploring step, in [0, 1], or a `Schedule` of it.
    epsilon_decay, decay_every
        Where ε is a number, it is multiplied by the first, in (0, 1], after every so many episodes.
    algorithm
        "q_learning", "double_q_learning", "sarsa" or "expected_sarsa": see `q_learning`.
    counterfactual
        Whether each step also teaches the states in which rules and reward machine are elsewhere.
    precision
        The type of the learned values, "float64" or "float32".

    Raises
    ------
    MDPError
        If a setting is out of its range, or counterfactual steps are to teach SARSA.

    Examples
    --------
    >>> round(Settings().epsilon_at(500_000), 4)
    0.0192
    >>> Settings(alpha=Schedule.visits(0.8), epsilon=0.1, epsilon_decay=1.0).epsilon_at(500_000)
    0.1
    """

    episodes: int = 500_000
    episode_steps: int = 60
    alpha: Rate = 0.1
    gamma: float = 0.9
    epsilon: Rate = 0.25
    epsilon_decay: float = 0.95
    decay_every: int = 10_000
    algorithm: Algorithm = "q_learning"
    counterfactual: bool = False
    precision: Precision = "float64"

    def __post_init__(self) -> None:
        check_gamma(self.gamma)
        alpha = self.alpha.start if isinstance(self.alpha, Schedule) else self.alpha
        epsilon = 0.0 if isinstance(self.epsilon, Schedule) else self.epsilon
        for name, holds, right in (
            ("alpha", alpha is None or 0 < alpha <= 1, "a number above 0, at most 1,"),
            ("epsilon", 0 <= epsilon <= 1, "a number from 0 to 1"),
            ("epsilon_decay", 0 < self.epsilon_decay <= 1, "a number above 0, at most 1,"),
            ("episodes", self.episodes >= 1, "a whole number from 1"),
            ("episode_steps", self.episode_steps >= 1, "a whole number from 1"),
            ("decay_every", self.decay_every >= 1, "a whole number from 1"),
        ):
            if not holds:
                message = f"{name} is {getattr(self, name)}; {right} is needed"
                raise MDPError(message)
        if self.epsilon_schedule.kind == "visits":
            message = (
                "epsilon cannot go by visits of an action, which is chosen with it; use another schedule"
            )
            raise MDPError(message)
        for name, known in (("algorithm", ALGORITHMS), ("precision", PRECISIONS)):
            if getattr(self, name) not in known:
                value = getattr(self, name)
                message = f"unknown {name} {value!r}; {suggest(str(value), known)}"
                raise MDPError(message)
        if self.counterfactual and self.algorithm == "sarsa":
            message = (
                "counterfactual is on, but 'sarsa' learns only from actions that its own policy took; "
                "use 'q_learning', 'double_q_learning' or 'expected_sarsa'"
            )
            raise MDPError(message)

    @property
    def alpha_schedule(self) -> Schedule:
        """α in each episode."""
        return self.alpha if isinstance(self.alpha, Schedule) else Schedule.constant(self.alpha)

    @property
    def epsilon_schedule(self) -> Schedule:
        """ε in each episode."""
        if isinstance(self.epsilon, Schedule):
            return self.epsilon
        return Schedule.exponential(self.epsilon, self.epsilon_decay, episodes=self.decay_every)

    def epsilon_at(self, episode: int) -> float:
        """Return ε in the given episode, counted from 0."""
        return self.epsilon_schedule.at(episode)

    @property
    def counted(self) -> bool:
        """Whether α goes by visits, which have to be counted then."""
        return self.alpha_schedule.kind == "visits"

    @property
    def tables(self) -> int:
        """How many tables are learned: two by double Q-learning, else one."""
        return 2 if self.algorithm == "double_q_learning" else 1

    @property
    def dtype(self) -> np.dtype[np.floating]:
        """The type of the learned values."""
        return np.dtype(self.precision)

"""A learner at work: the arrays that its kernel writes to, episode after episode."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from datetime import timedelta
from time import perf_counter
from typing import Final

import numpy as np

from supremal._arrays import Bools, Floats, Ints, Longs
from supremal.errors import MDPError
from supremal.learning import _kernels
from supremal.learning.checkpoints import LearnerState, check_state
from supremal.learning.course import Course
from supremal.learning.settings import ALGORITHMS, Settings

_EPISODES: Final = 10_000
_STEPS: Final = 1_000_000
"""The most between two looks at the clock, the progress bar and Ctrl-C."""


@dataclass(slots=True, eq=False)
class Run:
    """One learner; the arrays of N episodes and of each choice are those of `LearnerState`."""

    course: Course
    settings: Settings
    seed: int
    seconds: float
    progress: np.ndarray
    q: Floats
    visits: Longs
    returns: Floats
    lengths: Ints
    completed: Bools
    violations: Ints
    model: str = ""

    @property
    def done(self) -> int:
        """How many episodes have been run."""
        return int(self.progress[1])

    def advance(self, until: int) -> None:
        """Run episodes up to number ``until``.

        The kernel itself writes down how far it has come, so that Ctrl-C, which Python hears of between two
        lines of its own, never finds values and number that do not go together.
        """
        course, settings = self.course, self.settings
        learn = _kernels.learner(
            ALGORITHMS.index(settings.algorithm), lessons=settings.counterfactual, counted=settings.counted
        )
        first = self.done
        began = perf_counter()
        with np.errstate(over="ignore"):  # the generator counts modulo 2⁶⁴ when it runs uncompiled too
            learn(
                course.outcome,
                course.step,
                course.start,
                course.verdict,
                course.owed,
                *(getattr(course.lessons, field.name) for field in fields(course.lessons)),
                settings.alpha_schedule.over(first, until),
                settings.epsilon_schedule.over(first, until),
                settings.alpha_schedule.power or 1.0,
                settings.gamma,
                settings.episode_steps,
                until,
                self.progress,
                self.q,
                self.visits,
                self.returns,
                self.lengths,
                self.completed,
                self.violations,
            )
        self.seconds += perf_counter() - began

    def state(self) -> LearnerState:
        """Return a copy of what it has in mind."""
        n = self.done
        self.model = self.model or self.course.fingerprint()
        return LearnerState(
            model=self.model,
            settings=self.settings,
            seed=self.seed,
            seconds=self.seconds,
            progress=self.progress,
            q=self.q,
            visits=self.visits,
            returns=self.returns[:n],
            lengths=self.lengths[:n],
            completed=self.completed[:n],
            violations=self.violations[:n],
        )


def begin(course: Course, settings: Settings, seed: int, state: LearnerState | None = None) -> Run:
    """Return a learner that knows nothing yet, or goes on from ``state``; its kernel is compiled."""
    n, values = settings.episodes, settings.tables * course.action.size
    run = Run(
        course,
        settings,
        seed,
        0.0,
        np.append(np.random.SeedSequence(seed).generate_state(1, np.uint64), np.uint64(0)),
        np.zeros(values, settings.dtype),
        np.zeros(values if settings.counted else 0, np.int64),
        np.zeros(n),
        np.zeros(n, np.int32),
        np.zeros(n, np.bool_),
        np.zeros(n, np.int32),
    )
    if state is not None:
        run.model = course.fingerprint()
        check_state(state, run.model, settings, seed)
        for name in ("progress", "q", "visits", "returns", "lengths", "completed", "violations"):
            array = getattr(state, name)
            getattr(run, name)[: array.size] = array
    run.advance(run.done)
    run.seconds = state.seconds if state else 0.0
    return run


def train(
    run: Run,
    *,
    on_episodes: Callable[[int], object] | None,
    should_stop: Callable[[], bool] | None,
    on_state: Callable[[LearnerState], object] | None,
    checkpoint_every: int | timedelta | None,
) -> None:
    """Run the episodes that are left, telling how far it has come."""
    n, chunk = run.settings.episodes, max(1, min(_EPISODES, _STEPS // run.settings.episode_steps))
    period = checkpoint_every if isinstance(checkpoint_every, int) else n
    pause = checkpoint_every.total_seconds() if isinstance(checkpoint_every, timedelta) else np.inf
    if period < 1 or pause < 0:
        message = f"checkpoint_every is {checkpoint_every}; a whole number from 1, or a time, is needed"
        raise MDPError(message)
    told, clock = run.done, perf_counter()
    try:
        while run.done < n and not (should_stop and should_stop()):
            run.advance(min(n, run.done + chunk, (run.done // period + 1) * period))
            if on_episodes:
                on_episodes(run.done)
            if on_state and (run.done % period == 0 or perf_counter() - clock >= pause):
                on_state(run.state())
                told, clock = run.done, perf_counter()
    finally:  # also after Ctrl-C
        if on_state and told != run.done:
            on_state(run.state())

"""Logs of learning, under the names that other programs know: a CSV file, or TensorBoard's event files.

A row is written for each interval of episodes; its step is the number of steps of the environment so far.

============================  ============================================================
``rollout/ep_rew_mean``       the mean return of an episode, undiscounted
``rollout/ep_len_mean``       the mean number of its steps
``rollout/exploration_rate``  ε in the last of these episodes, where the settings are given
``time/episodes``             episodes so far
``time/total_timesteps``      steps so far
``time/fps``                  steps a second, since the start
``supremal/violations``       how often a rule was broken in these episodes
``supremal/completion``       the share of them that were completed
============================  ============================================================

Source: the names are those of Stable-Baselines3's logger, as its documentation lists them; the columns of a
CSV file are those of its ``progress.csv``.
"""

from __future__ import annotations

import csv
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self

from supremal._arrays import Bools, Floats, Ints
from supremal.errors import MDPError, ModelError
from supremal.learning.settings import Settings


class Log(Protocol):
    """Where rows of scalars go."""

    def write(self, step: int, scalars: Mapping[str, float]) -> None:
        """Write what was measured at ``step``."""


class Curves(Protocol):
    """What has been run so far: a `QResult` or a `TableResult`, whose curves have an entry an episode."""

    @property
    def returns(self) -> Floats:
        """What each episode earned."""

    @property
    def lengths(self) -> Ints:
        """Its steps."""

    @property
    def completed(self) -> Bools:
        """Whether it was completed."""

    @property
    def violations(self) -> Ints:
        """How often a rule was broken in it."""

    @property
    def seconds(self) -> float:
        """How long all of them took."""


class _Closing(ABC):
    """A log that is closed at the end of a ``with`` block."""

    @abstractmethod
    def close(self) -> None:
        """Write what is left, and close the file."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class CsvLog(_Closing):
    """A log in a CSV file, a row at a time, so that it can be read while it grows.

    Parameters
    ----------
    path
        The file; one that is there is written over.

    Raises
    ------
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> path = Path(tempfile.mkdtemp()) / "progress.csv"
    >>> with CsvLog(path) as log:
    ...     log.write(60, {"rollout/ep_len_mean": 6.0, "rollout/ep_rew_mean": -1.5})
    ...     log.write(90, {"rollout/ep_len_mean": 3.0, "rollout/ep_rew_mean": -0.5})
    >>> print(path.read_text())
    step,rollout/ep_len_mean,rollout/ep_rew_mean
    60,6.0,-1.5
    90,3.0,-0.5
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self.path = Path(path)
        self._file = self.path.open("w", encoding="utf-8", newline="")
        self._rows = csv.writer(self._file, lineterminator="\n")
        self._names: tuple[str, ...] = ()

    def write(self, step: int, scalars: Mapping[str, float]) -> None:
        """Write what was measured at ``step``; the first row settles the columns.

        Raises
        ------
        ModelError
            If another row has other names.
        """
        if not self._names:
            self._names = tuple(scalars)
            self._rows.writerow(("step", *self._names))
        for name in (*scalars, *self._names):
            if name not in self._names or name not in scalars:
                other = "is no column" if name in scalars else "is missing"
                message = f"{self.path}: {name!r} {other}; the first row had {', '.join(self._names)}"
                raise ModelError(message)
        self._rows.writerow((step, *(scalars[name] for name in self._names)))
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class TensorBoardLog(_Closing):
    """A log in an event file, for TensorBoard to show.

    Parameters
    ----------
    folder
        Where the event file goes: one folder a run.

    Raises
    ------
    MissingDependencyError
        If tensorboard is not installed.
    """

    def __init__(self, folder: str | PathLike[str]) -> None:
        from supremal.formats import _tensorboard

        self._write = _tensorboard.write_scalars
        self._events = _tensorboard.open_events(Path(folder))

    def write(self, step: int, scalars: Mapping[str, float]) -> None:
        """Write what was measured at ``step``."""
        self._write(self._events, step, scalars)

    def close(self) -> None:
        """Write what is left, and close the file."""
        self._events.close()


def log_result(log: Log, result: Curves, interval: int, *, settings: Settings | None = None) -> None:
    """Write the curves of ``result`` to ``log``, one row for each ``interval`` episodes and one for the rest.

    Parameters
    ----------
    log
        A `CsvLog`, a `TensorBoardLog`, or anything else that can ``write``.
    result
        What a learner returned.
    interval
        How many episodes make a row.
    settings
        Those of the learner, for the exploration rate.

    Raises
    ------
    MDPError
        If the interval is not a whole number from 1.
    """
    _Rows(log, interval, settings).write(result, rest=True)


def log_live(log: Log, interval: int, *, settings: Settings | None = None) -> Callable[[Curves], None]:
    """Return an ``on_episodes`` for `table_learning` that writes each row as soon as its episodes are over.

    Parameters and errors are those of `log_result`.  Episodes that do not fill an interval at the end make no
    row.

    Examples
    --------
    >>> import gymnasium, sys
    >>> from supremal import Settings
    >>> from supremal.learning.tables import table_learning
    >>> class Printed:
    ...     def write(self, step, scalars):
    ...         print(step, scalars["time/episodes"], scalars["supremal/violations"])
    >>> env = gymnasium.make("CliffWalking-v1", max_episode_steps=10)
    >>> settings = Settings(episodes=450)
    >>> _ = table_learning(env, settings=settings, on_episodes=log_live(Printed(), 200, settings=settings))
    2000 200 0
    4000 400 0
    """
    rows = _Rows(log, interval, settings)
    return lambda result: rows.write(result, rest=False)


class _Rows:
    """What has been written of curves that grow."""

    def __init__(self, log: Log, interval: int, settings: Settings | None) -> None:
        if interval < 1:
            message = f"interval is {interval}; a whole number of episodes from 1 is needed"
            raise MDPError(message)
        self.log, self.interval, self.settings = log, interval, settings
        self.episodes = self.steps = 0

    def write(self, result: Curves, *, rest: bool) -> None:
        """Write the intervals that are full, and the ``rest``."""
        n = len(result.returns)
        while self.episodes + (1 if rest else self.interval) <= n:
            end = min(n, self.episodes + self.interval)
            part = slice(self.episodes, end)
            self.episodes, self.steps = end, self.steps + int(result.lengths[part].sum())
            scalars = {
                "rollout/ep_rew_mean": float(result.returns[part].mean()),
                "rollout/ep_len_mean": float(result.lengths[part].mean()),
                "time/episodes": end,
                "time/total_timesteps": self.steps,
                "time/fps": int(result.lengths.sum() / max(result.seconds, 1e-9)),
                "supremal/violations": int(result.violations[part].sum()),
                "supremal/completion": float(result.completed[part].mean()),
            }
            if self.settings:
                scalars["rollout/exploration_rate"] = self.settings.epsilon_at(end - 1)
            self.log.write(self.steps, scalars)

"""Runs of a reward machine beside environments that say what is true."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final, TypeAlias

import numpy as np

from supremal._arrays import Bools, Floats, Ints
from supremal.decisions.reward_machine import RewardMachine
from supremal.envs._supervised_setup import environment
from supremal.errors import MDPError

Labels: TypeAlias = Callable[[Any, dict[str, Any]], Iterable[str]]
LabelsOfAll: TypeAlias = Callable[[Any, dict[str, Any]], Any]

_MANY: Final = 1 << 16  # sets of names that are kept; an environment may make up ever new ones


class MachineRun:
    """One run of ``machine``; ``labels`` says what is true after a step, left out ``info["labels"]`` does."""

    def __init__(self, machine: RewardMachine, labels: Labels | None = None) -> None:
        self.machine, self.labels = machine, labels
        self.state = 0
        self._bits = _Bits(machine)

    def earn(self, observation: Any, info: dict[str, Any]) -> float:  # noqa: ANN401 - the environment's
        """Read what is true now; return the reward.

        Raises
        ------
        MDPError
            If nobody says what is true.
        """
        true = info.get("labels") if self.labels is None else self.labels(observation, info)
        label, state = self._bits.of(true), self.state
        self.state = int(self.machine.delta[state, label])
        return float(self.machine.reward[state, label])


class MachineRuns:
    """N runs of ``machine`` at once.

    ``labels`` is a function of observations and infos that says for each run what is true after a step; left
    out, ``infos["labels"]`` does.  Either is an array ``int [N]``, whose bit i is proposition i of the
    machine, or N sets of names.

    Notes
    -----
    ``state`` is ``int32 [N]``.
    """

    def __init__(self, machine: RewardMachine, labels: LabelsOfAll | None, n: int) -> None:
        self.machine, self.labels = machine, labels
        self.state: Ints = np.zeros(n, np.int32)
        self._bits = _Bits(machine)

    def reset(self, which: Bools) -> None:
        """Let the runs ``which [N]`` start again."""
        self.state = np.where(which, np.int32(0), self.state)

    def earn(self, observations: Any, infos: dict[str, Any], live: Bools) -> Floats:  # noqa: ANN401 - the environments'
        """Read what is true now in the runs that are ``live [N]``; return their rewards, 0 of the others.

        Raises
        ------
        MDPError
            If nobody says what is true.
        """
        if not live.any():
            return np.zeros(len(live))
        true = infos.get("labels") if self.labels is None else self.labels(observations, infos)
        label = self._labels(true, live)
        to, reward = self.machine.delta[self.state, label], self.machine.reward[self.state, label]
        self.state = np.where(live, to, self.state)
        earned: Floats = np.where(live, reward, 0.0)
        return earned

    def _labels(self, true: Any, live: Bools) -> Ints:  # noqa: ANN401 - whatever a user's function returned
        """Return what is true as one number a run."""
        size, n = self.machine.delta.shape[1], len(live)
        if isinstance(true, np.ndarray) and true.dtype.kind in "iu" and true.shape == (n,):
            wrong = live & ((true < 0) | (true >= size))
            if wrong.any():
                i = int(wrong.argmax())
                message = f"environment {i}: the label is {true[i]}; a number from 0 to {size - 1} is needed"
                raise MDPError(message)
            return np.where(live, true, 0)
        if true is None or isinstance(true, str) or not hasattr(true, "__len__") or len(true) != n:
            message = (
                "the reward machine needs the propositions that are true after a step, as an array of "
                f"{n} numbers or {n} sets of names; it got {true!r:.60}: give labels=, or environments that "
                "put them into info['labels']"
            )
            raise MDPError(message)
        labels = np.zeros(n, np.int32)
        for i in np.flatnonzero(live).tolist():
            with environment(i):
                labels[i] = self._bits.of(true[i])
        return labels


class _Bits:
    """What is true as a number, whose bit i is proposition i of ``machine``; names are looked up once."""

    def __init__(self, machine: RewardMachine) -> None:
        self._propositions = machine.propositions
        self._known: dict[tuple[str, ...], int] = {}

    def of(self, true: Any) -> int:  # noqa: ANN401 - whatever a user's function returned
        """Return the number of these names; raise an `MDPError` if they can be none."""
        names = _names(true)
        bits = self._known.get(names)
        if bits is None:
            if len(self._known) > _MANY:
                self._known.clear()
            bits = sum(1 << k for k, name in enumerate(self._propositions) if name in names)
            self._known[names] = bits
        return bits


def _names(true: Any) -> tuple[str, ...]:  # noqa: ANN401 - whatever a user's function returned
    """Return the names of what is true; raise an `MDPError` if these can be none."""
    if isinstance(true, str) or not isinstance(true, Iterable):
        what = "nothing" if true is None else f"the string {true!r}" if isinstance(true, str) else repr(true)
        message = (
            "the reward machine needs the propositions that are true after a step, as a set of names; it "
            f"got {what}: give labels=, or an environment that puts them into info['labels']"
        )
        raise MDPError(message)
    return tuple(true)

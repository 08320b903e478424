"""One run of a reward machine beside an environment that says what is true."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

from supremal.decisions.reward_machine import RewardMachine
from supremal.errors import MDPError

Labels: TypeAlias = Callable[[Any, dict[str, Any]], Iterable[str]]


class MachineRun:
    """One run of ``machine``; ``labels`` says what is true after a step, left out ``info["labels"]`` does."""

    def __init__(self, machine: RewardMachine, labels: Labels | None = None) -> None:
        self.machine, self.labels = machine, labels
        self.state = 0
        self._known: dict[tuple[int, tuple[str, ...]], tuple[int, float]] = {}

    def earn(self, observation: Any, info: dict[str, Any]) -> float:  # noqa: ANN401 - the environment's
        """Read what is true now; return the reward.

        Raises
        ------
        MDPError
            If nobody says what is true.
        """
        true = info.get("labels") if self.labels is None else self.labels(observation, info)
        if true is None or isinstance(true, str):
            what = "nothing" if true is None else f"the string {true!r}"
            message = (
                "the reward machine needs the propositions that are true after a step, as a set of names; it "
                f"got {what}: give labels=, or an environment that puts them into info['labels']"
            )
            raise MDPError(message)
        # What a machine answers is remembered, for its own step looks every proposition up.
        key = self.state, tuple(true)
        answer = self._known.get(key)
        if answer is None:
            answer = self._known[key] = self.machine.step(self.state, key[1])
        self.state, reward = answer
        return reward

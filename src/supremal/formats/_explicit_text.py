"""What the text formats of model checkers share: numbers, and choices that are gathered line by line."""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from supremal.formats._explicit import ROUNDED, Explicit
from supremal.formats._page import Page, shown

MAX_STATE: Final = 99_999_999
"""The largest number of a state that is read."""

_FRACTION: Final = re.compile(r"([+-]?[0-9]{1,300})/([0-9]{1,300})")


def real(page: Page, text: str, where: int, what: str) -> float:
    """Return the number that ``text`` is: decimal, or a fraction."""
    try:
        value = float(text)
    except ValueError:
        value = _fraction(text)
    if not abs(value) < float("inf") or "_" in text or not text.isascii():
        page.fail(f"{what} is {shown(text)}; a finite number like 0.5 or 1/2 is needed", where)
    return value


def _fraction(text: str) -> float:
    parts = _FRACTION.fullmatch(text)
    try:
        return int(parts[1]) / int(parts[2]) if parts else float("nan")
    except (OverflowError, ZeroDivisionError):
        return float("nan")


def probability(page: Page, text: str, where: int) -> float:
    """Return the probability that ``text`` is."""
    value = real(page, text, where, "a probability")
    if not 0 < value <= 1 + ROUNDED:
        page.fail(f"a probability is {shown(text)}; a number above 0, up to 1, is needed", where)
    return value


class Gathered:
    """The lines of a model: choices with their states and actions, branches with their choices."""

    def __init__(self, *, chain: bool) -> None:
        self.chain = chain
        self.actions: dict[str, int] = {}
        self.state: list[int] = []  # of each choice
        self.action: list[int] = []  # of each choice
        self.choice: list[int] = []  # of each branch
        self.target: list[int] = []
        self.prob: list[float] = []
        self.reward: list[float] = []
        self.labels: dict[str, list[int]] = {}

    def open(self, state: int, action: str) -> None:
        """Begin a choice, which follows all others of its state and of states before."""
        self.state.append(state)
        self.action.append(self.actions.setdefault(action, len(self.actions)))

    def branch(self, target: int, prob: float, reward: float) -> None:
        """Add a branch to the last choice."""
        self.choice.append(len(self.state) - 1)
        self.target.append(target)
        self.prob.append(prob)
        self.reward.append(reward)

    def explicit(self, states: int) -> Explicit:
        """Return the model, each state of which has a choice, and each choice a branch."""
        labels = {}
        for name, held in self.labels.items():
            labels[name] = np.zeros(states, np.bool_)
            labels[name][held] = True
        return Explicit(
            chain=self.chain,
            actions=tuple(self.actions),
            words=(),
            choice=np.searchsorted(self.state, np.arange(states + 1)),
            branch=np.searchsorted(self.choice, np.arange(len(self.state) + 1)),
            action=np.array(self.action, np.int32),
            target=np.array(self.target, np.int32),
            prob=np.array(self.prob),
            reward=np.array(self.reward),
            word=np.zeros(0, np.int32),
            labels=labels,
            origin=None,
        )

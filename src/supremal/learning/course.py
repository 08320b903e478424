"""A process as a learner walks through it: all that a step needs, in one line of memory.

The outcome of a choice is one record of 32 bytes: its chance, its reward, the choices of the next state, and
a *letter*, which is what the monitors of the rules hear of it: the word, and whether the state that it leads
to is marked.  What a monitor says to a letter is one number: the row of the next state of the monitor, how
many violations it was, and the mark.

With the arrays of `Choices` in place of records a step takes 1.3 times as long.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from hashlib import sha256
from typing import Final

import numpy as np

from supremal._arrays import Bools, Ints, Longs
from supremal.automata.automaton import Automaton
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import Choices, enabled_choices
from supremal.learning.counterfactual import Lessons, lessons_of, no_lessons
from supremal.learning.monitors import WordMonitor, word_monitor
from supremal.learning.settings import Settings

STEP: Final = np.dtype(
    [("prob", "f8"), ("reward", "f8"), ("first", "i8"), ("count", "i4"), ("letter", "i4")], align=True
)


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A process of C choices, O outcomes, I initial states and L letters, and a monitor of M states.

    Parameters
    ----------
    choices
        ``int32 [S + 1]``: state s has the choices ``choices[s]`` to ``choices[s + 1]``.
    action
        ``int32 [C]``: the action of each choice.
    outcome
        ``int32 [C + 1]``: choice c has the outcomes ``outcome[c]`` to ``outcome[c + 1]``.
    step
        `STEP` ``[O]``: each outcome.  Letter 2 w + m is word w to a state that is marked (m = 1) or not.
    start
        `STEP` ``[I]``: the initial states, as if each was the outcome of a choice; the letter is m alone.
    verdict
        ``int64 [M * L]``: for letter l in the monitor's state i, at i * L + l: L times the next state in the
        high 32 bits, then the number of violations, then m in the lowest bit.
    owed
        ``int32 [M]``: how many rules are violated if the episode ends there.
    lessons
        Which outcomes teach each other.
    """

    choices: Ints
    action: Ints
    outcome: Ints
    step: np.ndarray
    start: np.ndarray
    verdict: Longs
    owed: Ints
    lessons: Lessons

    def __post_init__(self) -> None:
        for array in self._arrays():
            array.flags.writeable = False

    def _arrays(self) -> list[np.ndarray]:
        return [getattr(part, field.name) for part in (self, self.lessons) for field in fields(part)[:-1]]

    def fingerprint(self) -> str:
        """Return a hash of all that there is to learn from."""
        digest = sha256()
        for array in self._arrays():
            digest.update(f"{array.dtype} {array.shape}".encode())
            digest.update(array.data)
        return digest.hexdigest()


def lay_out(
    mdp: TabularMDP,
    enabled: Bools | None,
    rules: Sequence[Automaton],
    settings: Settings,
    environment: TabularMDP | None,
) -> Course:
    """Return the course of ``mdp`` under a mask, with monitors of ``rules``."""
    choices, monitor = enabled_choices(mdp, enabled), word_monitor(mdp, rules)
    starts = np.flatnonzero(mdp.initial)
    step = _steps(choices, choices.target, mdp.marked)
    step["prob"], step["reward"] = choices.prob, choices.reward
    step["letter"] += 2 * choices.word
    start = _steps(choices, starts, mdp.marked)
    start["prob"] = mdp.initial[starts]
    lessons = lessons_of(mdp, choices, environment) if settings.counterfactual else no_lessons()
    return Course(
        choices.choice,
        choices.action,
        choices.outcome,
        step,
        start,
        _verdicts(monitor),
        monitor.owed,
        lessons,
    )


def _steps(choices: Choices, states: np.ndarray, marked: Bools) -> np.ndarray:
    """Return what it is to come to ``states``."""
    step = np.zeros(len(states), STEP)
    step["first"] = choices.choice[states]
    step["count"] = choices.choice[states + 1] - choices.choice[states]
    step["letter"] = marked[states]
    return step


def _verdicts(monitor: WordMonitor) -> Longs:
    """Return what a monitor says to each letter, as one number each."""
    letters = 2 * monitor.next_state.shape[1]
    heard = monitor.next_state.astype(np.int64) * letters << 32 | monitor.breaks.astype(np.int64) << 1
    verdicts: Longs = np.stack([heard, heard | 1], axis=2).reshape(-1)
    return verdicts

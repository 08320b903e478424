"""Schedules: a learning rate or a chance to explore that changes from episode to episode.

Q-learning converges with probability 1 where every action is tried for ever and the rates of each state and
action satisfy Σ α = ∞ and Σ α² < ∞.  Rates by *visits*, α = 1 / (1 + n(s, a))^ω with ω in (1/2, 1], do; ω
well below 1 is quicker, since at ω = 1 the number of steps that it takes is exponential in 1 / (1 - γ).

Source: Watkins, Dayan, "Q-learning", Machine Learning 8 (1992); Even-Dar, Mansour, "Learning rates for
Q-learning", JMLR 5 (2003).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final, Literal, TypeAlias

import numpy as np

from supremal._arrays import Floats
from supremal.errors import MDPError

Kind: TypeAlias = Literal["constant", "exponential", "linear", "harmonic", "visits"]

_NEEDED: Final[dict[str, tuple[str, ...]]] = {
    "constant": ("start",),
    "exponential": ("start", "factor", "episodes"),
    "linear": ("start", "end", "episodes"),
    "harmonic": ("start", "episodes"),
    "visits": ("power",),
}


@dataclass(frozen=True, slots=True)
class Schedule:
    """A number from 0 to 1 for each episode, counted from 0; make one with a method below.

    Parameters
    ----------
    kind
        Which of them; the fields that it does not speak of are None.
    start
        The number at first.
    end
        Where a linear schedule arrives.
    episodes
        After how many: a linear one arrives; an exponential one is multiplied, again and again; a harmonic
        one is halved.
    factor
        By what an exponential one is multiplied, in (0, 1].
    power
        ω in (1/2, 1], for rates by visits.

    Raises
    ------
    MDPError
        If a number is missing, out of its range, or one that this kind does not take.

    Examples
    --------
    >>> Schedule.linear(1.0, 0.5, episodes=4).over(0, 6).tolist()
    [1.0, 0.875, 0.75, 0.625, 0.5, 0.5]
    >>> Schedule.exponential(0.25, 0.95, episodes=10_000).at(25_000) == 0.25 * 0.95**2
    True
    """

    kind: Kind
    start: float | None = None
    end: float | None = None
    episodes: int | None = None
    factor: float | None = None
    power: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in _NEEDED:
            message = f"kind is {self.kind!r}; one of {', '.join(_NEEDED)} is needed"
            raise MDPError(message)
        for field in fields(self)[1:]:
            value, needed = getattr(self, field.name), field.name in _NEEDED[self.kind]
            if (value is not None) != needed:
                wrong = f"takes no {field.name}; leave it out" if value is not None else f"needs {field.name}"
                message = f"a schedule of kind {self.kind!r} {wrong}"
                raise MDPError(message)
        for name, holds, right in (
            ("start", self.start is None or 0 <= self.start <= 1, "a number from 0 to 1"),
            ("end", self.end is None or 0 <= self.end <= 1, "a number from 0 to 1"),
            ("episodes", self.episodes is None or self.episodes >= 1, "a whole number from 1"),
            ("factor", self.factor is None or 0 < self.factor <= 1, "a number above 0, at most 1,"),
            ("power", self.power is None or 0.5 < self.power <= 1, "a number above 0.5, at most 1,"),
        ):
            if not holds:
                message = f"{name} is {getattr(self, name)}; {right} is needed"
                raise MDPError(message)

    @classmethod
    def constant(cls, value: float) -> Schedule:
        """Return ``value`` in every episode."""
        return cls("constant", value)

    @classmethod
    def exponential(cls, start: float, factor: float, *, episodes: int) -> Schedule:
        """Return start · factor^k in episode n, k = ⌊n / episodes⌋: the paper's schedule for ε."""
        return cls("exponential", start, episodes=episodes, factor=factor)

    @classmethod
    def linear(cls, start: float, end: float, *, episodes: int) -> Schedule:
        """Return a straight line from ``start`` to ``end``, which holds from number ``episodes`` on."""
        return cls("linear", start, end, episodes)

    @classmethod
    def harmonic(cls, start: float, *, episodes: int) -> Schedule:
        """Return start · b / (b + n) in episode n, b = ``episodes``."""
        return cls("harmonic", start, episodes=episodes)

    @classmethod
    def visits(cls, power: float = 1.0) -> Schedule:
        """Return 1 / (1 + n)^power, where n says how often this state and action was learned before."""
        return cls("visits", power=power)

    def at(self, episode: int) -> float:
        """Return the number in an episode; for rates by visits, that after so many visits."""
        return float(self.over(episode, episode + 1)[0])

    def over(self, first: int, end: int) -> Floats:
        """Return the numbers in episodes ``first`` to ``end - 1``, ``float64 [end - first]``."""
        n = np.arange(first, end)
        start, over = self.start or 0.0, self.episodes or 1
        values: Floats
        if self.kind == "exponential":
            periods, which = np.unique(n // over, return_inverse=True)
            values = np.array([start * (self.factor or 0.0) ** k for k in periods.tolist()])[which]
        elif self.kind == "linear":
            share = np.minimum(n / over, 1.0)
            values = start * (1 - share) + (self.end or 0.0) * share
        elif self.kind == "harmonic":
            values = start * over / (over + n)
        elif self.kind == "visits":
            values = np.power(1.0 + n, -(self.power or 1.0))
        else:
            values = np.full(n.size, start)
        return values

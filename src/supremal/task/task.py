"""A task: what can happen, the rules that it has to obey, what is worth how much, and how it is learned.

A task file says all of this; `supremal.task.reading.read_task` makes a `Task` of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.reward_machine import RewardMachine
from supremal.errors import ModelError, suggest
from supremal.learning.settings import Settings
from supremal.rules.rule import Rule

Model = Literal["environment", "plants", "anything"]

REPORTABLE: Final = (
    "check.verdict",
    *(f"product.{key}" for key in ("states", "state_actions", "disabled")),
    *(f"optimal.{key}" for key in ("value", "expected_return", "expected_steps", "steps_undisturbed")),
    *(f"optimal.{key}" for key in ("completion_within_limit", "completion_ever")),
    *(f"greedy.{key}" for key in ("value", "gap", "completion", "completion_ever")),
    *(f"greedy.{key}" for key in ("expected_return", "expected_steps", "violation_probability")),
    *(f"training.{key}" for key in ("violations", "episodes", "steps", "final_epsilon")),
    *(f"baseline.{key}" for key in ("violations", "violations_per_episode", "episodes_with_violation")),
)
"""The numbers of a result that a source may report."""


@dataclass(frozen=True, slots=True)
class Options:
    """How the rules are meant: whether something has to be completed, whether one has to act, and bounds.

    Parameters
    ----------
    nonblocking
        Whether what has to be completed must stay possible: marked states, and progress rules with them.
    must_act
        Whether, where an event can be chosen, one has to be: no resting for ever.
    max_states
        The most states of a product; None: what fits.
    """

    nonblocking: bool = True
    must_act: bool = False
    max_states: int | None = None


@dataclass(frozen=True, slots=True)
class Reported:
    """A number that the source of a task reports, to be shown beside what comes out here.

    Parameters
    ----------
    what
        What it is the number of.
    said
        The number, or in words what was said.
    key
        Where ``result.json`` has ours, as a path with dots; "" where it is a point of a curve.
    curve, episodes
        For a point of a curve: "score" or "completion", and the last episode of the interval.
    style
        How ours is written: as a number, a count, a share in percent, or yes and no.
    """

    what: str
    said: str | float
    key: str = ""
    curve: Literal["", "score", "completion"] = ""
    episodes: int = 0
    style: Literal["number", "count", "percent", "answer"] = "number"

    def __post_init__(self) -> None:
        if not self.curve and self.key not in REPORTABLE:
            message = f"reported {self.what!r}: a result has no {self.key!r}; {suggest(self.key, REPORTABLE)}"
            raise ModelError(message)
        if self.key == "check.verdict" and self.style != "answer":
            message = f"reported {self.what!r}: 'check.verdict' is no number; give style = \"answer\""
            raise ModelError(message)


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """What an agent has to do.

    Parameters
    ----------
    name
        What files and messages call it.
    alphabet
        All its events.
    plants
        The automata of what can happen; () where there is an environment that is no composition of plants,
        and where nothing is known: then anything can happen.
    environment
        The decision process; None where no chances are known, so that nothing can be learned.
    rules
        What must not break.
    reward_machine
        What is worth how much; None: the environment's own rewards.
    shaped
        The same machine with its rewards told earlier, which the learner is taught by; None: as it stands.
    options
        How the rules are meant.
    settings
        Those of the learner.
    seed, seeds
        The first seed, and how many, counted up from it.
    interval
        The episodes that a point of a curve averages over.
    out
        The folder of a run; None: one is named after the task, the seed and the time.
    title, source
        What it is in a few words, and where it comes from.
    reported
        What that source reports.
    path
        The file that said all this.
    """

    name: str
    alphabet: Alphabet
    plants: tuple[Automaton, ...] = ()
    environment: TabularMDP | None = None
    rules: tuple[Rule, ...] = ()
    reward_machine: RewardMachine | None = None
    shaped: RewardMachine | None = None
    options: Options = field(default_factory=Options)
    settings: Settings = field(default_factory=Settings)
    seed: int = 0
    seeds: int = 1
    interval: int = 10_000
    out: Path | None = None
    title: str = ""
    source: str = ""
    reported: tuple[Reported, ...] = ()
    path: str = ""

    @property
    def model(self) -> Model:
        """What the answers rest on: an environment's model, plants, or nothing (the worst case)."""
        if self.plants:
            return "plants"
        return "anything" if self.environment is None else "environment"

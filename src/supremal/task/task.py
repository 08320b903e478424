"""A task: an environment, the rules that its sequences of events obey, and what is worth how much.

Here is the paper's own, the pick-up and delivery grid.  Its automata come from the data files of the
environment.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

from supremal.automata.automaton import Automaton
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.reward_machine import RewardMachine
from supremal.envs.pickup_delivery import PickupDelivery, data_file
from supremal.formats.documents import read_automaton
from supremal.learning.q_learning import Settings
from supremal.rules.sequences import complete_safe, complete_unsafe, rule_from_safe, rule_from_unsafe

Preset = Literal["default", "published"]


@dataclass(frozen=True, slots=True, eq=False)
class Rule:
    """A rule as it was said, and as the paper draws it.

    Parameters
    ----------
    sentence
        The rule in words.
    automaton
        What it means: a partial automaton that breaks where it has no transition.
    completed
        The paper's completion of it, with the state s_a, for pictures.
    """

    sentence: str
    automaton: Automaton
    completed: Automaton


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """What an agent has to do.

    Parameters
    ----------
    name
        What files and messages call it.
    preset
        Which of its variants this is.
    environment
        The decision process.
    undisturbed
        The same where no uncontrollable event happens.
    rules
        What must not break.
    reward_machine
        What is worth how much.
    settings
        Those of the learner.
    drop_probability
        The chance that something is dropped at an epoch at which it can.
    """

    name: str
    preset: Preset
    environment: TabularMDP
    undisturbed: TabularMDP
    rules: tuple[Rule, ...]
    reward_machine: RewardMachine
    settings: Settings
    drop_probability: float


PRESETS: Final[tuple[Preset, ...]] = ("default", "published")

_PUBLISHED_ACTIONS: Final = 4


def pickup_delivery(preset: Preset = "default", *, settings: Settings | None = None) -> Task:
    """Return the paper's experiment.

    Parameters
    ----------
    preset
        "default" follows the paper's text, "published" the program that drew its two curves.
    settings
        Left out: the paper's, as the preset reads them.

    Notes
    -----
    The published program gives *every* action that is not greedy the probability ε, and spreads the share of
    the disabled ones evenly over the enabled ones.  With A actions of which n are enabled that is a chance of
    ε·A/n for each enabled one besides the greedy remainder: the textbook ε-greedy choice with A·ε in place of
    ε.  So its ε = 0.25 with four actions is an exploring step always, and here ε = 1.
    """
    grid = PickupDelivery(preset=preset)
    unsafe = read_automaton(data_file("no_u_turn.json"))
    safe = read_automaton(data_file("recovery.json"))
    standard = Settings()
    if preset == "published":
        standard = replace(standard, epsilon=_PUBLISHED_ACTIONS * standard.epsilon)
    return Task(
        name="pickup-delivery",
        preset=preset,
        environment=grid.model(),
        undisturbed=PickupDelivery(drop_probability=0.0, preset=preset).model(),
        rules=(
            Rule(
                "No U-turn: never two rights or two lefts in a row.",
                rule_from_unsafe(unsafe),
                replace(complete_unsafe(unsafe), name="H"),
            ),
            Rule(
                "After a drop: put down 2 and 3, then pick up 1, 2, 3, at once.",
                rule_from_safe(safe),
                replace(complete_safe(safe), name="G_s"),
            ),
        ),
        reward_machine=grid.reward_machine(),
        settings=settings or standard,
        drop_probability=grid.drop_probability,
    )

"""The stage of a task: what there is to see, and what may be done, at one moment.

A moment of a process is a state of the product of environment, rules and reward machine; a moment of plants
is a state of their supervisor.  Beside it stand the states of the rules as they are drawn, which follow what
has happened.  `supremal.task.playback` shows moments of episodes that were played, `supremal.task.game` lets
somebody play.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal.automata.automaton import Automaton
from supremal.automata.compose import components
from supremal.decisions.mdp import TabularMDP
from supremal.errors import MDPError
from supremal.show.playback import Look, Part, Step
from supremal.synthesis.explain import Disabled, disabled_in
from supremal.task._reasons import Reasons, brief_in, reasons_of
from supremal.task.boards import View, view_of
from supremal.task.experiment import supervise
from supremal.task.findings import Findings
from supremal.task.task import Task

_NAMED: Final = 60
"""The most states of an automaton whose names are told."""


# --- the parts that follow --------------------------------------------------------------------------------


def followers_of(task: Task) -> list[Automaton]:
    """Return the automata of the rules as they are drawn."""
    return [rule.drawn or rule.automaton for rule in task.rules]


def parts_of(task: Task) -> tuple[Part, ...]:
    """Return what follows on the stage: the rules, then the reward machine where there is one."""
    drawn = followers_of(task)
    parts = [Part(rule.name, _names(seen)) for rule, seen in zip(task.rules, drawn, strict=True)]
    if task.reward_machine is not None:
        parts.append(
            Part(task.reward_machine.name or "rewards", tuple(task.reward_machine.states), "machine")
        )
    return tuple(parts)


def _names(automaton: Automaton) -> tuple[str, ...]:
    few = automaton.n_states <= _NAMED
    return tuple(automaton.state_name(s) for s in range(automaton.n_states)) if few else ()


def follow(automata: Sequence[Automaton], at: tuple[int, ...], word: Sequence[str]) -> tuple[int, ...]:
    """Return where ``word`` leads each automaton; events that it does not know do not touch it."""
    return tuple(
        automaton.run([event for event in word if event in automaton.alphabet], state)
        for automaton, state in zip(automata, at, strict=True)
    )


# --- a process --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class ProcessStage:
    """The stage of a process.

    Parameters
    ----------
    task
        What there is to do.
    environment
        The process without its rules.
    model, enabled
        The product, whose first column of ``origin`` is the state of ``environment``, and its mask.
    reasons
        Says why an action is disabled.
    view
        Shows the world.
    world
        ``int [S, K]``: what the view is told of each state of the environment.
    """

    task: Task
    environment: TabularMDP
    model: TabularMDP
    enabled: Bools
    reasons: Reasons
    view: View
    world: Ints

    @property
    def free(self) -> frozenset[str]:
        """The events that nobody controls."""
        return self.environment.alphabet.uncontrollable

    @property
    def facts(self) -> tuple[str, ...]:
        """What the facts of a look are called."""
        return (*self.view.facts, "true here") if self.environment.propositions else self.view.facts

    def look(self, state: int) -> Look:
        """Return what the world looks like where the product is in ``state``."""
        own = int(self.model.origin[state, 0])
        look = self.view.look(tuple(self.world[own].tolist()))
        if not self.environment.propositions:
            return look
        label = int(self.environment.label[own])
        true = ", ".join(name for i, name in enumerate(self.environment.propositions) if label >> i & 1)
        return replace(look, facts=(*look.facts, true or "nothing"))

    def step(self, state: int, at: tuple[int, ...]) -> Step:
        """Return the moment in which the product is in ``state``, and the drawn rules in ``at``."""
        model, names = self.model, self.model.actions
        own, *parts = model.origin[state].tolist()
        rules = tuple(parts[: len(self.task.rules)])
        live = not model.terminal[state]
        enabled = np.flatnonzero(self.enabled[state] & live).tolist()
        barred = np.flatnonzero(model.feasible[state] & ~self.enabled[state] & live).tolist()
        words = {int(w) for a in enabled for w in model.word[model.outcomes(state, a)]}
        said = {event for word in words for event in model.spell(word)}
        return Step(
            at=(*at, *parts[len(self.task.rules) :]),
            can=tuple(names[a] for a in enabled),
            may=tuple(event for event in model.alphabet if event in said & model.alphabet.uncontrollable),
            cannot=tuple((names[a], self.reasons(own, rules, a)) for a in barred),
            look=self.look(state),
        )


def process_stage(task: Task, environment: TabularMDP, findings: Findings) -> ProcessStage:
    """Return the stage of a task's process: one more product, and one more synthesis for the reasons.

    Raises
    ------
    MDPError
        If the rules can only be kept by resting, which nobody can in a process.
    """
    numbered = replace(environment, origin=np.arange(environment.n_states, dtype=np.int32)[:, None])
    model, enabled = supervise(numbered, task)
    if ((model.initial > 0) & ~model.terminal & ~enabled.any(axis=1)).any():
        message = (
            f"task {task.name!r}: its rules can only be kept by never doing anything, and in an environment "
            "something has to be done; leave must_act out of its [check] to see why they cannot be kept so"
        )
        raise MDPError(message)
    reasons = reasons_of(task, environment, findings)
    return ProcessStage(task, environment, model, enabled, reasons, view_of(task), _world(task, environment))


def _world(task: Task, environment: TabularMDP) -> Ints:
    """Return what a view is told of each state of the environment: the state of each plant, or its number."""
    if not task.plants:
        return environment.origin
    _, states = components(*task.plants, max_states=task.options.max_states)
    return states[environment.origin[:, 0]]


# --- plants only ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class PlantStage:
    """The stage of plants, or of anything that can happen: their supervisor, with its reasons, and a view."""

    task: Task
    disabled: Disabled
    view: View

    @property
    def free(self) -> frozenset[str]:
        """The events that nobody controls."""
        return self.task.alphabet.uncontrollable

    @property
    def facts(self) -> tuple[str, ...]:
        """What the facts of a look are called."""
        return self.view.facts

    @property
    def automaton(self) -> Automaton:
        """What can happen under the supervisor."""
        return self.disabled.supervisor.automaton

    def step(self, state: int, at: tuple[int, ...]) -> Step:
        """Return the moment in which the supervisor is in ``state``, and the drawn rules in ``at``."""
        possible = self.possible(state)
        free = self.automaton.alphabet.uncontrollable
        leads = self.disabled.causes.product.events(int(self.disabled.state[state]))
        known = self.task.alphabet.names
        return Step(
            at=at,
            can=tuple(name for name in possible if name not in free),
            may=tuple(name for name in possible if name in free),
            cannot=tuple((e, brief_in(self.disabled, state, e, known)) for e in leads if e not in possible),
            look=self.view.look(tuple(self.disabled.supervisor.plant_state[state].tolist())),
        )

    def possible(self, state: int) -> tuple[str, ...]:
        """Return the events that can happen in ``state`` of the supervisor."""
        automaton = self.automaton
        return automaton.alphabet.spell(np.flatnonzero(automaton.delta[state] != NONE).tolist())


def plant_stage(task: Task, findings: Findings) -> PlantStage:
    """Return the stage of a task's plants."""
    disabled = disabled_in(findings.causes, findings.supervisor, findings.state)
    return PlantStage(task, disabled, view_of(task))

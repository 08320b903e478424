"""Why an action of a process is disabled: what explains its choices, state by state.

The process is read as an automaton (`observed_plant`), whose supremal supervisor enables what `safe_actions`
does on the product; so every action that the one disables has an explanation in the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from supremal._arrays import NONE
from supremal.automata.automaton import Automaton
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.plant import observed_plant
from supremal.errors import AutomatonError
from supremal.show.disabled import brief
from supremal.synthesis.causes import Causes, find_causes, supervisor_of
from supremal.synthesis.explain import Disabled, disabled_in
from supremal.task.findings import Findings
from supremal.task.task import Task

Reasons = Callable[[int, tuple[int, ...], int], str]
"""Says why an action is disabled: the state of the environment, those of the rules, the action's number."""


def reasons_of(task: Task, environment: TabularMDP, findings: Findings) -> Reasons:
    """Return what explains why an action is disabled, where environment and rules are in given states."""
    try:
        causes = _causes_of(task, environment, findings)
    except AutomatonError:  # the automaton is too large, or there are too many states
        return lambda *_: "it can lead to where a rule cannot be kept any more"
    plant = causes.product.plants[0]
    supervisor, state = supervisor_of(causes)
    disabled = disabled_in(causes, supervisor, state)
    known = [name for name in causes.product.graph.alphabet if name in task.alphabet]
    keys = np.column_stack(
        [plant.origin[supervisor.plant_state[:, 0], 0], supervisor.automaton.origin[:, 1:]]
    )
    number = {key: s for s, key in enumerate(map(tuple, keys.tolist())) if key[0] != NONE}

    @cache
    def why(own: int, rules: tuple[int, ...], action: int) -> str:
        here = number[(own, *rules)]
        return brief_in(disabled, here, _event_of(environment, plant, own, action), known)

    return why


def _causes_of(task: Task, environment: TabularMDP, findings: Findings) -> Causes:
    """Return why states of the environment and the rules have to go, where one has to act."""
    if not task.plants and findings.options.must_act:
        return findings.causes
    return find_causes(
        (observed_plant(environment, name="environment"),),
        findings.rules,
        nonblocking=findings.options.nonblocking,
        must_act=True,
        max_states=findings.options.max_states,
    )


def _event_of(environment: TabularMDP, plant: Automaton, own: int, action: int) -> str:
    """Return the event of ``plant``, an `observed_plant`, that stands for a choice."""
    shown = f"?{environment.actions[action]}"
    here = int(np.flatnonzero(plant.origin[:, 0] == own)[0])
    if shown in plant.alphabet and plant.delta[here, plant.alphabet.index(shown)] != NONE:
        return shown
    first = (environment.spell(int(w))[:1] for w in environment.word[environment.outcomes(own, action)])
    free = environment.alphabet.uncontrollable
    return next((word[0] for word in first if word and word[0] not in free), "")


def brief_in(disabled: Disabled, state: int, event: str, known: Sequence[str]) -> str:
    """Say why ``event`` is disabled in ``state`` of the supervisor.

    What an observed plant leaves out altogether can lead to where nothing goes on.
    """
    alphabet = disabled.causes.product.graph.alphabet
    if event in alphabet and event in disabled.causes.product.events(int(disabled.state[state])):
        return brief(disabled.why(state, event), known)
    return "it can lead to where nothing goes on"

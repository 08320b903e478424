"""What a supervised environment knows: its actions as events, the plant, the rules, and their supervisor.

The plant is what the user says can happen.  Actions are controllable events, each possible wherever the plant
does not say otherwise; everything else that happens is uncontrollable.  With no plant that is Σ*, the worst
case: whatever is enforced against it is enforced in any environment.  Against a plant that somebody wrote, a
supervisor keeps the rules as long as the environment does nothing that this plant cannot.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import Ints
from supremal.automata.alphabet import Alphabet, union
from supremal.automata.automaton import Automaton
from supremal.automata.build import universal
from supremal.automata.explore import as_parts
from supremal.errors import RuleError, suggest
from supremal.rules.rule import Rule
from supremal.synthesis.causes import Causes, find_causes, supervisor_of
from supremal.synthesis.explain import disabled_in, explain_empty
from supremal.synthesis.supervisor import Supervisor

Events: TypeAlias = Sequence[str] | Callable[[int], str]
Masks: TypeAlias = NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class SupervisedModel:
    """A supervisor over A actions.

    Parameters
    ----------
    events
        The event of each action.
    causes
        Plants and rules, and why states of their product had to go.
    supervisor
        What is left.
    state
        ``int32 [S]``: the state of the product in each state of the supervisor.
    masks
        ``int8 [S, A]``: which actions the supervisor enables.
    """

    events: tuple[str, ...]
    causes: Causes
    supervisor: Supervisor
    state: Ints
    masks: Masks

    @property
    def plants(self) -> tuple[Automaton, ...]:
        """The plants, the last of which says that every action is possible."""
        return self.causes.product.plants

    @property
    def rules(self) -> tuple[Automaton, ...]:
        """The rules."""
        return tuple(rule.whole for rule in self.causes.product.rules)

    def describe(self, parts: Sequence[int]) -> str:
        """Say in which state each plant and rule is, but for those that have one only; `NONE` is lost."""
        told = [
            f"{part.name} in {part.state_name(at) if at >= 0 else 'no state'}"
            for part, at in zip((*self.plants, *self.rules), parts, strict=True)
            if part.n_states > 1 or at < 0
        ]
        return ", ".join(told) or "the only state"

    def why(self, state: int, action: int) -> str:
        """Say why the supervisor does not enable ``action`` in its ``state``."""
        event = self.events[action]
        if event not in self.causes.product.events(int(self.state[state])):
            return f"the plant says that {event} is not possible there"
        return disabled_in(self.causes, self.supervisor, self.state).why(state, event).because


def supervised_model(
    actions: int,
    rules: Sequence[Rule | Automaton],
    *,
    plant: Automaton | Sequence[Automaton] | None,
    events: Events | None,
    nonblocking: bool,
    max_states: int | None,
) -> SupervisedModel:
    """Return the supervisor of ``rules`` for an agent that has to choose one of ``actions`` actions.

    Raises
    ------
    RuleError
        If the events do not name the actions, or a rule or a plant means an event to be controllable that no
        action is, or the other way round; or if no supervisor can keep the rules, with the reason.
    """
    names = _names(actions, events)
    if isinstance(rules, (Rule, Automaton)) or not isinstance(rules, Iterable):
        message = f"rules is {rules!r:.60}; a list of rules is needed"
        raise RuleError(message)
    given = tuple(_automaton(rule) for rule in rules)
    own = () if plant is None else _plants(plant)
    _check_events(names, (*own, *given))
    plants = (*own, universal(Alphabet(tuple(dict.fromkeys(names))), name="actions"))
    causes = find_causes(plants, given, nonblocking=nonblocking, must_act=True, max_states=max_states)
    reason = explain_empty(causes)
    if reason is not None:
        against = "with this plant"
        if plant is None:
            against = "if anything may happen at any time; give plant= to say what can"
        message = f"no agent can keep these rules {against}: {reason.because}"
        raise RuleError(message)
    supervisor, state = supervisor_of(causes)
    columns = [supervisor.automaton.alphabet.index(name) for name in names]
    masks = supervisor.enabled[:, columns].astype(np.int8)
    masks.flags.writeable = False
    return SupervisedModel(names, causes, supervisor, state, masks)


def _names(actions: int, events: Events | None) -> tuple[str, ...]:
    """Return the event of each action."""
    if events is None:
        return tuple(f"action_{a}" for a in range(actions))
    if not callable(events) and not isinstance(events, Iterable):
        message = f"events is {events!r}; the event of each action is needed, as a list or a function"
        raise RuleError(message)
    names = tuple(events(a) for a in range(actions)) if callable(events) else tuple(events)
    if isinstance(events, str) or len(names) != actions:
        message = f"events names {len(names)} actions; the environment has {actions}: name the event of each"
        raise RuleError(message)
    for action, name in enumerate(names):
        if not isinstance(name, str):
            message = f"events calls action {action} {name!r}; a name is needed"
            raise RuleError(message)
    return names


def _plants(plant: Any) -> tuple[Automaton, ...]:  # noqa: ANN401 - whatever a user gave
    """Return plants as a tuple."""
    known = isinstance(plant, (Automaton, Iterable)) and not isinstance(plant, str)
    parts = as_parts(plant) if known else (plant,)
    for part in parts:
        if not isinstance(part, Automaton):
            message = f"a plant is {part!r:.60}; an Automaton is needed, or a list of some"
            raise RuleError(message)
    return tuple(parts)


def _automaton(rule: Rule | Automaton) -> Automaton:
    """Return what a rule means, called as the rule is."""
    if isinstance(rule, Rule):
        return replace(rule.automaton, name=rule.name)
    if not isinstance(rule, Automaton):
        message = f"a rule is a {type(rule).__name__}; a Rule or an Automaton is needed"
        if isinstance(rule, str):
            message += "; write rule_from_regex(text, Alphabet(events))"
        raise RuleError(message)
    return rule


def _check_events(names: tuple[str, ...], parts: Sequence[Automaton]) -> None:
    """Raise a `RuleError` unless exactly the actions are controllable."""
    sigma = union(*(part.alphabet for part in parts))
    for action, name in enumerate(names):
        if name in sigma.uncontrollable:
            message = (
                f"action {action} is called {name!r}, which is declared uncontrollable; an action is what "
                "the agent chooses: declare the event controllable, or call the action something else"
            )
            raise RuleError(message)
    for name in sigma:
        if name not in sigma.uncontrollable and name not in names:
            message = (
                f"event {name!r} is controllable, but no action is called so ({suggest(name, names)}); name "
                "the actions by events=, or declare it uncontrollable"
            )
            raise RuleError(message)

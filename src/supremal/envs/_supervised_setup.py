"""What the user says about a supervised environment, checked, and put together once for all its runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from operator import index
from typing import Any, Final, Literal, TypeAlias, get_args

import numpy as np

from supremal._arrays import NONE, Longs
from supremal.automata.automaton import Automaton
from supremal.decisions.reward_machine import RewardMachine
from supremal.envs._gymnasium import Discrete, Space
from supremal.envs._supervised_model import Events, Masks, SupervisedModel, supervised_model
from supremal.envs._supervised_observer import Observer, observer
from supremal.envs.layout import KINDS, Kind
from supremal.errors import MDPError, suggest
from supremal.rules.rule import Rule

Mode: TypeAlias = Literal["strict", "correct", "monitor"]
Replace: TypeAlias = Literal["random", "first"]


_CHOICES: Final = {"mode": get_args(Mode), "replace": get_args(Replace), "observe": KINDS}


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """What all runs share.

    Parameters
    ----------
    model
        The supervisor.
    observer
        What tells observations.
    machine
        The reward machine, if there is one.
    first
        The environment's number of action 0.
    mode, replace
        What becomes of an action that is not enabled.
    own
        Whether the environment's own mask counts too.
    safe
        ``int8 [A]``: what may pass outside the supervisor; None: what breaks no rule at once.
    """

    model: SupervisedModel
    observer: Observer
    machine: RewardMachine | None
    first: int
    mode: Mode
    replace: Replace
    own: bool
    safe: Masks | None


def set_up(
    observations: Space[Any],
    actions: Space[Any],
    *,
    rules: Sequence[Rule | Automaton],
    plant: Automaton | Sequence[Automaton] | None,
    events: Events | None,
    word: Callable[..., Any] | None,
    reward_machine: RewardMachine | None,
    labels: Callable[..., Any] | None,
    nonblocking: bool,
    mode: Mode,
    replace: Replace,
    own_mask: bool,
    safe_actions: Sequence[int] | None,
    observe: Kind,
    max_states: int | None,
) -> Setup:
    """Return what all runs share; parameters and errors are those of `SupervisedEnv`."""
    for name, value in (("mode", mode), ("replace", replace), ("observe", observe)):
        if value not in _CHOICES[name]:
            message = f"{name} is {value!r}; {suggest(str(value), _CHOICES[name])}"
            raise MDPError(message)
    for name, function in (("word", word), ("labels", labels)):
        if function is not None and not callable(function):
            message = f"{name} is {function!r:.60}; a function is needed"
            raise MDPError(message)
    if reward_machine is not None and not isinstance(reward_machine, RewardMachine):
        message = f"reward_machine is {reward_machine!r:.60}; a RewardMachine is needed"
        raise MDPError(message)
    if not isinstance(actions, Discrete):
        message = f"the environment's actions are {actions}; a Discrete space of actions is needed"
        raise MDPError(message)
    count, first = int(actions.n), int(actions.start)
    model = supervised_model(
        count, rules, plant=plant, events=events, nonblocking=nonblocking, max_states=max_states
    )
    states = 0 if reward_machine is None else len(reward_machine.states)
    return Setup(
        model,
        observer(observe, observations, model, states),
        reward_machine,
        first,
        mode,
        replace,
        own_mask,
        None if safe_actions is None else _safe(safe_actions, first, count),
    )


@contextmanager
def environment(i: int) -> Iterator[None]:
    """Say in what goes wrong that it does so in environment ``i`` of several."""
    try:
        yield
    except MDPError as error:
        message = f"environment {i}: {error}"
        raise MDPError(message) from None


def place_of(action: Any, first: int, count: int) -> int:  # noqa: ANN401 - an integer of any kind
    """Return the place of ``action`` among all, of which there are ``count``."""
    try:
        place = index(action) - first
    except TypeError:
        place = NONE
    if not 0 <= place < count:
        last = first + count - 1
        message = f"action {action!r} is not known; a whole number from {first} to {last} is needed"
        raise MDPError(message)
    return place


def places_of(actions: Any, n: int, first: int, count: int) -> Longs:  # noqa: ANN401 - N integers of any kind
    """Return the place of each of N actions, ``int64 [N]``, among ``count``."""
    given = np.asarray(actions)
    if given.shape != (n,) or given.dtype.kind not in "iu":
        message = f"actions are {actions!r:.60}; {n} whole numbers are needed, one an environment"
        raise MDPError(message)
    places = given.astype(np.int64) - first
    wrong = (places < 0) | (places >= count)
    if wrong.any():
        i = int(wrong.argmax())
        with environment(i):
            place_of(given[i].item(), first, count)
    return places


def _safe(actions: Any, first: int, count: int) -> Masks:  # noqa: ANN401 - whatever a user gave
    """Return the mask that passes ``actions``."""
    if isinstance(actions, str) or not isinstance(actions, Iterable):
        message = f"safe_actions is {actions!r}; a list of actions is needed"
        raise MDPError(message)
    safe = np.zeros(count, np.int8)
    safe[[place_of(action, first, count) for action in actions]] = 1
    if not safe.any():
        message = (
            "safe_actions names no action; an agent has to choose, so name one at least, or leave it out"
        )
        raise MDPError(message)
    return safe

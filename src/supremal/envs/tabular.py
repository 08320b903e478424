"""Finite environments of Gymnasium as decision processes.

Gymnasium's toy texts (FrozenLake, CliffWalking, Taxi), and others made like them, carry their whole model
along, as a table.  `environment_model` reads it, so that rules, reward machines, synthesis and planning apply
to them as to any other process.

There, to be over belongs to a step and not to a state: one state may be entered both by a step that ends
the episode and by one that does not.  Here such a state becomes two, of which one is terminal.

Source: Gymnasium's documentation, *Toy Text*.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from typing import Any, Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal._graph import reachable_from
from supremal.automata.alphabet import Alphabet
from supremal.decisions.conditions import Condition, Factor, states_where, steps_where, told_factors
from supremal.decisions.mdp import TabularMDP
from supremal.envs._gymnasium import Env, made
from supremal.envs._tabular_factors import Look, known_look
from supremal.envs._tabular_table import TOLERANCE, Steps, read_table
from supremal.errors import MDPError

_MAX_EVENTS: Final = 30


def environment_model(
    env: Env[Any, Any] | str,
    *,
    options: Mapping[str, Any] | None = None,
    labels: Mapping[str, Condition] | None = None,
    events: Mapping[str, Condition] | None = None,
    marked: Condition | None = None,
    actions: Sequence[str] | None = None,
    factors: Callable[[int], Mapping[str, Any]] | None = None,
    rewards: bool = True,
) -> TabularMDP:
    """Return a finite environment as a decision process.

    Parameters
    ----------
    env
        The environment, or an id that Gymnasium knows.  Wrappers around it, and a limit of time, are passed
        over.
    options
        What to make it with, where ``env`` is an id.
    labels
        Propositions, and in which states they are true.
    events
        Uncontrollable events, and which steps they follow.
    marked
        Which states count as completion.  Left out: tile G of a FrozenLake; of others, the terminal states
        that are entered with the largest reward of all steps that end an episode.
    actions
        The names of the actions, by their numbers.  Left out: Gymnasium's words for them where there are
        any (left, down, right, up; south, north, east, west, pickup, dropoff), else action_0, action_1, ...
    factors
        A function that tells what a state looks like, {factor: value}.  Left out: row, column, tile (S, F,
        H, G, and C for the cliff); row, column, passenger, destination (red, green, yellow, blue, taxi).
    rewards
        Whether the environment's own rewards are wanted; a reward machine does without, and a model that
        keeps count for their sake is smaller then.

    Returns
    -------
    TabularMDP
        The states that can be reached, by their numbers, a state before its terminal copy; ``origin[:, 0]``
        is the environment's number.  The word of a step is its action, then the ``events`` that follow.  A
        `PickupDeliveryEnv` gives its own model.

    Raises
    ------
    MDPError
        If the environment is unknown or has no table, the table makes no process, or a condition names
        something that there is not.
    AlphabetError
        If an event is called as an action is.

    Notes
    -----
    A condition is a list of state numbers; a mapping from factors to a value, or to a list of values; or a
    function of the state number.  That of an event is on the state in which the step ends, and may name the
    step's ``"reward"``: in CliffWalking, ``{"reward": -100}`` is the fall, which leads back to the start.

    Takes time linear in the table, but for sorting it.

    Examples
    --------
    >>> lake = environment_model(
    ...     "FrozenLake-v1", labels={"goal": {"tile": "G"}}, events={"splash": {"tile": "H"}}
    ... )
    >>> lake
    <TabularMDP: 16 states, 4 actions, 128 outcomes, 5 events>
    >>> sorted(lake.words)[:3], lake.alphabet.names
    ([(0,), (0, 4), (1,)], ('left', 'down', 'right', 'up', 'splash'))
    """
    own = {"labels": labels, "events": events, "marked": marked, "actions": actions, "factors": factors}
    if isinstance(env, str):
        with closing(made(env, options or {})) as opened:
            return environment_model(opened, rewards=rewards, **own)  # type: ignore[arg-type] # each has its own type
    if options is not None:
        message = "options are for an environment that is given by its id; this one is made already"
        raise MDPError(message)
    core: Any = getattr(env, "unwrapped", env)
    if callable(getattr(core, "model", None)):
        return _own_model(core, own, rewards=rewards)
    steps, start = read_table(core)
    look = _look(core, steps, len(start), actions, factors)
    if marked is not None:
        look = look._replace(marked=marked)
    model = _assemble(steps, start, look, labels or {}, events or {})
    return model if rewards else replace(model, reward=np.zeros_like(model.reward))


def _own_model(core: Any, own: dict[str, Any], *, rewards: bool) -> TabularMDP:  # noqa: ANN401 - somebody's environment
    given = [name for name, value in own.items() if value is not None]
    if given:
        message = f"{type(core).__name__} has a model of its own; leave out {', '.join(given)}"
        raise MDPError(message)
    model = core.model() if rewards else core.model(rewards=False)
    if not isinstance(model, TabularMDP):
        message = f"model() of {type(core).__name__} gives a {type(model).__name__}; a TabularMDP is needed"
        raise MDPError(message)
    return model


def _look(
    core: Any,  # noqa: ANN401 - somebody's environment
    steps: Steps,
    states: int,
    actions: Sequence[str] | None,
    factors: Callable[[int], Mapping[str, Any]] | None,
) -> Look:
    """Return what the environment looks like, as the user says it or else as its kind is known."""
    count = 1 + int(steps.action.max())
    look = known_look(core, states)
    if len(look.actions) != count or any(len(factor.of) != states for factor in look.factors.values()):
        look = Look(tuple(f"action_{a}" for a in range(count)), {})
    if actions is not None:
        if len(actions) != count:
            message = f"actions names {len(actions)}; the environment has {count}"
            raise MDPError(message)
        look = look._replace(actions=tuple(actions))
    if factors is not None:
        look = look._replace(factors=told_factors(factors, states))
    return look


def _assemble(
    steps: Steps,
    start: Floats,
    look: Look,
    labels: Mapping[str, Condition],
    events: Mapping[str, Condition],
) -> TabularMDP:
    """Put the process together.  Node 2 s is state s of the environment, 2 s + 1 its terminal copy."""
    states, count = len(start), len(look.actions)
    target = (2 * steps.next_state + steps.over).astype(np.int32)
    nodes = _reached(steps, target, start)
    number = np.full(2 * states, NONE, np.int32)
    number[nodes] = np.arange(len(nodes))
    origin, terminal = nodes // 2, nodes % 2 == 1

    source = number[2 * steps.state]
    said = _said(steps, look.factors, events, states)
    every = np.stack([source * count + steps.action, number[target], said, steps.reward], axis=1)
    rows, same = np.unique(every[source != NONE], axis=0, return_inverse=True)
    slot, next_state, said = rows[:, :3].astype(np.int64).T
    prob = np.bincount(same.reshape(-1), steps.prob[source != NONE]).astype(np.float64)
    spoken, word = np.unique(said, return_inverse=True)
    names = tuple(events)
    return TabularMDP(
        actions=look.actions,
        alphabet=Alphabet((*look.actions, *names), frozenset(names)),
        propositions=tuple(labels),
        words=tuple(_word(int(code), count, len(names)) for code in spoken),
        row=np.searchsorted(slot, np.arange(len(nodes) * count + 1)),
        next_state=next_state.astype(np.int32),
        prob=_normalised(prob, slot, origin, count),
        reward=rows[:, 3],
        word=word.astype(np.int32),
        terminal=terminal,
        marked=_completed(steps, look, states)[nodes],
        label=_label(labels, look.factors, states)[origin],
        initial=np.where(terminal, 0.0, start[origin]),
        origin=origin[:, None].astype(np.int32),
    )


def _reached(steps: Steps, target: Ints, start: Floats) -> Longs:
    """Return the nodes that episodes can come to, in ascending order."""
    nodes = 2 * len(start)
    seeds = np.zeros(nodes, np.bool_)
    seeds[::2] = start > 0
    begin = np.searchsorted(2 * steps.state, np.arange(nodes + 1))
    return np.flatnonzero(reachable_from(begin, target, seeds))


def _normalised(prob: Floats, slot: Longs, origin: Longs, actions: int) -> Floats:
    """Return probabilities that sum to 1 in each slot s * A + a, if they nearly do so."""
    total = np.bincount(slot, prob)
    wrong = np.flatnonzero((total > 0) & ~(np.abs(total - 1) <= TOLERANCE))
    if wrong.size:
        s, a = divmod(int(wrong[0]), actions)
        message = f"P[{origin[s]}][{a}]: the probabilities sum to {total[wrong[0]]:.9g}; 1 is needed"
        raise MDPError(message)
    return prob / total[slot]


def _said(steps: Steps, factors: Mapping[str, Factor], events: Mapping[str, Condition], states: int) -> Longs:
    """Return the word of each step as a number: the action, then a bit for each event."""
    if len(events) > _MAX_EVENTS:
        message = f"{len(events)} events; at most {_MAX_EVENTS} can be told apart"
        raise MDPError(message)
    said = steps.action << len(events)
    for e, (name, condition) in enumerate(events.items()):
        holds = steps_where(condition, f"event {name!r}", factors, steps.next_state, steps.reward, states)
        said = said | holds.astype(np.int64) << e
    return said


def _word(said: int, actions: int, events: int) -> tuple[int, ...]:
    return (said >> events, *(actions + e for e in range(events) if said >> e & 1))


def _label(labels: Mapping[str, Condition], factors: Mapping[str, Factor], states: int) -> Longs:
    label = np.zeros(states, np.int64)
    for i, (name, condition) in enumerate(labels.items()):
        label |= states_where(condition, f"label {name!r}", factors, states).astype(np.int64) << i
    return label


def _completed(steps: Steps, look: Look, states: int) -> Bools:
    """Return which nodes count as completion: as told, or the terminal ones that the best endings lead to."""
    if look.marked is not None:
        return np.repeat(states_where(look.marked, "marked", look.factors, states), 2)
    marked = np.zeros(2 * states, np.bool_)
    best = steps.over & (steps.reward == steps.reward[steps.over].max(initial=-np.inf))
    marked[2 * steps.next_state[best] + 1] = True
    return marked

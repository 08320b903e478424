"""Whose turn it is in each state of a decision process that several agents share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal._graph import coreachable_to
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.safety import enabled_graph, find_dead_end, reachable_states
from supremal.errors import MDPError, suggest


def turns(model: TabularMDP, enabled: Bools, agents: Mapping[str, Sequence[str]]) -> Ints:
    """Return the agent whose turn it is in each state, ``int32 [S]``; `NONE` where no agent has one.

    Parameters
    ----------
    model
        What can happen.
    enabled
        ``bool [S, A]``, nothing of it in terminal states; only the states that it leads to count.
    agents
        The actions of each agent.  One that nobody has is nature's.

    Raises
    ------
    MDPError
        If actions and agents do not fit, two can act in one state, or from one that is not terminal nobody
        can ever act again.
    """
    players, owner = _owners(model, agents)
    acts = np.stack([enabled[:, owner == k].any(axis=1) for k in range(len(players))], axis=1)
    reached = reachable_states(model, enabled)
    crowded = reached & (acts.sum(axis=1) > 1)
    if crowded.any():
        both = " and ".join(players[k] for k in np.flatnonzero(acts[crowded][0]))
        message = f"{_after(model, enabled, crowded)} it is the turn of {both}; one at a time has to act"
        raise MDPError(message)
    asked = acts[:, : len(agents)]
    stuck = reached & ~coreachable_to(*enabled_graph(model, enabled), asked.any(axis=1) | model.terminal)
    if stuck.any():
        message = f"{_after(model, enabled, stuck)} no agent has a turn any more, and nothing is over"
        raise MDPError(message)
    return np.where(asked.any(axis=1), asked.argmax(axis=1), NONE).astype(np.int32)


def _owners(model: TabularMDP, agents: Mapping[str, Sequence[str]]) -> tuple[list[str], Ints]:
    """Return who moves, the agents first, and which of them each action is of, ``int32 [A]``."""
    players, owner = [*agents], np.full(model.n_actions, NONE, np.int32)
    for k, (name, own) in enumerate(agents.items()):
        if isinstance(own, str) or not own:
            message = f"the actions of agent {name!r} are {own!r}; a list of one name or more is needed"
            raise MDPError(message)
        for action in own:
            if action not in model.actions:
                known = suggest(str(action), model.actions)
                message = f"agent {name!r} has the action {action!r}, which is unknown; {known}"
                raise MDPError(message)
            a = model.actions.index(action)
            if owner[a] != NONE:
                message = f"action {action!r} is that of {players[owner[a]]!r} and of {name!r}; name it once"
                raise MDPError(message)
            owner[a] = k
    for a in np.flatnonzero(owner == NONE).tolist():
        action = model.actions[a]
        if action in model.alphabet and action not in model.alphabet.uncontrollable:
            message = f"action {action!r} can be chosen, but no agent has it; give it to one"
            raise MDPError(message)
        owner[a] = len(players)
        players.append(f"nature ({action})")
    return players, owner


def _after(model: TabularMDP, enabled: Bools, states: Bools) -> str:
    """Say by a shortest word where the nearest of some reachable ``states`` is."""
    word = find_dead_end(model, enabled & ~states[:, None])
    return f"after {' '.join(word)}" if word else "at the start"

"""Several agents under one supervisor: `TeamEnv`, a turn-based environment for PettingZoo.

A decision process in which each state belongs to one agent is a game of that team against chance.  The agent
whose turn it is chooses an enabled action, an outcome is drawn, and where nobody has a choice *nature* moves
on its own until somebody has one again, or the episode is over.  One supervisor watches all of it: the mask
of an agent is a row of the mask of the whole product, so that what one agent may do depends on what the
others did.  No agent needs a supervisor of its own, and none can be led by the others to where it has
nothing left to do.

The team is paid together: every agent earns the reward of every step.

Source: Terry et al., "PettingZoo: Gym for multi-agent reinforcement learning", NeurIPS 2021 (Agent
Environment Cycle games, in which chance is a player too).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import index
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.safety import check_mask, reachable_states
from supremal.envs._gymnasium import Dict, Discrete, MultiDiscrete
from supremal.envs._pettingzoo import AECEnv
from supremal.envs._team_turns import turns
from supremal.errors import MDPError

Observation: TypeAlias = dict[str, Any]


class TeamEnv(AECEnv[str, Observation, int]):
    r"""A decision process as an environment whose agents act in turn.

    Parameters
    ----------
    model
        What can happen, and what it is worth: usually a `product` of environment, rules and reward machine.
    agents
        The actions of each agent, by its name.  An action that is no controllable event, such as waiting,
        is nobody's: where it is the only one, nature takes it.
    enabled
        The supervisor's mask, ``bool [S, A]``; left out: every feasible action, the baseline, in which an
        episode ends where a rule breaks.
    observations
        ``int [S, K]``: what agents see of each state; left out: the ``origin`` of the model.
    max_steps
        After so many actions of agents an episode is truncated; None: never.

    Raises
    ------
    MDPError
        If actions and agents do not fit, the mask is no supervisor, two can act at once, nobody can ever act
        again, or ``observations`` has another shape.

    Notes
    -----
    An agent's action k is the k-th of its own list.  An observation is ``{"observation": int64 [K],
    "action_mask": int8 [A]}``, which is PettingZoo's convention.  The mask of the agent whose turn it is
    always has an action; that of the others is 0, until all is over, when it is 1, so that a maximum over it
    exists.  ``infos`` hold ``events``, the word of the last step, nature's moves included, and ``state``, the
    state of ``model``.  An agent may have several turns in a row.

    A step takes some ten microseconds, and the tables about 40 bytes an outcome.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> relay = from_outcomes(
    ...     [
    ...         (0, "pass", 1, 1.0, ("pass",)),
    ...         (1, "toss", 0, 0.5, ("lost",)),
    ...         (1, "toss", 2, 0.5, ("held",), 1.0),
    ...         (2, "run", 3, 1.0, ("run",)),
    ...     ],
    ...     alphabet=Alphabet(("pass", "run", "lost", "held"), uncontrollable=frozenset({"lost", "held"})),
    ...     terminal=[3],
    ... )
    >>> env = TeamEnv(relay, {"first": ["pass"], "second": ["run"]})
    >>> env.reset(seed=0)
    >>> while env.agent_selection == "first":
    ...     env.step(0)
    ...     print(env.infos["first"]["events"])
    ('pass', 'held')
    >>> observation, reward, terminated, truncated, info = env.last()
    >>> env.agent_selection, observation["observation"].tolist(), reward
    ('second', [2], 1.0)
    """

    metadata: ClassVar[dict[str, Any]] = {"name": "supremal_team_v0", "render_modes": []}
    render_mode = None

    def __init__(
        self,
        model: TabularMDP,
        agents: Mapping[str, Sequence[str]],
        *,
        enabled: Bools | None = None,
        observations: Ints | Longs | None = None,
        max_steps: int | None = None,
    ) -> None:
        super().__init__()
        check_mask(model, model.feasible if enabled is None else enabled)
        if max_steps is not None and max_steps < 1:
            message = f"max_steps is {max_steps}; a whole number above 0, or None, is needed"
            raise MDPError(message)
        mask = (model.feasible if enabled is None else enabled) & ~model.terminal[:, None]
        self.model, self.max_steps = model, max_steps
        self.possible_agents: list[str] = [*agents]
        self.agents: list[str] = []
        self._turn = turns(model, mask, agents).tolist()
        self._columns = {name: [model.actions.index(action) for action in agents[name]] for name in agents}
        self._masks = {name: mask[:, own].astype(np.int8) for name, own in self._columns.items()}
        self._moves = mask.argmax(axis=1).tolist()
        self._words = [model.spell(w) for w in range(len(model.words))]
        self._seen = _checked(observations, model)
        self._random = np.random.default_rng()
        self.state_space = _space(self._seen[reachable_states(model, mask)])
        self._choices, self._views = {}, {}
        for name, own in self._columns.items():
            masks = _space(np.array([[0], [1]], np.int8).repeat(len(own), axis=1))
            self._choices[name] = Discrete(len(own))
            self._views[name] = Dict({"observation": self.state_space, "action_mask": masks})

    def observation_space(self, agent: str) -> Dict:
        """Return the space of what ``agent`` observes, always the same object."""
        return self._views[agent]

    def action_space(self, agent: str) -> Discrete:
        """Return the space of the actions of ``agent``, always the same object."""
        return self._choices[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:  # noqa: ARG002 - PettingZoo's
        """Start a new episode, and let nature move until it is somebody's turn; ``options`` are not used."""
        if seed is not None:
            self._random = np.random.default_rng(seed)
        starts = np.flatnonzero(self.model.initial)
        first = starts[0] if len(starts) == 1 else self._random.choice(starts, p=self.model.initial[starts])
        self._state, self._steps, self._skip_agent_selection = int(first), 0, None
        self.agents = self.possible_agents[:]
        self._cumulative_rewards = dict.fromkeys(self.agents, 0.0)
        self._settle(0.0, ())

    def step(self, action: int | None) -> None:
        """Let the agent whose turn it is act, and then nature, until it is somebody's turn again.

        Raises
        ------
        MDPError
            If the mask does not enable ``action``, there is no such action, or no episode has begun; nothing
            has happened then.
        """
        if not self.agents:
            message = "no episode is under way; call reset first"
            raise MDPError(message)
        agent = self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            return
        chosen = self._chosen(agent, action)
        self._cumulative_rewards[agent] = 0.0
        self._steps += 1
        self._settle(*self._move(self._columns[agent][chosen]))

    def observe(self, agent: str) -> Observation:
        """Return what ``agent`` sees now."""
        mask, asked = self._masks[agent][self._state], self._turn[self._state]
        if asked == NONE or self.possible_agents[asked] != agent:
            mask = np.full_like(mask, any(self.terminations.values()) or any(self.truncations.values()))
        return {"observation": self.state(), "action_mask": mask.copy()}

    def state(self) -> NDArray[np.int64]:
        """Return what all agents see, without masks."""
        seen: NDArray[np.int64] = self._seen[self._state].copy()
        return seen

    def _settle(self, reward: float, word: tuple[str, ...]) -> None:
        """Let nature move on after a step, until it is somebody's turn or all is over."""
        over = self.model.terminal.item
        while self._turn[self._state] == NONE and not over(self._state):
            earned, more = self._move(self._moves[self._state])
            reward, word = reward + earned, word + more
        terminated = over(self._state)
        truncated = self._steps == self.max_steps and not terminated
        self.agent_selection = self.possible_agents[0 if terminated else self._turn[self._state]]
        self.terminations = dict.fromkeys(self.agents, terminated)
        self.truncations = dict.fromkeys(self.agents, truncated)
        self.infos = {agent: {"events": word, "state": self._state} for agent in self.agents}
        self.rewards = dict.fromkeys(self.agents, reward)
        self._accumulate_rewards()

    def _move(self, action: int) -> tuple[float, tuple[str, ...]]:
        """Draw an outcome of a model's ``action``; return its reward and its word."""
        model = self.model
        slot = self._state * model.n_actions + action
        outcome, last = model.row.item(slot), model.row.item(slot + 1) - 1
        if outcome < last:
            left = self._random.random() - model.prob.item(outcome)
            while left >= 0 and outcome < last:
                outcome += 1
                left -= model.prob.item(outcome)
        self._state = model.next_state.item(outcome)
        return model.reward.item(outcome), self._words[model.word.item(outcome)]

    def _chosen(self, agent: str, action: Any) -> int:  # noqa: ANN401 - an integer of any kind
        """Return the number of an enabled action."""
        columns = self._columns[agent]
        try:
            chosen = index(action)
        except TypeError:
            chosen = NONE
        if not 0 <= chosen < len(columns):
            message = (
                f"action {action!r} of {agent} is not known; a whole number from 0 to {len(columns) - 1} "
            )
            raise MDPError(message + "is needed")
        mask = self._masks[agent][self._state]
        if not mask[chosen]:
            names = [self.model.actions[a] for a in columns]
            possible = self.model.feasible[self._state, columns[chosen]]
            why = "the supervisor disables it" if possible else "it is not possible there"
            others = ", ".join(names[k] for k in np.flatnonzero(mask))
            message = f"action {chosen} ({names[chosen]!r}) of {agent}: {why}; enabled: {others}"
            raise MDPError(message)
        return chosen


def _checked(observations: Ints | Longs | None, model: TabularMDP) -> Longs:
    """Return what agents see of each state, ``int64 [S, K]``."""
    seen = np.asarray(model.origin if observations is None else observations)
    if seen.ndim != 2 or len(seen) != model.n_states or not seen.shape[1] or seen.dtype.kind not in "iu":
        message = (
            f"observations have shape {seen.shape} and type {seen.dtype}; int ({model.n_states}, K) is needed"
        )
        raise MDPError(message)
    return seen.astype(np.int64)


def _space(rows: NDArray[Any]) -> MultiDiscrete:
    """Return the smallest space that has all ``rows``."""
    low = rows.min(axis=0)
    return MultiDiscrete(rows.max(axis=0) - low + 1, dtype=rows.dtype.type, start=low)

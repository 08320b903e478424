"""Learning without a model: a table that grows with what is observed.

The algorithms are those of `q_learning`; there is no process to know beforehand.  Each observation that comes
along gets a row of the table, found again by hashing, and what an environment says in its ``info`` takes the
place of what a model would: ``info["action_mask"]``, where there is one, restricts both the choice of an
action and the maximum of the bootstrap.  A step that *terminates* has no future; one that is *truncated*, by
the environment or by the limit of steps, has.

Source: Sutton, Barto, *Reinforcement Learning: An Introduction*, 2nd ed., chapter 6.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal._hash import find_row, rehash_rows
from supremal._jit import COMPILED
from supremal.errors import MDPError
from supremal.learning import _table_kernels as kernels
from supremal.learning._table_keys import Keys
from supremal.learning.settings import ALGORITHMS, Settings

_ROOM: Final = 1024
_EVERY: Final = 100
"""Episodes between two reports."""


@dataclass(frozen=True, slots=True, eq=False)
class TableResult:
    """What `table_learning` returns; N episodes were run, S observations seen.

    Parameters
    ----------
    q
        ``float [S, A]``: the learned values; double Q-learning: the mean of its two tables.
    enabled
        ``bool [S, A]``: which actions were enabled when the observation was last seen.
    slots
        ``int64 [C, 1 + W]``: the hash table of the observations, rows (number + 1, key).
    first_action
        The environment's number of action 0.
    returns, lengths, completed, violations
        ``[N]``: what each episode earned, undiscounted; its steps; ``info["is_success"]`` at its end, where
        there is none whether it terminated; and the sum of ``info["violations"]`` over it, 0 without.
    seed, epsilon, seconds
        The seed, the final ε, and the time that the episodes took, that of the environment with it.
    finished
        False where the run was stopped.
    """

    q: Floats
    enabled: Bools
    slots: Longs
    first_action: int
    returns: Floats
    lengths: Ints
    completed: Bools
    violations: Ints
    seed: int
    epsilon: float
    seconds: float
    finished: bool
    _keys: Keys

    @property
    def keys(self) -> Longs:
        """The whole numbers in each observation, ``int64 [S, W]``."""
        taken = self.slots[self.slots[:, 0] > 0]
        keys: Longs = taken[np.argsort(taken[:, 0]), 1:]
        return keys

    def predict(self, observation: Any, mask: NDArray[Any] | None = None) -> int:  # noqa: ANN401 - whatever an environment observes
        """Return the best action, the first of equal ones.

        Parameters
        ----------
        observation
            As the environment gave it.  Where it was never seen, the first enabled action is returned.
        mask
            Which actions are enabled, ``[A]``; left out: those that were when it was last seen.

        Raises
        ------
        MDPError
            If the observation is not made like those that were learned from, or the mask enables no action.
        """
        row = int(self.slots[find_row(self.slots, self._keys.read(observation)), 0]) - 1
        actions = self.q.shape[1]
        values = self.q[row] if row >= 0 else np.zeros(actions)
        if mask is not None:
            enabled = _as_mask(mask, actions)
        else:
            enabled = self.enabled[row] if row >= 0 else np.ones(actions, np.bool_)
        if not enabled.any():
            message = (
                f"the mask enables no action after the observation {observation}; an agent has to choose one"
            )
            raise MDPError(message)
        return self.first_action + int(np.where(enabled, values, -np.inf).argmax())


def table_learning(
    env: Any,  # noqa: ANN401 - anything with Gymnasium's reset and step
    *,
    settings: Settings | None = None,
    seed: int = 0,
    key: Callable[[Any], Any] | None = None,
    on_episodes: Callable[[TableResult], object] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> TableResult:
    """Learn a policy for an environment of which nothing is known.

    Parameters
    ----------
    env
        An environment with Gymnasium's ``reset`` and ``step`` and discrete actions; usually a
        `SupervisedEnv`.
    settings
        Left out: those of the paper.
    seed
        For the learner, and for the environment's first ``reset``.  Same seed, same result.
    key
        A function that makes whole numbers (one, or an array, tuple or dictionary of them) of an
        observation.  Left out: observations are whole numbers already.
    on_episodes
        Called with the result so far, every hundred episodes and at the end; its arrays go on changing.
    should_stop
        Asked as often; once it says yes, what there is is returned.

    Returns
    -------
    TableResult

    Raises
    ------
    MDPError
        If actions are not discrete, an observation is not of whole numbers, a mask enables nothing, or the
        settings ask for counterfactual steps, which need a model.

    Notes
    -----
    Some microseconds a step besides those of the environment.  Memory is A numbers (double Q-learning: 2 A)
    and 2 (1 + W) whole numbers, for keys of W, for each observation that is seen, and up to twice as much.

    Examples
    --------
    >>> import gymnasium
    >>> from supremal import Settings
    >>> env = gymnasium.make("CliffWalking-v1", max_episode_steps=100)
    >>> result = table_learning(env, settings=Settings(episodes=300, alpha=0.5, gamma=0.99))
    >>> observation, info = env.reset()
    >>> result.predict(observation), len(result.keys)
    (0, 37)
    """
    settings = settings or Settings()
    if settings.counterfactual:
        message = "counterfactual steps need a model of rules and rewards; use q_learning, or leave them out"
        raise MDPError(message)
    n = settings.episodes
    learner = _Learner(env, settings, Keys(key), seed)
    returns, lengths = np.zeros(n), np.zeros(n, np.int32)
    completed, violations = np.zeros(n, np.bool_), np.zeros(n, np.int32)
    alphas, epsilons = settings.alpha_schedule.over(0, n), settings.epsilon_schedule.over(0, n)

    def result(done: int, seconds: float) -> TableResult:
        return TableResult(
            q=learner.q[:, : learner.count].mean(axis=0)
            if settings.tables > 1
            else learner.q[0, : learner.count],
            enabled=learner.allowed[: learner.count],
            slots=learner.slots,
            first_action=learner.first_action,
            returns=returns[:done],
            lengths=lengths[:done],
            completed=completed[:done],
            violations=violations[:done],
            seed=seed,
            epsilon=settings.epsilon_at(done),
            seconds=seconds,
            finished=done == n,
            _keys=learner.keys,
        )

    done, began = 0, perf_counter()
    while done < n and not (should_stop and should_stop()):
        until = min(n, done + _EVERY)
        # The generator counts modulo 2⁶⁴, which warns where it runs uncompiled.
        with nullcontext() if COMPILED else np.errstate(over="ignore"):
            for e in range(done, until):
                told = learner.episode(float(alphas[e]), float(epsilons[e]), seed if e == 0 else None)
                returns[e], lengths[e], completed[e], violations[e] = told
        done = until
        if on_episodes:
            on_episodes(result(done, perf_counter() - began))
    return result(done, perf_counter() - began)


class _Learner:
    """The table, and what fills it."""

    def __init__(self, env: Any, settings: Settings, keys: Keys, seed: int) -> None:  # noqa: ANN401 - see above
        space: Any = getattr(env, "action_space", None)
        if not hasattr(space, "n") or np.ndim(space.n):
            message = f"the environment's actions are {space}; a Discrete space of actions is needed"
            raise MDPError(message)
        self.env, self.keys, self.limit, self.gamma = env, keys, settings.episode_steps, settings.gamma
        self.actions, self.first_action = int(space.n), int(getattr(space, "start", 0))
        schedule = settings.alpha_schedule
        self.power = float(schedule.power or 0.0) if schedule.kind == "visits" else 0.0
        self.algorithm = ALGORITHMS.index(settings.algorithm)
        self.random = np.random.SeedSequence(seed).generate_state(1, np.uint64)
        self.at = np.array([NONE, NONE, 0], np.int64)
        self.enabled = np.ones(self.actions, np.bool_)
        self.slots = np.zeros((0, 0), np.int64)  # the first key says how wide it is
        self.q = np.zeros((settings.tables, _ROOM, self.actions), settings.dtype)
        self.visits = np.zeros(self.q.shape if self.power else (0, 0, 0), np.int64)
        self.allowed = np.ones(self.q.shape[1:], np.bool_)

    @property
    def count(self) -> int:
        """How many observations have been seen."""
        return int(self.at[kernels.COUNT])

    def episode(self, alpha: float, epsilon: float, seed: int | None) -> tuple[float, int, bool, int]:
        """Run one; return what it earned, its steps, whether it was completed, and its violations."""
        observation, info = self.env.reset() if seed is None else self.env.reset(seed=seed)
        self.at[kernels.ROW] = NONE
        action = self.advance(observation, info, 0.0, False, alpha, epsilon)
        score, steps, broken = 0.0, 0, 0
        while True:
            observation, reward, terminated, truncated, info = self.env.step(self.first_action + action)
            score += reward
            steps += 1
            broken += info.get("violations", 0)
            action = self.advance(observation, info, float(reward), bool(terminated), alpha, epsilon)
            if terminated or truncated or steps >= self.limit:
                return score, steps, bool(info.get("is_success", terminated)), broken

    def advance(
        self,
        observation: Any,  # noqa: ANN401 - whatever an environment observes
        info: dict[str, Any],
        reward: float,
        over: bool,  # noqa: FBT001 - as the kernel takes it
        alpha: float,
        epsilon: float,
    ) -> int:
        """Learn from one step; return the next action."""
        key = self.keys.read(observation)
        mask = info.get("action_mask")
        if mask is None:
            self.enabled.fill(True)
        else:
            self.enabled[:] = _as_mask(mask, self.actions)
        if self.at[kernels.COUNT] == self.q.shape[1] or not self.slots.size:
            self.make_room(len(key))
        action = kernels.advance(
            self.algorithm,
            self.slots,
            key,
            self.enabled,
            over,
            reward,
            self.at,
            self.random,
            self.q,
            self.visits,
            self.allowed,
            alpha,
            self.power,
            self.gamma,
            epsilon,
        )
        if action == NONE and not over:
            message = (
                f"the mask enables no action after the observation {observation}; an agent has to choose one"
            )
            raise MDPError(message)
        return action

    def make_room(self, width: int) -> None:
        """Make room for the first observations, or for twice as many."""
        if not self.slots.size:
            self.slots = np.zeros((2 * _ROOM, 1 + width), np.int64)
            return
        self.slots = rehash_rows(self.slots)
        self.q, self.visits = (
            np.concatenate([table, np.zeros_like(table)], axis=1) for table in (self.q, self.visits)
        )
        self.allowed = np.concatenate([self.allowed, np.ones_like(self.allowed)])


def _as_mask(mask: Any, actions: int) -> NDArray[Any]:  # noqa: ANN401 - whatever an environment says
    """Return a mask as an array, if it has an entry for each action."""
    array = mask if isinstance(mask, np.ndarray) else np.asarray(mask)
    if array.shape != (actions,):
        message = f"a mask has shape {array.shape}; ({actions},) is needed, an entry for each action"
        raise MDPError(message)
    return array

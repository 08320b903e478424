"""The pick-up and delivery grid as a Gymnasium environment.

The environment is `PickupDelivery` and a reward machine that reads the label of each new state; it has no
rules of its own.  ``info`` says all that a supervisor or a monitor beside it needs to know.

An action that is not feasible does nothing: one epoch passes, the word is (), no item falls, and the reward
machine reads the same label once more.  ``info["action_mask"]`` says which ones are feasible.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from supremal.decisions.mdp import TabularMDP
from supremal.decisions.product import product
from supremal.decisions.reward_machine import RewardMachine
from supremal.envs._draw import draw
from supremal.envs._dynamics import Preset
from supremal.envs._grid import CELLS, HEADS, HEIGHT, POSES, WIDTH
from supremal.envs._gymnasium import Discrete, Env, MultiDiscrete
from supremal.envs._loads import LOADS
from supremal.envs._pixels import pixels
from supremal.envs.pickup_delivery import PLACES, Answer, PickupDelivery
from supremal.errors import MDPError, RuleError, suggest


class PickupDeliveryEnv(Env[NDArray[np.int64], np.int64]):
    """The pick-up and delivery grid.

    Parameters
    ----------
    drop_probability, preset
        See `PickupDelivery`.
    reward_machine
        A machine over some of i1, i2, i3 (the item is carried) and S (the agent is there); left out: that
        of the preset.
    render_mode
        None, "ansi" (a string) or "rgb_array".

    Raises
    ------
    MDPError
        If a setting is out of its range.
    RuleError
        If the reward machine knows a proposition that the grid does not.

    Notes
    -----
    An action is the number of l, r, f, b, p1, p2, p3, d1, d2, d3 (published preset: l, r, f, b).

    An observation has the columns x, y, heading (up, right, down, left), items 1, 2, 3 (0 at home,
    1 carried, 2 dropped), the cell of the drop (0 for none, else 1 + 9 y + x), whether all three were just
    collected, and the state of the reward machine.  These make it Markov.

    ``info`` holds ``action_mask`` (int8, 1 for a feasible action), ``events`` (the word that occurred),
    ``labels`` (what is true now) and ``state`` (see `decode`).

    Examples
    --------
    >>> env = PickupDeliveryEnv()
    >>> observation, info = env.reset(seed=0)
    >>> observation.tolist(), info["labels"], info["action_mask"].tolist()
    ([6, 0, 0, 0, 0, 0, 0, 0, 0], ('S',), [1, 1, 1, 0, 0, 0, 0, 0, 0, 0])
    >>> observation, reward, terminated, truncated, info = env.step(0)
    >>> observation.tolist(), reward, info["events"]
    ([5, 0, 3, 0, 0, 0, 0, 0, 0], -10.0, ('l',))
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["ansi", "rgb_array"], "render_fps": 4}  # type: ignore[misc]

    def __init__(
        self,
        *,
        drop_probability: float = 0.5,
        preset: Preset = "default",
        reward_machine: RewardMachine | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.grid = PickupDelivery(drop_probability, preset)
        self.reward_machine = reward_machine or self.grid.reward_machine()
        if render_mode not in (None, *self.metadata["render_modes"]):
            known = suggest(str(render_mode), self.metadata["render_modes"])
            message = f"unknown render_mode {render_mode!r}; {known}"
            raise MDPError(message)
        self.render_mode = render_mode
        self.action_space = Discrete(len(self.grid.actions))
        sizes = [WIDTH, HEIGHT, HEADS, *[len(PLACES)] * 3, 1 + CELLS, 2, len(self.reward_machine.states)]
        self.observation_space = MultiDiscrete(sizes)
        self._mask = self.grid.feasible.astype(np.int8)
        self._truths = _truths(self.grid.propositions)
        self._next, self._reward = _read(self.reward_machine, self.grid.propositions)
        self._state, self._machine = self.grid.start, 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.int64], dict[str, Any]]:
        """Start a new episode at S, all items at home; ``options`` are not used."""
        super().reset(seed=seed, options=options)
        self._state, self._machine = self.grid.start, 0
        return self._observe(), self._info(())

    def step(self, action: np.int64 | int) -> tuple[NDArray[np.int64], float, bool, bool, dict[str, Any]]:
        """Let one epoch pass.

        Returns
        -------
        observation, reward, terminated, truncated, info
            ``truncated`` is always False: cutting by time is the affair of a wrapper.
        """
        word: tuple[str, ...] = ()
        answers = self.grid.outcomes(self._state, int(action))
        if answers:
            self._state, _, word = answers[0] if len(answers) == 1 else self._draw(answers)
        label = self.grid.label(self._state)
        reward = self._reward[self._machine][label]
        self._machine = self._next[self._machine][label]
        terminated = self.grid.is_terminal(self._state)
        return self._observe(), reward, terminated, False, self._info(word)

    def render(self) -> str | NDArray[np.uint8] | None:
        """Return a picture of the present state, None without a ``render_mode``."""
        if self.render_mode is None:
            return None
        return draw(self._state) if self.render_mode == "ansi" else pixels(self._state)

    def model(self, *, rewards: bool = True) -> TabularMDP:
        """Return the grid and its reward machine as a table; infeasible actions are left out.

        ``origin`` holds the numbers of the grid's state (see `decode`) and of the machine's.  Without
        ``rewards`` it is the grid alone.
        """
        return product(self.grid.model(), (), self.reward_machine) if rewards else self.grid.model()

    def _draw(self, answers: tuple[Answer, ...]) -> Answer:
        """Choose one of two answers by their probabilities."""
        return answers[self.np_random.random() >= answers[0].prob]

    def _observe(self) -> NDArray[np.int64]:
        load, pose = divmod(self._state, POSES)
        cell, heading = divmod(pose, HEADS)
        y, x = divmod(cell, WIDTH)
        items, lies, fresh = LOADS[load]
        return np.array([x, y, heading, *items, 1 + lies, fresh, self._machine], np.int64)

    def _info(self, word: tuple[str, ...]) -> dict[str, Any]:
        return {
            "action_mask": self._mask[self._state].copy(),
            "events": word,
            "labels": self._truths[self.grid.label(self._state)],
            "state": self._state,
        }


def _truths(propositions: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
    """Return the propositions true in each label."""
    return tuple(
        tuple(name for i, name in enumerate(propositions) if label >> i & 1)
        for label in range(1 << len(propositions))
    )


def _read(machine: RewardMachine, propositions: tuple[str, ...]) -> tuple[list[list[int]], list[list[float]]]:
    """Return the next state and the reward of ``machine``, by its state and the label of the grid."""
    for name in machine.propositions:
        if name not in propositions:
            message = (
                f"reward machine {machine.name!r} reads {name!r}, which the grid does not know; "
                f"{suggest(name, propositions)}"
            )
            raise RuleError(message)
    steps = [[machine.step(u, true) for true in _truths(propositions)] for u in range(len(machine.states))]
    return [[u for u, _ in row] for row in steps], [[r for _, r in row] for row in steps]

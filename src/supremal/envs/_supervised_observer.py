"""What an agent observes: the environment's own observation, and the states that make it Markov."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import NONE, Ints
from supremal.envs._gymnasium import Box, Dict, Discrete, Space, batch_space, flatten, flatten_space, iterate
from supremal.envs._supervised_model import SupervisedModel
from supremal.envs._supervised_run import Run
from supremal.envs.layout import Kind, Layout
from supremal.errors import MDPError

Numbers: TypeAlias = NDArray[np.float32]


class InDictionary:
    """States stand as numbers beside the environment's own observation.

    Parameters
    ----------
    space
        The environment's.
    model
        Whose states they are.
    machine
        How many states the reward machine has; 0 where there is none.
    """

    def __init__(self, space: Space[Any], model: SupervisedModel, machine: int) -> None:
        self._outside, self._machine = len(model.masks), machine > 0
        self._merged = isinstance(space, Dict)
        spaces = dict(space.spaces) if isinstance(space, Dict) else {"observation": space}
        own: dict[str, Space[Any]] = {"supervisor": Discrete(self._outside + 1)}
        if machine:
            own["machine"] = Discrete(machine)
        clash = sorted(own.keys() & spaces.keys())
        if clash:
            message = (
                f"the environment's observation has a key {clash[0]!r}, which the supervised one needs for "
                "itself; rename it in the environment, or use observe='flat'"
            )
            raise MDPError(message)
        self.space = Dict(spaces | own)
        self.layout = Layout("dict", self._outside, machine, 0, (), np.empty((0, 0), np.int32), self.space)

    def one(self, observation: Any, run: Run, machine: int) -> dict[str, Any]:  # noqa: ANN401 - the environment's
        """Return one observation."""
        state = run.state
        told = {**observation} if self._merged else {"observation": observation}
        told["supervisor"] = self._outside if state == NONE else state
        if self._machine:
            told["machine"] = machine
        return told

    def many(self, observations: Any, states: Ints, lost: Mapping[int, Run], machine: Ints) -> dict[str, Any]:  # noqa: ANN401, ARG002 - the environment's
        """Return N observations; ``states [N]`` are the supervisor's, those outside of it follow ``lost``."""
        told = {**observations} if self._merged else {"observation": observations}
        told["supervisor"] = np.where(states == NONE, self._outside, states).astype(np.int64)
        if self._machine:
            told["machine"] = machine.astype(np.int64)
        return told


class InArray:
    """One array: the environment's observation flattened, a block for each plant and rule, one for rewards.

    Parameters are those of `InDictionary`.
    """

    def __init__(self, space: Space[Any], model: SupervisedModel, machine: int) -> None:
        own = _flat(space)
        parts = (*model.plants, *model.rules)
        # A rule that breaks starts again, and the last plant allows anything; the others may get lost.
        can_be_lost = [(plant.delta == NONE).any() for plant in model.plants] + [False] * len(model.rules)
        self._shown = [k for k, part in enumerate(parts) if part.n_states > 1 or can_be_lost[k]]
        sizes = tuple(parts[k].n_states for k in self._shown)
        more = sum(sizes) + machine
        low, high = (
            np.append(end, np.full(more, k, np.float32)) for k, end in enumerate((own.low, own.high))
        )
        self.space = Box(low, high, dtype=np.float32)
        states = model.supervisor.automaton.origin[:, self._shown]
        self.layout = Layout("flat", len(states), machine, len(own.low), sizes, states, self.space)
        self._blank = np.zeros(len(self.space.low), np.float32)
        starts = self.layout.starts
        self._width, self._starts, self._rewards = starts[0], starts[:-1], starts[-1] if machine else NONE
        self._hot = states.astype(np.intp) + np.array(starts[:-1], np.intp)
        self._flatten, self._flatten_all = _flattener(space), _flattener_of_many(space)

    def one(self, observation: Any, run: Run, machine: int) -> Numbers:  # noqa: ANN401 - the environment's
        """Return one observation."""
        told = self._blank.copy()
        told[: self._width] = self._flatten(observation)
        # Blocks are few: one after the other is quicker than an index array.
        for spot in self._hot[run.state].tolist() if run.state != NONE else self._spots(run.parts):
            told[spot] = 1
        if self._rewards != NONE:
            told[self._rewards + machine] = 1
        return told

    def many(self, observations: Any, states: Ints, lost: Mapping[int, Run], machine: Ints) -> Numbers:  # noqa: ANN401 - the environment's
        """Return N observations, ``float32 [N, D + ΣK + U]``."""
        told = np.zeros((len(states), len(self._blank)), np.float32)
        told[:, : self._width] = self._flatten_all(observations, len(states))
        rows = np.arange(len(states))
        inside = states != NONE
        told[rows[inside, None], self._hot[states[inside]]] = 1
        for i, run in lost.items():
            told[i, self._spots(run.parts)] = 1
        if self._rewards != NONE:
            told[rows, self._rewards + machine] = 1
        return told

    def _spots(self, parts: Sequence[int]) -> list[int]:
        """Return where the blocks of ``parts`` are 1."""
        return [at + parts[k] for at, k in zip(self._starts, self._shown, strict=True) if parts[k] != NONE]


Observer: TypeAlias = InDictionary | InArray


def observer(kind: Kind, space: Space[Any], model: SupervisedModel, machine: int) -> Observer:
    """Return what tells observations of that kind."""
    return (InArray if kind == "flat" else InDictionary)(space, model, machine)


def _flat(space: Space[Any]) -> Box:
    """Return the space of flattened observations, of ``float32``."""
    flat = None
    with suppress(NotImplementedError):
        flat = flatten_space(space)
    if not isinstance(flat, Box):
        message = f"observations of {space} cannot be flattened; use observe='dict'"
        raise MDPError(message)
    with np.errstate(over="ignore"):  # the largest float64 is infinite there
        return Box(flat.low.astype(np.float32), flat.high.astype(np.float32), dtype=np.float32)


def _flattener(space: Space[Any]) -> Callable[[Any], Any]:
    """Return a function that flattens one observation; Gymnasium's own takes its time to find the way."""
    if isinstance(space, Box):
        return np.ravel
    if isinstance(space, Discrete):
        hot, first = np.eye(int(space.n), dtype=np.float32), int(space.start)
        return lambda observation: hot[observation - first]
    return lambda observation: flatten(space, observation)


def _flattener_of_many(space: Space[Any]) -> Callable[[Any, int], Any]:
    """Return a function that flattens the observations of so many environments."""
    if isinstance(space, Box):
        return lambda observations, n: np.reshape(observations, (n, -1))
    if isinstance(space, Discrete):
        numbers = np.arange(space.start, space.start + space.n)
        return lambda observations, _: np.asarray(observations)[:, None] == numbers

    def one_by_one(observations: Any, n: int) -> Any:  # noqa: ANN401 - as nested as the space
        each = iterate(batch_space(space, n), observations)
        flat: list[Any] = [flatten(space, observation) for observation in each]
        return np.stack(flat)

    return one_by_one

r"""What a learned policy is without its learner: fully connected layers, as plain arrays.

An observation is laid out as one vector, numbers as they are and choices one-hot, and goes through L layers,

.. math:: x_{k+1} = \sigma_k(W_k x_k + b_k),

the last of which gives one score an action: its value, or the logarithm of its probability up to a constant.
That takes a few matrix products and no more, so that acting needs no library for learning.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import frozen
from supremal.errors import MDPError, suggest

Numbers: TypeAlias = NDArray[np.float32]

ACTIVATIONS: Final[dict[str, Callable[[Numbers], Numbers]]] = {
    "identity": lambda x: x,
    "relu": lambda x: np.maximum(x, 0),
    "tanh": np.tanh,
    "elu": lambda x: np.where(x > 0, x, np.expm1(np.minimum(x, 0))),
    "sigmoid": lambda x: np.exp(-np.logaddexp(np.float32(0), -x)),
}
"""The functions between layers."""


@dataclass(frozen=True, slots=True)
class Input:
    """One part of an observation.

    Parameters
    ----------
    key
        Its key in a dictionary; None where the observation is one array.
    numbers
        How many numbers it is, taken as they are; 0 where it is made of choices.
    choices
        Of each choice among 0, ..., n - 1, how many there are; it is laid out one-hot.
    """

    key: str | None
    numbers: int
    choices: tuple[int, ...] = ()

    @property
    def width(self) -> int:
        """How many numbers it is laid out as."""
        return self.numbers + sum(self.choices)

    def laid_out(self, values: Any, count: int) -> Numbers:  # noqa: ANN401 - numbers of any kind
        """Return this part of ``count`` observations, ``float32 [count, width]``.

        Raises
        ------
        MDPError
            If they are not of that shape, or a choice is none of those that there are.
        """
        given = np.asarray(values)
        each = len(self.choices) or self.numbers
        if given.size != count * each:
            message = f"{self._name} has shape {given.shape}; {each} numbers an observation are needed"
            raise MDPError(message)
        rows = given.reshape(count, each)
        if not self.choices:
            return rows.astype(np.float32)
        if ((rows < 0) | (rows >= self.choices)).any():
            message = f"{self._name} has a choice out of range; whole numbers below {self.choices} are needed"
            raise MDPError(message)
        parts = [np.eye(n, dtype=np.float32)[rows[:, k].astype(int)] for k, n in enumerate(self.choices)]
        return np.concatenate(parts, axis=1)

    @property
    def _name(self) -> str:
        return "the observation" if self.key is None else f"{self.key!r} of the observation"


@dataclass(frozen=True, slots=True, eq=False)
class Network:
    """L layers over the inputs.

    Parameters
    ----------
    inputs
        What an observation is made of, in order.
    weights, biases
        Of each layer: ``float32 [to, from]`` and ``float32 [to]``.
    activations
        What follows each layer: a name in `ACTIVATIONS`.

    Raises
    ------
    MDPError
        If they do not fit together, or a number is not finite.

    Examples
    --------
    >>> inputs = (Input("place", 1), Input("supervisor", 0, (2,)))
    >>> network = Network(inputs, ([[1, 0, 9], [0, 1, 1]],), ([0, 0.5],), ("relu",))
    >>> network.scores({"place": [[0.25], [0.75]], "supervisor": [0, 1]}, 2).tolist()
    [[0.25, 1.5], [9.75, 1.5]]
    """

    inputs: tuple[Input, ...]
    weights: tuple[Numbers, ...]
    biases: tuple[Numbers, ...]
    activations: tuple[str, ...]

    def __post_init__(self) -> None:
        for name, dimensions in (("weights", 2), ("biases", 1)):
            arrays = [np.asarray(array, np.float32) for array in getattr(self, name)]
            object.__setattr__(self, name, tuple(frozen(array, np.float32, dimensions) for array in arrays))
        width = sum(part.width for part in self.inputs)
        for k, (weight, bias, activation) in enumerate(
            zip(self.weights, self.biases, self.activations, strict=True)
        ):
            if weight.shape != (len(bias), width):
                message = f"layer {k} has shape {weight.shape}; {(len(bias), width)} is needed"
                raise MDPError(message)
            if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
                message = f"layer {k} has numbers that are not finite; the learner diverged"
                raise MDPError(message)
            if activation not in ACTIVATIONS:
                message = f"layer {k} is followed by {activation!r}; {suggest(activation, ACTIVATIONS)}"
                raise MDPError(message)
            width = len(bias)

    def scores(self, batch: Any, count: int) -> Numbers:  # noqa: ANN401 - a dictionary or an array
        """Return a score of each action in each of ``count`` observations, ``float32 [count, A]``.

        Parameters
        ----------
        batch
            An array, or a dictionary of arrays, the first axis of which is that of the observations.

        Raises
        ------
        MDPError
            If the observations are not of the shape that was learned on.
        """
        parts = [part.laid_out(_of(batch, part.key), count) for part in self.inputs]
        x: Numbers = np.concatenate(parts, axis=1)
        for weight, bias, activation in zip(self.weights, self.biases, self.activations, strict=True):
            x = ACTIVATIONS[activation](x @ weight.T + bias)
        return x


def _of(batch: Any, key: str | None) -> Any:  # noqa: ANN401 - a dictionary, if the user is right
    """Return one part of a batch."""
    if key is None:
        return batch
    if not isinstance(batch, Mapping) or key not in batch:
        message = f"the observation is {batch!r:.60}; a dictionary with {key!r} is needed"
        raise MDPError(message)
    return batch[key]

r"""A learned policy and its supervisor as one thing: `Bundle`.

A mask that is kept beside a policy can be forgotten.  In a bundle there is no way around it: the supervisor's
state is read off the observation, and only what its mask enables is ever chosen,

.. math:: \pi(x) \in \arg\max_{a \in E(x)} f(x)_a,

whatever the network f says and whatever has become of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import NONE, Bools, frozen
from supremal.deep.network import Network
from supremal.envs.layout import Layout
from supremal.errors import MDPError

Scores: TypeAlias = Literal["values", "logits"]
Masks: TypeAlias = NDArray[np.int8]

_LOWEST: Final = np.finfo(np.float32).min


@dataclass(frozen=True, slots=True, eq=False)
class Bundle:
    """A policy over A actions under a supervisor of S states.

    Parameters
    ----------
    events
        The event of each action.
    layout
        Where an observation holds the supervisor's state.
    masks
        ``int8 [S, A]``: which actions the supervisor enables.
    network
        What scores the actions.
    scores
        What it scores them by: their "values", or their "logits", the logarithms of probabilities.
    learner
        Who learned it.

    Raises
    ------
    MDPError
        If they do not fit together.

    Examples
    --------
    >>> from supremal.deep.network import Input
    >>> layout = Layout("dict", 2, 0, 0, (), np.empty((0, 0)))
    >>> best_is_2 = Network((Input("supervisor", 0, (3,)),), ([[0, 0, 0]] * 3,), ([0, 1, 2],), ("identity",))
    >>> bundle = Bundle(("a", "b", "c"), layout, [[1, 1, 1], [1, 1, 0]], best_is_2, "values")
    >>> bundle.predict({"supervisor": 0}), bundle.predict({"supervisor": 1})
    (2, 1)
    >>> bundle.predict({"supervisor": np.array([0, 1, 1])}, action_mask=[1, 0, 1]).tolist()
    [2, 0, 0]
    >>> bundle.predict({"supervisor": 2})
    Traceback (most recent call last):
    supremal.errors.MDPError: observation 0 is outside of the supervisor, where the mask cannot be read off
    it; give action_mask=info['action_mask']
    """

    events: tuple[str, ...]
    layout: Layout
    masks: Masks
    network: Network
    scores: Scores
    learner: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "events", tuple(self.events))
        try:
            object.__setattr__(self, "masks", frozen(self.masks, np.int8, 2))
        except ValueError as error:
            message = f"masks: {error}"
            raise MDPError(message) from None
        shape = (self.layout.states, len(self.events))
        if self.masks.shape != shape or ((self.masks != 0) & (self.masks != 1)).any():
            message = f"masks have shape {self.masks.shape}; 0s and 1s of shape {shape} are needed"
            raise MDPError(message)
        scored = len(self.network.biases[-1])
        if scored != len(self.events):
            message = f"the network scores {scored} actions; there are {len(self.events)}"
            raise MDPError(message)
        if self.scores not in get_args(Scores):
            message = f"scores is {self.scores!r}; 'values' or 'logits' is needed"
            raise MDPError(message)

    def predict(
        self,
        observation: Any,  # noqa: ANN401 - a dictionary or an array
        action_mask: Any = None,  # noqa: ANN401 - 0s and 1s of any kind
        *,
        random: np.random.Generator | None = None,
    ) -> Any:  # noqa: ANN401 - an int, or an array of some
        """Return an enabled action for an observation, or ``int64 [N]`` for a batch of N.

        Parameters
        ----------
        observation
            As the supervised environment tells it, or N of them stacked.
        action_mask
            ``[A]`` or ``[N, A]``: restricts the choice further, like ``info["action_mask"]`` of an
            environment with a mask of its own.  It is needed where the run is outside of the supervisor.
        random
            Where given, the action is drawn from it by its probability; left out: the one of the highest
            score, the first of several.

        Raises
        ------
        MDPError
            If the observation is not of the shape that was learned on; if it is outside of the supervisor and
            there is no mask; if no action is enabled; or if one is to be drawn by values.
        """
        alone = self._is_one(observation)
        batch = _as_batch(observation) if alone else observation
        states = self.layout.states_of(batch)
        enabled = self._enabled(states, action_mask)
        scores = self.network.scores(batch, len(states))
        if random is not None:
            if self.scores == "values":
                message = "random is given, but this policy has values and no probabilities; leave it out"
                raise MDPError(message)
            # The largest is then a draw by probability.
            scores = scores + random.gumbel(size=scores.shape).astype(np.float32)
        # What is enabled is above all that is not, even where a network overflows.
        actions = np.where(enabled, np.maximum(scores, _LOWEST), -np.inf).argmax(axis=1)
        return int(actions[0]) if alone else actions

    def _is_one(self, observation: Any) -> bool:  # noqa: ANN401 - as above
        """Return whether this is one observation, and not a batch."""
        if self.layout.kind == "flat":
            return np.ndim(observation) == 1
        return isinstance(observation, Mapping) and np.ndim(observation.get("supervisor", 0)) == 0

    def _enabled(self, states: NDArray[np.int32], action_mask: Any) -> Bools:  # noqa: ANN401 - as above
        """Return what is enabled in these states of the supervisor, ``bool [N, A]``."""
        outside = states == NONE
        if action_mask is None and outside.any():
            message = (
                f"observation {outside.argmax()} is outside of the supervisor, where the mask cannot be read "
                "off it; give action_mask=info['action_mask']"
            )
            raise MDPError(message)
        enabled: Bools = self.masks[states] > 0
        enabled[outside] = True
        if action_mask is not None:
            more = np.asarray(action_mask, np.bool_)
            if more.shape not in (enabled.shape, enabled.shape[1:]):
                message = (
                    f"action_mask has shape {more.shape}; {enabled.shape[1:]} or {enabled.shape} is needed"
                )
                raise MDPError(message)
            enabled &= more
        empty = ~enabled.any(axis=1)
        if empty.any():
            message = f"no action is enabled in observation {empty.argmax()}; the mask given leaves none"
            raise MDPError(message)
        return enabled


def _as_batch(observation: Any) -> Any:  # noqa: ANN401 - a dictionary or an array
    """Return one observation as a batch of one."""
    if isinstance(observation, Mapping):
        return {key: np.asarray(value)[None] for key, value in observation.items()}
    return np.asarray(observation)[None]

"""Masks in the places where libraries look for them: `with_mask`.

Every library that restricts what may be chosen asks for the same A numbers in another place.  Two of the
places need no wrapper, for a `SupervisedEnv` has both:

==================================  =====================================================================
``info["action_mask"]``, ``int8``   Gymnasium's ``action_space.sample(mask)``; Tianshou, CleanRL and others
``action_masks()``, ``bool``        sb3-contrib's MaskablePPO, also through Monitor and DummyVecEnv
==================================  =====================================================================

The others put the mask into the observation, which so becomes a dictionary:

============  ==============================================================  ====================
dialect       observation                                                     the mask is of type
============  ==============================================================  ====================
"rllib"       ``{"action_mask": mask, "observations": the environment's}``    ``float32``
"pettingzoo"  ``{"observation": the environment's, "action_mask": mask}``     ``int8``
"torchrl"     the environment's keys, else "observation", and "action_mask"   ``bool``
============  ==============================================================  ====================

RLlib takes the logarithm of its mask; TorchRL's ActionMask negates it bit by bit.  Both would take a mask
without a one for a mask of ones, and so let all pass; that such a mask never gets there is the work of
`SupervisedEnv`, and of a check here.

Source: the libraries' documentation: RLlib, *Action masking* (``ActionMaskingTorchRLModule``); PettingZoo,
*AEC API: action masking*; TorchRL, ``torchrl.envs.transforms.ActionMask``.
"""

from __future__ import annotations

from typing import Any, Final, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import DTypeLike

from supremal.envs._gymnasium import Box, Dict, Discrete, Env, RecordConstructorArgs, Wrapper
from supremal.errors import MDPError, suggest

Dialect: TypeAlias = Literal["rllib", "pettingzoo", "torchrl"]


class _Form(NamedTuple):
    """How a dialect wants it: the key of the observation, the type of the mask, whether keys are merged."""

    key: str
    dtype: DTypeLike
    merged: bool


_FORMS: Final = {
    "rllib": _Form("observations", np.float32, merged=False),
    "pettingzoo": _Form("observation", np.int8, merged=False),
    "torchrl": _Form("observation", np.bool_, merged=True),
}


def with_mask(env: Env[Any, Any], dialect: Dialect) -> MaskedObservation:
    r"""Return ``env`` with its mask in the observation, where a library looks for it.

    Parameters
    ----------
    env
        A `SupervisedEnv`, with wrappers around it or not; or any other environment with discrete actions that
        gives an ``info["action_mask"]`` after each reset and step.
    dialect
        "rllib", "pettingzoo" or "torchrl".

    Raises
    ------
    MDPError
        If there is no such dialect, or the environment is none of these.

    Notes
    -----
    An observation grows by A numbers, and a step takes a microsecond longer.

    Examples
    --------
    >>> import gymnasium
    >>> from supremal import from_text
    >>> from supremal.envs.supervised import SupervisedEnv
    >>> rule = from_text("0 -up-> 1 \n 0 -right, down, left-> 0 \n 1 -right, down, left-> 0")
    >>> env = SupervisedEnv(
    ...     gymnasium.make("CliffWalking-v1"), rules=[rule], events=["up", "right", "down", "left"]
    ... )
    >>> env = with_mask(env, "rllib")
    >>> observation, info = env.reset()
    >>> env.step(0)[0]["action_mask"].tolist()
    [0.0, 1.0, 1.0, 1.0]
    """
    return MaskedObservation(env, dialect)


class MaskedObservation(Wrapper[dict[str, Any], Any, Any, Any], RecordConstructorArgs):
    """What `with_mask` returns."""

    def __init__(self, env: Env[Any, Any], dialect: Dialect) -> None:
        RecordConstructorArgs.__init__(self, dialect=dialect)
        if dialect not in _FORMS:
            message = f"dialect is {dialect!r}; {suggest(str(dialect), _FORMS)}"
            raise MDPError(message)
        if not isinstance(env, Env) or not isinstance(env.action_space, Discrete):
            message = f"the environment is {env!r:.60}; one of Gymnasium's with Discrete actions is needed"
            raise MDPError(message)
        super().__init__(env)
        self._key, self._dtype, merged = _FORMS[dialect]
        own = env.observation_space
        self._merged = merged and isinstance(own, Dict)
        spaces = dict(own.spaces) if self._merged and isinstance(own, Dict) else {self._key: own}
        if "action_mask" in spaces:
            message = "the environment's observation has a key 'action_mask' already; rename it there"
            raise MDPError(message)
        self._actions = int(env.action_space.n)
        spaces["action_mask"] = Box(0, 1, (self._actions,), self._dtype)  # type: ignore[arg-type] # bool is fine
        self.observation_space = Dict(spaces)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start a new episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        return self._beside(observation, info), info

    def step(self, action: Any) -> tuple[dict[str, Any], Any, bool, bool, dict[str, Any]]:  # noqa: ANN401 - as the environment's
        """Let one epoch pass.

        Raises
        ------
        MDPError
            If the environment gives no mask, or one that lets nothing pass.
        """
        observation, reward, terminated, truncated, info = self.env.step(action)
        return self._beside(observation, info), reward, terminated, truncated, info

    def _beside(self, observation: Any, info: dict[str, Any]) -> dict[str, Any]:  # noqa: ANN401 - the environment's
        """Return the observation with the mask in it."""
        mask = np.asarray(info.get("action_mask"))
        if mask.shape != (self._actions,) or not mask.any():
            got = (
                f"it is {mask.tolist()}"
                if "action_mask" in info
                else "there is none: wrap it in a SupervisedEnv"
            )
            message = f"info['action_mask'] has to have {self._actions} entries, not all 0; {got}"
            raise MDPError(message)
        told = {**observation} if self._merged else {self._key: observation}
        told["action_mask"] = mask.astype(self._dtype)
        return told

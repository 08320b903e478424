"""The only module that names Gymnasium: what environments are made of, and how one is registered and made.

Gymnasium before 1.0 called the functions of the entry point group ``gymnasium.envs`` by itself.  Since then
it learns of an environment when somebody imports the module that registers it, which an id may ask for:
``module:id``.
"""

from __future__ import annotations

from collections.abc import Mapping
from inspect import Parameter, signature
from typing import TYPE_CHECKING, Any, Final

import gymnasium
from gymnasium import Env, Wrapper
from gymnasium.envs.registration import load_env_creator
from gymnasium.envs.toy_text import CliffWalkingEnv, FrozenLakeEnv, TaxiEnv
from gymnasium.error import UnregisteredEnv
from gymnasium.spaces import Box, Dict, Discrete, MultiDiscrete, Space, Tuple, flatten, flatten_space
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space, iterate
from gymnasium.wrappers import RecordVideo

from supremal.errors import MDPError, suggest

__all__ = [
    "GRID_ID",
    "AnyVectorWrapper",
    "AutoresetMode",
    "Box",
    "CliffWalkingEnv",
    "Dict",
    "Discrete",
    "Env",
    "FrozenLakeEnv",
    "MultiDiscrete",
    "RecordConstructorArgs",
    "RecordVideo",
    "Space",
    "TaxiEnv",
    "Tuple",
    "VectorEnv",
    "Wrapper",
    "batch_space",
    "flatten",
    "flatten_space",
    "iterate",
    "made",
    "register",
]

if TYPE_CHECKING:
    AnyVectorWrapper = VectorWrapper[Any, Any, Any, Any, Any]
else:  # which takes no parameters before Gymnasium 1.3
    AnyVectorWrapper = VectorWrapper

GRID_ID: Final = "supremal/PickupDelivery-v0"
_MAX_STEPS: Final = 60  # the paper's


def register() -> None:
    """Register supremal's environments with Gymnasium; doing so again changes nothing."""
    if GRID_ID not in gymnasium.registry:
        gymnasium.register(
            GRID_ID,
            entry_point="supremal.envs.grid_env:PickupDeliveryEnv",
            max_episode_steps=_MAX_STEPS,
        )


def made(env_id: str, options: Mapping[str, Any]) -> Env[Any, Any]:
    """Return the environment that Gymnasium makes of an id and options.

    Raises
    ------
    MDPError
        If the id or an option is unknown, or the environment refuses to be made.
    """
    try:
        return gymnasium.make(env_id, **options)
    except UnregisteredEnv:
        message = f"unknown environment {env_id!r}; {suggest(env_id, _with_tables())}"
    except Exception as error:  # noqa: BLE001 - a constructor may raise anything
        strange = _strange_option(env_id, options) if isinstance(error, TypeError) else ""
        message = f"environment {env_id!r} cannot be made: {strange or f'{type(error).__name__}: {error}'}"
    raise MDPError(message)


def _with_tables() -> list[str]:
    """Return the ids of Gymnasium's and supremal's environments that are known to be finite models."""
    known = {f"{kind.__module__}:{kind.__name__}" for kind in (CliffWalkingEnv, FrozenLakeEnv, TaxiEnv)}
    return [GRID_ID, *(name for name, spec in gymnasium.registry.items() if spec.entry_point in known)]


def _strange_option(env_id: str, options: Mapping[str, Any]) -> str:
    """Name the first option that the environment does not take; nothing if it takes all."""
    spec = gymnasium.registry.get(env_id.rpartition(":")[2])
    if spec is None or spec.entry_point is None:
        return ""
    creator = spec.entry_point
    takes = signature(load_env_creator(creator) if isinstance(creator, str) else creator).parameters
    if any(one.kind is Parameter.VAR_KEYWORD for one in takes.values()):
        return ""
    strange = [name for name in options if name not in takes]
    return f"unknown option {strange[0]!r}; {suggest(strange[0], takes)}" if strange else ""

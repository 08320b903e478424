"""The only module that names Gymnasium: what environments are made of, and their registration.

Gymnasium before 1.0 called the functions of the entry point group ``gymnasium.envs`` by itself.  Since then
it learns of an environment when somebody imports the module that registers it, which an id may ask for:
``module:id``.
"""

from __future__ import annotations

from typing import Final

import gymnasium
from gymnasium import Env
from gymnasium.spaces import Discrete, MultiDiscrete

__all__ = ["GRID_ID", "Discrete", "Env", "MultiDiscrete", "register"]

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

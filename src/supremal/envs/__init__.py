"""Where agents act: environments with Gymnasium's interface, each with a tabular model of the same core.

Importing this room registers its environments with Gymnasium, so that both of these work::

    import gymnasium, supremal.envs
    env = gymnasium.make("supremal/PickupDelivery-v0")

    import gymnasium
    env = gymnasium.make("supremal.envs:supremal/PickupDelivery-v0")
"""

from supremal.envs._draw import draw
from supremal.envs._gymnasium import register
from supremal.envs._pixels import pixels
from supremal.envs.dialects import with_mask
from supremal.envs.grid_env import PickupDeliveryEnv
from supremal.envs.layout import Layout, layout_from
from supremal.envs.pickup_delivery import (
    Answer,
    GridState,
    PickupDelivery,
    data_file,
    decode,
    describe,
    encode,
    state_numbers,
)
from supremal.envs.recording import record_episode
from supremal.envs.supervised import SupervisedEnv
from supremal.envs.supervised_vector import SupervisedVectorEnv
from supremal.envs.tabular import environment_model

__all__ = [
    "Answer",
    "GridState",
    "Layout",
    "PickupDelivery",
    "PickupDeliveryEnv",
    "SupervisedEnv",
    "SupervisedVectorEnv",
    "data_file",
    "decode",
    "describe",
    "draw",
    "encode",
    "environment_model",
    "layout_from",
    "pixels",
    "record_episode",
    "register",
    "state_numbers",
    "with_mask",
]

register()

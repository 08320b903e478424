"""The one module that imports torch, Stable-Baselines3 and its contributions."""

from __future__ import annotations

from supremal.errors import MissingDependencyError

try:
    import torch
    from sb3_contrib.common.maskable.policies import (
        MaskableActorCriticPolicy,
        MaskableMultiInputActorCriticPolicy,
    )
    from sb3_contrib.common.maskable.utils import get_action_masks, is_masking_supported
    from stable_baselines3 import DQN
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.buffers import DictReplayBuffer, ReplayBuffer
    from stable_baselines3.common.policies import ActorCriticPolicy, MultiInputActorCriticPolicy
    from stable_baselines3.common.torch_layers import CombinedExtractor, FlattenExtractor
    from stable_baselines3.dqn.policies import DQNPolicy
    from stable_baselines3.dqn.policies import MultiInputPolicy as DQNMultiInputPolicy
    from torch import nn
    from torch.nn import functional
except ImportError:
    package = "torch, stable-baselines3 and sb3-contrib"
    raise MissingDependencyError(package, extra="deep", purpose="deep learning") from None

__all__ = [
    "DQN",
    "ActorCriticPolicy",
    "BaseAlgorithm",
    "CombinedExtractor",
    "DQNMultiInputPolicy",
    "DQNPolicy",
    "DictReplayBuffer",
    "FlattenExtractor",
    "MaskableActorCriticPolicy",
    "MaskableMultiInputActorCriticPolicy",
    "MultiInputActorCriticPolicy",
    "ReplayBuffer",
    "functional",
    "get_action_masks",
    "is_masking_supported",
    "nn",
    "torch",
]

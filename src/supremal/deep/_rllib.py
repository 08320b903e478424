"""The one module that imports Ray RLlib: what masked PPO is made of.

That an action is masked is RLlib's own action-masking module, which comes with it among its examples: it
takes the mask off the observation, and puts the logits of masked actions as low as numbers go.
"""

from __future__ import annotations

from supremal.errors import MissingDependencyError

try:
    from ray.rllib.algorithms.ppo import PPOConfig
    from ray.rllib.core.rl_module.rl_module import RLModuleSpec
    from ray.rllib.examples.rl_modules.classes.action_masking_rlm import ActionMaskingTorchRLModule
    from ray.tune.registry import register_env
except ImportError:
    package = "ray[rllib] and torch"
    raise MissingDependencyError(package, extra="rllib", purpose="learning with RLlib") from None

__all__ = ["ActionMaskingTorchRLModule", "PPOConfig", "RLModuleSpec", "register_env"]

"""From a model of Stable-Baselines3 to the network in it; what that cannot be said of is refused."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from supremal.deep._stable import (
    ActorCriticPolicy,
    BaseAlgorithm,
    CombinedExtractor,
    DQNMultiInputPolicy,
    DQNPolicy,
    FlattenExtractor,
    MaskableActorCriticPolicy,
    MaskableMultiInputActorCriticPolicy,
    MultiInputActorCriticPolicy,
    nn,
)
from supremal.deep.network import Input, Network
from supremal.envs._gymnasium import Box, Dict, Discrete, MultiDiscrete, Space
from supremal.errors import MDPError

_OF_VALUES: Final = (DQNPolicy, DQNMultiInputPolicy)
_OF_LOGITS: Final = (
    ActorCriticPolicy,
    MultiInputActorCriticPolicy,
    MaskableActorCriticPolicy,
    MaskableMultiInputActorCriticPolicy,
)
_FUNCTIONS: Final = {nn.Identity: "identity", nn.ReLU: "relu", nn.Tanh: "tanh", nn.Sigmoid: "sigmoid"}


def network_of(model: BaseAlgorithm) -> tuple[str, Network]:
    """Return what the network of ``model`` scores actions by, "values" or "logits", and the network.

    Raises
    ------
    MDPError
        If it is no chain of fully connected layers over the plain observation.
    """
    policy: Any = getattr(model, "policy", None)
    if type(policy) in _OF_VALUES:
        kind, extractor, modules = "values", policy.q_net.features_extractor, list(policy.q_net.q_net)
    elif type(policy) in _OF_LOGITS:
        kind, extractor = "logits", policy.pi_features_extractor
        modules = [*policy.mlp_extractor.policy_net, policy.action_net]
    else:
        message = (
            f"a policy of type {type(policy).__name__} cannot be saved; an MlpPolicy or a MultiInputPolicy "
            "of MaskablePPO, MaskedDQN, PPO, A2C or DQN is needed"
        )
        raise MDPError(message)
    if model.get_vec_normalize_env() is not None:
        message = (
            "the observations are normalised by VecNormalize, whose statistics a bundle does not hold; "
            "normalise them in the environment, beneath SupervisedEnv"
        )
        raise MDPError(message)
    return kind, Network(_inputs(model.observation_space, extractor), *_layers(modules))


def _inputs(space: Space[Any], extractor: nn.Module) -> tuple[Input, ...]:
    """Return what an observation is made of, in the order of ``extractor``."""
    plain = type(extractor) is FlattenExtractor
    if type(extractor) is CombinedExtractor:
        plain = all(type(part) is nn.Flatten for part in extractor.extractors.values())
    if not plain:
        message = (
            f"the features are drawn by a {type(extractor).__name__} with layers of its own, of which a "
            "bundle holds none; observe images as plain numbers, by observe='flat'"
        )
        raise MDPError(message)
    parts = space.spaces.items() if isinstance(space, Dict) else [(None, space)]
    return tuple(_input(key, part) for key, part in parts)


def _input(key: str | None, space: Space[Any]) -> Input:
    """Return one part of an observation."""
    if isinstance(space, Discrete):
        return Input(key, 0, (int(space.n),))
    if isinstance(space, MultiDiscrete):
        return Input(key, 0, tuple(int(n) for n in space.nvec))
    if isinstance(space, Box):
        return Input(key, int(np.prod(space.shape)))
    message = f"an observation of {space} cannot be saved; use observe='flat'"
    raise MDPError(message)


def _layers(modules: list[nn.Module]) -> tuple[tuple[Any, ...], tuple[Any, ...], tuple[str, ...]]:
    """Return the weights and biases of the layers, and what follows each."""
    layers: list[tuple[Any, Any]] = []
    follows: list[str] = []
    for module in modules:
        name = "elu" if type(module) is nn.ELU and module.alpha == 1 else _FUNCTIONS.get(type(module))
        if type(module) is nn.Linear:
            arrays = (module.weight, module.bias)
            layers.append(tuple(array.detach().cpu().numpy() for array in arrays))
            follows.append("identity")
        elif name is not None and layers and follows[-1] == "identity":
            follows[-1] = name
        else:
            message = (
                f"a layer of type {type(module).__name__} cannot be saved; Linear is needed, with ReLU, "
                "Tanh, ELU, Sigmoid or nothing after it"
            )
            raise MDPError(message)
    weights, biases = zip(*layers, strict=True)
    return weights, biases, tuple(follows)

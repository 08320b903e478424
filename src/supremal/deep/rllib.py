"""Deep learning under a supervisor by RLlib: PPO over the enabled actions, with several workers.

In RLlib's dialect the mask is part of the observation, ``{"action_mask": ..., "observations": ...}``, and
its action-masking module gives masked actions the probability 0.  Each worker steps an environment of its
own; the supervisor is in the environment, so it holds on whichever machine that is, and where one is lost,
RLlib starts its workers again elsewhere.

Source: Schulman et al., "Proximal policy optimization algorithms", 2017; Huang, Ontañón, "A closer look at
invalid action masking in policy gradient algorithms", FLAIRS 2022; Liang et al., "RLlib: abstractions for
distributed reinforcement learning", ICML 2018.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from supremal.deep._rllib import ActionMaskingTorchRLModule, PPOConfig, RLModuleSpec, register_env
from supremal.envs._gymnasium import Box, Dict, Discrete, Env, Wrapper, flatten, flatten_space
from supremal.errors import MDPError

COUNTS: Final = ("violations", "disabled")
"""What the workers count; RLlib's results have the sums of an iteration under ``env_runners``."""

_THREADS: Final = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_NAME: Final = "supremal/masked"


class RLlibEnv(Wrapper[dict[str, Any], Any, Any, Any]):
    """A `SupervisedEnv` in RLlib's dialect.

    Parameters
    ----------
    env
        It, or any environment with discrete actions from 0 that reports its mask as ``info["action_mask"]``.

    Raises
    ------
    MDPError
        If its actions are others, or its observations cannot be made one array.

    Notes
    -----
    An observation is ``{"action_mask": float32 [A], "observations": float32 [D]}``, the second being the
    environment's own flattened: a number of states becomes as many places, one of them 1.
    """

    def __init__(self, env: Env[Any, Any]) -> None:
        super().__init__(env)
        if not isinstance(env.action_space, Discrete) or env.action_space.start != 0:
            message = f"the environment's actions are {env.action_space}; Discrete actions from 0 are needed"
            raise MDPError(message)
        try:
            flat = flatten_space(env.observation_space)
        except NotImplementedError:
            flat = None
        if not isinstance(flat, Box):
            message = f"observations of {env.observation_space} cannot be made one array, which RLlib needs"
            raise MDPError(message)
        low, high = (end.astype(np.float32) for end in (flat.low, flat.high))
        self.observation_space = Dict(
            {
                "action_mask": Box(0, 1, (int(env.action_space.n),), np.float32),
                "observations": Box(low, high, dtype=np.float32),
            }
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start a new episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        return self._told(observation, info), info

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:  # noqa: ANN401 - an integer of any kind
        """Let one epoch pass."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return self._told(observation, info), float(reward), terminated, truncated, info

    def _told(self, observation: Any, info: Mapping[str, Any]) -> dict[str, Any]:  # noqa: ANN401 - the environment's
        flat = flatten(self.env.observation_space, observation)
        return {
            "action_mask": np.asarray(info["action_mask"], np.float32),
            "observations": np.asarray(flat, np.float32),
        }


def masked_ppo(
    make_env: Callable[[], Env[Any, Any]],
    *,
    workers: int = 2,
    hidden: Sequence[int] = (64, 64),
    gamma: float = 0.99,
    seed: int = 0,
) -> PPOConfig:
    """Return RLlib's configuration of PPO under a supervisor; what it does not say here can be set on it.

    Parameters
    ----------
    make_env
        Makes a `SupervisedEnv`; called once by each worker, so it takes nothing from outside that cannot
        travel to another machine.
    workers
        How many step environments, each with one thread; 0: the learner itself does.
    hidden
        The sizes of the network's layers.
    gamma
        The discount factor.
    seed
        Of environments and networks.

    Notes
    -----
    Every `train` reports under ``["env_runners"]`` the sums ``violations`` and ``disabled`` of what the
    environments counted in it.  A worker that is lost is started again.

    Examples
    --------
    >>> config = masked_ppo(make_env).training(lr=3e-4, train_batch_size=2000)  # doctest: +SKIP
    >>> algorithm = config.build_algo()  # doctest: +SKIP
    >>> algorithm.train()["env_runners"]["violations"]  # doctest: +SKIP
    0
    """
    register_env(_NAME, lambda _: RLlibEnv(make_env()))
    return (
        PPOConfig()
        .environment(_NAME)
        .env_runners(num_env_runners=workers, num_cpus_per_env_runner=1)
        .learners(num_learners=0, num_gpus_per_learner=0)
        .rl_module(
            rl_module_spec=RLModuleSpec(
                module_class=ActionMaskingTorchRLModule,
                model_config={"head_fcnet_hiddens": list(hidden), "head_fcnet_activation": "relu"},
            )
        )
        .training(gamma=gamma)
        .fault_tolerance(restart_failed_env_runners=True)
        .python_environment(extra_python_environs_for_worker=_THREADS)
        .callbacks(on_episode_step=_count)
        .debugging(seed=seed, log_level="ERROR")
    )


def _count(*, episode: Any, metrics_logger: Any, **_: object) -> None:  # noqa: ANN401 - RLlib's
    """Add up what the environment has counted in a step."""
    info = episode.get_infos(-1)
    for name in COUNTS:
        metrics_logger.log_value(name, int(info.get(name, 0)), reduce="sum")

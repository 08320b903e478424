r"""Deep Q-learning under a supervisor: `MaskedDQN`, Algorithm 1 of the paper with a network for its table.

The mask stands in all three places where Q-learning has an action to pick,

.. math:: y = r + \gamma \max_{a \in E(s')} Q^-(s', a),

namely in this maximum over the actions E(s') that are *enabled* in the next state, in the greedy choice, and
in the ε-random one.  Left out of the maximum, the values of actions that never happen, and are never
corrected, leak into those of the actions that do.

Where does E(s') come from?  The supervisor's state could be read off the next observation.  But that is not
all of the mask: in safe mode the state is outside of the supervisor, and with ``own_mask`` the environment
has a say.  So it is what the environment itself reported after the step, ``info["action_mask"]``, kept beside
the transition at one byte an action.  At a truncated step that is the mask of the observation that the
episode was cut at, as the bootstrap needs; the mask of the next episode's first observation, which a
vectorised environment is at by then, never enters.  At a terminated step there is no bootstrap.

Sources: the paper's Algorithm 1; Mnih et al., "Human-level control through deep reinforcement learning",
Nature 518 (2015); van Hasselt, Guez and Silver, "Deep reinforcement learning with double Q-learning", AAAI
2016; on invalid actions in general Huang and Ontañón, "A closer look at invalid action masking in policy
gradient algorithms", FLAIRS 2022.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from supremal._arrays import Bools, Longs
from supremal.deep._stable import (
    DQN,
    DictReplayBuffer,
    ReplayBuffer,
    functional,
    get_action_masks,
    is_masking_supported,
    torch,
)
from supremal.envs._gymnasium import Dict, MultiDiscrete
from supremal.errors import MDPError

_FIXED: Final = {"n_steps": 1, "replay_buffer_class": None, "optimize_memory_usage": False}
"""Settings of `DQN` that would lose the mask of the next state."""


class MaskedDQN(DQN):
    """`stable_baselines3.DQN` over the enabled actions only.

    Parameters
    ----------
    policy, env, settings
        As for `stable_baselines3.DQN`; ``n_steps``, ``replay_buffer_class`` and ``optimize_memory_usage``
        stay as they are.  The environment is a `SupervisedEnv`, wrapped or vectorised as you like, or any
        other that has ``action_masks()`` and ``info["action_mask"]``.
    double
        Whether the target is that of double Q-learning: the next action is chosen by the network that
        learns, and valued by the other.

    Raises
    ------
    MDPError
        If the environment has no masks, or a setting is one of those that stay.

    Notes
    -----
    Its replay buffer is that of Stable-Baselines3; the row that it keeps for an action holds the mask after
    it as well, 1 + A numbers.

    Examples
    --------
    >>> import gymnasium
    >>> from supremal import Alphabet, SupervisedEnv, rule_from_regex
    >>> moves = ["up", "right", "down", "left"]
    >>> rule = rule_from_regex("~(.* up up .*)", Alphabet(moves))
    >>> env = SupervisedEnv(gymnasium.make("CliffWalking-v1"), rules=[rule], events=moves)
    >>> model = MaskedDQN("MultiInputPolicy", env, learning_starts=20, seed=0).learn(40)
    >>> env.counts
    Counts(violations=0, disabled=0, model_broken=0)
    """

    replay_buffer: Any

    def __init__(self, policy: Any, env: Any, *, double: bool = False, **settings: Any) -> None:  # noqa: ANN401 - as DQN's
        for name, usual in _FIXED.items():
            if settings.get(name, usual) != usual:
                message = f"{name} is {settings[name]!r}; MaskedDQN needs {usual!r}, to keep the next mask"
                raise MDPError(message)
        self.double = double
        super().__init__(policy, env, **settings)

    def _setup_model(self) -> None:
        """Make the replay buffer, in which an action is a row: itself, and the mask after it."""
        if self.env is not None and not is_masking_supported(self.env):
            message = "the environment has no action_masks(); wrap it in a SupervisedEnv"
            raise MDPError(message)
        actions = self._actions
        if self.replay_buffer is None:
            kind = DictReplayBuffer if isinstance(self.observation_space, Dict) else ReplayBuffer
            rows = MultiDiscrete([actions] + [2] * actions, dtype=np.int8 if actions <= 127 else np.int32)
            self.replay_buffer = kind(
                self.buffer_size,
                self.observation_space,
                rows,
                device=self.device,
                n_envs=self.n_envs,
                **self.replay_buffer_kwargs,
            )
        super()._setup_model()
        self._random = np.random.default_rng(self.seed)

    @property
    def _actions(self) -> int:
        """A, how many actions there are."""
        return int(self.action_space.n)

    # --- acting -------------------------------------------------------------------------------------------

    def predict(
        self,
        observation: Any,  # noqa: ANN401 - the environment's
        state: Any = None,  # noqa: ANN401 - as in the base class
        episode_start: Any = None,  # noqa: ANN401, ARG002 - as in the base class
        deterministic: bool = False,  # noqa: FBT001, FBT002 - as in the base class
        action_masks: Any = None,  # noqa: ANN401 - 0s and 1s of any kind
    ) -> tuple[Any, Any]:
        """Return the action for an observation, or those for a batch; and ``state``.

        Parameters
        ----------
        observation
            One, or as many as the environment is vectorised.
        state, episode_start
            Not used: there is no memory.
        deterministic
            Whether the best enabled action is chosen; otherwise, with probability ε, any enabled one.
        action_masks
            ``[A]``, or ``[N, A]`` for a batch: what is enabled.

        Raises
        ------
        MDPError
            If there are no masks: this learner never acts without.
        """
        if action_masks is None:
            message = (
                "predict needs action_masks, like info['action_mask']; where there are none, save a bundle: "
                "it reads the supervisor's off the observation"
            )
            raise MDPError(message)
        _, batched = self.policy.obs_to_tensor(observation)
        masks = np.asarray(action_masks, np.bool_).reshape(-1, self._actions)
        actions = self._choose(observation, masks, 0.0 if deterministic else self.exploration_rate)
        return (actions if batched else actions[0]), state

    def _choose(self, observation: Any, masks: Bools, epsilon: float) -> Longs:  # noqa: ANN401 - the environment's
        """Return an enabled action for each of N observations: with probability ``epsilon`` any."""
        self.policy.set_training_mode(mode=False)
        with torch.no_grad():
            values = self.q_net(self.policy.obs_to_tensor(observation)[0])
        best = _only(values, torch.as_tensor(masks, device=values.device)).argmax(dim=1).cpu().numpy()
        any_enabled = np.where(masks, self._random.random(masks.shape), -1.0).argmax(axis=1)
        explores = self._random.random(len(masks)) < epsilon
        actions: Longs = np.where(explores, any_enabled, best)
        return actions

    def _sample_action(
        self,
        learning_starts: int,
        action_noise: Any = None,  # noqa: ANN401, ARG002 - as in the base class
        n_envs: int = 1,  # noqa: ARG002 - as in the base class
    ) -> tuple[Any, Any]:
        """Return an action for each environment, and the same for the replay buffer."""
        epsilon = 1.0 if self.num_timesteps < learning_starts else self.exploration_rate
        masks = np.asarray(get_action_masks(self.env), np.bool_)
        actions = self._choose(self._last_obs, masks, epsilon)
        return actions, actions

    # --- learning -----------------------------------------------------------------------------------------

    def _store_transition(
        self,
        replay_buffer: Any,  # noqa: ANN401 - as in the base class
        buffer_action: Any,  # noqa: ANN401
        new_obs: Any,  # noqa: ANN401
        reward: Any,  # noqa: ANN401
        dones: Any,  # noqa: ANN401
        infos: list[dict[str, Any]],
    ) -> None:
        """Keep the transitions, each with the mask that its own ``info`` tells."""
        if any("action_mask" not in info for info in infos):
            message = "the environment puts no 'action_mask' into info; wrap it in a SupervisedEnv"
            raise MDPError(message)
        masks = np.array([info["action_mask"] for info in infos], np.bool_)
        rows = np.column_stack((buffer_action, masks))
        super()._store_transition(replay_buffer, rows, new_obs, reward, dones, infos)

    def train(self, gradient_steps: int, batch_size: int = 100) -> None:
        """Take ``gradient_steps`` steps down the Huber loss of minibatches, as in `DQN`."""
        self.policy.set_training_mode(mode=True)
        self._update_learning_rate(self.policy.optimizer)
        losses = []
        for _ in range(gradient_steps):
            batch = self.replay_buffer.sample(batch_size, env=self._vec_normalize_env)
            taken, masks = batch.actions[:, :1].long(), batch.actions[:, 1:].bool()
            with torch.no_grad():
                follows = self._bootstrap(batch.next_observations, masks)
                target = batch.rewards + (1 - batch.dones) * self.gamma * follows
            values = self.q_net(batch.observations).gather(1, taken)
            loss = functional.smooth_l1_loss(values, target)
            losses.append(loss.item())
            self.policy.optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
            self.policy.optimizer.step()
        self._n_updates += gradient_steps
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        self.logger.record("train/loss", np.mean(losses))

    def _bootstrap(self, observations: Any, masks: torch.Tensor) -> torch.Tensor:  # noqa: ANN401 - as in the buffer
        """Return what the next observations are worth over the enabled actions, ``[N, 1]``."""
        values = self.q_net_target(observations)
        chooser = self.q_net(observations) if self.double else values
        return values.gather(1, _only(chooser, masks).argmax(dim=1, keepdim=True))


def _only(values: torch.Tensor, masks: torch.Tensor) -> torch.Tensor:
    """Return ``values`` with -inf where ``masks`` has nothing enabled; even -inf is above that elsewhere."""
    return values.clamp(min=torch.finfo(values.dtype).min).masked_fill(~masks, -torch.inf)

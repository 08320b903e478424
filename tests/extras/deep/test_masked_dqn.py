"""Deep Q-learning under a supervisor: the mask where it acts, where it explores, and where it looks ahead."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from press import Press, press
from sb3_contrib.common.maskable.evaluation import evaluate_policy
from stable_baselines3.common.buffers import DictReplayBuffer
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv

from supremal import MDPError, MissingDependencyError
from supremal.deep import MaskedDQN

SMALL = {"buffer_size": 2_000, "policy_kwargs": {"net_arch": [8]}, "seed": 0, "device": "cpu"}
POLICY = {"dict": "MultiInputPolicy", "flat": "MlpPolicy"}
GAMMA = 0.9


def vector(**options: Any) -> DummyVecEnv:
    return DummyVecEnv([lambda: Monitor(press(**options))] * 2)


def violations(env: DummyVecEnv) -> list[int]:
    return [counts.violations + counts.disabled + counts.model_broken for counts in env.get_attr("counts")]


def explorer(observe: str = "flat", **settings: Any) -> MaskedDQN:
    """Return a learner with a thousand transitions behind it, all of them explored and none learned from."""
    settings = SMALL | {"gamma": GAMMA, "learning_starts": 1_000} | settings
    return MaskedDQN(POLICY[observe], vector(observe=observe), **settings).learn(1_000)


# --- acting -----------------------------------------------------------------------------------------------


def test_random_exploration_keeps_to_the_mask() -> None:
    model = explorer()  # in mode "strict", where a disabled action is an error
    assert violations(model.env) == [0, 0]
    assert model.replay_buffer.size() == 500  # of two environments each


def test_exploration_is_uniform_over_the_enabled_actions() -> None:
    model = explorer()
    masks = np.tile([[True, False, True], [False, True, False], [True, True, True]], (3_000, 1))
    observations = np.zeros((len(masks), *model.observation_space.shape), np.float32)
    actions = model._choose(observations, masks, epsilon=1.0).reshape(-1, 3)
    shares = [np.bincount(actions[:, k], minlength=3) / 3_000 for k in range(3)]
    assert np.abs(np.array(shares) - [[0.5, 0, 0.5], [0, 1, 0], [1 / 3] * 3]).max() < 0.03


@pytest.mark.parametrize("value", [1e30, np.inf, -np.inf], ids=str)
def test_whatever_the_network_says_the_greedy_choice_is_enabled(value: float) -> None:
    model = explorer()
    with torch.no_grad():
        model.q_net.q_net[-1].bias[:] = torch.tensor([value, -value, value])
    masks = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1) if a or b or c], np.int8)
    observations = np.zeros((len(masks), *model.observation_space.shape), np.float32)
    actions, _ = model.predict(observations, deterministic=True, action_masks=masks)
    assert masks[np.arange(len(masks)), actions].all()


def test_predicting_without_masks_is_an_error() -> None:
    model = explorer()
    with pytest.raises(MDPError, match="predict needs action_masks, like info\\['action_mask'\\]"):
        model.predict(model.env.reset())


def test_a_single_observation_gets_a_single_action() -> None:
    model = explorer("dict")
    observation, info = press().reset(seed=0)
    action, state = model.predict(observation, action_masks=info["action_mask"], deterministic=True)
    assert (np.shape(action), state) == ((), None)


# --- what is remembered -----------------------------------------------------------------------------------


@pytest.mark.parametrize("observe", ["dict", "flat"])
def test_each_transition_keeps_the_mask_after_it(observe: str) -> None:
    model = explorer(observe)
    buffer, layout, size = model.replay_buffer, model.env.get_attr("layout")[0], model.replay_buffer.size()
    is_dict = isinstance(buffer, DictReplayBuffer)
    after = {"supervisor": buffer.next_observations["supervisor"]} if is_dict else buffer.next_observations
    cut = buffer.timeouts[:size].astype(bool)
    ended = buffer.dones[:size].astype(bool) & ~cut
    assert cut.sum() >= 3
    assert ended.sum() >= 3
    for k in range(2):
        rows = {"supervisor": after["supervisor"][:size, k]} if is_dict else after[:size, k]
        masks = model.env.get_attr("model")[0].masks[layout.states_of(rows)]
        masks[ended[:, k]] = 1  # nothing follows
        assert (buffer.actions[:size, k, 1:] == masks).all()  # where it was cut as well


# --- looking ahead ----------------------------------------------------------------------------------------


def by_definition(model: MaskedDQN, batch: Any) -> tuple[list[float], list[float]]:
    """Return the targets and the Huber loss of a batch, one transition at a time."""
    with torch.no_grad():
        old, new, now = (
            network(observations).tolist()
            for network, observations in (
                (model.q_net_target, batch.next_observations),
                (model.q_net, batch.next_observations),
                (model.q_net, batch.observations),
            )
        )
    targets, losses = [], []
    for i, (row, done, reward) in enumerate(zip(batch.actions, batch.dones, batch.rewards, strict=True)):
        action, *mask = row.int().tolist()
        enabled = [a for a in range(3) if mask[a]]
        chooser = new if model.double else old
        best = max(enabled, key=lambda a, i=i, chooser=chooser: chooser[i][a])
        target = reward.item() + (0 if done.item() else GAMMA * old[i][best])
        error = abs(now[i][action] - target)
        targets.append(target)
        losses.append(error**2 / 2 if error < 1 else error - 0.5)
    return targets, losses


@pytest.mark.parametrize("double", [False, True])
def test_the_target_is_the_maximum_over_the_enabled_actions(double: bool) -> None:  # noqa: FBT001
    model = explorer(double=double)
    with torch.no_grad():
        model.q_net.q_net[-1].bias += torch.tensor([3.0, -1.0, 2.0])  # the two networks disagree
        model.q_net_target.q_net[-1].bias += torch.tensor([5.0, -1.0, 1.0])  # and would strike everywhere
    batch = model.replay_buffer.sample(300)
    masks = batch.actions[:, 1:].bool()
    assert 0 < (masks[:, 0] == 0).sum() < 300
    targets, losses = by_definition(model, batch)
    ahead = model._bootstrap(batch.next_observations, masks)
    computed = batch.rewards + (1 - batch.dones) * GAMMA * ahead
    assert computed.flatten().tolist() == pytest.approx(targets, rel=1e-5)

    model.replay_buffer.sample = lambda *_, **__: batch
    model.train(1, 300)
    assert model.logger.name_to_value["train/loss"] == pytest.approx(np.mean(losses), rel=1e-4)


def test_what_is_disabled_never_leaks_into_the_target() -> None:
    model = explorer()
    batch = model.replay_buffer.sample(300)
    batch = batch._replace(actions=torch.cat((batch.actions[:, :1], 0 * batch.actions[:, 1:]), dim=1))
    batch.actions[:, 2] = 1  # only a rest is enabled
    before = model._bootstrap(batch.next_observations, batch.actions[:, 1:].bool())
    with torch.no_grad():
        model.q_net_target.q_net[-1].bias[[0, 2]] = 1e9
    after = model._bootstrap(batch.next_observations, batch.actions[:, 1:].bool())
    assert torch.equal(before, after)


# --- as a learner of Stable-Baselines3 --------------------------------------------------------------------


def test_it_learns_and_breaks_no_rule() -> None:
    settings = {"learning_starts": 200, "learning_rate": 3e-3, "target_update_interval": 100, "gamma": GAMMA}
    env = make_vec_env(partial(press, observe="flat"), 2, seed=0)
    model = MaskedDQN("MlpPolicy", env, **SMALL | settings, double=True, train_freq=2).learn(3_000)
    assert violations(env) == [0, 0]
    rewards, lengths = evaluate_policy(model, env, 20, return_episode_rewards=True)
    assert violations(env) == [0, 0]
    assert np.mean(rewards) > 8.5  # at random half of the episodes are cut before 9
    assert np.mean(lengths) < 27


def test_the_seed_settles_what_is_learned(tmp_path: Path) -> None:
    first, second = (
        MaskedDQN("MlpPolicy", vector(observe="flat"), **SMALL, learning_starts=50).learn(300)
        for _ in range(2)
    )
    one, other = (model.q_net.state_dict() for model in (first, second))
    assert all(torch.equal(one[name], other[name]) for name in one)
    first.save(tmp_path / "model.zip")
    again = MaskedDQN.load(tmp_path / "model.zip", env=vector(observe="flat"))
    assert all(torch.equal(one[name], again.q_net.state_dict()[name]) for name in one)


@pytest.mark.parametrize("setting", [{"n_steps": 3}, {"optimize_memory_usage": True}], ids=str)
def test_settings_that_would_lose_the_mask(setting: dict[str, Any]) -> None:
    with pytest.raises(MDPError, match=f"{next(iter(setting))} is .*to keep the next mask"):
        MaskedDQN("MlpPolicy", press(observe="flat"), **SMALL, **setting)


def test_an_environment_without_masks() -> None:
    with pytest.raises(MDPError, match="no action_masks\\(\\); wrap it in a SupervisedEnv"):
        MaskedDQN("MlpPolicy", Press(), **SMALL)


def test_an_environment_that_tells_no_mask() -> None:
    class Silent(Press):
        def action_masks(self) -> list[bool]:
            return [True] * 3

    model = MaskedDQN("MlpPolicy", Silent(), **SMALL)
    with pytest.raises(MDPError, match="no 'action_mask' into info"):
        model.learn(10)


def test_without_torch_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    for name in ("_stable", "masked_dqn"):
        monkeypatch.delitem(sys.modules, f"supremal.deep.{name}")
    with pytest.raises(
        MissingDependencyError, match=r"deep learning needs torch.*pip install 'supremal\[deep\]'"
    ):
        import supremal.deep.masked_dqn  # noqa: F401 - importing is what fails

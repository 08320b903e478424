"""Masked PPO by RLlib: no rule is broken by any worker, also where a node is killed in the middle."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from supremal import MDPError, from_text
from supremal.envs.supervised import SupervisedEnv

ray = pytest.importorskip("ray")
pytest.importorskip("ray.rllib.algorithms.ppo")
pytestmark = pytest.mark.filterwarnings("default")  # Ray's own

QUICK = {"train_batch_size": 400, "minibatch_size": 100, "num_epochs": 2}
NODE = {"num_cpus": 1, "object_store_memory": 10**8}
PAGE = Path(__file__).parents[3] / "docs" / "studies.md"


def cliff(mode: str = "strict") -> Callable[[], SupervisedEnv]:
    """Return what makes a small environment, where one must not go up, nor left, twice in a row."""

    def make() -> SupervisedEnv:
        rules = [
            from_text(f"name {twice} \n 0 -{twice}-> 1 \n 0 -{others}-> 0 \n 1 -{others}-> 0")
            for twice, others in (("up", "right, down, left"), ("left", "up, right, down"))
        ]
        env = gymnasium.make("CliffWalking-v1", max_episode_steps=50)
        return SupervisedEnv(env, rules=rules, events=["up", "right", "down", "left"], mode=mode)

    return make


def trained(algorithm: Any, iterations: int) -> dict[str, int]:
    """Train; return what the workers counted, in all."""
    total = dict.fromkeys(("violations", "disabled", "num_env_steps_sampled"), 0)
    for _ in range(iterations):
        found = algorithm.train()["env_runners"]
        total = {name: count + int(found[name]) for name, count in total.items()}
    return total


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Give a cluster of one node with one CPU, that this process is connected to."""
    utils = pytest.importorskip("ray.cluster_utils")
    head = {**NODE, "include_dashboard": False}
    found = utils.Cluster(initialize_head=True, head_node_args=head)
    try:
        ray.init(found.address, log_to_driver=False)
        yield found
    finally:
        ray.shutdown()
        found.shutdown()


def test_an_observation_is_the_mask_and_one_array() -> None:
    from supremal.deep.rllib import RLlibEnv

    env, plain = RLlibEnv(cliff()()), cliff()()
    told, seen = env.reset(seed=0)[0], plain.reset(seed=0)
    for action in (0, 1, 3, 0):
        assert told in env.observation_space
        assert told["action_mask"].tolist() == seen[-1]["action_mask"].tolist()
        assert told["observations"][seen[0]["observation"]] == 1
        assert told["observations"].sum() == len(seen[0])  # one of the places of each part
        told, seen = env.step(action)[0], plain.step(action)
    assert told["observations"].dtype == told["action_mask"].dtype == np.float32


def test_what_has_no_dialect_is_refused() -> None:
    from supremal.deep.rllib import RLlibEnv

    class Strange(gymnasium.Env):
        action_space = gymnasium.spaces.Discrete(2, start=1)
        observation_space = gymnasium.spaces.Discrete(2)

    with pytest.raises(MDPError, match="Discrete actions from 0 are needed"):
        RLlibEnv(Strange())
    Strange.action_space = gymnasium.spaces.Discrete(2)
    Strange.observation_space = gymnasium.spaces.Sequence(gymnasium.spaces.Discrete(2))
    with pytest.raises(MDPError, match="cannot be made one array"):
        RLlibEnv(Strange())


def test_no_worker_breaks_a_rule_though_a_node_is_killed(cluster: Any) -> None:
    from supremal.deep.rllib import masked_ppo

    second = cluster.add_node(**NODE)
    algorithm = masked_ppo(cliff()).training(**QUICK).build_algo()
    runners = algorithm.env_runner_group
    before = trained(algorithm, 2)
    assert before == {"violations": 0, "disabled": 0, "num_env_steps_sampled": 800}
    assert runners.num_healthy_remote_workers() == 2
    cluster.remove_node(second, allow_graceful=False)
    cluster.add_node(**NODE)
    during = trained(algorithm, 2)  # by the other
    assert (during["violations"], during["num_env_steps_sampled"] > 0) == (0, True)
    deadline = time.monotonic() + 120
    while runners.num_healthy_remote_workers() < 2:
        assert time.monotonic() < deadline
        trained(algorithm, 1)
    assert trained(algorithm, 2) == before
    algorithm.stop()


@pytest.mark.usefixtures("cluster")
def test_without_the_mask_rules_are_broken() -> None:
    from supremal.deep.rllib import masked_ppo

    algorithm = masked_ppo(cliff("monitor"), workers=0).training(**QUICK).build_algo()
    assert trained(algorithm, 1)["violations"] > 0
    algorithm.stop()


@pytest.mark.usefixtures("cluster")
def test_the_page_runs_as_printed() -> None:
    blocks = PAGE.read_text(encoding="utf-8").split("```python rllib\n")[1:]
    code = "\n".join(block.split("```")[0] for block in blocks).replace("workers=2", "workers=0")
    assert "build_algo" in code
    exec(compile(code, str(PAGE), "exec"), {})  # noqa: S102 - our own page

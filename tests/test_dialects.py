"""Masks where libraries look for them, and layouts: the supervisor's state, read off an observation."""

from __future__ import annotations

import json
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, Graph, MultiBinary, Tuple, flatten
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import TimeLimit
from hypothesis import given

from stand_ins import MOVES, NO_TWO_UPS, Scripted
from strategies import SEEDS
from supremal import MDPError, from_text, reward_machine
from supremal.envs import SupervisedEnv
from supremal.envs.dialects import with_mask
from supremal.envs.layout import Layout, layout_from

DIALECTS = {"rllib": ("observations", np.float32), "pettingzoo": ("observation", np.int8)}
DIALECTS |= {"torchrl": ("observation", np.bool_)}


def cliff(observe: Any = "flat") -> SupervisedEnv:
    env = gymnasium.make("CliffWalking-v1")
    return SupervisedEnv(env, rules=[NO_TWO_UPS], events=MOVES, mode="correct", observe=observe)


# --- dialects ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dialect", DIALECTS)
@pytest.mark.parametrize("observe", ["flat", "dict"])
def test_gymnasium_finds_no_fault(dialect: Any, observe: Any) -> None:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*is different from the unwrapped version.*")
        check_env(with_mask(cliff(observe), dialect), skip_render_check=True)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_the_mask_stands_where_the_library_looks(dialect: Any) -> None:
    key, dtype = DIALECTS[dialect]
    env = with_mask(TimeLimit(cliff(), 5), dialect)
    observation, info = env.reset(seed=0)
    for _ in range(5):
        assert observation.keys() == {key, "action_mask"}
        assert observation in env.observation_space
        assert observation["action_mask"].dtype == dtype
        assert observation["action_mask"].tolist() == info["action_mask"].tolist()
        assert env.get_wrapper_attr("action_masks")().tolist() == info["action_mask"].astype(bool).tolist()
        assert info["action_mask"].dtype == np.int8
        observation, _, _, truncated, info = env.step(env.action_space.sample(info["action_mask"]))
    assert truncated


def test_torchrl_keeps_the_environments_keys_and_others_wrap_them() -> None:
    assert with_mask(cliff("dict"), "torchrl").reset()[0].keys() == {
        "observation",
        "supervisor",
        "action_mask",
    }
    inner = with_mask(cliff("dict"), "rllib").reset()[0]["observations"]
    assert inner.keys() == {"observation", "supervisor"}


def test_an_environments_own_mask_will_do() -> None:
    env = with_mask(Scripted(None, action_mask=np.array([0, 1], np.int8)), "pettingzoo")
    assert env.reset()[0]["action_mask"].tolist() == [0, 1]


@pytest.mark.parametrize(
    ("info", "got"),
    [
        ({}, "there is none: wrap it in a SupervisedEnv"),
        ({"action_mask": np.zeros(2, np.int8)}, r"it is \[0, 0\]"),
        ({"action_mask": np.ones(3, np.int8)}, r"it is \[1, 1, 1\]"),
        ({"action_mask": None}, "it is None"),
    ],
)
def test_an_empty_mask_is_never_passed_on(info: dict[str, Any], got: str) -> None:
    with pytest.raises(MDPError, match=rf"has to have 2 entries, not all 0; {got}"):
        with_mask(Scripted(None, **info), "rllib").reset()


def test_what_is_refused_and_why() -> None:
    with pytest.raises(MDPError, match="dialect is 'rlib'; did you mean 'rllib'"):
        with_mask(cliff(), "rlib")
    with pytest.raises(MDPError, match="dialect is 3; known: rllib, pettingzoo, torchrl"):
        with_mask(cliff(), 3)
    with pytest.raises(MDPError, match="the environment is 'Taxi-v4'; one of Gymnasium's"):
        with_mask("Taxi-v4", "rllib")
    twice = with_mask(cliff(), "torchrl")
    with pytest.raises(MDPError, match="has a key 'action_mask' already; rename it there"):
        with_mask(twice, "torchrl")


# --- layouts ----------------------------------------------------------------------------------------------

SPACES = [
    Discrete(5, start=2),
    Box(-np.inf, np.inf, (2, 3), np.float64),
    Box(0, 255, (2, 2, 3), np.uint8),
    MultiBinary(3),
    Tuple((Discrete(2), Box(-1, 1, (2,), np.float32))),
    Dict({"far": Box(0, 1, (2,), np.float32), "near": Discrete(2)}),
]
MACHINE = reward_machine(["p"], [("0", "p", "1", 1.0), ("1", "!p", "2", 0.5)])
PLANT = from_text("name press\nuncontrollable jam\n0 -a-> 1\n0 -b-> 0\n1 -a-> 1\n1 -jam-> 1\n1 -b-> 0")
RULE = from_text("name r\nuncontrollable jam\n0 -a, b-> 0\n0 -jam-> 1\n1 -b-> 0\n1 -jam-> 1")


class Pressed(Scripted):
    """An environment with observations of any space, in which many things happen."""

    def __init__(self, space: gymnasium.Space) -> None:
        random = np.random.default_rng(0)
        words = [[("a",), ("a", "jam"), ("b",), ("b", "jam")][k] for k in random.integers(4, size=40)]
        super().__init__(*words)
        self.observation_space = space
        space.seed(0)
        self.seen = [space.sample() for _ in range(41)]

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        return self.seen[0], super().reset(seed=seed, options=options)[1]

    def step(self, action: int) -> Any:
        _, *rest, info = super().step(action)
        return self.seen[len(self.taken)], *rest, {**info, "labels": ["p"] if action == 0 else []}


@pytest.mark.parametrize("machine", [None, MACHINE])
@pytest.mark.parametrize("space", SPACES, ids=str)
def test_the_supervisors_state_is_read_off_an_observation(space: gymnasium.Space, machine: Any) -> None:
    make = {
        "rules": [RULE],
        "plant": PLANT,
        "events": ["a", "b"],
        "mode": "monitor",
        "reward_machine": machine,
    }
    in_array = SupervisedEnv(Pressed(space), observe="flat", **make)
    in_dict = SupervisedEnv(Pressed(space), **make)
    flat, (told, _) = in_array.reset()[0], in_dict.reset()
    states, rows, numbers = [], [], []
    read = layout_from(json.loads(json.dumps(in_array.layout.document())))
    for _ in range(40):
        states.append(in_array._run.state)
        rows.append(flat)
        numbers.append(told["supervisor"])
        assert flat in in_array.observation_space
        assert told in in_dict.observation_space
        assert (flat.dtype, flat.shape) == (np.float32, in_array.layout.space.shape)
        assert in_array.layout.state_of(flat) == in_dict.layout.state_of(told) == states[-1]
        own = flatten(space, told["observation"] if "observation" in told else _without(told))
        assert np.array_equal(flat[: in_array.layout.width], own.astype(np.float32))
        blocks = np.split(flat, in_array.layout.starts)[1:]
        assert [block.sum() for block in blocks[:-1]] == [part >= 0 for part in in_array._run.parts[:2]]
        assert blocks[-1].tolist() == ([] if machine is None else np.eye(3)[told["machine"]].tolist())
        action = len(states) % 2
        flat, told = in_array.step(action)[0], in_dict.step(action)[0]
    assert min(states) == -1 < max(states)
    assert read.states_of(np.stack(rows)).tolist() == states
    assert in_dict.layout.states_of({"supervisor": np.array(numbers)[:, None]}).tolist() == states


def _without(told: dict[str, Any]) -> dict[str, Any]:
    return {key: part for key, part in told.items() if key not in ("supervisor", "machine")}


@given(SEEDS)
def test_a_layout_finds_each_state_by_its_blocks(seed: int) -> None:
    random = np.random.default_rng(seed)
    sizes = random.integers(1, 6, random.integers(1, 5))
    parts = np.unique(random.integers(sizes, size=(20, len(sizes))), axis=0)
    layout = Layout("flat", len(parts), 2, 3, tuple(sizes.tolist()), parts)
    places = random.integers(-1, sizes, size=(50, len(sizes)))
    blocks = [np.eye(size)[places[:, k]] * (places[:, k] >= 0)[:, None] for k, size in enumerate(sizes)]
    batch = np.hstack([random.random((50, 3)), *blocks, random.random((50, 2))])
    expected = {tuple(row): s for s, row in enumerate(parts.tolist())}
    found = layout.states_of(batch)
    assert found.tolist() == [expected.get(tuple(row), -1) for row in places.tolist()]
    assert layout_from(layout.document()).states_of(batch).tolist() == found.tolist()


@pytest.mark.parametrize(
    ("batch", "message"),
    [
        (np.zeros((2, 3)), r"has shape \(2, 3\); \(N, 39\) is needed"),
        (np.zeros(39), r"has shape \(39,\); \(N, 39\) is needed"),
        ({"supervisor": [0]}, r"has shape \(\)"),
    ],
)
def test_what_is_no_batch_of_arrays(batch: Any, message: str) -> None:
    assert cliff().layout.space.shape == (50,)
    layout = Layout("flat", 1, 0, 37, (2,), np.array([[0]]))
    with pytest.raises(MDPError, match=message):
        layout.states_of(batch)


@pytest.mark.parametrize("observation", [3, None, {"observation": 3}])
def test_what_is_no_dictionary(observation: Any) -> None:
    with pytest.raises(MDPError, match="a dictionary with 'supervisor' is needed"):
        cliff("dict").layout.state_of(observation)


GOOD = Layout("flat", 2, 0, 3, (2, 2), np.array([[0, 0], [1, 1]])).document()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kind": "flatt"}, "a layout of kind 'flatt'; did you mean 'flat'"),
        ({"states": 0}, "the parts of a layout of 0 states"),
        ({"states": True}, "whole numbers are needed, none below 0"),
        ({"width": -1}, "whole numbers are needed, none below 0"),
        ({"sizes": "ab"}, "whole numbers are needed, none below 0"),
        ({"sizes": [2, 1]}, "each number below the size of its block"),
        ({"parts": [[0], [1]]}, "rows of whole numbers are needed"),
        ({"parts": "x"}, "rows of whole numbers are needed"),
        ({"parts": [[0, 0], [0, 0]]}, "two states of a layout have the same parts"),
        ({"parts": [[0, 0.5], [1, 1]]}, "rows of whole numbers are needed"),
        ({"more": 1}, "a table with kind, states, machine, width, sizes, parts is needed"),
    ],
)
def test_a_document_that_tells_of_no_layout(change: dict[str, Any], message: str) -> None:
    with pytest.raises(MDPError, match=message):
        layout_from(GOOD | change)


def test_observations_that_have_no_place_for_the_state() -> None:
    env = Scripted(None)
    env.observation_space = Dict({"supervisor": Discrete(2)})
    with pytest.raises(MDPError, match=r"has a key 'supervisor'.* or use observe='flat'"):
        SupervisedEnv(env)
    assert SupervisedEnv(env, observe="flat").layout.width == 2
    env.observation_space = Graph(Box(0, 1, (1,)), None)
    with pytest.raises(MDPError, match="cannot be flattened; use observe='dict'"):
        SupervisedEnv(env, observe="flat")

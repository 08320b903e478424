"""A vector of supervised environments: each of them does what one on its own does, step for step."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, Tuple
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import batch_space, iterate
from hypothesis import given, settings
from hypothesis import strategies as st

from stand_ins import MOVES, NO_TWO_UPS, Scripted, Stormy
from strategies import SEEDS, plants, specifications
from supremal import Alphabet, Automaton, MDPError, RuleError, from_text, reward_machine
from supremal.envs import SupervisedEnv
from supremal.envs.supervised_vector import SupervisedVectorEnv

N = 3
MODES = list(AutoresetMode)
SPACES = [
    Discrete(3, start=1),
    Box(-1, 1, (2, 2), np.float32),
    MultiBinary(2),
    Tuple((Discrete(2), Box(0, 1, (1,), np.float32))),
    Dict({"far": Box(0, 1, (2,), np.float32), "near": Discrete(2)}),
]
MACHINE = reward_machine(["p", "q"], [("0", "p", "1", 1.0), ("1", "q & !p", "0", 0.5)])
TOLD = ("action", "action_mask", "events", "violations", "disabled", "model_broken", "labels")


def sync(makers: list[Callable[[], gymnasium.Env]], mode: AutoresetMode) -> SyncVectorEnv:
    return SyncVectorEnv(makers, autoreset_mode=mode)


def same(one: Any, other: Any) -> bool:
    """Whether two observations are equal, as nested as they may be."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(np.array_equal(one, other))


def assert_told(infos: dict[str, Any], i: int, info: dict[str, Any]) -> None:
    """Check that ``infos`` tells of environment ``i`` what ``info`` does, and no more."""
    for key in TOLD:
        assert bool(infos.get(f"_{key}", np.zeros(N))[i]) == (key in info), key
        if key in info:
            assert same(infos[key][i], info[key]), key


class Singles:
    """N environments on their own that start again when a vector of them would."""

    def __init__(self, envs: list[SupervisedEnv], mode: AutoresetMode) -> None:
        self.envs, self.mode, self.ended = envs, mode, [False] * len(envs)

    def step(self, actions: list[int]) -> list[tuple[Any, ...]]:
        """Return the step of each, ``[observation, reward, terminated, truncated, info, last]``.

        ``last`` is observation and info of an episode's end, where a new one began in the same step.
        """
        steps = []
        for i, env in enumerate(self.envs):
            if self.ended[i] and self.mode is AutoresetMode.NEXT_STEP:
                observation, info = env.reset()
                steps.append((observation, 0.0, False, False, info, None))
            else:
                observation, reward, terminated, truncated, info = env.step(actions[i])
                last = None
                if (terminated or truncated) and self.mode is AutoresetMode.SAME_STEP:
                    last = observation, info
                    observation, info = env.reset()
                steps.append((observation, reward, terminated, truncated, info, last))
            self.ended[i] = steps[-1][2] or steps[-1][3]
        return steps


def agreed(alone: Callable[[], Any], together: Callable[[], Any]) -> Any:
    """Return what ``alone`` gives; where that is an error, check that ``together`` says the same: None."""
    try:
        return alone()
    except MDPError as error:
        said = str(error)
    with pytest.raises(MDPError, match=rf"^environment \d: {re.escape(said)}$"):
        together()
    return None


class Pair:
    """A vector beside its singles, in lockstep."""

    def __init__(self, envs: SupervisedVectorEnv, singles: Singles) -> None:
        self.envs, self.singles = envs, singles

    def reset(self, which: np.ndarray, seed: int | None, **options: Any) -> bool:
        """Start new episodes in both; return whether that went well."""
        alone = agreed(
            lambda: {
                i: self.singles.envs[i].reset(seed=None if seed is None else seed + i)
                for i in np.flatnonzero(which).tolist()
            },
            lambda: self.envs.reset(seed=seed, options=options),
        )
        if alone is None:
            return False
        observations, infos = self.envs.reset(seed=seed, options=options)
        each = list(iterate(self.envs.observation_space, observations))
        for i, (observation, info) in alone.items():
            assert same(each[i], observation)
            assert_told(infos, i, info)
            self.singles.ended[i] = False
        return True

    def step(self, actions: list[int]) -> bool:
        """Let an epoch pass in both; return whether that went well."""
        envs, singles = self.envs, self.singles
        next_step = singles.mode is AutoresetMode.NEXT_STEP
        restarting = [ended and next_step for ended in singles.ended]
        steps = agreed(lambda: singles.step(actions), lambda: envs.step(np.array(actions)))
        if steps is None:
            return False
        observations, rewards, terminated, truncated, infos = envs.step(np.array(actions))
        assert envs.observation_space.contains(observations)
        assert infos["autoreset"].tolist() == restarting
        each, known = list(iterate(envs.observation_space, observations)), envs.layout.states_of(observations)
        for i, (observation, reward, over, cut, info, last) in enumerate(steps):
            assert same(each[i], observation)
            assert (rewards[i], terminated[i], truncated[i]) == (reward, over, cut)
            assert_told(infos, i, info)
            assert known[i] == singles.envs[i].layout.state_of(observation) == singles.envs[i]._run.state
            if last is not None:
                assert same(infos["final_obs"][i], last[0])
                assert_told(infos["final_info"], i, last[1])
        return True


@settings(max_examples=80)
@given(
    plants(),
    specifications(),
    SEEDS,
    st.sampled_from(["correct", "monitor", "strict"]),
    st.sampled_from(MODES),
    st.sampled_from(SPACES),
    st.sampled_from(["dict", "flat"]),
    st.sampled_from([None, MACHINE]),
    st.booleans(),
)
def test_each_does_what_one_on_its_own_does(
    plant: Automaton,
    spec: Automaton,
    seed: int,
    mode: Any,
    autoreset: AutoresetMode,
    space: gymnasium.Space,
    observe: Any,
    machine: Any,
    own: bool,  # noqa: FBT001
) -> None:
    names = tuple(sorted({*plant.alphabet, *spec.alphabet} - {"u", "v"}))
    if not names:
        return
    random = np.random.default_rng(seed)
    make = {"rules": [spec], "plant": plant, "events": names, "mode": mode, "nonblocking": bool(seed % 2)}
    make |= {"observe": observe, "reward_machine": machine, "own_mask": own}
    if random.random() < 0.5:
        make["safe_actions"] = [3]

    def stormy() -> gymnasium.Env:
        return Stormy(plant, names, space, strange=0.1, free=0.9)

    vector = sync([stormy] * N, autoreset)
    try:
        singles = Singles([SupervisedEnv(stormy(), **make) for _ in range(N)], autoreset)
    except RuleError:
        with pytest.raises(RuleError):
            SupervisedVectorEnv(vector, **make)
        return
    envs = SupervisedVectorEnv(vector, **make)
    assert envs.single_observation_space == singles.envs[0].observation_space
    pair = Pair(envs, singles)
    well = pair.reset(np.ones(N, np.bool_), seed % 2**31)  # as many seeds as spaces take
    for _ in range(25):
        if not well:
            return
        masks = envs.action_masks()
        assert masks.any(axis=1).all()
        wild = random.random() < (0.03 if mode == "strict" else 0.5)
        allowed = np.ones_like(masks) if wild else masks
        well = pair.step([int(random.choice(np.flatnonzero(row))) + 3 for row in allowed])
        if well and autoreset is AutoresetMode.DISABLED and any(singles.ended):
            ended = np.array(singles.ended)
            well = pair.reset(ended, None, reset_mask=ended)
    for name in ("violations", "disabled", "model_broken") if well else ():
        assert getattr(envs.counts, name).tolist() == [getattr(env.counts, name) for env in singles.envs]


# --- arrays -----------------------------------------------------------------------------------------------


class Sea(VectorEnv):
    """N boats in arrays: it storms at random, which is a fault; a storm moors a boat that sails."""

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 - Gymnasium's own

    def __init__(self, n: int) -> None:
        self.num_envs = n
        self.single_observation_space, self.single_action_space = Box(0, 1, (2,), np.float32), Discrete(2)
        self.observation_space = batch_space(self.single_observation_space, n)
        self.action_space = batch_space(self.single_action_space, n)

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.age, self.storms = np.zeros(self.num_envs, int), np.zeros(self.num_envs, np.bool_)
        return self.seen(), {}

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        self.age = np.where(self.age == 7, 0, self.age + 1)
        self.storms = (self.age > 0) & (self.np_random.random(self.num_envs) < 0.2)
        cut = np.zeros(self.num_envs, np.bool_)
        return self.seen(), (actions == 0) * 1.0, self.age == 7, cut, {"storms": self.storms}

    def seen(self) -> np.ndarray:
        return np.column_stack([self.age / 7, self.storms]).astype(np.float32)


NO_SAIL_AFTER_STORM = from_text(
    "name lull\nuncontrollable storm\n0 -sail, moor-> 0\n0 -storm-> 1\n1 -moor-> 0\n1 -storm-> 1"
)


def numbers(actions: Any, seen: Any, rewards: Any, over: Any, cut: Any, infos: Any) -> np.ndarray:
    """The words as numbers, in the alphabet ``sail, moor, storm``."""
    return np.column_stack([actions, np.where(infos["storms"], 2, -1)])


def names(actions: Any, *transition: Any) -> list[tuple[str, ...]]:
    """The same words as names."""
    boats = zip(actions.tolist(), transition[-1]["storms"].tolist(), strict=True)
    return [("sail", "moor")[a : a + 1] + ("storm",) * storms for a, storms in boats]


def test_words_may_be_numbers_and_labels_bits() -> None:
    machine = reward_machine(["calm", "storm"], [("0", "storm", "1", -1.0), ("1", "calm", "0", 2.0)])
    make = {
        "rules": [NO_SAIL_AFTER_STORM],
        "events": ["sail", "moor"],
        "mode": "correct",
        "reward_machine": machine,
    }
    by_numbers = SupervisedVectorEnv(
        Sea(64), word=numbers, labels=lambda _, infos: 1 + infos["storms"].astype(int), **make
    )
    assert tuple(by_numbers.alphabet) == ("sail", "moor", "storm")
    by_names = SupervisedVectorEnv(
        Sea(64),
        word=names,
        labels=lambda _, infos: [{"storm"} if s else {"calm"} for s in infos["storms"]],
        **make,
    )
    random = np.random.default_rng(0)
    assert same(by_numbers.reset(seed=1)[0], by_names.reset(seed=1)[0])
    for _ in range(60):
        actions = random.integers(2, size=64)
        one, other = by_numbers.step(actions), by_names.step(actions)
        assert all(map(same, one, other))
        calm = ~one[4]["storms"] | one[2] | one[4]["autoreset"]
        assert (one[4]["action_mask"][:, 0] == calm).all()
    assert by_numbers.counts.disabled.sum() > 0
    assert by_numbers.counts.violations.sum() == by_numbers.counts.model_broken.sum() == 0


def test_long_words_of_many_events_are_numbers_too() -> None:
    events = [f"e{k}" for k in range(30)]
    words = np.random.default_rng(0).integers(-1, 30, (2, 15))
    makers = [lambda: Scripted(None, None, actions=30)] * 2
    envs = SupervisedVectorEnv(sync(makers, AutoresetMode.NEXT_STEP), events=events, word=lambda *_: words)
    envs.reset()
    told = envs.step(np.array([0, 1]))[4]["events"]
    assert told.tolist() == [tuple(events[e] for e in word if e >= 0) for word in words.tolist()]


def test_no_supervisor_moves_where_an_action_is_ignored() -> None:
    envs = SupervisedVectorEnv(
        sync([lambda: Scripted(None, None), lambda: Scripted(None, None, None)], AutoresetMode.NEXT_STEP),
        rules=[from_text("0 -action_0-> 1\n1 -action_1-> 0")],
    )
    envs.reset()
    for actions in ([0, 0], [1, 1]):
        infos = envs.step(np.array(actions))[4]
    assert infos["action_mask"].tolist() == [[1, 1], [1, 0]]
    assert envs.action_masks().tolist() == [[True, True], [True, False]]
    observations, _, _, _, infos = envs.step(np.array([1, 0]))  # the first would be disabled
    assert infos["autoreset"].tolist() == [True, False]
    assert infos["_action"].tolist() == [False, True]
    assert infos["events"].tolist() == [(), ("action_0",)]
    assert observations["supervisor"].tolist() == [0, 1]
    assert envs.counts.disabled.tolist() == [0, 0]


def test_in_processes_of_their_own() -> None:
    make = {"rules": [NO_TWO_UPS], "events": MOVES, "mode": "correct"}
    rows = []
    for kind in ("sync", "async"):
        envs = SupervisedVectorEnv(
            gymnasium.make_vec("CliffWalking-v1", num_envs=2, vectorization_mode=kind), **make
        )
        random = np.random.default_rng(0)
        envs.reset(seed=0)
        rows.append([envs.step(random.integers(4, size=2)) for _ in range(20)])
        envs.close()
    for one, other in zip(*rows, strict=True):
        assert all(map(same, one[:4], other[:4]))
        assert (one[4]["action"] == other[4]["action"]).all()


# --- what goes wrong --------------------------------------------------------------------------------------


def two(*words: Any, **options: Any) -> SupervisedVectorEnv:
    return SupervisedVectorEnv(
        sync([lambda: Scripted(None, None), lambda: Scripted(*words)], AutoresetMode.NEXT_STEP), **options
    )


def test_strict_says_which_environment_and_touches_none() -> None:
    envs = two(None, None, rules=[from_text("name turns\n0 -action_0-> 1\n1 -action_1-> 0")])
    envs.reset()
    with pytest.raises(MDPError, match=r"^environment 1: action 1 \('action_1'\) is disabled \(turns in 0\)"):
        envs.step(np.array([0, 1]))
    assert [env.taken for env in envs.env.envs] == [[], []]


def test_an_empty_mask_is_an_error_that_says_where() -> None:
    plant = from_text("name drill\nuncontrollable done\nidle -go-> busy\nbusy -done-> idle")
    envs = SupervisedVectorEnv(
        sync(
            [lambda: Scripted(("go", "done"), None, actions=1), lambda: Scripted(("go",), None, actions=1)],
            AutoresetMode.NEXT_STEP,
        ),
        plant=plant,
        events=["go"],
    )
    envs.reset()
    with pytest.raises(MDPError, match=r"^environment 1: no action can pass \(drill in busy\)"):
        envs.step(np.array([0, 0]))


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ([0, 2], "environment 1: action 2 is not known; a whole number from 0 to 1 is needed"),
        ([-1, 0], "environment 0: action -1 is not known"),
        ([0], "2 whole numbers are needed, one an environment"),
        ([0.0, 1.0], "2 whole numbers are needed"),
        ("up", "2 whole numbers are needed"),
        (None, "2 whole numbers are needed"),
    ],
)
def test_unknown_actions(actions: Any, message: str) -> None:
    envs = two(None)
    envs.reset()
    with pytest.raises(MDPError, match=message):
        envs.step(actions if not isinstance(actions, list) else np.array(actions))


@pytest.mark.parametrize(
    ("word", "message"),
    [
        (lambda *_: "ab", "word returned 'ab'; 2 words are needed, or an array of numbers of events"),
        (lambda *_: None, "word returned None; 2 words are needed"),
        (lambda *_: [()], "word returned 1 words; 2 are needed, one an environment"),
        (lambda *_: [(), 7], "environment 1: the word of a step is 7; a tuple of event names is needed"),
        (lambda *_: [(), "a"], "environment 1: the word of a step is 'a'"),
        (lambda *_: [(3,), ()], "environment 0: the word of a step has 3; names of events are needed"),
        (lambda *_: np.array([[0], [2]]), r"environment 1: the word of a step is \[2\]; numbers of events"),
    ],
)
def test_words_that_are_none(word: Any, message: str) -> None:
    envs = two(None, word=word)
    envs.reset()
    with pytest.raises(MDPError, match=message):
        envs.step(np.array([0, 0]))


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        (None, "the reward machine needs .* an array of 2 numbers or 2 sets of names; it got None"),
        (lambda *_: "ab", "it got 'ab'"),
        (lambda *_: np.array([0, 2]), "environment 1: the label is 2; a number from 0 to 1 is needed"),
        (lambda *_: [{"a"}, "a"], "environment 1: the reward machine needs .* the string 'a'"),
    ],
)
def test_a_reward_machine_has_to_be_told_what_is_true(labels: Any, message: str) -> None:
    envs = two(None, reward_machine=reward_machine(["a"], [("0", "a", "1", 1.0)]), labels=labels)
    envs.reset()
    with pytest.raises(MDPError, match=message):
        envs.step(np.array([0, 0]))


def test_one_environment_is_no_vector_and_a_vector_is_not_one() -> None:
    with pytest.raises(
        MDPError, match="a vector of Gymnasium's is needed, and for a single one SupervisedEnv"
    ):
        SupervisedVectorEnv(Scripted(None))
    with pytest.raises(MDPError, match="for a vector of them SupervisedVectorEnv"):
        SupervisedEnv(Sea(2))


@pytest.mark.parametrize("mask", [[True, False], np.array([1, 0]), np.array([True]), "x"])
def test_a_reset_mask_is_an_array_of_truth_values(mask: Any) -> None:
    envs = two(None)
    envs.reset()
    with pytest.raises(MDPError, match="reset_mask is .*; an array of 2 booleans is needed"):
        envs.reset(options={"reset_mask": mask})


def test_a_vector_that_does_not_say_how_episodes_ended() -> None:
    sea = Sea(2)
    sea.metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}
    envs = SupervisedVectorEnv(sea)
    envs.reset(seed=0)
    for _ in range(6):
        envs.step(np.zeros(2, int))
    with pytest.raises(MDPError, match=r"start again in the same step and give no infos\['final_obs'\]"):
        envs.step(np.zeros(2, int))
    sea.metadata = {"autoreset_mode": "sometimes"}
    with pytest.raises(MDPError, match=r"autoreset_mode'\] is 'sometimes'; one of AutoresetMode.NEXT_STEP"):
        SupervisedVectorEnv(sea)


def test_replacements_are_not_the_environments_own_numbers() -> None:
    alphabet = Alphabet(("a", "b", "c"))
    rule = from_text("0 -b, c-> 0\nevents a, b, c", alphabet=alphabet)
    env = SupervisedEnv(
        Scripted(*[None] * 400, actions=3), rules=[rule], events=alphabet.names, mode="correct"
    )
    env.reset(seed=5)
    drawn = np.array([env.step(0)[4]["action"] == 2 for _ in range(300)])
    own = np.random.default_rng(5).random(300) >= 0.5
    assert 0.35 < np.mean(drawn == own) < 0.65

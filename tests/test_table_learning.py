"""Learning by tables that grow: against plain Python bit for bit, and against exact and tabular learning."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete
from hypothesis import given
from hypothesis import strategies as st

from supremal import (
    MDPError,
    from_text,
    plant_automaton,
    product,
    q_learning,
    rule_from_unsafe,
    safe_actions,
    value_iteration,
)
from supremal._jit import COMPILED
from supremal.envs import PickupDelivery, PickupDeliveryEnv, data_file, environment_model
from supremal.envs.supervised import SupervisedEnv
from supremal.formats import read_automaton
from supremal.learning._table_keys import Keys
from supremal.learning.schedules import Schedule
from supremal.learning.settings import ALGORITHMS, Settings
from supremal.learning.tables import table_learning

pytestmark = pytest.mark.engine
MOVES = ("up", "right", "down", "left")
NO_TWO_UPS = from_text("name no_two_ups\n0 -up-> 1\n0 -right, down, left-> 0\n1 -right, down, left-> 0")
_64 = (1 << 64) - 1


class Queue(gymnasium.Env):
    """Jobs arrive by chance and wait; the agent serves one, rests, or opens the gate for a batch."""

    observation_space, action_space = Box(0, 40, (2,), np.int64), Discrete(3, start=1)

    def __init__(self, *, masked: bool = True, wide: int = 40) -> None:
        self.masked, self.wide = masked, wide

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.jobs, self.tired = 3, 0
        return self._told()

    def step(self, action: int) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        if self.masked:
            assert self._mask()[action - 1]
        served = min(self.jobs, action - 1)
        self.tired = 0 if action == 1 else min(self.tired + action - 1, 4)
        self.jobs = min(self.jobs - served + int(self.np_random.integers(3)), self.wide)
        seen, info = self._told()
        return seen, served - 0.1 * self.jobs, self.jobs == 0, self.jobs > 12, info

    def _mask(self) -> np.ndarray:
        return np.array([1, self.tired < 4, self.tired < 2], np.int8)

    def _told(self) -> tuple[np.ndarray, dict[str, Any]]:
        info = {"violations": int(self.jobs > 8)}
        return np.array([self.jobs, self.tired]), {
            **info,
            "action_mask": self._mask(),
        } if self.masked else info


def uniforms(seed: int) -> Iterator[float]:
    """Yield SplitMix64 as 53 bits in [0, 1), in whole numbers."""
    state = int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])
    while True:
        state = (state + 0x9E3779B97F4A7C15) & _64
        z = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & _64
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _64
        yield ((z ^ (z >> 31)) >> 11) * 2.0**-53


def by_dictionary(env: gymnasium.Env, settings: Settings, seed: int) -> tuple[dict[Any, float], list[Any]]:
    """The textbook's listings with a dictionary for a table; the draws in the order of the kernel's."""
    random, q, visits, episodes = uniforms(seed), {}, {}, []
    double = settings.algorithm == "double_q_learning"

    def value(t: int, key: Any, a: int) -> float:
        return q.get((t, key, a), 0.0)

    def best(key: Any, actions: list[int], tables: tuple[int, ...]) -> int:
        return max(actions, key=lambda a: sum(value(t, key, a) for t in tables))

    def chosen(greedy: int, actions: list[int], epsilon: float, u: float) -> int:
        return greedy if u >= epsilon else actions[min(int(u / epsilon * len(actions)), len(actions) - 1)]

    def look(seen: np.ndarray, info: dict[str, Any]) -> tuple[Any, list[int]]:
        return tuple(seen.tolist()), np.flatnonzero(info.get("action_mask", np.ones(3))).tolist()

    for episode in range(settings.episodes):
        epsilon = settings.epsilon_at(episode)
        if double:
            next(random)
        seen, info = env.reset(seed=seed if episode == 0 else None)
        key, actions = look(seen, info)
        action = chosen(best(key, actions, (0, 1) if double else (0,)), actions, epsilon, next(random))
        score, steps, broken = 0.0, 0, 0
        while True:
            seen, reward, terminated, truncated, info = env.step(action + 1)
            score, steps, broken = score + reward, steps + 1, broken + info["violations"]
            own = int(double and next(random) >= 0.5)
            own, other = (1 - own, own) if double else (0, 0)
            goal, (after, actions) = reward, look(seen, info)
            if not terminated:
                u, greedy = next(random), best(after, actions, (own,))
                worth = value(other, after, greedy)
                if settings.algorithm == "sarsa":
                    worth = value(0, after, chosen(greedy, actions, epsilon, u))
                if settings.algorithm == "expected_sarsa":
                    total = sum(value(0, after, a) for a in actions)
                    worth = (1 - epsilon) * worth + epsilon * (total / len(actions))
                goal += settings.gamma * worth
            place = own, key, action
            alpha = settings.alpha_schedule.at(episode)
            if settings.alpha_schedule.kind == "visits":
                visits[place] = visits.get(place, 0) + 1
                alpha = float(visits[place]) ** -settings.alpha_schedule.power
            q[place] = value(*place) + alpha * (goal - value(*place))
            if not terminated:
                if settings.algorithm != "sarsa":
                    greedy = best(after, actions, (0, 1) if double else (0,))
                key, action = after, chosen(greedy, actions, epsilon, u)
            if terminated or truncated or steps >= settings.episode_steps:
                break
        episodes.append((score, steps, terminated, broken))
    return q, episodes


@pytest.mark.parametrize("alpha", [0.3, Schedule.visits(0.7), Schedule.linear(0.5, 0.1, episodes=50)])
@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("masked", [True, False])
def test_learning_is_the_textbooks_bit_for_bit(algorithm: Any, alpha: Any, masked: bool) -> None:  # noqa: FBT001
    settings = Settings(
        episodes=60, episode_steps=15, alpha=alpha, epsilon=0.6, decay_every=20, algorithm=algorithm
    )
    got = table_learning(Queue(masked=masked), settings=settings, seed=5)
    q, episodes = by_dictionary(Queue(masked=masked), settings, 5)
    curves = (got.returns, got.lengths, got.completed, got.violations)
    assert list(zip(*(curve.tolist() for curve in curves), strict=True)) == episodes
    rows = {tuple(key): row for key, row in zip(got.keys.tolist(), got.q.tolist(), strict=True)}
    for _, key, a in q:
        known = [q.get((t, key, a), 0.0) for t in range(settings.tables)]
        assert rows[key][a] == pytest.approx(sum(known) / settings.tables, abs=1e-15)


def test_same_seed_same_result_and_other_seeds_differ() -> None:
    settings = Settings(episodes=30)
    one, two, other = (table_learning(Queue(), settings=settings, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.q, two.q)
    np.testing.assert_array_equal(one.returns, two.returns)
    assert one.returns.tolist() != other.returns.tolist()


@pytest.mark.skipif(not COMPILED, reason="takes many steps")
def test_the_policy_under_the_supervisor_is_worth_the_exact_value() -> None:
    model = environment_model("CliffWalking-v1", actions=MOVES)
    tabular = product(model, [NO_TWO_UPS])
    exact = value_iteration(tabular, gamma=0.9, enabled=safe_actions(tabular))
    env = SupervisedEnv(
        gymnasium.make("CliffWalking-v1"), rules=[NO_TWO_UPS], plant=plant_automaton(model), events=MOVES
    )
    settings = Settings(episodes=400, episode_steps=100, alpha=0.5, epsilon=0.5, epsilon_decay=1.0)
    learned = table_learning(env, settings=settings)
    assert learned.violations.sum() == 0
    start = np.flatnonzero(tabular.initial)[0]
    seen, info = env.reset()
    earned = 0.0
    for step in range(30):
        seen, reward, terminated, _, info = env.step(learned.predict(seen, info["action_mask"]))
        earned += 0.9**step * reward
        if terminated:
            break
    assert terminated
    assert earned == pytest.approx(exact.value[start], abs=1e-6)


@pytest.mark.skipif(not COMPILED, reason="takes many steps")
def test_it_learns_as_q_learning_does_on_the_model() -> None:
    model = environment_model("CliffWalking-v1", actions=MOVES)
    settings = Settings(episodes=150, episode_steps=100, alpha=0.5, epsilon=0.2, epsilon_decay=1.0)
    last = slice(100, None)
    env = gymnasium.make("CliffWalking-v1")
    free = [table_learning(env, settings=settings, seed=s).returns[last].mean() for s in range(4)]
    told = [q_learning(model, settings=settings, seed=s).returns[last].mean() for s in range(4)]
    spread = np.hypot(np.std(free, ddof=1), np.std(told, ddof=1)) / 2
    assert abs(np.mean(free) - np.mean(told)) < 5 * spread + 1


def test_blackjack_has_tuples_for_observations() -> None:
    env = gymnasium.make("Blackjack-v1", sab=True)
    n = 4000 if COMPILED else 200
    result = table_learning(env, settings=Settings(episodes=n, alpha=0.05, gamma=0.99, epsilon=0.2))
    assert result.keys.shape[1] == 3
    assert result.predict((21, 10, 1)) == 0
    if COMPILED:
        assert result.returns[-2000:].mean() > -0.25


def test_no_violation_on_the_grid_while_learning() -> None:
    grid, rule = PickupDelivery(), rule_from_unsafe(read_automaton(data_file("no_u_turn.json")))
    env = gymnasium.wrappers.TimeLimit(PickupDeliveryEnv(), 60)
    settings = Settings(episodes=150 if COMPILED else 5, episode_steps=1000, epsilon=1.0)
    safe = table_learning(
        SupervisedEnv(env, rules=[rule], events=grid.actions, own_mask=True), settings=settings
    )
    free = table_learning(
        SupervisedEnv(env, rules=[rule], events=grid.actions, mode="monitor"), settings=settings
    )
    assert safe.violations.sum() == 0
    assert free.violations.sum() > 0
    assert safe.lengths.max() == 60
    if COMPILED:
        assert len(safe.q) > 1024  # so that the table has grown


# --- ends -------------------------------------------------------------------------------------------------


class Loop(gymnasium.Env):
    """One state and one action, which costs 1; it ends after some steps in one way or the other."""

    observation_space, action_space = Discrete(1), Discrete(1)

    def __init__(self, ends: str, **info: Any) -> None:
        self.ends, self.info = ends, info

    def reset(self, **_: Any) -> tuple[int, dict[str, Any]]:
        self.left = 5
        return 0, {}

    def step(self, _: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.left -= 1
        last = self.left == 0
        return 0, -1.0, last and self.ends == "terminated", last and self.ends == "truncated", self.info


@pytest.mark.parametrize(("ends", "value"), [("truncated", -2.0), ("terminated", -5 / 3), ("limit", -2.0)])
def test_only_what_terminates_has_no_future(ends: str, value: float) -> None:
    settings = Settings(episodes=400, episode_steps=5, alpha=Schedule.visits(0.6), gamma=0.5)
    result = table_learning(Loop(ends), settings=settings)
    assert result.lengths.tolist() == [5] * 400
    assert result.completed.tolist() == [ends == "terminated"] * 400
    assert result.q[0, 0] == pytest.approx(value, abs=0.1)  # -5/3 = -1 + γ · 4/5 · -5/3


def test_completion_is_what_the_environment_calls_success() -> None:
    result = table_learning(Loop("terminated", is_success=False), settings=Settings(episodes=3))
    assert not result.completed.any()


def test_reports_and_stopping() -> None:
    told = []
    result = table_learning(
        Loop("terminated"),
        settings=Settings(episodes=1000),
        on_episodes=lambda so_far: told.append((len(so_far.returns), so_far.finished, so_far.predict(0))),
        should_stop=lambda: len(told) == 2,
    )
    assert told == [(100, False, 0), (200, False, 0)]
    assert (len(result.returns), result.finished, result.seed) == (200, False, 0)
    assert table_learning(Loop("limit"), settings=Settings(episodes=1)).finished


# --- the table --------------------------------------------------------------------------------------------


def test_predicting() -> None:
    result = table_learning(Queue(), settings=Settings(episodes=200, epsilon=1.0))
    assert result.predict(np.array([3, 4])) == 1  # only resting is enabled
    assert result.predict(np.array([3, 4]), np.array([0, 1, 0])) == 2
    assert result.predict(np.array([39, 0])) == 1  # never seen
    assert result.predict(np.array([39, 0]), [False, False, True]) == 3
    with pytest.raises(MDPError, match=r"a mask has shape \(2,\); \(3,\) is needed"):
        result.predict(np.array([3, 4]), [1, 1])
    with pytest.raises(MDPError, match="the mask enables no action"):
        result.predict(np.array([3, 4]), [0, 0, 0])
    with pytest.raises(MDPError, match="the observation is of type int; the first one was an array"):
        result.predict(3)


def test_small_numbers_are_kept_on_request() -> None:
    assert table_learning(Queue(), settings=Settings(episodes=3, precision="float32")).q.dtype == np.float32


@given(
    st.lists(
        st.tuples(st.integers(-5, 5), st.booleans(), st.lists(st.integers(0, 3), min_size=2, max_size=2))
    )
)
def test_keys_are_equal_where_observations_are(seen: list[Any]) -> None:
    keys = Keys()
    made = [
        tuple(keys.read({"b": (np.int8(n), flag), "a": {"x": np.array(more, np.uint8)}}).tolist())
        for n, flag, more in seen
    ]
    assert made == [(*more, n, flag) for n, flag, more in seen]


BAD_KEYS = [
    (0.5, "the observation is of type float; a table needs whole numbers; give key="),
    (
        {"a": [1, {"b": np.zeros(2, np.float32)}]},
        r"the observation\['a'\]\[1\]\['b'\] is an array of float32 of ",
    ),
    ("up", "the observation is of type str"),
    (None, "the observation is of type NoneType"),
]


@pytest.mark.parametrize(("observation", "message"), BAD_KEYS, ids=[str(o) for o, _ in BAD_KEYS])
def test_what_is_no_whole_number(observation: Any, message: str) -> None:
    with pytest.raises(MDPError, match=message):
        Keys().read(observation)


def test_observations_have_to_be_made_alike() -> None:
    keys = Keys()
    keys.read({"a": 1, "b": np.zeros(3, np.int64)})
    for other, message in (
        ({"a": 1}, r"the observation\['b'\] is of type NoneType; the first one was an array"),
        (
            {"a": 0.5, "b": np.zeros(3, np.int64)},
            r"\['a'\] is of type float; the first one was a whole number",
        ),
        ({"a": 1, "b": np.zeros(3)}, r"\['b'\] is an array of float64 of shape \(3,\)"),
        ({"a": 1, "b": np.zeros(2, np.int64)}, r"of shape \(2,\); the first one was .* of shape \(3,\)"),
        (7, r"\['a'\] is of type NoneType"),
    ):
        with pytest.raises(MDPError, match=message):
            keys.read(other)
    deep: Any = 1
    for _ in range(60):
        deep = (deep,)
    with pytest.raises(MDPError, match="nested more than 50 deep"):
        Keys().read(deep)


def test_a_key_makes_whole_numbers_of_any_observation() -> None:
    env = gymnasium.make("CartPole-v1")
    settings = Settings(episodes=3)
    with pytest.raises(MDPError, match="an array of float32 .*; a table needs whole numbers; give key="):
        table_learning(env, settings=settings)
    result = table_learning(env, settings=settings, key=lambda seen: np.round(seen).astype(int))
    assert result.keys.shape[1] == 4
    assert result.predict(np.full(4, 0.1, np.float32)) in (0, 1)


@pytest.mark.parametrize(
    ("info", "message"),
    [
        (
            {"action_mask": [0]},
            "the mask enables no action after the observation 0; an agent has to choose one",
        ),
        ({"action_mask": [1, 1]}, r"a mask has shape \(2,\); \(1,\) is needed"),
    ],
)
def test_masks_that_do_not_fit(info: Any, message: str) -> None:
    with pytest.raises(MDPError, match=message):
        table_learning(Loop("limit", **info), settings=Settings(episodes=1))


def test_what_is_refused() -> None:
    with pytest.raises(MDPError, match="counterfactual steps need a model"):
        table_learning(Loop("limit"), settings=Settings(counterfactual=True))
    env = Loop("limit")
    env.action_space = Box(0, 1)
    with pytest.raises(MDPError, match="actions are Box.*; a Discrete space of actions is needed"):
        table_learning(env)

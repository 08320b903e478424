"""Finite environments of Gymnasium as models, against their tables, their steps, and known optima."""

from __future__ import annotations

from collections import defaultdict
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from processes import outcomes_of
from strategies import SEEDS
from supremal import (
    AlphabetError,
    MDPError,
    TabularMDP,
    from_text,
    product,
    reward_machine,
    safe_actions,
    value_iteration,
)
from supremal.envs import PickupDeliveryEnv, environment_model

IDS = [
    pytest.param("FrozenLake-v1", {}, id="lake"),
    pytest.param("FrozenLake-v1", {"map_name": "8x8", "success_rate": 0.7}, id="large lake"),
    pytest.param("FrozenLake-v1", {"is_slippery": False, "desc": ["SFG", "SHF"]}, id="own lake"),
    pytest.param("CliffWalking-v1", {}, id="cliff"),
    pytest.param("CliffWalking-v1", {"is_slippery": True}, id="slippery cliff"),
    pytest.param("Taxi-v4", {}, id="taxi"),
    pytest.param("Taxi-v4", {"is_rainy": True}, id="taxi in the rain"),
]
CLIFF = {"fall": {"reward": -100}}


def toy(table: Any, initial: list[float], **more: Any) -> Any:
    """An environment that is nothing but its table."""
    return SimpleNamespace(P=table, initial_state_distrib=initial, **more)


def reached(core: Any) -> set[tuple[int, bool]]:
    """The pairs (state, ended) that the table leads to, by search."""
    found = {(int(s), False) for s in np.flatnonzero(core.initial_state_distrib)}
    left = [*found]
    while left:
        s, ended = left.pop()
        for _, t, _, over in (entry for row in core.P[s].values() for entry in row if entry[0]):
            if not ended and (int(t), bool(over)) not in found:
                found.add((int(t), bool(over)))
                left.append((int(t), bool(over)))
    return found


def by_table(core: Any, s: int, a: int) -> dict[tuple[int, bool, float], float]:
    """Where a step leads, with which reward, and how likely."""
    chance: dict[tuple[int, bool, float], float] = defaultdict(float)
    for prob, t, reward, over in core.P[s].get(a, []):
        if prob:
            chance[int(t), bool(over), float(reward)] += prob
    return chance


def assert_agrees(model: TabularMDP, core: Any) -> None:
    """The model says of every state and action exactly what the table says."""
    pairs = list(zip(model.origin[:, 0].tolist(), model.terminal.tolist(), strict=True))
    assert len(set(pairs)) == len(pairs)
    assert set(pairs) == reached(core)
    for k, (s, ended) in enumerate(pairs):
        for a in range(model.n_actions):
            said = {
                (*pairs[t], reward): prob
                for t, prob, reward, word in outcomes_of(model, k, a)
                if word[0] == model.actions[a]
            }
            assert said == ({} if ended else pytest.approx(by_table(core, s, a)))
            assert len(outcomes_of(model, k, a)) == len(said)  # equal outcomes are one
        start = 0.0 if ended else core.initial_state_distrib[s]
        assert model.initial[k] == pytest.approx(start)


@pytest.mark.parametrize(("name", "options"), IDS)
def test_it_is_the_table(name: str, options: dict[str, Any]) -> None:
    env = gymnasium.make(name, **options)
    assert_agrees(environment_model(env), env.unwrapped)


@pytest.mark.parametrize(("name", "options"), IDS)
def test_what_happens_can_happen(name: str, options: dict[str, Any]) -> None:
    """Play at random; the model knows each step, and allows nothing after the last."""
    env = gymnasium.make(name, **options)
    model = environment_model(name, options=options)
    number = {
        (int(s), bool(ended)): k
        for k, (s, ended) in enumerate(zip(model.origin[:, 0], model.terminal, strict=True))
    }
    env.action_space.seed(0)
    for episode in range(20):
        observation, _ = env.reset(seed=episode)
        k, over = number[int(observation), False], False
        assert model.initial[k] > 0
        for _ in range(50):
            action = int(env.action_space.sample())
            observation, reward, over, cut, _ = env.step(action)
            after = number[int(observation), bool(over)]
            assert (after, float(reward)) in {(t, r) for t, _, r, _ in outcomes_of(model, k, action)}
            k = after
            if over or cut:
                break
        assert bool(over) == bool(model.terminal[k]) == (not model.feasible[k].any())


@pytest.mark.parametrize(
    ("name", "options", "optimum"),
    [
        pytest.param("FrozenLake-v1", {}, 0.8235, id="lake: 14 of 17 crossings succeed"),
        pytest.param("Taxi-v4", {}, 7.93, id="taxi"),
        pytest.param("CliffWalking-v1", {}, -13.0, id="cliff: 13 steps along the edge"),
        pytest.param("FrozenLake-v1", {"is_slippery": False}, 1.0, id="dry lake"),
    ],
)
def test_known_optima(name: str, options: dict[str, Any], optimum: float) -> None:
    model = environment_model(name, options=options)
    plan = value_iteration(model, gamma=1 - 1e-6)
    assert model.initial @ plan.value == pytest.approx(optimum, abs=2e-3)


def test_the_other_two_lakes_and_taxis() -> None:
    assert environment_model("FrozenLake-v1", options={"map_name": "8x8"}).n_states == 64
    assert environment_model("Taxi-v4").n_states == 404  # as its documentation says
    assert environment_model("CliffWalking-v1").n_states == 38


# --- the end belongs to the step --------------------------------------------------------------------------


def test_a_state_entered_both_ways_becomes_two() -> None:
    """In Taxi, a passenger at the destination ends the episode only when dropped off there."""
    env = gymnasium.make("Taxi-v4")
    core = env.unwrapped
    waiting = core.encode(0, 0, 1, 1)  # waits at green, wants to be there
    core.initial_state_distrib = np.eye(500)[waiting]
    model = environment_model(env)
    assert_agrees(model, core)
    delivered = core.encode(0, 4, 1, 1)
    at, over = np.flatnonzero(model.origin[:, 0] == delivered)
    assert model.terminal[[at, over]].tolist() == [False, True]
    assert (model.marked == model.terminal).all()
    stay = model.actions.index("north")
    assert outcomes_of(model, int(at), stay) == [(at, 1.0, -1.0, ("north",))]


@st.composite
def tables(draw: st.DrawFn) -> Any:
    """Small random tables: double entries, entries of no probability, missing actions, either ending."""
    rng = np.random.default_rng(draw(SEEDS))
    states = int(rng.integers(1, 5))
    table: dict[int, dict[int, list[Any]]] = {s: {} for s in range(states)}
    for s in range(states):
        for a in range(2):
            if rng.random() < 0.8 or (s, a) == (0, 1):
                count = int(rng.integers(1, 5))
                chance = [*rng.dirichlet(np.ones(count)), 0.0]
                table[s][a] = [
                    (p, int(rng.integers(states)), int(rng.integers(2)), bool(rng.random() < 0.3))
                    for p in chance
                ]
    return toy(table, rng.dirichlet(np.ones(states)))


@given(tables())
def test_any_table(core: Any) -> None:
    model = environment_model(core)
    assert_agrees(model, core)
    assert model.actions == ("action_0", "action_1")
    ends = [(r, int(t)) for row in core.P.values() for x in row.values() for p, t, r, over in x if over and p]
    goals = {t for reward, t in ends if reward == max(ends)[0]}
    for s, ended, marked in zip(model.origin[:, 0], model.terminal, model.marked, strict=True):
        assert marked == (ended and s in goals)


def test_lists_do_for_tables_and_thirds_may_be_rounded() -> None:
    model = environment_model(toy([[[(0.3333333, 0, 0, False), (0.6666666, 1, 1.0, True)]], []], [1, 0]))
    assert model.prob.sum() == pytest.approx(1, abs=1e-15)
    assert model.terminal.tolist() == [False, True]


# --- names, events, labels --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "moves"),
    [
        ("FrozenLake-v1", {"left": (0, -1), "down": (1, 0), "right": (0, 1), "up": (-1, 0)}),
        ("CliffWalking-v1", {"up": (-1, 0), "right": (0, 1), "down": (1, 0), "left": (0, -1)}),
        ("Taxi-v4", {"south": (1, 0), "north": (-1, 0), "east": (0, 1), "west": (0, -1)}),
    ],
)
def test_actions_do_what_they_are_called(name: str, moves: dict[str, tuple[int, int]]) -> None:
    options = {"is_slippery": False} if name == "FrozenLake-v1" else {}
    model = environment_model(name, options=options)
    if name == "Taxi-v4":
        row, column, *_ = np.unravel_index(model.origin[:, 0], (5, 5, 5, 4))
    else:
        row, column = np.divmod(model.origin[:, 0], 4 if name == "FrozenLake-v1" else 12)
    for action, move in moves.items():
        seen = set()
        for k in range(model.n_states):
            for t, _, reward, word in outcomes_of(model, k, model.actions.index(action)):
                assert word == (action,)
                if reward > -100:
                    seen.add((int(row[t] - row[k]), int(column[t] - column[k])))
        assert seen == {(0, 0), move}
    assert model.actions[: len(moves)] == tuple(moves)


def test_taxi_events() -> None:
    model = environment_model(
        "Taxi-v4",
        events={"refused": {"reward": -10}, "boarded": {"passenger": "taxi"}},
        labels={"aboard": {"passenger": 4}, "home": {"row": 0, "column": [0, 4]}},
    )
    assert model.actions[4:] == ("pickup", "dropoff")
    assert model.alphabet.uncontrollable == {"refused", "boarded"}
    row, column, passenger, _ = np.unravel_index(model.origin[:, 0], (5, 5, 5, 4))
    assert np.array_equal(model.label & 1, passenger == 4)
    assert np.array_equal(model.label >> 1, (row == 0) & ((column == 0) | (column == 4)))
    for k in range(model.n_states):
        for a in range(model.n_actions):
            for t, _, reward, word in outcomes_of(model, k, a):
                happens = {"refused": reward == -10, "boarded": passenger[t] == 4}
                assert word == (model.actions[a], *(name for name, holds in happens.items() if holds))


def test_the_fall_is_a_step_and_no_state() -> None:
    model = environment_model("CliffWalking-v1", events=CLIFF)
    falls = [
        (k, model.spell(int(model.word[o])))
        for k in range(38)
        for o in _of(model, k)
        if model.reward[o] == -100
    ]
    assert {word for _, word in falls} == {("down", "fall"), ("right", "fall")}
    assert len(falls) == 11
    nowhere = environment_model("CliffWalking-v1", events={"fall": {"tile": "C"}})
    assert sorted(nowhere.words) == [(0,), (1,), (2,), (3,)]


def _of(model: TabularMDP, k: int) -> range:
    return range(*model.row[[k * model.n_actions, (k + 1) * model.n_actions]])


@pytest.mark.parametrize(
    "condition", [[5, 7, 11, 12], {"tile": "H"}, lambda s: s in {5, 7, 11, 12}, np.array([5, 7, 11, 12])]
)
def test_three_ways_to_say_where(condition: Any) -> None:
    model = environment_model(
        "FrozenLake-v1", labels={"hole": condition}, events={"splash": condition}, marked=condition
    )
    hole = np.isin(model.origin[:, 0], [5, 7, 11, 12])
    assert np.array_equal(model.label, hole)
    assert np.array_equal(model.marked, hole)
    splash = np.array(["splash" in model.spell(int(w)) for w in model.word])
    assert np.array_equal(splash, hole[model.next_state])


def test_marked_is_the_goal_whatever_it_earns() -> None:
    model = environment_model("FrozenLake-v1", options={"reward_schedule": (-1, 0, 0)})
    assert model.origin[model.marked, 0].tolist() == [15]


def test_names_and_factors_of_ones_own() -> None:
    core = toy([[[(1.0, 1, 0, False)]], [[(1.0, 0, 0, True)]]], [1, 0])
    model = environment_model(
        core, actions=["go"], factors=lambda s: {"side": "ab"[s]}, labels={"there": {"side": "b"}}
    )
    assert (model.actions, model.label.tolist()) == (("go",), [0, 0, 1])
    assert model.origin[:, 0].tolist() == [0, 0, 1]


def test_rules_and_machines_apply() -> None:
    """The taxi may not be refused; the machine counts boardings."""
    model = environment_model(
        "Taxi-v4", events={"refused": {"reward": -10}}, labels={"aboard": {"passenger": "taxi"}}
    )
    rule = from_text(
        "\n".join(["name polite", "marked ok", *(f"ok -{a}-> ok" for a in model.actions)]),
        alphabet=model.alphabet,
    )
    machine = reward_machine(["aboard"], [("0", "aboard", "1", 1.0)])
    joint = product(model, [rule], machine)
    enabled = safe_actions(joint)
    plan = value_iteration(joint, gamma=0.99, enabled=enabled)
    assert (plan.value[joint.initial > 0] > 0.8).all()
    assert not any(
        "refused" in joint.spell(int(joint.word[o]))
        for k in np.flatnonzero(enabled.any(axis=1))
        for a in np.flatnonzero(enabled[k])
        for o in range(*joint.outcomes(int(k), int(a)).indices(len(joint.word)))
    )


def test_an_environment_with_a_model_of_its_own() -> None:
    env = gymnasium.make("supremal/PickupDelivery-v0", preset="published")
    core = env.unwrapped
    assert isinstance(core, PickupDeliveryEnv)
    model = environment_model(env)
    assert model.origin.shape[1] == 2
    number = {tuple(pair): k for k, pair in enumerate(model.origin.tolist())}
    env.action_space.seed(1)
    for seed in range(5):
        observation, info = env.reset(seed=seed)
        k = number[info["state"], int(observation[-1])]
        for _ in range(60):
            action = int(env.action_space.sample(info["action_mask"]))
            observation, reward, over, cut, info = env.step(action)
            after = number[info["state"], int(observation[-1])]
            known = {(t, r, word) for t, _, r, word in outcomes_of(model, k, action)}
            assert (after, reward, info["events"]) in known
            k = after
            if over or cut:
                break


# --- what cannot be read ----------------------------------------------------------------------------------

LAKE = "FrozenLake-v1"


@pytest.mark.parametrize(
    ("env", "given", "says"),
    [
        ("FrozenLak-v1", {}, "unknown environment 'FrozenLak-v1'; did you mean 'FrozenLake-v1'?"),
        ("Nothing", {}, "unknown environment 'Nothing'; known: supremal/PickupDelivery-v0, FrozenLake-v1"),
        ("no.such.module:Lake-v1", {}, "'no.such.module:Lake-v1' cannot be made: ModuleNotFoundError"),
        (LAKE, {"options": {"is_slipery": True}}, "unknown option 'is_slipery'; did you mean 'is_slippery'?"),
        (LAKE, {"options": {"map_name": "9x9"}}, "cannot be made: KeyError: '9x9'"),
        ("Blackjack-v1", {}, "BlackjackEnv is no finite model: a table P[state][action] and initial_state"),
        ("Taxi-v4", {"options": {"fickle_passenger": True}}, "kept out of the state"),
        (PickupDeliveryEnv(), {"options": {}}, "options are for an environment that is given by its id"),
        (
            PickupDeliveryEnv(),
            {"labels": {}, "marked": []},
            "has a model of its own; leave out labels, marked",
        ),
        (
            SimpleNamespace(model=lambda: 3),
            {},
            "model() of SimpleNamespace gives a int; a TabularMDP is needed",
        ),
        (3, {}, "int is no finite model"),
        (toy(None, [1]), {}, "P is not as in Gymnasium's toy texts: P[state][action] lists (probability"),
        (toy({}, [1]), {}, "P is not as in"),
        (toy({0: {1: [(1.0, 0, 0)]}}, [1]), {}, "P[0][1] is not as in"),
        (toy({0: {1: [("much", 0, 0, True)]}}, [1]), {}, "P[0][1] is not as in"),
        (toy({0: {1: [(1.0, 0.5, 0, True)]}}, [1]), {}, "P[0][1] is not as in"),
        (toy({0: {1: [(1.0, -1, 0, True)]}}, [1]), {}, "P[0][1] is not as in"),
        (toy({0: {1: [(1.5, 0, 0, True)]}}, [1]), {}, "P[0][1] is not as in"),
        (toy({0: {1: [(1.0, 0, np.nan, True)]}}, [1]), {}, "P[0][1] is not as in"),
        (toy({0: {1: [(0.9, 0, 0, True)]}}, [1]), {}, "P[0][1]: the probabilities sum to 0.9; 1 is needed"),
        (toy({0: {0: [(1.0, 1, 0, True)]}}, [1]), {}, "initial_state_distrib has 1 entries; P has 2 states"),
        (toy({0: {0: [(1.0, 0, 0, True)]}}, "all"), {}, "initial_state_distrib is 'all'; a probability for"),
        (toy({0: {0: [(1.0, 0, 0, True)]}}, [2]), {}, "initial_state_distrib sums to 2; probabilities"),
        (LAKE, {"actions": ["a"]}, "actions names 1; the environment has 4"),
        (
            LAKE,
            {"labels": {"goal": {"title": "G"}}},
            "label 'goal' names the unknown factor 'title'; did you",
        ),
        (LAKE, {"labels": {"goal": {"tile": "X"}}}, "label 'goal': tile is never 'X'; known: S, F, H, G"),
        (LAKE, {"labels": {"goal": {"tile": {}}}}, "label 'goal': tile is never {}; known: S, F, H, G"),
        (LAKE, {"labels": {"goal": {"row": [0, 4]}}}, "label 'goal': row is never 4; known: 0, 1, 2, 3"),
        (LAKE, {"labels": {"goal": [16]}}, "label 'goal' names state 16; 0 to 15 are known"),
        (LAKE, {"labels": {"goal": "G"}}, "label 'goal' is 'G'; state numbers, a mapping of factors or a"),
        (LAKE, {"labels": {"goal": 15}}, "label 'goal' is 15; state numbers, a mapping of factors or a"),
        (LAKE, {"labels": {"paid": {"reward": 1}}}, "label 'paid' names the unknown factor 'reward'"),
        (LAKE, {"events": {"paid": {"reward": "1"}}}, "event 'paid': reward '1' is no number"),
        (LAKE, {"marked": {"tile": "g"}}, "marked: tile is never 'g'"),
        (
            "Taxi-v4",
            {"marked": {"passenger": "gren"}},
            "marked: passenger is never 'gren'; did you mean 'green'?",
        ),
        (
            toy({0: {0: [(1.0, 0, 0, True)]}}, [1]),
            {"marked": {"x": 1}},
            "the environment has none; give factors=",
        ),
        (LAKE, {"factors": lambda s: {"a": s} if s else {}}, "factors tells ['a'] of state 1, [] of state 0"),
        (
            LAKE,
            {"factors": lambda s: {"a": [s]}},
            "factor 'a' of state 0 is [0]; a number or a name is needed",
        ),
        (LAKE, {"events": {f"e{k}": [] for k in range(31)}}, "31 events; at most 30 can be told apart"),
    ],
)
def test_bad_models(env: Any, given: dict[str, Any], says: str) -> None:
    with pytest.raises(MDPError) as error:
        environment_model(env, **given)
    assert says in str(error.value)


def test_an_event_is_no_action() -> None:
    with pytest.raises(AlphabetError, match="event 'up' stands twice"):
        environment_model(LAKE, events={"up": [0]})

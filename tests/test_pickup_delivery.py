"""The pick-up and delivery grid: against the paper's words, and the three forms of it against each other.

The reference here is written from the text, on states in words and with the walls as pairs of cells; the
step by step core, the table and the environment all have to agree with it.
"""

import copy
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from supremal import (
    MDPError,
    RuleError,
    complete_safe,
    complete_unsafe,
    mark_all,
    reward_machine,
    rule_from_safe,
    rule_from_unsafe,
)
from supremal.envs import (
    GridState,
    PickupDelivery,
    PickupDeliveryEnv,
    data_file,
    decode,
    describe,
    draw,
    encode,
    pixels,
    register,
    state_numbers,
)
from supremal.formats import read_automaton, read_reward_machine

PRESETS = ("default", "published")
ALL = ("carried", "carried", "carried")
HOME = ("home", "home", "home")
STEP = {"up": (0, 1), "right": (1, 0), "down": (0, -1), "left": (-1, 0)}
TURN = {"l": dict(zip(STEP, ("left", "up", "right", "down"), strict=True))}
TURN["r"] = {after: before for before, after in TURN["l"].items()}
BACK = {"up": "down", "down": "up", "left": "right", "right": "left"}
HOMES = {1: (0, 6), 2: (8, 6), 3: (6, 3)}
WALLS = [  # the sides of the five pockets, as the pairs of cells that they part
    *[((2, y), (3, y)) for y in (0, 1)],
    *[((3, y), (4, y)) for y in (0, 1)],
    *[((x, 2), (x, 3)) for x in (0, 1)],
    *[((x, 3), (x, 4)) for x in (0, 1)],
    *[((2, y), (3, y)) for y in (5, 6)],
    *[((3, y), (4, y)) for y in (5, 6)],
    *[((5, 2), (5, 3)), ((5, 3), (5, 4)), ((5, 3), (6, 3))],
    *[((7, 2), (7, 3)), ((7, 3), (7, 4)), ((6, 3), (7, 3))],
]


# --- the reference ------------------------------------------------------------------------------------------


def moved(x, y, heading, move):
    facing = TURN.get(move, {}).get(heading, heading)
    step = STEP[BACK[facing] if move == "b" else facing]
    to = x + step[0], y + step[1]
    inside = 0 <= to[0] < 9 and 0 <= to[1] < 7
    blocked = any({(x, y), to} == set(pair) for pair in WALLS)
    return (*to, facing) if inside and not blocked else None


def changed(items, k, place):
    return tuple(place if i == k else old for i, old in enumerate(items, 1))


def picked(state, k):
    items = changed(state.items, k, "carried")
    return state._replace(
        items=items, drop=state.drop if "dropped" in items else None, fresh=all(i == "carried" for i in items)
    )


def lies(state, k):
    return {"home": HOMES[k], "dropped": state.drop, "carried": None}[state.items[k - 1]]


def is_over(state, preset):
    if (state.x, state.y) == (6, 0) and state.items == ALL:
        return True
    carried = [k for k in (1, 2, 3) if state.items[k - 1] == "carried"]
    return preset == "published" and state.drop is None and carried not in ([], [1], [1, 2], [1, 2, 3])


def reference(state, action, risk, preset):
    """What may follow ``action``: {(state, word): probability}."""
    here = state.x, state.y
    if is_over(state, preset):
        return {}
    if preset == "published" and state.drop:
        stages = {(1,): "d2", (1, 2): "d3", (1, 2, 3): "p1", (2, 3): "p2", (3,): "p3"}
        event = stages[tuple(k for k in (1, 2, 3) if state.items[k - 1] == "dropped")]
        k = int(event[1])
        after = (
            picked(state, k) if event[0] == "p" else state._replace(items=changed(state.items, k, "dropped"))
        )
        return {(after, (event,)): 1.0}
    word = (action,)
    if action in "lrfb":
        to = moved(*state[:3], action)
        if to is None:
            return {}
        after = GridState(*to, state.items, state.drop, fresh=False)
        for k in (1, 2, 3) if preset == "published" else ():
            if lies(after, k) == to[:2]:
                after, word = picked(after, k), (action, f"p{k}")
    else:
        k = int(action[1])
        if action[0] == "p" and lies(state, k) == here:
            after = picked(state, k)
        elif action[0] == "d" and state.drop == here and state.items[k - 1] == "carried":
            after = state._replace(items=changed(state.items, k, "dropped"))
        else:
            return {}
    if state.items != ALL or state.fresh:
        return {(after, word): 1.0}
    fallen = state._replace(items=("dropped", "carried", "carried"), drop=here)
    answers = {(after, word): 1 - risk, (fallen, ("d_u",)): risk}
    return {answer: p for answer, p in answers.items() if p}


def answers(grid, state, action):
    return {(decode(code), word): prob for code, prob, word in grid.outcomes(encode(state), action)}


def sample(mdp, size=2000):
    """Some states of ``mdp``, with all near the start and all where an episode ends."""
    drawn = np.random.default_rng(5).integers(mdp.n_states, size=size)
    return sorted({*range(300), *drawn.tolist(), *np.flatnonzero(mdp.terminal).tolist()})


# --- the core against the reference -------------------------------------------------------------------------


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("risk", [0, 0.3, 1])
def test_core_and_table_are_what_the_text_says(preset, risk):
    grid = PickupDelivery(risk, preset)
    mdp = grid.model()
    numbers = state_numbers(mdp)
    for s in sample(mdp):
        code = int(mdp.origin[s, 0])
        state = decode(code)
        assert mdp.terminal[s] == grid.is_terminal(code) == is_over(state, preset)
        complete = state.items == ALL and state[:2] == (6, 0)
        assert mdp.marked[s] == grid.is_marked(code) == complete
        label = sum(1 << k for k in range(3) if state.items[k] == "carried") | (state[:2] == (6, 0)) << 3
        assert mdp.label[s] == grid.label(code) == label
        for a, action in enumerate(grid.actions):
            expected = reference(state, action, risk, preset)
            assert answers(grid, state, a) == pytest.approx(expected)
            table = {}
            for o in range(*mdp.outcomes(s, a).indices(len(mdp.prob))):
                to = int(mdp.origin[mdp.next_state[o], 0])
                assert numbers[to] == mdp.next_state[o]
                table[decode(to), mdp.spell(mdp.word[o])] = float(mdp.prob[o])
            assert table == pytest.approx(expected)


@pytest.mark.parametrize("preset", PRESETS)
def test_table_frame(preset):
    grid = PickupDelivery(preset=preset)
    mdp = grid.model()
    assert mdp.actions == grid.actions
    assert mdp.alphabet.names == ("l", "r", "f", "b", "p1", "p2", "p3", "d1", "d2", "d3", "d_u")
    assert mdp.alphabet.uncontrollable == {"d_u"}
    assert mdp.propositions == ("i1", "i2", "i3", "S")
    assert not mdp.reward.any()
    assert mdp.initial[0] == 1
    assert mdp.origin[0, 0] == grid.start == encode(GridState(6, 0, "up"))
    assert mdp.feasible.any(axis=1).tolist() == (~mdp.terminal).tolist()
    assert (grid.feasible[mdp.origin[:, 0]] == mdp.feasible).all()
    assert len(set(mdp.words)) == len(mdp.words)
    assert set(range(len(mdp.words))) == set(mdp.word.tolist())


def test_actions():
    assert PickupDelivery().actions == ("l", "r", "f", "b", "p1", "p2", "p3", "d1", "d2", "d3")
    assert PickupDelivery(preset="published").actions == ("l", "r", "f", "b")


@pytest.mark.parametrize(
    ("preset", "risk", "states", "ends"),
    [("default", 0.5, 102_772, 4), ("default", 0, 1_866, 4), ("published", 0.5, 2_286, 12)],
)
def test_number_of_states(preset, risk, states, ends):
    mdp = PickupDelivery(risk, preset).model()
    assert mdp.n_states == states
    assert mdp.terminal.sum() == ends
    assert mdp.marked.sum() == 4  # S, facing each way


# --- moves --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "action", "end"),
    [
        ((4, 3, "up"), "l", (3, 3, "left")),  # the paper's four
        ((4, 3, "up"), "r", (5, 3, "right")),
        ((4, 3, "up"), "f", (4, 4, "up")),
        ((4, 3, "up"), "b", (4, 2, "up")),
        ((4, 4, "left"), "l", (4, 3, "down")),
        ((4, 4, "left"), "r", (4, 5, "up")),
        ((4, 4, "down"), "l", (5, 4, "right")),
        ((4, 4, "down"), "r", (3, 4, "left")),
        ((4, 4, "right"), "b", (3, 4, "right")),
        ((0, 0, "up"), "l", None),  # the border
        ((0, 0, "up"), "b", None),
        ((8, 6, "right"), "f", None),
        ((8, 6, "right"), "l", None),
        ((3, 2, "down"), "f", (3, 1, "down")),  # the pockets, each open on one side
        ((3, 1, "down"), "l", None),
        ((3, 1, "down"), "r", None),
        ((2, 0, "right"), "f", None),
        ((4, 1, "left"), "f", None),
        ((2, 3, "left"), "f", (1, 3, "left")),
        ((1, 3, "left"), "r", None),
        ((1, 2, "up"), "f", None),
        ((2, 2, "up"), "f", (2, 3, "up")),
        ((3, 4, "up"), "f", (3, 5, "up")),
        ((3, 6, "up"), "l", None),
        ((4, 5, "left"), "f", None),
        ((4, 3, "right"), "f", (5, 3, "right")),
        ((5, 3, "right"), "f", None),
        ((5, 3, "right"), "l", None),
        ((5, 4, "down"), "f", None),
        ((8, 3, "left"), "f", (7, 3, "left")),
        ((7, 3, "left"), "f", None),
        ((7, 2, "up"), "f", None),
        ((6, 4, "down"), "f", (6, 3, "down")),  # item 3, between two pockets
        ((6, 3, "down"), "r", None),
        ((6, 3, "down"), "l", None),
        ((6, 3, "down"), "f", (6, 2, "down")),
    ],
)
def test_move(start, action, end):
    grid = PickupDelivery()
    expected = {} if end is None else {(GridState(*end), (action,)): 1.0}
    assert answers(grid, GridState(*start), grid.actions.index(action)) == expected


def test_every_wall_stops_from_both_sides():
    blocked = set()
    for x in range(9):
        for y in range(7):
            for heading, (right, up) in STEP.items():
                to = x + right, y + up
                if (
                    0 <= to[0] < 9
                    and 0 <= to[1] < 7
                    and not PickupDelivery().outcomes(encode(GridState(x, y, heading)), 2)
                ):
                    blocked.add(((x, y), to))
    assert blocked == {*WALLS, *((b, a) for a, b in WALLS)}


# --- drops --------------------------------------------------------------------------------------------------


def follow(grid, state, *words):
    """Take the outcomes with these words, by whatever action; return the states on the way."""
    for word in words:
        found = {
            after
            for a in range(len(grid.actions))
            for (after, said), _ in answers(grid, state, a).items()
            if said == tuple(word.split())
        }
        (state,) = found
        yield state


def test_drop_and_recovery():
    before = GridState(6, 2, "down", ALL)
    grid = PickupDelivery()
    assert answers(grid, before, 2) == {
        (GridState(6, 1, "down", ALL), ("f",)): 0.5,
        (GridState(6, 2, "down", ("dropped", "carried", "carried"), (6, 2)), ("d_u",)): 0.5,
    }
    *_, two, three, one, again = follow(grid, before, "d_u", "d2", "d3", "p1", "p2", "p3")
    assert two.items == ("dropped", "dropped", "dropped")
    assert three.items == ("carried", "dropped", "dropped")
    assert one == GridState(6, 2, "down", ("carried", "carried", "dropped"), (6, 2))
    assert again == GridState(6, 2, "down", ALL, fresh=True)
    assert answers(grid, again, 2) == {(GridState(6, 1, "down", ALL), ("f",)): 1.0}


def test_recovery_in_another_order_and_elsewhere_is_possible():
    grid = PickupDelivery()
    (fallen,) = follow(grid, GridState(6, 2, "down", ALL), "d_u")
    (again,) = follow(grid, fallen, "p1")
    assert again == GridState(6, 2, "down", ALL, fresh=True)
    away, _ = follow(grid, fallen, "f", "b")
    feasible = grid.feasible[encode(away)]
    assert [grid.actions[a] for a in np.flatnonzero(feasible)] == ["l", "r", "f", "b"]


def test_first_collection_is_fresh_too():
    grid = PickupDelivery()
    held = GridState(6, 3, "down", ("carried", "carried", "home"))
    (fresh,) = follow(grid, held, "p3")
    assert fresh == GridState(6, 3, "down", ALL, fresh=True)
    assert answers(grid, fresh, 2) == {(GridState(6, 2, "down", ALL), ("f",)): 1.0}


def test_putting_down_needs_a_drop_beside_it():
    grid = PickupDelivery()
    assert not grid.feasible[encode(GridState(4, 4, "up", ALL)), 7:].any()
    assert not grid.feasible[encode(GridState(4, 4, "up", ("carried", "home", "home"))), 7:].any()


@pytest.mark.parametrize(("risk", "words"), [(0, {("f",)}), (1, {("d_u",)})])
def test_certain_probabilities_leave_one_outcome(risk, words):
    grid = PickupDelivery(risk)
    assert {word for _, _, word in grid.outcomes(encode(GridState(4, 4, "up", ALL)), 2)} == words


def test_arriving_at_s_with_all_ends_it():
    grid = PickupDelivery()
    ((end, _),) = answers(grid, GridState(6, 1, "down", ALL, fresh=True), 2)
    assert end == GridState(6, 0, "down", ALL)
    assert grid.is_terminal(encode(end))
    assert all(not grid.outcomes(encode(end), a) for a in range(10))


# --- the published program ----------------------------------------------------------------------------------


def test_published_picks_up_on_arrival():
    grid = PickupDelivery(preset="published")
    assert answers(grid, GridState(0, 5, "up"), 2) == {
        (GridState(0, 6, "up", ("carried", "home", "home")), ("f", "p1")): 1.0
    }
    held = ("carried", "carried", "home")
    assert answers(grid, GridState(6, 4, "down", held), 2) == {
        (GridState(6, 3, "down", ALL, fresh=True), ("f", "p3")): 1.0
    }


def test_published_ends_where_the_order_is_broken():
    grid = PickupDelivery(preset="published")
    (end,) = follow(grid, GridState(8, 5, "up"), "f p2")
    assert end.items == ("home", "carried", "home")
    assert grid.is_terminal(encode(end))
    assert not grid.is_marked(encode(end))


def test_published_recovers_by_itself():
    grid = PickupDelivery(preset="published")
    (state,) = follow(grid, GridState(6, 2, "down", ALL), "d_u")
    for event in ("d2", "d3", "p1", "p2", "p3"):
        every = [answers(grid, state, a) for a in range(4)]
        assert all(one == every[0] for one in every)
        ((state, word),) = every[0]
        assert word == (event,)
    assert state == GridState(6, 2, "down", ALL, fresh=True)


# --- states in words ----------------------------------------------------------------------------------------


def test_every_code_has_one_state():
    codes = range(0, 113_400, 7)
    assert [encode(decode(code)) for code in codes] == list(codes)
    assert len({decode(code) for code in codes}) == len(codes)


@pytest.mark.parametrize(
    "state",
    [
        GridState(9, 0, "up"),
        GridState(0, -1, "up"),
        GridState(0, 0, "north"),
        GridState(0, 0, "up", ("home", "home", "lost")),
        GridState(0, 0, "up", ("dropped", "home", "home"), (0, 0)),
        GridState(0, 0, "up", ("dropped", "carried", "carried")),
        GridState(0, 0, "up", HOME, (0, 0)),
        GridState(0, 0, "up", HOME, fresh=True),
        GridState(0, 0, "up", ("dropped", "carried", "carried"), (9, 0)),
    ],
)
def test_no_such_state(state):
    with pytest.raises(MDPError, match="the grid has no state"):
        encode(state)


def test_numbers_out_of_range():
    grid = PickupDelivery()
    for code in (-1, 113_400):
        with pytest.raises(MDPError, match="0 to 113399 are known"):
            decode(code)
        with pytest.raises(MDPError, match="0 to 113399 are known"):
            grid.outcomes(code, 0)
    for action in (-1, 10):
        with pytest.raises(MDPError, match="0 to 9 are known"):
            grid.outcomes(grid.start, action)


@pytest.mark.parametrize("risk", [-0.1, 1.1, float("nan")])
def test_settings_are_checked(risk):
    with pytest.raises(MDPError, match="drop_probability is"):
        PickupDelivery(risk)
    with pytest.raises(MDPError, match="unknown preset 'publshed'; did you mean 'published'"):
        PickupDelivery(preset="publshed")


def test_description():
    assert describe(encode(GridState(6, 3, "down", ALL, fresh=True))) == (
        "at (6, 3) facing down; carries 1, 2, 3, just collected"
    )


# --- the paper's figures ------------------------------------------------------------------------------------


def arrows(automaton):
    return {
        (automaton.state_name(s), event, automaton.state_name(int(t)))
        for s, row in enumerate(automaton.delta)
        for event, t in zip(automaton.alphabet, row, strict=True)
        if t >= 0
    }


def test_figure_of_h():
    figure = complete_unsafe(read_automaton(data_file("no_u_turn.json")))
    assert set(figure.alphabet) == set("lrfb")
    assert arrows(figure) == {
        *[("0", e, "0") for e in "fb"],
        ("0", "r", "1"),
        ("0", "l", "2"),
        ("1", "r", "s_a"),
        ("2", "l", "s_a"),
        ("1", "l", "2"),
        ("2", "r", "1"),
        *[("1", e, "0") for e in "fb"],
        *[("2", e, "0") for e in "fb"],
        *[("s_a", e, "s_a") for e in "lrfb"],
    }
    assert figure.state_name(0) == "0"
    assert [figure.state_name(s) for s in np.flatnonzero(figure.marked)] == ["s_a"]


def test_rule_of_no_u_turn():
    rule = rule_from_unsafe(read_automaton(data_file("no_u_turn.json")))
    assert (rule.n_states, rule.n_transitions) == (3, 10)
    assert rule.run("lrfbr") >= 0
    assert rule.run("lrfbrr") == rule.run("ll") == -1


def test_figure_of_g_s():
    safe = read_automaton(data_file("recovery.json"))
    figure = complete_safe(safe)
    sigma = ["l", "r", "f", "b", "p1", "p2", "p3", "d1", "d2", "d3", "d_u"]
    assert list(figure.alphabet) == sigma
    assert figure.alphabet.uncontrollable == {"d_u"}
    chain = {
        "w1": ("d2", "w2"),
        "w2": ("d3", "w3"),
        "w3": ("p1", "w4"),
        "w4": ("p2", "w5"),
        "w5": ("p3", "w0"),
    }
    assert arrows(figure) == {
        *[("w0", e, "w0") for e in sigma if e != "d_u"],
        ("w0", "d_u", "w1"),
        *[(w, e, to if e == event else "s_a") for w, (event, to) in chain.items() for e in sigma],
        *[("s_a", e, "s_a") for e in sigma],
    }
    assert figure.state_name(0) == "w0"
    assert [figure.state_name(s) for s in np.flatnonzero(figure.marked)] == ["s_a"]
    assert arrows(rule_from_safe(safe)) == arrows(mark_all(safe))


@pytest.mark.parametrize(("preset", "broken"), [("default", -20), ("published", -1020)])
def test_figure_of_the_reward_machine(preset, broken):
    machine = PickupDelivery(preset=preset).reward_machine()
    assert machine.states[0] == "u0"
    number = {name: u for u, name in enumerate(machine.states)}
    sets = {f"{a}{b}{c}": (a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)}

    def step(state, carried, *, at_s=False):
        true = [f"i{k + 1}" for k in range(3) if sets[carried][k]] + ["S"] * at_s
        after, reward = machine.step(number[state], true)
        return machine.states[after], reward

    assert step("u0", "000") == step("u0", "000", at_s=True) == ("u0", -10)
    assert step("u0", "010") == step("u0", "001") == ("u1", broken)
    assert step("u0", "100") == step("u2", "100") == ("u2", -8)
    assert step("u2", "101") == ("u1", broken)
    assert step("u2", "110") == step("u3", "110") == ("u3", -6)
    assert step("u3", "111") == step("u4", "111") == ("u4", -1)
    assert step("u4", "011") == step("u4", "000") == ("u4", -1)  # a drop is being put right
    assert step("u4", "111", at_s=True) == ("u5", 0)
    assert all(step("u1", carried) == ("u1", -20) for carried in sets)
    assert all(step("u5", carried) == ("u5", 0) for carried in sets)


def test_data_files_are_read_by_name():
    assert read_reward_machine(data_file("reward_machine.json")).name == "R"


# --- the environment ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("render_mode", [None, "ansi", "rgb_array"])
def test_gymnasium_accepts_it(preset, render_mode):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make("supremal/PickupDelivery-v0", preset=preset, render_mode=render_mode)
        check_env(env.unwrapped)
    assert env.spec.max_episode_steps == 60


def test_registering_again_changes_nothing():
    spec = gymnasium.spec("supremal/PickupDelivery-v0")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        register()
        register()
    assert gymnasium.spec("supremal/PickupDelivery-v0") is spec


@pytest.mark.parametrize(
    "script",
    [
        "import gymnasium; gymnasium.make('supremal.envs:supremal/PickupDelivery-v0').reset()",
        "import gymnasium, supremal.envs; gymnasium.make('supremal/PickupDelivery-v0').reset()",
        "import supremal.envs, gymnasium; gymnasium.make('supremal/PickupDelivery-v0').reset()",
        "import supremal, supremal.formats, sys; assert 'gymnasium' not in sys.modules",
    ],
)
def test_in_a_new_process(script):
    subprocess.run([sys.executable, "-W", "error", "-c", script], check=True)


@pytest.mark.parametrize("preset", PRESETS)
def test_environment_walks_within_the_table(preset):
    grid = PickupDelivery(preset=preset)
    mdp = grid.model()
    numbers, feasible = state_numbers(mdp), mdp.feasible
    env = PickupDeliveryEnv(preset=preset)
    rng = np.random.default_rng(11)
    risky = fell = 0
    for episode in range(150):
        observation, info = env.reset(seed=3 if episode == 0 else None)
        if episode % 2:  # random walks rarely collect all three
            env._state = encode(GridState(4, 3, "up", ALL))
            info = env._info(())
        terminated, steps = False, 0
        while not terminated and steps < 80:
            s = numbers[info["state"]]
            assert (info["action_mask"] == feasible[s]).all()
            action = rng.choice(np.flatnonzero(info["action_mask"]))
            before = decode(info["state"])
            observation, _, terminated, truncated, info = env.step(action)
            rows = mdp.outcomes(int(s), int(action))
            found = [
                float(mdp.prob[o])
                for o in range(rows.start, rows.stop)
                if mdp.next_state[o] == numbers[info["state"]] and mdp.spell(mdp.word[o]) == info["events"]
            ]
            assert len(found) == 1
            assert found[0] > 0
            risky += before.items == ALL and not before.fresh
            fell += info["events"] == ("d_u",)
            assert observation in env.observation_space
            assert terminated == mdp.terminal[numbers[info["state"]]]
            assert truncated is False
            true = [name for i, name in enumerate(mdp.propositions) if grid.label(info["state"]) >> i & 1]
            assert info["labels"] == tuple(true)
            steps += 1
    assert risky > 150
    assert abs(fell - risky / 2) < 4 * np.sqrt(risky / 4)


def shortest(env, goal):
    """Return the fewest moves to ``goal`` from where the environment is, by breadth-first search."""
    ways, seen = [(env._state, ())], {env._state}
    for code, way in ways:
        if decode(code)[:2] == goal:
            return way
        for a in range(4):
            for after, _, _ in env.grid.outcomes(code, a)[:1]:
                if after not in seen:
                    seen.add(after)
                    ways.append((after, (*way, a)))
    return None


def test_whole_round_without_drops():
    env = PickupDeliveryEnv(drop_probability=0)
    env.reset(seed=0)
    total, epochs = 0.0, 0
    for item in (1, 2, 3, 0):
        actions = shortest(env, HOMES.get(item, (6, 0)))
        for action in (*actions, env.grid.actions.index(f"p{item}")) if item else actions:
            _, reward, ended, _, info = env.step(action)
            total, epochs = total + reward, epochs + 1
        assert ended == (item == 0)
    assert info["labels"] == ("i1", "i2", "i3", "S")
    assert epochs == (12 + 1) + (12 + 1) + (5 + 1) + 3  # the walls make 8 into 12
    assert total == 12 * -10 + (1 + 12) * -8 + (1 + 5) * -6 + (1 + 2) * -1


def test_published_penalty_ends_the_episode():
    env = PickupDeliveryEnv(preset="published")
    env.reset(seed=0)
    rewards = []
    for action in shortest(env, HOMES[3]):
        observation, reward, ended, _, info = env.step(action)
        rewards.append(reward)
    assert rewards[:-1] == [-10] * (len(rewards) - 1)
    assert (rewards[-1], ended, info["labels"]) == (-1020, True, ("i3",))
    assert not info["action_mask"].any()
    assert observation[-1] == env.reward_machine.states.index("u1")


def test_infeasible_action_does_nothing_for_one_epoch():
    env = PickupDeliveryEnv()
    before, info = env.reset(seed=0)
    after, reward, ended, _, later = env.step(3)  # backwards through the border
    assert after.tolist() == before.tolist()
    assert (reward, ended) == (-10, False)
    assert later["events"] == ()
    assert later["state"] == info["state"]


def test_actions_out_of_range_are_refused():
    env = PickupDeliveryEnv(preset="published")
    env.reset(seed=0)
    with pytest.raises(MDPError, match="the grid has no action 4"):
        env.step(4)


def test_observation_columns():
    env = PickupDeliveryEnv(drop_probability=1)
    observation, _ = env.reset(seed=0)
    assert observation.tolist() == [6, 0, 0, 0, 0, 0, 0, 0, 0]
    env._state = encode(GridState(6, 2, "down", ALL))
    assert env.step(2)[0].tolist() == [6, 2, 2, 2, 1, 1, 1 + 2 * 9 + 6, 0, 0]
    assert env.step(env.grid.actions.index("p1"))[0].tolist() == [6, 2, 2, 1, 1, 1, 0, 1, 0]
    assert env.observation_space.nvec.tolist() == [9, 7, 4, 3, 3, 3, 64, 2, 6]


def test_two_runs_with_one_seed_are_one():
    def trace(seed):
        env = PickupDeliveryEnv()
        env.reset(seed=seed)
        env._state = encode(GridState(4, 3, "up", ALL))
        return [env.step(action)[4]["state"] for action in [2, 3] * 10]

    assert trace(1) == trace(1)
    assert trace(1) != trace(2)


def test_a_copy_goes_on_by_itself():
    env = PickupDeliveryEnv()
    env.reset(seed=0)
    twin = copy.deepcopy(env)
    twin.step(0)
    assert env._state == env.grid.start
    assert twin._state != twin.grid.start


def test_own_reward_machine():
    machine = reward_machine(["S", "i2"], [("a", "i2 & !S", "b", 5.0), ("a", "!i2 & S", "a", 1.0)])
    env = PickupDeliveryEnv(reward_machine=machine)
    env.reset(seed=0)
    assert env.observation_space.nvec[-1] == 2
    assert env.step(3)[1] == 1.0  # into the border: still at S
    env._state = encode(GridState(8, 6, "up"))
    observation, reward, *_ = env.step(env.grid.actions.index("p2"))
    assert (reward, observation[-1]) == (5.0, 1)


def test_settings_of_the_environment_are_checked():
    with pytest.raises(RuleError, match="reads 'i4', which the grid does not know; known: i1, i2, i3, S"):
        PickupDeliveryEnv(reward_machine=reward_machine(["i4"], [("a", "i4", "b", 1.0)]))
    with pytest.raises(MDPError, match="unknown render_mode 'rgb_aray'; did you mean 'rgb_array'"):
        PickupDeliveryEnv(render_mode="rgb_aray")


# --- pictures -----------------------------------------------------------------------------------------------


def test_text_picture():
    lines = draw(encode(GridState(2, 4, "left", ("dropped", "dropped", "carried"), (2, 4)))).splitlines()
    assert len(lines) == 2 * 7 + 1 + 1
    assert {len(line) for line in lines[:-1]} == {9 * 6 + 1}
    assert "◀12" in lines[5]
    assert lines[-1] == "at (2, 4) facing left; carries 3; dropped 1, 2 at (2, 4)"
    env = PickupDeliveryEnv(render_mode="ansi")
    env.reset(seed=0)
    assert env.render() == draw(env.grid.start)


def test_pixel_picture():
    env = PickupDeliveryEnv(render_mode="rgb_array")
    env.reset(seed=0)
    picture = env.render()
    assert (picture.shape, picture.dtype) == ((304, 432, 3), np.uint8)
    assert (picture == pixels(env.grid.start)).all()

    def at(x, y):  # in cells, from the bottom left of the grid
        return picture[round(304 - 12 - 40 * y), round(12 + 40 * x)].astype(int)

    assert at(3, 1).max() < 60  # a wall
    assert at(3, 3.5).min() > 200  # none
    assert at(0.25, 6.5)[2] > at(0.25, 6.5)[0] + 80  # item 1, blue
    assert at(6.5, 0.5).max() < 100  # the agent, dark
    assert PickupDeliveryEnv().render() is None


def test_pictures_tell_states_apart():
    states = [
        GridState(6, 0, "up"),
        GridState(6, 0, "down"),
        GridState(6, 1, "down"),
        GridState(6, 1, "down", ("carried", "home", "home")),
        GridState(6, 1, "down", ("dropped", "carried", "carried"), (6, 1)),
        GridState(6, 1, "down", ("dropped", "dropped", "carried"), (6, 1)),
        GridState(6, 1, "down", ("dropped", "dropped", "dropped"), (6, 2)),
    ]
    pictures = {pixels(encode(state)).tobytes() for state in states}
    assert len(pictures) == len(states)
    assert pixels(encode(states[0]), cell=20).shape == (152, 216, 3)

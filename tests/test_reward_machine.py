"""Reward machines: δu reads the label after each epoch; the reward is that of the edge."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from strategies import Formula, formulas
from supremal import FormatError, RewardMachine, RuleError, reward_machine
from supremal.decisions.guards import truth_table
from supremal.decisions.reward_machine import none_of

FIGURE_6 = [
    ("u0", "!p1 & !p2 & !p3", "u0", -10.0),
    ("u0", "!p1 & p2 & !p3 | !p1 & !p2 & p3", "u1", -20.0),
    ("u0", "p1 & !p2 & !p3", "u2", -8.0),
    ("u1", "true", "u1", -20.0),
    ("u2", "p1 & !p2 & !p3", "u2", -8.0),
    ("u2", "p1 & !p2 & p3", "u1", -20.0),
    ("u2", "p1 & p2 & !p3", "u3", -6.0),
    ("u3", "p1 & p2 & !p3", "u3", -6.0),
    ("u3", "p1 & p2 & p3", "u4", -1.0),
    ("u4", "p1 & p2 & p3 & !S", "u4", -1.0),
    ("u4", "p1 & p2 & p3 & S", "u5", 0.0),
    ("u5", "true", "u5", 0.0),
]
P = ["p1", "p2", "p3", "S"]


def run(machine: RewardMachine, labels: list[set[str]]) -> tuple[list[str], list[float]]:
    """The states entered and the rewards earned from the initial state on."""
    state, states, rewards = 0, [], []
    for true in labels:
        state, reward = machine.step(state, true)
        states.append(machine.states[state])
        rewards.append(reward)
    return states, rewards


@pytest.mark.parametrize(
    ("labels", "states", "rewards"),
    [
        pytest.param(
            [set(), {"p1"}, {"p1"}, {"p1", "p2"}, {"p1", "p2", "p3"}, {"p1", "p2", "p3"}, {*P}, set()],
            ["u0", "u2", "u2", "u3", "u4", "u4", "u5", "u5"],
            [-10, -8, -8, -6, -1, -1, 0, 0],
            id="in order",
        ),
        pytest.param(
            [{"p2"}, {"p1", "p2"}, {*P}], ["u1", "u1", "u1"], [-20, -20, -20], id="second item first"
        ),
        pytest.param([{"p1"}, {"p1", "p3"}], ["u2", "u1"], [-8, -20], id="third item second"),
        pytest.param(
            [{"p1"}, {"p1", "p2"}, {"p1", "p2", "p3"}, {"p2", "p3"}],
            ["u2", "u3", "u4", "u4"],
            [-8, -6, -1, -1],
            id="an item dropped: no guard is true, so it stays",
        ),
    ],
)
def test_the_paper_machine(labels: list[set[str]], states: list[str], rewards: list[float]) -> None:
    assert run(reward_machine(P, FIGURE_6), labels) == (states, rewards)


def test_shapes_and_order() -> None:
    machine = reward_machine(P, FIGURE_6, name="grid")
    assert machine.states == ("u0", "u1", "u2", "u3", "u4", "u5")
    assert machine.propositions == tuple(P)
    assert machine.delta.shape == (6, 16)
    assert machine.reward.shape == (6, 16)
    assert len(machine.edges) == len(FIGURE_6)
    assert machine.edges[0].guard == "!p1 & !p2 & !p3"
    assert repr(machine) == "<RewardMachine 'grid': 6 states, 12 edges>"
    for array in (machine.delta, machine.reward):
        assert not array.flags.writeable


def test_no_guard_and_no_loop_earns_nothing() -> None:
    machine = reward_machine(["c"], [("start", "c", "done", 1.0)])
    assert run(machine, [set(), {"c"}, {"c"}]) == (["start", "done", "done"], [0.0, 1.0, 0.0])


def test_no_guard_earns_what_the_loop_does() -> None:
    machine = reward_machine(
        ["c", "d"], [("start", "c & d", "start", -1.0), ("start", "c & !d", "done", 5.0)]
    )
    assert run(machine, [set(), {"d"}, {"c"}]) == (["start", "start", "done"], [-1.0, -1.0, 5.0])


def test_the_initial_state_comes_first() -> None:
    machine = reward_machine(
        ["c"], [("later", "c", "last", 1.0), ("first", "c", "later", 2.0)], initial="first"
    )
    assert machine.states == ("first", "later", "last")
    assert run(machine, [{"c"}, {"c"}]) == (["later", "last"], [2.0, 1.0])
    assert reward_machine(["c"], [], initial="alone").step(0, {"c"}) == (0, 0.0)


def test_guards_may_overlap_where_they_agree() -> None:
    machine = reward_machine(["c", "d"], [("0", "c", "1", 1.0), ("0", "d", "1", 1.0)])
    for true in ({"c"}, {"d"}, {"c", "d"}):
        assert machine.step(0, true) == (1, 1.0)


def test_each_guard_between_two_states_keeps_its_reward() -> None:
    machine = reward_machine(["c", "d"], [("0", "c", "1", 1.0), ("0", "d & !c", "1", 2.0)])
    assert [machine.step(0, true) for true in ({"c"}, {"d"}, {"c", "d"})] == [(1, 1.0), (1, 2.0), (1, 1.0)]


def test_loops_may_differ_where_they_leave_no_case_out() -> None:
    machine = reward_machine(["c"], [("0", "c", "0", 1.0), ("0", "!c", "0", 2.0)])
    assert run(machine, [{"c"}, set()]) == (["0", "0"], [1.0, 2.0])


@given(
    st.lists(
        st.tuples(st.integers(0, 2), formulas(["p", "q"]), st.integers(0, 2), st.sampled_from([0.0, 1.0])),
        min_size=1,
        max_size=5,
    )
)
def test_steps_by_the_definition(edges: list[tuple[int, Formula, int, float]]) -> None:
    labels: list[set[str]] = [set(), {"p"}, {"q"}, {"p", "q"}]
    loops = {u: {r for v, _, w, r in edges if u == v == w} or {0.0} for u, *_ in edges}
    expected = {}
    for u in {state for v, _, w, _ in edges for state in (v, w)}:
        for n, true in enumerate(labels):
            steps = {(v, r) for w, guard, v, r in edges if w == u and guard.holds(true)}
            expected[u, n] = steps or {(u, r) for r in loops.get(u, {0.0})}
    listed = [(str(u), guard.text, str(v), reward) for u, guard, v, reward in edges]
    if any(len(steps) > 1 for steps in expected.values()):
        with pytest.raises(RuleError, match="both guards|its loops have different rewards"):
            reward_machine(["p", "q"], listed)
        return
    machine = reward_machine(["p", "q"], listed)
    assert machine.states[0] == str(edges[0][0])
    for (u, n), steps in expected.items():
        after, reward = machine.step(machine.states.index(str(u)), labels[n])
        assert {(int(machine.states[after]), reward)} == steps


@given(st.lists(formulas(["p", "q"]), max_size=3))
def test_none_of_some_guards(guards: list[Formula]) -> None:
    rest = none_of([guard.text for guard in guards], ["p", "q"])
    uncovered = [not any(guard.holds(true) for guard in guards) for true in (set(), {"p"}, {"q"}, {"p", "q"})]
    assert (truth_table(rest, ["p", "q"]).tolist() if rest else [False] * 4) == uncovered


# --- bad machines -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("edges", "options", "says"),
    [
        pytest.param(
            [("u0", "p1", "u1", 0.0), ("u0", "p2", "u2", 0.0)],
            {},
            "in state u0 both guards 'p1' (to u1) and 'p2' (to u2) are true for {p1, p2}; make them exclude",
            id="two guards can both be true",
        ),
        pytest.param(
            [("u0", "true", "u0", 0.0), ("u0", "p3", "u2", 0.0)],
            {},
            "both guards 'true' (to u0) and 'p3' (to u2) are true for {p3}",
            id="a loop and an edge",
        ),
        pytest.param(
            [("u0", "p1", "u1", 1.0), ("u0", "p2", "u1", 2.0)],
            {},
            "both guards 'p1' (to u1, reward 1) and 'p2' (to u1, reward 2) are true for {p1, p2}; make them",
            id="two rewards",
        ),
        pytest.param(
            [("u0", "p1", "u0", 1.0), ("u0", "p2 & !p1", "u0", 2.0)],
            {},
            "no guard of u0 is true for {}, and its loops have different rewards (1, 2); give that case an",
            id="two loops",
        ),
        pytest.param(
            [("u0", "p1", "u1", float("nan"))],
            {},
            "guard of u0 → u1 has reward nan; a finite number",
            id="nan",
        ),
        pytest.param(
            [("u0", "p1", "u1", float("-inf"))],
            {},
            "guard of u0 → u1 has reward -inf; a finite",
            id="infinite",
        ),
        pytest.param([], {}, "has no state; give it an edge", id="no edge"),
        pytest.param(
            [("start", "p1", "done", 1.0)],
            {"initial": "strat"},
            "initial state 'strat' has no edge; did you mean 'start'?",
            id="initial state unknown",
        ),
    ],
)
def test_bad_machines(edges: list[Any], options: dict[str, Any], says: str) -> None:
    with pytest.raises(RuleError) as error:
        reward_machine(P, edges, name="grid", **options)
    assert says in str(error.value)
    assert "'grid'" in str(error.value)


def test_a_guard_that_does_not_parse_says_where() -> None:
    with pytest.raises(FormatError) as error:
        reward_machine(P, [("u0", "p1", "u1", 0.0), ("u0", "!p1 & p4", "u2", 0.0)])
    assert error.value.path == "guard of u0 → u2"
    assert (error.value.line, error.value.column) == (1, 7)
    assert "unknown proposition 'p4' (known: p1, p2, p3, S)" in str(error.value)


def test_too_many_propositions() -> None:
    names = [f"p{i}" for i in range(17)]
    with pytest.raises(RuleError, match="17 propositions; a reward machine may have 16"):
        reward_machine(names, [("u0", "p1", "u1", 0.0)])


def test_the_arrays_of_a_machine_are_its_own() -> None:
    delta, reward = np.zeros((1, 2), np.int32), np.zeros((1, 2))
    machine = RewardMachine(("u",), ("p",), (), delta, reward)
    delta[:], reward[:] = 7, 7.0
    assert machine.step(0, {"p"}) == (0, 0.0)

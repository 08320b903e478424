"""Reward machines as text.  The tasks are those of the literature's office and craft worlds, told anew."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from strategies import Formula, formulas
from supremal import FormatError, RewardMachine, RuleError, reward_machine
from supremal.formats import read_machine_text, read_reward_machine
from supremal.formats.machine_text import read

COFFEE = """\
0                     # nothing yet
[2]
# f: at the coffee machine, g: at the office, n: on a plant, which breaks the task
(0,0,'!f&!n',ConstantRewardFunction(0))
(0,1,'f&!g&!n',ConstantRewardFunction(0))
(0,2,'f&g&!n',ConstantRewardFunction(1))
(1,1,'!g&!n',ConstantRewardFunction(0))
(1,2,'g&!n',ConstantRewardFunction(1))
"""
PATROL = """\
0
[]
(0, 0, '!a', ConstantRewardFunction(0))
(0, 1,  'a', ConstantRewardFunction(0))
(1, 1, '!b', ConstantRewardFunction(0))
(1, 0,  'b', ConstantRewardFunction(2.5))
"""
BRIDGE = """\
0
[3]
(0,0,'!wood&!iron',ConstantRewardFunction(-0.1)) (0,1,'wood&!iron',ConstantRewardFunction(-0.1))
(0,2,'iron',ConstantRewardFunction(-0.1))
(1,1,'!iron',ConstantRewardFunction(-0.1)) (1,2,'iron',ConstantRewardFunction(-0.1))
(2,2,'!factory|False',ConstantRewardFunction(-1e-1))
(2,3,"factory & True",
     ConstantRewardFunction( +1. ))
"""


def machine_of(text: str, propositions: list[str] | None = None) -> RewardMachine:
    return read(text.encode(), "task.txt", propositions)


def run(machine: RewardMachine, labels: list[str]) -> tuple[list[str], list[float]]:
    state, states, rewards = 0, [], []
    for true in labels:
        state, reward = machine.step(state, true.split())
        states.append(machine.states[state])
        rewards.append(reward)
    return states, rewards


@pytest.mark.parametrize(
    ("text", "labels", "states", "rewards"),
    [
        pytest.param(
            COFFEE, ["", "f", "", "g", "f"], ["0", "1", "1", "2", "2"], [0, 0, 0, 1, 0], id="coffee"
        ),
        pytest.param(COFFEE, ["f g"], ["2"], [1], id="coffee in the office"),
        pytest.param(COFFEE, ["f", "n g", "g"], ["1", "-1", "-1"], [0, 0, 0], id="a plant is broken"),
        pytest.param(PATROL, ["b", "a", "a", "b", "a b"], list("01101"), [0, 0, 0, 2.5, 0], id="patrol"),
        pytest.param(
            BRIDGE, ["wood", "", "iron", "factory", "iron"], list("11233"), [-0.1] * 3 + [1, 0], id="bridge"
        ),
    ],
)
def test_tasks(text: str, labels: list[str], states: list[str], rewards: list[float]) -> None:
    assert run(machine_of(text), labels) == (states, rewards)


def test_what_is_read() -> None:
    machine = machine_of(COFFEE)
    assert (machine.name, machine.propositions, machine.states) == (
        "task",
        ("f", "g", "n"),
        ("0", "1", "2", "-1"),
    )
    assert machine_of(PATROL).states == ("0", "1")  # a guard is always true: nothing is lost
    assert machine_of(PATROL, ["b", "c", "a"]).propositions == ("b", "c", "a")


def test_guards_between_the_same_states_keep_their_rewards() -> None:
    """The original keeps one reward for both where their guards are written alike, or for all."""
    edges = ["0\n[1]", "(0,1,'a&!b',ConstantRewardFunction(1))", "(0,1,'b',ConstantRewardFunction(2))"]
    machine = machine_of("\n".join(edges))
    assert [machine.step(0, true) for true in ({"a"}, {"b"}, {"a", "b"})] == [(1, 1.0), (1, 2.0), (1, 2.0)]


def test_names_are_whole() -> None:
    machine = machine_of(
        "0\n[1]\n(0,1,'ore',ConstantRewardFunction(1))\n(0,0,'!ore',ConstantRewardFunction(0))"
    )
    assert machine.step(0, {"store", "o"}) == (0, 0.0)


def test_a_terminal_state_is_never_left() -> None:
    machine = machine_of(
        "0\n[0, 1]\n(0,1,'a',ConstantRewardFunction(5))\n(1,7,'junk',ConstantRewardFunction(5))"
    )
    assert (machine.states, machine.propositions, machine.step(0, {"a"})) == (("0", "1"), (), (0, 0.0))


@given(
    st.lists(
        st.tuples(st.integers(0, 2), formulas(["p", "q"]), st.integers(0, 2), st.integers(-3, 3)), max_size=6
    )
)
def test_it_says_what_its_edges_say(edges: list[tuple[int, Formula, int, int]]) -> None:
    """Beside an edge to -1 where no guard is true, it is `reward_machine` of the same edges."""
    covered = [(u, "true", u, 0) for u in range(3) if u not in {edge[0] for edge in edges}]
    listed = [*((u, guard.text, v, r) for u, guard, v, r in edges), *covered]
    text = "0[]" + "".join(f"({u},{v},'{guard}',ConstantRewardFunction({r}))" for u, guard, v, r in listed)
    try:
        plain = reward_machine(["p", "q"], [(str(u), g, str(v), r) for u, g, v, r in listed], initial="0")
    except RuleError as error:
        if "its loops have" not in str(error):
            with pytest.raises(RuleError, match="task.txt: reward machine 'task': in state"):
                machine_of(text, ["p", "q"])
        return
    machine = machine_of(text, ["p", "q"])
    for u, state in enumerate(plain.states):
        for true in (set(), {"p"}, {"q"}, {"p", "q"}):
            after, reward = machine.step(machine.states.index(state), true)
            v, earned = plain.step(u, true)
            said = any(guard.holds(true) for w, guard, *_ in edges if str(w) == state)
            said |= any(str(w) == state for w, *_ in covered)
            assert (machine.states[after], reward) == ((plain.states[v], earned) if said else ("-1", 0.0))


def test_the_ending_says_that_it_is_text(tmp_path: Path) -> None:
    path = tmp_path / "coffee.txt"
    path.write_text(COFFEE.replace("\n", "\r\n"), encoding="utf-8-sig")
    for machine in (read_reward_machine(path), read_machine_text(str(path))):
        assert (machine.name, machine.step(0, {"f", "g"})) == ("coffee", (2, 1.0))


# --- bad texts --------------------------------------------------------------------------------------------

EDGE = "(0,0,'a',ConstantRewardFunction(1))"


@pytest.mark.parametrize(
    ("text", "place", "says"),
    [
        ("", "1:1", "the file ends where the initial state, a whole number from 0 to 999999999, is needed"),
        ("# nothing\n", "2:1", "the file ends where the initial state"),
        ("u0\n[]", "1:1", "'u0' where the initial state"),
        ("-1\n[]", "1:1", "'-1' where the initial state"),
        ("1.0\n[]", "1:1", "'1.0' where the initial state"),
        ("0\n2", "2:1", "'2' where the list of terminal states, like [2] or [], is needed"),
        ("0\n[2 3]", "2:4", "'3' where ',' is needed"),
        ("0\n[2", "2:3", "the file ends where ',' is needed"),
        ("0\n[]\n0,0", "3:1", "'0' where an edge, like (0,1,'a&!b',ConstantRewardFunction(1)), is needed"),
        ("0\n[]\n(0,x,'a',ConstantRewardFunction(1))", "3:4", "'x' where a state"),
        ("0\n[]\n(0,0,a,ConstantRewardFunction(1))", "3:6", "'a' where a guard in quotes is needed"),
        ("0\n[]\n(0,0,'a,ConstantRewardFunction(1))", "3:6", '"\'" is no sign here, or opens what is not'),
        (
            "0\n[]\n(0,0,'a' ConstantRewardFunction(1))",
            "3:10",
            "'ConstantRewardFunction' where ',' is needed",
        ),
        (
            "0\n[]\n(0,0,'a',RewardControl())",
            "3:10",
            "reward function 'RewardControl' cannot be read; Constant",
        ),
        ("0\n[]\n(0,0,'a',ConstantRewardFunction(one))", "3:33", "'one' where a number is needed"),
        ("0\n[]\n(0,0,'a',ConstantRewardFunction(1e999))", "3:33", "'1e999' where a finite number is needed"),
        ("0\n[]\n(0,0,'a',ConstantRewardFunction(1_0))", "3:33", "'1' is no sign here"),
        ("0\n[]\n(0,0,'a',ConstantRewardFunction(1)", "3:35", "the file ends where ')' is needed"),
        ("0\n[]\n(0,0,'a',ConstantRewardFunction(__import__('os')))", "3:33", "'__import__' where a number"),
        (
            f"0\n[]\n{EDGE}\n(0,1,'!a',ConstantRewardFunction(1))",
            "4:4",
            "state 1 has no edge and is not terminal",
        ),
        (f"7\n[]\n{EDGE}", "1:1", "state 7 has no edge and is not terminal; give it one, or list it in the"),
        ("0\n[]\n(0,0, 'a &', ConstantRewardFunction(1))", "3:11", "a proposition is missing in 'a &'"),
        ("0\n[]\n(0,0,'a + b',ConstantRewardFunction(1))", "3:9", "unexpected '+' in 'a + b'"),
    ],
)
def test_bad_texts(text: str, place: str, says: str) -> None:
    with pytest.raises(FormatError) as error:
        machine_of(text)
    assert str(error.value).startswith(f"task.txt:{place}: {says}")


def test_a_guard_may_name_what_is_known_only() -> None:
    with pytest.raises(FormatError, match=r"task.txt:5:7: unknown proposition 'f' \(did you mean 'ff'\?\)"):
        machine_of(COFFEE.replace("(0,0,'!f&!n'", "(0,0,'ff&!n'"), ["ff", "g", "n"])


def test_bad_machines() -> None:
    with pytest.raises(RuleError, match="task.txt: reward machine 'task': in state 0 both guards 'a'"):
        machine_of(f"0\n[1]\n{EDGE}\n(0,1,'b',ConstantRewardFunction(1))")
    many = "|".join(f"p{k}" for k in range(17))
    with pytest.raises(RuleError, match="task.txt: 17 propositions; a reward machine may have 16"):
        machine_of(f"0\n[]\n(0,0,'{many}',ConstantRewardFunction(1))")
    with pytest.raises(RuleError, match="task.txt: proposition 'a b': a word other than"):
        machine_of(f"0\n[]\n{EDGE}", ["a", "a b"])


def test_what_would_take_too_long() -> None:
    many = " & ".join(f"p{k}" for k in range(16))
    edges = "".join(f"({k},{k + 1},'{many}',ConstantRewardFunction(1))" for k in range(1100))
    with pytest.raises(RuleError, match="1,101 states and guards of 91,300 letters are too many for 16 prop"):
        machine_of(f"0[1100]{edges}")
    long = many + "&p0" * 100_000
    with pytest.raises(RuleError, match="letters are too many for 16 propositions"):
        machine_of(f"0[1](0,1,'{long}',ConstantRewardFunction(1))")


@given(st.binary(max_size=60) | st.text("0[](),'a&|!# \nConstantRewardFunction", max_size=80).map(str.encode))
def test_no_text_but_says_what_is_wrong(raw: bytes) -> None:
    says = ""
    try:
        read(raw, "task.txt")
    except (FormatError, RuleError) as error:
        says = str(error)
    assert not says or says.startswith("task.txt:")

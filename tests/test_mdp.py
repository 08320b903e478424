"""Decision processes: outcomes are stored once, as they were given, and bad numbers are named."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from supremal import Alphabet, AlphabetError, MDPError, Outcome, TabularMDP, from_outcomes
from supremal.decisions.mdp import restrict

SIGMA = Alphabet(("go", "stop", "fault"), frozenset({"fault"}))
LINES = [
    Outcome(0, "go", 1, 0.75, ("go",), -1.0),
    Outcome(0, "go", 0, 0.25, ("fault",), -5.0),
    Outcome(1, "stop", 2, 0.5, ("stop",)),
    Outcome(1, "stop", 0, 0.5, ("stop", "fault")),
    Outcome(0, "rest", 0, 1.0, ()),
]


def machine(**changes: Any) -> TabularMDP:
    options: dict[str, Any] = {
        "alphabet": SIGMA,
        "terminal": [2],
        "labels": {2: ["done"], 1: ["busy", "warm"]},
    }
    return from_outcomes(LINES, **options | changes)


def read(mdp: TabularMDP) -> set[Outcome]:
    """All that can happen, off the public arrays."""
    return {
        Outcome(
            s,
            action,
            int(mdp.next_state[k]),
            float(mdp.prob[k]),
            mdp.spell(int(mdp.word[k])),
            float(mdp.reward[k]),
        )
        for s in range(mdp.n_states)
        for a, action in enumerate(mdp.actions)
        for k in range(mdp.outcomes(s, a).start, mdp.outcomes(s, a).stop)
    }


@st.composite
def outcome_lists(draw: st.DrawFn) -> list[Outcome]:
    """Outcomes of any order; those of one state and action have equal probabilities."""
    events = st.lists(st.sampled_from(SIGMA.names), max_size=2).map(tuple)
    choices = st.tuples(st.integers(0, 3), st.sampled_from(["go", "stop", "rest"]))
    results = st.lists(st.tuples(st.integers(0, 3), events), min_size=1, max_size=3, unique=True)
    table = draw(st.dictionaries(choices, results, max_size=6))
    lines = [
        Outcome(state, action, target, 1 / len(listed), word, float(draw(st.integers(-3, 3))))
        for (state, action), listed in table.items()
        for target, word in listed
    ]
    return draw(st.permutations(lines))


@settings(max_examples=50)
@given(outcome_lists())
def test_what_goes_in_comes_out(lines: list[Outcome]) -> None:
    mdp = from_outcomes(lines, alphabet=SIGMA)
    assert read(mdp) == set(lines)
    assert len(mdp.next_state) == len(lines)
    assert len(set(mdp.words)) == len(mdp.words)
    feasible = {(line.state, mdp.actions.index(line.action)) for line in lines}
    assert {tuple(pair) for pair in np.argwhere(mdp.feasible).tolist()} == feasible
    assert mdp.feasible.shape == (mdp.n_states, mdp.n_actions)


def test_every_field() -> None:
    mdp = machine()
    assert (mdp.n_states, mdp.n_actions) == (3, 3)
    assert mdp.actions == ("go", "stop", "rest")
    assert mdp.words[mdp.word[mdp.outcomes(0, 2)][0]] == ()
    assert mdp.propositions == ("done", "busy", "warm")
    assert mdp.label.tolist() == [0, 0b110, 0b001]
    assert mdp.terminal.tolist() == mdp.marked.tolist() == [False, False, True]
    assert mdp.initial.tolist() == [1, 0, 0]
    assert mdp.origin.tolist() == [[0], [1], [2]]
    assert mdp.feasible.tolist() == [[True, False, True], [False, True, False], [False, False, False]]
    assert repr(mdp) == "<TabularMDP: 3 states, 3 actions, 5 outcomes, 3 events>"


def test_options() -> None:
    mdp = machine(
        actions=["rest", "stop", "go", "wait"], marked=[1], initial=1, propositions=["warm", "busy", "done"]
    )
    assert mdp.actions == ("rest", "stop", "go", "wait")
    assert not mdp.feasible[:, 3].any()
    assert mdp.marked.tolist() == [False, True, False]
    assert mdp.initial.tolist() == [0, 1, 0]
    assert mdp.label.tolist() == [0, 0b011, 0b100]
    assert read(mdp) == set(LINES)
    assert machine(marked=[]).marked.sum() == 0
    assert machine(terminal=[4]).n_states == 5


def test_later_writes_to_the_arrays_do_not_show() -> None:
    source = machine()
    names = (
        "row",
        "next_state",
        "prob",
        "reward",
        "word",
        "terminal",
        "marked",
        "label",
        "initial",
        "origin",
    )
    arrays = {name: getattr(source, name).copy() for name in names}
    mdp = replace(source, **arrays)
    for name, array in arrays.items():
        before = getattr(mdp, name).tolist()
        array[:] = 0
        assert getattr(mdp, name).tolist() == before == getattr(source, name).tolist()
        with pytest.raises(ValueError, match="read-only"):
            getattr(mdp, name)[0] = 0


@settings(max_examples=50)
@given(outcome_lists(), st.data())
def test_restrict_keeps_the_enabled_actions(lines: list[Outcome], data: st.DataObject) -> None:
    mdp = from_outcomes(lines, alphabet=SIGMA)
    size = mdp.n_states * mdp.n_actions
    mask = data.draw(st.lists(st.booleans(), min_size=size, max_size=size))
    enabled = np.array(mask, np.bool_).reshape(mdp.n_states, mdp.n_actions)
    cut = restrict(mdp, enabled)
    assert read(cut) == {line for line in lines if enabled[line.state, mdp.actions.index(line.action)]}
    assert cut.feasible.tolist() == (mdp.feasible & enabled).tolist()


@pytest.mark.parametrize(
    ("lines", "options", "error", "says"),
    [
        pytest.param(
            [(0, "go", 1, 0.5, ()), (0, "go", 0, 0.4, ())],
            {},
            MDPError,
            "the probabilities of action 'go' in state 0 sum to 0.9; they have to sum to 1",
            id="less than 1",
        ),
        pytest.param(
            [(0, "go", 0, 1.0, ()), (2, "stop", 0, 0.75, ()), (2, "stop", 1, 0.75, ())],
            {},
            MDPError,
            "action 'stop' in state 2 sum to 1.5",
            id="more than 1",
        ),
        pytest.param(
            [(0, "go", 0, float("nan"), ())], {}, MDPError, "sum to nan; they have to sum to 1", id="nan"
        ),
        pytest.param(
            [(0, "go", 0, 1.0, ()), (0, "go", 1, 0.0, ())],
            {},
            MDPError,
            "an outcome has probability 0; leave out what cannot happen",
            id="probability 0",
        ),
        pytest.param(
            [(0, "go", 0, 1.5, ()), (0, "go", 1, -0.5, ())],
            {},
            MDPError,
            "probability -0.5; leave",
            id="negative",
        ),
        pytest.param(
            [(0, "go", 0, 1.0, (), float("inf"))],
            {},
            MDPError,
            "a reward is not finite",
            id="reward not finite",
        ),
        pytest.param(
            [(0, "go", -1, 1.0, ())],
            {},
            MDPError,
            "state -1 is below 0; states are counted from 0",
            id="next state",
        ),
        pytest.param(
            [(0, "go", 0, 1.0, ("flt",))],
            {},
            AlphabetError,
            "unknown event 'flt'; did you mean 'fault'?",
            id="unknown event",
        ),
        pytest.param(
            [(0, "rest", 0, 1.0, ())],
            {"actions": ["go"]},
            MDPError,
            "unknown action 'rest'; known: go",
            id="unknown action",
        ),
        pytest.param(
            [(0, "go", 0, 1.0, ())],
            {"labels": {0: ["warm"]}, "propositions": ["cold"]},
            MDPError,
            "unknown proposition 'warm'; known: cold",
            id="unknown proposition",
        ),
        pytest.param(
            [(0, "go", 0, 1.0, ())],
            {"propositions": [f"p{i}" for i in range(64)]},
            MDPError,
            "64 propositions; at most 63 fit a label",
            id="too many propositions",
        ),
    ],
)
def test_bad_outcomes(lines: list[Any], options: dict[str, Any], error: type[Exception], says: str) -> None:
    with pytest.raises(error) as caught:
        from_outcomes(lines, alphabet=SIGMA, **options)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        pytest.param({"prob": [1.0]}, "prob has 1 entries, 5 are needed", id="too few probabilities"),
        pytest.param({"row": [0, 5]}, "row has 2 entries, 10 are needed", id="too few rows"),
        pytest.param({"marked": [True]}, "marked has 1 entries, 3 are needed", id="too few marks"),
        pytest.param({"origin": [[0]]}, "origin has 1 entries, 3 are needed", id="too few origins"),
        pytest.param({"row": [0, 3, 2, 3, 3, 5, 5, 5, 5, 5]}, "row has to rise from 0", id="row falls"),
        pytest.param({"row": [1, 2, 2, 3, 3, 5, 5, 5, 5, 5]}, "row has to rise from 0", id="row starts late"),
        pytest.param(
            {"row": [0, 2, 2, 3, 3, 4, 4, 4, 4, 4]}, "to the number of outcomes, 5", id="row ends early"
        ),
        pytest.param({"word": [0, 1, 2, 3, 9]}, "word holds 0 to 9; 0 to 4 are known", id="unknown word"),
        pytest.param(
            {"next_state": [0, 1, 2, 3, 0]}, "next_state holds 0 to 3; 0 to 2 are", id="unknown state"
        ),
        pytest.param({"initial": [0.5, 0, 0]}, "the initial distribution sums to 0.5", id="initial sum"),
        pytest.param({"initial": [1.5, -0.5, 0]}, "the initial distribution", id="initial negative"),
    ],
)
def test_bad_arrays(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(MDPError) as caught:
        replace(machine(), **changes)
    assert says in str(caught.value)


def test_a_distribution_over_initial_states() -> None:
    assert replace(machine(), initial=[0.5, 0.5, 0]).initial.tolist() == [0.5, 0.5, 0]


def test_thirds_sum_to_one() -> None:
    lines = [(0, "go", s, 1 / 3, ()) for s in range(3)]
    assert from_outcomes(lines, alphabet=SIGMA).n_states == 3

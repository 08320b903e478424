"""Rewards out of what is there: rules as propositions, and potential-based shaping."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from processes import SIGMA, follow, outcomes_of, random_process, random_rule
from strategies import SEEDS
from supremal import (
    Alphabet,
    Automaton,
    MDPError,
    RewardMachine,
    RuleError,
    TabularMDP,
    from_outcomes,
    from_text,
    product,
    reward_machine,
    value_iteration,
)
from supremal.automata.build import empty
from supremal.decisions.shaping import label_end, label_with_rule, machine_from_rule, potentials, shaped
from supremal.envs import PickupDelivery

GAMMA = 0.8


def random_machine(seed: int) -> RewardMachine:
    """Three states; each may leave cases out, and has a loop at most."""
    rng = np.random.default_rng(seed)
    guards = ["x & y", "x & !y", "!x & y", "!x & !y"]
    edges = [
        (str(u), guard, str(v), float(rng.integers(-4, 5)))
        for u in range(3)
        for guard in guards
        for v in [int(rng.integers(3))]
        if rng.random() < 0.8 and (u != v or guard == "x & y")
    ]
    return reward_machine(["x", "y"], edges, initial=edges[0][0] if edges else "0")


def marked_rule(seed: int) -> Automaton:
    rule = random_rule(seed)
    return replace(rule, marked=np.random.default_rng(seed).random(rule.n_states) < 0.5, name="rule")


# --- shaping ----------------------------------------------------------------------------------------------


@given(SEEDS, SEEDS, st.none() | SEEDS)
def test_optimal_policies_stay_and_values_move_by_the_potential(
    process_seed: int, machine_seed: int, potential_seed: int | None
) -> None:
    mdp = label_end(random_process(process_seed))
    machine = random_machine(machine_seed)
    phi = potentials(machine, GAMMA)
    if potential_seed is not None:
        phi = np.random.default_rng(potential_seed).normal(0, 5, len(machine.states))
    told = product(mdp, [], machine)
    earlier = product(mdp, [], shaped(machine, GAMMA, potential=phi))
    assert np.array_equal(told.origin, earlier.origin)
    plans = [value_iteration(process, gamma=GAMMA) for process in (told, earlier)]
    moved = np.where(told.terminal, 0, phi[told.origin[:, -1]])
    assert plans[1].value == pytest.approx(plans[0].value - moved, abs=1e-7)
    assert plans[1].q == pytest.approx(plans[0].q - moved[:, None], abs=1e-7)


@given(SEEDS)
def test_potentials_by_the_definition(seed: int) -> None:
    """Walk through the sequences of labels themselves."""
    machine = random_machine(seed)
    labels = [set(), {"x"}, {"y"}, {"x", "y"}]
    value = [0.0] * len(machine.states)
    for _ in range(150):
        steps = [[machine.step(u, true) for true in labels] for u in range(len(value))]
        value = [max(reward + GAMMA * value[v] for v, reward in row) for row in steps]
    assert potentials(machine, GAMMA) == pytest.approx(value, abs=1e-8)


@given(SEEDS)
def test_every_shaped_step_by_the_formula(seed: int) -> None:
    machine = random_machine(seed)
    phi = np.random.default_rng(seed).normal(0, 5, len(machine.states)).round(3)
    by_end, always = (shaped(machine, GAMMA, potential=phi, over=over) for over in ("over", None))
    assert by_end.states == always.states == machine.states
    for u in range(len(machine.states)):
        for true in (set(), {"x"}, {"y"}, {"x", "y"}):
            after, reward = machine.step(u, true)
            earned = reward + GAMMA * phi[after] - phi[u]
            for step in (always.step(u, true), by_end.step(u, true)):
                assert step == (after, pytest.approx(earned))
            assert by_end.step(u, {*true, "over"}) == (after, pytest.approx(reward - phi[u]))


def test_on_the_grid_where_episodes_end_in_the_wrong_order_too() -> None:
    grid = PickupDelivery(preset="published")
    machine, gamma = grid.reward_machine(), 0.9
    model = label_end(grid.model())
    plans = [value_iteration(product(model, [], m), gamma=gamma) for m in (machine, shaped(machine, gamma))]
    assert plans[1].value[0] == pytest.approx(plans[0].value[0] - potentials(machine, gamma)[0])
    assert np.array_equal(plans[0].policy == -1, plans[1].policy == -1)


def test_to_end_where_much_could_be_earned_does_not_pay() -> None:
    mdp = from_outcomes(
        [(0, "stop", 1, 1.0, ("stop",)), (0, "go", 2, 1.0, ("go",))],
        alphabet=Alphabet(("stop", "go")),
        terminal=[1, 2],
        labels={1: ["x"], 2: ["y"]},
    )
    machine = reward_machine(
        ["x", "y"], [("0", "x", "1", 0.0), ("0", "y & !x", "2", 1.0), ("1", "!x", "0", 9.0)]
    )
    best = [
        mdp.actions[value_iteration(product(label_end(mdp), [], told), gamma=GAMMA).policy[0]]
        for told in (machine, shaped(machine, GAMMA), shaped(machine, GAMMA, over=None))
    ]
    assert best == ["go", "go", "stop"]
    with pytest.raises(RuleError, match="reads proposition 'over', which the environment does not have"):
        product(mdp, [], shaped(machine, GAMMA))


def test_a_machine_may_know_the_end_already() -> None:
    machine = reward_machine(["over"], [("0", "over", "1", 1.0)])
    earlier = shaped(machine, 0.5, potential=[4.0, 2.0])
    assert earlier.propositions == ("over",)
    assert [earlier.step(0, set()), earlier.step(0, {"over"})] == [(0, -2.0), (1, -3.0)]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"gamma": 1.0}, "gamma is 1.0; a number from 0 up to, not including, 1"),
        ({"gamma": 0.5, "potential": [1.0]}, r"the potential is \[1.0\]; 2 finite numbers are needed"),
        ({"gamma": 0.5, "potential": [1.0, np.inf]}, "2 finite numbers are needed"),
    ],
)
def test_bad_shaping(options: dict, says: str) -> None:
    with pytest.raises(MDPError, match=says):
        shaped(reward_machine(["x"], [("0", "x", "1", 1.0)]), **options)


# --- rules as propositions --------------------------------------------------------------------------------


def runs(mdp: TabularMDP, length: int) -> list[list[tuple[int, float, tuple[str, ...]]]]:
    """All runs of at most so many steps from the initial states: (next state, reward, word) each."""
    found = [([], int(s)) for s in np.flatnonzero(mdp.initial)]
    listed = []
    while found:
        path, s = found.pop()
        listed.append(path)
        if len(path) < length and not mdp.terminal[s]:
            for a in range(mdp.n_actions):
                for t, _, reward, word in outcomes_of(mdp, s, a):
                    found.append(([*path, (t, reward, word)], t))
    return listed


@given(SEEDS, SEEDS)
def test_a_rule_is_true_where_its_automaton_is_marked(process_seed: int, rule_seed: int) -> None:
    mdp, rule = random_process(process_seed, states=4), marked_rule(rule_seed)
    labelled = label_with_rule(mdp, rule)
    assert labelled.propositions == (*mdp.propositions, "rule")
    for path in runs(labelled, 3):
        q = 0
        for t, _, word in path:
            q = follow(rule, q, word)
            own = labelled.origin[t, 0]
            satisfied = q >= 0 and bool(rule.marked[q])
            assert labelled.label[t] == mdp.label[own] | satisfied << 2
            assert labelled.origin[t, 1] == (q if q >= 0 else rule.n_states)
            assert (labelled.terminal[t], labelled.marked[t]) == (mdp.terminal[own], mdp.marked[own])


@given(SEEDS, SEEDS)
def test_a_rule_pays_when_it_becomes_satisfied(process_seed: int, rule_seed: int) -> None:
    mdp, rule = random_process(process_seed, states=4), marked_rule(rule_seed)
    paying = product(label_with_rule(mdp, rule), [], machine_from_rule(rule, reward=7.0))
    for path in runs(paying, 3):
        q = 0
        for _, reward, word in path:
            before = q >= 0 and bool(rule.marked[q])
            q = follow(rule, q, word)
            assert reward == (7.0 if q >= 0 and rule.marked[q] and not before else 0.0)


def test_two_rules_and_a_machine_of_ones_own() -> None:
    mdp = random_process(3)
    rules = {name: from_text(f"marked 1\n0 -{name}-> 1\n1 -{name}-> 1", alphabet=SIGMA) for name in "ab"}
    both = mdp
    for name, rule in rules.items():
        both = label_with_rule(both, rule, proposition=f"did_{name}")
    assert both.propositions == ("x", "y", "did_a", "did_b")
    machine = reward_machine(["did_a", "did_b"], [("0", "did_a & !did_b", "1", 1.0)])
    assert product(both, [], machine).origin.shape[1] == 4


def test_a_rule_that_nothing_satisfies() -> None:
    nothing = replace(empty(Alphabet(("a",))), name="nothing")
    labelled = label_with_rule(random_process(0), nothing)
    assert not (labelled.label >> 2).any()
    assert machine_from_rule(nothing).step(0, set()) == (0, 0.0)


def test_bad_propositions() -> None:
    mdp = random_process(0)
    rule = from_text("marked 1\n0 -a-> 1", alphabet=SIGMA)
    for make in (partial(label_with_rule, mdp), machine_from_rule):
        with pytest.raises(RuleError, match="the rule has no name; say proposition="):
            make(rule)
        with pytest.raises(RuleError, match="proposition 'never again': a word other than"):
            make(rule, proposition="never again")
    with pytest.raises(MDPError, match="has a proposition 'x' already"):
        label_with_rule(mdp, rule, proposition="x")
    with pytest.raises(MDPError, match="has a proposition 'over' already"):
        label_end(label_end(mdp))

"""Plants that see the state, and plants as decision processes, against their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from processes import SIGMA, outcomes_of, random_process, random_rule, wild_process
from strategies import SEEDS, automata
from supremal import (
    Alphabet,
    Automaton,
    MDPError,
    TabularMDP,
    evaluate,
    from_outcomes,
    from_text,
    is_isomorphic,
    is_same_language,
    mark_all,
    plant_automaton,
    product,
    project,
    safe_actions,
    synthesize,
    value_iteration,
)
from supremal.decisions.plant import observed_plant
from supremal.decisions.plant_process import process_of, undisturbed
from supremal.decisions.product import broken_states
from supremal.decisions.safety import reachable_states
from supremal.envs import PickupDelivery

# --- a supervisor that sees the state -----------------------------------------------------------------------


def enabled_choices(plant: Automaton, s: int, possible: np.ndarray, feasible: set[str]) -> set[str]:
    """The choices that a supervisor leaves in a state of the plant, of which ``possible`` is left."""
    names = plant.alphabet.names
    offered = {e: names[e] for e in np.flatnonzero(plant.delta[s] >= 0).tolist()}
    left = {name for e, name in offered.items() if possible[e]}
    if any(name[0] == "?" for name in offered.values()):
        return {name[1:] for name in left if name[0] == "?"}
    free = {name for name in offered.values() if name not in plant.alphabet.uncontrollable}
    return left & free if free == feasible else feasible  # where the choice is moot, all are enabled


@settings(max_examples=100)
@given(SEEDS, st.booleans(), st.sampled_from([0.0, 0.3, 0.6]), st.booleans())
def test_synthesis_on_the_observed_plant_is_the_safe_mask(
    seed: int,
    nonblocking: bool,  # noqa: FBT001
    owing: float,
    wild: bool,  # noqa: FBT001
) -> None:
    mdp = wild_process(seed) if wild else random_process(seed, silent=True)
    rules = [random_rule(seed, owing=owing), random_rule(seed + 1, states=2)]
    if not nonblocking:
        rules = [mark_all(rule) for rule in rules]  # then marked states play no part in synthesis
    plant = observed_plant(mdp)
    supervisor = synthesize(plant, rules, nonblocking=nonblocking, must_act=True)
    p = product(mdp, rules)
    enabled = safe_actions(p, nonblocking=nonblocking)
    safe = (p.terminal & ~broken_states(p)) | enabled.any(axis=1)
    assert supervisor.is_empty == (not safe[p.initial > 0].all())
    if supervisor.is_empty:
        return
    found = {}
    for row, possible in zip(
        supervisor.automaton.origin.tolist(), supervisor.automaton.delta >= 0, strict=True
    ):
        s = int(plant.origin[row[0], 0])
        if s >= 0:
            feasible = {p.actions[a] for a in np.flatnonzero(mdp.feasible[s] & ~mdp.terminal[s])}
            ahead = {a for a in feasible if safe_actions(mdp, nonblocking=False)[s, p.actions.index(a)]}
            columns = [supervisor.automaton.alphabet.index(name) for name in plant.alphabet]
            found[s, *row[1:]] = enabled_choices(plant, row[0], possible[columns], ahead)
    expected = {
        tuple(p.origin[i].tolist()): {p.actions[a] for a in np.flatnonzero(enabled[i])}
        for i in np.flatnonzero(reachable_states(p, enabled))
    }
    assert found == expected


@pytest.mark.parametrize("seed", range(20))
def test_without_what_is_seen_the_words_are_those_of_the_process(seed: int) -> None:
    mdp = random_process(seed, silent=True)
    heard = project(observed_plant(mdp), mdp.alphabet.names)
    assert is_same_language(mark_all(heard), mark_all(plant_automaton(mdp)))


@pytest.mark.parametrize("preset", ["default", "published"])
def test_words_tell_all_on_the_grid(preset: str) -> None:
    grid = PickupDelivery(preset=preset).model()
    plant = observed_plant(grid)
    assert plant.alphabet == grid.alphabet
    assert is_isomorphic(mark_all(plant), mark_all(plant_automaton(grid)))
    between = [-1] * (plant.n_states - grid.n_states)
    assert plant.origin[:, 0].tolist() == [*range(grid.n_states), *between]
    assert plant.marked.tolist() == [*(grid.marked | grid.terminal).tolist(), *(False for _ in between)]


def arrows(plant: Automaton) -> set[tuple[int, str, int]]:
    """The transitions, between states of the process; -1 is any state in the middle of a word."""
    at = plant.origin[:, 0].tolist()
    names = plant.alphabet.names
    return {(at[s], names[e], at[plant.delta[s, e]]) for s, e in np.argwhere(plant.delta >= 0).tolist()}


def test_a_state_is_seen_where_a_word_does_not_tell_it() -> None:
    lines = [(0, "a", 0, 0.4, ("a",)), (0, "a", 1, 0.4, ("a",)), (0, "a", 2, 0.2, ("a", "u"))]
    plant = observed_plant(from_outcomes(lines, alphabet=SIGMA, terminal=[1, 2]))
    assert arrows(plant) == {(0, "a", -1), (-1, "@0", 0), (-1, "@1", 1), (-1, "u", 2)}
    assert plant.alphabet.uncontrollable == {"u", "@0", "@1"}


def test_a_choice_is_an_event_where_its_words_do_not_show_it() -> None:
    lines = [(0, "slow", 1, 1.0, ("a",)), (0, "fast", 2, 1.0, ("a",)), (0, "rest", 0, 1.0, ())]
    plant = observed_plant(from_outcomes(lines, alphabet=SIGMA, terminal=[1, 2]))
    assert arrows(plant) == {
        *((0, f"?{action}", -1) for action in ("slow", "fast")),
        (-1, "a", 1),
        (-1, "a", 2),
        (0, "?rest", 0),
    }
    assert plant.alphabet.uncontrollable == {"u"}


def test_what_chance_decides_is_announced() -> None:
    lines = [(0, "a", 1, 0.5, ("a", "a")), (0, "a", 2, 0.5, ("a", "b"))]
    plant = observed_plant(from_outcomes(lines, alphabet=SIGMA, terminal=[1, 2]))
    assert plant.alphabet.names == ("a", "b", "u", "!a", "!b")
    assert plant.accepts(["a", "!a", "a"])
    assert plant.accepts(["a", "!b", "b"])
    assert plant.alphabet.uncontrollable == {"u", "!a", "!b"}


def test_several_starts_and_numbers_of_the_environment() -> None:
    line = from_outcomes([(0, "a", 1, 1.0, ("a",)), (1, "a", 2, 1.0, ("a",))], alphabet=SIGMA, terminal=[2])
    mdp = TabularMDP(
        **{name: getattr(line, name) for name in line.__dataclass_fields__}
        | {"initial": [0.5, 0.5, 0.0], "origin": [[7], [8], [9]]}
    )
    assert arrows(observed_plant(mdp)) == {(-1, "@7", 0), (-1, "@8", 1), (0, "a", 1), (1, "a", 2)}


def test_an_action_into_a_dead_end_is_none() -> None:
    lines = [(0, "a", 1, 0.5, ("a",)), (0, "a", 2, 0.5, ("a",)), (0, "b", 2, 1.0, ("b",))]
    fork = from_outcomes(lines, alphabet=SIGMA, terminal=[2])
    assert arrows(observed_plant(fork)) == {(0, "b", 2)}
    assert observed_plant(from_outcomes(lines[:2], alphabet=SIGMA, terminal=[2])).n_states == 0


def test_names_that_are_taken() -> None:
    sigma = Alphabet(("a", "@1"))
    lines = [(0, "a", 0, 0.5, ("a",)), (0, "a", 1, 0.5, ("a",)), (1, "a", 1, 1.0, ("@1",))]
    with pytest.raises(MDPError, match="event '@1' has the name of one that the observed plant needs; give"):
        observed_plant(from_outcomes(lines, alphabet=sigma))


# --- a plant as a process -----------------------------------------------------------------------------------


def chances(seed: int) -> dict[str, float]:
    """Chances of u and v that sum to less than 1."""
    u, v, _ = np.random.default_rng(seed).dirichlet([1, 1, 1]) + 1e-6
    return {"u": float(u / 1.01), "v": float(v / 1.01)}


def known(plant: Automaton, seed: int) -> dict[str, float]:
    return {name: chance for name, chance in chances(seed).items() if name in plant.alphabet}


@given(automata(min_states=1, missing=0.5, missing_uncontrollable=0.6), SEEDS)
def test_process_is_that_of_the_definition(plant: Automaton, seed: int) -> None:
    chance = known(plant, seed)
    mdp = process_of(plant, chance)
    assert mdp.origin[0, 0] == 0
    number = {int(q): s for s, q in enumerate(mdp.origin[:, 0])}
    reached = set()
    todo = [0]
    while todo:
        q = todo.pop()
        if q in reached:
            continue
        reached.add(q)
        s, to = number[q], {e: int(plant.delta[q, plant.alphabet.index(e)]) for e in plant.alphabet}
        to = {e: t for e, t in to.items() if t >= 0}
        todo += to.values()
        forced = {e: t for e, t in to.items() if e in plant.alphabet.uncontrollable}
        free = {e: t for e, t in to.items() if e not in forced}
        total = sum(chance[e] for e in forced)
        expected = {}
        for e, t in free.items():
            pre_empted = {(u, number[v]): chance[u] for u, v in forced.items()}
            expected[e] = pre_empted | {(e, number[t]): 1 - total}
        if forced and not free:
            expected["wait"] = {(u, number[v]): chance[u] / total for u, v in forced.items()}
        if not to and not plant.marked[q]:
            expected["wait"] = {("", s): 1.0}
        got = {
            name: {
                ("".join(word), t): pytest.approx(p, abs=1e-12) for t, p, _, word in outcomes_of(mdp, s, a)
            }
            for a, name in enumerate(mdp.actions)
            if mdp.feasible[s, a]
        }
        assert got == expected
        assert mdp.terminal[s] == (not to and plant.marked[q])
        assert mdp.marked[s] == plant.marked[q]
    assert sorted(reached) == mdp.origin[:, 0].tolist()


@given(automata(min_states=1, missing=0.5, missing_uncontrollable=0.6), SEEDS)
def test_its_observed_plant_is_the_plant(plant: Automaton, seed: int) -> None:
    assert is_isomorphic(observed_plant(process_of(plant, known(plant, seed))), plant)


@given(automata(min_states=1, max_events=4), SEEDS)
def test_undisturbed_is_the_definition(plant: Automaton, seed: int) -> None:
    mdp = process_of(plant, known(plant, seed))
    calm = undisturbed(mdp)
    for s in range(mdp.n_states):
        for a in range(mdp.n_actions):
            outcomes = outcomes_of(mdp, s, a)
            kept = [one for one in outcomes if not set(one[3]) & plant.alphabet.uncontrollable] or outcomes
            total = sum(p for _, p, _, _ in kept)
            assert outcomes_of(calm, s, a) == [
                (t, pytest.approx(p / total), r, word) for t, p, r, word in kept
            ]


def test_without_a_drop_the_grid_takes_35_steps() -> None:
    grid = PickupDelivery()
    steps = []
    for mdp in (undisturbed(grid.model()), PickupDelivery(drop_probability=0.0).model()):
        p = product(mdp, (), grid.reward_machine())
        plan = value_iteration(p, gamma=0.9)
        steps.append(evaluate(p, plan.policy, gamma=0.9).expected_steps)
    assert steps == pytest.approx([35, 35], abs=1e-8)


MACHINE = """
    name machine
    uncontrollable finish, break
    marked idle
    idle -start-> busy
    busy -finish-> idle
    busy -break-> down
    busy -wait-> busy
    down -repair-> idle
"""


@pytest.mark.parametrize(
    ("chance", "said"),
    [
        (
            {"finish": 0.5},
            "plant 'machine': uncontrollable event 'break' can happen, but has no chance; give it",
        ),
        ({"finish": 0.5, "break": 0.0}, "chance of 'break' is 0.0; a number above 0, at most 1, is needed"),
        ({"finish": 0.5, "break": float("nan")}, "chance of 'break' is nan; a number"),
        ({"finish": 0.5, "brake": 0.1}, "event 'brake' has a chance, but is unknown; did you mean 'break'"),
        (
            {"finish": 0.5, "break": 0.1, "start": 1.0},
            "'start' has a chance, but is controllable, and happens",
        ),
        (
            {"finish": 0.8, "break": 0.4},
            "in state 'busy' of plant 'machine' .* finish, break sum to 1.2; at most",
        ),
    ],
)
def test_bad_chances_say_what_is_wrong(chance: dict[str, float], said: str) -> None:
    with pytest.raises(MDPError, match=said):
        process_of(from_text(MACHINE), chance)


def test_chances_that_sum_to_one_leave_nothing_to_choose() -> None:
    process = process_of(from_text(MACHINE), {"finish": 0.7, "break": 0.3})
    busy = process.outcomes(1, process.actions.index("wait"))
    assert [process.spell(w) for w in process.word[busy]] == [("finish",), ("break",)]
    assert process.actions == ("start", "wait", "repair")


def test_waiting_has_a_name_of_its_own() -> None:
    clock = from_text("uncontrollable wait \n 0 -wait-> 1 \n 1 -go-> 0")
    assert process_of(clock, {"wait": 1.0}).actions == ("go", "wait'")


def test_an_empty_plant_is_no_process_and_one_state_is() -> None:
    with pytest.raises(MDPError, match="plant 'nil' is empty"):
        process_of(from_text("name nil"), {})
    assert process_of(from_text("initial rest"), {}).terminal.tolist() == [True]

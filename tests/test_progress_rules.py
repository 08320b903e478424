"""Rules that owe something: marked states count on decision processes as they do on automata."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from processes import (
    SIGMA,
    arrive,
    feasible_pairs,
    outcomes_of,
    random_process,
    random_rule,
    wild_process,
)
from supremal import (
    Automaton,
    Settings,
    TabularMDP,
    evaluate,
    from_outcomes,
    from_text,
    mark_all,
    product,
    q_learning,
    safe_actions,
)
from supremal.decisions.product import broken_states
from supremal.learning.monitors import word_monitor

pytestmark = pytest.mark.engine
SEEDS = range(40)
State = tuple[int, ...]


def two_rules(seed: int) -> list[Automaton]:
    return [random_rule(seed, owing=0.4), random_rule(seed + 500, states=2, owing=0.2)]


# --- what may be done: the greatest mask, straight from the process and its rules ---------------------------


def supremal_mask(mdp: TabularMDP, rules: list[Automaton], *, nonblocking: bool) -> dict[State, set[int]]:
    """Take out what breaks a rule, what leaves nothing to do, and what leads nowhere, until nothing goes.

    A state is (s, q₁, …, qₙ); what is left of its actions is returned, of a terminal one the empty set.
    """
    steps: dict[State, dict[int, list[State]]] = {}
    todo = [
        (int(s), *(arrive(mdp, rule, 0, (), int(s)) for rule in rules)) for s in np.flatnonzero(mdp.initial)
    ]
    feasible = feasible_pairs(mdp)
    while todo:
        state = todo.pop()
        if state in steps or min(state) < 0:
            continue
        steps[state] = {
            a: [
                (t, *(arrive(mdp, rule, q, word, t) for rule, q in zip(rules, state[1:], strict=True)))
                for t, _, _, word in outcomes_of(mdp, state[0], a)
            ]
            for s, a in feasible
            if s == state[0]
        }
        todo += [to for ways in steps[state].values() for to in ways]

    def complete(state: State) -> bool:
        satisfied = all(rule.marked[q] for rule, q in zip(rules, state[1:], strict=True))
        return bool(mdp.terminal[state[0]] or (mdp.marked[state[0]] and satisfied))

    good = set(steps)
    while True:
        mask = {s: {a for a, ways in steps[s].items() if set(ways) <= good} for s in good}
        left = {s for s in good if mask[s] or mdp.terminal[s[0]]}
        if nonblocking:
            alive = {s for s in left if complete(s)}
            while more := {s for s in left for a in mask[s] if alive & set(steps[s][a])} - alive:
                alive |= more
            left = alive
        if left == good:
            return mask
        good = left


@pytest.mark.parametrize("nonblocking", [True, False])
@pytest.mark.parametrize("wild", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_safe_actions_are_those_of_the_definition(seed: int, wild: bool, nonblocking: bool) -> None:  # noqa: FBT001
    mdp, rules = wild_process(seed) if wild else random_process(seed), two_rules(seed)
    p = product(mdp, rules)
    enabled = safe_actions(p, nonblocking=nonblocking)
    safe = enabled.any(axis=1) | (p.terminal & ~broken_states(p))
    got = {tuple(p.origin[i].tolist()): set(np.flatnonzero(enabled[i])) for i in np.flatnonzero(safe)}
    assert got == supremal_mask(mdp, rules, nonblocking=nonblocking)


# --- what is broken: the product, the monitors and the definition agree -------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_an_episode_ends_in_a_sink_exactly_if_monitors_count(seed: int) -> None:
    mdp, rules, rng = random_process(seed, silent=True), two_rules(seed), np.random.default_rng(seed)
    p, monitor = product(mdp, rules), word_monitor(mdp, rules)
    broken = broken_states(p)
    for _ in range(30):
        i, m, count = int(p.initial.argmax()), 0, 0
        for _ in range(30):
            choices = np.flatnonzero(p.feasible[i])
            if p.terminal[i] or not choices.size:
                break
            at = p.outcomes(i, int(rng.choice(choices)))
            o = int(rng.integers(at.start, at.stop))
            count += int(monitor.breaks[m, p.word[o]])
            i, m = int(p.next_state[o]), int(monitor.next_state[m, p.word[o]])
            count += int(monitor.owed[m]) if p.terminal[i] else 0
        assert broken[i] == (count > 0)


def test_owed_counts_the_rules_that_are_not_marked() -> None:
    mdp = from_outcomes([(0, "a", 0, 0.5, ("a",)), (0, "a", 0, 0.5, ("b",))], alphabet=SIGMA)
    even = from_text("marked 0 \n 0 -a-> 1 \n 1 -a-> 0", alphabet=SIGMA)
    monitor = word_monitor(mdp, [even, replace(even, marked=np.array([False, True])), mark_all(even)])
    assert monitor.owed.tolist() == [1, 1]
    assert word_monitor(mdp, [even, even]).owed.tolist() == [0, 2]
    assert word_monitor(mdp, [from_text("", alphabet=SIGMA)]).owed.tolist() == [1]


# --- a response: every a is to be answered by a b -----------------------------------------------------------

RESPONSE = from_text(
    "marked calm \n calm -a-> owing \n calm -b-> calm \n owing -a-> owing \n owing -b-> calm"
)
LEAVE = from_outcomes(
    [
        (0, "a", 1, 1.0, ("a",)),
        (0, "b", 2, 1.0, ("b",)),
        (1, "a", 2, 1.0, ("a",)),
        (1, "b", 2, 0.75, ("b",)),
        (1, "b", 1, 0.25, ("b", "a")),
    ],
    alphabet=SIGMA,
    terminal=[2],
)


def test_an_end_with_something_owed_is_a_broken_rule() -> None:
    p = product(LEAVE, [RESPONSE])
    assert p.origin.tolist() == [[0, 0], [1, 1], [2, 0], [-1, -1]]
    assert p.terminal.tolist() == [False, False, True, True]
    assert p.marked.tolist() == [False, False, True, False]
    assert safe_actions(p)[:2].tolist() == [[True, True], [False, True]]
    assert not broken_states(product(LEAVE, [mark_all(RESPONSE)])).any()


def test_what_is_owed_can_always_still_be_given() -> None:
    lines = [
        (0, "a", 0, 1.0, ("a",)),
        (0, "b", 0, 1.0, ("b",)),
        (0, "u", 1, 1.0, ("u",)),
        (1, "a", 1, 1.0, ("a",)),
    ]
    for_ever = from_outcomes(lines, alphabet=SIGMA, marked=[0, 1])
    p = product(for_ever, [RESPONSE])
    assert p.marked.tolist() == [owing == 0 for _, owing in p.origin.tolist()]
    left = {(*p.origin[s].tolist(), p.actions[a]) for s, a in np.argwhere(safe_actions(p))}
    assert left == {(0, 0, "a"), (0, 0, "b"), (0, 1, "a"), (0, 1, "b")}
    assert safe_actions(p, nonblocking=False).sum() == p.feasible.sum()
    assert safe_actions(product(for_ever, [mark_all(RESPONSE)])).sum() == p.feasible.sum()


def test_violation_counts_what_is_owed_at_the_end() -> None:
    p = product(LEAVE, [RESPONSE])
    for chance in (0.0, 0.5, 1.0):  # of not answering
        policy = np.array([[1.0, 0.0], [chance, 1 - chance], [0.0, 0.0], [0.0, 0.0]])
        result = evaluate(p, policy, gamma=0.9)
        answered = 0.75 * (1 - chance)
        assert result.violation == pytest.approx(chance / (chance + answered), abs=1e-9)
        assert result.completion == pytest.approx(answered / (chance + answered), abs=1e-9)


TWICE = from_outcomes([(0, "a", 1, 1.0, ("a",)), (1, "a", 2, 1.0, ("a",))], alphabet=SIGMA, terminal=[2])


@pytest.mark.parametrize(("steps", "violations"), [(1, 0), (2, 2), (3, 2)])
def test_a_learner_counts_what_is_owed_at_the_end_and_not_at_the_limit(steps: int, violations: int) -> None:
    settings = Settings(episodes=3, episode_steps=steps)
    result = q_learning(TWICE, rules=[RESPONSE, RESPONSE, mark_all(RESPONSE)], settings=settings)
    assert result.violations.tolist() == [violations] * 3


# --- the start ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_the_product_starts_where_the_definition_does(seed: int) -> None:
    mdp, rules = wild_process(seed), two_rules(seed)
    expected: dict[State, float] = {}
    for s in np.flatnonzero(mdp.initial).tolist():
        after = [arrive(mdp, rule, 0, (), s) for rule in rules]
        state = (s, *after) if min(after) >= 0 else (-1, *(min(q, 0) for q in after))
        expected[state] = expected.get(state, 0.0) + float(mdp.initial[s])
    p = product(mdp, rules)
    starts = np.flatnonzero(p.initial)
    assert {tuple(p.origin[i].tolist()): p.initial[i] for i in starts} == pytest.approx(expected)


def test_an_episode_that_is_over_at_once_owes_what_its_rules_do() -> None:
    over = from_outcomes([(1, "a", 0, 1.0, ("a",))], alphabet=SIGMA, terminal=[0])
    asks = from_text("marked done \n 0 -a-> done", alphabet=SIGMA)
    assert product(over, [RESPONSE]).origin.tolist() == [[0, 0]]
    assert product(over, [RESPONSE, asks]).origin.tolist() == [[-1, 0, -1]]
    result = q_learning(over, rules=[RESPONSE, asks], settings=Settings(episodes=1))
    assert (result.lengths.tolist(), result.violations.tolist()) == ([0], [1])

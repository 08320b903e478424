"""The product, the safe set, planning and evaluation against their definitions."""

from __future__ import annotations

from itertools import chain, combinations
from itertools import product as tuples

import numpy as np
import pytest

from processes import (
    SIGMA,
    arrive,
    feasible_pairs,
    is_safe_mask,
    matrices,
    outcomes_of,
    random_process,
    random_rule,
)
from supremal import (
    Alphabet,
    AlphabetError,
    MDPError,
    RuleError,
    TabularMDP,
    evaluate,
    find_dead_end,
    from_outcomes,
    from_text,
    plant_automaton,
    product,
    reward_machine,
    safe_actions,
    value_iteration,
)
from supremal.decisions.mdp import restrict
from supremal.decisions.product import broken_states
from supremal.decisions.safety import reachable_states

pytestmark = pytest.mark.engine
SEEDS = range(40)

MACHINE = reward_machine(
    ["y", "x"], [("0", "x & !y", "1", 2.0), ("1", "y", "0", -1.0), ("1", "!y", "1", 0.5)], initial="0"
)


def with_rules(seed: int) -> TabularMDP:
    rules = [random_rule(seed), random_rule(seed + 1000, owing=0.3)]
    return product(random_process(seed, silent=seed % 2 == 0), rules)


@pytest.mark.parametrize("seed", SEEDS)
def test_product_is_that_of_the_definition(seed: int) -> None:
    mdp = random_process(seed, silent=True)
    rules = [random_rule(seed, owing=0.3), random_rule(seed + 500, owing=0.3 * (seed % 2))]
    got = product(mdp, rules, MACHINE)
    expected: dict[tuple[int, ...], dict[int, list[tuple[object, ...]]]] = {}
    todo = [(0, 0, 0, 0)]
    while todo:
        state = todo.pop()
        if state in expected:
            continue
        s, *qs, u = state
        expected[state] = {}
        if s < 0 or mdp.terminal[s]:
            continue
        for a in range(mdp.n_actions):
            rows: list[tuple[object, ...]] = []
            for t, p, _, word in outcomes_of(mdp, s, a):
                after = [arrive(mdp, rule, q, word, t) for rule, q in zip(rules, qs, strict=True)]
                true = {name for i, name in enumerate(mdp.propositions) if mdp.label[t] >> i & 1}
                v, r = MACHINE.step(u, true)
                to = (t, *after, v) if min(after) >= 0 else (-1, *(min(q, 0) for q in after), 0)
                rows.append((to, p, r, word))
                todo.append(to)
            expected[state][a] = rows
    origins = [tuple(row) for row in got.origin.tolist()]
    assert sorted(origins) == sorted(expected)
    for i, state in enumerate(origins):
        for a, rows in expected[state].items():
            assert [(origins[t], p, r, w) for t, p, r, w in outcomes_of(got, i, a)] == rows
        s = state[0]
        assert got.terminal[i] == (s < 0 or mdp.terminal[s])
        satisfied = all(q >= 0 and rule.marked[q] for rule, q in zip(rules, state[1:], strict=False))
        assert got.marked[i] == (s >= 0 and mdp.marked[s] and satisfied)
        assert got.label[i] == (0 if s < 0 else mdp.label[s])


@pytest.mark.parametrize("nonblocking", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_safe_actions_are_the_union_of_all_safe_masks(seed: int, nonblocking: bool) -> None:  # noqa: FBT001
    p = product(random_process(seed, states=4), [random_rule(seed, states=2, owing=0.3)])
    pairs, broken = feasible_pairs(p), set(np.flatnonzero(broken_states(p)).tolist())
    if len(pairs) > 11:
        pairs = pairs[:11]
        kept = np.zeros((p.n_states, p.n_actions), np.bool_)
        kept[tuple(np.array(pairs).T)] = True
        p = restrict(p, kept)
    subsets = chain.from_iterable(combinations(pairs, n) for n in range(len(pairs) + 1))
    safe = [set(mask) for mask in subsets if is_safe_mask(p, broken, set(mask), nonblocking=nonblocking)]
    got = {(int(s), int(a)) for s, a in np.argwhere(safe_actions(p, nonblocking=nonblocking))}
    assert got == set().union(*safe)
    assert got in safe


@pytest.mark.parametrize("seed", SEEDS)
def test_under_the_safe_mask_some_policy_ends_with_probability_one(seed: int) -> None:
    p = with_rules(seed)
    enabled = safe_actions(p)
    if not enabled[0].any():
        return
    uniform = np.where(enabled, 1.0, 0.0) / np.maximum(enabled.sum(axis=1, keepdims=True), 1)
    result = evaluate(p, uniform, gamma=0.9)
    assert np.isfinite(result.expected_steps)
    assert result.violation == 0.0
    assert find_dead_end(p, enabled) is None


def test_one_step_lookahead_walks_into_a_dead_end_and_full_lookahead_does_not() -> None:
    corridor = from_outcomes(
        [
            (0, "in", 1, 1.0, ("in",)),
            (0, "wait", 0, 0.5, ("wait",)),
            (0, "wait", 3, 0.5, ("wait",)),
            (1, "out", 2, 1.0, ("out",)),
            (2, "out", 3, 1.0, ("out",)),
        ],
        alphabet=Alphabet(("in", "wait", "out")),
        terminal=[3],
    )
    never_out_twice = from_text("0 -in, wait-> 0\n 0 -out-> 1\n 1 -in, wait-> 0", alphabet=corridor.alphabet)
    p = product(corridor, [never_out_twice])
    one, full = safe_actions(p, lookahead="one_step"), safe_actions(p)
    assert find_dead_end(p, one) == ("in", "out")
    assert find_dead_end(p, full) is None
    assert [p.actions[a] for a in np.flatnonzero(full[0])] == ["wait"]
    with pytest.raises(MDPError, match="leaves no action after in out"):
        value_iteration(p, gamma=0.9, enabled=one)


def test_nonblocking_keeps_a_way_to_the_end() -> None:
    trap = from_outcomes(
        [(0, "go", 1, 1.0, ("go",)), (0, "stay", 2, 1.0, ("stay",)), (2, "stay", 2, 1.0, ("stay",))],
        alphabet=Alphabet(("go", "stay")),
        terminal=[1],
    )
    assert safe_actions(trap).tolist() == [[True, False], [False, False], [False, False]]
    assert safe_actions(trap, nonblocking=False)[[0, 2]].tolist() == [[True, True], [False, True]]


@pytest.mark.parametrize("seed", SEEDS)
def test_value_iteration_is_the_best_of_all_policies(seed: int) -> None:
    mdp, gamma = random_process(seed), 0.8
    choices = [np.flatnonzero(row) if row.any() else [-1] for row in mdp.feasible]
    best = np.full(mdp.n_states, -np.inf)
    for policy in tuples(*choices):
        p, r = matrices(mdp, np.array(policy))
        best = np.maximum(best, np.linalg.solve(np.eye(mdp.n_states) - gamma * p, r))
    plan = value_iteration(mdp, gamma=gamma)
    assert np.abs(plan.value - best).max() <= plan.bound + 1e-12
    assert plan.bound < 1e-9
    p, r = matrices(mdp, plan.policy)
    np.testing.assert_allclose(np.linalg.solve(np.eye(mdp.n_states) - gamma * p, r), best, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_evaluation_is_that_of_linear_algebra(seed: int) -> None:
    p, gamma, horizon = with_rules(seed), 0.9, 7
    rng = np.random.default_rng(seed)
    if (~p.feasible.any(axis=1) & ~p.terminal & reachable_states(p)).any():
        return
    policy = np.array([rng.choice(np.flatnonzero(row)) if row.any() else -1 for row in p.feasible])
    got = evaluate(p, policy, gamma=gamma, horizon=horizon)
    matrix, reward = matrices(p, policy)
    value = np.linalg.solve(np.eye(p.n_states) - gamma * matrix, reward)
    assert abs(got.value - value[0]) <= got.bound + 1e-10

    def reach(goals: np.ndarray) -> float:
        """Iterate so often that what is left is below rounding, or the least solution is found."""
        x = goals.astype(float)
        step = np.where(goals[:, None], 0.0, matrix)
        for _ in range(20_000):
            x = np.where(goals, 1.0, step @ x)
        return float(x[0])

    assert got.completion == pytest.approx(reach(p.marked), abs=1e-9)
    assert got.violation == pytest.approx(reach(broken_states(p)), abs=1e-9)
    if reach(p.terminal) > 1 - 1e-9:
        on = ~p.terminal & reachable_states(p, np.arange(p.n_actions) == policy[:, None])
        inner = matrix[np.ix_(on, on)]
        steps = np.linalg.solve(np.eye(on.sum()) - inner, np.ones(on.sum())) if p.initial[on].any() else [0.0]
        total = np.linalg.solve(np.eye(on.sum()) - inner, reward[on]) if p.initial[on].any() else [0.0]
        assert got.expected_steps == pytest.approx(steps[0], rel=1e-8)
        assert got.expected_return == pytest.approx(total[0], rel=1e-8, abs=1e-8)
    else:
        assert np.isinf(got.expected_steps)
        assert np.isnan(got.expected_return)
    absorbed = np.where(p.marked[:, None], np.eye(p.n_states), matrix)
    distribution = p.initial
    for n in range(horizon + 1):
        assert got.completion_within[n] == pytest.approx(distribution[p.marked].sum(), abs=1e-12)
        distribution = distribution @ absorbed


@pytest.mark.parametrize("seed", SEEDS)
def test_plant_generates_the_words_of_the_process(seed: int) -> None:
    mdp = random_process(seed, silent=seed % 3 == 0)
    plant = plant_automaton(mdp)
    words: set[tuple[str, ...]] = {()}
    seen, todo = set(), [(0, ())]
    while todo:
        s, word = todo.pop()
        if (s, word) in seen or len(word) > 5:
            continue
        seen.add((s, word))
        for a in range(mdp.n_actions):
            for t, _, _, more in outcomes_of(mdp, s, a) if not mdp.terminal[s] else []:
                words |= {(*word, *more[:n]) for n in range(len(more) + 1)}
                todo.append((t, (*word, *more)))
    short = {word for word in words if len(word) <= 5}
    generated = {word for n in range(6) for word in tuples(SIGMA.names, repeat=n) if plant.run(word) >= 0}
    assert generated == short


def test_a_rule_without_states_is_broken_at_once() -> None:
    mdp = random_process(1)
    p = product(mdp, [from_text("", alphabet=SIGMA)])
    assert p.n_states == 1
    assert broken_states(p).all()
    assert not safe_actions(p).any()


def outcome(prob: float) -> list[tuple[int, str, int, float, tuple[str, ...]]]:
    return [(0, "a", 0, prob, ("a",)), (0, "a", 1, 0.5, ("a",))]


def test_bad_models_say_what_is_wrong() -> None:
    with pytest.raises(
        MDPError, match="probabilities of action 'a' in state 0 sum to 0.7; they have to sum to 1"
    ):
        from_outcomes(outcome(0.2), alphabet=SIGMA)
    with pytest.raises(MDPError, match="has probability 0; leave out what cannot happen"):
        from_outcomes([*outcome(0.5), (0, "a", 1, 0.0, ("a",))], alphabet=SIGMA)
    with pytest.raises(AlphabetError, match="unknown event 'fly'"):
        from_outcomes([(0, "a", 0, 1.0, ("fly",))], alphabet=SIGMA)
    with pytest.raises(MDPError, match="unknown action 'c'; known: a"):
        from_outcomes([(0, "c", 0, 1.0, ("a",))], alphabet=SIGMA, actions=["a"])


def test_products_refuse_what_does_not_fit() -> None:
    mdp = random_process(3)
    with pytest.raises(
        AlphabetError, match="'u' is uncontrollable in one automaton and controllable in another"
    ):
        product(mdp, [from_text("0 -u-> 0")])
    with pytest.raises(RuleError, match="reads proposition 'z'"):
        product(mdp, (), reward_machine(["z"], [("0", "z", "0", 1.0)]))
    with pytest.raises(MDPError, match=r"environment \(5\), rule6 \(3\) states has more than 2"):
        product(random_process(6), [random_rule(6)], max_states=2)


@pytest.mark.parametrize("gamma", [-0.1, 1.0, float("nan")])
def test_gamma_out_of_range(gamma: float) -> None:
    with pytest.raises(MDPError, match="gamma is .*; a number from 0"):
        value_iteration(random_process(0), gamma=gamma)
    with pytest.raises(MDPError, match="gamma is"):
        evaluate(random_process(0), np.zeros(5, np.int32), gamma=gamma)


def test_bad_masks_and_policies() -> None:
    mdp = random_process(2)
    with pytest.raises(MDPError, match=r"mask has shape \(2, 2\) and type bool; bool \(5, 2\) is needed"):
        value_iteration(mdp, gamma=0.9, enabled=np.ones((2, 2), np.bool_))
    with pytest.raises(MDPError, match="where it is not feasible"):
        value_iteration(mdp, gamma=0.9, enabled=np.ones((5, 2), np.bool_))
    with pytest.raises(MDPError, match="leaves no action at the start"):
        value_iteration(mdp, gamma=0.9, enabled=np.zeros((5, 2), np.bool_))
    with pytest.raises(MDPError, match="policy has shape"):
        evaluate(mdp, np.zeros(3, np.int32), gamma=0.9)
    with pytest.raises(MDPError, match="gives feasible actions probability 0 in state 0"):
        evaluate(mdp, np.zeros((5, 2)), gamma=0.9)
    with pytest.raises(MDPError, match="actions are 0 to 1"):
        evaluate(mdp, np.full(5, 7), gamma=0.9)

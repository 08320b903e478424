"""Every algorithm against plain Python, bit for bit, and the exact solution; schedules and statistics."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as examples

from processes import SIGMA, outcomes_of, random_process, random_rule
from strategies import SEEDS
from supremal import (
    Alphabet,
    MDPError,
    Outcome,
    Settings,
    TabularMDP,
    from_outcomes,
    product,
    q_learning,
    q_learning_seeds,
    reward_machine,
    safe_actions,
    value_iteration,
)
from supremal._jit import COMPILED
from supremal.decisions.horizon import finite_horizon
from supremal.decisions.planning import enabled_choices
from supremal.learning.counterfactual import lessons_of
from supremal.learning.schedules import Schedule
from supremal.learning.settings import ALGORITHMS
from supremal.learning.statistics import bootstrap_interval, interquartile_mean, regret
from test_learning import choose, uniforms

ENGINE = pytest.mark.engine
CASES = tomllib.loads((Path(__file__).parent / "cases" / "planning.toml").read_text(encoding="utf-8"))["case"]
DISCOUNTED = [case for case in CASES if "gamma" in case]
MACHINE = reward_machine(
    ["x", "y"], [("u", "x", "v", 2.0), ("u", "!x", "u", -1.0), ("v", "y & !x", "u", 3.0)]
)


def supervised(seed: int) -> tuple[TabularMDP, TabularMDP, np.ndarray]:
    """Return an environment, its product with a rule and a machine, and a safe mask that lets it start."""
    while True:
        environment = random_process(seed, silent=True)
        mdp = product(environment, [random_rule(seed, owing=0.2)], MACHINE)
        mask = safe_actions(mdp)
        if mask[0].any():
            return environment, mdp, mask
        seed += 1000


@dataclass
class ByTheBook:
    """The algorithms as Sutton and Barto print them, on dictionaries."""

    mdp: TabularMDP
    mask: np.ndarray
    settings: Settings
    random: Iterator[float]
    columns: int = 0

    def __post_init__(self) -> None:
        pairs = [tuple(pair) for pair in np.argwhere(self.mask).tolist()]
        self.actions = {s: [a for t, a in pairs if t == s] for s in range(self.mdp.n_states)}
        self.q = [dict.fromkeys(pairs, 0.0) for _ in range(self.settings.tables)]
        self.seen = [dict.fromkeys(pairs, 0) for _ in self.q]

    def act(self, s: int, epsilon: float) -> int | None:
        u = next(self.random)
        able = self.actions[s]
        if u < epsilon and able:
            return able[min(int(u / epsilon * len(able)), len(able) - 1)]
        return max(able, key=lambda a: sum(q[s, a] for q in self.q), default=None)

    def worth(self, t: int, own: int, other: int, later: int | None, epsilon: float) -> float:
        able, q = self.actions[t], self.q[own]
        best = max(able, key=lambda a: q[t, a])
        if self.settings.algorithm == "sarsa":
            return q[t, later]
        if self.settings.algorithm == "expected_sarsa":
            return (1 - epsilon) * q[t, best] + epsilon * (sum(q[t, a] for a in able) / len(able))
        return self.q[other][t, best]

    def taught(self, s: int, a: int) -> list[int]:
        if not self.settings.counterfactual:
            return [s]
        part = self.mdp.origin[:, : self.columns].tolist()
        return [p for p in range(self.mdp.n_states) if part[p] == part[s] and (p, a) in self.q[0]]

    def episode(self, number: int) -> float:
        settings, mdp = self.settings, self.mdp
        epsilon, sarsa = settings.epsilon_at(number), settings.algorithm == "sarsa"
        rates = settings.alpha_schedule
        starts = np.flatnonzero(mdp.initial)
        s = int(starts[choose(mdp.initial[starts].tolist(), next(self.random))])
        a = self.act(s, epsilon) if sarsa else None
        score, steps, own, other = 0.0, 0, 0, 0
        while steps < settings.episode_steps and self.actions[s]:
            a = a if sarsa else self.act(s, epsilon)
            found = outcomes_of(mdp, s, a)
            k = choose([p for _, p, _, _ in found], next(self.random)) if len(found) > 1 else 0
            t, _, r, _ = found[k]
            if len(self.q) > 1:
                own, other = (1, 0) if next(self.random) < 0.5 else (0, 1)
            later = self.act(t, epsilon) if sarsa else None
            for p in self.taught(s, a):
                to, _, goal, _ = outcomes_of(mdp, p, a)[k]
                if self.actions[to]:
                    goal += settings.gamma * self.worth(to, own, other, later, epsilon)
                self.seen[own][p, a] += 1
                n, q = self.seen[own][p, a], self.q[own]
                alpha = n**-rates.power if rates.power else rates.at(number)
                q[p, a] = float(settings.dtype.type(q[p, a] + alpha * (goal - q[p, a])))
            score, steps, s, a = score + r, steps + 1, t, later
        return score


COMBINATIONS = {
    "q": Settings(alpha=Schedule.visits(0.8), epsilon=Schedule.linear(1.0, 0.2, episodes=30)),
    "q, counterfactual": Settings(
        counterfactual=True, alpha=Schedule.harmonic(0.5, episodes=20), epsilon=0.5
    ),
    "double": Settings(algorithm="double_q_learning", alpha=Schedule.visits(), epsilon=0.9),
    "double, counterfactual": Settings(
        algorithm="double_q_learning", counterfactual=True, alpha=Schedule.linear(0.5, 0.0, episodes=40)
    ),
    "sarsa": Settings(algorithm="sarsa", alpha=Schedule.visits(0.6), epsilon=0.7),
    "expected": Settings(algorithm="expected_sarsa", alpha=Schedule.visits(0.9), epsilon=0.7),
    "expected, counterfactual": Settings(
        algorithm="expected_sarsa", counterfactual=True, precision="float32", epsilon=0.4
    ),
}


@ENGINE
@pytest.mark.parametrize("name", COMBINATIONS)
@pytest.mark.parametrize("seed", range(4))
def test_kernels_are_the_book_bit_for_bit(name: str, seed: int) -> None:
    environment, mdp, mask = supervised(seed)
    settings = replace(COMBINATIONS[name], episodes=50, episode_steps=7)
    book = ByTheBook(mdp, mask, settings, uniforms(seed), environment.origin.shape[1])
    scores = [book.episode(n) for n in range(settings.episodes)]
    got = q_learning(
        mdp, enabled=mask, rules=[random_rule(seed)], settings=settings, seed=seed, environment=environment
    )
    assert got.returns.tolist() == scores
    assert got.q.dtype == settings.dtype
    mean = {key: sum(q[key] for q in book.q) / len(book.q) for key in book.q[0]}
    assert {key: float(got.q[key]) for key in mean} == mean
    assert np.isneginf(got.q[~mask]).all()


@given(seed=SEEDS)
@examples(max_examples=30)
def test_no_learner_ever_breaks_a_rule_under_the_mask(seed: int) -> None:
    environment = random_process(seed)
    rules = [random_rule(seed, owing=0.3), random_rule(seed + 1)]
    mdp = product(environment, rules)
    mask = safe_actions(mdp)
    if not mask[0].any():
        return
    for settings in COMBINATIONS.values():
        few = replace(settings, episodes=20, episode_steps=10)
        got = q_learning(mdp, enabled=mask, rules=rules, settings=few, seed=seed)
        assert not got.violations.any()
        assert np.isfinite(got.q[mask]).all()


@ENGINE
@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("case", DISCOUNTED, ids=lambda case: case["name"])
def test_learners_arrive_at_the_textbook_values(case: dict, algorithm: str) -> None:
    names = tuple(dict.fromkeys(line[1] for line in case["outcomes"]))
    mdp = from_outcomes(
        [Outcome(s, a, t, p, (a,), r) for s, a, t, p, r in case["outcomes"]],
        alphabet=Alphabet(names),
        terminal=case.get("terminal", []),
    )
    mdp = replace(mdp, initial=np.full(mdp.n_states, 1 / mdp.n_states))
    settings = Settings(
        episodes=40_000 if COMPILED else 300,
        episode_steps=20,
        alpha=Schedule.visits(0.7),
        gamma=min(case["gamma"], 0.6),
        epsilon=Schedule.harmonic(1.0, episodes=100),
        algorithm=algorithm,
    )
    learned = q_learning(mdp, settings=settings, seed=1)
    exact = value_iteration(mdp, gamma=settings.gamma)
    gap = np.abs(learned.q.max(axis=1) - exact.value).max() / np.abs(exact.value).max()
    assert gap < (0.02 if COMPILED else 0.5)


@ENGINE
@pytest.mark.parametrize("algorithm", ["q_learning", "double_q_learning", "expected_sarsa"])
def test_counterfactual_steps_lead_to_the_same_values(algorithm: str) -> None:
    environment, mdp, mask = supervised(3)
    settings = Settings(
        episodes=20_000 if COMPILED else 300,
        alpha=Schedule.visits(0.7),
        gamma=0.6,
        epsilon=Schedule.harmonic(1.0, episodes=200),
        counterfactual=True,
        algorithm=algorithm,
    )
    learned = q_learning(mdp, enabled=mask, settings=settings, environment=environment)
    exact = value_iteration(mdp, gamma=0.6, enabled=mask)
    tried = np.isfinite(learned.q) & (learned.q != 0)
    assert np.abs(learned.q[tried] - exact.q[tried]).max() < (0.15 if COMPILED else 3.0)


@pytest.mark.parametrize("seed", range(6))
def test_a_lesson_is_what_the_environment_says_wherever_rules_and_machine_are(seed: int) -> None:
    environment, mdp, mask = supervised(seed)
    choices = enabled_choices(mdp, mask)
    lessons = lessons_of(mdp, choices, environment)
    state, action = choices.state[lessons.owner], choices.action[lessons.owner]
    place = np.arange(len(state)) - choices.outcome[lessons.owner]
    said = list(zip(mdp.origin[state, 0].tolist(), action.tolist(), place.tolist(), strict=True))
    for o in range(len(state)):
        group = lessons.member[slice(*lessons.bound[lessons.group[o] :][:2])].tolist()
        assert group == [p for p in range(len(state)) if said[p] == said[o]]


def test_lessons_need_the_environment_where_it_has_several_parts() -> None:
    outcomes = [(0, "a", 1, 1.0, ("a",)), (1, "a", 2, 1.0, ("b",)), (0, "b", 2, 1.0, ("b",))]
    walk = from_outcomes(outcomes, alphabet=SIGMA, terminal=[2])
    two = replace(walk, origin=np.array([[0, 0], [0, 1], [1, 1]], np.int32))
    mdp, settings = (
        product(two, [random_rule(0)], MACHINE_OF_NOTHING),
        Settings(episodes=1, counterfactual=True),
    )
    assert q_learning(mdp, settings=settings, environment=two).finished
    with pytest.raises(MDPError, match="'a' has other outcomes in state .*give the environment"):
        q_learning(mdp, settings=settings)


MACHINE_OF_NOTHING = reward_machine([], [("u", "true", "u", -1.0)])


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"algorithm": "q_lerning"}, "unknown algorithm 'q_lerning'; did you mean 'q_learning'"),
        ({"precision": "float16"}, "unknown precision 'float16'; did you mean 'float"),
        (
            {"algorithm": "sarsa", "counterfactual": True},
            "'sarsa' learns only from actions that its own policy",
        ),
        ({"epsilon": Schedule.visits()}, "epsilon cannot go by visits"),
        ({"alpha": Schedule.constant(0.0)}, "alpha is .*; a number above 0, at most 1, is needed"),
    ],
)
def test_settings_that_do_not_go_together(said: dict, message: str) -> None:
    with pytest.raises(MDPError, match=message):
        Settings(**said)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"kind": "square"}, "kind is 'square'; one of constant, exponential, .* is needed"),
        ({"kind": "linear", "start": 1.0}, "kind 'linear' needs end"),
        ({"kind": "constant", "start": 1.0, "power": 1.0}, "kind 'constant' takes no power; leave it out"),
        ({"kind": "constant", "start": 1.5}, "start is 1.5; a number from 0 to 1 is needed"),
        ({"kind": "constant", "start": float("nan")}, "start is nan; a number from 0 to 1"),
        ({"kind": "visits", "power": 0.5}, "power is 0.5; a number above 0.5"),
        ({"kind": "harmonic", "start": 1.0, "episodes": 0}, "episodes is 0; a whole number from 1"),
        (
            {"kind": "exponential", "start": 1.0, "factor": 0.0, "episodes": 9},
            "factor is 0.0; a number above",
        ),
    ],
)
def test_bad_schedules(said: dict, message: str) -> None:
    with pytest.raises(MDPError, match=message):
        Schedule(**said)


def test_schedules_say_what_their_formulas_say() -> None:
    n = range(25)
    for schedule, formula in (
        (Schedule.constant(0.3), lambda _: 0.3),
        (Schedule.exponential(0.8, 0.9, episodes=4), lambda k: 0.8 * 0.9 ** (k // 4)),
        (Schedule.harmonic(0.6, episodes=5), lambda k: 0.6 * 5 / (5 + k)),
        (Schedule.visits(0.7), lambda k: (1.0 + k) ** -0.7),
    ):
        assert schedule.over(0, 25).tolist() == [schedule.at(k) for k in n]
        assert schedule.over(0, 25).tolist() == pytest.approx([formula(k) for k in n], rel=1e-15)
    line = Schedule.linear(0.9, 0.1, episodes=8)
    assert line.over(0, 25).tolist() == pytest.approx([0.9 - 0.1 * min(k, 8) for k in n])
    assert line.at(8) == line.at(10**12) == 0.1


def test_seeds_go_on_from_their_states() -> None:
    mdp, half = random_process(5), Settings(episodes=20, epsilon=0.5)
    kept: dict[int, object] = {}
    q_learning_seeds(mdp, [3, 4], settings=half, on_state=kept.__setitem__)
    whole = replace(half, episodes=45)
    on = q_learning_seeds(mdp, [3, 4], settings=whole, resume=[kept[0], None])
    for one, seed in zip(on, (3, 4), strict=True):
        np.testing.assert_array_equal(one.q, q_learning(mdp, settings=whole, seed=seed).q)
    with pytest.raises(MDPError, match="1 states to resume from, and 2 seeds"):
        q_learning_seeds(mdp, [3, 4], settings=whole, resume=[None])


# --- statistics over seeds --------------------------------------------------------------------------------


def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end() -> None:
    assert interquartile_mean([100.0, 1.0, 2.0, -50.0]) == 1.5
    assert interquartile_mean([7.0]) == 7.0
    assert interquartile_mean(np.arange(10.0)) == np.arange(2, 8).mean()
    scores = np.random.default_rng(0).normal(size=(7, 3))
    assert interquartile_mean(scores) == np.sort(scores.reshape(-1))[5:16].mean()
    with pytest.raises(MDPError, match="no score"):
        interquartile_mean([])


def test_bootstrap_intervals_hold_the_truth_as_often_as_they_say() -> None:
    rng = np.random.default_rng(1)
    hits = 0
    for trial in range(100):
        low, high = bootstrap_interval(rng.normal([0, 10], size=(20, 2)), np.mean, resamples=200, seed=trial)
        hits += low <= 5 <= high
    assert 0.86 <= hits / 100 <= 0.99


def test_bootstrap_keeps_to_its_strata_and_its_seed() -> None:
    scores = np.array(
        [[0.0, 10.0]] * 5
    )  # runs of a task are alike, so that resampling within it changes nothing
    assert bootstrap_interval(scores, np.mean) == (5.0, 5.0)
    spread = np.random.default_rng(2).normal(size=9)
    assert bootstrap_interval(spread, seed=3) == bootstrap_interval(spread, seed=3)
    assert bootstrap_interval(spread, seed=3) != bootstrap_interval(spread, seed=4)
    low, high = bootstrap_interval(spread, confidence=0.5)
    wide = bootstrap_interval(spread, confidence=0.99)
    assert wide[0] < low < high < wide[1]
    for wrong, message in (({"confidence": 1.0}, "confidence is 1.0"), ({"resamples": 0}, "resamples is 0")):
        with pytest.raises(MDPError, match=message):
            bootstrap_interval(spread, **wrong)


def test_regret_of_an_optimal_learner_stays_near_zero() -> None:
    environment, mdp, mask = supervised(3)
    settings = Settings(episodes=400, episode_steps=12, epsilon=0.5, counterfactual=True)
    best = float(finite_horizon(mdp, 12, enabled=mask).value[-1] @ mdp.initial)
    learned = q_learning(mdp, enabled=mask, settings=settings, environment=environment)
    curve = regret(learned.returns, best, interval=150)
    assert curve.tolist() == pytest.approx([n * best - learned.returns[:n].sum() for n in (150, 300, 400)])
    assert regret(np.full(5, best), best, interval=2).tolist() == [0.0, 0.0, 0.0]
    with pytest.raises(MDPError, match="interval is 0"):
        regret(learned.returns, best, interval=0)

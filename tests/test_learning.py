"""Algorithm 1: against plain Python, bit for bit; against the exact solution; and what it counts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from processes import SIGMA, follow, outcomes_of, random_process, random_rule
from supremal import (
    Automaton,
    MDPError,
    Settings,
    TabularMDP,
    from_outcomes,
    from_text,
    product,
    q_learning,
    q_learning_seeds,
    safe_actions,
    value_iteration,
)
from supremal._jit import COMPILED

pytestmark = pytest.mark.engine
_64 = (1 << 64) - 1


def uniforms(seed: int) -> Iterator[float]:
    """Yield SplitMix64 as its authors write it, in whole numbers, as 53 bits in [0, 1)."""
    state = int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])
    while True:
        state = (state + 0x9E3779B97F4A7C15) & _64
        z = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & _64
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _64
        yield ((z ^ (z >> 31)) >> 11) * 2.0**-53


def choose(weights: list[float], u: float) -> int:
    for k, weight in enumerate(weights[:-1]):
        if u < weight:
            return k
        u -= weight
    return len(weights) - 1


def algorithm_1(
    mdp: TabularMDP, mask: np.ndarray, rules: list[Automaton], settings: Settings, seed: int
) -> tuple[dict[tuple[int, int], float], list[tuple[float, int, bool, int]]]:
    """The paper's listing, line by line."""
    random = uniforms(seed)
    q = dict.fromkeys(map(tuple, np.argwhere(mask).tolist()), 0.0)
    actions = {s: [a for a in range(mdp.n_actions) if (s, a) in q] for s in range(mdp.n_states)}
    starts = np.flatnonzero(mdp.initial).tolist()
    episodes = []
    for episode in range(settings.episodes):
        epsilon = settings.epsilon * settings.epsilon_decay ** (episode // settings.decay_every)
        s = starts[choose(mdp.initial[starts].tolist(), next(random))]
        states, score, steps, broken, done = [0] * len(rules), 0.0, 0, 0, bool(mdp.marked[s])
        while steps < settings.episode_steps and not mdp.terminal[s]:
            best = max(actions[s], key=lambda a: q[s, a])
            u = next(random)
            a = (
                actions[s][min(int(u / epsilon * len(actions[s])), len(actions[s]) - 1)]
                if u < epsilon
                else best
            )
            outcomes = outcomes_of(mdp, s, a)
            t, _, r, word = outcomes[
                choose([p for _, p, _, _ in outcomes], next(random)) if len(outcomes) > 1 else 0
            ]
            for name in word:
                for k, rule in enumerate(rules):
                    to = follow(rule, states[k], (name,))
                    broken += to < 0
                    states[k] = max(to, 0)
            future = 0.0 if mdp.terminal[t] else max(q[t, b] for b in actions[t])
            target = r if mdp.terminal[t] else r + settings.gamma * future
            q[s, a] += settings.alpha * (target - q[s, a])
            score, steps, s, done = score + r, steps + 1, t, done or bool(mdp.marked[t])
        if mdp.terminal[s]:
            broken += sum(not rule.marked[q] for rule, q in zip(rules, states, strict=True))
        episodes.append((score, steps, done, broken))
    return q, episodes


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("supervised", [True, False])
def test_kernel_is_algorithm_1_bit_for_bit(seed: int, supervised: bool) -> None:  # noqa: FBT001
    rules = [random_rule(seed, owing=0.3), random_rule(seed + 100)]
    environment = random_process(seed, silent=True)
    mdp = product(environment, rules) if supervised else environment
    mask = safe_actions(mdp) if supervised else mdp.feasible & ~mdp.terminal[:, None]
    if not mask[0].any() or not mdp.feasible[~mdp.terminal].any(axis=1).all():
        return
    settings = Settings(
        episodes=60, episode_steps=8, alpha=0.3, epsilon=0.9, epsilon_decay=0.7, decay_every=25
    )
    got = q_learning(mdp, enabled=mask, rules=rules, settings=settings, seed=seed)
    q, episodes = algorithm_1(mdp, mask, rules, settings, seed)
    assert {key: got.q[key] for key in q} == q
    assert np.isneginf(got.q[~mask]).all()
    curves = (got.returns, got.lengths, got.completed, got.violations)
    assert list(zip(*(curve.tolist() for curve in curves), strict=True)) == episodes
    if supervised:
        assert got.violations.sum() == 0


@pytest.mark.parametrize("seed", range(4))
def test_learned_values_approach_the_exact_ones(seed: int) -> None:
    environment = random_process(seed)
    mdp = product(environment, [random_rule(seed)])
    mask = safe_actions(mdp)
    if not mask[0].any():
        return
    n = 60_000 if COMPILED else 600
    settings = Settings(
        episodes=n, alpha=0.01 if COMPILED else 0.2, gamma=0.7, epsilon=1.0, epsilon_decay=1.0
    )
    learned = q_learning(mdp, enabled=mask, settings=settings, seed=seed)
    exact = value_iteration(mdp, gamma=0.7, enabled=mask)
    tried = np.isfinite(learned.q) & (learned.q != 0)
    assert tried.any()
    assert np.abs(learned.q[tried] - exact.q[tried]).max() < (0.4 if COMPILED else 6.0)


def test_same_seed_same_result_and_seeds_side_by_side_are_those_one_by_one() -> None:
    mdp, settings = random_process(5), Settings(episodes=40, episode_steps=9)
    alone = [q_learning(mdp, settings=settings, seed=seed) for seed in (3, 4)]
    told: list[tuple[int, int]] = []
    together = q_learning_seeds(mdp, [3, 4], settings=settings, on_episodes=lambda *at: told.append(at))
    assert sorted(told) == [(0, 40), (1, 40)]
    for one, other in zip(alone, together, strict=True):
        assert one.seed == other.seed
        np.testing.assert_array_equal(one.q, other.q)
        np.testing.assert_array_equal(one.returns, other.returns)
    assert (alone[0].returns != alone[1].returns).any()


def test_a_stopped_run_returns_what_it_has() -> None:
    asked = iter([False, True])
    settings = Settings(episodes=30, decay_every=10)
    result = q_learning(
        random_process(5), settings=settings, should_stop=lambda: next(asked), checkpoint_every=10
    )
    assert not result.finished
    assert len(result.returns) == 10
    assert result.epsilon == settings.epsilon_at(10)
    assert result.epsilon < settings.epsilon_at(9)


def test_the_limit_of_steps_is_not_an_end() -> None:
    loop = from_outcomes([(0, "a", 0, 1.0, ("a",), -1.0)], alphabet=SIGMA, terminal=[1])
    result = q_learning(loop, settings=Settings(episodes=400, episode_steps=5, alpha=0.5, gamma=0.5))
    assert result.q[0, 0] == pytest.approx(-2.0)
    assert result.lengths.tolist() == [5] * 400


def test_each_breaking_event_counts_and_the_rule_starts_again() -> None:
    walk = from_outcomes([(0, "a", 0, 1.0, ("a", "a", "b"))], alphabet=SIGMA)
    no_two = from_text("0 -a-> 1\n1 -b-> 0\n0 -b-> 0", alphabet=SIGMA)
    result = q_learning(walk, rules=[no_two], settings=Settings(episodes=1, episode_steps=3))
    assert result.violations.tolist() == [3]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("alpha", 0.0),
        ("alpha", 1.1),
        ("alpha", float("nan")),
        ("gamma", 1.0),
        ("gamma", -0.5),
        ("epsilon", -0.1),
        ("epsilon", 1.5),
        ("epsilon_decay", 0.0),
        ("episodes", 0),
        ("episode_steps", 0),
        ("decay_every", 0),
    ],
)
def test_settings_out_of_range(name: str, value: float) -> None:
    with pytest.raises(MDPError, match=f"{name} is {value}; a .*is needed"):
        Settings(**{name: value})


def test_a_mask_without_an_action_is_refused() -> None:
    mdp = random_process(2)
    with pytest.raises(MDPError, match="the mask leaves no action at the start"):
        q_learning(mdp, enabled=np.zeros((5, 2), np.bool_), settings=Settings(episodes=1))

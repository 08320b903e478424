"""The manufacturing cell, learned: deliveries per 1,000 rounds, with faults, beside the most there can be.

A *round* is from one turn of R1 to its next; what is counted is R1's events and ``d2``.  *In the long run*
their ratio is E[Σ γⁿ d2] / E[Σ γⁿ rounds] with γ = 1 - 10⁻⁶, each solved exactly, which is the ratio of the
means up to some millionths.  The largest such ratio λ is that for which the best policy earns nothing with
rewards d2 - λ · rounds (Dinkelbach, "On nonlinear fractional programming", Management Science 13, 1967).

*Dead ends*: the paper's own supervisor looks one step ahead.  How soon an agent that takes any action that it
leaves runs into a state without one is solved exactly too.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.learning import EXAMPLES
from supremal import TabularMDP, evaluate, q_learning, q_learning_seeds, safe_actions, value_iteration
from supremal.decisions.safety import find_dead_end
from supremal.learning.settings import Settings
from supremal.task.experiment import rules_of, supervise
from supremal.task.reading import read_task
from supremal.task.task import Task

LONG_RUN = 1 - 1e-6
SEEDS = range(10)
STEPS = 10**8
DELIVERIES = ("d2",)
ROUNDS = ("e1", "n1", "w1", "s1", "p1", "d1")


def counting(mdp: TabularMDP, events: Collection[str]) -> TabularMDP:
    """Return ``mdp`` with a reward of 1 for each of ``events``."""
    spelled = [mdp.spell(word) for word in range(len(mdp.words))]
    counts = np.array([sum(event in events for event in word) for word in spelled], np.float64)
    return replace(mdp, reward=counts[mdp.word])


def per_round(mdp: TabularMDP, policy: np.ndarray) -> float:
    """Return the deliveries in a round of a policy, in the long run."""
    delivered, rounds = (
        evaluate(counting(mdp, events), policy, gamma=LONG_RUN).value for events in (DELIVERIES, ROUNDS)
    )
    return delivered / rounds


def most_per_round(mdp: TabularMDP, enabled: np.ndarray) -> float:
    """Return the most deliveries in a round that a policy under the mask can make in the long run."""
    delivered, rounds = counting(mdp, DELIVERIES).reward, counting(mdp, ROUNDS).reward
    best, more = -1.0, 0.0
    while more > best + 1e-9:  # no more than the solver can tell
        best = more
        plan = value_iteration(
            replace(mdp, reward=delivered - best * rounds), gamma=LONG_RUN, enabled=enabled
        )
        more = per_round(mdp, plan.policy)
    return more


def anything(enabled: np.ndarray) -> np.ndarray:
    """Return the policy that takes any enabled action, ``[S, A]``."""
    return enabled / np.maximum(enabled.sum(axis=1, keepdims=True), 1)


def deliveries(task: Task, mdp: TabularMDP, enabled: np.ndarray) -> dict[str, Any]:
    """Print and return deliveries per 1,000 rounds: the most, the optimum's, and those of what is learned."""
    gamma = task.settings.gamma
    plan = value_iteration(mdp, gamma=gamma, enabled=enabled)
    optimum = float(plan.value @ mdp.initial)
    record: dict[str, Any] = {
        "most": 1000 * most_per_round(mdp, enabled),
        f"best for gamma = {gamma}": 1000 * per_round(mdp, plan.policy),
        "any enabled action": 1000 * per_round(mdp, anything(enabled)),
    }
    for name, rate in record.items():
        print(f"{name:30}{rate:10.2f} deliveries per 1,000 rounds")
    for name, said in (
        ("learned", {}),
        ("learned, counterfactual", {"counterfactual": True}),
    ):
        settings = replace(task.settings, **said)
        results = q_learning_seeds(
            mdp, SEEDS, enabled=enabled, settings=settings, environment=task.environment
        )
        rates = [1000 * per_round(mdp, result.policy) for result in results]
        shares = [evaluate(mdp, result.policy, gamma=gamma).value / optimum for result in results]
        record[name] = {"rates": rates, "share_of_optimal_value": shares}
        print(
            f"{name:30}{np.median(rates):10.2f} ({min(rates):.2f}–{max(rates):.2f}); "
            f"value {np.median(shares):.2%} of the optimum's"
        )
    return record


def long(task: Task, mdp: TabularMDP, enabled: np.ndarray) -> dict[str, Any]:
    """Print and return what 10⁸ steps came to: the rules broken, and the episodes that had to end early."""
    settings: Settings = replace(task.settings, episodes=STEPS // task.settings.episode_steps)
    result = q_learning(mdp, enabled=enabled, rules=rules_of(task), settings=settings)
    record = {
        "steps": int(result.lengths.sum()),
        "violations": int(result.violations.sum()),
        "dead_ends": int((result.lengths < settings.episode_steps).sum()),
        "rate": 1000 * per_round(mdp, result.policy),
        "seconds": result.seconds,
    }
    print(
        f"{record['steps']:,} steps: {record['violations']} violations, {record['dead_ends']} dead ends; "
        f"then {record['rate']:.2f} deliveries per 1,000 rounds"
    )
    return record


def dead_ends(mdp: TabularMDP, limit: int) -> dict[str, Any]:
    """Print and return how often an agent gets stuck that takes any action harmless one step ahead."""
    enabled = safe_actions(mdp, lookahead="one_step")
    word = find_dead_end(mdp, enabled)
    stuck = ~enabled.any(axis=1) & ~mdp.terminal
    ended = replace(counting(mdp, ROUNDS), terminal=mdp.terminal | stuck, marked=stuck)
    found = evaluate(ended, anything(enabled), gamma=0.0, horizon=limit)
    record = {
        "word": word,
        "within_an_episode": float(found.completion_within[-1]),
        "sooner_or_later": found.completion,
        "rounds_until": found.expected_return,
        "per_1000_rounds": 1000 / found.expected_return,
    }
    print(
        f"one step ahead: stuck within {limit} steps with probability {record['within_an_episode']:.4f}, "
        f"in the mean after {found.expected_return:.1f} rounds"
    )
    print(f"  the shortest way there: {' '.join(word or ())}")
    return record


def run() -> dict[str, Any]:
    """Print everything; return the record."""
    task = read_task(EXAMPLES / "manufacturing_cell.toml")
    assert task.environment is not None
    mdp, enabled = supervise(task.environment, task)
    assert find_dead_end(mdp, enabled) is None
    return {
        "deliveries_per_1000_rounds": deliveries(task, mdp, enabled),
        "long": long(task, mdp, enabled),
        "one_step": dead_ends(mdp, task.settings.episode_steps),
    }

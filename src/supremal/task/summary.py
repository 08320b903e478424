"""The numbers of an experiment: what ``result.json`` holds, and all that is shown comes from."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Final

import numpy as np

from supremal import __version__
from supremal._arrays import Floats
from supremal.automata.explore import Exploration
from supremal.decisions.safety import reachable_states
from supremal.learning.q_learning import QResult
from supremal.synthesis.verify import Violation
from supremal.task.comparison import comparison
from supremal.task.experiment import Experiment
from supremal.task.task import Rule

INTERVAL: Final = 10_000
"""Episodes that the paper's curves average over."""


def interval_means(values: np.ndarray, interval: int = INTERVAL) -> Floats:
    """Return the means over successive intervals; the last may be shorter."""
    if not len(values):
        return np.empty(0)
    starts = np.arange(0, len(values), interval)
    sums = np.add.reduceat(values.astype(np.float64), starts)
    means: Floats = sums / np.diff(np.append(starts, len(values)))
    return means


def summary(experiment: Experiment) -> dict[str, Any]:
    """Return the numbers of an experiment, ready for JSON; what is not finite or not known is None."""
    task, result = experiment.task, experiment.results[0]
    reached = reachable_states(experiment.model, experiment.enabled)
    possible = experiment.model.feasible & ~experiment.model.terminal[:, None]
    optimum, greedy = experiment.optimum, experiment.greedy[0]
    best = float(experiment.model.initial @ experiment.plan.value)
    document = {
        "supremal": __version__,
        "task": task.name,
        "preset": task.preset,
        "partial": experiment.partial,
        "seed": result.seed,
        "seeds": len(experiment.results),
        "settings": asdict(task.settings) | {"drop_probability": task.drop_probability},
        "check": _check_summary(experiment),
        "product": {
            "states": int(reached.sum()),
            "state_actions": int(experiment.enabled[reached].sum()),
            "disabled": int((possible & ~experiment.enabled)[reached].sum()),
        },
        "optimal": {
            "value": best,
            "bound": experiment.plan.bound,
            "expected_return": _number(optimum.expected_return),
            "expected_steps": _number(optimum.expected_steps),
            "steps_without_drop": _number(experiment.steps_without_drop),
            "completion_within_limit": float(optimum.completion_within[-1]),
            "completion_ever": optimum.completion,
        },
        "greedy": {
            "value": greedy.value,
            "bound": greedy.bound,
            "gap": best - greedy.value,
            "completion": float(greedy.completion_within[-1]),
            "completion_ever": greedy.completion,
            "expected_return": _number(greedy.expected_return),
            "expected_steps": _number(greedy.expected_steps),
            "violation_probability": greedy.violation,
        },
        "training": _training_summary(result),
        "baseline": _baseline_summary(experiment),
        "per_seed": [
            {
                "seed": learned.seed,
                "greedy_value": policy.value,
                "gap": best - policy.value,
                "completion": float(policy.completion_within[-1]),
                "violations": int(learned.violations.sum()),
            }
            for learned, policy in zip(experiment.results, experiment.greedy, strict=True)
        ],
    }
    return document | {"comparison": comparison(document)}


def _training_summary(result: QResult) -> dict[str, Any]:
    steps = int(result.lengths.sum())
    return {
        "episodes": len(result.returns),
        "steps": steps,
        "seconds": result.seconds,
        "steps_per_second": steps / result.seconds if result.seconds else None,
        "violations": int(result.violations.sum()),
        "final_epsilon": result.epsilon,
        "interval": INTERVAL,
        "score": interval_means(result.returns).tolist(),
        "completion": interval_means(result.completed).tolist(),
    }


def _baseline_summary(experiment: Experiment) -> dict[str, Any] | None:
    result, greedy, judged = experiment.baseline, experiment.baseline_greedy, experiment.baseline_judged
    if result is None or greedy is None or judged is None:
        return None
    return _training_summary(result) | {
        "violations_per_episode": float(result.violations.mean()),
        "episodes_with_violation": int((result.violations > 0).sum()),
        "greedy": {
            "value": greedy.value,
            "completion": float(greedy.completion_within[-1]),
            "expected_steps": _number(greedy.expected_steps),
            "violation_probability": judged.violation,
        },
    }


def _check_summary(experiment: Experiment) -> dict[str, Any]:
    checked, start = experiment.checked, experiment.model.initial > 0
    kept = checked.joint is None and bool(experiment.enabled[start].any(axis=1).all())
    rules = zip(
        experiment.task.rules, checked.products, checked.witnesses, checked.without_plant, strict=True
    )
    return {
        "verdict": "enforceable" if kept else "not enforceable",
        "plant": {"states": checked.plant.n_states, "transitions": checked.plant.n_transitions},
        "rules": [_rule_summary(*about) for about in rules],
    }


def _rule_summary(
    rule: Rule, product: Exploration, witness: Violation | None, anything: Violation | None
) -> dict[str, Any]:
    automaton = rule.automaton
    without = (
        "The plant is not needed: nothing uncontrollable can break this rule."
        if anything is None
        else f"Without a plant, {anything}. The environment rules that out, which is why the plant matters."
        if witness is None
        else f"Without a plant, {anything}."
    )
    return {
        "name": automaton.name,
        "title": rule.sentence,
        "states": automaton.n_states,
        "transitions": automaton.n_transitions,
        "product": {"states": len(product.bad), "transitions": len(product.event)},
        "controllable": witness is None,
        "witness": None if witness is None else asdict(witness),
        "without_plant": {
            "controllable": anything is None,
            "witness": None if anything is None else asdict(anything),
            "text": without,
        },
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None

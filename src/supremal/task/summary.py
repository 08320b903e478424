"""The numbers of an experiment: what ``result.json`` holds, and all that is shown comes from."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Final

import numpy as np

from supremal import __version__
from supremal._arrays import Floats
from supremal.automata.automaton import Automaton
from supremal.automata.build import universal
from supremal.decisions.safety import reachable_states
from supremal.learning.q_learning import QResult
from supremal.learning.statistics import regret
from supremal.rules.about import classify
from supremal.synthesis.verify import find_uncontrollable
from supremal.task.comparison import comparison
from supremal.task.experiment import Experiment
from supremal.task.findings import Findings, document
from supremal.task.spread import CONFIDENCE, spread
from supremal.task.task import Task

_SEVERAL: Final = 2


def interval_means(values: np.ndarray, interval: int) -> Floats:
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
    said = {
        "supremal": __version__,
        "task": task.name,
        "title": task.title,
        "source": task.source,
        "partial": experiment.partial,
        "shaped": task.shaped is not None,
        "seed": result.seed,
        "seeds": len(experiment.results),
        "settings": asdict(task.settings),
        "check": check_summary(experiment.findings, task),
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
            "return_within_limit": experiment.best_return,
            "steps_undisturbed": _number(experiment.steps_undisturbed),
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
        "training": _training_summary(result, task.interval)
        | {"regret": regrets(experiment, result).tolist()},
        "baseline": _baseline_summary(experiment),
        "over_seeds": _over_seeds(experiment),
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
    return said | {"comparison": comparison(said, task.reported)}


def _training_summary(result: QResult, interval: int) -> dict[str, Any]:
    steps = int(result.lengths.sum())
    return {
        "episodes": len(result.returns),
        "steps": steps,
        "seconds": result.seconds,
        "steps_per_second": steps / result.seconds if result.seconds else None,
        "violations": int(result.violations.sum()),
        "final_epsilon": result.epsilon,
        "interval": interval,
        "score": interval_means(result.returns, interval).tolist(),
        "completion": interval_means(result.completed, interval).tolist(),
    }


def regrets(experiment: Experiment, result: QResult) -> Floats:
    """Return the regret of a learner at the end of each interval; nothing where the best is not known."""
    best = experiment.best_return
    return np.empty(0) if best is None else regret(result.returns, best, interval=experiment.task.interval)


def _over_seeds(experiment: Experiment) -> dict[str, Any] | None:
    """Return what several seeds say together, None for one."""
    results, interval = experiment.results, experiment.task.interval
    if len(results) < _SEVERAL:
        return None
    best = float(experiment.model.initial @ experiment.plan.value)
    gaps = spread([np.array([best - policy.value]) for policy in experiment.greedy])
    return {
        "confidence": CONFIDENCE,
        "score": spread([interval_means(result.returns, interval) for result in results]),
        "completion": spread([interval_means(result.completed, interval) for result in results]),
        "regret": spread([regrets(experiment, result) for result in results]),
        "gap": {"mean": gaps["mean"][0], "low": gaps["low"][0], "high": gaps["high"][0]},
    }


def _baseline_summary(experiment: Experiment) -> dict[str, Any] | None:
    result, greedy, judged = experiment.baseline, experiment.baseline_greedy, experiment.baseline_judged
    if result is None or greedy is None or judged is None:
        return None
    return _training_summary(result, experiment.task.interval) | {
        "violations_per_episode": float(result.violations.mean()),
        "episodes_with_violation": int((result.violations > 0).sum()),
        "greedy": {
            "value": greedy.value,
            "completion": float(greedy.completion_within[-1]),
            "expected_steps": _number(greedy.expected_steps),
            "violation_probability": judged.violation,
        },
    }


def check_summary(findings: Findings, task: Task) -> dict[str, Any]:
    """Return what `supremal check` says, and for each rule what it is and what holds without the plant."""
    said = document(findings)
    for entry, rule in zip(said["rules"], task.rules, strict=True):
        entry |= {
            "sentence": rule.sentence,
            "form": rule.form,
            "text": rule.text,
            "class": classify(rule.automaton),
            "transitions": rule.automaton.n_transitions,
            "without_plant": _without_plant(rule.automaton, needed=entry["controllable"] is True),
        }
    return said


def _without_plant(rule: Automaton, *, needed: bool) -> dict[str, Any]:
    """Say whether ``rule`` could be kept where anything can happen at any time."""
    found = find_uncontrollable(universal(rule.alphabet), rule)
    if found is None:
        text = "The plant is not needed: nothing uncontrollable can break this rule."
    elif needed:
        text = f"Without a plant, {found}. The environment rules that out, which is why the plant matters."
    else:
        text = f"Without a plant, {found}."
    witness = None if found is None else asdict(found)
    return {"controllable": found is None, "witness": witness, "text": text}


def _number(value: float | None) -> float | None:
    return float(value) if value is not None and np.isfinite(value) else None

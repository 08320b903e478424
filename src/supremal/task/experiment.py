"""The experiment: check, supervise, learn, evaluate; every number that is reported is made here.

`run` walks the stair once.  Its `Experiment` holds the models and the results; `summary` of it is what
``result.json`` holds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np

from supremal import __version__
from supremal._arrays import NONE, Bools, Floats, Ints
from supremal.automata.automaton import Automaton
from supremal.automata.build import universal
from supremal.automata.explore import Exploration, explore
from supremal.decisions.evaluation import Evaluation, evaluate
from supremal.decisions.mdp import TabularMDP, restrict
from supremal.decisions.planning import Plan, value_iteration
from supremal.decisions.plant import plant_automaton
from supremal.decisions.product import product
from supremal.decisions.safety import reachable_states, safe_actions
from supremal.learning.q_learning import QResult, q_learning_seeds
from supremal.synthesis.verify import Violation, find_uncontrollable
from supremal.task.comparison import comparison
from supremal.task.task import Rule, Task

INTERVAL: Final = 10_000
"""Episodes that the paper's curves average over."""

OnStage = Callable[[str], object]
OnEpisodes = Callable[[str, int, int], object]


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """Whether the rules can be kept.

    The plant; for each rule its product with the plant and a witness against it; a witness against all of
    them together; and for each rule a witness against it where anything can happen.
    """

    plant: Automaton
    products: tuple[Exploration, ...]
    witnesses: tuple[Violation | None, ...]
    joint: Violation | None
    without_plant: tuple[Violation | None, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """What `run` returns.

    Parameters
    ----------
    task
        What was asked.
    checked
        Whether the rules can be kept.
    model, enabled
        The product of environment, rules and reward machine, and the supervisor's mask over it.
    plan, optimum
        The optimal values, and the exact evaluation of the optimal policy.
    steps_without_drop
        The steps that an optimal policy takes where nothing uncontrollable happens.
    results, greedy
        What each seed learned, and the exact evaluation of each greedy policy.
    baseline, baseline_greedy, baseline_judged
        The first seed without the rules, the evaluation of its greedy policy, and that with the rules beside
        it, where a violation ends the episode; None where the run was stopped before.
    """

    task: Task
    checked: Checked
    model: TabularMDP
    enabled: Bools
    plan: Plan
    optimum: Evaluation
    steps_without_drop: float
    results: list[QResult]
    greedy: list[Evaluation]
    baseline: QResult | None
    baseline_greedy: Evaluation | None
    baseline_judged: Evaluation | None

    @property
    def partial(self) -> bool:
        """Whether the run was stopped before its end."""
        return self.baseline is None or not all(r.finished for r in [*self.results, self.baseline])


def check(task: Task) -> Checked:
    """Ask Theorem 1 about each rule and all of them together, with the plant and against Σ*."""
    plant = plant_automaton(task.environment, name="environment")
    anything = universal(plant.alphabet)
    rules = [rule.automaton for rule in task.rules]
    return Checked(
        plant,
        tuple(explore([plant], [rule]) for rule in rules),
        tuple(find_uncontrollable(plant, rule) for rule in rules),
        find_uncontrollable(plant, rules),
        tuple(find_uncontrollable(anything, rule) for rule in rules),
    )


def supervise(environment: TabularMDP, task: Task) -> tuple[TabularMDP, Bools]:
    """Return the product of ``environment`` with the task's rules and reward machine, and its safe mask."""
    model = product(environment, [rule.automaton for rule in task.rules], task.reward_machine)
    return model, safe_actions(model)


def run(
    task: Task,
    seeds: Sequence[int],
    *,
    on_stage: OnStage = lambda _: None,
    on_episodes: OnEpisodes = lambda *_: None,
) -> Experiment:
    """Run the whole experiment, once for each of ``seeds``.

    ``on_stage`` is told what begins, ``on_episodes`` the learner ("supervised" or "baseline"), the place of
    the seed and the episodes it has run.  Ctrl-C while learning returns what there is.
    """
    on_stage("checking the rules")
    checked = check(task)
    on_stage("building the supervisor")
    model, enabled = supervise(task.environment, task)
    calm, calm_enabled = supervise(task.undisturbed, task)
    settings, gamma, limit = task.settings, task.settings.gamma, task.settings.episode_steps
    on_stage("solving exactly")
    plan = value_iteration(model, gamma=gamma, enabled=enabled)
    calm_plan = value_iteration(calm, gamma=gamma, enabled=calm_enabled)

    on_stage("learning under the supervisor")
    rules = [rule.automaton for rule in task.rules]
    results = q_learning_seeds(
        model,
        seeds,
        enabled=enabled,
        rules=rules,
        settings=settings,
        on_episodes=lambda place, done: on_episodes("supervised", place, done),
    )
    baseline = baseline_greedy = baseline_judged = None
    if all(result.finished for result in results):
        on_stage("learning without the rules, for comparison")
        free = product(task.environment, (), task.reward_machine)
        (baseline,) = q_learning_seeds(
            free,
            seeds[:1],
            rules=rules,
            settings=settings,
            on_episodes=lambda place, done: on_episodes("baseline", place, done),
        )
        baseline_greedy = evaluate(free, baseline.policy, gamma=gamma, horizon=limit)
        baseline_judged = _with_rules(free, baseline.policy, task)
    on_stage("evaluating the policies exactly")
    return Experiment(
        task=task,
        checked=checked,
        model=model,
        enabled=enabled,
        plan=plan,
        optimum=evaluate(model, plan.policy, gamma=gamma, horizon=limit),
        steps_without_drop=evaluate(calm, calm_plan.policy, gamma=gamma).expected_steps,
        results=results,
        greedy=[evaluate(model, result.policy, gamma=gamma, horizon=limit) for result in results],
        baseline=baseline,
        baseline_greedy=baseline_greedy,
        baseline_judged=baseline_judged,
    )


def _with_rules(free: TabularMDP, policy: Ints, task: Task) -> Evaluation:
    """Evaluate a policy that does not know the rules in their product: a violation ends the episode."""
    chosen = np.zeros((free.n_states, free.n_actions), np.bool_)
    acts = np.flatnonzero(policy != NONE)
    chosen[acts, policy[acts]] = True
    numbered = replace(restrict(free, chosen), origin=np.arange(free.n_states, dtype=np.int32)[:, None])
    judged = product(numbered, [rule.automaton for rule in task.rules])
    lifted = np.append(policy, np.int32(NONE))[judged.origin[:, 0]]
    return evaluate(judged, lifted, gamma=task.settings.gamma)


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

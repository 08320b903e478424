"""The experiment: check, supervise, learn, evaluate.

`run` walks the stair once.  Its `Experiment` holds the models and the results, from which
`supremal.task.summary` reads the numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal.automata.automaton import Automaton
from supremal.automata.build import universal
from supremal.automata.explore import Exploration, explore
from supremal.decisions.evaluation import Evaluation, evaluate
from supremal.decisions.mdp import TabularMDP, restrict
from supremal.decisions.planning import Plan, value_iteration
from supremal.decisions.plant import plant_automaton
from supremal.decisions.product import product
from supremal.decisions.safety import safe_actions
from supremal.learning.q_learning import QResult, q_learning_seeds
from supremal.synthesis.verify import Violation, find_uncontrollable
from supremal.task.task import Task

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

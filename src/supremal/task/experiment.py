"""The experiment: supervise, learn, evaluate.

`run` walks the stair once.  Its `Experiment` holds the models and the results, from which
`supremal.task.summary` reads the numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal.automata.automaton import Automaton
from supremal.automata.reduce import mark_all
from supremal.decisions.evaluation import Evaluation, evaluate
from supremal.decisions.horizon import finite_horizon
from supremal.decisions.mdp import TabularMDP, restrict
from supremal.decisions.planning import Plan, value_iteration
from supremal.decisions.plant_process import undisturbed
from supremal.decisions.product import product
from supremal.decisions.safety import find_dead_end, safe_actions
from supremal.errors import MDPError
from supremal.learning.q_learning import QResult, q_learning_seeds
from supremal.task.findings import Findings, plants_of, study
from supremal.task.keeper import Keeper
from supremal.task.task import Task

_MAX_HORIZON: Final = 50_000_000
"""The most values, states times steps, that the best return of a limited episode is computed with."""

OnStage = Callable[[str], object]
OnEpisodes = Callable[[str, int, int], object]


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """What `run` returns.

    Parameters
    ----------
    task
        What was asked.
    findings
        Whether the rules can be kept.
    model, enabled
        The product of environment, rules and reward machine, and the supervisor's mask over it.
    plan, optimum
        The optimal values, and the exact evaluation of the optimal policy.
    best_return
        What an episode of limited steps can earn in the mean, undiscounted; None where that is too much to
        compute, or where the curves are of rewards that are told earlier.
    steps_undisturbed
        The steps that an optimal policy takes where nothing uncontrollable happens; None where nothing can.
    results, greedy
        What each seed learned, and the exact evaluation of each greedy policy.
    baseline, baseline_greedy, baseline_judged
        The first seed without the rules, the evaluation of its greedy policy, and that with the rules beside
        it, where a violation ends the episode; None where there are no rules or the run was stopped before.
    """

    task: Task
    findings: Findings
    model: TabularMDP
    enabled: Bools
    plan: Plan
    optimum: Evaluation
    best_return: float | None
    steps_undisturbed: float | None
    results: list[QResult]
    greedy: list[Evaluation]
    baseline: QResult | None
    baseline_greedy: Evaluation | None
    baseline_judged: Evaluation | None

    @property
    def partial(self) -> bool:
        """Whether the run was stopped before its end."""
        stopped = not all(result.finished for result in self.results)
        return stopped or (bool(self.task.rules) and (self.baseline is None or not self.baseline.finished))


def check(task: Task) -> Findings:
    """Ask whether the rules of ``task`` can be kept, where something is to be learned.

    Raises
    ------
    MDPError
        If the task has no environment.
    """
    if task.environment is None:
        message = (
            f"task {task.name!r} has no [environment], so nothing can be learned; say how likely "
            "uncontrollable events are (chances = {...}), or give a Gymnasium id (id = ...)"
        )
        raise MDPError(message)
    rules = tuple(rule.automaton for rule in task.rules)
    return study(plants_of(task), rules, task.options, lost=False)


def rules_of(task: Task) -> list[Automaton]:
    """Return the rules as the product reads them: where nothing has to be completed, nothing is owed."""
    automata = [rule.automaton for rule in task.rules]
    return automata if task.options.nonblocking else [mark_all(rule) for rule in automata]


def supervise(environment: TabularMDP, task: Task) -> tuple[TabularMDP, Bools]:
    """Return the product of ``environment`` with the task's rules and reward machine, and its safe mask."""
    bound = {"max_states": task.options.max_states} if task.options.max_states else {}
    model = product(environment, rules_of(task), task.reward_machine, **bound)
    return model, safe_actions(model, nonblocking=task.options.nonblocking)


def run(
    task: Task,
    findings: Findings,
    *,
    keeper: Keeper | None = None,
    on_stage: OnStage = lambda _: None,
    on_episodes: OnEpisodes = lambda *_: None,
) -> Experiment:
    """Run the whole experiment, once for each of the task's seeds, after its `check`.

    The learners go on from what ``keeper`` has of them, and give it their states on the way.  ``on_stage`` is
    told what begins, ``on_episodes`` the learner ("supervised" or "baseline"), the place of the seed and the
    episodes it has run.  Ctrl-C while learning returns what there is.

    Raises
    ------
    MDPError
        If the rules cannot be kept, so that there is nothing to learn, or there is no environment.
    """
    environment, settings = task.environment, task.settings
    if environment is None or findings.verdict == "not_enforceable":
        message = f"the rules of task {task.name!r} cannot be kept in any environment of it; check it first"
        raise MDPError(message)
    gamma, limit = settings.gamma, settings.episode_steps
    on_stage("building the supervisor")
    model, enabled = supervise(environment, task)
    on_stage("solving exactly")
    plan = value_iteration(model, gamma=gamma, enabled=enabled)

    on_stage("learning under the supervisor")
    rules, seeds = rules_of(task), range(task.seed, task.seed + task.seeds)
    learn = partial(_learn, task, environment, rules, keeper=keeper, on_episodes=on_episodes)
    taught = model if task.shaped is None else product(environment, rules, task.shaped)  # the same states
    results = learn("supervised", taught, seeds, enabled=enabled)
    baseline = baseline_greedy = baseline_judged = None
    if rules and all(result.finished for result in results):
        on_stage("learning without the rules, for comparison")
        free = product(environment, (), task.reward_machine)
        unruled = free if task.shaped is None else product(environment, (), task.shaped)
        (baseline,) = learn("baseline", unruled, seeds[:1])
        baseline_greedy = evaluate(free, baseline.policy, gamma=gamma, horizon=limit)
        baseline_judged = _with_rules(free, baseline.policy, rules, gamma)
    on_stage("evaluating the policies exactly")
    return Experiment(
        task=task,
        findings=findings,
        model=model,
        enabled=enabled,
        plan=plan,
        optimum=evaluate(model, plan.policy, gamma=gamma, horizon=limit),
        best_return=_best_return(model, enabled, limit) if task.shaped is None else None,
        steps_undisturbed=_steps_undisturbed(task, environment),
        results=results,
        greedy=[evaluate(model, result.policy, gamma=gamma, horizon=limit) for result in results],
        baseline=baseline,
        baseline_greedy=baseline_greedy,
        baseline_judged=baseline_judged,
    )


def _learn(
    task: Task,
    environment: TabularMDP,
    rules: list[Automaton],
    learner: str,
    model: TabularMDP,
    seeds: Sequence[int],
    *,
    enabled: Bools | None = None,
    keeper: Keeper | None,
    on_episodes: OnEpisodes,
) -> list[QResult]:
    return q_learning_seeds(
        model,
        seeds,
        enabled=enabled,
        rules=rules,
        environment=environment,
        settings=task.settings,
        resume=keeper.states(learner, seeds) if keeper else None,
        on_episodes=lambda place, done: on_episodes(learner, place, done),
        on_state=(lambda _, state: keeper.save(learner, state)) if keeper else None,
        checkpoint_every=keeper.every if keeper else None,
    )


def _best_return(model: TabularMDP, enabled: Bools, steps: int) -> float | None:
    """Return what an episode of at most so many steps can earn in the mean; None where that is too much."""
    if model.n_states * steps > _MAX_HORIZON:
        return None
    value = finite_horizon(model, steps, enabled=enabled).value[-1]
    return float(model.initial @ value)


def _steps_undisturbed(task: Task, environment: TabularMDP) -> float | None:
    if not environment.alphabet.uncontrollable:
        return None
    calm, enabled = supervise(undisturbed(environment), task)
    if find_dead_end(calm, enabled) is not None:  # it takes something uncontrollable to get on
        return None
    plan = value_iteration(calm, gamma=task.settings.gamma, enabled=enabled)
    return evaluate(calm, plan.policy, gamma=task.settings.gamma).expected_steps


def _with_rules(free: TabularMDP, policy: Ints, rules: list[Automaton], gamma: float) -> Evaluation:
    """Evaluate a policy that does not know the rules in their product: a violation ends the episode."""
    chosen = np.zeros((free.n_states, free.n_actions), np.bool_)
    acts = np.flatnonzero(policy != NONE)
    chosen[acts, policy[acts]] = True
    numbered = replace(restrict(free, chosen), origin=np.arange(free.n_states, dtype=np.int32)[:, None])
    judged = product(numbered, rules)
    lifted = np.append(policy, np.int32(NONE))[judged.origin[:, 0]]
    return evaluate(judged, lifted, gamma=gamma)

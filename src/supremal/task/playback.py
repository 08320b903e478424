"""Episodes to look at: what the learned policy does, what could come at worst, and why it may not do more.

Where something was learned, episodes of its greedy policy are drawn from the product of environment, rules
and reward machine, and its worst one is computed (see `supremal.decisions.worst_case`).  Where a process is
there and no policy, any enabled action is taken; where there are only plants, any enabled event happens.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from supremal._arrays import Bools, Ints
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.safety import reachable_states
from supremal.decisions.worst_case import worst_case
from supremal.errors import MDPError
from supremal.show.playback import Episode, Playback, Reel
from supremal.task.findings import Findings
from supremal.task.stage import (
    PlantStage,
    ProcessStage,
    follow,
    followers_of,
    parts_of,
    plant_stage,
    process_stage,
)
from supremal.task.task import Task

EPISODES: Final = 3
"""How many episodes are played, if nothing else is said."""

_STEPS: Final = 40
"""The most steps where no task says how long an episode is."""
_WORST: Final = 50_000_000
"""The most values, states times steps, that the worst case is computed with."""


def playback_of(
    task: Task, findings: Findings, policy: Ints | None = None, *, seed: int = 0, episodes: int = EPISODES
) -> Playback | None:
    """Return episodes of a task under its supervisor, None where the rules cannot be kept.

    Parameters
    ----------
    task
        What there is to do.
    findings
        What `study` found of it.
    policy
        ``int [S]``: what was learned, over the product of the task; None: nothing was.
    seed
        The seed of the first episode; those of the others are counted up from it.
    episodes
        How many.

    Raises
    ------
    MDPError
        If the policy is not one of this product, or does what the supervisor disables; if its rules can only
        be kept by resting, which nobody can in a process.

    Notes
    -----
    One more product and, where the findings are not of the environment itself, one more synthesis.
    """
    if findings.verdict == "not_enforceable":
        return None
    if task.environment is None:
        return _of_supervisor(task, findings, seed, episodes)
    return _of_process(task, task.environment, findings, policy, seed, episodes)


# --- a process --------------------------------------------------------------------------------------------


def _of_process(
    task: Task, environment: TabularMDP, findings: Findings, policy: Ints | None, seed: int, episodes: int
) -> Playback:
    limit = task.settings.episode_steps
    stage = process_stage(task, environment, findings)
    if policy is not None:
        _check_policy(stage.model, stage.enabled, policy)
    drawn = []
    for k in range(episodes):
        start, outcomes = sample(stage.model, policy, stage.enabled, seed=seed + k, steps=limit)
        drawn.append(_episode(stage, start, outcomes, f"Seed {seed + k}"))
    reels = _reels(stage, tuple(drawn), policy, limit)
    return Playback(parts_of(task), reels, stage.free, stage.view.board, stage.facts)


def _episode(stage: ProcessStage, start: int, outcomes: Sequence[int], called: str) -> Episode:
    """Return the episode from ``start`` through ``outcomes``."""
    model, followers = stage.model, followers_of(stage.task)
    at = (0,) * len(followers)
    steps, score = [stage.step(start, at)], 0.0
    for o in outcomes:
        action = model.actions[(int(np.searchsorted(model.row, o, side="right")) - 1) % model.n_actions]
        word, reward, state = model.spell(int(model.word[o])), float(model.reward[o]), model.next_state[o]
        at = follow(followers, at, word)
        steps[-1] = replace(steps[-1], chosen=action)
        moment = stage.step(int(state), at)
        steps.append(replace(moment, action=action, word=word, reward=reward))
        score += reward
    ended = bool(model.terminal[model.next_state[outcomes[-1]]]) if len(outcomes) else True
    end = "" if ended else ", cut off"
    count = "1 step" if len(outcomes) == 1 else f"{len(outcomes)} steps"
    return Episode(f"{called}: {count}, return {score:.6g}{end}", tuple(steps))


def _reels(
    stage: ProcessStage, drawn: tuple[Episode, ...], policy: Ints | None, limit: int
) -> tuple[Reel, ...]:
    """Return the episodes that were drawn, and the worst one where something was learned."""
    if policy is None:
        note = "Nothing was learned: at each step any enabled action is taken, by a seed."
        return (Reel("Anything allowed", note, drawn),)
    note = f"The learned policy without exploring, for at most {limit} steps; chance is drawn from a seed."
    if int(reachable_states(stage.model, stage.enabled).sum()) * limit > _WORST:
        return (Reel("As it goes", f"{note} The worst case is left out: there are too many states.", drawn),)
    worst = worst_case(stage.model, policy, limit)
    episode = _episode(stage, worst.start, worst.outcomes.tolist(), "The worst case")
    said = (
        "The learned policy as it stands, and at each step, of all that can happen with any chance at all, "
        f"what costs it most over the {limit} steps of an episode. No episode of it can earn less."
    )
    return Reel("As it goes", note, drawn), Reel("The worst case", said, (episode,))


def _check_policy(model: TabularMDP, enabled: Bools, policy: Ints) -> None:
    """Raise an `MDPError` if ``policy`` is none of this product under its supervisor."""
    if policy.shape != (model.n_states,):
        message = (
            f"the learned policy has {policy.size:,} states, and the product of the task {model.n_states:,}; "
            "the task file of the run that learned it is needed"
        )
        raise MDPError(message)
    acts = enabled & (policy[:, None] == np.arange(model.n_actions))
    wrong = np.flatnonzero(reachable_states(model, acts) & ~model.terminal & ~acts.any(axis=1))
    if wrong.size:
        message = (
            f"the learned policy does what the supervisor disables in state {int(wrong[0])} of the product; "
            "the task file of the run that learned it is needed"
        )
        raise MDPError(message)


def sample(
    mdp: TabularMDP, policy: Ints | None, enabled: Bools, *, seed: int, steps: int
) -> tuple[int, list[int]]:
    """Return the start of an episode and its outcomes, as numbers into ``next_state``.

    Parameters
    ----------
    mdp
        The process.
    policy
        ``int [S]``; None: any enabled action, with equal chances.
    enabled
        ``bool [S, A]``.
    seed
        Same seed, same episode.
    steps
        The most steps.
    """
    rng = np.random.default_rng(seed)
    start = state = int(rng.choice(mdp.n_states, p=mdp.initial / mdp.initial.sum()))
    taken: list[int] = []
    while len(taken) < steps and not mdp.terminal[state]:
        choices = np.flatnonzero(enabled[state])
        action = int(rng.choice(choices)) if policy is None else int(policy[state])
        outcomes = mdp.outcomes(state, action)
        prob = mdp.prob[outcomes]
        taken.append(outcomes.start + int(rng.choice(prob.size, p=prob / prob.sum())))
        state = int(mdp.next_state[taken[-1]])
    return start, taken


# --- plants only ------------------------------------------------------------------------------------------


def _of_supervisor(task: Task, findings: Findings, seed: int, episodes: int) -> Playback:
    stage = plant_stage(task, findings)
    drawn = tuple(_wander(stage, seed + k) for k in range(episodes))
    note = f"At each step any event that is enabled happens, by a seed; {_STEPS} of them at most."
    reel = Reel("Anything allowed", note, drawn)
    return Playback(parts_of(task), (reel,), stage.free, stage.view.board, stage.facts)


def _wander(stage: PlantStage, seed: int) -> Episode:
    """Return an episode in which any enabled event happens."""
    rng, followers = np.random.default_rng(seed), followers_of(stage.task)
    free = stage.automaton.alphabet.uncontrollable
    state, at = 0, (0,) * len(followers)
    steps = [stage.step(state, at)]
    while (possible := stage.possible(state)) and len(steps) <= _STEPS:
        event = possible[int(rng.integers(len(possible)))]
        chosen = "" if event in free else event
        steps[-1] = replace(steps[-1], chosen=chosen)
        at, state = follow(followers, at, (event,)), stage.automaton.run([event], state)
        steps.append(replace(stage.step(state, at), action=chosen, word=(event,)))
    return Episode(f"Seed {seed}: {len(steps) - 1} events", tuple(steps))

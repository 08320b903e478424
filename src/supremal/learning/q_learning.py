"""Supervised Q-learning: Algorithm 1 of the paper.

On the product of environment, rules and reward machine the table q̃ with indices q_s, q_h and u is one table
q(s, a).  At each epoch the agent takes, with probability ε, any enabled action with equal chances, and else
the best of them (the first of equal ones), and learns

    q(s, a) ← q(s, a) + α (r + γ max over the a' enabled in s' of q(s', a') - q(s, a)),

without the maximum where s' is terminal.  An episode that the limit of steps cuts off is not terminal: its
last step bootstraps like any other.  After every ``decay_every`` episodes ε is multiplied by
``epsilon_decay``.

Without a mask the same call is the unsupervised baseline.  In both cases monitors of the rules stand beside
the learner and count; a supervised learner's zero is measured.

Source: section III of the paper; Watkins, Dayan, "Q-learning", Machine Learning 8 (1992).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from threading import Event
from time import perf_counter
from typing import Final

import numpy as np

from supremal._arrays import Bools, Floats, Ints
from supremal.automata.automaton import Automaton
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import check_gamma, enabled_choices, greedy
from supremal.errors import MDPError
from supremal.learning import _kernels
from supremal.learning.monitors import word_monitor

_CHUNK: Final = 10_000
"""Episodes between two looks at the clock, the progress bar and Ctrl-C."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What a learner is set to; the defaults are those of the paper's experiment.

    Parameters
    ----------
    episodes, episode_steps
        How many episodes, and the most steps of one.
    alpha
        The learning rate, in (0, 1].
    gamma
        The discount factor, in [0, 1).
    epsilon
        The chance of an exploring step, in [0, 1].
    epsilon_decay, decay_every
        ε is multiplied by the first, in (0, 1], after every so many episodes.

    Raises
    ------
    MDPError
        If a setting is out of its range.

    Examples
    --------
    >>> round(Settings().epsilon_at(500_000), 4)
    0.0192
    """

    episodes: int = 500_000
    episode_steps: int = 60
    alpha: float = 0.1
    gamma: float = 0.9
    epsilon: float = 0.25
    epsilon_decay: float = 0.95
    decay_every: int = 10_000

    def __post_init__(self) -> None:
        check_gamma(self.gamma)
        for name, holds, right in (
            ("alpha", 0 < self.alpha <= 1, "a number above 0, at most 1,"),
            ("epsilon", 0 <= self.epsilon <= 1, "a number from 0 to 1"),
            ("epsilon_decay", 0 < self.epsilon_decay <= 1, "a number above 0, at most 1,"),
            ("episodes", self.episodes >= 1, "a whole number from 1"),
            ("episode_steps", self.episode_steps >= 1, "a whole number from 1"),
            ("decay_every", self.decay_every >= 1, "a whole number from 1"),
        ):
            if not holds:
                message = f"{name} is {getattr(self, name)}; {right} is needed"
                raise MDPError(message)

    def epsilon_at(self, episode: int) -> float:
        """Return ε in the given episode, counted from 0."""
        return self.epsilon * self.epsilon_decay ** (episode // self.decay_every)


@dataclass(frozen=True, slots=True, eq=False)
class QResult:
    """What `q_learning` returns; N episodes were run.

    Parameters
    ----------
    q
        ``float64 [S, A]``: the learned values, -inf where an action is not enabled.
    policy
        ``int32 [S]``: the greedy policy.
    returns, lengths, completed, violations
        ``[N]``: what each episode earned, undiscounted; its steps; whether it met a marked state; how often
        a rule was broken in it.
    seed, epsilon, seconds
        The seed, the final ε, and the time that the episodes took.
    finished
        False where the run was stopped.
    """

    q: Floats
    policy: Ints
    returns: Floats
    lengths: Ints
    completed: Bools
    violations: Ints
    seed: int
    epsilon: float
    seconds: float
    finished: bool


def q_learning(
    mdp: TabularMDP,
    *,
    enabled: Bools | None = None,
    rules: Sequence[Automaton] = (),
    settings: Settings | None = None,
    seed: int = 0,
    on_episodes: Callable[[int], object] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> QResult:
    """Learn a policy for ``mdp`` by Algorithm 1.

    Parameters
    ----------
    mdp
        Usually a `product` of environment, rules and reward machine.
    enabled
        ``bool [S, A]``: the supervisor's mask; left out: every feasible action, the baseline.
    rules
        Those whose violations are to be counted.
    settings
        Left out: those of the paper.
    seed
        Same seed, same result, to the bit.
    on_episodes
        Called with the number of episodes run so far, every ten thousand or so.
    should_stop
        Asked as often; once it says yes, what there is is returned.

    Raises
    ------
    MDPError
        If the mask leaves a reachable state without an action.

    Notes
    -----
    A step takes time linear in the enabled actions of the next state; memory is 8 bytes a choice and 17
    an episode.

    Examples
    --------
    >>> from supremal import Alphabet, Settings, from_outcomes, q_learning
    >>> door = from_outcomes(
    ...     [(0, "wait", 0, 1.0, ("wait",), -1.0), (0, "go", 1, 1.0, ("go",), -1.0)],
    ...     alphabet=Alphabet(("wait", "go")),
    ...     terminal=[1],
    ... )
    >>> result = q_learning(door, settings=Settings(episodes=500))
    >>> door.actions[result.policy[0]]
    'go'
    """
    settings = settings or Settings()
    choices = enabled_choices(mdp, enabled)
    monitor = word_monitor(mdp, rules)
    starts = np.flatnonzero(mdp.initial)
    n = settings.episodes
    flat = np.zeros(len(choices.action))
    random = np.random.SeedSequence(seed).generate_state(1, np.uint64)
    returns, lengths = np.zeros(n), np.zeros(n, np.int32)
    completed, violations = np.zeros(n, np.bool_), np.zeros(n, np.int32)

    def episodes(first: int, end: int) -> float:
        began = perf_counter()
        with np.errstate(over="ignore"):  # the generator counts modulo 2⁶⁴ when it runs uncompiled too
            _kernels.q_learning(
                choices.choice,
                choices.outcome,
                choices.target,
                choices.prob,
                choices.reward,
                choices.word,
                mdp.marked,
                starts.astype(np.int32),
                mdp.initial[starts],
                monitor.next_state,
                monitor.breaks,
                settings.alpha,
                settings.gamma,
                settings.epsilon_at(first),
                settings.episode_steps,
                flat,
                random,
                returns[first:end],
                lengths[first:end],
                completed[first:end],
                violations[first:end],
            )
        return perf_counter() - began

    episodes(0, 0)  # compiles the kernel before the clock starts, if it has to be
    done, seconds = 0, 0.0
    while done < n and not (should_stop and should_stop()):
        until = min(n, done + _CHUNK, (done // settings.decay_every + 1) * settings.decay_every)
        seconds += episodes(done, until)
        done = until
        if on_episodes:
            on_episodes(done)
    q = np.full((mdp.n_states, mdp.n_actions), -np.inf)
    q[np.repeat(np.arange(mdp.n_states), np.diff(choices.choice)), choices.action] = flat
    return QResult(
        q=q,
        policy=greedy(q),
        returns=returns[:done],
        lengths=lengths[:done],
        completed=completed[:done],
        violations=violations[:done],
        seed=seed,
        epsilon=settings.epsilon_at(done),
        seconds=seconds,
        finished=done == n,
    )


def q_learning_seeds(
    mdp: TabularMDP,
    seeds: Sequence[int],
    *,
    enabled: Bools | None = None,
    rules: Sequence[Automaton] = (),
    settings: Settings | None = None,
    on_episodes: Callable[[int, int], object] | None = None,
    workers: int | None = None,
) -> list[QResult]:
    """Run `q_learning` once for each of ``seeds``, side by side.

    Parameters
    ----------
    mdp, enabled, rules, settings
        As `q_learning`.
    seeds
        One run each.
    on_episodes
        Called with the run's place in ``seeds`` and its number of episodes so far, from the run's thread.
    workers
        Threads; left out: one a core.  Kernels run without the GIL.

    Returns
    -------
    list of QResult
        In the order of ``seeds``, the same as one after another.  Ctrl-C ends every run after its current ten
        thousand episodes; the results then say that they are not ``finished``.

    Examples
    --------
    >>> from supremal import Alphabet, Settings, from_outcomes, q_learning_seeds
    >>> step = from_outcomes([(0, "go", 1, 1.0, ("go",), 5.0)], alphabet=Alphabet(("go",)), terminal=[1])
    >>> [r.seed for r in q_learning_seeds(step, [3, 4], settings=Settings(episodes=10))]
    [3, 4]
    """
    stopped = Event()

    def run(place: int, seed: int) -> QResult:
        report = (lambda episodes: on_episodes(place, episodes)) if on_episodes else None
        return q_learning(
            mdp,
            enabled=enabled,
            rules=rules,
            settings=settings,
            seed=seed,
            on_episodes=report,
            should_stop=stopped.is_set,
        )

    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        futures = [pool.submit(run, place, seed) for place, seed in enumerate(seeds)]
        try:
            wait(futures)
        except KeyboardInterrupt:
            stopped.set()
        return [future.result() for future in futures]

"""Supervised Q-learning, Algorithm 1 of the paper, and its relatives.

On the product of environment, rules and reward machine the table q̃ with indices q_s, q_h and u is one table
q(s, a).  At each epoch the agent takes, with probability ε, any enabled action with equal chances, and else
the best of them (the first of equal ones), and learns

    q(s, a) ← q(s, a) + α (r + γ V(s') - q(s, a)),

without V(s') where s' is terminal.  An episode that the limit of steps cuts off is not terminal: its last
step bootstraps like any other.  The algorithms differ in V, over the actions a' that are enabled in s':

* Q-learning: the largest q(s', a').
* Double Q-learning has two tables, of which a coin says which is to learn; V is what the other one gives the
  action that is best in this one, so that no value is overrated for having been lucky.  The agent acts by
  their sum.
* SARSA: q(s', a') of the action a' that the agent takes next.
* Expected SARSA: the mean of q(s', a') over what it may take next.

Without a mask the same call is the unsupervised baseline.  In both cases monitors of the rules stand beside
the learner and count; a supervised learner's zero is measured.

Source: section III of the paper; Watkins, Dayan, "Q-learning", Machine Learning 8 (1992); van Hasselt,
"Double Q-learning", NIPS 2010; van Seijen and others, "A theoretical and empirical analysis of Expected
Sarsa", ADPRL 2009; Sutton, Barto, *Reinforcement Learning*, chapter 6.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from datetime import timedelta
from threading import Event

import numpy as np

from supremal._arrays import Bools, Floats, Ints
from supremal.automata.automaton import Automaton
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import greedy
from supremal.errors import MDPError
from supremal.learning._run import Run, begin, train
from supremal.learning.checkpoints import LearnerState
from supremal.learning.course import lay_out
from supremal.learning.settings import Settings


@dataclass(frozen=True, slots=True, eq=False)
class QResult:
    """What `q_learning` returns; N episodes were run.

    Parameters
    ----------
    q
        ``[S, A]``: the learned values, the mean of two tables where there are two; -inf where an action is
        not enabled.  float64, or float32 where the settings ask for it.
    policy
        ``int32 [S]``: the greedy policy.
    returns, lengths, completed, violations
        ``[N]``: what each episode earned, undiscounted; its steps; whether it met a marked state; how often
        a rule was broken in it, or left with something owed at its end.
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
    environment: TabularMDP | None = None,
    resume: LearnerState | None = None,
    on_episodes: Callable[[int], object] | None = None,
    should_stop: Callable[[], bool] | None = None,
    on_state: Callable[[LearnerState], object] | None = None,
    checkpoint_every: int | timedelta | None = None,
) -> QResult:
    """Learn a policy for ``mdp`` by Algorithm 1, or by another algorithm that the settings name.

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
    environment
        What ``mdp`` is a product of; counterfactual steps need it where its ``origin`` has several columns.
    resume
        A state to go on from, bit for bit as if there had been no stop.  Only the number of episodes may
        differ from what it was learned with.
    on_episodes
        Called with the number of episodes run so far, every ten thousand, or oftener where they are long.
    should_stop
        Asked as often; once it says yes, what there is is returned.
    on_state
        Given the learner's state (see `save_state`) when it ends, is stopped, or is cut off by Ctrl-C.
    checkpoint_every
        How often to do so on the way: after so many episodes, or once so much time has passed.

    Raises
    ------
    MDPError
        If the mask leaves a reachable state without an action, ``resume`` is the state of a learner on
        another model or with other settings, or counterfactual steps need an ``environment``.

    Notes
    -----
    A step takes time linear in the enabled actions of the next state.  A *choice* is a state with an enabled
    action.  Memory is 32 bytes an outcome and 8 a choice for what is learned from, 28 more an outcome for
    counterfactual steps; for each table 8 bytes a choice (4 in single precision), and 8 more where visits
    are counted; and 17 an episode.  The result has 8 bytes (or 4) for each state and action, enabled or not:
    on the paper's grid with 10 actions all this is 222 bytes (or 183) a state at its peak.

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
    run = begin(lay_out(mdp, enabled, rules, settings, environment), settings, seed, resume)
    train(
        run,
        on_episodes=on_episodes,
        should_stop=should_stop,
        on_state=on_state,
        checkpoint_every=checkpoint_every,
    )
    return _result(mdp, run)


def q_learning_seeds(
    mdp: TabularMDP,
    seeds: Sequence[int],
    *,
    enabled: Bools | None = None,
    rules: Sequence[Automaton] = (),
    settings: Settings | None = None,
    environment: TabularMDP | None = None,
    resume: Sequence[LearnerState | None] | None = None,
    on_episodes: Callable[[int, int], object] | None = None,
    on_state: Callable[[int, LearnerState], object] | None = None,
    checkpoint_every: int | timedelta | None = None,
    workers: int | None = None,
) -> list[QResult]:
    """Run `q_learning` once for each of ``seeds``, side by side.

    Parameters
    ----------
    mdp, enabled, rules, settings, environment, checkpoint_every
        As `q_learning`.
    seeds
        One run each.
    resume
        For each seed a state to go on from, or None.
    on_episodes, on_state
        As `q_learning`, called from the run's thread with its place in ``seeds`` before the rest.
    workers
        Threads; left out: one a core.  Kernels run without the GIL.

    Returns
    -------
    list of QResult
        In the order of ``seeds``, the same as one after another.  Ctrl-C ends every run after its current ten
        thousand episodes or fewer; the results then say that they are not ``finished``.

    Raises
    ------
    MDPError
        As `q_learning`, or if there are not as many states to go on from as seeds.

    Examples
    --------
    >>> from supremal import Alphabet, Settings, from_outcomes, q_learning_seeds
    >>> step = from_outcomes([(0, "go", 1, 1.0, ("go",), 5.0)], alphabet=Alphabet(("go",)), terminal=[1])
    >>> [r.seed for r in q_learning_seeds(step, [3, 4], settings=Settings(episodes=10))]
    [3, 4]
    """
    settings = settings or Settings()
    states = [None] * len(seeds) if resume is None else list(resume)
    if len(states) != len(seeds):
        message = f"{len(states)} states to resume from, and {len(seeds)} seeds; give one for each, or None"
        raise MDPError(message)
    course = lay_out(mdp, enabled, rules, settings, environment)
    runs = [begin(course, settings, seed, state) for seed, state in zip(seeds, states, strict=True)]
    stopped = Event()

    def work(place: int) -> QResult:
        train(
            runs[place],
            on_episodes=(lambda episodes: on_episodes(place, episodes)) if on_episodes else None,
            should_stop=stopped.is_set,
            on_state=(lambda state: on_state(place, state)) if on_state else None,
            checkpoint_every=checkpoint_every,
        )
        return _result(mdp, runs[place])

    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        futures = [pool.submit(work, place) for place in range(len(runs))]
        try:
            wait(futures)
        except KeyboardInterrupt:
            stopped.set()
        return [future.result() for future in futures]


def _result(mdp: TabularMDP, run: Run) -> QResult:
    settings, course, n = run.settings, run.course, run.done
    q = np.full((mdp.n_states, mdp.n_actions), -np.inf, settings.dtype)
    state = np.repeat(np.arange(mdp.n_states), np.diff(course.choices))
    q[state, course.action] = run.q.reshape(settings.tables, -1).mean(axis=0, dtype=np.float64)
    return QResult(
        q=q,
        policy=greedy(q),
        returns=run.returns[:n],
        lengths=run.lengths[:n],
        completed=run.completed[:n],
        violations=run.violations[:n],
        seed=run.seed,
        epsilon=settings.epsilon_at(n),
        seconds=run.seconds,
        finished=n == settings.episodes,
    )

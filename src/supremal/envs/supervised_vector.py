"""N environments under a supervisor at once, with array operations: `SupervisedVectorEnv`.

What `SupervisedEnv` does for one environment, for a vector of them: of Gymnasium's, whose environments run
one after another or in processes of their own, or one that computes all of them in arrays.  In each of them
the masks, words, rewards and counts are those that `SupervisedEnv` would give.

What a vector has more is that its environments start new episodes by themselves.  By default they do so *in
the next step*: the step after an episode's last ignores its action and gives the first observation of the
next.  No supervisor moves in such a step, nothing is counted, and nothing is to be learned from it:
``infos["autoreset"]`` says where that was.

Source: as `supremal.envs.supervised`; Gymnasium's documentation, *Vector autoreset modes*.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from supremal._arrays import Bools, Longs
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.decisions.reward_machine import RewardMachine
from supremal.envs._gymnasium import AnyVectorWrapper, AutoresetMode, VectorEnv, batch_space
from supremal.envs._supervised_arrivals import arrival, autoreset_mode, row
from supremal.envs._supervised_gate import replacements
from supremal.envs._supervised_machine import LabelsOfAll, MachineRuns
from supremal.envs._supervised_model import Events, Masks
from supremal.envs._supervised_runs import Runs
from supremal.envs._supervised_setup import Mode, Replace, places_of, set_up
from supremal.envs._supervised_words import Objects, Words, WordsOf
from supremal.envs.layout import Kind
from supremal.errors import MDPError
from supremal.rules.rule import Rule


@dataclass(slots=True)
class VectorCounts:
    """What each environment of a `SupervisedVectorEnv` has counted since it was made.

    Parameters
    ----------
    violations, disabled, model_broken
        ``int64 [N]``: as `Counts` has them.
    """

    violations: Longs
    disabled: Longs
    model_broken: Longs


class SupervisedVectorEnv(AnyVectorWrapper):
    r"""N environments in which a supervisor keeps the rules.

    Parameters
    ----------
    envs
        A vector of environments with `Discrete` actions, resetting themselves in the next step, in the same
        step, or not at all, as ``metadata["autoreset_mode"]`` says.
    word
        A function (actions, observations, rewards, terminations, truncations, infos) that returns N words, or
        an array ``int [N, L]`` of their events' numbers in ``alphabet``, padded by -1.  Left out:
        ``infos["events"]`` where environments gave one, else the event of the action that was carried out.
    labels
        A function (observations, infos) that returns what is true after a step: an array ``int [N]`` whose
        bit i is proposition i of the reward machine, or N sets of names.  Left out: ``infos["labels"]``.
    rules, plant, events, reward_machine, nonblocking, mode, replace, own_mask, safe_actions, observe
        As for `SupervisedEnv`, and so is ``max_states``.

    Raises
    ------
    MDPError, RuleError
        As of `SupervisedEnv`; what goes wrong in one environment says in which.

    Notes
    -----
    ``infos`` has what the ``info`` of a `SupervisedEnv` has, stacked as Gymnasium stacks it: ``action_mask``
    (``int8 [N, A]``), ``action``, ``events`` (N tuples), ``violations``, ``disabled``, ``model_broken``, each
    with its ``_key`` (``bool [N]``, where it applies); and ``autoreset`` (``bool [N]``): whose action was
    ignored, since the step began a new episode.  ``counts`` are arrays, ``int64 [N]``.

    After the last step of an episode ``infos["action_mask"]`` belongs to where it ended, as in a
    `SupervisedEnv`; `action_masks` is all ones there, since the next action will be ignored.

    Where environments reset themselves in the same step, ``infos["final_obs"]`` and ``infos["final_info"]``
    are supervised, too, and `word` and `labels` are asked about how the step ended, not about the next
    episode.  Where they do not reset themselves, give `reset` the option ``reset_mask``.

    In mode "correct" the environments draw as N single ones do, whose `reset` got the seeds of these.

    Inside of the supervisor a step costs a few operations on arrays, some 0.1 µs an environment; one that is
    outside of it, or gets another action, costs some microseconds more.

    Examples
    --------
    >>> import gymnasium
    >>> from supremal import from_text
    >>> envs = gymnasium.make_vec("CliffWalking-v1", num_envs=3, vectorization_mode="sync")
    >>> no_two_ups = from_text("0 -up-> 1 \n 0 -right, down, left-> 0 \n 1 -right, down, left-> 0")
    >>> envs = SupervisedVectorEnv(envs, rules=[no_two_ups], events=["up", "right", "down", "left"])
    >>> observations, infos = envs.reset(seed=0)
    >>> observations, rewards, terminations, truncations, infos = envs.step(np.array([0, 0, 3]))
    >>> observations["supervisor"].tolist(), infos["action_mask"].tolist()
    ([1, 1, 0], [[0, 1, 1, 1], [0, 1, 1, 1], [1, 1, 1, 1]])
    """

    def __init__(
        self,
        envs: VectorEnv[Any, Any, Any],
        *,
        rules: Sequence[Rule | Automaton] = (),
        plant: Automaton | Sequence[Automaton] | None = None,
        events: Events | None = None,
        word: WordsOf | None = None,
        reward_machine: RewardMachine | None = None,
        labels: LabelsOfAll | None = None,
        nonblocking: bool = True,
        mode: Mode = "strict",
        replace: Replace = "random",
        own_mask: bool = False,
        safe_actions: Sequence[int] | None = None,
        observe: Kind = "dict",
        max_states: int | None = None,
    ) -> None:
        if not isinstance(envs, VectorEnv):
            message = (
                f"the environments are {envs!r:.60}; a vector of Gymnasium's is needed, and for a single one "
                "SupervisedEnv"
            )
            raise MDPError(message)
        super().__init__(envs)
        setup = self._setup = set_up(
            envs.single_observation_space,
            envs.single_action_space,
            rules=rules,
            plant=plant,
            events=events,
            word=word,
            reward_machine=reward_machine,
            labels=labels,
            nonblocking=nonblocking,
            mode=mode,
            replace=replace,
            own_mask=own_mask,
            safe_actions=safe_actions,
            observe=observe,
            max_states=max_states,
        )
        n = envs.num_envs
        self.model, self.layout = setup.model, setup.observer.layout
        self.counts = VectorCounts(*np.zeros((3, n), np.int64))
        self._autoreset = autoreset_mode(envs)
        self._runs, self._word = Runs(setup, n), word
        self._words = Words(self.alphabet, self.model.events)
        self._machines = None if reward_machine is None else MachineRuns(reward_machine, labels, n)
        self._random = [replacements(None) for _ in range(n)]
        self._every, self._zeros = np.ones(n, np.bool_), np.zeros(n, np.int32)
        self._every.flags.writeable = False  # infos have it
        self._nobody: Bools = ~self._every
        self._ended = self._nobody
        self._enabled: Masks = np.ones((n, len(self.model.events)), np.int8)
        self._mask = self._enabled
        self._rows = np.arange(n) * len(self.model.events)
        self.single_observation_space = setup.observer.space
        self.observation_space = batch_space(setup.observer.space, n)

    @property
    def alphabet(self) -> Alphabet:
        """All events, those of actions and those of nature, by their numbers."""
        return self.model.supervisor.automaton.alphabet

    def reset(
        self,
        *,
        seed: Any = None,  # noqa: ANN401 - None, one, or N of them
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Start new episodes: of all environments, or of those in ``options["reset_mask"]``, ``bool [N]``."""
        which = self._which(options)
        observations, infos = self.env.reset(seed=seed, options=options)
        if seed is not None:
            seeds = range(seed, seed + self.num_envs) if isinstance(seed, (int, np.integer)) else seed
            for i, own in enumerate(seeds):
                self._random[i] = self._random[i] if own is None else replacements(own)
        self._restart(which)
        self._ended = self._ended & ~which
        enabled, mask = self._runs.settle(infos, ~which)
        self._enabled = np.where(which[:, None], enabled, self._enabled)
        self._mask = np.where(which[:, None], mask, self._mask)
        silent = self._words.names(np.full(self.num_envs, self._words.silent))
        news = self._news(which, silent, np.zeros(self.num_envs, np.int64), self._nobody.copy())
        return self._beside(observations), {**infos, **news}

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:  # noqa: ANN401 - N integers of any kind
        """Let one epoch pass in each environment.

        Raises
        ------
        MDPError
            As `SupervisedEnv.step`, with the environment in which it is.
        """
        ignored = self._ended if self._autoreset is AutoresetMode.NEXT_STEP else self._nobody
        places = places_of(actions, self.num_envs, self._setup.first, len(self.model.events))
        disabled = (self._enabled.reshape(-1).take(self._rows + places) == 0) & ~ignored
        for i in np.flatnonzero(disabled).tolist():
            places[i] = self._runs.instead(i, int(places[i]), self._enabled[i], self._random[i])
        done = places + self._setup.first
        observations, rewards, terminated, truncated, infos = self.env.step(done)
        self._ended = np.logical_or(terminated, truncated)
        again = self._ended if self._autoreset is AutoresetMode.SAME_STEP else self._nobody
        seen, told = observations, infos
        if again.any():
            seen, told = arrival(self.env.single_observation_space, observations, infos, again)

        self._restart(ignored)
        codes = self._said((done, seen, rewards, terminated, truncated, told), places, ignored)
        words, known = self._words.names(codes), self._runs.broken
        violations = self._runs.follow(self._words.rows(codes), words, places)
        if terminated.any():
            violations += np.where(terminated, self._runs.owed(), 0)
        self.counts.violations += violations
        self.counts.disabled += disabled
        self.counts.model_broken += self._runs.broken & ~known
        if self._machines:
            rewards = np.where(ignored, rewards, self._machines.earn(seen, told, ~ignored))
        self._enabled, self._mask = self._runs.settle(told, terminated)
        news = self._news(self._every, words, violations, disabled)
        news |= {"action": done, "_action": ~ignored, "autoreset": ignored.copy()}
        if again.any():
            infos, news = self._begun_again(infos, news, again, terminated)
        return self._beside(observations), rewards, terminated, truncated, {**infos, **news}

    def action_masks(self) -> Bools:
        """Return what may be chosen next, ``bool [N, A]``; anything where the next action will be ignored."""
        masks = self._mask.astype(np.bool_)
        if self._autoreset is AutoresetMode.NEXT_STEP:
            masks |= self._ended[:, None]
        return masks

    def _restart(self, which: Bools) -> None:
        """Let supervisor and reward machine start again."""
        if which.any():
            self._runs.reset(which)
            if self._machines:
                self._machines.reset(which)

    def _which(self, options: dict[str, Any] | None) -> Bools:
        """Return which environments are to start new episodes."""
        which = (options or {}).get("reset_mask", self._every)
        if not isinstance(which, np.ndarray) or which.shape != (self.num_envs,) or which.dtype != np.bool_:
            message = f"reset_mask is {which!r:.60}; an array of {self.num_envs} booleans is needed"
            raise MDPError(message)
        return which

    def _said(self, transition: tuple[Any, ...], places: Longs, ignored: Bools) -> Longs:
        """Return the code of each word that occurred; nothing did where the action was ``ignored``."""
        told = transition[-1]
        words = told.get("events") if self._word is None else self._word(*transition)
        if self._word is None and words is None:
            codes = places.copy()
        else:
            heard = self._every if self._word else told.get("_events", self._every)
            codes = self._words.said(words, places, heard & ~ignored)
        codes[ignored] = self._words.silent
        return codes

    def _news(self, present: Bools, words: Objects, violations: Longs, disabled: Bools) -> dict[str, Any]:
        """Return what the infos of those that are ``present`` have besides the environments' own."""
        news = {
            "action_mask": self._mask.copy(),
            "events": words,
            "violations": violations,
            "disabled": disabled,
            "model_broken": self._runs.broken.copy(),
        }
        return {**news, **{f"_{key}": present for key in news}}

    def _begun_again(
        self, infos: dict[str, Any], news: dict[str, Any], again: Bools, terminated: Bools
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return infos and news where in the same step new episodes have begun ``again``."""
        last = {key: value for key, value in news.items() if not key.startswith("_") and key != "autoreset"}
        final = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(again).tolist():
            machine = int(self._machines.state[i]) if self._machines else 0
            final[i] = self._setup.observer.one(row(infos["final_obs"], i), self._runs.run(i), machine)
        known = {**infos["final_info"], **last, **{f"_{key}": again for key in last}}
        self._restart(again)
        self._enabled, self._mask = self._runs.settle(infos, terminated & ~again)
        silent = self._words.names(np.full(self.num_envs, self._words.silent))
        begun = self._news(
            self._every,
            np.where(again, silent, news["events"]),
            np.where(again, 0, news["violations"]),
            news["disabled"] & ~again,
        )
        acted = {"_action": news["_action"] & ~again}
        return {**infos, "final_obs": final, "final_info": known}, {**news, **begun, **acted}

    def _beside(self, observations: Any) -> Any:  # noqa: ANN401 - the environments'
        """Return the observations with the states that make them Markov."""
        machine = self._machines.state if self._machines else self._zeros
        return self._setup.observer.many(observations, self._runs.state, self._runs.lost, machine)

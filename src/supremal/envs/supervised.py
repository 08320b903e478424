"""Any environment with discrete actions, under a supervisor: `SupervisedEnv`.

An epoch goes like this.  The mask says which actions the supervisor enables in its state; the agent chooses
one; the environment answers, and a *word function* reads off its answer which events really occurred; the
supervisor follows them.  So its state is a function of what happened, never of what was intended.

The guarantee depends on the plant that the supervisor was synthesized against.  With none it holds in any
environment.  With a plant that somebody wrote it holds as long as the environment does nothing that this
plant cannot; where it does, the run goes on in *safe mode* and says so.

Source: section II of the paper; Alshiekh et al., "Safe reinforcement learning via shielding", AAAI 2018.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from supremal._arrays import Bools
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.decisions.reward_machine import RewardMachine
from supremal.envs._gymnasium import Env, RecordConstructorArgs, Wrapper
from supremal.envs._supervised_gate import Gate, replacements
from supremal.envs._supervised_machine import Labels, MachineRun
from supremal.envs._supervised_model import Events
from supremal.envs._supervised_run import Run
from supremal.envs._supervised_setup import Mode, Replace, place_of, set_up
from supremal.envs._supervised_word import as_word
from supremal.envs.layout import Kind
from supremal.errors import MDPError
from supremal.rules.rule import Rule

WordOf: TypeAlias = Callable[[int, Any, float, bool, bool, dict[str, Any]], Iterable[str]]


@dataclass(slots=True)
class Counts:
    """What a `SupervisedEnv` has counted since it was made.

    Parameters
    ----------
    violations
        Events that broke a rule, and rules left with something owed where an episode terminated.
    disabled
        Chosen actions that the mask of the supervisor did not enable.
    model_broken
        Episodes in which something happened that the plant said could not.
    """

    violations: int = 0
    disabled: int = 0
    model_broken: int = 0


class SupervisedEnv(Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    r"""An environment in which a supervisor keeps the rules.

    Parameters
    ----------
    env
        Any environment with `Discrete` actions.
    rules
        Rules, or automata that are rules: what may happen.
    plant
        What can happen: an automaton, or several side by side, over the events of actions and of nature.
        None: anything, at any time, which is the worst case.
    events
        The event of each action: a list, or a function of the action's place.  Left out: action_0, ...
    word
        A function (action, observation, reward, terminated, truncated, info) that returns the events that
        occurred in a step, in order.  Left out: ``info["events"]`` where there is one, else the event of the
        action that was carried out.
    reward_machine
        Where given, its rewards take the place of the environment's.
    labels
        A function (observation, info) that returns the propositions that are true after a step, for the
        reward machine.  Left out: ``info["labels"]``.
    nonblocking
        Whether a state in which plant and rules are marked must stay reachable.
    mode
        What becomes of an action that the mask does not enable.  "strict": an `MDPError`, before the
        environment is touched.  "correct": an enabled action takes its place.  "monitor": it is carried out,
        and violations are counted; every action passes, and the mask says so.
    replace
        Which enabled action takes the place of another: a "random" one, settled by the seed of `reset`, or
        the "first".
    own_mask
        Whether an action has to be enabled by the environment's own ``info["action_mask"]`` as well.
    safe_actions
        The actions to pass in safe mode.  Left out: those that break no rule at once.
    observe
        How the states of supervisor and reward machine are told: "dict", as numbers in a dictionary, or
        "flat", one-hot in an array.
    max_states
        The most states that the product of plant and rules may have.

    Raises
    ------
    MDPError
        If the environment's actions are not `Discrete`, or a setting is not one of those above.
    RuleError
        If events and actions do not fit, or no supervisor can keep the rules; tells why.

    Notes
    -----
    An observation is a dictionary: the environment's own under ``"observation"`` (or, where that is a
    dictionary itself, its keys), the supervisor's state under ``"supervisor"`` (its number, S where the run
    is outside of it) and, where there is one, the reward machine's under ``"machine"``.  With
    ``observe="flat"`` it is one array of numbers; ``layout`` says where in it what stands, and reads the
    supervisor's state off an observation.  Together they are Markov if the environment's own is.

    ``info`` has besides: ``action_mask`` (``int8 [A]``), ``events`` (the word), ``violations`` (how many in
    this step), ``disabled`` (whether the chosen action was) and ``model_broken`` (whether in this episode
    something happened that the plant said could not); after a step ``action``, the one that was carried out.
    At a terminated step no choice follows; the mask is all ones there, so that a maximum over it exists.  At
    a truncated one it is the real one, which the bootstrap needs.

    *Safe mode* is whatever lies outside the supervisor: the mask looks one step ahead at the rules alone, or
    is the user's ``safe_actions``, until the supervisor knows again where it is, at the latest until `reset`.

    A step costs a look-up in a table for each event more than the environment's own, and some microseconds in
    all.

    Examples
    --------
    >>> import gymnasium
    >>> from supremal import from_text
    >>> env = gymnasium.make("CliffWalking-v1")
    >>> no_two_ups = from_text(
    ...     "name no_two_ups \n 0 -up-> 1 \n 0 -right, down, left-> 0 \n 1 -right, down, left-> 0"
    ... )
    >>> env = SupervisedEnv(env, rules=[no_two_ups], events=["up", "right", "down", "left"])
    >>> observation, info = env.reset(seed=0)
    >>> observation, info["action_mask"].tolist()
    ({'observation': 36, 'supervisor': 0}, [1, 1, 1, 1])
    >>> observation, reward, terminated, truncated, info = env.step(0)
    >>> observation, info["action_mask"].tolist()
    ({'observation': 24, 'supervisor': 1}, [0, 1, 1, 1])
    >>> env.step(0)
    Traceback (most recent call last):
    supremal.errors.MDPError: action 0 ('up') is disabled (no_two_ups in 1): it breaks no_two_ups in its
    state 1; enabled: right, down, left
    """

    def __init__(
        self,
        env: Env[Any, Any],
        *,
        rules: Sequence[Rule | Automaton] = (),
        plant: Automaton | Sequence[Automaton] | None = None,
        events: Events | None = None,
        word: WordOf | None = None,
        reward_machine: RewardMachine | None = None,
        labels: Labels | None = None,
        nonblocking: bool = True,
        mode: Mode = "strict",
        replace: Replace = "random",
        own_mask: bool = False,
        safe_actions: Sequence[int] | None = None,
        observe: Kind = "dict",
        max_states: int | None = None,
    ) -> None:
        RecordConstructorArgs.__init__(
            self,
            _disable_deepcopy=True,
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
        if not isinstance(env, Env):
            message = (
                f"the environment is {env!r:.60}; one of Gymnasium's is needed, and for a vector of them "
                "SupervisedVectorEnv"
            )
            raise MDPError(message)
        super().__init__(env)
        setup = set_up(
            env.observation_space,
            env.action_space,
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
        self.model, self.layout, self.counts = setup.model, setup.observer.layout, Counts()
        self._run = Run(setup.model)
        self._gate = Gate(self._run, setup)
        self._machine = None if reward_machine is None else MachineRun(reward_machine, labels)
        self._word, self._first, self._observer = word, setup.first, setup.observer
        self._random = replacements(None)
        self.observation_space = setup.observer.space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start a new episode: of the environment, the supervisor and the reward machine."""
        observation, info = self.env.reset(seed=seed, options=options)
        if seed is not None:
            self._random = replacements(seed)
        self._run.reset()
        if self._machine:
            self._machine.state = 0
        self._gate.settle(info, terminated=False)
        news = {"events": (), "violations": 0, "disabled": False, "model_broken": False}
        return self._beside(observation), {**info, **news, "action_mask": self._gate.mask.copy()}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:  # noqa: ANN401 - an integer of any kind
        """Let one epoch pass.

        Raises
        ------
        MDPError
            If there is no such action, or in mode "strict" if the mask does not enable it; if no action is
            enabled afterwards; or if word or labels are no names.
        """
        place = place_of(action, self._first, len(self.model.events))
        disabled = not self._gate.enabled[place]
        if disabled:
            place = self._gate.instead(place, self._random)
        done, event = self._first + place, self.model.events[place]
        observation, earned, terminated, truncated, info = self.env.step(done)
        reward = float(earned)
        if self._word is None:
            word = info.get("events", (event,))
        else:
            word = self._word(done, observation, reward, terminated, truncated, info)
        if not isinstance(word, tuple):
            word = as_word(word)
        run = self._run
        known = run.surprise is not None
        violations = run.observe(word, event)
        if terminated:
            violations += run.owed
        broken = run.surprise is not None
        if disabled or violations or broken:
            self.counts.violations += violations
            self.counts.disabled += disabled
            self.counts.model_broken += broken and not known
        if self._machine:
            reward = self._machine.earn(observation, info)
        self._gate.settle(info, terminated=terminated)
        info = {
            **info,
            "action": done,
            "action_mask": self._gate.mask.copy(),
            "events": word,
            "violations": violations,
            "disabled": disabled,
            "model_broken": broken,
        }
        return self._beside(observation), reward, terminated, truncated, info

    def action_masks(self) -> Bools:
        """Return the present mask, ``bool [A]``, under the name that maskable learners ask for."""
        return self._gate.mask.astype(np.bool_)

    @property
    def alphabet(self) -> Alphabet:
        """All events, those of actions and those of nature."""
        return self.model.supervisor.automaton.alphabet

    def _beside(self, observation: Any) -> Any:  # noqa: ANN401 - the environment's
        """Return the observation with the states that make it Markov."""
        return self._observer.one(observation, self._run, self._machine.state if self._machine else 0)

"""Environments that stand in for users' own, and a rule for some of them."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Discrete, Space

from supremal import Automaton, from_text

MOVES = ("up", "right", "down", "left")
NO_TWO_UPS = from_text("name no_two_ups\n0 -up-> 1\n0 -right, down, left-> 0\n1 -right, down, left-> 0")


class Plays(gymnasium.Env):
    """An environment that does what a plant can: an action that is not possible does nothing."""

    observation_space = Discrete(1)

    def __init__(self, plant: Automaton, actions: tuple[str, ...]) -> None:
        self.plant, self.actions = plant, actions
        self.action_space = Discrete(len(actions))
        self.at, self.word = 0, ()

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.at, self.word = 0, ()
        return 0, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        word = []
        for name in (
            self.actions[action],
            *self.np_random.permutation(sorted(self.plant.alphabet.uncontrollable)),
        ):
            known = name in self.plant.alphabet
            to = self.plant.run([name], self.at) if known else self.at
            if to >= 0 and (not word or self.np_random.random() < 0.5):
                self.at = to
                word.append(str(name))
        self.word = tuple(word)
        return 0, 0.0, False, False, {"events": self.word}


class Scripted(gymnasium.Env):
    """An environment that answers each step with the next word, and ends after the last."""

    observation_space = Discrete(1)

    def __init__(self, *words: Any, actions: int = 2, start: int = 0, **info: Any) -> None:
        self.words, self.info, self.taken = words, info, []
        self.action_space = Discrete(actions, start=start)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.taken = []
        return 0, dict(self.info)

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.taken.append(action)
        word = self.words[len(self.taken) - 1]
        said = {} if word is None else {"events": word}
        return 0, 1.0, len(self.taken) == len(self.words), False, {**self.info, **said}


class Stormy(gymnasium.Env):
    """An environment that does nearly what a plant can, and says all that one may say.

    With probability ``strange`` something happens that nobody expects: any event at all, or one with a name
    that no alphabet has.  One step in ten says no word, one in seven ends the episode either way.
    """

    def __init__(
        self, plant: Automaton, actions: tuple[str, ...], space: Space[Any], *, strange: float, free: float
    ) -> None:
        self.plant, self.actions, self.strange, self.free = plant, actions, strange, free
        self.observation_space = deepcopy(space)
        self.action_space = Discrete(len(actions), start=3)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        if seed is not None:
            self.observation_space.seed(seed)
        self.at = 0
        return self.observation_space.sample(), {"action_mask": self.own_mask()}

    def step(self, action: int) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        random, alphabet, word = self.np_random, self.plant.alphabet, []
        chosen = self.actions[action - 3]
        for name in (chosen, *random.permutation(sorted(alphabet.uncontrollable))):
            to = self.plant.run([name], self.at) if name in alphabet else self.at
            if to >= 0 and (not word or random.random() < 0.5):
                self.at = to
                word.append(str(name))
        if random.random() < self.strange:
            word.append(str(random.choice([*alphabet, "sparrow"])))
        info = {"labels": tuple(np.array(["p", "q"])[random.random(2) < 0.5].tolist())}
        info |= {"action_mask": self.own_mask(), "events": tuple(word)}
        if random.random() < 0.1:
            del info["events"]
        terminated, truncated = (random.random(2) < 1 / 14).tolist()
        return self.observation_space.sample(), random.normal(), terminated, truncated, info

    def own_mask(self) -> np.ndarray:
        return (self.np_random.random(len(self.actions)) < self.free).astype(np.int8)

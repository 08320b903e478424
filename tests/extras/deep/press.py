"""A press with faults: small enough to know by hand which actions keep its rules."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from supremal import Alphabet, from_text, rule_from_regex
from supremal.envs.supervised import SupervisedEnv

ACTIONS = ("strike", "rest", "oil")
SIGMA = Alphabet((*ACTIONS, "jam", "dust"), uncontrollable={"jam", "dust"})
PLANT = from_text("""
    name press
    uncontrollable jam
    cold -strike-> warm
    warm -strike-> hot
    hot -strike-> hot
    hot -jam-> hot
    cold -rest, oil-> cold
    warm -rest, oil-> cold
    hot -rest, oil-> warm
""")
RULES = [
    rule_from_regex("~(.* jam .*)", SIGMA),
    rule_from_regex("~(.* dust [^oil]* strike .*)", SIGMA),
    rule_from_regex("~(.* oil (dust | jam)* oil .*)", SIGMA),
]
EPISODE, STROKES = 40, 9


class Press(gymnasium.Env):
    """It heats with every stroke, and may jam where it is hot; dust comes at any time; 9 strokes end it."""

    action_space = gymnasium.spaces.Discrete(3)
    observation_space = gymnasium.spaces.Box(0, 2, (1,), np.float32)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:  # noqa: ARG002 - has none
        super().reset(seed=seed)
        self.heat, self.steps, self.strokes = 0, 0, 0
        self.dusty = self.oiled = False
        return np.array([self.heat], np.float32), {"keeps": self.keeps()}

    def step(self, action: int) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        name = ACTIONS[action]
        strikes = name == "strike"
        self.heat = min(self.heat + 1, 2) if strikes else max(self.heat - 1, 0)
        self.dusty &= name != "oil"
        self.oiled = name == "oil"
        chance = self.np_random.random(2)
        jams, dust = self.heat == 2 and chance[0] < 0.5, chance[1] < 0.1
        self.dusty |= bool(dust)
        self.steps, self.strokes = self.steps + 1, self.strokes + strikes
        word = (name, *(["jam"] if jams else []), *(["dust"] if dust else []))
        info = {"events": word, "keeps": self.keeps()}
        done, late = self.strokes == STROKES, self.steps == EPISODE
        return np.array([self.heat], np.float32), float(strikes), done, late, info

    def keeps(self) -> list[bool]:
        """Return by definition which actions keep all rules, whatever happens after them.

        A stroke where it is warm makes it hot, and it may jam.
        """
        return [self.heat == 0 and not self.dusty, True, not self.oiled]


def press(**options: Any) -> SupervisedEnv:
    """Return the press under its supervisor."""
    return SupervisedEnv(Press(), rules=RULES, plant=PLANT, events=ACTIONS, **options)

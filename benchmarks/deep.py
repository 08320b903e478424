"""Deep learners under a supervisor, on a level of MiniGrid with faults, beside ones that pay.

The world is MiniGrid's DoorKey: fetch the key, open the door, reach the goal; the layout is new in each
episode, and there is no model of it.  Nature has two events more.  A *blackout* can come after any step.  A
motor that is hot may *jam*; going forward heats it, anything else cools it, a rest at once.  The rules: after
a blackout, rest before doing anything but turn; no left and right in turn; and the motor never jams, which is
kept by never letting it get hot, a rule that nobody wrote.

*Goals*: how many are reached in 1,000 steps.  *Violations*: counted by the environment, in every step.  The
learners with a penalty are Stable-Baselines3's own, with the same settings and networks (but DQN's target is
not double there); a monitor tells the same states beside the observation, each violation costs.

``python -m benchmarks.deep --jobs 2`` runs two at a time; ``--steps``, ``--shown`` and ``--play`` say how
long the two learners under the supervisor go on, those of the curves, and what was saved and loaded.
"""

from __future__ import annotations

import argparse
import json
import platform
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import gymnasium
import numpy as np
import torch
from minigrid.core.constants import OBJECT_TO_IDX
from minigrid.envs import DoorKeyEnv
from numpy.typing import NDArray
from sb3_contrib import MaskablePPO
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv

from benchmarks.__main__ import RECORDS, processor
from supremal import Alphabet, from_text, rule_from_regex
from supremal.deep import Bundle, MaskedDQN, load, save
from supremal.envs.supervised import SupervisedEnv
from supremal.learning.statistics import bootstrap_interval, interquartile_mean
from supremal.show.figures import Series, curves_svg

SIZE = 5  # with the walls around
CELLS = (SIZE - 2) ** 2
KINDS, AGENT = len(OBJECT_TO_IDX), OBJECT_TO_IDX["agent"]
ACTIONS = ("left", "right", "forward", "pickup", "drop", "toggle", "rest")
BLACKOUT, JAM = 0.05, 0.3  # how likely they are, after a step and where the motor is hot
SIGMA = Alphabet((*ACTIONS, "blackout", "jam"), uncontrollable={"blackout", "jam"})
RULES = [
    rule_from_regex("~(.* blackout [^rest]* (forward | pickup | drop | toggle) .*)", SIGMA),
    rule_from_regex("~(.* (left right | right left) .*)", SIGMA),
    rule_from_regex("~(.* jam .*)", SIGMA),
]
MOTOR = from_text("""
    name motor
    uncontrollable jam
    cold -forward-> warm
    warm -forward-> hot
    hot -forward-> hot
    hot -jam-> hot
    cold -left, right, pickup, drop, toggle, rest-> cold
    warm -left, right, pickup, drop, toggle, rest-> cold
    hot -left, right, pickup, drop, toggle-> warm
    hot -rest-> cold
""")
PENALTY = 0.1
ENVS = 16
SEEDS = range(5)
STEPS, CURVE_STEPS, STRETCHES, PLAYED = 1_000_000, 80_000, 20, 100_000
EXPLORING = 30_000  # steps until ε is at its least


class Level(DoorKeyEnv):
    """DoorKey with a motor and blackouts: seen from above, each cell one-hot, and telling what happened."""

    def __init__(self) -> None:
        super().__init__(size=SIZE)
        self.observation_space = gymnasium.spaces.Box(0, 1, (CELLS * (KINDS + 3) + 4,), np.float32)

    def gen_obs(self) -> NDArray[np.float32]:
        cells = np.zeros((CELLS, KINDS + 3), np.float32)
        for k in range(CELLS):
            cell = self.grid.get(1 + k // (SIZE - 2), 1 + k % (SIZE - 2))
            if cell is not None:
                kind, _, door = cell.encode()
                cells[k, [kind, KINDS + door]] = 1
        x, y = self.agent_pos
        cells[(x - 1) * (SIZE - 2) + y - 1, AGENT] = 1
        return np.append(cells, np.eye(4)[self.agent_dir]).astype(np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        self.heat = 0
        return super().reset(seed=seed, options=options)

    def step(self, action: int) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = super().step(action)
        name = ACTIONS[action]
        self.heat = (
            min(self.heat + 1, 2) if name == "forward" else 0 if name == "rest" else max(self.heat - 1, 0)
        )
        chance = self.np_random.random(2)
        jams, black = self.heat == 2 and chance[0] < JAM, chance[1] < BLACKOUT
        word = (name, *(["jam"] if jams else []), *(["blackout"] if black else []))
        return observation, float(reward), terminated, truncated, {**info, "events": word}


class Penalty(gymnasium.Wrapper):
    """Each violation costs."""

    def step(self, action: int) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward - PENALTY * info["violations"], terminated, truncated, info


def world(*, supervised: bool) -> gymnasium.Env:
    mode = "strict" if supervised else "monitor"
    env = SupervisedEnv(Level(), rules=RULES, plant=MOTOR, events=ACTIONS, observe="flat", mode=mode)
    return env if supervised else Penalty(env)


class Tally(BaseCallback):
    """What happened: violations, faults, and at which steps a goal was reached."""

    def __init__(self) -> None:
        super().__init__()
        self.violations = self.faults = 0
        self.goals: list[int] = []

    def _on_step(self) -> bool:
        for info, done in zip(self.locals["infos"], self.locals["dones"], strict=True):
            self.violations += info["violations"]
            self.faults += len(info["events"]) - 1
            if done and not info["TimeLimit.truncated"]:
                self.goals.append(self.num_timesteps)
        return True

    def curve(self) -> list[float]:
        """Return how many goals were reached in 1,000 steps, in each stretch."""
        goals, _ = np.histogram(self.goals, STRETCHES, (0, self.num_timesteps))
        return [round(float(n) * 1_000 * STRETCHES / self.num_timesteps, 2) for n in goals]


ON_POLICY = {"n_steps": 64, "batch_size": 256, "n_epochs": 4, "learning_rate": 1e-3, "ent_coef": 0.01}
OFF_POLICY = {
    "learning_rate": 5e-4,
    "buffer_size": 50_000,
    "learning_starts": 2_000,
    "batch_size": 128,
    "gradient_steps": 2,
    "target_update_interval": 1_000,
}
WAYS: dict[str, tuple[Callable[..., Any], dict[str, Any], bool]] = {
    "MaskablePPO": (MaskablePPO, ON_POLICY, True),
    "MaskedDQN": (MaskedDQN, OFF_POLICY | {"double": True}, True),
    "PPO, penalty": (PPO, ON_POLICY, False),
    "DQN, penalty": (DQN, OFF_POLICY, False),
}
"""Learner, settings, and whether there is a supervisor."""


def learned(way: str, seed: int, steps: int, play: int = 0) -> dict[str, Any]:
    """Return what came of so many steps, and of playing what was learned, saved and loaded."""
    torch.set_num_threads(1)
    kind, settings, supervised = WAYS[way]
    if issubclass(kind, DQN):
        often = {"exploration_fraction": min(EXPLORING / steps, 1), "train_freq": max(1, steps // 250_000)}
        settings = settings | often  # as much of both in a long run
    tally = Tally()
    envs = DummyVecEnv([partial(world, supervised=supervised)] * ENVS)
    model = kind("MlpPolicy", envs, seed=seed, device="cpu", **settings)
    began = perf_counter()
    model.learn(steps, callback=tally)
    row = {
        "steps": model.num_timesteps,
        "violations": tally.violations,
        "faults": tally.faults,
        "goals": tally.curve(),
        "steps_per_second": round(model.num_timesteps / (perf_counter() - began)),
    }
    if play:
        with TemporaryDirectory() as folder:
            path = Path(folder) / "bundle.zip"
            save(path, model)
            row |= {"bundle_bytes": path.stat().st_size, "played": played(load(path), play, seed + 1)}
    print(f"{way:14} seed {seed:<4} {json.dumps(row)}", flush=True)
    return row


def played(bundle: Bundle, steps: int, seed: int) -> dict[str, Any]:
    """Return what a loaded bundle did in so many steps, its masks read off the observations alone."""
    env = world(supervised=True)
    observation, _ = env.reset(seed=seed)
    successes: list[bool] = []
    violations = faults = 0
    random = np.random.default_rng(seed) if bundle.scores == "logits" else None
    for _ in range(steps):
        action = bundle.predict(observation, random=random)
        observation, _, terminated, truncated, info = env.step(action)
        violations += info["violations"]
        faults += len(info["events"]) - 1
        if terminated or truncated:
            successes.append(terminated)
            observation, _ = env.reset()
    return {
        "steps": steps,
        "violations": violations,
        "faults": faults,
        "episodes": len(successes),
        "success": float(np.mean(successes)),
    }


def summary(rows: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    """Print and return, of each learner, the mean of the middle half of the seeds and its 95 % interval."""
    record: dict[str, Any] = {}
    print(f"{'':14}{'goals in 1,000 steps':>28}{'violations in training':>36}")
    for way, runs in rows.items():
        values = {
            "goals": [row["goals"][-1] for row in runs],
            "violations": [row["violations"] for row in runs],
        }
        record[way] = {"runs": runs}
        for name, several in values.items():
            low, high = bootstrap_interval(several, interquartile_mean, resamples=1000)
            record[way][name] = [float(interquartile_mean(several)), float(low), float(high)]
        goals = "{:12.1f} ({:.1f}-{:.1f})".format(*record[way]["goals"])
        print(f"{way:14}{goals:>28}{'{:12,.0f} ({:,.0f}-{:,.0f})'.format(*record[way]['violations']):>36}")
    return record


def draw(record: dict[str, Any], steps: int) -> None:
    """Draw each masked learner beside the one with a penalty: the mean of the seeds, and their range."""
    x = [round(steps * (k + 1) / STRETCHES) for k in range(STRETCHES)]
    for name, pair in (("ppo", ("MaskablePPO", "PPO, penalty")), ("dqn", ("MaskedDQN", "DQN, penalty"))):
        series = []
        for way, style in zip(pair, ("main", "second"), strict=True):
            runs = np.array([row["goals"] for row in record[way]["runs"]])
            band = list(zip(runs.min(axis=0).tolist(), runs.max(axis=0).tolist(), strict=True))
            series.append(Series(way, x, runs.mean(axis=0).tolist(), style, band))
        chart = curves_svg(series, xlabel="steps", ylabel="goals in 1,000 steps")
        (RECORDS / f"deep_{name}.svg").write_text(chart, encoding="utf-8")


def run(steps: int = STEPS, shown: int = CURVE_STEPS, play: int = PLAYED, jobs: int = 1) -> dict[str, Any]:
    """Print the tables; return the record, and draw its curves beside it."""
    under = [way for way, (_, _, supervised) in WAYS.items() if supervised]
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        long = {way: pool.submit(learned, way, 100, steps, play) for way in under}
        short = {(way, seed): pool.submit(learned, way, seed, shown) for seed in SEEDS for way in WAYS}
        record: dict[str, Any] = {"level": f"DoorKey {SIZE}x{SIZE}", "penalty": PENALTY, "environments": ENVS}
        rows = {way: [short[way, seed].result() for seed in SEEDS] for way in WAYS}
        record |= {"curves": summary(rows), "long": {way: row.result() for way, row in long.items()}}
    for way in under:
        row = record["long"][way]
        played_steps, broken = row["played"]["steps"], row["played"]["violations"]
        print(f"{way:14}{row['steps']:12,} steps, {row['faults']:,} faults, {row['violations']} violations")
        print(f"{'as a bundle':14}{played_steps:12,} steps, {broken} violations")
        assert row["violations"] == broken == 0 < min(row["faults"], row["played"]["faults"])
        assert all(run["violations"] == 0 for run in rows[way])
    draw(record["curves"], shown)
    return record


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.deep")
    for option, default in (("steps", STEPS), ("shown", CURVE_STEPS), ("play", PLAYED), ("jobs", 1)):
        parser.add_argument(f"--{option}", type=int, default=default)
    found = run(**vars(parser.parse_args()))
    found |= {"python": platform.python_version(), "processor": processor()}
    (RECORDS / "deep.json").write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")

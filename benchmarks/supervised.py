"""What supervision costs a step: `SupervisedEnv` and `SupervisedVectorEnv` beside the bare environment.

The environment is Gymnasium's CartPole, alone, and N of them in arrays.  The rules: never four pushes to the
same side in a row, and not three to the left right after a *gust*, which nobody controls.  What may occur
in a step is told in four ways:

========  ============================================================================================
actions   nothing does but the actions: there is no function ``word``
numbers   a function of the whole batch tells of gusts, one step in seven, as numbers
names     the same as names
lost      as *names*; but nobody said that a *quake* can happen, one step in a hundred and forty-seven,
          and from there to the episode's end the supervisor does not know where it is
========  ============================================================================================

Times are those of the processor, since others may compute beside, and the best of some rounds, in which all
take turns; an episode's end and the next one's beginning, some twenty steps later, are part of them.  A step
alone is measured on an environment that does nothing and never ends.
"""

from __future__ import annotations

from collections.abc import Callable
from time import process_time
from typing import Any, TypeAlias

import gymnasium
import numpy as np
from numpy.typing import NDArray

from supremal import from_text
from supremal.envs import SupervisedEnv
from supremal.envs.layout import KINDS as LAYOUTS
from supremal.envs.supervised_vector import SupervisedVectorEnv

Env: TypeAlias = gymnasium.Env[Any, Any]
Envs: TypeAlias = gymnasium.vector.VectorEnv[Any, Any, Any]
Longs: TypeAlias = NDArray[np.int64]

ROUNDS = 60
SINGLE_STEPS = 600
VECTOR_STEPS = {32: 40, 1024: 8}
PUSHES = (0, 0, 1, 1)  # keeps the rules, wherever an episode begins
GUST, QUAKE = 7, 147

PLANT = from_text("""
    name weather
    events left, right, gust, quake
    uncontrollable gust, quake
    any -left, right, gust-> any
""")
TURNS = from_text("""
    name turns
    start -left-> l1
    start -right-> r1
    l1 -left-> l2
    l2 -left-> l3
    l1 -right-> r1
    l2 -right-> r1
    l3 -right-> r1
    r1 -right-> r2
    r2 -right-> r3
    r1 -left-> l1
    r2 -left-> l1
    r3 -left-> l1
""")
LEE = from_text("""
    name lee
    uncontrollable gust
    calm -left, right-> calm
    calm -gust-> windy
    windy -gust-> windy
    windy -right-> calm
    windy -left-> w1
    w1 -gust-> windy
    w1 -right-> calm
    w1 -left-> w2
    w2 -gust-> windy
    w2 -right-> calm
""")
KINDS = ("actions", "numbers", "names", "lost")


class Idle(gymnasium.Env[int, int]):
    """Does nothing, and never ends."""

    observation_space = gymnasium.spaces.Discrete(2)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        return 0, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        return action, 0.0, False, False, {}


class Weather:
    """Word functions: of one environment or of N, whose steps they count."""

    def __init__(self, *, quake: bool = False) -> None:
        self.steps, self.quake = 0, quake

    def one(self, action: int, *_: object) -> tuple[str, ...]:
        """Return the word of a step."""
        self.steps += 1
        word = ("right",) if action else ("left",)
        if self.quake and self.steps % QUAKE == 0:
            return (*word, "quake")
        return word if self.steps % GUST else (*word, "gust")

    def names(self, actions: Longs, *_: object) -> list[tuple[str, ...]]:
        """Return N words."""
        return [self.one(action) for action in actions.tolist()]

    def numbers(self, actions: Longs, *_: object) -> Longs:
        """Return N words as numbers of left, right and gust."""
        steps = self.steps + np.arange(1, len(actions) + 1)
        self.steps += len(actions)
        return np.column_stack([actions, np.where(steps % GUST, -1, 2)])


def options(kind: str, *, vector: bool) -> dict[str, Any]:
    """Return what a supervised environment is made with."""
    weather = Weather(quake=kind == "lost")
    told = {"names": weather.names, "numbers": weather.numbers, "lost": weather.names}
    return {
        "rules": [TURNS, LEE],
        "plant": PLANT,
        "events": ["left", "right"],
        "mode": "correct",
        "word": (told.get(kind) if vector else weather.one) if kind != "actions" else None,
    }


def walk(env: Env, steps: int) -> None:
    """Take so many steps in one environment."""
    for k in range(steps):
        _, _, terminated, truncated, _ = env.step(PUSHES[k % 4])
        if terminated or truncated:
            env.reset()


def walk_all(envs: Envs, steps: int) -> None:
    """Take so many steps in each of N environments."""
    pushes = [np.full(envs.num_envs, push) for push in PUSHES]
    for k in range(steps):
        envs.step(pushes[k % 4])


def best(take: dict[str, Callable[[], None]]) -> dict[str, float]:
    """Return the least time of each, in seconds; they take turns."""
    times = dict.fromkeys(take, np.inf)
    for _ in range(ROUNDS):
        for name, act in take.items():
            began = process_time()
            act()
            times[name] = min(times[name], process_time() - began)
    return times


def overheads(
    bare: Env | Envs, supervised: dict[str, Any], walked: Callable[[Any, int], None], steps: int
) -> dict[str, Any]:
    """Print and return the microseconds of a step of one environment, and how many more if supervised."""
    envs = {"bare": bare, **supervised}
    for env in envs.values():
        env.reset(seed=0)
    times = best({name: (lambda env=env: walked(env, steps)) for name, env in envs.items()})
    n = getattr(bare, "num_envs", 1)
    each = {name: seconds / steps / n * 1e6 for name, seconds in times.items()}
    row: dict[str, Any] = {"bare": each["bare"]}
    for name in supervised:
        more = each[name] - each["bare"]
        row[name] = {"more": more, "ratio": each[name] / each["bare"]}
        print(f"  {name:16} {more:7.3f} µs more  {row[name]['ratio']:6.2f} ×")
    return row


def run() -> dict[str, Any]:
    """Print the table; return the record."""
    record: dict[str, Any] = {}
    for name, made in (("idle", Idle), ("single", cart_pole)):
        print(f"one environment: {name}")
        single = {
            f"{kind}, {observe}": SupervisedEnv(made(), observe=observe, **options(kind, vector=False))
            for kind in ("actions", "names", "lost")
            for observe in LAYOUTS
        }
        record[name] = overheads(made(), single, walk, SINGLE_STEPS)
    for n, steps in VECTOR_STEPS.items():
        print(f"{n} environments")
        vector = {
            f"{kind}, {observe}": SupervisedVectorEnv(
                cart_poles(n), observe=observe, **options(kind, vector=True)
            )
            for kind in KINDS
            for observe in LAYOUTS
        }
        record[f"vector of {n}"] = overheads(cart_poles(n), vector, walk_all, steps)
    return record


def cart_pole() -> Env:
    """Return one environment, with no wrapper around it."""
    return gymnasium.make("CartPole-v1").unwrapped


def cart_poles(n: int) -> Envs:
    """Return N environments in arrays."""
    return gymnasium.make_vec("CartPole-v1", num_envs=n, vectorization_mode="vector_entry_point")

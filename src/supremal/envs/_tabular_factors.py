"""What is known of Gymnasium's own finite environments: names of actions, and what a state looks like."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from supremal.decisions.conditions import Condition, Factor
from supremal.envs._gymnasium import CliffWalkingEnv, Env, FrozenLakeEnv, TaxiEnv

_COLOURS: Final = ("red", "green", "yellow", "blue", "taxi")


class Look(NamedTuple):
    """What is known of an environment beside its table."""

    actions: tuple[str, ...]
    factors: dict[str, Factor]
    marked: Condition | None = None


def known_look(env: Env[Any, Any], states: int) -> Look:
    """Return what is known of one of Gymnasium's environments by its kind, nothing of another."""
    if isinstance(env, FrozenLakeEnv):
        return Look(
            ("left", "down", "right", "up"), _ground(np.asarray(env.desc, np.str_), "SFHG"), {"tile": "G"}
        )
    if isinstance(env, CliffWalkingEnv):
        tiles = np.full(env.shape, "F")
        tiles[-1, 1:-1], tiles[-1, -1], tiles.flat[env.start_state_index] = "C", "G", "S"
        return Look(("up", "right", "down", "left"), _ground(tiles, "SFCG"))
    if isinstance(env, TaxiEnv):
        row, column, passenger, destination = np.unravel_index(np.arange(states), (5, 5, 5, 4))
        factors = {
            "row": _numbers(row),
            "column": _numbers(column),
            "passenger": _named(_COLOURS, passenger),
            "destination": _named(_COLOURS[:-1], destination),
        }
        return Look(("south", "north", "east", "west", "pickup", "dropoff"), factors)
    return Look((), {})


def _ground(tiles: NDArray[np.str_], letters: str) -> dict[str, Factor]:
    """Return row, column and tile of the cells of a map, counted row by row."""
    row, column = (part.reshape(-1) for part in np.indices(tiles.shape))
    flat = tiles.reshape(-1).tolist()
    code = {letter: k for k, letter in enumerate(dict.fromkeys([*letters, *flat]))}
    tile = Factor(code, np.array([code[letter] for letter in flat], np.int32))
    return {"row": _numbers(row), "column": _numbers(column), "tile": tile}


def _numbers(of: NDArray[np.integer]) -> Factor:
    return Factor({k: k for k in range(int(of.max()) + 1)}, of)


def _named(names: Sequence[str], of: NDArray[np.integer]) -> Factor:
    """Return a factor whose values can be said by name or by number."""
    return Factor({way: k for k, name in enumerate(names) for way in (name, k)}, of)

"""What varies in a study: the values of each key, in order, and where the study file says so.

A grid is all combinations of its lists, of which the last varies fastest.  In a random search every key has
a stream of random numbers of its own, made of the seed and the key: another key beside it changes nothing.
The draws are the same at every point of a grid, so that points are compared under the same conditions.

Source: Bergstra, Bengio, "Random search for hyper-parameter optimization", JMLR 13 (2012).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from math import exp, log, prod
from typing import Any, Final, TypeAlias

import numpy as np

from supremal.task._fields import Field, check_keys, choose, number, shown, table, take, whole

MAX_SETTINGS: Final = 100_000
"""The most settings of a study."""

Choices: TypeAlias = list[tuple[Any, Field]]
"""Values, and where each is said."""


@dataclass(frozen=True, slots=True, eq=False)
class Axes:
    """What varies: the ``choices`` of each key of a grid, and as many ``draws`` of each random one."""

    choices: dict[str, Choices]
    draws: dict[str, Choices]

    def __iter__(self) -> Iterator[dict[str, tuple[Any, Field]]]:
        """Give every combination of the grid with every draw."""
        for point in product(*self.choices.values()):
            for draw in zip(*self.draws.values(), strict=True) if self.draws else [()]:
                yield dict(zip((*self.choices, *self.draws), (*point, *draw), strict=True))


def read_axes(root: Field) -> Axes:
    """Read ``[grid]`` and ``[random]``."""
    grid: dict[str, Choices] = {}
    for key, field in _leaves(root["grid"], _is_list).items() if "grid" in root else ():
        grid[key] = [(element.value, element) for element in field.elements()]
        if not grid[key]:
            field.fail("is []; a list of values is needed")
    draws = _read_random(root["random"]) if "random" in root else {}
    for key in draws:
        if key in grid:
            draws[key][0][1].fail(f"{key!r} is in [grid] too; leave it out of one of them", key=True)
    count = prod(len(choices) for choices in grid.values()) * len(next(iter(draws.values()), [None]))
    if count > MAX_SETTINGS:
        root.fail(f"these are {count:,} settings; at most {MAX_SETTINGS:,} are run")
    return Axes(grid, draws)


def _leaves(field: Field, is_leaf: Callable[[Field], bool], above: str = "") -> dict[str, Field]:
    """Return every key below ``field``, with its tables and dots, down to what ``is_leaf``."""
    found: dict[str, Field] = {}
    for part in table(field).value:
        key, below = f"{above}{part}", field[part]
        if is_leaf(below):
            inside = {key: below}
        elif isinstance(below.value, dict):
            inside = _leaves(below, is_leaf, f"{key}.")
        else:
            below.wrong("a list of values" if is_leaf is _is_list else _RANGES)
        for twice in found.keys() & inside.keys():
            inside[twice].fail(f"{twice!r} stands here twice; leave out one", key=True)
        found |= inside
    return found


def _is_list(field: Field) -> bool:
    return isinstance(field.value, list)


# --- random search ----------------------------------------------------------------------------------------


def _read_random(field: Field) -> dict[str, Choices]:
    samples = take(table(field), "samples", whole(1), None)
    if samples is None:
        field.fail("has no 'samples'; say how many settings are to be drawn", key=True)
    if samples > MAX_SETTINGS:
        field["samples"].wrong(f"a number up to {MAX_SETTINGS:,}")
    seed = take(field, "seed", whole(), 0)
    rest = Field(field.document, field.path, {k: v for k, v in field.value.items() if k not in _OWN})
    if not rest.value:
        field.fail("has no key to draw for, such as learner.alpha = { uniform = [0.1, 0.5] }", key=True)
    return {
        key: [(value, leaf) for value in _draw(leaf, np.random.default_rng([seed, *key.encode()]), samples)]
        for key, leaf in _leaves(rest, _is_range).items()
    }


def _is_range(field: Field) -> bool:
    return isinstance(field.value, dict) and any(kind in field.value for kind in _KINDS)


def _draw(field: Field, random: np.random.Generator, samples: int) -> list[Any]:
    """Draw from a range."""
    check_keys(field, _KINDS)
    kind = choose(field, list(_KINDS))
    return _KINDS[kind](field[kind], random, samples)


def _uniform(field: Field, random: np.random.Generator, samples: int) -> list[Any]:
    low, high = _ends(field, number)
    return [_rounded(x, low, high) for x in random.uniform(low, high, samples)]


def _log_uniform(field: Field, random: np.random.Generator, samples: int) -> list[Any]:
    low, high = _ends(field, number)
    if low <= 0:
        field.fail(f"is {shown(field.value)}; numbers above 0 are needed")
    return [_rounded(exp(x), low, high) for x in random.uniform(log(low), log(high), samples)]


def _integers(field: Field, random: np.random.Generator, samples: int) -> list[Any]:
    low, high = _ends(field, whole())
    return list(random.integers(low, high, samples, endpoint=True).tolist())


def _choice(field: Field, random: np.random.Generator, samples: int) -> list[Any]:
    values = [element.value for element in field.elements()]
    if not values:
        field.wrong("a list of values")
    return [values[k] for k in random.integers(len(values), size=samples)]


_KINDS: Final = {"uniform": _uniform, "log_uniform": _log_uniform, "integers": _integers, "choice": _choice}
_OWN: Final = ("samples", "seed")
_RANGES: Final = f"a table with one of {', '.join(_KINDS)}"


def _ends(field: Field, read: Callable[[Field], Any]) -> tuple[Any, Any]:
    """Read the least and the largest value."""
    ends = [read(element) for element in field.elements()]
    if len(ends) != 2 or ends[0] >= ends[1]:
        field.wrong("[least, largest]")
    return ends[0], ends[1]


def _rounded(x: float, low: float, high: float) -> float:
    """Return ``x`` with six digits, which are enough to search by, and the same on every machine."""
    return min(max(float(f"{x:.6g}"), low), high)

"""The least automaton, beside libFAUDES on the smaller sizes; above them, how our time grows.

Twenty events.  *Random*: every state of a random automaton stands there four times, and each transition leads
to any of the copies, so that three quarters of the states have to go.  *Shifts*: a ring with one marked
state, on which event e leads from s to 2 s + e: nothing has to go, and it takes long words to tell states
apart.
"""

from __future__ import annotations

from collections.abc import Callable
from math import log
from typing import Any

import faudes
import numpy as np

from benchmarks.synthesis import PATIENCE, timed, to_faudes
from supremal import Alphabet, Automaton, minimise

EVENTS = 20
SIZES = (1_000, 10_000, 100_000, 1_000_000)
REPEATS = 3
COPIES = 4
SIGMA = Alphabet(tuple(f"e{e}" for e in range(EVENTS)))


def copies(states: int) -> Automaton:
    """Return a random automaton, every state several times."""
    rng = np.random.default_rng(0)
    size = states // COPIES
    delta = np.where(rng.random((size, EVENTS)) < 0.5, rng.integers(0, size, (size, EVENTS)), -1)
    wide = np.tile(delta, (COPIES, 1))
    wide = np.where(wide >= 0, wide + size * rng.integers(0, COPIES, wide.shape), -1)
    return Automaton(SIGMA, wide, np.tile(rng.random(size) < 0.5, COPIES))


def shifts(states: int) -> Automaton:
    """Return a ring whose other events double the number of the state."""
    s, e = np.arange(states)[:, None], np.arange(EVENTS)
    return Automaton(SIGMA, np.where(e == 0, s + 1, 2 * s + e) % states, np.arange(states) == 0)


def by_faudes(automaton: Automaton) -> tuple[int, float]:
    """Return how many states libFAUDES finds and the time it took, hand-over left out."""
    generator = faudes.Generator(to_faudes(automaton))
    result = faudes.Generator()
    _, seconds = timed(lambda: faudes.StateMin(generator, result))
    return int(result.Size()), seconds


def run() -> dict[str, Any]:
    """Print the times and their ratios; return the record."""
    minimise(shifts(10))
    record: dict[str, Any] = {}
    makes: dict[str, Callable[[int], Automaton]] = {"random": copies, "shifts": shifts}
    for kind, make in makes.items():
        rows, theirs = [], 0.0
        for states in SIZES:
            automaton = make(states)
            least, seconds = timed(lambda one=automaton: minimise(one), REPEATS)
            unit = seconds / (EVENTS * states * log(states)) * 1e9
            row = {"states": states, "least": least.n_states, "seconds": seconds, "unit_ns": unit}
            text = f"{kind:7}{states:10,} -> {least.n_states:9,}{seconds:9.4f} s{unit:7.2f} ns E S ln S"
            if theirs < PATIENCE and states <= 10_000:
                size, theirs = by_faudes(automaton)
                assert size == least.n_states
                row |= {"faudes_seconds": theirs, "ratio": theirs / seconds}
                text += f"   libFAUDES {theirs:8.3f} s, {theirs / seconds:6.0f} times as long"
            print(text)
            rows.append(row)
        record[kind] = rows
    return record

"""Decision processes written for a model checker and read back, in each format, and loaded by Storm.

The process has four actions a state with two outcomes each, at most, whose probabilities have all their
digits.  ``EXPORT_STATES`` asks for another size; text above 64 MiB is not read back.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import stormpy

from supremal import Alphabet, TabularMDP
from supremal.formats.processes import PROCESS_FORMATS, read_process, write_process

STATES = int(os.environ.get("EXPORT_STATES", "100_000"))
ACTIONS = ("a", "b", "c", "d")
LOADERS: dict[str, Callable[[Path], Any]] = {
    ".umb": stormpy.build_model_from_umb,
    ".drn": stormpy.build_model_from_drn,
}
"""Of PRISM's files Storm asks for other headers."""


def random_walk(states: int, seed: int) -> TabularMDP:
    """Return a process in which every action leads to one of two states."""
    rng = np.random.default_rng(seed)
    slots = states * len(ACTIONS)
    left = rng.random(slots)
    return TabularMDP(
        actions=ACTIONS,
        alphabet=Alphabet(ACTIONS),
        propositions=("lit",),
        words=tuple((e,) for e in range(len(ACTIONS))),
        row=np.arange(slots + 1) * 2,
        next_state=rng.integers(states, size=2 * slots, dtype=np.int32),
        prob=np.stack([left, 1 - left], axis=1).reshape(-1),
        reward=np.repeat(rng.integers(-9, 1, size=slots), 2).astype(np.float64),
        word=np.tile(np.repeat(np.arange(len(ACTIONS), dtype=np.int32), 2), states),
        terminal=rng.random(states) < 0.01,
        marked=rng.random(states) < 0.01,
        label=rng.integers(2, size=states),
        initial=np.eye(1, states)[0],
    )


def run() -> dict[str, Any]:
    mdp = random_walk(STATES, seed=0)
    rows = []
    for ending in PROCESS_FORMATS:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"walk{ending}")
            write_process(path, mdp)
            began = perf_counter()
            write_process(path, mdp, force=True)
            wrote = perf_counter()
            size = sum(file.stat().st_size for file in path.parent.iterdir())
            row: dict[str, Any] = {"format": ending, "states": STATES, "bytes": size}
            row["write_seconds"] = wrote - began
            row["states_per_second"] = STATES / row["write_seconds"]
            if size < 64 << 20 or ending == ".umb":
                began = perf_counter()
                assert read_process(path).n_states == STATES
                row["read_seconds"] = perf_counter() - began
            if ending in LOADERS:
                began = perf_counter()
                assert LOADERS[ending](path).nr_states == STATES
                row["storm_seconds"] = perf_counter() - began
        rows.append(row)
        print(
            f"{ending}: {size / 1e6:.1f} MB, written in {row['write_seconds']:.2f} s "
            f"({row['states_per_second']:,.0f} states/s), read in {row.get('read_seconds', np.nan):.2f} s, "
            f"by Storm in {row.get('storm_seconds', np.nan):.2f} s"
        )
    return {"rows": rows}

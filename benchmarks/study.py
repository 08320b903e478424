"""A study of 64 settings and five seeds: one at a time, on all cores, and on a Ray cluster of two nodes.

The cluster is of this machine, one CPU a node, once left alone and once with a node killed when half of the
rows are there.  All ways give the same rows.  *Writing* is what the file costs each time that rows come, by
how many are in it.  Needs ``supremal[rllib]``; run by its name only.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from benchmarks.learning import EXAMPLES
from supremal.studies.cluster import run_on_cluster
from supremal.studies.ranking import rank
from supremal.studies.reading import read_study
from supremal.studies.results import Results
from supremal.studies.running import run_study
from supremal.studies.study import Cell
from supremal.studies.trial import Row, Worlds, learn_cell

STUDY = EXAMPLES / "studies" / "frozen_lake.toml"
ROWS = (320, 10_000, 100_000)
NODE = {"num_cpus": 1, "object_store_memory": 10**8}
IMPORTS = ("pyarrow", "ray", "ray.tune", "ray.rllib.algorithms.ppo")


def run_all(way: Callable[[Results], bool], path: Path) -> tuple[float, Results]:
    """Return how long a study takes, and what comes out."""
    results = Results(path, read_study(STUDY))
    began = perf_counter()
    assert way(results)
    return perf_counter() - began, results


def on_two_nodes(results: Results, *, kill: bool = False) -> bool:
    """Run a study on a new cluster; perhaps kill a node in the middle."""
    from ray.cluster_utils import Cluster

    half, killed = len(results.missing) // 2, False

    def on_row(_: Row) -> None:
        nonlocal killed
        if kill and not killed and len(results.missing) <= half:
            cluster.remove_node(second, allow_graceful=False)
            killed = True

    cluster = Cluster(initialize_head=True, head_node_args={**NODE, "include_dashboard": False})
    try:
        second = cluster.add_node(**NODE)
        finished = run_on_cluster(results, cluster.address, on_row=on_row)
        assert len(cluster.list_all_nodes()) == 2 - kill
    finally:
        cluster.shutdown()
    return finished


def timeless(results: Results) -> dict[Cell, Row]:
    return {cell: replace(row, seconds=0.0) for cell, row in results.rows.items()}


def writing(folder: Path, rows: int) -> float:
    """Return how long it takes to write so many rows."""
    study = read_study(STUDY)
    count = len(study.settings)
    results = Results(folder / f"{rows}.parquet", replace(study, seeds=tuple(range(rows // count))))
    row = Row(0, 0, "enforceable", 0.5, 0.1, 1.0, 50.0, 0.9, 0.2, 0, 10_000, 0.1)
    results.add(replace(row, setting=number, seed=seed) for number, seed in results.missing)
    began = perf_counter()
    results.add([row])
    return perf_counter() - began


def importing(module: str) -> float:
    """Return how long a fresh interpreter takes to import a module, the best of three."""
    script = f"import time; t = time.perf_counter(); import {module}; print(time.perf_counter() - t)"
    command = (sys.executable, "-W", "ignore", "-c", script)
    return min(float(subprocess.check_output(command, stderr=subprocess.DEVNULL)) for _ in range(3))


def run() -> dict[str, Any]:
    """Print the table; return the record."""
    cores = os.cpu_count() or 1
    ways: dict[str, Callable[[Results], bool]] = {
        "one at a time": run_study,
        f"{cores} at a time": lambda results: run_study(results, jobs=cores),
        "on two nodes": on_two_nodes,
        "one of them killed": partial(on_two_nodes, kill=True),
    }
    os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")  # nothing beyond the loopback interface
    record: dict[str, Any] = {"cores": cores, "seconds": {}}
    with TemporaryDirectory() as folder:
        warm = read_study(STUDY)
        learn_cell(warm, Worlds(warm.models.__getitem__), (0, 0))  # compiles
        found = {name: run_all(way, Path(folder, f"{name}.parquet")) for name, way in ways.items()}
        rows = [timeless(results) for _, results in found.values()]
        assert all(other == rows[0] for other in rows[1:])
        assert all(row.violations == 0 for row in rows[0].values())
        record["cells"] = len(rows[0])
        for name, (seconds, _) in found.items():
            record["seconds"][name] = seconds
            print(f"{name:20}{seconds:8.1f} s for {record['cells']} cells")
        best = rank(found["one at a time"][1], 1)[0]
        record["best"] = {"setting": best.setting, "mean": best.mean, "low": best.low, "high": best.high}
        record["writing"] = {rows: writing(Path(folder), rows) for rows in ROWS}
        for rows, seconds in record["writing"].items():
            print(f"writing {rows:>7,} rows {seconds * 1e3:8.1f} ms")
    record["importing"] = {module: importing(module) for module in IMPORTS}
    for module, seconds in record["importing"].items():
        print(f"import {module:28}{seconds:6.2f} s")
    return record

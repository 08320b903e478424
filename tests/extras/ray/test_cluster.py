"""Studies on Ray clusters: complete and the same, also where a node or the driver is killed in the middle."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from supremal import SupremalError
from supremal.studies.cluster import ClusterError, run_on_cluster
from supremal.studies.reading import read_study
from supremal.studies.results import Results
from supremal.studies.running import run_study
from supremal.studies.study import Cell
from supremal.studies.trial import Row

ray = pytest.importorskip("ray")
pytestmark = pytest.mark.filterwarnings("default")  # Ray's own

EXAMPLES = Path(__file__).parents[3] / "examples"
GRID = f"""
task = "{EXAMPLES / "frozen_lake.toml"}"
seeds = 5
[grid]
learner.alpha = [0.1, 0.4]
learner.gamma = [0.95, 0.99]
learner.epsilon = [0.2, 1.0]
environment.options.is_slippery = [true, false]
learner.episodes = [1_000]
"""


def study_file(folder: Path, text: str) -> Path:
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def timeless(rows: dict[Cell, Row]) -> dict[Cell, Row]:
    return {cell: replace(row, seconds=0.0) for cell, row in rows.items()}


def alone(results: Results) -> dict[Cell, Row]:
    """Return the rows of the same study, run in this process."""
    there = Results(results.path.with_name("alone.parquet"), results.study)
    assert run_study(there)
    return timeless(there.rows)


def test_a_study_is_complete_and_the_same_though_a_node_is_killed(
    cluster: Any, node: Any, tmp_path: Path
) -> None:
    results = Results(tmp_path / "r.parquet", read_study(study_file(tmp_path, GRID)))
    nodes: list[int] = []

    def kill(_: Row) -> None:
        if len(results.rows) >= 20 and not nodes:
            nodes.append(len(cluster.list_all_nodes()))
            cluster.remove_node(node, allow_graceful=False)
            nodes.append(len(cluster.list_all_nodes()))

    assert run_on_cluster(results, cluster.address, on_row=kill)
    assert nodes == [2, 1]
    assert not results.missing
    rows = alone(results)
    assert len(rows) == 80
    assert timeless(results.rows) == rows
    assert timeless(Results(results.path, results.study).rows) == rows
    assert all(row.violations == 0 for row in rows.values())


def test_machines_that_are_lost_too_often_end_a_study_that_goes_on_later(
    cluster: Any, node: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = Results(tmp_path / "r.parquet", read_study(study_file(tmp_path, GRID)))
    killed: list[Row] = []

    def kill(row: Row) -> None:
        if not killed:
            cluster.remove_node(node, allow_graceful=False)
            killed.append(row)

    monkeypatch.setattr("supremal.studies._ray._RETRIES", 0)
    with pytest.raises(ClusterError, match=r"of 80 results are missing.*the same command goes on with them"):
        run_on_cluster(results, cluster.address, on_row=kill)
    again = Results(results.path, results.study)
    assert 0 < len(again.missing) < 80
    assert run_study(again)  # in one process, as well as anywhere
    assert timeless(again.rows) == alone(again)


def test_halving_leaves_rows_out_and_changes_none(cluster: Any, tmp_path: Path) -> None:
    study = read_study(study_file(tmp_path, GRID))
    halved = Results(tmp_path / "r.parquet", study)
    assert run_on_cluster(halved, cluster.address, halving=True)
    assert len(study.settings) <= len(halved.rows) < len(study.cells)
    rows = alone(halved)
    assert timeless(halved.rows).items() <= rows.items()
    assert run_study(halved)  # and what was left out can be run after all
    assert timeless(halved.rows) == rows


def test_what_is_wrong_on_a_worker_is_told(cluster: Any, tmp_path: Path) -> None:
    study = read_study(study_file(tmp_path, GRID + "check.max_states = [3]\n"))
    with pytest.raises(SupremalError, match="raise max_states or split it"):
        run_on_cluster(Results(tmp_path / "r.parquet", study), cluster.address)
    assert not ray.is_initialized()


def test_a_cluster_that_is_not_there(tmp_path: Path) -> None:
    study = read_study(study_file(tmp_path, GRID))
    for address in ("127.0.0.1:1", "nonsense"):
        with pytest.raises(ClusterError, match=f"no Ray cluster at '{address}'.*or use --ray local"):
            run_on_cluster(Results(tmp_path / "r.parquet", study), address)


def test_a_driver_that_is_ended_loses_nothing_finished(cluster: Any, tmp_path: Path) -> None:
    path, out = study_file(tmp_path, GRID.replace("seeds = 5", "seeds = 100")), tmp_path / "r.parquet"
    study = read_study(path)
    script = "import sys; from supremal.cli.study import study_command as s; s()"
    command = [sys.executable, "-c", script, str(path), "--out", str(out), "--ray", cluster.address]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        while not out.exists():
            assert process.poll() is None
            time.sleep(0.1)
        process.kill()
    assert process.returncode == -signal.SIGKILL
    results = Results(out, study)
    killed = dict(results.rows)
    assert 0 < len(killed) < len(study.cells)

    assert not run_on_cluster(results, cluster.address, on_row=lambda _: signal.raise_signal(signal.SIGINT))
    stopped = dict(results.rows)
    assert len(killed) < len(stopped) < len(study.cells)
    results = Results(out, read_study(study_file(tmp_path, GRID)))  # the first seeds are enough to compare
    assert results.rows == stopped
    assert run_study(results)
    assert alone(results).items() <= timeless(results.rows).items()

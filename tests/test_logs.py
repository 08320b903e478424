"""Logs: the rows that curves make, in CSV and in event files that TensorBoard reads."""

from __future__ import annotations

import csv
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from supremal import Alphabet, MDPError, MissingDependencyError, ModelError, from_outcomes, q_learning
from supremal.formats.logs import CsvLog, TensorBoardLog, log_live, log_result
from supremal.learning.settings import Settings

SETTINGS = Settings(epsilon=0.5, epsilon_decay=0.5, decay_every=2)


class Rows(list[tuple[int, dict[str, float]]]):
    """A log that keeps its rows."""

    def write(self, step: int, scalars: Mapping[str, float]) -> None:
        self.append((step, dict(scalars)))


@dataclass
class Curves:
    """Five episodes."""

    returns: np.ndarray
    lengths: np.ndarray
    completed: np.ndarray
    violations: np.ndarray
    seconds: float = 2.0

    def first(self, n: int) -> Curves:
        return Curves(self.returns[:n], self.lengths[:n], self.completed[:n], self.violations[:n])


FIVE = Curves(
    np.array([1.0, 3.0, -2.0, 0.0, 7.0]),
    np.array([4, 6, 10, 10, 20], np.int32),
    np.array([True, False, False, False, True]),
    np.array([0, 2, 0, 1, 0], np.int32),
)


def test_rows_of_intervals_and_the_rest() -> None:
    rows = Rows()
    log_result(rows, FIVE, 2, settings=SETTINGS)
    assert rows[0] == (
        10,
        {
            "rollout/ep_rew_mean": 2.0,
            "rollout/ep_len_mean": 5.0,
            "time/episodes": 2,
            "time/total_timesteps": 10,
            "time/fps": 25,
            "supremal/violations": 2,
            "supremal/completion": 0.5,
            "rollout/exploration_rate": 0.5,
        },
    )
    assert [step for step, _ in rows] == [10, 30, 50]
    assert [row["supremal/violations"] for _, row in rows] == [2, 1, 0]
    assert [row["rollout/exploration_rate"] for _, row in rows] == [0.5, 0.25, 0.125]
    assert rows[2][1]["rollout/ep_rew_mean"] == 7.0


@pytest.mark.parametrize("interval", [1, 2, 3, 5, 9])
def test_live_rows_are_those_of_the_result(interval: int) -> None:
    whole, live = Rows(), Rows()
    log_result(whole, FIVE, interval)
    report = log_live(live, interval)
    for n in (2, 2, 5):
        report(FIVE.first(n))
    full = len(FIVE.returns) // interval
    kept = [(step, {k: v for k, v in row.items() if k != "time/fps"}) for step, row in whole[:full]]
    assert [(step, {k: v for k, v in row.items() if k != "time/fps"}) for step, row in live] == kept
    assert "rollout/exploration_rate" not in whole[0][1]


def test_a_result_of_q_learning_can_be_logged() -> None:
    go = from_outcomes([(0, "go", 1, 1.0, ("go",), 5.0)], alphabet=Alphabet(("go",)), terminal=[1])
    rows = Rows()
    log_result(rows, q_learning(go, settings=Settings(episodes=30)), 10)
    assert [(step, row["rollout/ep_rew_mean"]) for step, row in rows] == [(10, 5.0), (20, 5.0), (30, 5.0)]


def test_an_interval_has_to_be_a_number_of_episodes() -> None:
    with pytest.raises(MDPError, match="interval is 0; a whole number of episodes from 1 is needed"):
        log_result(Rows(), FIVE, 0)


def test_csv_reads_back_while_it_grows(tmp_path: Path) -> None:
    path = tmp_path / "progress.csv"
    rows = Rows()
    log_result(rows, FIVE, 2)
    with CsvLog(path) as log:
        log_result(log, FIVE, 2)
        with path.open(encoding="utf-8", newline="") as file:
            read = list(csv.DictReader(file))
    assert [{name: float(value) for name, value in row.items()} for row in read] == [
        {"step": step, **row} for step, row in rows
    ]


def test_csv_columns_are_settled_by_the_first_row(tmp_path: Path) -> None:
    with CsvLog(tmp_path / "a.csv") as log:
        log.write(1, {"x": 1.0, "y": 2.0})
        with pytest.raises(ModelError, match=r"a\.csv: 'z' is no column; the first row had x, y"):
            log.write(2, {"x": 1.0, "y": 2.0, "z": 3.0})
        with pytest.raises(ModelError, match="'y' is missing; the first row had x, y"):
            log.write(2, {"x": 1.0})


def test_event_files_are_read_by_tensorboard(tmp_path: Path) -> None:
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    rows = Rows()
    log_result(rows, FIVE, 2, settings=SETTINGS)
    with TensorBoardLog(tmp_path / "runs" / "one") as log:
        log_result(log, FIVE, 2, settings=SETTINGS)
    read = accumulator.EventAccumulator(str(tmp_path / "runs" / "one"))
    read.Reload()
    assert sorted(read.Tags()["scalars"]) == sorted(rows[0][1])
    for name in rows[0][1]:
        got = [(event.step, event.value) for event in read.Scalars(name)]
        assert got == [(step, pytest.approx(row[name])) for step, row in rows]


def test_without_tensorboard_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "tensorboard"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "supremal.formats._tensorboard", raising=False)
    monkeypatch.setitem(sys.modules, "tensorboard", None)
    monkeypatch.delattr("supremal.formats._tensorboard", raising=False)
    with pytest.raises(MissingDependencyError, match=r"pip install 'supremal\[tensorboard\]'"):
        TensorBoardLog(tmp_path)

"""The folder of a run: written beside its place and moved there whole, so that nobody finds half of one."""

from __future__ import annotations

import csv
import json
import secrets
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from supremal.errors import SupremalError
from supremal.learning.q_learning import QResult
from supremal.task.experiment import Experiment
from supremal.task.summary import interval_means


class OutputError(SupremalError):
    """An output folder that exists already or cannot be written."""


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Give a folder to write to, which becomes ``path`` when all went well and is removed when not.

    Raises
    ------
    OutputError
        If ``path`` exists, or nothing can be written there.
    """
    if path.exists():
        message = f"{path} exists already, and a run is never overwritten; choose another folder with --out"
        raise OutputError(message)
    work = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        work.mkdir(parents=True)
    except OSError as error:
        message = f"cannot write to {path.parent}: {error.strerror}; choose another folder with --out"
        raise OutputError(message) from None
    try:
        yield work
        work.rename(path)
    except OSError as error:
        message = f"cannot write {path}: {error.strerror}"
        raise OutputError(message) from None
    finally:
        shutil.rmtree(work, ignore_errors=True)


def write_json(path: Path, document: Mapping[str, Any]) -> None:
    """Write ``document`` as JSON that any reader takes: no NaN, no infinity."""
    path.write_text(
        json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8"
    )


def write_learned(path: Path, results: Sequence[QResult]) -> None:
    """Write what each seed learned: ``seeds [N]``, ``policy [N, S]`` and ``q [N, S, A]`` over the product."""
    np.savez_compressed(
        path,
        seeds=np.array([result.seed for result in results]),
        policy=np.stack([result.policy for result in results]),
        q=np.stack([result.q for result in results]),
    )


def write_curves(path: Path, experiment: Experiment) -> None:
    """Write the learning curves as CSV, one line for each learner, seed and interval of episodes."""
    runs = [("supervised", result) for result in experiment.results]
    if experiment.baseline is not None:
        runs.append(("baseline", experiment.baseline))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(
            ["learner", "seed", "episodes", "score", "completion", "steps", "violations", "epsilon"]
        )
        for learner, result in runs:
            writer.writerows([learner, result.seed, *row] for row in _rows(result, experiment))


def _rows(result: QResult, experiment: Experiment) -> Iterator[list[float]]:
    columns = (result.returns, result.completed, result.lengths, result.violations)
    interval = experiment.task.interval
    for i, means in enumerate(zip(*(interval_means(column, interval) for column in columns), strict=True)):
        first, end = i * interval, min((i + 1) * interval, len(result.returns))
        yield [end, *map(float, means), experiment.task.settings.epsilon_at(first)]

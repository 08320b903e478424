"""The folder of a run: written beside its place and moved there whole, so that nobody finds half of one.

Beside its place is ``NAME.partial``.  It holds what the learners keep on the way, so that a run that was
killed can go on; where nothing was kept yet, it goes when the run fails.
"""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np

from supremal import __version__
from supremal.errors import SupremalError
from supremal.learning.q_learning import QResult
from supremal.task.experiment import Experiment
from supremal.task.keeper import CHECKPOINTS
from supremal.task.summary import interval_means
from supremal.task.task import Task


class OutputError(SupremalError):
    """An output folder that exists already or cannot be written."""


_PARTIAL: Final = ".partial"


def final_place(path: Path) -> Path:
    """Return the folder that a run ends in, given that or the one that it is written in.

    Examples
    --------
    >>> final_place(Path("runs/taxi.partial")).name, final_place(Path("runs/taxi")).name
    ('taxi', 'taxi')
    """
    return path.with_name(path.name.removesuffix(_PARTIAL))


@contextmanager
def run_folder(path: Path, *, resume: bool = False) -> Iterator[Path]:
    """Give a folder to write to, which becomes ``path`` when all went well.

    When not, it is removed, unless there is something in it to go on from.

    Parameters
    ----------
    path
        The folder of the run.
    resume
        Whether to go on with one that was stopped, or killed.

    Raises
    ------
    OutputError
        If ``path`` exists, nothing can be written there, or there is nothing to go on with.
    """
    work = path.with_name(path.name + _PARTIAL)
    try:
        if resume:
            _take_up(path, work)
        else:
            _begin(path, work)
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
        if not (work / CHECKPOINTS).exists():
            shutil.rmtree(work, ignore_errors=True)


def _begin(path: Path, work: Path) -> None:
    if path.exists():
        message = f"{path} exists already, and a run is never overwritten; choose another folder with --out"
        raise OutputError(message)
    if work.exists():
        message = f"{work} is a run that was killed; go on with it by --resume {path}, or remove it"
        raise OutputError(message)
    work.mkdir(parents=True)


def _take_up(path: Path, work: Path) -> None:
    if work.exists():
        return
    if not (path / CHECKPOINTS).is_dir():
        message = f"{path} is no run that was stopped: there are no {CHECKPOINTS} in it; leave --resume out"
        raise OutputError(message)
    path.rename(work)


CONFIG: Final = "config.json"
"""What a run was asked for, written before anything is learned."""


def write_config(folder: Path, task: Task) -> None:
    """Write down what is asked for; a run that goes on reads it again."""
    config = {
        "supremal": __version__,
        "task": task.name,
        "title": task.title,
        "source": task.source,
        "seed": task.seed,
        "seeds": task.seeds,
        "interval": task.interval,
        "settings": asdict(task.settings),
    }
    write_json(folder / CONFIG, config)


def read_config(path: Path) -> dict[str, Any]:
    """Return what a run was asked for that is to end in ``path`` and has not yet, or was stopped."""
    for folder in (path.with_name(path.name + _PARTIAL), path):
        with suppress(OSError, ValueError):
            found = json.loads((folder / CONFIG).read_text(encoding="utf-8"))
            if isinstance(found, dict):
                return found
    return {}


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

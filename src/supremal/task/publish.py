"""Writing a run down: configuration, numbers, curves, the paper's two figures, and the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from supremal.formats.logs import CsvLog, TensorBoardLog, log_result
from supremal.show.figures import save_curves
from supremal.task.copy import copy_task
from supremal.task.experiment import Experiment
from supremal.task.folder import write_curves, write_json, write_learned
from supremal.task.page import FIGURES, axes_of, page_of, series_of

PAGE: Final = "report.html"
"""What a run calls its report."""


def publish(folder: Path, experiment: Experiment, result: Mapping[str, Any]) -> None:
    """Write all files of a run to ``folder``.

    Raises
    ------
    MissingDependencyError
        If matplotlib is not installed.
    """
    task = experiment.task
    write_json(folder / "result.json", result)
    write_learned(folder / "learned.npz", experiment.results)
    copy_task(task.path, folder)
    write_curves(folder / "curves.csv", experiment)
    for name in FIGURES:
        save_curves(folder / name, series_of(task, result, name), **axes_of(name))
    page = page_of(task, experiment.findings, result, experiment.results[0].policy, seed=task.seed)
    (folder / PAGE).write_text(page, encoding="utf-8")


def write_logs(folder: Path, experiment: Experiment, kinds: Sequence[str]) -> None:
    """Write the curves in the names that the ecosystem's tools read: "csv", "tensorboard".

    Raises
    ------
    MissingDependencyError
        If tensorboard is asked for and not installed.
    """
    interval, settings = experiment.task.interval, experiment.task.settings
    runs = [(f"supervised-{result.seed}", result) for result in experiment.results]
    if experiment.baseline is not None:
        runs.append((f"baseline-{experiment.baseline.seed}", experiment.baseline))
    for kind in kinds:
        for name, result in runs:
            place = folder / "logs" / name
            place.mkdir(parents=True, exist_ok=True)
            with CsvLog(place / "progress.csv") if kind == "csv" else TensorBoardLog(place) as log:
                log_result(log, result, interval, settings=settings)

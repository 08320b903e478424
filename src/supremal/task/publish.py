"""Writing a run down: configuration, numbers, curves, the paper's two figures, and the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from supremal._arrays import Floats
from supremal.formats.logs import CsvLog, TensorBoardLog, log_result
from supremal.learning.q_learning import QResult
from supremal.show.diagram import automaton_svg, reward_machine_svg
from supremal.show.figures import Series, curves_svg, save_curves
from supremal.show.report import Diagram, report_html
from supremal.task.copy import copy_task
from supremal.task.experiment import Experiment
from supremal.task.folder import write_curves, write_json, write_learned
from supremal.task.spread import spread
from supremal.task.summary import interval_means, regrets
from supremal.task.task import Task

Curve = Literal["score", "completion", "regret"]

_FIGURES: Final[dict[Curve, tuple[str, tuple[float, float] | None]]] = {
    "score": ("Average score", None),
    "completion": ("Average task completion %", (0.0, 100.0)),
    "regret": ("Regret against the exact optimum", None),
}

_SCALE: Final[dict[Curve, float]] = {"score": 1.0, "completion": 100.0, "regret": 1.0}
_DRAWN: Final = 24
"""The most states of an automaton that is drawn."""


def publish(folder: Path, experiment: Experiment, result: Mapping[str, Any]) -> None:
    """Write all files of a run to ``folder``.

    Raises
    ------
    MissingDependencyError
        If matplotlib is not installed.
    """
    write_json(folder / "result.json", result)
    write_learned(folder / "learned.npz", experiment.results)
    copy_task(experiment.task.path, folder)
    write_curves(folder / "curves.csv", experiment)
    charts = []
    for name, (ylabel, ylim) in _FIGURES.items():
        series = _series(experiment, name)
        axes: dict[str, Any] = {"xlabel": "Episodes (×10³)", "ylabel": ylabel, "ylim": ylim}
        save_curves(folder / name, series, **axes)
        charts.append(curves_svg(series, **axes))
    page = report_html(result, diagrams=_diagrams(experiment.task), charts=charts)
    (folder / "report.html").write_text(page, encoding="utf-8")


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


def _series(experiment: Experiment, name: Curve) -> list[Series]:
    """Return the curves of one figure: the seeds, the baseline, and the points that the source reports."""
    curves = [_curve(experiment, result, name) for result in experiment.results]
    label, band, middle = "under the supervisor", None, curves[0]
    if len(curves) > 1:
        found = spread(curves)
        label += f": interquartile mean of {len(curves)} seeds"
        middle, band = np.array(found["mean"]), list(zip(found["low"], found["high"], strict=True))
    ends = _ends(experiment, experiment.results, len(middle))
    series = [Series(label, ends, middle.tolist(), "main", band)]
    if experiment.baseline is not None and name != "regret":
        curve = _curve(experiment, experiment.baseline, name)
        ends = _ends(experiment, [experiment.baseline], len(curve))
        series.append(Series("without the rules", ends, curve.tolist(), "second"))
    known = [row for row in experiment.task.reported if row.curve == name]
    if known:
        x = [row.episodes / 1000 for row in known]
        y = [float(row.said) * _SCALE[name] for row in known]
        series.append(Series("as published", x, y, "reference"))
    return series


def _curve(experiment: Experiment, result: QResult, name: Curve) -> Floats:
    if name == "regret":
        return regrets(experiment, result)
    values = result.returns if name == "score" else result.completed
    return _SCALE[name] * interval_means(values, experiment.task.interval)


def _ends(experiment: Experiment, results: Sequence[QResult], points: int) -> list[float]:
    """Return the ends of the intervals that all ``results`` have reached, in thousands of episodes."""
    interval, episodes = experiment.task.interval, min(len(result.returns) for result in results)
    return [min((i + 1) * interval, episodes) / 1000 for i in range(points)]


def _diagrams(task: Task) -> list[Diagram]:
    pictures = []
    for rule in task.rules:
        drawn = rule.drawn or rule.automaton
        if drawn.n_states <= _DRAWN:
            title = drawn.name or rule.name
            pictures.append(Diagram(title, automaton_svg(drawn, title=title), rule.sentence))
    machine = task.reward_machine
    if machine is not None and len(machine.states) <= _DRAWN:
        caption = "Each edge: what has to be true in the state reached, and the reward of the step."
        svg = reward_machine_svg(machine, title="Reward machine")
        pictures.append(Diagram("Reward machine", svg, caption, wide=True))
    return pictures

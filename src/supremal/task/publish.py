"""Writing a run down: configuration, numbers, curves, the paper's two figures, and the report."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Literal

from supremal.learning.q_learning import QResult
from supremal.show.diagram import automaton_svg, reward_machine_svg
from supremal.show.figures import Series, curves_svg, save_curves
from supremal.show.report import Diagram, report_html
from supremal.task.copy import copy_task
from supremal.task.experiment import Experiment
from supremal.task.folder import write_curves, write_json, write_learned
from supremal.task.summary import interval_means
from supremal.task.task import Task

Curve = Literal["score", "completion"]

_FIGURES: Final[dict[Curve, tuple[str, tuple[float, float] | None]]] = {
    "score": ("Average score", None),
    "completion": ("Average task completion %", (0.0, 100.0)),
}

_DRAWN: Final = 24
"""The most states of an automaton that is drawn."""


def publish(folder: Path, experiment: Experiment, result: Mapping[str, Any]) -> None:
    """Write all files of a run to ``folder``.

    Raises
    ------
    MissingDependencyError
        If matplotlib is not installed.
    """
    config = {
        key: result[key] for key in ("supremal", "task", "title", "source", "seed", "seeds", "settings")
    }
    write_json(folder / "config.json", config)
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


def _series(experiment: Experiment, name: Curve) -> list[Series]:
    """Return the curves of one figure: every seed, the baseline, and the points that the source reports."""
    interval = experiment.task.interval
    first, *others = experiment.results
    series = [Series("", *_points(result, name, interval), "main") for result in others]
    series.append(Series("under the supervisor", *_points(first, name, interval), "main"))
    if experiment.baseline is not None:
        points = _points(experiment.baseline, name, interval)
        series.append(Series("without the rules", *points, "second"))
    known = [row for row in experiment.task.reported if row.curve == name]
    if known:
        x = [row.episodes / 1000 for row in known]
        y = [float(row.said) * (100 if name == "completion" else 1) for row in known]
        series.append(Series("as published", x, y, "reference"))
    return series


def _points(result: QResult, name: Curve, interval: int) -> tuple[list[float], list[float]]:
    values = result.returns if name == "score" else 100.0 * result.completed
    means = interval_means(values, interval).tolist()
    x = [min((i + 1) * interval, len(values)) / 1000 for i in range(len(means))]
    return x, means


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

"""Writing a run down: configuration, numbers, curves, the paper's two figures, and the report."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from supremal.learning.q_learning import QResult
from supremal.show.diagram import automaton_svg, reward_machine_svg
from supremal.show.figures import Series, curves_svg, save_curves
from supremal.show.report import Diagram, report_html
from supremal.task.comparison import PUBLISHED
from supremal.task.experiment import Experiment
from supremal.task.folder import write_curves, write_json
from supremal.task.summary import INTERVAL, interval_means
from supremal.task.task import Task

_FIGURES: Final = {
    "score": ("Average score", (-1000.0, -200.0)),
    "completion": ("Average task completion %", (0.0, 100.0)),
}


def publish(folder: Path, experiment: Experiment, result: Mapping[str, Any]) -> None:
    """Write all files of a run to ``folder``.

    Raises
    ------
    MissingDependencyError
        If matplotlib is not installed.
    """
    config = {key: result[key] for key in ("supremal", "task", "preset", "seed", "seeds", "settings")}
    write_json(folder / "config.json", config)
    write_json(folder / "result.json", result)
    write_curves(folder / "curves.csv", experiment)
    charts = []
    for name, (ylabel, ylim) in _FIGURES.items():
        series = _series(experiment, name)
        axes: dict[str, Any] = {"xlabel": "Episodes (×10³)", "ylabel": ylabel, "ylim": ylim}
        save_curves(folder / name, series, **axes)
        charts.append(curves_svg(series, **axes))
    page = report_html(result, diagrams=_diagrams(experiment.task), charts=charts)
    (folder / "report.html").write_text(page, encoding="utf-8")


def _series(experiment: Experiment, name: str) -> list[Series]:
    """Return the curves of one figure: every seed, the baseline, and the points of the published run."""
    first, *others = experiment.results
    series = [Series("", *_points(result, name), "main") for result in others]
    series.append(Series("under the supervisor", *_points(first, name), "main"))
    if experiment.baseline is not None:
        series.append(Series("without the rules", *_points(experiment.baseline, name), "second"))
    if experiment.task.preset == "published":
        x = [point.episodes / 1000 for point in PUBLISHED]
        y = [point.score if name == "score" else 100 * point.completion for point in PUBLISHED]
        series.append(Series("the published run", x, y, "reference"))
    return series


def _points(result: QResult, name: str) -> tuple[list[float], list[float]]:
    values = result.returns if name == "score" else 100.0 * result.completed
    means = interval_means(values).tolist()
    x = [min((i + 1) * INTERVAL, len(values)) / 1000 for i in range(len(means))]
    return x, means


def _diagrams(task: Task) -> list[Diagram]:
    pictures = [
        Diagram(rule.completed.name, automaton_svg(rule.completed, title=rule.completed.name), rule.sentence)
        for rule in task.rules
    ]
    machine = task.reward_machine
    caption = "Each edge: what has to be true in the state reached, and the reward of the step."
    svg = reward_machine_svg(machine, title="Reward machine")
    return [*pictures, Diagram("Reward machine", svg, caption, wide=True)]

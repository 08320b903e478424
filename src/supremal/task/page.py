"""The report of a task: its page, put together from a result, what the check found and what was learned.

All numbers are those of the result, so that the page of a run is the same whether `supremal run` writes it
or `supremal report` does later.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final, Literal

from supremal import __version__
from supremal._arrays import NONE, Ints
from supremal.automata.automaton import Automaton
from supremal.automata.reduce import complement
from supremal.automata.words import Word, shortest_words
from supremal.rules.about import essence
from supremal.show.diagram import automaton_svg, reward_machine_svg
from supremal.show.disabled import DisabledTable, disabled_table
from supremal.show.figures import Series, curves_svg
from supremal.show.report import Diagram, RuleView, report_html
from supremal.synthesis.explain import disabled_in
from supremal.task.findings import Findings
from supremal.task.playback import EPISODES, playback_of
from supremal.task.summary import check_summary
from supremal.task.task import Task

Curve = Literal["score", "completion", "regret"]

FIGURES: Final[dict[Curve, tuple[str, tuple[float, float] | None]]] = {
    "score": ("Average score", None),
    "completion": ("Average task completion %", (0.0, 100.0)),
    "regret": ("Regret against the exact optimum", None),
}
"""The curves: what stands beside each, and its limits."""

_SCALE: Final[dict[Curve, float]] = {"score": 1.0, "completion": 100.0, "regret": 1.0}
_DRAWN: Final = 24
"""The most states of an automaton that is drawn."""
_EXAMPLES: Final = 3
"""The most words of each kind that are shown of a rule."""


def page_of(
    task: Task,
    findings: Findings,
    result: Mapping[str, Any],
    policy: Ints | None = None,
    *,
    seed: int = 0,
    episodes: int = EPISODES,
) -> str:
    """Return the report of a task as the text of one HTML page.

    Parameters
    ----------
    task
        What there is to do.
    findings
        What `study` found of it.
    result
        What ``result.json`` holds of a run, or `checked` of a task that nothing was learned of.
    policy
        ``int [S]``: what was learned; None: nothing was.
    seed, episodes
        The seed of the first episode that is played, and how many are.

    Raises
    ------
    MDPError
        If the policy is not one of this task.
    """
    return report_html(
        result,
        rules=rule_views(task),
        diagrams=_diagrams(task),
        charts=[curves_svg(series_of(task, result, name), **axes_of(name)) for name in _curves(result)],
        disabled=_disabled(task, findings),
        playback=playback_of(task, findings, policy, seed=seed, episodes=episodes),
        free=task.alphabet.uncontrollable,
    )


def checked(task: Task, findings: Findings) -> dict[str, Any]:
    """Return what a result says of a task that nothing was learned of."""
    return {
        "supremal": __version__,
        "task": task.name,
        "title": task.title,
        "source": task.source,
        "check": check_summary(findings, task),
    }


def rule_views(task: Task) -> list[RuleView]:
    """Return what a page shows of each rule beside what a result says of it."""
    views = []
    for rule in task.rules:
        drawn = rule.drawn or rule.automaton
        accepted, rejected = _examples(rule.automaton)
        views.append(RuleView(rule.name, _picture(drawn, rule.name), accepted, rejected))
    return views


def _examples(rule: Automaton) -> tuple[tuple[Word, ...], tuple[Word, ...]]:
    """Return words that ``rule`` accepts, and words that it rejects and no beginning of.

    They are of the events that matter to it; where these make too few that it accepts, of others too.
    """
    essential = essence(rule)
    accepted = (*shortest_words(essential, _EXAMPLES), *shortest_words(rule, _EXAMPLES))
    wrong = complement(essential)
    delta = wrong.delta.copy()
    delta[wrong.marked] = NONE  # a word ends where it is rejected first
    rejected = shortest_words(replace(wrong, delta=delta), _EXAMPLES)
    return tuple(dict.fromkeys(accepted))[:_EXAMPLES], tuple(rejected)


def series_of(task: Task, result: Mapping[str, Any], name: Curve) -> list[Series]:
    """Return the curves of one figure: the seeds, the baseline, and the points that the source reports."""
    training, baseline = result["training"], result["baseline"]
    label, band, middle = "under the supervisor", None, training[name]
    if result["over_seeds"]:
        found = result["over_seeds"][name]
        label += f": interquartile mean of {result['seeds']} seeds"
        middle = found["mean"]
        band = list(zip(_scaled(name, found["low"]), _scaled(name, found["high"]), strict=True))
    series = [Series(label, _ends(training, len(middle)), _scaled(name, middle), "main", band)]
    if baseline is not None and name != "regret":
        ends = _ends(baseline, len(baseline[name]))
        series.append(Series("without the rules", ends, _scaled(name, baseline[name]), "second"))
    known = [row for row in task.reported if row.curve == name]
    if known:
        x = [row.episodes / 1000 for row in known]
        y = _scaled(name, [float(row.said) for row in known])
        series.append(Series("as published", x, y, "reference"))
    return series


def axes_of(name: Curve) -> dict[str, Any]:
    """Return what stands beside the axes of a figure, and its limits."""
    ylabel, ylim = FIGURES[name]
    return {"xlabel": "Episodes (×10³)", "ylabel": ylabel, "ylim": ylim}


def _curves(result: Mapping[str, Any]) -> list[Curve]:
    """Return the curves that a result has."""
    training = result.get("training")
    return [name for name in FIGURES if training and training.get(name)]


def _scaled(name: Curve, values: list[float]) -> list[float]:
    return [_SCALE[name] * value for value in values]


def _ends(run: Mapping[str, Any], points: int) -> list[float]:
    """Return the ends of the intervals that a run has reached, in thousands of episodes."""
    return [min((k + 1) * run["interval"], run["episodes"]) / 1000 for k in range(points)]


def _picture(automaton: Automaton, title: str) -> str:
    return automaton_svg(automaton, title=title) if 0 < automaton.n_states <= _DRAWN else ""


def _diagrams(task: Task) -> list[Diagram]:
    machine = task.reward_machine
    if machine is None or len(machine.states) > _DRAWN:
        return []
    caption = "Each edge: what has to be true in the state reached, and the reward of the step."
    return [Diagram("Reward machine", reward_machine_svg(machine, title="Reward machine"), caption)]


def _disabled(task: Task, findings: Findings) -> DisabledTable | None:
    """Return what the supervisor disables; None where there is none."""
    if findings.supervisor.is_empty:
        return None
    disabled = disabled_in(findings.causes, findings.supervisor, findings.state)
    return disabled_table(disabled, task.alphabet.names)

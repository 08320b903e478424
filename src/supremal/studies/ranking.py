"""Which settings of a study are best: by the interquartile mean over seeds, with its bootstrap interval.

A setting is ranked where all its seeds have been run.  One with a seed whose number is not finite, or whose
rules cannot be kept, comes last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from supremal.learning.statistics import bootstrap_interval, interquartile_mean
from supremal.studies.results import Results
from supremal.studies.study import LOWER_IS_BETTER, Metric
from supremal.studies.trial import Row


@dataclass(frozen=True, slots=True)
class Place:
    """A setting, and its metric over seeds: the interquartile mean, and the ends of its interval.

    All three are None where the metric of a seed is not finite or not known.
    """

    setting: int
    mean: float | None
    low: float | None
    high: float | None


def rank(results: Results, count: int | None = None) -> list[Place]:
    """Return the best settings, the best first; of equal ones the first in the study.

    Parameters
    ----------
    results
        Rows; a setting without a row for each seed of the study is left out.
    count
        How many; None: all.  Only of these the interval is computed.
    """
    study, found = results.study, []
    for number in range(len(study.settings)):
        rows = [results.rows[number, seed] for seed in study.seeds if (number, seed) in results.rows]
        if len(rows) == len(study.seeds):
            found.append((mean_score(study.metric, rows), number, rows))
    best = sorted(found, key=lambda one: one[:2])[:count]
    return [_place(number, _scores(study.metric, rows)) for _, number, rows in best]


def mean_score(metric: Metric, rows: Sequence[Row]) -> float:
    """Return the interquartile mean of a metric over ``rows`` as a number of which less is better."""
    scores = _scores(metric, rows)
    return (1 if LOWER_IS_BETTER[metric] else -1) * interquartile_mean(scores) if scores else inf


def _scores(metric: Metric, rows: Sequence[Row]) -> list[float]:
    """Return the metric of each row; nothing where one has none."""
    scores: list[float | None] = [getattr(row, metric) for row in rows]
    known = [score for score in scores if score is not None]
    return known if len(known) == len(scores) else []


def _place(number: int, scores: Sequence[float]) -> Place:
    if not scores:
        return Place(number, None, None, None)
    return Place(number, interquartile_mean(scores), *bootstrap_interval(scores))

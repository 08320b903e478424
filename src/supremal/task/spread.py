"""What several seeds say together: interquartile means, and how far they may be off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, TypedDict

import numpy as np

from supremal._arrays import Floats
from supremal.learning.statistics import bootstrap_interval, interquartile_mean

CONFIDENCE: Final = 0.95
_RESAMPLES: Final = 500


class Spread(TypedDict):
    """An interquartile mean over seeds for each point, and the ends of its confidence interval."""

    mean: list[float]
    low: list[float]
    high: list[float]


def spread(curves: Sequence[Floats]) -> Spread:
    """Return the spread of curves ``[N]``, one a seed; the bootstrap draws from seed 0.

    Points that not all seeds have reached are left out.

    Examples
    --------
    >>> spread([np.array([1.0, 5.0]), np.array([3.0, 5.0])])["mean"]
    [2.0, 5.0]
    """
    points = min((len(curve) for curve in curves), default=0)
    columns = np.array([curve[:points] for curve in curves]).T
    bounds = [bootstrap_interval(column, confidence=CONFIDENCE, resamples=_RESAMPLES) for column in columns]
    return {
        "mean": [interquartile_mean(column) for column in columns],
        "low": [low for low, _ in bounds],
        "high": [high for _, high in bounds],
    }

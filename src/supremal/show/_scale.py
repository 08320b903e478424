"""Round numbers: where an axis starts and ends, where its ticks stand, and how a value is written."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import floor, log10
from typing import Final

_DIGITS: Final = 12


def limits(values: Sequence[float], given: tuple[float, float] | None = None) -> tuple[float, float]:
    """Return where an axis starts and ends: as ``given``, or at round numbers around ``values``.

    Examples
    --------
    >>> limits([3.0, 487.0])
    (0.0, 500.0)
    """
    if given is not None:
        return float(given[0]), float(given[1])
    low, high = (min(values), max(values)) if values else (0.0, 1.0)
    if low == high:
        low, high = low - 0.5, high + 0.5
    step = _step(high - low)
    return floor(low / step + 1e-9) * step, -floor(-high / step + 1e-9) * step


def ticks(low: float, high: float) -> list[float]:
    """Return about five round numbers from ``low`` to ``high``.

    Examples
    --------
    >>> ticks(-1000, -200)
    [-1000.0, -800.0, -600.0, -400.0, -200.0]
    """
    step = _step(high - low)
    first = -floor(-low / step + 1e-9)
    found = [round((first + k) * step, 12) for k in range(12)]
    return [tick + 0.0 for tick in found if tick <= high + 1e-9 * step]


def tick_labels(marks: Sequence[float]) -> list[str]:
    """Return what stands at ticks, with as many digits as it takes for each to say its own value.

    Examples
    --------
    >>> tick_labels([10_000.0, 10_002.5, 10_005.0])
    ['10,000', '10,002.5', '10,005']
    >>> tick_labels([-0.5, 0.0, 0.5])
    ['\u22120.5', '0', '0.5']
    """
    step = min((abs(b - a) for a, b in pairwise(marks)), default=0.0)
    digits = next(
        (d for d in range(_DIGITS) if all(abs(round(x, d) - x) <= 1e-6 * step for x in marks)), _DIGITS
    )
    said = [f"{x:,.{digits}f}" for x in marks]
    return [(text.rstrip("0").rstrip(".") if digits else text).replace("-", "\u2212") for text in said]


def _step(span: float) -> float:
    """Return the round step that divides ``span`` into four to seven parts."""
    raw = abs(span) / 4 or 1.0
    power = 10.0 ** floor(log10(raw))
    return power * max(size for size in (1.0, 2.0, 2.5, 5.0) if size * power <= raw * (1 + 1e-9))


def number(value: float) -> str:
    """Return ``value`` as people write it: a true minus, commas, no more digits than it needs."""
    form = ",.4g" if abs(value) < 1000 else ",.1f" if abs(value) < 10_000 else ",.0f"
    text = f"{value:{form}}"
    return text.removesuffix(".0").replace("-", "\u2212")

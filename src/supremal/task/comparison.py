"""What the source of a task reports, beside what came out here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from supremal.task.task import Reported

_MISSING: Final = "–"


def comparison(result: Mapping[str, Any], reported: Sequence[Reported]) -> list[dict[str, str]]:
    """Return the rows "what / reported / here" for a summary; "–" stands for what a run did not reach."""
    return [
        {
            "what": row.what,
            "reported": _written(row, row.said) if not isinstance(row.said, str) else row.said,
            "here": _written(row, _point(result, row) if row.curve else _found(result, row)),
        }
        for row in reported
    ]


def _found(result: Mapping[str, Any], row: Reported) -> Any:  # noqa: ANN401 - a summary holds anything
    value: Any = result
    for part in row.key.split("."):
        value = value[part] if value is not None else None
    return value


def _point(result: Mapping[str, Any], row: Reported) -> float | None:
    """Return the average over the interval of episodes that ends with the row's, None if not reached."""
    training = result["training"]
    k = row.episodes // training["interval"] - 1
    reached = 0 <= k < len(training[row.curve]) and training["episodes"] >= row.episodes
    return float(training[row.curve][k]) if reached else None


def _written(row: Reported, value: Any) -> str:  # noqa: ANN401 - a summary holds anything
    if value is None:
        return _MISSING
    if row.style == "percent":
        return f"{value:.2%}"
    if row.style == "answer":
        return "yes" if value in (True, "enforceable") else "no"
    if row.style == "count":
        return f"{value:,.0f}"
    return f"{value:.4g}" if abs(value) < 1 else f"{value:,.1f}"

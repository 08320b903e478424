"""The benchmark of planning with a million states; MDPSolver, which takes minutes for each, is left out."""

from __future__ import annotations

from typing import Any

from benchmarks import planning


def run() -> dict[str, Any]:
    """Print the times and their ratios; return the record."""
    return planning.run((1_000_000,), without="MDPSolver")

"""How long ``import supremal`` takes, beside importing numpy alone and numba alone, in fresh processes."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

REPEATS = 7
TIMED = "from time import perf_counter as t; b = t(); import {}; print(t() - b)"


def seconds(module: str) -> float:
    """Return the best time of importing ``module`` in a new interpreter."""
    command = [sys.executable, "-c", TIMED.format(module)]
    return min(float(subprocess.check_output(command, text=True)) for _ in range(REPEATS))


def run() -> dict[str, Any]:
    """Print the times; return the record."""
    record = {module: seconds(module) for module in ("numpy", "numba", "supremal")}
    for module, best in record.items():
        print(f"import {module:10} {best:6.3f} s")
    return {"seconds": record}

"""How time and memory of exploration and synthesis grow, from ten thousand to over ten million transitions.

Each size runs in a process of its own, so that its peak memory is its own.  ``records/growth.svg`` shows the
time for each transition: linear growth is a level line.
"""

from __future__ import annotations

import json
import subprocess
import sys
from math import log10
from pathlib import Path
from typing import Any

from supremal.show.figures import Series, save_curves

SIZES = ((4, 3), (5, 2), (5, 3), (6, 2), (6, 3), (6, 4), (6, 5), (6, 6))
MEASURE = """
import json, resource, sys
from benchmarks.models import transfer_line
from benchmarks.synthesis import timed
from supremal import synthesize
from supremal.automata.explore import explore

machines, capacity = map(int, sys.argv[1:])
synthesize(*transfer_line(2, 1))
plants, specs = transfer_line(machines, capacity)
graph, exploring = timed(lambda: explore(plants, specs), 1 if capacity > 4 else 3)
states, transitions = len(graph.bad), len(graph.event)
del graph
supervisor, seconds = timed(lambda: synthesize(plants, specs), 1 if capacity > 4 else 3)
print(json.dumps({
    "states": states,
    "transitions": transitions,
    "supervisor": supervisor.automaton.n_states,
    "exploring": exploring,
    "synthesizing": seconds,
    "peak_gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
}))
"""


def run() -> dict[str, Any]:
    """Print a line a size and write the figure; return the record."""
    rows = []
    print(f"{'states':>12} {'transitions':>12} {'explored':>10} {'synthesized':>12} {'M/s':>6} {'GiB':>6}")
    for size in SIZES:
        command = [sys.executable, "-c", MEASURE, *map(str, size)]
        row = json.loads(subprocess.check_output(command, text=True))
        rows.append(row)
        rate = row["transitions"] / row["exploring"] / 1e6
        print(
            f"{row['states']:>12,} {row['transitions']:>12,} {row['exploring']:>8.3f} s "
            f"{row['synthesizing']:>10.3f} s {rate:>6.1f} {row['peak_gib']:>6.2f}",
            flush=True,
        )
    x = [log10(row["transitions"]) for row in rows]
    series = [
        Series(label, x, [1e9 * row[key] / row["transitions"] for row in rows], style)
        for label, key, style in (
            ("exploring and synthesizing", "synthesizing", "main"),
            ("exploring", "exploring", "second"),
        )
    ]
    stem = Path(__file__).parent / "records" / "growth"
    top = 1.2 * max(max(one.y) for one in series)
    save_curves(stem, series, xlabel="transitions (power of ten)", ylabel="ns a transition", ylim=(0, top))
    stem.with_suffix(".png").unlink()
    return {"models": rows}

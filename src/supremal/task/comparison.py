"""What the paper reports, beside what came out here.

The three points of each curve are averages over 10,000 episodes of the run that its authors published with
the program; the paper's figures draw that run.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple


class Published(NamedTuple):
    """Averages of the published run over the 10,000 episodes that end with ``episodes``."""

    episodes: int
    score: float
    completion: float


PUBLISHED: Final = (
    Published(10_000, -979.3, 0.0),
    Published(250_000, -454.5, 0.581),
    Published(500_000, -305.0, 0.946),
)


def comparison(result: Mapping[str, Any]) -> list[dict[str, str]]:
    """Return the rows "what / paper / here" for a summary; "–" stands for what a run did not reach."""
    training, greedy = result["training"], result["greedy"]
    interval = training["interval"]
    kept = "yes" if result["check"]["verdict"] == "enforceable" else "no"
    gap = f"{greedy['gap']:.1e}" if greedy["gap"] else "0"
    rows = [
        ("Both rules are controllable", "assumed", kept),
        ("Rules broken while learning", "0, by construction", f"{training['violations']:,}, counted"),
        ("ε at the end of training", "0.019", f"{training['final_epsilon']:.4f}" + _as_published(result)),
        ("Greedy policy completes the task within 60 steps", "100 %", f"{greedy['completion']:.4%}"),
        ("Greedy policy is optimal", "“optimally”", f"gap to the exact optimum: {gap}"),
    ]
    scores, completions = training["score"], training["completion"]
    for point in PUBLISHED:
        k = point.episodes // interval - 1
        reached = training["episodes"] >= point.episodes
        span = f"episodes {point.episodes - interval + 1:,}–{point.episodes:,}"
        here = (f"{scores[k]:.1f}", f"{completions[k]:.2%}") if reached else ("–", "–")
        rows += [
            (f"Average score, {span}", f"{point.score:.1f}", here[0]),
            (f"Tasks completed, {span}", f"{point.completion:.2%}", here[1]),
        ]
    return [{"what": what, "paper": paper, "here": here} for what, paper, here in rows]


def _as_published(result: Mapping[str, Any]) -> str:
    share = result["training"]["final_epsilon"] / 4
    return f" ({share:.4f} for each of four actions)" if result["preset"] == "published" else ""

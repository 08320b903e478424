"""A finished run, told on the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from supremal.cli.check import VERDICTS


def describe(console: Console, result: Mapping[str, Any], folder: Path) -> None:
    """Print what a reader of the report should know first; lines are wrapped on a terminal only."""
    check, product = result["check"], result["product"]

    def say(line: str, style: str = "") -> None:
        console.print(Text(line, style=style), soft_wrap=not console.is_terminal)

    console.print()
    say(VERDICTS[check["verdict"]], "bold")
    for plant in check["plants"]:
        say(f"  {plant['name']}: {plant['states']:,} states")
    for rule in check["rules"]:
        say(f"  {_rule(rule)}")
    say(
        f"  product under supervision: {product['states']:,} states, {product['state_actions']:,} enabled "
        f"actions, {product['disabled']:,} disabled"
    )
    console.print()
    console.print(_numbers(result))
    if result["baseline"] and not result["baseline"]["greedy"]["completion"]:
        say(_unfinished(result))
    if result["partial"]:
        say("Stopped before the end: these numbers are of the episodes that were run.", "bold")
    console.print(Text(f"Written to {folder}; open {folder / 'report.html'}"), soft_wrap=True)


def _rule(rule: Mapping[str, Any]) -> str:
    """Say whether a rule can be kept, with the witness of `supremal check` where it cannot."""
    found = rule["witness"] or rule["blocking"]
    verdict = {True: "controllable", False: "not controllable"}.get(rule["controllable"], "left open")
    if rule["blocking"] and not rule["witness"]:
        verdict += ", blocking"
    states = "1 state" if rule["states"] == 1 else f"{rule['states']:,} states"
    why = f"{found['text']}." if found else rule["without_plant"]["text"]
    return f"{rule['name']} ({rule['class']}, {states}): {verdict}. {why[:1].upper()}{why[1:]}"


def _unfinished(result: Mapping[str, Any]) -> str:
    """Say of a baseline whose policy never completes the task in time how long its episodes are."""
    limit, steps = result["settings"]["episode_steps"], result["baseline"]["greedy"]["expected_steps"]
    ends = "its episodes may never end" if steps is None else f"its episodes end after {steps:.1f} on average"
    return f"Without the rules the greedy policy never completes the task within {limit} steps; {ends}."


def _numbers(result: Mapping[str, Any]) -> Table:
    training, baseline = result["training"], result["baseline"]
    optimal, greedy = result["optimal"], result["greedy"]
    limit = result["settings"]["episode_steps"]
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("")
    table.add_column("supervised", justify="right")
    table.add_column("without the rules", justify="right")

    def both(form: str, key: str) -> tuple[str, str]:
        return form.format(training[key]), form.format(baseline[key]) if baseline else "–"

    def policies(key: str) -> tuple[str, str]:
        return f"{greedy[key]:.4%}", f"{baseline['greedy'][key]:.4%}" if baseline else "–"

    def row(what: str, here: str, there: str = "") -> None:
        table.add_row(f"  {what}", here, there)

    def last(form: str, curve: str) -> tuple[str, str]:
        ends = [form.format(run[curve][-1]) if run and run[curve] else "–" for run in (training, baseline)]
        return ends[0], ends[1]

    row("rules broken while learning", *both("{:,}", "violations"))
    row("episodes, final ε", f"{training['episodes']:,}, {training['final_epsilon']:.4f}")
    row("steps per second", *both("{:,.0f}", "steps_per_second"))
    row("average score at the end", *last("{:.1f}", "score"))
    row("tasks completed at the end", *last("{:.1%}", "completion"))
    row(f"greedy policy completes within {limit} steps", *policies("completion"))
    row("greedy policy ever breaks a rule", *policies("violation_probability"))
    row("value of the greedy policy", f"{greedy['value']:.9f}")
    row("value of the optimum", f"{optimal['value']:.9f}")
    bound = optimal["bound"] + greedy["bound"]
    gap = "0" if abs(greedy["gap"]) <= bound else f"{greedy['gap']:.1e}"
    row("gap (solver's bound)", f"{gap} ({bound:.0e})")
    row(
        "expected steps, optimum",
        "–" if optimal["expected_steps"] is None else f"{optimal['expected_steps']:.4f}",
    )
    if optimal["steps_undisturbed"] is not None:
        row("steps where nothing uncontrollable happens", f"{optimal['steps_undisturbed']:g}")
    return table

"""Exploration and synthesis beside libFAUDES and TCT, on a transfer line and on random automata.

All three get the same parts and have to compose and synthesize; the sizes of the results have to agree.  The
older tools are given the smaller sizes only, up to where they take about a minute; above them our time alone
shows how it grows.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from functools import reduce
from pathlib import Path
from time import perf_counter
from typing import Any

import faudes
import numpy as np
import pitct

from benchmarks.models import random_pair, transfer_line
from supremal import Automaton, synthesize
from supremal.automata.explore import explore

LINES = ((4, 3), (5, 3), (5, 5), (6, 3), (6, 5))
RANDOM = (10_000, 100_000, 1_000_000)
PATIENCE = 10.0
"""A peer that took longer than this, in seconds, is not asked for anything larger."""


def timed(work: Callable[[], Any], repeats: int = 1) -> tuple[Any, float]:
    """Return the result and the best time."""
    best, result = float("inf"), None
    for _ in range(repeats):
        began = perf_counter()
        result = work()
        best = min(best, perf_counter() - began)
    return result, best


def to_faudes(automaton: Automaton) -> Any:  # noqa: ANN401 - an extension type
    """Hand an automaton to libFAUDES."""
    names = automaton.alphabet.names
    sources, events = np.nonzero(automaton.delta >= 0)
    targets = automaton.delta[sources, events]
    moves = zip(sources.tolist(), events.tolist(), targets.tolist(), strict=True)
    return faudes.System.FromLists(
        [str(s) for s in range(automaton.n_states)],
        list(names),
        [name for name in names if name not in automaton.alphabet.uncontrollable],
        [(str(s), names[e], str(t)) for s, e, t in moves],
        ["0"],
        [str(s) for s in np.flatnonzero(automaton.marked)],
    )


def by_faudes(plants: Sequence[Automaton], specs: Sequence[Automaton]) -> tuple[tuple[int, int], float]:
    """Return the size of libFAUDES' supervisor and the time it took, hand-over left out."""
    g, k = [to_faudes(p) for p in plants], [to_faudes(s) for s in specs]
    controllable = faudes.EventSet()
    for part in (*plants, *specs):
        for name in part.alphabet:
            if name not in part.alphabet.uncontrollable:
                controllable.Insert(name)

    def work() -> Any:  # noqa: ANN401
        plant, spec = reduce(faudes.Parallel, g), reduce(faudes.Parallel, k)
        return faudes.SupCon(plant, controllable, faudes.Parallel(plant, spec))

    result, seconds = timed(work)
    return (int(result.Size()), int(result.TransRelSize())), seconds


def by_tct(plants: Sequence[Automaton], specs: Sequence[Automaton]) -> tuple[tuple[int, int], float]:
    """Return the size of TCT's supervisor and the time it took, hand-over left out."""
    numbers: dict[str, int] = {}
    for part in (*plants, *specs):
        for name in part.alphabet:
            odd = name not in part.alphabet.uncontrollable
            numbers.setdefault(name, 2 * len(numbers) + odd)
    here = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            pitct.init("run", overwrite=True)
            for kind, parts in (("g", plants), ("k", specs)):
                for i, part in enumerate(parts):
                    arrows = [
                        (int(s), numbers[part.alphabet.names[e]], int(part.delta[s, e]))
                        for s, e in np.argwhere(part.delta >= 0)
                    ]
                    marked = np.flatnonzero(part.marked).tolist()
                    pitct.create(f"{kind}{i}", part.n_states, arrows, marked)
            began = perf_counter()
            for kind, parts in (("g", plants), ("k", specs)):
                names = [f"{kind}{i}" for i in range(len(parts))]
                if len(names) > 1:
                    pitct.sync(kind, *names)
            plant = "g" if len(plants) > 1 else "g0"
            spec = "k" if len(specs) > 1 else "k0"
            pitct.sync("both", plant, spec)
            pitct.supcon("s", plant, "both")
            seconds = perf_counter() - began
            return (pitct.statenum("s"), pitct.transnum("s")), seconds
        finally:
            os.chdir(here)


PEERS = {"libFAUDES": by_faudes, "TCT": by_tct}


def compare(
    name: str, plants: Sequence[Automaton], specs: Sequence[Automaton], gone: set[str]
) -> dict[str, Any]:
    """Print one line and return its record; ``gone`` are the peers that ran out of patience."""
    graph, exploring = timed(lambda: explore(plants, specs), 3)
    supervisor, seconds = timed(lambda: synthesize(plants, specs), 3)
    size = (supervisor.automaton.n_states, supervisor.automaton.n_transitions)
    row: dict[str, Any] = {
        "model": name,
        "product": [len(graph.bad), len(graph.event)],
        "supervisor": list(size),
        "seconds": seconds,
        "transitions_per_second": len(graph.event) / exploring,
    }
    line = f"{name:14} {len(graph.bad):>9,} {len(graph.event):>11,} {size[0]:>9,} {seconds:>8.3f} s"
    for peer, solve in PEERS.items():
        if peer in gone:
            line += f"  {peer}      –       "
            continue
        try:
            theirs, took = solve(plants, specs)
        except MemoryError:
            line += f"  {peer} out of memory   "
            row[peer] = {"failed": "out of memory"}
            gone.add(peer)
            continue
        if theirs != size:
            message = f"{name}: {peer} finds {theirs}, supremal {size}"
            raise AssertionError(message)
        row[peer] = {"seconds": took, "ratio": took / seconds}
        line += f"  {peer} {took:7.2f} s {took / seconds:6.0f}×"
        if took > PATIENCE:
            gone.add(peer)
    print(line, flush=True)
    return row


def run() -> dict[str, Any]:
    """Print the times and their ratios; return the record."""
    synthesize(*transfer_line(2, 1))
    synthesize(*(([part]) for part in random_pair(20_000, 3, 0)))
    print(f"{'model':14} {'product':>9} {'transitions':>11} {'result':>9} {'supremal':>10}")
    rows = []
    gone: set[str] = set()
    for machines, capacity in LINES:
        plants, specs = transfer_line(machines, capacity)
        rows.append(compare(f"line {machines}, {capacity}", plants, specs, gone))
    gone = set()
    for states in RANDOM:
        plant, spec = random_pair(states, 20, 1)
        rows.append(compare(f"random {states:,}", [plant], [spec], gone))
    return {"models": rows}

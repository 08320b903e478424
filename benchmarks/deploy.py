"""Exported supervisors beside the library's Monitor: a million random events, answer by answer.

The supervisor is that of the manufacturing cell.  Each answer says whether the event was allowed and what is
enabled after it; an event that is not enabled comes now and then, and a reset after it.  Python and C answer
the same events, and every answer has to be the Monitor's.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from supremal import Monitor
from supremal.cli.models import read
from supremal.deploy.build import make_controller
from supremal.deploy.code import c_text, python_text

EVENTS = int(os.environ.get("DEPLOY_EVENTS", "1_000_000"))
TASK = Path(__file__).parents[1] / "examples" / "manufacturing_cell.toml"
DRIVER = r"""
#define CELL_SELF_TEST
#include "controller.h"
#include <stdio.h>
int main(void) {
    cell_supervisor s;
    int event;
    if (cell_self_test() != 0) return 1;
    cell_reset(&s);
    while ((event = getchar()) != EOF) {
        int ok = 1;
        unsigned long long enabled = 0;
        if (event == CELL_N_EVENTS) cell_reset(&s); else ok = cell_step(&s, (unsigned)event);
        for (unsigned e = 0; e < CELL_N_EVENTS; e++)
            if (cell_enabled(&s, e)) enabled |= 1ull << e;
        printf("%d %llu\n", ok, enabled);
    }
    return 0;
}
"""


def random_run(monitor: Monitor, seed: int) -> tuple[list[int], list[tuple[bool, int]]]:
    """Return events, E for a reset; of each whether it is allowed, and what is enabled then, as bits."""
    names = monitor.supervisor.automaton.alphabet.names
    rng, known = np.random.default_rng(seed), dict[int, list[int]]()
    events, answers = [], []
    for kind, draw in rng.random((EVENTS, 2)).tolist():
        enabled = known.get(monitor.state)
        if enabled is None:
            enabled = known[monitor.state] = [names.index(event) for event in monitor.enabled]
        ok, e = True, len(names)
        if not enabled or kind < 0.001:
            monitor.reset()
        else:
            choices = enabled if kind < 0.99 else range(len(names))
            e = choices[int(draw * len(choices))]
            ok = monitor.observe([names[e]])
        events.append(e)
        answers.append((ok, monitor.state))
    bits = {s: sum(1 << e for e in enabled) for s, enabled in known.items()}
    last = answers[-1][1]
    bits.setdefault(last, sum(1 << names.index(event) for event in monitor.enabled))
    return events, [(ok, bits[state]) for ok, state in answers]


def run() -> dict[str, Any]:
    subject = read([TASK], closed=False, must_act=False, max_states=None)
    controller = make_controller(subject.plants, subject.rules, name="cell", must_act=True)
    began = perf_counter()
    events, wanted = random_run(Monitor(controller.components[0].supervisor), seed=0)
    seconds = {"monitor": perf_counter() - began}

    text = python_text(controller)
    space: dict[str, Any] = {"__name__": "exported"}
    exec(compile(text, "cell.py", "exec"), space)
    exported, names = space["Supervisor"](), space["EVENTS"]
    number = {event: e for e, event in enumerate(names)}
    began = perf_counter()
    for e, answer in zip(events, wanted, strict=True):
        ok = exported.reset() is None if e == len(names) else exported.step(names[e])
        assert (ok, sum(1 << number[event] for event in exported.enabled())) == answer
    seconds["python"] = perf_counter() - began

    with tempfile.TemporaryDirectory() as folder:
        header = c_text(controller)
        Path(folder, "controller.h").write_text(header, encoding="ascii")
        Path(folder, "driver.c").write_text(DRIVER, encoding="ascii")
        strict = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
        subprocess.run(["gcc", *strict, "-o", "driver", "driver.c"], cwd=folder, check=True)
        size = subprocess.run(["size", "driver"], cwd=folder, check=True, capture_output=True, text=True)
        began = perf_counter()
        done = subprocess.run([Path(folder, "driver")], input=bytes(events), capture_output=True, check=True)
        seconds["c"] = perf_counter() - began
    assert done.stdout.decode().splitlines() == [f"{ok:d} {bits}" for ok, bits in wanted]

    refused = sum(not ok for ok, _ in wanted)
    for language, took in seconds.items():
        print(f"{language}: {EVENTS:,} events in {took:.1f} s, {EVENTS / took:,.0f} a second")
    print(f"all answers are the Monitor's; {refused:,} of the events were refused")
    return {
        "states": controller.n_states,
        "events": EVENTS,
        "refused": refused,
        "differences": 0,
        "seconds": seconds,
        "python_bytes": len(text),
        "c_bytes": len(header),
        "c_program_bytes": int(size.stdout.split()[6]),
    }

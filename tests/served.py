"""The page of a game, served while a test looks at it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from supremal.cli import play as command
from supremal.cli._serving import PageServer
from supremal.task.findings import Findings, plants_of, study
from supremal.task.game import game_of
from supremal.task.reading import read_task
from supremal.task.task import Task

LAMP = """
title = "A lamp that burns out"
[[plant]]
name = "lamp"
transitions = \"""
    uncontrollable fuse
    dark -on-> lit
    lit -off, fuse-> dark
\"""
[[rule]]
name = "once"
pattern = "at_most"
of = "fuse"
times = 1
"""
"""A task of plants only."""


def studied(task: Task) -> Findings:
    """Return what the check finds."""
    return study(plants_of(task), tuple(rule.automaton for rule in task.rules), task.options, lost=False)


@contextmanager
def served(path: Path) -> Iterator[PageServer]:
    """Serve the game of a task file at a free port."""
    task = read_task(path)
    findings = studied(task)
    game = game_of(task, findings)
    assert game is not None
    with command._server(task, findings, game, 0) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()

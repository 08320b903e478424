"""Test vectors: words that a copy of a controller has to follow, and what has to be seen on the way.

Each word goes where the fewest went before, and ends with an event that has to be refused, if there is one.
Words that show nothing new are left out.  Nothing is left to chance, so the same controller has the same
vectors.
"""

from __future__ import annotations

from collections import Counter
from typing import Final

from supremal.deploy.controller import Controller, JointMonitor, Vector

STEPS: Final = 200
"""About how many events all words together have."""
_LENGTH: Final = 20
_WALKS: Final = 50

Tried = Counter[tuple[tuple[int, ...], str]]


def make_vectors(controller: Controller, steps: int = STEPS) -> tuple[Vector, ...]:
    """Return words of about ``steps`` events in all, fewer where those show all that there is to see."""
    monitor, tried = JointMonitor(controller), Tried()
    found: list[Vector] = []
    for _ in range(_WALKS):
        before = len(tried)
        vector = _walk(monitor, tried)
        if len(tried) > before:
            found.append(vector)
        if sum(len(vector.word) for vector in found) >= steps:
            break
    return tuple(found)


def _walk(monitor: JointMonitor, tried: Tried) -> Vector:
    """Return a word of which each event was tried as seldom as any."""
    monitor.reset()
    word: list[str] = []
    enabled, marked = [monitor.enabled], [monitor.marked]

    def take(events: list[str]) -> None:
        here = monitor.state
        event = min(events, key=lambda event: tried[here, event])
        tried[here, event] += 1
        monitor.step(event)
        word.append(event)
        enabled.append(monitor.enabled)
        marked.append(monitor.marked)

    while enabled[-1] and len(word) < _LENGTH:
        take(list(enabled[-1]))
    refused = [event for event in monitor.controller.alphabet if event not in enabled[-1]]
    if refused:
        take(refused)
    return Vector(tuple(word), monitor.lost_at is None, tuple(enabled), tuple(marked))


def find_difference(controller: Controller) -> str | None:
    """Say where the controller does something else than its vectors, None where it does nowhere."""
    monitor = JointMonitor(controller)
    for number, vector in enumerate(controller.vectors, 1):
        monitor.reset()
        rows = zip(("", *vector.word), vector.enabled, vector.marked, strict=True)
        for k, (event, enabled, marked) in enumerate(rows):
            found = (monitor.step(event) if event else True, monitor.enabled, monitor.marked)
            wanted = (vector.ok or k < len(vector.word), enabled, marked)
            if found != wanted:
                after = " ".join(vector.word[:k]) or "nothing"
                return (
                    f"test {number} is not kept: after {after} the tables are {_told(*found)}, "
                    f"where the test has {_told(*wanted)}"
                )
    return None


def _told(ok: bool, enabled: tuple[str, ...], marked: bool) -> str:  # noqa: FBT001 - an answer, not flags
    return (
        f"{'allowed' if ok else 'lost'} and {'marked' if marked else 'not marked'}, with "
        f"{', '.join(enabled) or 'nothing'} enabled"
    )

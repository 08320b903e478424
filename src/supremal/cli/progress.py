"""What a run says while it goes on: a bar on a terminal, plain lines elsewhere, nothing for machines."""

from __future__ import annotations

from typing import Final, Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

_PARTS: Final = 5
"""Plain lines that one learner's episodes are reported in."""


class Reporter:
    """Tells the stages of a run and the episodes of its learners.

    Parameters
    ----------
    console
        Where to.
    episodes
        The episodes of one learner.
    quiet
        Whether to say nothing at all.
    """

    def __init__(self, console: Console, episodes: int, *, quiet: bool = False) -> None:
        self.console, self.episodes, self.quiet = console, episodes, quiet
        self._tasks: dict[tuple[str, int], int] = {}
        self._parts: dict[tuple[str, int], int] = {}
        self._bar = Progress(
            TextColumn("  {task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("episodes"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=quiet or not console.is_terminal,
        )

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def stage(self, name: str) -> None:
        """Say what begins."""
        if not self.quiet:
            self.console.print(f"{name} ...", style="dim", highlight=False)

    def progress(self, learner: str, place: int, done: int) -> None:
        """Say how many episodes the learner in a place has run; called from its thread."""
        key = (learner, place)
        if not self._bar.disable:
            if key not in self._tasks:
                self._tasks[key] = self._bar.add_task(f"{learner} {place + 1}", total=self.episodes)
            self._bar.update(self._tasks[key], completed=done)  # type: ignore[arg-type]
        elif not self.quiet:
            part = done * _PARTS // self.episodes
            if part > self._parts.get(key, 0):
                self._parts[key] = part
                self.console.print(
                    f"  {learner} {place + 1}: {done:,} of {self.episodes:,} episodes", highlight=False
                )

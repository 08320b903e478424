"""Where a run keeps the states of its learners, so that it can go on after it was stopped or killed."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from datetime import timedelta
from pathlib import Path
from typing import Final

from supremal.learning.checkpoints import LearnerState, load_state, save_state

CHECKPOINTS: Final = "checkpoints"
"""The folder inside a run's, one file for each learner and seed."""


class Keeper:
    """Keeps learners' states in the folder of a run.

    Parameters
    ----------
    folder
        That of the run.
    every
        How often; None: only when a learner ends or is stopped.
    """

    def __init__(self, folder: Path, every: timedelta | None = None) -> None:
        self.folder, self.every = folder / CHECKPOINTS, every

    def states(self, learner: str, seeds: Sequence[int]) -> list[LearnerState | None]:
        """Return the state of a learner with each of ``seeds``, None where none was kept."""
        paths = [self._path(learner, seed) for seed in seeds]
        return [load_state(path) if path.exists() else None for path in paths]

    def save(self, learner: str, state: LearnerState) -> None:
        """Keep the state of a learner in place of the one before; safe against being killed meanwhile."""
        self.folder.mkdir(parents=True, exist_ok=True)
        save_state(self._path(learner, state.seed), state)

    def clear(self) -> None:
        """Forget all states: the run is finished."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _path(self, learner: str, seed: int) -> Path:
        return self.folder / f"{learner}-{seed}.npz"

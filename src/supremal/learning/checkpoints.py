"""Checkpoints: all that a learner has in mind between two episodes, and back.

A learner that goes on from its state goes on bit for bit like one that was never stopped.  A file is written
beside its place, forced to the disk, and renamed into it: whenever the power fails, there is either the old
state or the new one, and it is whole.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from lzma import LZMAError
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np

from supremal._arrays import Bools, Floats, Ints, Longs, frozen
from supremal.errors import FormatError, MDPError
from supremal.learning.schedules import Schedule
from supremal.learning.settings import Settings

_DTYPES: Final[dict[str, type]] = {
    "progress": np.uint64,
    "visits": np.int64,
    "returns": np.float64,
    "lengths": np.int32,
    "completed": np.bool_,
    "violations": np.int32,
}
_ARRAYS: Final = ("q", *_DTYPES)
_NO_CHECKPOINT: Final = (
    # what zipfile, numpy and json raise, in this order, and what comes of a document with other fields
    *(BadZipFile, EOFError, RuntimeError, zlib.error, LZMAError),
    *(ValueError, TypeError, KeyError, AttributeError),
)


@dataclass(frozen=True, slots=True, eq=False)
class LearnerState:
    """A learner of C choices and T tables after N episodes.

    Parameters
    ----------
    model
        A hash of the model, the mask and the rules.
    settings, seed
        What it was set to.
    seconds
        The time that the episodes took.
    progress
        ``uint64 [2]``: the state of the random generator, and N.
    q
        ``[T * C]``, of the type that the settings ask for: the learned values of each choice.
    visits
        ``int64 [T * C]``: how often each was learned, empty where no rate goes by visits.
    returns, lengths, completed, violations
        ``[N]``: as in `QResult`.

    Raises
    ------
    MDPError
        If shapes do not fit.
    """

    model: str
    settings: Settings
    seed: int
    seconds: float
    progress: np.ndarray
    q: Floats
    visits: Longs
    returns: Floats
    lengths: Ints
    completed: Bools
    violations: Ints

    def __post_init__(self) -> None:
        for name in _ARRAYS:
            try:
                array = frozen(getattr(self, name), _DTYPES.get(name, self.settings.dtype), 1)
                object.__setattr__(self, name, array)
            except ValueError as error:
                message = f"{name}: {error}"
                raise MDPError(message) from None
        sizes = {"progress": 2, "visits": self.q.size if self.settings.counted else 0}
        for name in ("progress", "visits", "returns", "lengths", "completed", "violations"):
            size, needed = getattr(self, name).size, sizes.get(name, self.episodes)
            if size != needed:
                message = f"{name} has {size} entries, {needed} are needed"
                raise MDPError(message)

    @property
    def episodes(self) -> int:
        """N, the episodes that have been run."""
        return int(self.progress[-1]) if self.progress.size else 0


def check_state(state: LearnerState, model: str, settings: Settings, seed: int) -> None:
    """Raise an `MDPError` if a learner on ``model`` cannot go on from ``state``."""
    if state.model != model:
        message = (
            "the state to resume from is that of a learner on another model, mask or set of rules; "
            "give what it was learned on, or begin anew"
        )
        raise MDPError(message)
    own = replace(state.settings, episodes=settings.episodes)
    for name, before, now in (
        *((f.name, getattr(own, f.name), getattr(settings, f.name)) for f in fields(own)),
        ("seed", state.seed, seed),
    ):
        if before != now:
            message = f"the state to resume from was learned with {name} {before!r}, not {now!r}"
            raise MDPError(message)
    if state.episodes > settings.episodes:
        message = (
            f"the state to resume from has run {state.episodes:,} episodes; ask for at least as many, "
            f"not {settings.episodes:,}"
        )
        raise MDPError(message)


def save_state(path: str | Path, state: LearnerState) -> None:
    """Write ``state`` to a file, a zip archive of arrays (``.npz``).

    What was in it before is replaced in one step.  A write that is cut off may leave ``.NAME.partial`` beside
    it, which the next one overwrites.

    Raises
    ------
    OSError
        If it cannot be written.

    Notes
    -----
    8 or 4 bytes a choice and table, 8 more where visits are counted, 17 an episode.

    Examples
    --------
    >>> import tempfile
    >>> from supremal import Alphabet, Settings, from_outcomes, q_learning
    >>> from supremal.learning.checkpoints import load_state, save_state
    >>> step = from_outcomes([(0, "go", 1, 1.0, ("go",), 5.0)], alphabet=Alphabet(("go",)), terminal=[1])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = f"{folder}/learner.npz"
    ...     half = q_learning(step, settings=Settings(episodes=5), on_state=lambda s: save_state(path, s))
    ...     whole = q_learning(step, settings=Settings(episodes=10), resume=load_state(path))
    >>> len(half.returns), len(whole.returns)
    (5, 10)
    """
    place = Path(path)
    about = {"seed": state.seed, "seconds": state.seconds, "settings": asdict(state.settings)}
    text = json.dumps(about | {"model": state.model})
    partial = place.with_name(f".{place.name}.partial")
    with partial.open("wb") as file:
        np.savez(file, about=np.array(text), **{name: getattr(state, name) for name in _ARRAYS})
        file.flush()
        os.fsync(file.fileno())
    partial.replace(place)
    if os.name == "posix":  # elsewhere a folder cannot be opened
        folder = os.open(place.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def load_state(path: str | Path) -> LearnerState:
    """Return the state that `save_state` wrote to a file.

    Raises
    ------
    FormatError
        If it cannot be read, or is no such file.
    """
    try:
        with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            if arrays.zip.testzip() is None:  # first, since a damaged header may ask for any amount of memory
                return _state(json.loads(str(arrays["about"])), {name: arrays[name] for name in _ARRAYS})
            message = "it is damaged; give a checkpoint that save_state wrote"
    except OSError as error:
        message = f"cannot read it: {error.strerror or error}; give the path of a checkpoint"
    except _NO_CHECKPOINT as error:
        message = f"it is no checkpoint of a learner ({error}); give one that save_state wrote"
    raise FormatError(message, path=str(path)) from None


def _state(about: dict[str, Any], arrays: Mapping[str, np.ndarray]) -> LearnerState:
    said = {
        name: Schedule(**value) if isinstance(value, dict) else value
        for name, value in about.pop("settings").items()
    }
    return LearnerState(settings=Settings(**said), **about, **arrays)  # type: ignore[arg-type]

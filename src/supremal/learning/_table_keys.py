"""Observations as keys: the whole numbers in them, one after another.

An observation may be a whole number, an array of them, or a dictionary or tuple of observations.  Its layout
is settled by the first one that is seen; the others have to be made like it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, NoReturn, TypeAlias

import numpy as np

from supremal._arrays import Longs
from supremal.errors import MDPError

_MAX_DEPTH: Final = 50
_KINDS: Final = "iub"
_NUMBERS: Final = (int, np.integer, np.bool_)

Path: TypeAlias = tuple[Any, ...]


class Keys:
    """What turns observations into keys.

    Parameters
    ----------
    key
        A function of the user's that is applied first; it may return anything that an observation may be.
    """

    def __init__(self, key: Callable[[Any], Any] | None = None) -> None:
        self._key = key
        self._key_of: Longs = np.zeros(0, np.int64)
        self._leaves: list[tuple[Path, Longs | int]] | None = None

    def read(self, observation: Any) -> Longs:  # noqa: ANN401 - whatever an environment observes
        """Return the key of ``observation``, ``int64 [W]``, in an array that the next call writes to.

        Raises
        ------
        MDPError
            If something in it is no whole number, or it is made otherwise than the first one.
        """
        seen = observation if self._key is None else self._key(observation)
        if self._leaves is None:
            self._leaves = self._settle(seen)
        for path, place in self._leaves:
            value = seen
            try:
                for step in path:
                    value = value[step]
            except (LookupError, TypeError):
                value = None
            if isinstance(place, int):
                if not isinstance(value, _NUMBERS):
                    _fail(path, value, "the first one was a whole number")
                self._key_of[place] = value
            else:
                if (
                    not isinstance(value, np.ndarray)
                    or value.shape != place.shape
                    or value.dtype.kind not in _KINDS
                ):
                    _fail(path, value, f"the first one was an array of whole numbers of shape {place.shape}")
                place[...] = value
        return self._key_of

    def _settle(self, seen: Any) -> list[tuple[Path, Longs | int]]:  # noqa: ANN401 - see above
        """Find where the whole numbers are, and make room for them; arrays get their part of the key."""
        found: list[tuple[Path, Any]] = []
        stack: list[tuple[Path, Any]] = [((), seen)]
        while stack:
            path, value = stack.pop()
            if len(path) > _MAX_DEPTH:
                message = f"the observation is nested more than {_MAX_DEPTH} deep; give key="
                raise MDPError(message)
            if isinstance(value, Mapping):
                stack += [((*path, name), value[name]) for name in sorted(value, reverse=True)]
            elif isinstance(value, tuple | list):
                stack += [((*path, k), value[k]) for k in reversed(range(len(value)))]
            elif isinstance(value, _NUMBERS) or (
                isinstance(value, np.ndarray) and value.dtype.kind in _KINDS
            ):
                found.append((path, value))
            else:
                _fail(path, value, "a table needs whole numbers; give key=, a function that makes some of it")
        ends = np.cumsum([0, *(np.size(value) for _, value in found)]).tolist()
        self._key_of = np.zeros(ends[-1], np.int64)
        return [
            (path, self._key_of[at:end].reshape(value.shape) if isinstance(value, np.ndarray) else at)
            for (path, value), at, end in zip(found, ends[:-1], ends[1:], strict=True)
        ]


def _fail(path: Path, value: Any, right: str) -> NoReturn:  # noqa: ANN401 - see above
    where = "the observation" + "".join(f"[{step!r}]" for step in path)
    array = isinstance(value, np.ndarray)
    what = f"an array of {value.dtype} of shape {value.shape}" if array else f"of type {type(value).__name__}"
    message = f"{where} is {what}; {right}"
    raise MDPError(message)

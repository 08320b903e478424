"""The only module that names numba: kernels that compile when they are first called.

Importing numba takes longer than importing the rest of the house, so ``@kernel`` only remembers the
function; the first call compiles it (and keeps the machine code on disk for the next process).  A kernel
may call kernels: numba asks a global for its ``_numba_type_``, and that of a `Kernel` is its dispatcher's.
With ``NUMBA_DISABLE_JIT=1`` the same functions run as plain Python.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import update_wrapper
from typing import Any, Final, Generic, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

COMPILED: Final = os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")


class Kernel(Generic[P, R]):
    """A function of arrays and scalars, compiled at its first call; it runs without the GIL."""

    def __init__(self, function: Callable[P, R]) -> None:
        update_wrapper(self, function)
        self.python = function
        self._compiled: Any = None

    @property
    def compiled(self) -> Any:  # noqa: ANN401 - a numba dispatcher, which has no type of its own
        """The numba dispatcher."""
        if self._compiled is None:
            import numba

            self._compiled = numba.njit(cache=True, nogil=True)(self.python)
        return self._compiled

    @property
    def _numba_type_(self) -> Any:  # noqa: ANN401 - see above
        return self.compiled._numba_type_

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        run = self.compiled if COMPILED else self.python
        result: R = run(*args, **kwargs)
        return result


def kernel(function: Callable[P, R]) -> Kernel[P, R]:
    """Mark ``function`` as a kernel."""
    return Kernel(function)

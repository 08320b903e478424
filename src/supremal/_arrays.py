"""Arrays as values: the dtypes that all rooms share, and the sentinel for "not possible"."""

from __future__ import annotations

from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

NONE: Final = -1
"""The state that is none: a transition that is not possible."""

Ints: TypeAlias = NDArray[np.int32]
Longs: TypeAlias = NDArray[np.int64]
Floats: TypeAlias = NDArray[np.float64]
Bools: TypeAlias = NDArray[np.bool_]


def frozen(values: ArrayLike, dtype: DTypeLike, ndim: int) -> NDArray[Any]:
    """Return ``values`` as a C-ordered, read-only array that nobody else can write to.

    An array that is already so is returned as it is; anything else is copied.  A `ValueError` if the number
    of dimensions is another, or a value does not fit ``dtype``.

    Examples
    --------
    >>> a = frozen([[0, 1]], np.int32, 2)
    >>> a.flags.writeable, frozen(a, np.int32, 2) is a
    (False, True)
    """
    array = np.asarray(values)
    owned = array.base is None and (array is not values or not array.flags.writeable)
    result = np.array(array, dtype=dtype, order="C", copy=None if owned else True)
    if result.dtype != array.dtype and array.size and not np.array_equal(result, array):
        message = f"values of type {array.dtype} do not fit {result.dtype}"
        raise ValueError(message)
    if result.ndim != ndim:
        message = f"an array of {ndim} dimension(s) is needed, got shape {result.shape}"
        raise ValueError(message)
    result.flags.writeable = False
    return result

"""A hash table from integer keys to state numbers, for kernels that explore products.

``keys [count]`` holds the keys in the order in which they came; ``slots`` holds their numbers, `NONE` where
it is free, and has a power of two entries of which at most half are taken.
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Ints, Longs
from supremal._jit import kernel


@kernel
def find_slot(slots: Ints, keys: Longs, key: int | np.int64) -> int:
    """Return the slot of ``key`` in an open-addressed hash table: its own, or the free one to take."""
    mask = slots.shape[0] - 1
    mixed = ((key ^ (key >> 31)) & 0x7FFFFFFF) * 0x9E3779B1
    slot: int = int(mixed ^ (mixed >> 29)) & mask
    while slots[slot] != NONE and keys[slots[slot]] != key:
        slot = (slot + 1) & mask
    return slot


@kernel
def rehash(slots: Ints, keys: Longs, count: int) -> Ints:
    """Return a table of twice the size that holds the first ``count`` keys."""
    wider = np.full(slots.shape[0] * 2, NONE, np.int32)
    for i in range(count):
        wider[find_slot(wider, keys, keys[i])] = i
    return wider


@kernel
def find_row(slots: Longs, key: Longs) -> int:
    """Return the slot of a key of several integers: its own, or the free one to take.

    A slot is a row (number + 1, key), so that looking a key up touches one line of memory; zeros are free.
    """
    mask = slots.shape[0] - 1
    mixed = np.int64(0)
    for word in key:
        mixed = (((mixed >> 17) ^ word ^ (word >> 31)) & 0x7FFFFFFF) * 0x9E3779B1
    slot: int = (mixed ^ (mixed >> 29)) & mask
    while slots[slot, 0] != 0:
        same = True
        for w in range(key.shape[0]):
            if slots[slot, w + 1] != key[w]:
                same = False
                break
        if same:
            break
        slot = (slot + 1) & mask
    return slot


@kernel
def rehash_rows(slots: Longs) -> Longs:
    """Return a table of twice the size with the same keys and numbers."""
    wider = np.zeros((slots.shape[0] * 2, slots.shape[1]), np.int64)
    for i in range(slots.shape[0]):
        if slots[i, 0] != 0:
            wider[find_row(wider, slots[i, 1:])] = slots[i]
    return wider


@kernel
def grow(array: np.ndarray) -> np.ndarray:
    """Return a copy of a one-dimensional ``array`` with room for twice as much."""
    wider = np.empty(array.shape[0] * 2, array.dtype)
    wider[: array.shape[0]] = array
    return wider

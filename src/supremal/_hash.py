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
def find_row(slots: Ints, keys: Longs, row: Longs) -> int:
    """`find_slot` for keys of several integers: those of number ``i`` are ``keys[i * n : (i + 1) * n]``."""
    n = row.shape[0]
    mask = slots.shape[0] - 1
    mixed = np.int64(0)
    for w in range(n):
        mixed = (((mixed >> 17) ^ row[w] ^ (row[w] >> 31)) & 0x7FFFFFFF) * 0x9E3779B1
    slot: int = (mixed ^ (mixed >> 29)) & mask
    while slots[slot] != NONE:
        at = np.int64(slots[slot]) * n
        same = True
        for w in range(n):
            if keys[at + w] != row[w]:
                same = False
                break
        if same:
            break
        slot = (slot + 1) & mask
    return slot


@kernel
def rehash_rows(slots: Ints, keys: Longs, count: int, n: int) -> Ints:
    """`rehash` for keys of ``n`` integers."""
    wider = np.full(slots.shape[0] * 2, NONE, np.int32)
    for i in range(count):
        wider[find_row(wider, keys, keys[i * n : (i + 1) * n])] = i
    return wider


@kernel
def grow(array: np.ndarray) -> np.ndarray:
    """Return a copy of a one-dimensional ``array`` with room for twice as much."""
    wider = np.empty(array.shape[0] * 2, array.dtype)
    wider[: array.shape[0]] = array
    return wider

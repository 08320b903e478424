"""The product of automata, explored breadth first over integer keys.

A product state is the mixed-radix number of its component states.  Where the product of the sizes is
small the table from keys to numbers is addressed directly, elsewhere it is hashed.
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Ints, Longs
from supremal._hash import find_slot, grow, rehash
from supremal._jit import kernel


@kernel
def explore(
    delta: Ints,
    base: Longs,
    width: Longs,
    size: Longs,
    stride: Longs,
    part_start: Longs,
    part: Ints,
    column: Ints,
    table_size: int,
    limit: int,
) -> tuple[Longs, Ints]:
    """Return ``keys [S]`` and ``delta [S, E]`` of the reachable product, states in breadth-first order.

    Entry ``(q, c)`` of part ``k`` is ``delta[base[k] + q * width[k] + c]``.  Event ``e`` moves the parts
    ``part[part_start[e] : part_start[e + 1]]``, of which it is the ``column`` beside.  ``table_size`` > 0
    addresses keys directly.  More than ``limit`` states: one key too many comes back, and no transitions.
    """
    parts = size.shape[0]
    events = part_start.shape[0] - 1
    direct = table_size > 0
    keys = np.empty(1024, np.int64)
    out = np.full((1024, events), NONE, np.int32)
    slots = np.full(table_size if direct else 4096, NONE, np.int32)
    state = np.empty(parts, np.int64)
    keys[0] = 0
    slots[0 if direct else find_slot(slots, keys, 0)] = 0
    count = 1
    head = 0
    while head < count:
        key = keys[head]
        for k in range(parts):
            state[k] = key // stride[k] % size[k]
        for e in range(events):
            reached = key
            for j in range(part_start[e], part_start[e + 1]):
                k = part[j]
                to = delta[base[k] + state[k] * width[k] + column[j]]
                if to == NONE:
                    reached = NONE
                    break
                reached += (to - state[k]) * stride[k]
            if reached == NONE:
                continue
            slot = reached if direct else find_slot(slots, keys, reached)
            if slots[slot] == NONE:
                if count == limit:
                    return keys[: count + 1].copy(), out[:0].copy()
                if count + 1 == keys.shape[0]:
                    keys = grow(keys)
                    wider_out = np.full((keys.shape[0], events), NONE, np.int32)
                    wider_out[:count] = out[:count]
                    out = wider_out
                keys[count] = reached
                slots[slot] = count
                count += 1
                if not direct and count * 2 > slots.shape[0]:
                    slots = rehash(slots, keys, count)
                    slot = find_slot(slots, keys, reached)
            out[head, e] = slots[slot]
        head += 1
    return keys[:count].copy(), out[:count].copy()

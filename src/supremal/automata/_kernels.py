"""The product of automata, explored breadth first over integer keys.

A key packs the component states into bits, so that taking it apart costs shifts and no divisions; it has as
many integers as that takes.  Where the product of the sizes is small enough the table from states to numbers
is addressed by their mixed-radix number, elsewhere keys are hashed.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._hash import find_row
from supremal._jit import kernel

BLOCK: Final = 62
"""Events that one integer tells of."""

_BIT: Final = np.zeros(67, np.int64)
"""The number of a bit from its value modulo 67, of which 2 is a primitive root."""
for _bit in range(BLOCK):
    _BIT[(1 << _bit) % 67] = _bit


@kernel
def explore(
    delta: Ints,
    base: Longs,
    width: Longs,
    stride: Longs,
    place: Longs,
    shift: Longs,
    bits: Longs,
    possible: Longs,
    first_row: Longs,
    free: Longs,
    forced: Longs,
    plants: int,
    part_start: Longs,
    part: Ints,
    column: Ints,
    table: Ints,
    slots: Longs,
    keys: Longs,
    start: Longs,
    bad: Bools,
    offers: Bools,
    event: Ints,
    target: Ints,
    done: Longs,
) -> None:
    """Explore the product of plants and specifications, breadth first, as far as the arrays have room.

    Entry ``(q, c)`` of part ``k`` is ``delta[base[k] + q * width[k] + c]``; the first ``plants`` parts are
    plants.  Event ``e`` moves the parts ``part[part_start[e] : part_start[e + 1]]``, of which it is the
    ``column`` beside.  Row ``first_row[k] + q`` of ``possible`` holds, `BLOCK` events an integer, which
    events part ``k`` can follow in ``q`` or does not know; ``free`` which are controllable, ``forced`` which
    are not.

    A state's key is a row of ``keys [room, words]``, in which part ``k`` takes ``bits[k]`` (a mask) at
    ``shift[k]`` of integer ``place[k]``.  ``table``, where it is not empty, is addressed by the mixed-radix
    number of the state, with ``stride``; elsewhere keys are hashed in ``slots``.

    A state is *bad* where all plants can follow an uncontrollable event and a specification cannot.  It
    has no edges.  *offers* tells where the plants can follow a controllable event.  ``start``, ``event``
    and ``target`` are the edges; ``done`` counts the states explored, the states found and the edges, and
    is where a call goes on from.

    Notes
    -----
    Arrays that grow inside of the loop would cost two thirds of its speed: compiled code then looks each of
    them up anew at every access.
    """
    parts = stride.shape[0]
    blocks = free.shape[0]
    events = part_start.shape[0] - 1
    words = keys.shape[1]
    direct = table.shape[0] > 0
    state = np.zeros(parts, np.int64)
    reached = np.zeros(words, np.int64)
    open_events = np.zeros(blocks, np.int64)
    head, count, edges = done[0], done[1], done[2]
    while head < count:
        if count + events > keys.shape[0] or edges + events > event.shape[0]:
            break
        if not direct and 2 * (count + events) > slots.shape[0]:
            break
        number = np.int64(0)
        for k in range(parts):
            state[k] = (keys[head, place[k]] >> shift[k]) & bits[k]
            number += state[k] * stride[k]
        breaks = False
        for m in range(blocks):
            can = np.int64(-1)
            may = np.int64(-1)
            for k in range(plants):
                can &= possible[first_row[k] + state[k], m]
            for k in range(plants, parts):
                may &= possible[first_row[k] + state[k], m]
            breaks |= can & ~may & forced[m] != 0
            offers[head] |= can & free[m] != 0
            open_events[m] = can & may
        bad[head] = breaks
        for m in range(0 if breaks else blocks):
            left = open_events[m]
            while left != 0:
                low = left & -left
                left ^= low
                e = m * BLOCK + _BIT[low % 67]
                for w in range(words):
                    reached[w] = keys[head, w]
                to = number
                for i in range(part_start[e], part_start[e + 1]):
                    k = part[i]
                    step = delta[base[k] + state[k] * width[k] + column[i]] - state[k]
                    reached[place[k]] += step << shift[k]
                    to += step * stride[k]
                slot = 0
                if direct:
                    known = np.int64(table[to]) - 1
                else:
                    slot = find_row(slots, reached)
                    known = slots[slot, 0] - 1
                if known == NONE:
                    known = count
                    count += 1
                    if direct:
                        table[to] = count
                    else:
                        slots[slot, 0] = count
                    for w in range(words):
                        keys[known, w] = reached[w]
                        if not direct:
                            slots[slot, w + 1] = reached[w]
                event[edges] = e
                target[edges] = known
                edges += 1
        head += 1
        start[head] = edges
    done[0], done[1], done[2] = head, count, edges


@kernel
def pack(delta: Ints, column: Ints, packed: Longs) -> None:
    """Write to ``packed [S, blocks]`` which events an automaton can follow in each state.

    Event ``e`` is ``column[e]`` of ``delta``; `NONE` is an event that it does not know, which counts.
    """
    for s in range(delta.shape[0]):
        for e in range(column.shape[0]):
            if column[e] == NONE or delta[s, column[e]] != NONE:
                packed[s, e // BLOCK] |= np.int64(1) << (e % BLOCK)


@kernel
def unpack(keys: Longs, place: Longs, shift: Longs, bits: Longs, states: Ints) -> None:
    """Take keys apart: write the state of every part to ``states [S, K]``."""
    for s in range(states.shape[0]):
        for k in range(states.shape[1]):
            states[s, k] = (keys[s, place[k]] >> shift[k]) & bits[k]


@kernel
def fill_table(start: Longs, event: Ints, target: Ints, delta: Ints) -> None:
    """Write the edges to the dense table ``delta [S, E]``."""
    for s in range(delta.shape[0]):
        for k in range(start[s], start[s + 1]):
            delta[s, event[k]] = target[k]

"""The product of automata, explored breadth first over integer keys.

A key packs the component states into bits, so that taking it apart costs shifts and no divisions; it has as
many integers as that takes.  Where the product of the sizes is small enough the table from states to numbers
is addressed by their mixed-radix number, elsewhere keys are hashed.
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._hash import find_row, grow, rehash_rows
from supremal._jit import kernel


@kernel
def explore(
    delta: Ints,
    base: Longs,
    width: Longs,
    stride: Longs,
    place: Longs,
    shift: Longs,
    bits: Longs,
    words: int,
    order: Ints,
    part_start: Longs,
    plants: Ints,
    part: Ints,
    column: Ints,
    uncontrollable: Bools,
    table: Ints,
    limit: int,
) -> tuple[Longs, Longs, Ints, Ints, Bools, Bools]:
    """Explore the product of plants and specifications, breadth first.

    Entry ``(q, c)`` of part ``k`` is ``delta[base[k] + q * width[k] + c]``.  Event ``e`` moves the parts
    ``part[part_start[e] : part_start[e + 1]]``, of which it is the ``column`` beside; the first ``plants[e]``
    of these are plants.  A state's key is ``words`` integers, in which part ``k`` takes ``bits[k]`` (a mask)
    at ``shift[k]`` of integer ``place[k]``.  ``table``, where it is not empty, is addressed by the
    mixed-radix number of the state, with ``stride``; elsewhere keys are hashed.

    A state is *bad* where all plants can follow an uncontrollable event and a specification cannot.  It has
    no edges.  *offers* tells where the plants can follow a controllable event.

    Returns ``keys [S * words]``, ``start [S + 1]``, ``event`` and ``target`` of the edges, ``bad [S]`` and
    ``offers [S]``.  More than ``limit`` states: the keys of one too many come back.
    """
    parts = stride.shape[0]
    direct = table.shape[0] > 0
    keys = np.zeros(1024 * words, np.int64)
    start = np.zeros(1025, np.int64)
    bad = np.zeros(1024, np.bool_)
    offers = np.zeros(1024, np.bool_)
    event = np.empty(4096, np.int32)
    target = np.empty(4096, np.int32)
    slots = np.full(1 if direct else 4096, NONE, np.int32)
    state = np.zeros(parts, np.int64)
    reached = np.zeros(words, np.int64)
    if direct:
        table[0] = 1
    else:
        slots[find_row(slots, keys, reached)] = 0
    count = 1
    edges = 0
    head = 0
    while head < count:
        number = 0
        for k in range(parts):
            state[k] = (keys[head * words + place[k]] >> shift[k]) & bits[k]
            number += state[k] * stride[k]
        for e in order:
            for w in range(words):
                reached[w] = keys[head * words + w]
            to = number
            i = part_start[e]
            end = part_start[e + 1]
            while i < end:
                k = part[i]
                step = delta[base[k] + state[k] * width[k] + column[i]] - state[k]
                if step + state[k] == NONE:
                    break
                reached[place[k]] += step << shift[k]
                to += step * stride[k]
                i += 1
            possible = i >= part_start[e] + plants[e]
            if possible and not uncontrollable[e]:
                offers[head] = True
            if i < end:
                if possible and uncontrollable[e]:
                    bad[head] = True
                    edges = start[head]
                    break
                continue
            slot = 0
            if direct:
                known = table[to] - 1
            else:
                slot = find_row(slots, keys, reached)
                known = slots[slot]
            if known == NONE:
                if count == limit:
                    return keys[: (count + 1) * words].copy(), start, event, target, bad, offers
                if (count + 1) * words >= keys.shape[0]:
                    keys = grow(keys)
                    start = grow(start)
                    bad = grow(bad)
                    offers = grow(offers)
                known = count
                for w in range(words):
                    keys[count * words + w] = reached[w]
                bad[count] = False
                offers[count] = False
                count += 1
                if direct:
                    table[to] = count
                else:
                    slots[slot] = known
                    if count * 2 > slots.shape[0]:
                        slots = rehash_rows(slots, keys, count, words)
            if edges == event.shape[0]:
                event = grow(event)
                target = grow(target)
            event[edges] = e
            target[edges] = known
            edges += 1
        head += 1
        start[head] = edges
    return (
        keys[: count * words].copy(),
        start[: count + 1].copy(),
        event[:edges].copy(),
        target[:edges].copy(),
        bad[:count].copy(),
        offers[:count].copy(),
    )


@kernel
def fill_table(start: Longs, event: Ints, target: Ints, delta: Ints) -> None:
    """Write the edges to the dense table ``delta [S, E]``."""
    for s in range(delta.shape[0]):
        for k in range(start[s], start[s + 1]):
            delta[s, event[k]] = target[k]

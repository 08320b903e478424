"""Kernels of decision processes: the product and the safe set."""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._hash import find_slot, grow, rehash
from supremal._jit import kernel


@kernel
def explore(
    row: Longs,
    next_state: Ints,
    word: Ints,
    terminal: Bools,
    initial: Ints,
    rule_next: Ints,
    rule_base: Longs,
    rule_size: Longs,
    rule_marked: Bools,
    machine_next: Ints,
    machine_label: Ints,
    words: int,
    limit: int,
) -> tuple[Longs, Ints, Longs, Ints, Longs]:
    """Explore the product of a process, rules that read its words, and a machine that reads its labels.

    Rule ``k`` moves from ``q`` by word ``w`` to ``rule_next[rule_base[k] + q * words + w]``, `NONE` if that
    breaks it; it breaks too where a state that is not in ``rule_marked``, one rule's after the other's, meets
    a terminal one.  A state's key is its mixed-radix number (process, rules, machine), and ``-1 - m`` for
    the sink in which the rules of bit mask ``m`` are broken.

    Returns ``keys [S]``, ``start``, the state in which each of ``initial`` begins, ``row``, ``next_state
    [O]`` and ``taken [O]``, the process's outcome behind each outcome.  More than ``limit`` states: one key
    too many comes back.
    """
    rules = rule_size.shape[0]
    machine_size = machine_next.shape[0]
    actions = (row.shape[0] - 1) // terminal.shape[0]
    radix = machine_size
    without_state = 0
    owing = 0
    first = 0
    for k in range(rules):
        radix *= max(rule_size[k], 1)
        if rule_size[k] == 0:
            without_state |= 1 << k
        elif not rule_marked[first]:
            owing |= 1 << k
        first += rule_size[k]

    keys = np.empty(1024, np.int64)
    slots = np.full(4096, NONE, np.int32)
    out_row = np.zeros(1024 * actions + 1, np.int64)
    out_next = np.empty(4096, np.int32)
    out_taken = np.empty(4096, np.int64)
    state = np.empty(rules, np.int64)
    start = np.empty(initial.shape[0], np.int32)
    count = 0
    for i in range(initial.shape[0]):
        s = initial[i]
        broken = without_state | owing if terminal[s] else without_state
        key = np.int64(-1 - broken) if broken else s * radix
        slot = find_slot(slots, keys, key)
        if slots[slot] == NONE:
            if count + 1 == keys.shape[0]:
                keys = grow(keys)
            keys[count] = key
            slots[slot] = count
            count += 1
            if count * 2 > slots.shape[0]:
                slots = rehash(slots, keys, count)
                slot = find_slot(slots, keys, key)
        start[i] = slots[slot]
    outcomes = 0
    head = 0
    while head < count:
        key = keys[head]
        s = key // radix
        rest = key % radix
        u = rest % machine_size
        rest //= machine_size
        for j in range(rules):
            k = rules - 1 - j
            state[k] = rest % max(rule_size[k], 1)
            rest //= max(rule_size[k], 1)
        while (head + 1) * actions >= out_row.shape[0]:
            out_row = grow(out_row)
        for a in range(actions):
            if key >= 0 and not terminal[s]:
                for o in range(row[s * actions + a], row[s * actions + a + 1]):
                    broken = 0
                    to = np.int64(next_state[o])
                    reached = to
                    first = 0
                    for k in range(rules):
                        q = rule_next[rule_base[k] + state[k] * words + word[o]]
                        if q == NONE or (terminal[to] and not rule_marked[first + q]):
                            broken |= 1 << k
                        first += rule_size[k]
                        reached = reached * rule_size[k] + q
                    reached = reached * machine_size + machine_next[u, machine_label[to]]
                    if broken:
                        reached = np.int64(-1 - broken)
                    slot = find_slot(slots, keys, reached)
                    if slots[slot] == NONE:
                        if count == limit:
                            return keys[: count + 1].copy(), start, out_row, out_next, out_taken
                        if count + 1 == keys.shape[0]:
                            keys = grow(keys)
                        keys[count] = reached
                        slots[slot] = count
                        count += 1
                        if count * 2 > slots.shape[0]:
                            slots = rehash(slots, keys, count)
                            slot = find_slot(slots, keys, reached)
                    if outcomes == out_next.shape[0]:
                        out_next = grow(out_next)
                        out_taken = grow(out_taken)
                    out_next[outcomes] = slots[slot]
                    out_taken[outcomes] = o
                    outcomes += 1
            out_row[head * actions + a + 1] = outcomes
        head += 1
    return (
        keys[:count].copy(),
        start,
        out_row[: count * actions + 1].copy(),
        out_next[:outcomes].copy(),
        out_taken[:outcomes].copy(),
    )


@kernel
def disable(
    into: Longs, slot: Ints, enabled: Bools, left: Ints, terminal: Bools, safe: Bools, fresh: Ints, count: int
) -> None:
    """Disable the actions that may lead to the states ``fresh[:count]``, and go on from what that costs.

    ``slot[into[t] : into[t + 1]]`` are the pairs s * A + a with an outcome in ``t``; ``left [S]`` counts the
    enabled actions.  A state that is not terminal and has none left is no longer safe.
    """
    actions = enabled.shape[0] // safe.shape[0]
    head = 0
    while head < count:
        t = fresh[head]
        head += 1
        for j in range(into[t], into[t + 1]):
            k = slot[j]
            if enabled[k]:
                enabled[k] = False
                s = k // actions
                left[s] -= 1
                if left[s] == 0 and safe[s] and not terminal[s]:
                    safe[s] = False
                    fresh[count] = s
                    count += 1

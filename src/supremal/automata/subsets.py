"""The subset construction: a deterministic automaton of what may be so, given the word that was seen.

An automaton that is not deterministic, or has silent moves, can be in any state of a set after a word.  These
sets are the states here: the initial one is the silent closure of the initial states, and an event leads from
a set to the closure of all that it leads to from a member.  A set is marked where a member is.

Of S states there are 2^S sets at worst; only those that are reached are built.  They are kept one after
another in a pool and found again by a hash that does not ask for an order (Zobrist's: a random number a
state, the exclusive or of the members'), so that nothing is sorted.

Source: Rabin, Scott, "Finite automata and their decision problems", IBM J. Res. Dev. 3 (1959); Cassandras,
Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., section 2.3.4.
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._graph import reachable_from
from supremal._hash import grow
from supremal._jit import kernel
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.build import empty
from supremal.automata.explore import default_max_states
from supremal.errors import AutomatonError


def subset_automaton(
    alphabet: Alphabet,
    moves: tuple[Longs, Ints],
    silent: tuple[Longs, Ints],
    initial: Bools,
    marked: Bools,
    *,
    max_states: int | None = None,
    name: str = "",
) -> Automaton:
    """Return the subset automaton, its states in breadth-first order.

    Parameters
    ----------
    alphabet
        The E events.
    moves
        ``start [S * E + 1]`` and ``target``: event e leads from s to the states
        ``target[start[s * E + e] : start[s * E + e + 1]]``; `NONE` among them is skipped.
    silent
        ``start [S + 1]`` and ``target`` of the silent moves.
    initial, marked
        ``bool [S]``.
    max_states
        The most states that the result may have; left out: what fits the machine.
    name
        What to call the result.

    Raises
    ------
    AutomatonError
        If the result has more than ``max_states`` states, or its sets do not fit the machine.
    """
    seeds = np.flatnonzero(reachable_from(*silent, initial)).astype(np.int32)
    if not seeds.size:
        return empty(alphabet, name=name)
    limit = default_max_states(len(alphabet)) if max_states is None else max_states
    room = 20 * default_max_states(0)  # members: four bytes each, and half of them free after a growth
    code = np.random.default_rng(0).integers(0, 1 << 62, len(initial))
    first, pool, delta = _explore(*moves, *silent, seeds, code, len(alphabet), limit, room)
    if not len(delta):
        why = "" if len(first) > limit else f", or these do not fit the memory: {first[-1]:,} members"
        message = (
            f"the subset automaton of {name or 'the automaton'} ({len(initial):,} states) has more than "
            f"{min(limit, len(first) - 1):,} sets{why}; raise max_states, or make the automaton smaller first"
        )
        raise AutomatonError(message)
    return Automaton(alphabet, delta, np.logical_or.reduceat(marked[pool], first[:-1]), name=name)


@kernel
def _add(state: int, members: Ints, count: int, seen: Longs, stamp: int) -> int:
    """Add ``state`` to the first ``count`` of ``members``, if it is one and is not there yet."""
    if state != NONE and seen[state] != stamp:
        seen[state] = stamp
        members[count] = state
        count += 1
    return count


@kernel
def _close(members: Ints, count: int, seen: Longs, stamp: int, start: Longs, target: Ints) -> int:
    """Add to the first ``count`` of ``members`` all that silent moves lead to; return how many there are."""
    head = 0
    while head < count:
        s = members[head]
        head += 1
        for k in range(start[s], start[s + 1]):
            count = _add(target[k], members, count, seen, stamp)
    return count


@kernel
def _code(members: Ints, count: int, zobrist: Longs) -> np.int64:
    """Return the hash of the set of the first ``count`` of ``members``."""
    code = np.int64(0)
    for i in range(count):
        code ^= zobrist[members[i]]
    return code


@kernel
def _find(
    slots: Ints, codes: Longs, first: Longs, pool: Ints, code: np.int64, count: int, seen: Longs, stamp: int
) -> int:
    """Return the slot of the set whose ``count`` members are stamped: its own, or the free one to take."""
    mask = slots.shape[0] - 1
    slot: int = code & mask
    while slots[slot] != NONE:
        i = slots[slot]
        same = codes[i] == code and first[i + 1] - first[i] == count
        k = first[i]
        while same and k < first[i + 1]:
            same = seen[pool[k]] == stamp
            k += 1
        if same:
            break
        slot = (slot + 1) & mask
    return slot


@kernel
def _rehash(slots: Ints, codes: Longs, count: int) -> Ints:
    """Return a table of twice the size for the first ``count`` sets, which are all different."""
    wider = np.full(slots.shape[0] * 2, NONE, np.int32)
    mask = wider.shape[0] - 1
    for i in range(count):
        slot = codes[i] & mask
        while wider[slot] != NONE:
            slot = (slot + 1) & mask
        wider[slot] = i
    return wider


@kernel
def _explore(
    start: Longs,
    target: Ints,
    silent_start: Longs,
    silent_target: Ints,
    seeds: Ints,
    zobrist: Longs,
    events: int,
    limit: int,
    room: int,
) -> tuple[Longs, Ints, Ints]:
    """Return the sets, ``pool[first[i] : first[i + 1]]``, and ``delta [N, E]``; see `subset_automaton`.

    Where there are more than ``limit`` sets, or more than ``room`` members, ``delta`` comes back empty.
    """
    states = silent_start.shape[0] - 1
    seen = np.zeros(states, np.int64)
    members = np.empty(states, np.int32)
    codes = np.empty(1024, np.int64)
    first = np.zeros(1025, np.int64)
    rows = np.full(1024 * events, NONE, np.int32)
    slots = np.full(4096, NONE, np.int32)
    pool = seeds.copy()
    codes[0] = _code(seeds, len(seeds), zobrist)
    first[1] = len(seeds)
    slots[codes[0] & 4095] = 0
    found = 1
    head = 0
    stamp = 0
    while head < found:
        for e in range(events):
            stamp += 1
            count = 0
            for i in range(first[head], first[head + 1]):
                row = pool[i] * np.int64(events) + e
                for k in range(start[row], start[row + 1]):
                    count = _add(target[k], members, count, seen, stamp)
            if count == 0:
                continue
            count = _close(members, count, seen, stamp, silent_start, silent_target)
            code = _code(members, count, zobrist)
            slot = _find(slots, codes, first, pool, code, count, seen, stamp)
            known = slots[slot]
            if known == NONE:
                if found >= limit or first[found] + count > room:
                    return first[: found + 1].copy(), pool[:0].copy(), rows[:0].reshape(0, events)
                while first[found] + count > pool.shape[0]:
                    pool = grow(pool)
                if found + 1 == codes.shape[0]:
                    codes, first, rows = grow(codes), grow(first), grow(rows)
                    rows[found * events + events :] = NONE
                known = found
                codes[found] = code
                pool[first[found] : first[found] + count] = members[:count]
                first[found + 1] = first[found] + count
                slots[slot] = found
                found += 1
                if found * 2 > slots.shape[0]:
                    slots = _rehash(slots, codes, found)
            rows[head * events + e] = known
        head += 1
    delta = rows[: found * events].copy().reshape(found, events)
    return first[: found + 1].copy(), pool[: first[found]].copy(), delta

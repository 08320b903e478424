"""Exploring the product of plants and specifications, once, on the fly.

What can happen is decided by the plants; what may happen by the specifications.  A state in which all plants
can follow an uncontrollable event and some specification cannot is *bad*: no supervisor may let it be
reached, so it is not explored any further.  With plants only this is the synchronous composition.

Events that no plant knows are possible at any time.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._hash import find_row, rehash_rows
from supremal.automata import _kernels
from supremal.automata.alphabet import Alphabet, union
from supremal.automata.automaton import Automaton
from supremal.errors import AutomatonError

_DIRECT: Final = 1 << 26
"""Up to so many combinations of states the table is addressed directly; its pages come as needed."""

_ROOM: Final = 1 << 22
"""The most states that there is room for at first; here too pages come as needed."""

_NAMED: Final = 12
"""Parts that an error names."""

_BITS: Final = 62
_MEMORY_SHARE: Final = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class Exploration:
    """A product as a graph: S states, M edges, K parts.

    Parameters
    ----------
    alphabet
        The events of all parts.
    states
        ``int32 [S, K]``: the state of each part; state 0 is initial.
    start, event, target
        The edges out of s are ``start[s]`` to ``start[s + 1]`` of ``event`` and ``target``.
    marked
        ``bool [S]``: where all parts are marked.
    bad
        ``bool [S]``: where something uncontrollable breaks a specification.
    offers
        ``bool [S]``: where the plants can follow some controllable event.
    """

    alphabet: Alphabet
    states: Ints
    start: Longs
    event: Ints
    target: Ints
    marked: Bools
    bad: Bools
    offers: Bools

    def delta(self) -> Ints:
        """Return the edges as a dense table, ``int32 [S, E]``."""
        table = np.full((len(self.bad), len(self.alphabet)), NONE, np.int32)
        _kernels.fill_table(self.start, self.event, self.target, table)
        return table


def as_parts(parts: Automaton | Sequence[Automaton]) -> tuple[Automaton, ...]:
    """Return one automaton, or a sequence of them, as a tuple."""
    return (parts,) if isinstance(parts, Automaton) else tuple(parts)


def default_max_states(events: int, parts: int = 1) -> int:
    """Return how many states of a product fit two fifths of this machine's memory.

    Synthesis takes about 5 bytes an event and 8 a part for each state of its result, and as much again, with
    some ten edges, while it works.
    """
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return int(_MEMORY_SHARE * memory / (12 * events + 8 * parts + 200))


def explore(
    plants: Sequence[Automaton], specs: Sequence[Automaton] = (), *, max_states: int | None = None
) -> Exploration:
    """Return the reachable product of ``plants`` and ``specs``, bad states not explored.

    Parameters
    ----------
    plants, specs
        What can happen, and what may.
    max_states
        The most states that the product may have; left out: what fits the machine.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another.
    AutomatonError
        If the product has more than ``max_states`` states; names the parts and their sizes.

    Notes
    -----
    Linear in the states times the events, and in the transitions times the parts that share an event.  Memory
    is 8 bytes an edge and about 40 a state, besides the result.
    """
    parts = [*plants, *specs]
    alphabet = union(*(part.alphabet for part in parts))
    limit = default_max_states(len(alphabet), len(parts)) if max_states is None else max_states
    sizes = [part.n_states for part in parts]
    if 0 in sizes:
        return _nothing(alphabet, len(parts))
    place, shift, bits = _packing(sizes)
    direct = prod(sizes) <= _DIRECT
    blocks = -(-len(alphabet) // _kernels.BLOCK)
    start, part, column = _participants(alphabet, parts)
    possible = np.concatenate([np.empty((0, blocks), np.int64), *(_possible(alphabet, p) for p in parts)])
    table = np.zeros(prod(sizes) if direct else 0, np.int32)  # numbers counted from 1: free pages are zeros
    table[:1] = 1
    model = (
        np.concatenate([np.empty(0, np.int32), *(p.delta.reshape(-1) for p in parts)]),
        np.cumsum([0, *(p.delta.size for p in parts[:-1])], dtype=np.int64),
        np.array([len(p.alphabet) for p in parts], np.int64),
        np.array([prod(sizes[k + 1 :]) if direct else 0 for k in range(len(parts))], np.int64),
        place,
        shift,
        bits,
        possible,
        np.cumsum([0, *sizes[:-1]], dtype=np.int64),
        _pack(alphabet.controllable),
        _pack(~alphabet.controllable),
        len(plants),
        start,
        part,
        column,
        table,
    )
    room = min(prod(sizes), _ROOM, limit)
    found = _Found(len(alphabet), int(place.max(initial=0)) + 1, room, hashed=not direct)
    while found.done[0] < found.done[1] <= limit:
        found.make_room()
        _kernels.explore(*model, *found.arrays(), found.done)
    _, count, edges = found.done.tolist()
    if count > limit:
        message = (
            f"the product of {_sizes(parts)} states has more than {limit:,}; raise max_states or split it"
        )
        raise AutomatonError(message)
    states = np.empty((count, len(parts)), np.int32)
    _kernels.unpack(found.keys, place, shift, bits, states)
    marked = np.ones(count, np.bool_)
    for k, p in enumerate(parts):
        if not p.marked.all():
            marked &= p.marked[states[:, k]]
    return Exploration(
        alphabet,
        states,
        found.start[: count + 1],
        found.event[:edges],
        found.target[:edges],
        marked,
        found.bad[:count],
        found.offers[:count],
    )


def _sizes(parts: Sequence[Automaton]) -> str:
    """Return the names and sizes of the parts; of many, those of the largest."""
    named = {k: f"{part.name or f'part {k}'} ({part.n_states})" for k, part in enumerate(parts)}
    largest = sorted(named, key=lambda k: -parts[k].n_states)[:_NAMED]
    more = f" and {len(named) - _NAMED} smaller ones" if len(named) > _NAMED else ""
    return ", ".join(named[k] for k in sorted(largest)) + more


class _Found:
    """The arrays that exploring fills; ``done`` counts states explored, states found, and edges."""

    def __init__(self, events: int, words: int, room: int, *, hashed: bool) -> None:
        self.events = events
        self.done = np.array([0, 1, 0])
        room += 2 * events
        self.slots = np.zeros((1 << (4 * events).bit_length() + 10 if hashed else 1, words + 1), np.int64)
        self.keys = np.zeros((room, words), np.int64)
        self.start = np.zeros(room + 1, np.int64)
        self.bad, self.offers = np.zeros(room, np.bool_), np.zeros(room, np.bool_)
        self.event, self.target = np.empty(4 * room, np.int32), np.empty(4 * room, np.int32)
        self.hashed = hashed
        if hashed:
            self.slots[find_row(self.slots, self.keys[0]), 0] = 1

    def make_room(self) -> None:
        """Double what the next state may not fit."""
        _, count, edges = self.done.tolist()
        if count + self.events > len(self.keys):
            room = 2 * len(self.keys)
            self.keys = _grown(self.keys, room)
            self.start = _grown(self.start, room + 1)
            self.bad, self.offers = _grown(self.bad, room), _grown(self.offers, room)
        if edges + self.events > len(self.event):
            room = 2 * len(self.event)
            self.event, self.target = _grown(self.event, room), _grown(self.target, room)
        if self.hashed and 2 * (count + self.events) > len(self.slots):
            self.slots = rehash_rows(self.slots)

    def arrays(self) -> tuple[Longs, Longs, Longs, Bools, Bools, Ints, Ints]:
        """Return the arrays in the kernel's order."""
        return self.slots, self.keys, self.start, self.bad, self.offers, self.event, self.target


def _grown(array: NDArray[Any], room: int) -> NDArray[Any]:
    """Return ``array`` with zeros behind it, ``room`` entries in all."""
    wider = np.zeros((room, *array.shape[1:]), array.dtype)
    wider[: len(array)] = array
    return wider


def _nothing(alphabet: Alphabet, parts: int) -> Exploration:
    none, no = np.empty(0, np.int32), np.empty(0, np.bool_)
    return Exploration(
        alphabet, np.empty((0, parts), np.int32), np.zeros(1, np.int64), none, none, no, no, no
    )


def _packing(sizes: Sequence[int]) -> tuple[Longs, Longs, Longs]:
    """Return in which integer of a key each part lies, how far up, and the mask of its bits."""
    place, shift, word, used = [], [], 0, 0
    widths = [max(size - 1, 1).bit_length() for size in sizes]
    for width in widths:
        if used + width > _BITS:
            word, used = word + 1, 0
        place.append(word)
        shift.append(used)
        used += width
    masks = [(1 << width) - 1 for width in widths]
    return np.array(place, np.int64), np.array(shift, np.int64), np.array(masks, np.int64)


def _possible(alphabet: Alphabet, part: Automaton) -> Longs:
    """Return which events ``part`` can follow, or does not know, in each state; ``[S, blocks]``."""
    column = np.full(len(alphabet), NONE, np.int32)
    column[[alphabet.index(name) for name in part.alphabet]] = np.arange(len(part.alphabet))
    packed = np.zeros((part.n_states, -(-len(alphabet) // _kernels.BLOCK)), np.int64)
    _kernels.pack(part.delta, column, packed)
    return packed


def _pack(events: Bools) -> Longs:
    """Return a set of events, ``bool [E]``, as integers of `BLOCK` bits each."""
    row = np.where(events, np.int32(0), np.int32(NONE))[None]
    packed: Longs = np.zeros((1, -(-len(events) // _kernels.BLOCK)), np.int64)
    _kernels.pack(row, np.arange(len(events), dtype=np.int32), packed)
    return packed.reshape(-1)


def _participants(alphabet: Alphabet, parts: Sequence[Automaton]) -> tuple[Longs, Ints, Ints]:
    """For every event the parts that move by it and its column in each, as one sparse table."""
    pairs = [
        [(k, part.alphabet.index(name)) for k, part in enumerate(parts) if name in part.alphabet]
        for name in alphabet
    ]
    start = np.cumsum([0, *map(len, pairs)], dtype=np.int64)
    flat = np.array([pair for row in pairs for pair in row], np.int32).reshape(-1, 2)
    return start, flat[:, 0].copy(), flat[:, 1].copy()

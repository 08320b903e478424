"""What an action does on the pick-up and delivery grid, one state at a time.

`intended` is what an action does by itself, `fall` what d_u does, which may pre-empt any action that is
possible.  `_tables` says the same of all states at once, out of the same tables.
"""

from __future__ import annotations

from typing import Final, Literal, TypeAlias

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.envs._grid import HEADS, MOVE, MOVES, POSES, START, cell_at
from supremal.envs._loads import (
    AFTER,
    ALL,
    CARRIES,
    EVENT_CELL,
    FALLEN,
    FRESH,
    IN_ORDER,
    ITEMS,
    LOADS,
    RECOVERY,
    SETTLED,
)

Preset: TypeAlias = Literal["default", "published"]

ALPHABET: Final = Alphabet((*MOVES, "p1", "p2", "p3", "d1", "d2", "d3", "d_u"), frozenset({"d_u"}))
ACTIONS: Final = {"default": ALPHABET.names[:-1], "published": MOVES}
PROPOSITIONS: Final = ("i1", "i2", "i3", "S")
"""Item k is carried; the agent is at S."""
STATES: Final = len(LOADS) * POSES

FALL: Final = ALPHABET.index("d_u")
PAIR: Final = len(ALPHABET)  # where the words (move, p_i) begin
START_CELL: Final = cell_at(*START)
WORDS: Final = (
    *((event,) for event in range(len(ALPHABET))),
    *((move, len(MOVES) + item) for move in range(len(MOVES)) for item in ITEMS),
)
"""All words of both presets, as event numbers: each event alone, then a move with what it picks up."""
SPELLED: Final = tuple(ALPHABET.spell(word) for word in WORDS)


def is_complete(state: int) -> bool:
    """Tell whether the agent is at S with all three items."""
    load, pose = divmod(state, POSES)
    return load in (ALL, FRESH) and pose // HEADS == START_CELL


def is_over(preset: Preset, state: int) -> bool:
    """Tell whether an episode ends in ``state``."""
    return is_complete(state) or (preset == "published" and not IN_ORDER[state // POSES])


def label_of(state: int) -> int:
    """Return the propositions true in ``state``, as bits."""
    load, pose = divmod(state, POSES)
    return CARRIES[load] | (pose // HEADS == START_CELL) << len(ITEMS)


def fall(state: int) -> tuple[int, int] | None:
    """Return the state and the word after d_u, None where nothing can fall."""
    load, pose = divmod(state, POSES)
    return (FALLEN[pose // HEADS] * POSES + pose, FALL) if load == ALL else None


def intended(preset: Preset, state: int, action: int) -> tuple[int, int] | None:
    """Return the state and the word after ``action``, None where it is not possible."""
    if is_over(preset, state):
        return None
    load, pose = divmod(state, POSES)
    if preset == "published":
        return _by_program(load, pose, action)
    if action >= len(MOVES):
        event = action - len(MOVES)
        if EVENT_CELL[load][event] != pose // HEADS:
            return None
        return AFTER[load][event] * POSES + pose, action
    after = MOVE[pose][action]
    return None if after == NONE else (SETTLED[load] * POSES + after, action)


def _by_program(load: int, pose: int, action: int) -> tuple[int, int] | None:
    """`intended` as in the published program: it recovers by itself, and picks up on arrival."""
    event = RECOVERY[load]
    if event != NONE:
        return AFTER[load][event] * POSES + pose, len(MOVES) + event
    after = MOVE[pose][action]
    if after == NONE:
        return None
    load = SETTLED[load]
    for item in ITEMS:
        if EVENT_CELL[load][item] == after // HEADS:
            return AFTER[load][item] * POSES + after, PAIR + action * len(ITEMS) + item
    return load * POSES + after, action

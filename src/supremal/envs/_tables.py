"""What actions do on the pick-up and delivery grid, in all states at once.

`intended_table` is `_dynamics.intended` by array operations; `tabulate` adds d_u and keeps the states that
can be reached.
"""

from __future__ import annotations

from functools import cache
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs, frozen
from supremal._graph import of_table, search
from supremal.decisions.mdp import TabularMDP
from supremal.envs._dynamics import (
    ACTIONS,
    ALPHABET,
    FALL,
    PAIR,
    PROPOSITIONS,
    START_CELL,
    STATES,
    WORDS,
    Preset,
)
from supremal.envs._grid import HEADS, MOVE, MOVES, POSES
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

_LOADS, _MOVES, _ITEMS = len(LOADS), len(MOVES), len(ITEMS)
_POSE: Final[Ints] = np.arange(POSES, dtype=np.int32)
_CELL: Final[Ints] = _POSE // HEADS
_MOVE: Final[Ints] = np.array(MOVE, np.int32)
_AFTER: Final[Ints] = np.array(AFTER, np.int32)
_EVENT_CELL: Final[Ints] = np.array(EVENT_CELL, np.int32)
_SETTLED: Final[Ints] = np.array(SETTLED, np.int32)
_RECOVERY: Final[Ints] = np.array(RECOVERY, np.int32)


@cache
def intended_table(preset: Preset) -> tuple[Ints, Ints]:
    """Return the state and the word after each action in each state, ``int32 [S, A]``, `NONE` where none."""
    state, word = _moved()
    if preset == "published":
        state, word = _recover(*_arrive(state, word))
    else:
        state = np.concatenate([state, _handled()], axis=2)
        word = np.arange(state.shape[2], dtype=np.int32)
    shape = STATES, state.shape[2]
    possible = ~over_table(preset)[:, None] & (state.reshape(shape) != NONE)
    word = np.broadcast_to(word, state.shape).reshape(shape)
    return (
        frozen(np.where(possible, state.reshape(shape), NONE), np.int32, 2),
        frozen(np.where(possible, word, NONE), np.int32, 2),
    )


def _moved() -> tuple[Ints, Ints]:
    """Return the states after l, r, f, b, ``[loads, poses, 4]``, and the words, which are the moves."""
    state = np.where(_MOVE == NONE, NONE, _SETTLED[:, None, None] * POSES + _MOVE)
    return state, np.arange(_MOVES, dtype=np.int32)


def _handled() -> Ints:
    """Return the states after p1, p2, p3, d1, d2, d3, ``[loads, poses, 6]``."""
    possible = _EVENT_CELL[:, None, :] == _CELL[:, None]
    return np.where(possible, _AFTER[:, None, :] * POSES + _POSE[:, None], NONE)


def _arrive(state: Ints, word: Ints) -> tuple[Ints, Ints]:
    """Pick up what lies where a move leads."""
    for item in ITEMS:
        where = _EVENT_CELL[_SETTLED, item][:, None, None]
        found = (_MOVE != NONE) & (where == _MOVE // HEADS)
        state = np.where(found, _AFTER[_SETTLED, item][:, None, None] * POSES + _MOVE, state)
        word = np.where(found, PAIR + np.arange(_MOVES, dtype=np.int32) * _ITEMS + item, word)
    return state, word


def _recover(state: Ints, word: Ints) -> tuple[Ints, Ints]:
    """Go on with the recovery of the program, whatever is chosen."""
    after = _AFTER[np.arange(_LOADS), _RECOVERY]
    here = after[:, None, None] * POSES + _POSE[:, None]
    event = _RECOVERY[:, None, None]
    return np.where(event == NONE, state, here), np.where(event == NONE, word, _MOVES + event)


def complete_table() -> Bools:
    """Return `is_complete` of every state, ``bool [S]``."""
    table = np.zeros((_LOADS, POSES), np.bool_)
    table[[ALL, FRESH]] = _CELL == START_CELL
    return table.reshape(-1)


def over_table(preset: Preset) -> Bools:
    """Return `is_over` of every state, ``bool [S]``."""
    over = complete_table()
    if preset == "published":
        over |= np.repeat(~np.array(IN_ORDER), POSES)
    return over


def fall_table() -> Ints:
    """Return the state after d_u in every state, ``int32 [S]``, `NONE` where nothing can fall."""
    table = np.full((_LOADS, POSES), NONE, np.int32)
    table[ALL] = np.array(FALLEN)[_CELL] * POSES + _POSE
    return table.reshape(-1)


def label_table() -> Longs:
    """Return `label_of` every state, ``int64 [S]``."""
    at_start = (_CELL == START_CELL).astype(np.int64)
    table: Longs = np.array(CARRIES, np.int64)[:, None] | at_start << _ITEMS
    return table.reshape(-1)


def tabulate(preset: Preset, risk: float, start: int) -> TabularMDP:
    """Return the grid with drop probability ``risk`` as a table of the states reachable from ``start``."""
    meant, word = intended_table(preset)
    falls = (fall_table() if risk else np.full(STATES, NONE, np.int32))[:, None]
    falls = np.where(meant != NONE, falls, NONE)  # d_u pre-empts an action that is possible
    stays = np.where((falls != NONE) & (risk == 1), NONE, meant)
    order = _reached(np.concatenate([stays, falls], axis=1), start)
    number = np.full(STATES, NONE, np.int32)
    number[order] = np.arange(len(order))

    answers = [stays[order], falls[order]]
    both = (answers[0] != NONE) & (answers[1] != NONE)
    happens = np.stack([answer != NONE for answer in answers], axis=2)
    share = np.stack([np.where(both, 1 - risk, 1.0), np.where(both, risk, 1.0)], axis=2)
    said = np.stack([word[order], np.full_like(both, FALL, np.int32)], axis=2)[happens]
    used = np.flatnonzero(np.bincount(said, minlength=len(WORDS)))
    return TabularMDP(
        actions=ACTIONS[preset],
        alphabet=ALPHABET,
        propositions=PROPOSITIONS,
        words=tuple(WORDS[w] for w in used),
        row=np.append(0, np.cumsum(happens[:, :, 0] + happens[:, :, 1].astype(np.int64))),
        next_state=number[np.stack(answers, axis=2)[happens]],
        prob=share[happens],
        reward=np.zeros(len(said)),
        word=np.searchsorted(used, said).astype(np.int32),
        terminal=over_table(preset)[order],
        marked=complete_table()[order],
        label=label_table()[order],
        initial=(order == start).astype(np.float64),
        origin=order[:, None],
    )


def _reached(edges: Ints, start: int) -> Ints:
    """Return the states that ``edges`` (``[S, K]``) lead to from ``start``, nearest first."""
    seeds = np.zeros(STATES, np.bool_)
    seeds[start] = True
    order, _ = search(*of_table(np.ascontiguousarray(edges)), seeds, np.ones(STATES, np.bool_))
    return order

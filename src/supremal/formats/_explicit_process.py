"""From what a model checker stores to a `TabularMDP`.

What a file does not say is filled in: a word is the action of its choice, unless branches have words of their
own; an event that no action is called as is uncontrollable; and where no label says where episodes end, they
end in the states that every choice stays in at no reward, so that no value changes.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal.automata.alphabet import Alphabet
from supremal.decisions.mdp import TabularMDP
from supremal.errors import FormatError
from supremal.formats._explicit import BROKEN, DEADLOCK, GOAL, INIT, RESERVED, ROUNDED, TERMINAL, Explicit
from supremal.formats._names import unique
from supremal.formats.model import size_problem

_STEP: Final = "step"
_MOST_LABELS: Final = 63
_EXACT: Final = 1e-9


def to_process(model: Explicit, path: str) -> TabularMDP:
    """Return ``model``, which was read from ``path``, as a decision process; states keep their numbers.

    Linear in the model, up to sorting the choices of each state by their actions.

    Raises
    ------
    FormatError
        If the model does not start in one state, or there are too many labels, or states and actions.
    MDPError
        If probabilities do not sum to 1.
    """
    none = np.zeros(model.n_states, np.bool_)
    initial = model.labels.get(INIT, none)
    if initial.sum() != 1:
        message = f"{initial.sum()} states have the label {INIT!r}; one has to, the state that all starts in"
        raise FormatError(message, path=path)
    stays = np.logical_and.reduceat(model.target == model.state_of[model.choice_of], model.branch[:-1])
    idle = np.logical_and.reduceat(stays & (model.gain == 0), model.choice[:-1])
    terminal = model.labels.get(TERMINAL, idle)
    kept = np.flatnonzero(~(terminal | idle & model.labels.get(DEADLOCK, none))[model.state_of])
    names, action = _distinct_actions(model, kept)
    problem = size_problem(model.n_states, len(names))
    if problem:
        raise FormatError(problem.replace("events", "actions"), path=path)
    row, taken = _arranged(model, kept, model.state_of[kept] * len(names) + action, len(names))
    if model.words:
        words, word = model.words, model.word[taken]
    else:
        words = tuple((event,) for event in unique("_".join(name.split()) or _STEP for name in names))
        word = np.repeat(np.arange(len(row) - 1) % max(len(names), 1), np.diff(row))
    alphabet = _alphabet(names, words)
    propositions, label = _label(model, path)
    return TabularMDP(
        actions=names,
        alphabet=alphabet,
        propositions=propositions,
        words=tuple(tuple(alphabet.index(event) for event in events) for events in words),
        row=row,
        next_state=model.target[taken],
        prob=_normalised(model)[taken],
        reward=model.reward[taken],
        word=word,
        terminal=terminal,
        marked=model.labels.get(GOAL, terminal),
        label=label,
        initial=initial.astype(np.float64),
        origin=_origin(model),
    )


def _label(model: Explicit, path: str) -> tuple[tuple[str, ...], Longs]:
    """Return the propositions, and those true in each state as bits."""
    propositions = tuple(name for name in model.labels if name not in RESERVED)
    if len(propositions) > _MOST_LABELS:
        message = f"{len(propositions)} labels; at most {_MOST_LABELS} are read"
        raise FormatError(message, path=path)
    label = np.zeros(model.n_states, np.int64)
    for i, name in enumerate(propositions):
        label |= model.labels[name].astype(np.int64) << i
    return propositions, label


def _arranged(model: Explicit, kept: Longs, slot: Longs, actions: int) -> tuple[Longs, Longs]:
    """Return where the outcomes of each slot, a state and an action, begin, and which branches they are."""
    order = np.argsort(slot)
    length = np.diff(model.branch)[kept[order]]
    counts = np.zeros(model.n_states * actions, np.int64)
    counts[slot[order]] = length
    row = np.append(0, np.cumsum(counts))
    begin = model.branch[kept[order]] - (np.cumsum(length) - length)
    return row, np.arange(row[-1]) + np.repeat(begin, length)


def _distinct_actions(model: Explicit, kept: Longs) -> tuple[tuple[str, ...], Longs]:
    """Return names of actions, and one for each of the ``kept`` choices, in each state distinct.

    Where a state has several choices with the same action, the later ones get numbers behind their names.
    """
    size = len(model.actions)
    key = model.state_of[kept] * size + model.action[kept]
    order = np.argsort(key, kind="stable")
    first = np.append(True, np.diff(key[order]) > 0)[: key.size]
    at = np.arange(key.size)
    again = np.empty(key.size, np.int64)
    again[order] = at - np.maximum.accumulate(np.where(first, at, 0))
    used, action = np.unique(again * size + model.action[kept], return_inverse=True)
    names = unique(model.actions[k % size] or _STEP for k in used.tolist())
    return tuple(names), action


def _alphabet(names: tuple[str, ...], words: tuple[tuple[str, ...], ...]) -> Alphabet:
    """Return the events of ``words``, those first that are called as an action."""
    occurring = dict.fromkeys(event for word in words for event in word)
    own = [name for name in names if name in occurring]
    others = [event for event in occurring if event not in set(own)]
    return Alphabet((*own, *others), uncontrollable=frozenset(others))


def _normalised(model: Explicit) -> Floats:
    """Return the probabilities, divided by their sums where those are off by no more than rounding."""
    sums = np.add.reduceat(model.prob, model.branch[:-1])
    off = np.abs(sums - 1)
    divisor = np.where((off > _EXACT) & (off <= ROUNDED), sums, 1.0)
    prob: Floats = model.prob / np.repeat(divisor, np.diff(model.branch))
    return prob


def _origin(model: Explicit) -> Ints:
    """Return the parts that states are made of; what is only known to be broken has `NONE` for a part."""
    if model.origin is not None:
        return model.origin
    at = np.arange(model.n_states, dtype=np.int32)[:, None]
    broken: Bools | None = model.labels.get(BROKEN)
    if broken is None or not broken.any():
        return at
    return np.hstack([at, np.where(broken, NONE, 0).astype(np.int32)[:, None]])

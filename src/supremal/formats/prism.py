r"""Models of PRISM in its explicit format: a ``.tra`` file, and others beside it with the same stem.

========= =============================================== ==============================================
``.tra``  "states choices branches", then "0 1 2 0.5 go"  state, choice, target, probability, action
``.lab``  ``0="init" 1="deadlock"``, then "0: 0"          state: labels
``.sta``  "(part0,part1)", then "0:(0,0)"                 state: what it is made of; not read
``.trew`` "states choices rewards", then "0 1 2 -1.0"     state, choice, target, reward
``.srew`` "states rewards", then "0 -1.0"                 state, reward; read, and not written
========= =============================================== ==============================================

Markov chains have neither choices nor actions.  The reward of a branch is the expected one of the outcomes
that lead to its target; those that are 0 are left out.  White space and quotes in names are
escaped.  Words of events have no place.

Storm reads the same columns with headers of its own; give it ``.umb`` or ``.drn``.

Source: the PRISM manual, appendix "Explicit Model Files".
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import islice
from operator import itemgetter
from pathlib import Path
from typing import Final

import numpy as np

from supremal._arrays import Longs
from supremal.formats._explicit import DEADLOCK, INIT, Explicit, merged
from supremal.formats._explicit_text import MAX_STATE, Gathered, probability, real
from supremal.formats._names import EMPTY, escape, unescape
from supremal.formats._page import Page, Word, decode, shown, words
from supremal.formats.model import MAX_BYTES, read_bytes

_BAD: Final = re.compile(r'[\s"\x00-\x1f\x7f]')
_CHUNK: Final = 1 << 16
_OF_CHOICE: Final = re.compile(r"\s*([0-9]{1,8})\s+([0-9]{1,8})\s+([0-9]{1,8})\s+(\S+)(?:\s+(\S+))?\s*")
_OF_CHAIN: Final = re.compile(r"\s*([0-9]{1,8})()\s+([0-9]{1,8})\s+(\S+)(?:\s+(\S+))?\s*")
_LABEL: Final = re.compile(r'([0-9]{1,4})="([^"]*)"')
_HELD: Final = re.compile(r"([0-9]{1,8}): ?([0-9 ]*)")


def write(model: Explicit) -> dict[str, Iterator[str]]:
    """Return the texts of the files, each in pieces."""
    model = merged(model)
    return {
        ".tra": _blocks(_transitions(model)),
        ".lab": _blocks(_labels(model)),
        ".sta": _blocks(_states(model)),
        ".trew": _blocks(_rewards(model)),
    }


def _blocks(lines: Iterator[str]) -> Iterator[str]:
    while block := list(islice(lines, _CHUNK)):
        yield "\n".join(block) + "\n"


def _places(model: Explicit, which: Longs) -> Iterator[str]:
    """Give state, choice and target of some branches, as far as the model has them."""
    choice = model.choice_of[which]
    state = model.state_of[choice]
    local = (choice - model.choice[state]).tolist()
    ends = model.target[which].tolist()
    if model.chain:
        return (f"{s} {t}" for s, t in zip(state.tolist(), ends, strict=True))
    return (f"{s} {k} {t}" for s, k, t in zip(state.tolist(), local, ends, strict=True))


def _sizes(model: Explicit, branches: int) -> str:
    return " ".join(map(str, [model.n_states, *([] if model.chain else [len(model.action)]), branches]))


def _transitions(model: Explicit) -> Iterator[str]:
    size = len(model.target)
    yield _sizes(model, size)
    tails = ["" if model.chain else f" {_name(name)}" for name in model.actions]
    columns = (_places(model, np.arange(size)), model.prob.tolist(), model.action[model.choice_of].tolist())
    for place, p, a in zip(*columns, strict=True):
        yield f"{place} {p!r}{tails[a]}"


def _rewards(model: Explicit) -> Iterator[str]:
    paid = np.flatnonzero(model.reward)
    yield _sizes(model, paid.size)
    for place, r in zip(_places(model, paid), model.reward[paid].tolist(), strict=True):
        yield f"{place} {r!r}"


def _labels(model: Explicit) -> Iterator[str]:
    names = [INIT, DEADLOCK, *(name for name in model.labels if name not in (INIT, DEADLOCK))]
    yield " ".join(f'{i}="{_name(name)}"' for i, name in enumerate(names))
    held = np.full(model.n_states, "", object)
    for i, name in enumerate(names):
        held[model.labels[name]] += f" {i}"
    for s in np.flatnonzero(held != "").tolist():
        yield f"{s}:{held[s]}"


def _states(model: Explicit) -> Iterator[str]:
    origin = model.origin if model.origin is not None else np.arange(model.n_states)[:, None]
    yield f"({','.join(f'part{k}' for k in range(origin.shape[1]))})"
    for s, parts in enumerate(origin.tolist()):
        yield f"{s}:({','.join(map(str, parts))})"


def _name(name: str) -> str:
    return escape(name, _BAD) or EMPTY


def read(path: Path) -> Explicit:
    """Return the model in a ``.tra`` file, and in those beside it that are there."""
    page = _Table(path)
    sizes = page.sizes
    if len(sizes) not in (2, 3):
        page.fail("the first line has to be the numbers of states, choices (unless a chain) and branches")
    states, chain = page.number(sizes[0], "the number of states", MAX_STATE), len(sizes) == 2
    model, last, seen = Gathered(chain=chain), (-1, 0), set[int]()
    reward_of = _rewards_of(path, states, chain=chain)
    lines = sorted(page.branches(states, chain=chain), key=itemgetter(0, 1))
    for state, choice, target, number, action, where in lines:
        if (state, choice) != last:
            if (state, choice) not in ((last[0], last[1] + 1), (last[0] + 1, 0)):
                page.fail(f"the one before choice {choice} of state {state} is missing", where)
            model.open(state, unescape(action))
            last, seen = (state, choice), set()
        if target in seen:
            page.fail(f"choice {choice} of state {state} leads to state {target} twice", where)
        seen.add(target)
        model.branch(target, probability(page, number, where), reward_of(state, choice, target))
    if last[0] != states - 1:
        page.fail(f"state {last[0] + 1} has no choice; one that ends needs one that stays there")
    found = [states, len(model.target)] if chain else [states, len(model.state), len(model.target)]
    if [word.text for word in sizes] != list(map(str, found)):
        page.fail(f"the file has {' '.join(map(str, found))} states, choices and branches", sizes[0].where)
    model.labels = _read_labels(path.with_suffix(".lab"), states)
    return model.explicit(states)


class _Table(Page):
    """A page of lines of numbers, the first of which has sizes; lines that begin with # are comments."""

    def __init__(self, path: Path) -> None:
        page = decode(read_bytes(path, MAX_BYTES), str(path))
        super().__init__(page.path, page.text)
        self.rows = (line for line in self.lines() if line.text.strip() and line.text[0] != "#")
        self.sizes = words(next(self.rows, Word("", 0)))

    def branches(self, states: int, *, chain: bool) -> Iterator[tuple[int, int, int, str, str, int]]:
        """Give state, choice, target, number, action and place of every line."""
        form = _OF_CHAIN if chain else _OF_CHOICE
        for line in self.rows:
            found = form.fullmatch(line.text)
            if found is None:
                what = "state, target and number" if chain else "state, choice, target and number"
                self.fail(f"{shown(line.text)} is no line with {what}", line.where)
            state, choice, target, number, action = found.groups(default="")
            if max(int(state), int(target)) >= states:
                self.fail(f"{shown(line.text)} has a state above the last, {states - 1}", line.where)
            yield int(state), int(choice or 0), int(target), number, action, line.where


def _rewards_of(path: Path, states: int, *, chain: bool) -> Callable[[int, int, int], float]:
    """Return the reward of a state, a choice and a target, as the files of rewards say."""
    of_state: dict[int, float] = {}
    of_branch: dict[tuple[int, int, int], float] = {}
    if path.with_suffix(".srew").exists():
        page = _Table(path.with_suffix(".srew"))
        for row in map(words, page.rows):
            if len(row) != 2:
                page.fail("a line has a state and its reward", row[0].where)
            state = page.number(row[0], "a state", states - 1)
            of_state[state] = real(page, row[1].text, row[1].where, "a reward")
    if path.with_suffix(".trew").exists():
        page = _Table(path.with_suffix(".trew"))
        for state, choice, target, number, _, where in page.branches(states, chain=chain):
            of_branch[state, choice, target] = real(page, number, where, "a reward")
    return lambda s, k, t: of_state.get(s, 0.0) + of_branch.get((s, k, t), 0.0)


def _read_labels(path: Path, states: int) -> dict[str, list[int]]:
    """Return the states of each label; without a file, state 0 is the one that starts."""
    if not path.exists():
        return {INIT: [0]}
    page = decode(read_bytes(path, MAX_BYTES), str(path))
    lines = (line for line in page.lines() if line.text.strip() and not line.text.startswith("#"))
    head = next(lines, Word("", 0))
    labels: dict[str, list[int]] = {}
    numbers: dict[str, str] = {}
    for word in words(head):
        found = _LABEL.fullmatch(word.text)
        if found is None or found[1] in numbers or unescape(found[2]) in labels:
            page.fail(f'{shown(word.text)} is no label of its own like 0="init"', word.where)
        numbers[found[1]] = unescape(found[2])
        labels[numbers[found[1]]] = []
    for line in lines:
        held = _HELD.fullmatch(line.text.rstrip())
        if held is None:
            page.fail(f"{shown(line.text)} is no line like '0: 1 2', a state and its labels", line.where)
        state = page.number(Word(held[1], line.where), "a state", states - 1)
        for number in held[2].split():
            if number not in numbers:
                page.fail(f"label {number} is none of the first line", line.where + held.start(2))
            labels[numbers[number]].append(state)
    return labels

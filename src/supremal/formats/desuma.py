r"""Automata of DESUMA and UMDES, ``.fsm``.

::

    3                       the number of states
    idle    1   1           state, 1 where it is marked and 0 where not, number of its transitions
    start   busy    c   o   event, next state, c or uc, o or uo
    busy    0   1
    end     idle    uc  o
    lost    0   0
    EVENTS                  those that no transition has
    fail    uc  uo

Words are kept apart by blanks.  The first state is the initial one.  An event is controllable and observable
where nothing else is said.  The file says no name; its own is taken.  In a name of a state, blanks are
written as ``\u{20}``.

Source: *UMDES Software Library File Formats*, University of Michigan, https://wiki.eecs.umich.edu/desuma.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePath
from typing import Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.formats._draft import Draft
from supremal.formats._names import EMPTY, escape, state_names, unescape
from supremal.formats._page import Page, Word, decode, shown, words
from supremal.formats.model import MAX_STATES, Model

_FLAGS: Final = ("c", "uc", "o", "uo")
_BLANK: Final = re.compile(r"\s")


def read(raw: bytes, path: str) -> Model:
    """Return the automaton in a file, as a plant."""
    page = decode(raw, path)
    lines = [line for line in map(words, page.lines()) if line]
    if not lines or len(lines[0]) != 1:
        page.fail("the first line is to be the number of states, and nothing else", 0)
    count = page.number(lines[0][0], "the number of states", MAX_STATES)
    draft = Draft(page, PurePath(path).stem)
    reader = _Reader(page, draft)
    later: list[tuple[int, list[Word]]] = []
    here = 1
    for _ in range(count):
        if here == len(lines):
            page.fail(f"the file ends after {len(draft.states)} of {count} states", len(page.text))
        state, transitions = reader.state(lines[here])
        begin, here = here + 1, here + 1 + transitions
        if here > len(lines):
            page.fail(
                f"the file ends before the {transitions} transitions of this state", lines[begin - 1][0].where
            )
        later += [(state, line) for line in lines[begin:here]]
    for state, line in later:
        reader.transition(state, line)
    if here < len(lines) and [word.text for word in lines[here]] != ["EVENTS"]:
        page.fail("after the last state, only a line EVENTS may follow", lines[here][0].where)
    for line in lines[here + 1 :]:
        reader.event(line[0], line[1:])
    draft.initial = 0 if count else None
    return Model((draft.automaton(),), ())


class _Reader:
    """Reads the lines of a page."""

    def __init__(self, page: Page, draft: Draft) -> None:
        self.page, self.draft = page, draft

    def state(self, line: list[Word]) -> tuple[int, int]:
        """Add a state; return its number, and how many transitions follow."""
        if len(line) != 3:
            self.page.fail(
                f"a state has {len(line)} words; three are needed: its name, 1 or 0, its transitions",
                line[0].where,
            )
        state = self.draft.state(unescape(line[0].text), line[0].where)
        if self.page.number(line[1], "the marking of a state", 1):
            self.draft.marked.add(state)
        return state, self.page.number(line[2], "the number of transitions", 999_999_999)

    def transition(self, state: int, line: list[Word]) -> None:
        """Add a transition."""
        if len(line) < 2:
            self.page.fail("a transition has two words at least: event and next state", line[0].where)
        event = self.event(line[0], line[2:])
        self.draft.edge(
            state, event, self.draft.find_state(unescape(line[1].text), line[1].where), line[0].where
        )

    def event(self, word: Word, flags: list[Word]) -> int:
        """Add an event, or check that the flags say of it what they have said before."""
        for flag in flags:
            if flag.text not in _FLAGS:
                known = ", ".join(_FLAGS)
                self.page.fail(f"{shown(flag.text)} is no property of an event; known: {known}", flag.where)
        texts = {flag.text for flag in flags}
        if len(flags) > 2 or {"c", "uc"} <= texts or {"o", "uo"} <= texts:
            self.page.fail("one of c and uc and one of o and uo are all that is needed", flags[0].where)
        draft, name = self.draft, word.text
        controllable, observable = "uc" not in texts, "uo" not in texts
        if name not in draft.events:
            return draft.event(name, word.where, controllable=controllable, observable=observable)
        if (controllable, observable) != (name not in draft.uncontrollable, name not in draft.unobservable):
            self.page.fail(f"event {shown(name)} has other properties here than before", word.where)
        return draft.events[name]


def write(model: Model) -> list[str]:
    r"""Return a text for each automaton of ``model``, the plants before the specifications.

    Examples
    --------
    >>> from supremal import from_text
    >>> light = from_text("name light\ndark -on-> lit\nlit -off-> dark")
    >>> write(Model((light,), ()))
    ['2\n\ndark\t1\t1\non\tlit\tc\to\n\nlit\t1\t1\noff\tdark\tc\to\n']
    """
    return ["\n".join(_lines(part)) + "\n" for part in (*model.plants, *model.specs)]


def lacks(model: Model) -> list[str]:
    """Say what of ``model`` the format cannot hold."""
    parts = (*model.plants, *model.specs)
    blanks = any(_BLANK.search(name) for part in parts for name in state_names(part))
    return ["the names of automata (files have them)"] + (
        ["blanks in names (they are escaped)"] if blanks else []
    )


def _flags(sigma: Alphabet, event: str) -> str:
    return f"{'uc' if event in sigma.uncontrollable else 'c'}\t{'uo' if event in sigma.unobservable else 'o'}"


def _lines(part: Automaton) -> Iterator[str]:
    sigma = part.alphabet
    states = [escape(name, _BLANK) or EMPTY for name in state_names(part)]
    flags = [_flags(sigma, event) for event in sigma]
    yield str(part.n_states)
    for s, name in enumerate(states):
        possible = np.flatnonzero(part.delta[s] != NONE)
        yield from ["", f"{name}\t{int(part.marked[s])}\t{possible.size}"]
        for e in possible:
            yield f"{sigma.names[e]}\t{states[part.delta[s, e]]}\t{flags[e]}"
    unused = [event for e, event in enumerate(sigma) if not (part.delta[:, e] != NONE).any()]
    if unused:
        yield from ["", "EVENTS", *(f"{event}\t{_flags(sigma, event)}" for event in unused)]

"""Reading one automaton of the HOA format: its header, its states, and what the two make together."""

from __future__ import annotations

from typing import Final

import numpy as np

from supremal._arrays import Ints
from supremal.automata.automaton import Automaton
from supremal.errors import AutomatonError
from supremal.formats._draft import Draft
from supremal.formats._hoa_tokens import MAX_PROPOSITIONS, Token, Tokens
from supremal.formats._names import unique
from supremal.formats._page import shown
from supremal.formats.model import MAX_STATES, size_problem

MAX_TRANSITIONS: Final = 10_000_000
"""The most transitions of an automaton that is read: a label as short as ``[t]`` is one for every event."""

ALL: Final = "0 t"
"""Acceptance of every run: all states are marked."""

MARKED: Final = "1 Inf ( 0 )"
"""Acceptance by a set of states: the marked ones, where words are finite."""


class Reader:
    """Reads the automaton that begins with the next of ``tokens``."""

    def __init__(self, tokens: Tokens) -> None:
        self.tokens, self.page = tokens, tokens.page
        tokens.aliases = {}
        self.begin = tokens.now.where
        self.role, self.name, self.acceptance, self.finite = "plant", "", "", False
        self.count: int | None = None
        self.initial: int | None = None
        self.propositions: list[str] = []
        self.listed: dict[str, set[int]] = {}
        self.names: dict[int, str | None] = {}
        self.marked: set[int] = set()
        self.edges: list[tuple[int, int, int, int]] = []  # source, label, target, where

    def automaton(self) -> Automaton:
        """Return the automaton."""
        self._header()
        if self.acceptance != ALL and not (self.acceptance == MARKED and self.finite):
            self.page.fail(
                f"the acceptance is {shown(self.acceptance)}, which is about infinite words; '0 t' is read, "
                "and '1 Inf(0)' where 'finite-words: t' says that set 0 holds the marked states",
                self.begin,
            )
        while self.tokens.has("header", "State:"):
            self._state()
        self.tokens.take("mark", "--END--", "'State:', an edge or --END--")
        return self._built()

    def _header(self) -> None:
        tokens = self.tokens
        tokens.take("header", "HOA:", "'HOA:', with which every automaton begins,")
        tokens.take("word", "v1", "the version v1")
        seen: set[str] = set()
        while not tokens.has("mark", "--BODY--"):
            if not tokens.has("header"):
                tokens.wrong("a header item or --BODY--")
            token = tokens.get()
            if token.text in seen and token.text not in {"Alias:", "properties:"}:
                self.page.fail(f"{token.text!r} stands twice; one is read", token.where)
            seen.add(token.text)
            self._item(token, token.text[:-1])
        tokens.get()

    def _item(self, token: Token, name: str) -> None:
        tokens = self.tokens
        match name:
            case "States":
                self.count = tokens.number("the number of states", MAX_STATES)
            case "Start":
                self.initial = self._one_state()
            case "AP":
                number = tokens.number("the number of propositions", MAX_PROPOSITIONS)
                self.propositions = [tokens.take("string", None, "a proposition") for _ in range(number)]
            case "Alias":
                alias = tokens.take("alias", None, "an alias")
                if alias in tokens.aliases:
                    self.page.fail(f"alias {shown('@' + alias)} is defined twice", token.where)
                tokens.aliases[alias] = tokens.either()
            case "name":
                self.name = tokens.take("string", None, "a name in quotes")
            case "role":
                self.role = tokens.take("word", None, "plant or spec")
                if self.role not in {"plant", "spec"}:
                    self.page.fail(f"the role is {shown(self.role)}; plant or spec is needed", token.where)
            case "controllable-AP" | "unobservable-AP":
                numbers = self.listed.setdefault(name, set())
                while tokens.has("number"):
                    numbers.add(tokens.number("a proposition", MAX_PROPOSITIONS - 1))
            case "Acceptance":
                self.acceptance = " ".join(self._rest())
            case "finite-words":
                self.finite = self._rest() == ["t"]
            case _ if name[0].isupper():
                self.page.fail(f"{token.text!r} changes the meaning, and is not known", token.where)
            case _:
                self._rest()

    def _rest(self) -> list[str]:
        """Return what a header item says, up to the next one."""
        said = []
        while self.tokens.now.kind not in {"", "header", "mark"}:
            said.append(self.tokens.get().text)
        return said

    def _one_state(self) -> int:
        state = self.tokens.number("a state", MAX_STATES)
        if self.tokens.has("sign", "&"):
            self.page.fail("a conjunction of states is beyond deterministic automata", self.tokens.now.where)
        return state

    def _sets(self) -> set[int]:
        """Return the acceptance sets that may follow."""
        sets: set[int] = set()
        if self.tokens.has("sign", "{"):
            self.tokens.get()
            while not self.tokens.has("sign", "}"):
                sets.add(self.tokens.number("an acceptance set or '}'", MAX_STATES))
            self.tokens.get()
        return sets

    def _state(self) -> None:
        tokens = self.tokens
        where = tokens.get().where
        if tokens.has("sign", "["):
            self.page.fail("a label on a state is not read; label its edges", tokens.now.where)
        state = tokens.number("a state", MAX_STATES)
        if state in self.names:
            self.page.fail(f"state {state} stands twice", where)
        self.names[state] = tokens.get().text if tokens.has("string") else None
        if 0 in self._sets() or self.acceptance == ALL:
            self.marked.add(state)
        while tokens.has("sign", "[") or tokens.has("number"):
            where = tokens.now.where
            if tokens.has("number"):
                self.page.fail("an edge without a label is not read; label it", where)
            label = tokens.label()
            self.edges.append((state, label, self._one_state(), where))
            if self._sets():
                self.page.fail("an acceptance set on an edge is not read; sets of states are", where)

    def _built(self) -> Automaton:
        draft = Draft(self.page, self.name)
        hidden = self.listed.get("unobservable-AP", set())
        free = self.listed.get("controllable-AP", range(len(self.propositions)))
        for e, name in enumerate(self.propositions):
            draft.event(name, self.begin, controllable=e in free, observable=e not in hidden)
        count = self._check_states()
        names = [self.names[s] for s in range(count)]
        is_named = any(name is not None for name in names)
        called = unique(str(s) if name is None else name for s, name in enumerate(names)) if is_named else ()
        draft.number_states(count, called)
        draft.initial, draft.marked = self.initial, self.marked
        self._add_edges(draft)
        return draft.automaton()

    def _check_states(self) -> int:
        """Return the number of states, each of which has to be listed."""
        ends = [(target, where) for _, _, target, where in self.edges]
        ends += [(state, self.begin) for state in (*self.names, self.initial) if state is not None]
        count = max((state + 1 for state, _ in ends), default=0) if self.count is None else self.count
        for state, where in ends:
            if state >= count or state not in self.names:
                self.page.fail(f"state {state} is not one of the {count} that are listed", where)
        if len(self.names) < count:
            missing = next(s for s in range(count) if s not in self.names)
            self.page.fail(f"there are to be {count} states, and state {missing} is not listed", self.begin)
        problem = size_problem(count, len(self.propositions))
        if problem:
            self.page.fail(problem, self.begin)
        return count

    def _add_edges(self, draft: Draft) -> None:
        """Add a transition for every event at which a label is true."""
        everything = (1 << len(self.propositions)) - 1
        labelled: dict[int, int] = {}
        total = 0
        for source, label, target, where in self.edges:
            if label >= 0 and label > everything:
                self.page.fail(
                    f"a label names a proposition beyond the {len(self.propositions)} of AP", where
                )
            events = label & everything
            if events & labelled.get(source, 0):
                message = (
                    f"{self.page.at(where)}: automaton {self.name!r} is not deterministic: two edges of "
                    f"state {source} have one event; keep one of the two"
                )
                raise AutomatonError(message)
            labelled[source] = labelled.get(source, 0) | events
            total += events.bit_count()
            if total > MAX_TRANSITIONS:
                self.page.fail(f"more than {MAX_TRANSITIONS:,} transitions, the most that are read", where)
            if events.bit_count() == 1:
                draft.edge(source, events.bit_length() - 1, target, where)
            elif events:
                draft.edges(source, _members(events), target, where)


def _members(events: int) -> Ints:
    """Return the numbers of the bits that are set."""
    raw = np.frombuffer(events.to_bytes(events.bit_length() // 8 + 1, "little"), np.uint8)
    return np.flatnonzero(np.unpackbits(raw, bitorder="little")).astype(np.int32)

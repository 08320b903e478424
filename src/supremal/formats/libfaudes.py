r"""Generators of libFAUDES, ``.gen``.

::

    <Generator name="MACH1" ftype="System">
    <Alphabet>     "start" +C+ "end" "fail" +o+         </Alphabet>
    <States>       "I" "W" <Consecutive> 3 9 </Consecutive> </States>
    <TransRel>     "I" "start" "W"   "W" "end" "I"      </TransRel>
    <InitStates>   "I"                                  </InitStates>
    <MarkedStates> "I"                                  </MarkedStates>
    </Generator>

A token is a word or stands in quotes; ``%`` before one starts a comment.  A number without quotes is the
index of a state, counted from 1.  An event is not controllable, but observable, unless ``+C+``, ``+o+``,
``+Co+`` or a number in base 16 behind it (bit 0: controllable, bit 1: observable) say otherwise.  A generator
without initial state is the empty automaton.  Several generators stand in a ``<SystemVector>``; those in one
that is called ``specs`` are specifications, all others are plants.

A name in libFAUDES is of visible ASCII characters other than ``"`` and ``#``; others are written as
``\u{...}``, with their number in base 16.

Source: the native file format of libFAUDES (Moor, Schmidt, Perk, "libFAUDES - an open source C++ library for
discrete event systems", WODES 2008; https://fgdes.tf.fau.de).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.automaton import Automaton
from supremal.formats._draft import Draft
from supremal.formats._faudes_tokens import WORDS, Token, Tokens, quoted
from supremal.formats._names import EMPTY, escape, state_names, unescape
from supremal.formats._page import Page, Word, decode
from supremal.formats.model import MAX_STATES, Model

_SHORT: Final = {"A": "Alphabet", "S": "States", "T": "TransRel", "I": "InitStates", "M": "MarkedStates"}
_HEX: Final = re.compile(r"0x[0-9a-fA-F]{1,8}")
_INDEX: Final = re.compile(r"[0-9]{1,9}")
_BAD: Final = re.compile(r'[^!-~]|["#]')
_CONTROL: Final = re.compile(r"[^ -~]")
_RANGES: Final = 3 * MAX_STATES
_SPECS: Final = "specs"


def read(raw: bytes, path: str) -> Model:
    """Return the generators of a file."""
    reader = _Reader(decode(raw, path))
    plants: list[Automaton] = []
    specs: list[Automaton] = []
    token = reader.tokens.get()
    if not token.kind:
        reader.wrong(token, "<Generator>")
    while token.kind:
        if token.kind == "begin" and token.text == "Generator":
            plants.append(reader.generator(token))
        elif token.kind == "begin" and token.text.endswith("Vector"):
            group = specs if token.attributes.get("name") == _SPECS else plants
            group += reader.vector(token)
        else:
            reader.wrong(token, "<Generator> or <SystemVector>")
        token = reader.tokens.get()
    return Model(tuple(plants), tuple(specs))


class _Reader:
    """Reads the generators of a file."""

    def __init__(self, page: Page) -> None:
        self.page, self.tokens = page, Tokens(page)
        self.inside, self.wrong = self.tokens.inside, self.tokens.wrong
        self.state_at: dict[int, int] = {}
        self.given: set[str] = set()  # the sections of the generator that have been read
        self.sections = {
            "Alphabet": self._alphabet,
            "States": self._states,
            "TransRel": self._transrel,
            "InitStates": self._initstates,
            "MarkedStates": self._markedstates,
        }
        self.left = _RANGES  # so that ranges that cost a few bytes cannot take for ever

    def vector(self, begin: Token) -> list[Automaton]:
        """Return the generators of a vector."""
        parts = []
        for token in self.inside(begin.text):
            if (token.kind, token.text) != ("begin", "Generator"):
                self.wrong(token, "<Generator>")
            parts.append(self.generator(token))
        return parts

    def generator(self, begin: Token) -> Automaton:
        """Return the generator whose tag has been read."""
        name = begin.attributes.get("name", "")
        if self.tokens.peek().kind in WORDS:
            name = self.tokens.get().text
        draft = Draft(self.page, unescape(name))
        self.state_at, self.given = {}, set()
        for token in self.inside("Generator"):
            section = _SHORT.get(token.text, token.text)
            if token.kind != "begin" or section not in self.sections:
                self.wrong(token, f"one of <{'>, <'.join(self.sections)}>, which is all that is read,")
            if section in self.given:
                self.page.fail(f"<{token.text}> stands twice in one generator", token.where)
            self.given.add(section)
            self.sections[section](draft, token.text)
        if "TransRel" not in self.given:
            self.page.fail("the generator has no <TransRel>", begin.where)
        return draft.automaton()

    def _alphabet(self, draft: Draft, section: str) -> None:
        last = ""
        for token in self.inside(section):
            flags = _flags(token)
            if flags is None or not last:
                last = self._event(token)
                draft.event(last, token.where, controllable=False)
            else:
                for is_true, names in zip(flags, (draft.uncontrollable, draft.unobservable), strict=True):
                    (names.discard if is_true else names.add)(last)

    def _states(self, draft: Draft, section: str) -> None:
        for indices, token in self._listed(section):
            name = None
            if indices is None:
                text, _, suffix = self._raw(token, "a state").partition("#")
                name = unescape(text)
                first = self._index(suffix, token.where) if suffix else len(draft.states) + 1
                indices = range(first, first + 1)  # noqa: PLW2901 - a name has an index too
            for index in indices:
                if index in self.state_at:
                    self.page.fail(f"state {index} stands twice; name each state once", token.where)
                self.state_at[index] = draft.state(str(index) if name is None else name, token.where)

    def _listed(self, section: str) -> Iterator[tuple[range | None, Token]]:
        """Give what a section lists, with its indices where it has no name; flags are passed over."""
        for token in self.inside(section):
            if (token.kind, token.text) == ("begin", "Consecutive"):
                yield self._range(), token
            elif _is_index(token):
                index = self._index(token.text, token.where)
                yield range(index, index + 1), token
            elif _flags(token) is None:
                yield None, token

    def _range(self) -> range:
        ends = list(self.inside("Consecutive"))
        if len(ends) != 2:
            self.page.fail(f"a range of states has {len(ends)} ends; two are needed", self.tokens.here)
        first, last = (self._index(end.text, end.where) for end in ends)
        self.left -= max(0, last - first)
        if self.left < 0:
            self.page.fail(f"ranges of more than {_RANGES:,} states in all", self.tokens.here)
        return range(first, last + 1)

    def _index(self, text: str, where: int) -> int:
        return self.page.number(Word(text, where), "the index of a state", MAX_STATES)

    def _raw(self, token: Token, what: str) -> str:
        if token.kind not in WORDS:
            self.wrong(token, what)
        return f"+{token.text}+" if token.kind == "option" else token.text

    def _event(self, token: Token) -> str:
        return unescape(self._raw(token, "an event"))

    def _find(self, draft: Draft, token: Token) -> int:
        """Return the number of a state, by its index or its name; add it where <States> was left out."""
        if _is_index(token):
            return self._find_index(draft, self._index(token.text, token.where), token.where)
        name = unescape(self._raw(token, "a state").partition("#")[0])
        if "States" not in self.given and name not in draft.states:
            return draft.state(name, token.where)
        return draft.find_state(name, token.where)

    def _find_index(self, draft: Draft, index: int, where: int) -> int:
        if index not in self.state_at:
            if "States" in self.given:
                self.page.fail(f"unknown state {index}", where)
            self.state_at[index] = draft.state(str(index), where)
        return self.state_at[index]

    def _members(self, draft: Draft, section: str) -> Iterator[tuple[int, int]]:
        """Give the numbers of the states that a section lists, and where it does."""
        for indices, token in self._listed(section):
            if indices is None:
                yield self._find(draft, token), token.where
            else:
                yield from ((self._find_index(draft, index, token.where), token.where) for index in indices)

    def _transrel(self, draft: Draft, section: str) -> None:
        tokens = [token for token in self.inside(section) if token.kind == "option" or _flags(token) is None]
        triple: list[Token] = []
        for token in tokens:
            if token.kind == "option" and len(triple) != 1:
                continue  # a flag of the transition before
            triple.append(token)
            if len(triple) == 3:
                event = self._event(triple[1])
                if "Alphabet" not in self.given and event not in draft.events:
                    draft.event(event, controllable=False)
                source, target = self._find(draft, triple[0]), self._find(draft, triple[2])
                number = draft.find_event(event, triple[1].where)
                draft.edge(source, number, target, triple[0].where)
                triple = []
        if triple:
            self.page.fail("a transition is of three parts: state, event, state", triple[0].where)

    def _initstates(self, draft: Draft, section: str) -> None:
        for state, where in self._members(draft, section):
            draft.start(state, where)

    def _markedstates(self, draft: Draft, section: str) -> None:
        draft.marked.update(state for state, _ in self._members(draft, section))


def _is_index(token: Token) -> bool:
    return token.kind == "plain" and _INDEX.fullmatch(token.text) is not None


def _flags(token: Token) -> tuple[bool, bool] | None:
    """Return whether flags behind a name say controllable and observable; None where they are no flags."""
    if token.kind == "option":
        return "C" in token.text, "o" not in token.text
    if token.kind == "plain" and _HEX.fullmatch(token.text):
        bits = int(token.text, 16)
        return bool(bits & 1), bool(bits & 2)
    return None


def write(model: Model) -> str:
    r"""Return ``model`` as generators: one as it stands, several in a vector of plants and one of specs.

    Examples
    --------
    >>> from supremal import from_text
    >>> light = from_text("name light\ndark -on-> lit\nlit -off-> dark")
    >>> print(write(Model((light,), ())).splitlines()[0])
    <Generator name="light" ftype="System">
    """
    return "\n".join(_lines(model)) + "\n"


def lacks(model: Model) -> list[str]:
    """Say what of ``model`` the format cannot hold."""
    parts = (*model.plants, *model.specs)
    names = [name for part in parts for name in (*part.alphabet, *state_names(part))]
    return ["names that are not plain ASCII words (they are escaped)"] if any(map(_BAD.search, names)) else []


def _lines(model: Model) -> Iterator[str]:
    if len(model.plants) == 1 and not model.specs:
        yield from _generator(model.plants[0])
        return
    for name, parts in (("plants", model.plants), (_SPECS, model.specs)):
        yield f'<SystemVector name="{name}">'
        for part in parts:
            yield from _generator(part)
        yield "</SystemVector>"


def _quoted(name: str) -> str:
    return quoted(escape(name, _BAD) or EMPTY)


def _generator(part: Automaton) -> Iterator[str]:
    sigma, states = part.alphabet, [_quoted(name) for name in state_names(part)]
    yield f'<Generator name={quoted(escape(part.name, _CONTROL))} ftype="System">'
    yield "<Alphabet>"
    for event in sigma:
        flags = ("" if event in sigma.uncontrollable else "C") + ("o" if event in sigma.unobservable else "")
        yield f"{_quoted(event)} +{flags}+" if flags else _quoted(event)
    yield "</Alphabet>"
    yield from ["<States>", *states, "</States>", "<TransRel>"]
    events = [_quoted(event) for event in sigma]
    for s, e in np.argwhere(part.delta != NONE).tolist():
        yield f"{states[s]} {events[e]} {states[part.delta[s, e]]}"
    yield from ["</TransRel>", "<InitStates>", *states[:1], "</InitStates>", "<MarkedStates>"]
    yield from (states[s] for s in np.flatnonzero(part.marked))
    yield "</MarkedStates>"
    yield "</Generator>"

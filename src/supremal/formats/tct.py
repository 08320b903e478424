"""Automata of TCT, ``.ads``: everything is a number.

::

    # a comment
    MACH1
    State size (State set will be (0,1....,size-1)):
    3
    Marker states:
    0
    Vocal states:
    Transitions:
    0 11 1
    1 10 0

State 0 is the initial one; ``*`` marks all states; a transition is (from, event, to).  An event is a number
from 0 to 9999, controllable where it is odd, and its automaton knows those that occur.  Vocal states are
refused.

Where all events of a model are such numbers they are written as they stand.  Else controllable events are
numbered 1, 3, 5, ... and uncontrollable ones 2, 4, 6, ..., and comments say what the numbers mean::

    # supremal: name "machine 1"
    # supremal: event 1 "start"
    # supremal: event 2 "break" unobservable
    # supremal: state 0 "idle"

TCT passes over them, and writes files without them; they are read back here, if they are there.

Source: W. M. Wonham, K. Cai, *Supervisory Control of Discrete-Event Systems*, Springer, 2019, and the TCT
software that goes with it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import union
from supremal.automata.automaton import Automaton
from supremal.errors import FormatError
from supremal.formats._draft import Draft
from supremal.formats._names import state_names, unique
from supremal.formats._page import Page, Word, decode, shown, words
from supremal.formats.model import MAX_STATES, Model

MAX_EVENT: Final = 9999

_HEAD: Final = re.compile(
    r"\s*+(state size|marker states|vocal states|transitions)\s*+(\(.*\))?\s*+:", re.IGNORECASE
)
_SAID: Final = re.compile(
    r"#\s*+supremal:\s*+(name|event|state)\s++(?:([0-9]{1,9})\s++)?(\".*\")\s*+(unobservable)?\s*+"
)
_TITLE: Final = re.compile(r"[^0-9A-Za-z_.-]+")


def read(raw: bytes, path: str) -> Model:
    """Return the automaton in a file, as a plant."""
    page = decode(raw, path)
    sections: dict[str, list[Word]] = {}
    section, said = sections.setdefault("", []), _Said(page)
    for line in page.lines():
        if line.text.lstrip().startswith("#"):
            said.read(line)
            continue
        head = _HEAD.match(line.text)
        if head is None:
            section += words(line)
            continue
        name = head[1].lower()
        if name in sections:
            page.fail(f"{head[1]!r} stands twice; keep one of the two", line.where)
        section = sections.setdefault(name, words(Word(line.text[head.end() :], line.where + head.end())))
    for needed in ("state size", "transitions"):
        if needed not in sections:
            page.fail(f"the file has no line '{needed.capitalize()}:'")
    return Model((_automaton(page, sections, said),), ())


class _Said:
    """What comments say about numbers."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.name: str | None = None
        self.names: dict[str, dict[int, str]] = {"event": {}, "state": {}}
        self.unobservable: set[int] = set()
        self.taken: set[tuple[str, str]] = set()

    def read(self, line: Word) -> None:
        """Read a comment, which need not say anything."""
        found = _SAID.fullmatch(line.text.strip())
        if found is None:
            return
        kind, number, text, unobservable = found.groups()
        try:
            name = json.loads(text)
            name.encode()
        except ValueError:
            self.page.fail(f"{shown(text)} is no name in quotes", line.where)
        if kind == "name":
            self.name = name
            return
        if (kind, name) in self.taken:
            self.page.fail(f"the name {shown(name)} stands for two numbers; name each on its own", line.where)
        self.taken.add((kind, name))
        most = MAX_STATES if kind == "state" else MAX_EVENT
        value = self.page.number(Word(number or "", line.where), f"what {shown(name)} stands for", most)
        self.names[kind][value] = name
        if unobservable:
            self.unobservable.add(value)


def _automaton(page: Page, sections: Mapping[str, list[Word]], said: _Said) -> Automaton:
    title = " ".join(word.text for word in sections.get("", []))
    draft = Draft(page, title if said.name is None else said.name)
    size = sections["state size"]
    if len(size) != 1:
        page.fail(f"'State size' gives {len(size)} numbers; one is needed", size[1].where if size else -1)
    count = page.number(size[0], "the state size", MAX_STATES)
    named = said.names["state"]
    draft.number_states(count, unique(named.get(s, str(s)) for s in range(count)) if named else ())
    draft.initial = 0 if count else None

    def state(word: Word) -> int:
        return page.number(word, "a state", count - 1)

    for word in sections.get("marker states", []):
        draft.marked.update(range(count) if word.text == "*" else [state(word)])
    for word in sections.get("vocal states", [])[:1]:
        page.fail(
            "a vocal state has an output, which plain automata do not have; leave the list blank", word.where
        )
    triples = sections["transitions"]
    if len(triples) % 3:
        page.fail("a transition is of three numbers: from, event, to", triples[-1].where)
    numbers = [page.number(word, "an event", MAX_EVENT) for word in triples[1::3]]
    events = _events(draft, dict.fromkeys([*said.names["event"], *numbers]), said)
    for k, number in enumerate(numbers):
        source, target = triples[3 * k], triples[3 * k + 2]
        draft.edge(state(source), events[number], state(target), source.where)
    return draft.automaton()


def _events(draft: Draft, numbers: Mapping[int, None], said: _Said) -> dict[int, int]:
    """Add the events; those that comments name come first."""
    names = unique(said.names["event"].get(number, str(number)) for number in numbers)
    return {
        number: draft.event(name, controllable=number % 2 == 1, observable=number not in said.unobservable)
        for number, name in zip(numbers, names, strict=True)
    }


def numbering(model: Model) -> dict[str, int]:
    """Return the number of every event.

    Raises
    ------
    FormatError
        If there are more events than numbers.

    Examples
    --------
    >>> from supremal import Alphabet, universal
    >>> numbering(Model((universal(Alphabet(("start", "end"), frozenset({"end"}))),), ()))
    {'start': 1, 'end': 2}
    """
    sigma = union(*(part.alphabet for part in (*model.plants, *model.specs)))
    if all(_is_number(name, controllable=name not in sigma.uncontrollable) for name in sigma):
        return {name: int(name) for name in sigma}
    following = {True: 1, False: 2}
    numbers: dict[str, int] = {}
    for name in sigma:
        controllable = name not in sigma.uncontrollable
        numbers[name] = following[controllable]
        following[controllable] += 2
    if max(numbers.values()) > MAX_EVENT:
        message = f"TCT has numbers for events up to {MAX_EVENT}, and this model has {len(numbers)} events"
        raise FormatError(message, path="<model>")
    return numbers


def _is_number(name: str, *, controllable: bool) -> bool:
    return re.fullmatch(r"0|[1-9][0-9]{0,3}", name) is not None and int(name) % 2 == controllable


def write(model: Model) -> list[str]:
    r"""Return a text for each automaton of ``model``, the plants before the specifications.

    Examples
    --------
    >>> from supremal import from_text
    >>> light = from_text("name light\ndark -on-> lit\nlit -off-> dark")
    >>> print(*write(Model((light,), ()))[0].splitlines()[-3:], sep="\n")
    Transitions:
    0 1 1
    1 3 0
    """
    numbers = numbering(model)
    parts = (*model.plants, *model.specs)
    return ["\n".join(_lines(part, numbers)) + "\n" for part in parts]


def lacks(model: Model) -> list[str]:
    """Say what of ``model`` TCT has no place for."""
    parts = (*model.plants, *model.specs)
    problems = []
    if any(str(number) != name for name, number in numbering(model).items()):
        problems.append("names of events")
    if any(part.state_names for part in parts):
        problems.append("names of states")
    if any(part.alphabet.unobservable for part in parts):
        problems.append("observability")
    if problems:
        problems[-1] += " (comments hold what is lost to TCT)"
    if any(not _occurring(part).all() for part in parts):
        problems.append("events that are blocked everywhere")
    return problems


def _occurring(part: Automaton) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return which events have a transition."""
    return np.asarray((part.delta != NONE).any(axis=0))


def _lines(part: Automaton, numbers: Mapping[str, int]) -> Iterator[str]:
    title = _TITLE.sub("_", part.name) or "automaton"
    yield from ["# CTCT ADS", ""]
    if title != part.name:
        yield f"# supremal: name {json.dumps(part.name)}"
    occurs = _occurring(part)
    numbered = {name: number for name, number in numbers.items() if name in part.alphabet}
    if any(str(number) != name for name, number in numbered.items()) or not occurs.all():
        for name in part.alphabet:
            hidden = " unobservable" if name in part.alphabet.unobservable else ""
            yield f"# supremal: event {numbers[name]} {json.dumps(name)}{hidden}"
    if part.state_names:
        for s, name in enumerate(state_names(part)):
            yield f"# supremal: state {s} {json.dumps(name)}"
    yield from [title, "", "State size (State set will be (0,1....,size-1)):", str(part.n_states), ""]
    marked = np.flatnonzero(part.marked)
    yield from ["Marker states:", *map(str, marked), "", "Vocal states:", "", "Transitions:"]
    for s, e in np.argwhere(part.delta != NONE).tolist():
        yield f"{s} {numbers[part.alphabet.names[e]]} {part.delta[s, e]}"

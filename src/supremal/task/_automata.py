"""Events and automata in a task file: written there, or in a model file beside it."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, TypeVar

from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.build import from_text, from_transitions
from supremal.errors import suggest
from supremal.formats import Model, read_model
from supremal.formats.model import size_problem
from supremal.task._fields import (
    Field,
    Reader,
    called,
    check_keys,
    choose,
    distinct,
    event,
    event_of,
    name,
    one_of,
    shown,
    take,
)
from supremal.task._slips import placed, placed_in

T = TypeVar("T")
DRAWN: Final = ("transitions", "initial", "marked")
"""The keys of an automaton that is written in the task file itself."""


def read_events(field: Field) -> Alphabet:
    """Read ``[events]``."""
    check_keys(field, ("controllable", "uncontrollable"))
    free: tuple[str, ...] = take(field, "controllable", distinct(event), ())
    forced: tuple[str, ...] = take(field, "uncontrollable", distinct(event), ())
    both = set(free).intersection(forced)
    for k, element in enumerate(forced):
        if element in both:
            field["uncontrollable"][k].fail(f"{element!r} is among the controllable ones too; name it once")
    if not free and not forced:
        field.fail("names no event; controllable = [...] or uncontrollable = [...] is needed", key=True)
    return Alphabet((*free, *forced), frozenset(forced))


def read_plants(field: Field, known: Alphabet | None, folder: Path) -> tuple[Automaton, ...]:
    """Read one ``[[plant]]``; ``known`` are the events of ``[events]``, where they are given."""
    if choose(field, ("file", "transitions"), ("name", *DRAWN)) == "transitions":
        check_keys(field, ("name", *DRAWN))
        return (read_drawn(field, known),)
    check_keys(field, ("name", "file"))
    plants = read_model_file(field["file"], folder).plants
    if not plants:
        field["file"].fail("has specifications only; give it as the file of a [[rule]]")
    return tuple(settle(field["file"], plant, known) for plant in named(field, plants))


# --- in a file --------------------------------------------------------------------------------------------


def path_of(field: Field, folder: Path) -> Path:
    """Read the path of a file or folder that is there, relative to ``folder``, that of the task file."""
    path = folder / name(field)
    try:
        if path.is_file() or path.is_dir():
            if path.samefile(field.document.path):
                field.fail("is this task file itself; give another file")
            return path
    except OSError as error:
        field.fail(f"cannot read {shown(field.value)}: {error.strerror}")
    return field.fail(f"there is no file {shown(field.value)}; paths start from the folder of the task file")


def read_model_file(field: Field, folder: Path) -> Model:
    """Read the model file that a field names."""
    return in_file(field, path_of(field, folder), read_model)


def in_file(field: Field, path: Path, read: Callable[[Path], T]) -> T:
    """Return what ``read`` finds in the file that a field names; what is wrong there is told here too."""
    try:
        with placed(field):
            return read(path)
    except OSError as error:
        return field.fail(f"cannot read {path}: {error.strerror}")


def named(field: Field, automata: Sequence[Automaton]) -> tuple[Automaton, ...]:
    """Return ``automata``; where there is one, it has the name that a table may give it."""
    if "name" not in field:
        return tuple(automata)
    if len(automata) != 1:
        field["name"].fail(f"the file has {len(automata)} automata, which keep their own names; leave it out")
    return (replace(automata[0], name=called(field)),)


# --- in the task file -------------------------------------------------------------------------------------


def read_drawn(field: Field, known: Alphabet | None) -> Automaton:
    """Read the automaton that a table draws by its ``transitions``: arrows in a text, or a list."""
    rows = field["transitions"]
    if not isinstance(rows.value, str):
        return settle(rows, _listed(field, known), known)
    for key in DRAWN[1:]:
        if key in field:
            field[key].fail(
                f"goes with a list of transitions; write a line '{key} ...' in the text", key=True
            )
    with placed_in(rows):
        automaton = from_text(rows.value, path=rows.name)
    return settle(rows, replace(automaton, name=called(field, automaton.name)), known)


def _listed(field: Field, known: Alphabet | None) -> Automaton:
    triples = [_triple(row, event_of(known)) for row in field["transitions"].elements()]
    alphabet = Alphabet(tuple(dict.fromkeys(middle for _, middle, _ in triples)))
    states = dict.fromkeys(state for triple in triples for state in triple[::2])
    problem = size_problem(len(states), len(alphabet))
    if problem:
        field["transitions"].fail(problem)
    state = one_of(states) if states else name
    initial, marked = take(field, "initial", state, None), take(field, "marked", distinct(state), None)
    with placed(field):
        return from_transitions(alphabet, triples, initial=initial, marked=marked, name=called(field))


def _triple(row: Field, read_event: Reader[str]) -> tuple[str, str, str]:
    if not isinstance(row.value, list) or len(row.value) != 3:
        row.wrong("[from, event, to]")
    return name(row[0]), read_event(row[1]), name(row[2])


def settle(field: Field, automaton: Automaton, known: Alphabet | None) -> Automaton:
    """Return ``automaton`` with its events controllable or not as the ``known`` ones are.

    What is drawn here need not say that an event is uncontrollable.  A file does say it of every event, so it
    has to say the same.
    """
    own = automaton.alphabet
    if known is None:
        return automaton
    agree(field, own, known, silent=field.path[-1] == "transitions")
    forced = known.uncontrollable.intersection(own)
    return replace(automaton, alphabet=Alphabet(own.names, forced, own.unobservable))


def agree(field: Field, own: Alphabet, known: Alphabet, *, silent: bool = False) -> None:
    """Check that all events are ``known``, and as controllable there, if their own text is not ``silent``."""
    for word in own:
        if word not in known:
            field.fail(f"unknown event {word!r}; {suggest(word, known)}", at=_find(word, field))
        here, there = (_control(word, sigma) for sigma in (own, known))
        if here != there and not (silent and here == "controllable"):
            field.fail(f"event {word!r} is {here} here and {there} in the task; say the same of it in both")


def _control(word: str, alphabet: Alphabet) -> str:
    return "uncontrollable" if word in alphabet.uncontrollable else "controllable"


def _find(word: str, field: Field) -> int | None:
    """Return where an event stands in a text of arrows."""
    if field.path[-1] != "transitions" or not isinstance(field.value, str):
        return None
    found = re.search(rf"(?<![^\s,-]){re.escape(word)}(?![^\s,-])", field.value)
    return found.start() if found else None

"""Supremal's own documents: automata, models of several automata, and reward machines, as JSON.

One automaton in a file::

    {"name": "light", "events": {"on": {"controllable": true}, "off": {"controllable": true}},
     "states": ["dark", "lit"], "initial": "dark", "marked": ["dark"],
     "transitions": [["dark", "on", "lit"], ["lit", "off", "dark"]]}

An event that cannot be seen says ``"observable": false`` besides.  A model has one table of ``events``, and
lists of automata, ``plants`` and ``specs``, in each of which ``events`` is a list of names.  A reward machine
has ``propositions``, and ``edges`` [from, guard, to, reward], in place of events, states and transitions.

All of them may say more about themselves in ``title``, ``source``, ``description``, ``params``,
``supervisor`` and ``note``.  Any other key is an error: it is most likely a slip of the pen, which would
otherwise change the meaning in silence.  A document is data: nothing in it is run.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.resources.abc import Traversable
from os import PathLike
from pathlib import Path
from typing import Any, Final, NamedTuple, NoReturn, TypeAlias

from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.build import from_transitions
from supremal.decisions.reward_machine import Edge, RewardMachine, reward_machine
from supremal.errors import FormatError, ModelError, suggest

MAX_BYTES: Final = 64 << 20
"""The largest file that is read: 64 MiB."""

Source: TypeAlias = str | PathLike[str] | Traversable
"""A path, or a file inside a package."""

_ABOUT: Final = ("title", "source", "description", "params", "supervisor", "note")
_AUTOMATON: Final = ("name", "events", "states", "initial", "marked", "transitions")


class Model(NamedTuple):
    """A model: what can happen (``plants``) and what is wanted (``specs``), each the `sync` of its parts."""

    plants: tuple[Automaton, ...]
    specs: tuple[Automaton, ...]


class _WrongError(Exception):
    """What is wrong in a document; `_reading` adds the path."""


def read_automaton(source: Source) -> Automaton:
    """Return the automaton in a file.

    Raises
    ------
    FormatError
        If the file is not JSON (gives line and column) or not laid out as above.
    ModelError
        If what it says makes no automaton; the message begins with the path.
    OSError
        If the file cannot be read.
    """
    with _reading(source) as document:
        return _automaton(document, "the document", _alphabet)


def read_model(source: Source) -> Model:
    """Return the plants and specifications in a file.

    Errors are those of `read_automaton`.
    """
    with _reading(source) as document:
        _check_keys(document, "the document", ("events", "plants"), ("name", "specs", *_ABOUT))
        if "name" in document:
            _text(document["name"], "'name'")
        sigma = _alphabet(document["events"], "'events'")

        def chosen(names: Any, what: str) -> Alphabet:  # noqa: ANN401 - JSON may hold anything
            return _subset(sigma, names, what)

        groups = [
            tuple(
                _automaton(part, f"automaton {k} of {key!r}", chosen)
                for k, part in enumerate(_list(document.get(key, []), repr(key)), 1)
            )
            for key in ("plants", "specs")
        ]
        return Model(*groups)


def read_reward_machine(source: Source) -> RewardMachine:
    """Return the reward machine in a file.

    Errors are those of `read_automaton`; a guard that does not parse is a `FormatError` too.
    """
    with _reading(source) as document:
        _check_keys(document, "the document", ("name", "propositions", "initial", "edges"), _ABOUT)
        name = _text(document["name"], "'name'")
        propositions = _distinct(document["propositions"], f"'propositions' of {name!r}")
        edges = [
            _edge(row, f"edge {k} of {name!r}")
            for k, row in enumerate(_list(document["edges"], f"'edges' of {name!r}"), 1)
        ]
        initial = _text(document["initial"], f"'initial' of {name!r}")
        return reward_machine(list(propositions), edges, initial=initial, name=name)


@contextmanager
def _reading(source: Source) -> Iterator[Any]:
    """Give what the file holds, and put its path in front of what is found wrong with it."""
    path = str(source)
    file = Path(source) if isinstance(source, str | PathLike) else source
    with file.open("rb") as stream:
        raw = stream.read(MAX_BYTES + 1)
    try:
        yield _parse(raw, path)
    except _WrongError as error:
        raise FormatError(str(error), path=path) from None
    except FormatError as error:
        if error.path == path:
            raise
        raise FormatError(str(error), path=path) from None
    except ModelError as error:
        message = f"{path}: {error}"
        raise type(error)(message) from None


def _parse(raw: bytes, path: str) -> Any:  # noqa: ANN401 - JSON may hold anything
    if len(raw) > MAX_BYTES:
        _fail(f"the file is larger than {MAX_BYTES >> 20} MiB, the most that is read; split the model")
    try:
        text = raw.decode("utf-8-sig")
        return json.loads(text, object_pairs_hook=_object, parse_constant=_no_number)
    except UnicodeDecodeError as error:
        _fail(f"byte {error.start} is not UTF-8; save the file in that encoding")
    except json.JSONDecodeError as error:
        message = f"this is not JSON: {error.msg}"
        raise FormatError(message, path=path, line=error.lineno, column=error.colno) from None
    except RecursionError:
        _fail("brackets are nested too deeply for any document of supremal")
    except ValueError:
        _fail("a number has too many digits")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make an object of ``pairs``; JSON itself would let the last of two equal keys win."""
    document = dict(pairs)
    if len(document) != len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for k, key in enumerate(keys) if key in keys[:k])
        _fail(f"key {twice!r} stands twice in one object; keep one of the two")
    return document


def _no_number(text: str) -> NoReturn:
    _fail(f"{text} is no number of JSON; a finite number is needed")


def _fail(message: str) -> NoReturn:
    raise _WrongError(message)


def _shown(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _check_keys(value: object, what: str, needed: Iterable[str], also: Iterable[str]) -> None:
    """Check that ``value`` is an object with all keys of ``needed`` and no others but those of ``also``."""
    if not isinstance(value, dict):
        _fail(f"{what} is {_shown(value)}; an object with the keys {', '.join(needed)} is needed")
    known = (*needed, *also)
    for key in value:
        if key not in known:
            _fail(f"{what} has the unknown key {key!r}; {suggest(key, known)}")
    for key in needed:
        if key not in value:
            _fail(f"{what} has no key {key!r}; {', '.join(needed)} are needed")


def _text(value: object, what: str) -> str:
    if not isinstance(value, str):
        _fail(f"{what} is {_shown(value)}; a string is needed")
    return value


def _list(value: object, what: str) -> list[Any]:
    if not isinstance(value, list):
        _fail(f"{what} is {_shown(value)}; a list is needed")
    return value


def _distinct(value: object, what: str) -> dict[str, None]:
    """Return the names in a list, in order, each of which has to stand there once."""
    names: dict[str, None] = {}
    for name in _list(value, what):
        text = _text(name, f"an entry of {what}")
        if text in names:
            _fail(f"{what} names {text!r} twice; name each once")
        names[text] = None
    return names


def _alphabet(table: Any, what: str) -> Alphabet:  # noqa: ANN401 - JSON may hold anything
    """Return the alphabet of a table: event → what can be done about it."""
    if not isinstance(table, dict):
        _fail(f'{what} is {_shown(table)}; an object like {{"start": {{"controllable": true}}}} is needed')
    for event, says in table.items():
        _check_keys(says, f"event {event!r}", ("controllable",), ("observable",))
        for key, value in says.items():
            if not isinstance(value, bool):
                _fail(f"{key!r} of event {event!r} is {_shown(value)}; true or false is needed")
    return Alphabet(
        tuple(table),
        frozenset(event for event, says in table.items() if not says["controllable"]),
        frozenset(event for event, says in table.items() if not says.get("observable", True)),
    )


def _subset(sigma: Alphabet, names: object, what: str) -> Alphabet:
    """Return those events of ``sigma`` that a list names."""
    chosen = _distinct(names, what)
    for event in chosen:
        if event not in sigma:
            _fail(f"{what} names the unknown event {event!r}; {suggest(event, sigma)}")
    return Alphabet(tuple(chosen), sigma.uncontrollable & chosen.keys(), sigma.unobservable & chosen.keys())


def _automaton(document: Any, what: str, events: Callable[[Any, str], Alphabet]) -> Automaton:  # noqa: ANN401
    """Return the automaton that ``document`` describes; ``events`` reads its alphabet."""
    _check_keys(document, what, _AUTOMATON, _ABOUT)
    name = _text(document["name"], f"'name' of {what}")
    alphabet = events(document["events"], f"'events' of {name!r}")
    states = _distinct(document["states"], f"'states' of {name!r}")
    initial = document["initial"] if not states else _text(document["initial"], f"'initial' of {name!r}")
    if not states and initial is not None:
        _fail(f"'initial' of {name!r} is {_shown(initial)}, but it has no states; null is needed")
    rows = _list(document["transitions"], f"'transitions' of {name!r}")
    return from_transitions(
        alphabet,
        [_transition(row, f"transition {k} of {name!r}", alphabet, states) for k, row in enumerate(rows, 1)],
        initial=initial,
        marked=_distinct(document["marked"], f"'marked' of {name!r}"),
        states=states,
        name=name,
    )


def _transition(row: object, what: str, alphabet: Alphabet, states: dict[str, None]) -> tuple[str, str, str]:
    if not (isinstance(row, list) and len(row) == 3 and all(isinstance(part, str) for part in row)):
        _fail(f"{what} is {_shown(row)}; [from, event, to] is needed")
    source, event, target = row
    for state in (source, target):
        if state not in states:
            _fail(f"{what} has the unknown state {state!r}; {suggest(state, states)}")
    if event not in alphabet:
        _fail(f"{what} has the unknown event {event!r}; {suggest(event, alphabet)}")
    return source, event, target


def _edge(row: object, what: str) -> Edge:
    if isinstance(row, list) and len(row) == 4:
        source, guard, target, reward = row
        is_number = isinstance(reward, int | float) and not isinstance(reward, bool)
        if is_number and abs(reward) < 1e300 and all(isinstance(part, str) for part in row[:3]):
            return Edge(source, guard, target, float(reward))
    _fail(f"{what} is {_shown(row)}; [from, guard, to, reward] with a finite number as reward is needed")

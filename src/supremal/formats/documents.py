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
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import PurePath
from typing import Any, Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet, union
from supremal.automata.automaton import Automaton
from supremal.automata.build import from_transitions
from supremal.decisions.reward_machine import Edge, RewardMachine, reward_machine
from supremal.errors import FormatError, ModelError, suggest
from supremal.formats._json import WrongError, check_keys, distinct, fail, list_of, parse, shown, text_of
from supremal.formats._names import state_names
from supremal.formats.machine_text import read_machine_text
from supremal.formats.model import MAX_BYTES, Model, Source, read_bytes, size_problem

_ABOUT: Final = ("title", "source", "description", "params", "supervisor", "note")
_AUTOMATON: Final = ("name", "events", "states", "initial", "marked", "transitions")


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
    """Return the plants and specifications in a file; one automaton is a model of one plant.

    Errors are those of `read_automaton`.
    """
    return read(read_bytes(source, MAX_BYTES), str(source))


def read(raw: bytes, path: str) -> Model:
    """Return the plants and specifications that a document of these bytes holds."""
    with _checking(path):
        document = parse(raw, path, MAX_BYTES)
        if isinstance(document, dict) and "states" in document and "plants" not in document:
            return Model((_automaton(document, "the document", _alphabet),), ())
        check_keys(document, "the document", ("events", "plants"), ("name", "specs", *_ABOUT))
        if "name" in document:
            text_of(document["name"], "'name'")
        sigma = _alphabet(document["events"], "'events'")

        def chosen(names: Any, what: str) -> Alphabet:  # noqa: ANN401 - JSON may hold anything
            return _subset(sigma, names, what)

        groups = [
            tuple(
                _automaton(part, f"automaton {k} of {key!r}", chosen)
                for k, part in enumerate(list_of(document.get(key, []), repr(key)), 1)
            )
            for key in ("plants", "specs")
        ]
        return Model(*groups)


def read_reward_machine(source: Source) -> RewardMachine:
    """Return the reward machine in a file: a document, or the text of `read_machine_text` in a ``.txt``.

    Errors are those of `read_automaton`; a guard that does not parse is a `FormatError` too.
    """
    if PurePath(str(source)).suffix.lower() == ".txt":
        return read_machine_text(source)
    with _reading(source) as document:
        check_keys(document, "the document", ("name", "propositions", "initial", "edges"), _ABOUT)
        name = text_of(document["name"], "'name'")
        propositions = distinct(document["propositions"], f"'propositions' of {name!r}")
        edges = [
            _edge(row, f"edge {k} of {name!r}")
            for k, row in enumerate(list_of(document["edges"], f"'edges' of {name!r}"), 1)
        ]
        initial = text_of(document["initial"], f"'initial' of {name!r}")
        return reward_machine(list(propositions), edges, initial=initial, name=name)


@contextmanager
def _reading(source: Source) -> Iterator[Any]:
    """Give what the file holds, and put its path in front of what is found wrong with it."""
    raw, path = read_bytes(source, MAX_BYTES), str(source)
    with _checking(path):
        yield parse(raw, path, MAX_BYTES)


@contextmanager
def _checking(path: str) -> Iterator[None]:
    """Put ``path`` in front of what is found wrong with a document."""
    try:
        yield
    except WrongError as error:
        raise FormatError(str(error), path=path) from None
    except FormatError as error:
        if error.path == path:
            raise
        raise FormatError(str(error), path=path) from None
    except ModelError as error:
        message = f"{path}: {error}"
        raise type(error)(message) from None


def _alphabet(table: Any, what: str) -> Alphabet:  # noqa: ANN401 - JSON may hold anything
    """Return the alphabet of a table: event → what can be done about it."""
    if not isinstance(table, dict):
        fail(f'{what} is {shown(table)}; an object like {{"start": {{"controllable": true}}}} is needed')
    for event, says in table.items():
        check_keys(says, f"event {event!r}", ("controllable",), ("observable",))
        for key, value in says.items():
            if not isinstance(value, bool):
                fail(f"{key!r} of event {event!r} is {shown(value)}; true or false is needed")
    return Alphabet(
        tuple(table),
        frozenset(event for event, says in table.items() if not says["controllable"]),
        frozenset(event for event, says in table.items() if not says.get("observable", True)),
    )


def _subset(sigma: Alphabet, names: object, what: str) -> Alphabet:
    """Return those events of ``sigma`` that a list names."""
    chosen = distinct(names, what)
    for event in chosen:
        if event not in sigma:
            fail(f"{what} names the unknown event {event!r}; {suggest(event, sigma)}")
    return Alphabet(tuple(chosen), sigma.uncontrollable & chosen.keys(), sigma.unobservable & chosen.keys())


def _automaton(document: Any, what: str, events: Callable[[Any, str], Alphabet]) -> Automaton:  # noqa: ANN401
    """Return the automaton that ``document`` describes; ``events`` reads its alphabet."""
    check_keys(document, what, _AUTOMATON, _ABOUT)
    name = text_of(document["name"], f"'name' of {what}")
    alphabet = events(document["events"], f"'events' of {name!r}")
    states = distinct(document["states"], f"'states' of {name!r}")
    initial = document["initial"] if not states else text_of(document["initial"], f"'initial' of {name!r}")
    if not states and initial is not None:
        fail(f"'initial' of {name!r} is {shown(initial)}, but it has no states; null is needed")
    problem = size_problem(len(states), len(alphabet))
    if problem:
        fail(f"{name!r}: {problem}")
    rows = list_of(document["transitions"], f"'transitions' of {name!r}")
    return from_transitions(
        alphabet,
        [_transition(row, f"transition {k} of {name!r}", alphabet, states) for k, row in enumerate(rows, 1)],
        initial=initial,
        marked=distinct(document["marked"], f"'marked' of {name!r}"),
        states=states,
        name=name,
    )


def _transition(row: object, what: str, alphabet: Alphabet, states: dict[str, None]) -> tuple[str, str, str]:
    if not (isinstance(row, list) and len(row) == 3 and all(isinstance(part, str) for part in row)):
        fail(f"{what} is {shown(row)}; [from, event, to] is needed")
    source, event, target = row
    for state in (source, target):
        if state not in states:
            fail(f"{what} has the unknown state {state!r}; {suggest(state, states)}")
    if event not in alphabet:
        fail(f"{what} has the unknown event {event!r}; {suggest(event, alphabet)}")
    return source, event, target


def _edge(row: object, what: str) -> Edge:
    if isinstance(row, list) and len(row) == 4:
        source, guard, target, reward = row
        is_number = isinstance(reward, int | float) and not isinstance(reward, bool)
        if is_number and abs(reward) < 1e300 and all(isinstance(part, str) for part in row[:3]):
            return Edge(source, guard, target, float(reward))
    return fail(f"{what} is {shown(row)}; [from, guard, to, reward] with a finite number as reward is needed")


def write(model: Model) -> str:
    r"""Return ``model`` as a document, one transition a line.

    Examples
    --------
    >>> from supremal import from_text
    >>> light = from_text("name light\ndark -on-> lit\nlit -off-> dark")
    >>> print(*write(Model((light,), ())).splitlines()[:4], sep="\n")
    {
      "events": {
        "on": {"controllable": true},
        "off": {"controllable": true}
    """
    sigma = union(*(part.alphabet for part in (*model.plants, *model.specs)))
    events = ",\n".join(f"    {_quoted(name)}: {_properties(sigma, name)}" for name in sigma)
    groups = [
        f'  "{key}": [' + ",".join(map(_text_of, parts)) + ("\n  ]" if parts else "]")
        for key, parts in (("plants", model.plants), ("specs", model.specs))
    ]
    return (
        "{\n"
        + ",\n".join(['  "events": {' + (f"\n{events}\n  }}" if sigma.names else "}"), *groups])
        + "\n}\n"
    )


def _quoted(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)


def _properties(sigma: Alphabet, name: str) -> str:
    says = {"controllable": name not in sigma.uncontrollable}
    return _quoted(says | ({"observable": False} if name in sigma.unobservable else {}))


def _text_of(part: Automaton) -> str:
    states, events = state_names(part), part.alphabet.names
    rows = [
        f"\n        {_quoted([states[s], events[e], states[part.delta[s, e]]])}"
        for s, e in np.argwhere(part.delta != NONE).tolist()
    ]
    says = {
        "name": part.name,
        "events": list(events),
        "states": states,
        "initial": states[0] if states else None,
        "marked": [states[s] for s in np.flatnonzero(part.marked)],
    }
    lines = [f"\n      {_quoted(key)}: {_quoted(value)}," for key, value in says.items()]
    transitions = f'\n      "transitions": [{",".join(rows)}' + ("\n      ]" if rows else "]")
    return "\n    {" + "".join(lines) + transitions + "\n    }"


def lacks(model: Model) -> list[str]:  # noqa: ARG001 - every format is asked the same
    """Say what of ``model`` the format cannot hold: nothing."""
    return []

"""Controllers as JSON, and read back.

One object, with exactly the keys of ``_KEYS``; a state is one line::

    {"state": "busy, empty", "marked": false, "enabled": {"end": 3}, "disabled": {"start": 0}}

``enabled`` has where each event that may happen leads, as the number of a state from 0, the initial one;
``disabled`` the events that the plants could follow and the controller forbids, each with the number of its
reason.  What is read back is checked: names and numbers, the hash of the content, and every test is run.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from itertools import chain
from typing import Any, Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.deploy.controller import Component, Controller, Vector, Why
from supremal.deploy.vectors import find_difference
from supremal.errors import FormatError, ModelError, suggest
from supremal.formats._json import WrongError, check_keys, distinct, fail, list_of, parse, shown, text_of
from supremal.formats.model import MAX_BYTES, Source, read_bytes, size_problem
from supremal.synthesis.supervisor import Supervisor
from supremal.verifier import digest

FORMAT: Final = "supremal-controller"
VERSION: Final = 1

_KEYS: Final = (
    "format", "version", "name", "model", "proved", "events", "uncontrollable", "components", "reasons",
    "tests", "sha256",
)  # fmt: skip
_COMPONENT: Final = ("name", "events", "states")
_STATE: Final = ("state", "marked", "enabled", "disabled")
_WHY: Final = ("kind", "rules", "through", "text")
_TEST: Final = ("word", "ok", "enabled", "marked")


def controller_text(controller: Controller) -> str:
    r"""Return ``controller`` as JSON, one state a line; the same controller gives the same text.

    Examples
    --------
    >>> from supremal import from_text
    >>> from supremal.deploy.build import make_controller
    >>> door = from_text("shut -open-> ajar \n ajar -close-> shut")
    >>> print(*controller_text(make_controller([door], [])).splitlines()[:4], sep="\n")
    {
      "format": "supremal-controller",
      "version": 1,
      "name": "supervisor",
    """
    document = _document(controller)
    document["sha256"] = digest(document)
    return (
        "{\n"
        + ",\n".join(f"  {_quoted(key)}: {_laid_out(key, value)}" for key, value in document.items())
        + "\n}\n"
    )


def _document(c: Controller) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": c.name,
        "model": {"sha256": c.model, "nonblocking": c.asked[0], "must_act": c.asked[1]},
        "proved": {"nonblocking": c.nonblocking, "acts": c.acts, "blocked_after": c.blocked_after},
        "events": list(c.alphabet),
        "uncontrollable": [event for event in c.alphabet if event in c.alphabet.uncontrollable],
        "components": [_component_document(component) for component in c.components],
        "reasons": [why._asdict() for why in c.reasons],
        "tests": [vector._asdict() for vector in c.vectors],
    }


def _component_document(component: Component) -> dict[str, Any]:
    automaton = component.supervisor.automaton
    names = automaton.alphabet.names
    states: list[dict[str, Any]] = [
        {"state": automaton.state_name(s), "marked": bool(marked), "enabled": {}, "disabled": {}}
        for s, marked in enumerate(automaton.marked)
    ]
    for s, e in np.argwhere(automaton.delta != NONE).tolist():
        states[s]["enabled"][names[e]] = int(automaton.delta[s, e])
    for s, e, why in component.disabled.tolist():
        states[s]["disabled"][names[e]] = None if why == NONE else why
    return {"name": component.name, "events": list(names), "states": states}


def _quoted(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)


def _laid_out(key: str, value: Any) -> str:  # noqa: ANN401 - JSON may hold anything
    """Return a value on one line, or a list that can be long with one entry a line."""
    if key == "components":
        return "[" + ",".join(map(_component_text, value)) + "\n  ]"
    if key in ("reasons", "tests") and value:
        return "[" + ",".join(f"\n    {_quoted(entry)}" for entry in value) + "\n  ]"
    return _quoted(value)


def _component_text(component: Mapping[str, Any]) -> str:
    states = ",".join(f"\n        {_quoted(state)}" for state in component["states"])
    return (
        f'\n    {{\n      "name": {_quoted(component["name"])},'
        f'\n      "events": {_quoted(component["events"])},'
        f'\n      "states": [{states}\n      ]\n    }}'
    )


# --- and back ---------------------------------------------------------------------------------------------


def read_controller(source: Source) -> Controller:
    """Return the controller in a file that `controller_text` made.

    Raises
    ------
    FormatError
        If it is not JSON (gives line and column), no controller of this version, says something that makes
        none, was changed after it was written, or does not keep its own tests.
    OSError
        If the file cannot be read.
    """
    raw, path = read_bytes(source, MAX_BYTES), str(source)
    try:
        return _controller(parse(raw, path, MAX_BYTES))
    except (WrongError, ModelError) as error:
        raise FormatError(str(error), path=path) from None


def _controller(document: Any) -> Controller:  # noqa: ANN401 - JSON may hold anything
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        fail(f'this is no controller; an object with "format": "{FORMAT}" is needed')
    if document.get("version") != VERSION:
        fail(f"this is a controller of version {shown(document.get('version'))}; version {VERSION} is needed")
    check_keys(document, "the document", _KEYS, ())
    sigma = _alphabet(document["events"], document["uncontrollable"])
    reasons = tuple(
        _why(row, f"reason {k} of 'reasons'")
        for k, row in enumerate(list_of(document["reasons"], "'reasons'"))
    )
    components = tuple(
        _component(row, f"component {k} of 'components'", sigma, len(reasons))
        for k, row in enumerate(list_of(document["components"], "'components'"), 1)
    )
    silent = set(sigma) - set(chain.from_iterable(c.supervisor.automaton.alphabet for c in components))
    for event in sorted(silent):
        fail(f"no component knows the event {event!r} of 'events'; leave it out")
    tests = list_of(document["tests"], "'tests'")
    check_keys(document["model"], "'model'", ("sha256", "nonblocking", "must_act"), ())
    check_keys(document["proved"], "'proved'", ("nonblocking", "acts", "blocked_after"), ())
    model, proved = document["model"], document["proved"]
    word = proved["blocked_after"]
    controller = Controller(
        name=text_of(document["name"], "'name'"),
        alphabet=sigma,
        components=components,
        reasons=reasons,
        model=text_of(model["sha256"], "'sha256' of 'model'"),
        asked=(
            _truth(model["nonblocking"], "'nonblocking' of 'model'"),
            _truth(model["must_act"], "'must_act' of 'model'"),
        ),
        nonblocking=_known(proved["nonblocking"], "'nonblocking' of 'proved'"),
        acts=_known(proved["acts"], "'acts' of 'proved'"),
        blocked_after=None if word is None else _events(word, "'blocked_after' of 'proved'", sigma),
        vectors=tuple(_vector(row, f"test {k} of 'tests'", sigma) for k, row in enumerate(tests, 1)),
    )
    _check_content(document, controller)
    return controller


def _check_content(document: Mapping[str, Any], controller: Controller) -> None:
    found = digest(document)
    if found != document["sha256"]:
        fail(f"the content has the hash {found}, and 'sha256' is {shown(document['sha256'])}: it was changed")
    difference = find_difference(controller)
    if difference is not None:
        fail(difference)


def _alphabet(names: object, uncontrollable: object) -> Alphabet:
    events = distinct(names, "'events'")
    free = distinct(uncontrollable, "'uncontrollable'")
    return Alphabet(tuple(events), frozenset(_events(list(free), "'uncontrollable'", events)))


def _events(value: object, what: str, known: Alphabet | Mapping[str, Any]) -> tuple[str, ...]:
    """Return the events of a list, all of which have to be ``known``."""
    events = tuple(text_of(event, f"an entry of {what}") for event in list_of(value, what))
    for event in events:
        if event not in known:
            fail(f"{what} names the unknown event {event!r}; {suggest(event, known)}")
    return events


def _truth(value: object, what: str) -> bool:
    if not isinstance(value, bool):
        fail(f"{what} is {shown(value)}; true or false is needed")
    return value


def _known(value: object, what: str) -> bool | None:
    return None if value is None else _truth(value, what)


def _number(value: object, what: str, below: int) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < below:
        fail(f"{what} is {shown(value)}; a whole number from 0 to {below - 1} is needed")
    return value


def _why(row: object, what: str) -> Why:
    check_keys(row, what, _WHY, ())
    said: Mapping[str, Any] = row  # type: ignore[assignment] # an object, as was just checked
    rules, through = (tuple(distinct(said[key], f"{key!r} of {what}")) for key in ("rules", "through"))
    kind, text = (text_of(said[key], f"{key!r} of {what}") for key in ("kind", "text"))
    return Why(kind, rules, through, text)


def _component(row: Any, what: str, sigma: Alphabet, reasons: int) -> Component:  # noqa: ANN401
    """Return the table that an object describes."""
    check_keys(row, what, _COMPONENT, ())
    name = text_of(row["name"], f"'name' of {what}")
    own = _events(list(distinct(row["events"], f"'events' of {what}")), f"'events' of {what}", sigma)
    alphabet = Alphabet(own, sigma.uncontrollable & set(own))
    states = list_of(row["states"], f"'states' of {what}")
    problem = size_problem(len(states), len(own))
    if problem or not states:
        fail(f"{what}: {problem or 'it has no states; at least one is needed'}")
    delta = np.full((len(states), len(own)), NONE, np.int32)
    disabled: list[tuple[int, int, int]] = []
    for s, state in enumerate(states):
        here = f"state {s} of {what}"
        check_keys(state, here, _STATE, ())
        text_of(state["state"], f"'state' of {here}")
        _truth(state["marked"], f"'marked' of {here}")
        for e, to, event in _entries(state["enabled"], f"'enabled' of {here}", alphabet):
            delta[s, e] = _number(to, f"where {event!r} leads from {here}", len(states))
        for e, why, event in _entries(state["disabled"], f"'disabled' of {here}", alphabet):
            if delta[s, e] != NONE or event in alphabet.uncontrollable:
                fail(f"{event!r} is disabled in {here}, where it is enabled or nobody controls it")
            number = NONE if why is None else _number(why, f"the reason of {event!r} in {here}", reasons)
            disabled.append((s, e, number))
    automaton = Automaton(
        alphabet,
        delta,
        [state["marked"] for state in states],  # type: ignore[arg-type] # becomes an array
        state_names=tuple(state["state"] for state in states),
        name=name,
    )
    supervisor = Supervisor(
        automaton, np.empty((len(states), 0), np.int32), (delta != NONE) | ~alphabet.controllable
    )
    return Component(name, supervisor, np.array(disabled, np.int64).reshape(-1, 3))


def _entries(table: object, what: str, alphabet: Alphabet) -> Iterator[tuple[int, Any, str]]:
    """Give the number of each event of a table, what it says of it, and the event."""
    if not isinstance(table, dict):
        fail(f"{what} is {shown(table)}; an object with an event as each key is needed")
    for event in _events(list(table), what, alphabet):
        yield alphabet.index(event), table[event], event


def _vector(row: Any, what: str, sigma: Alphabet) -> Vector:  # noqa: ANN401
    check_keys(row, what, _TEST, ())

    def entries(key: str, read: Callable[[Any, str], Any]) -> tuple[Any, ...]:
        place = f"{key!r} of {what}"
        return tuple(read(entry, f"an entry of {place}") for entry in list_of(row[key], place))

    word = _events(row["word"], f"'word' of {what}", sigma)
    enabled = entries("enabled", lambda entry, place: _events(entry, place, sigma))
    marked = entries("marked", _truth)
    if not len(enabled) == len(marked) == len(word) + 1:
        fail(
            f"{what} has {len(word)} events; {len(word) + 1} entries of 'enabled' and of 'marked' are needed"
        )
    return Vector(word, _truth(row["ok"], f"'ok' of {what}"), enabled, marked)

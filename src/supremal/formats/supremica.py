"""Supremica's older automata, ``.xml``.

::

    <Automata name="p">                     or <SupremicaProject>
      <Automaton name="MACH1" type="Plant | Specification | Supervisor">
        <Events>
          <Event id="0" label="start" controllable="false" observable="false"/>
        <States>
          <State id="0" name="I" initial="true" accepting="true"/>
        <Transitions>
          <Transition source="0" dest="1" event="0"/>

A label or name that is left out is the id; an event is controllable and observable, and a state neither
initial nor accepting, unless the file says otherwise.  Plants, and automata of no type, are plants;
specifications and supervisors are specifications.  Forbidden states, interfaces, propositions, silent events
and events without priority are refused.

Source: the automata files of Supremica, https://supremica.org.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.automaton import Automaton
from supremal.errors import suggest
from supremal.formats._draft import Draft
from supremal.formats._names import part_names, state_names, unescape, unique
from supremal.formats._page import Page, shown
from supremal.formats._xml import Element, attribute, flag, nested, parse, start_tag
from supremal.formats.model import Model

_TYPES: Final = {"plant": 0, "undefined": 0, "specification": 1, "supervisor": 1}
_ROOTS: Final = ("SupremicaProject", "Automata")


def read(raw: bytes, path: str) -> Model:
    """Return the plants and specifications of a project."""
    page, root = parse(raw, path)
    if root.tag not in _ROOTS:
        hint = "; a module of Supremica is a .wmod file" if root.tag == "Module" else ""
        page.fail(f"the file holds <{root.tag}>; a <{'> or <'.join(_ROOTS)}> is needed{hint}", root.where)
    groups: tuple[list[Automaton], list[Automaton]] = ([], [])
    for part in root.all("Automaton"):
        kind = part.attributes.get("type", "undefined")
        if kind.lower() not in _TYPES:
            page.fail(f"the automaton is of type {shown(kind)}; known: {', '.join(_TYPES)}", part.where)
        groups[_TYPES[kind.lower()]].append(_automaton(page, part))
    return Model(*map(tuple, groups))


def _inside(part: Element, group: str, tag: str) -> Iterator[Element]:
    return (element for inner in part.all(group) for element in inner.all(tag))


def _refuse(page: Page, element: Element, name: str, *, usual: bool) -> None:
    """Refuse what has no counterpart here: a flag that is not as usual."""
    if flag(page, element, name, default=usual) != usual:
        page.fail(
            f'<{element.tag}> has {name}="{element.attributes[name]}", which is beyond plain automata; '
            "leave it out",
            element.where,
        )


def _automaton(page: Page, part: Element) -> Automaton:
    draft = Draft(page, attribute(page, part, "name"))
    events: dict[str, int] = {}
    states: dict[str, int] = {}
    for event in _inside(part, "Events", "Event"):
        _refuse(page, event, "proposition", usual=False)
        _refuse(page, event, "epsilon", usual=False)
        _refuse(page, event, "prioritized", usual=True)
        name = _name(page, event, "label", events)
        events[event.attributes["id"]] = draft.event(
            name,
            event.where,
            controllable=flag(page, event, "controllable", default=True),
            observable=flag(page, event, "observable", default=True),
        )
    for state in _inside(part, "States", "State"):
        _refuse(page, state, "forbidden", usual=False)
        number = draft.state(_name(page, state, "name", states), state.where)
        states[state.attributes["id"]] = number
        if flag(page, state, "initial", default=False):
            draft.start(number, state.where)
        if flag(page, state, "accepting", default=False):
            draft.marked.add(number)
    if draft.states and draft.initial is None:
        page.fail(f'automaton {draft.name!r} has no state with initial="true"', part.where)
    for arrow in _inside(part, "Transitions", "Transition"):
        source, target = (_number(page, arrow, end, states) for end in ("source", "dest"))
        draft.edge(source, _number(page, arrow, "event", events), target, arrow.where)
    return draft.automaton()


def _name(page: Page, element: Element, label: str, known: dict[str, int]) -> str:
    """Return the name of an event or a state whose id is new."""
    identity = attribute(page, element, "id")
    if element.attributes["id"] in known:
        page.fail(f"<{element.tag}> has the id {shown(identity)}, which stands twice", element.where)
    return unescape(element.attributes.get(label, element.attributes["id"]))


def _number(page: Page, arrow: Element, end: str, known: dict[str, int]) -> int:
    attribute(page, arrow, end)
    identity = arrow.attributes[end]
    if identity not in known:
        page.fail(f"{end!r} is the unknown id {shown(identity)}; {suggest(identity, known)}", arrow.where)
    return known[identity]


def write(model: Model) -> str:
    r"""Return ``model`` as a project.

    Examples
    --------
    >>> from supremal import from_text
    >>> light = from_text("name light\ndark -on-> lit\nlit -off-> dark")
    >>> print(write(Model((light,), ())).splitlines()[2].strip())
    <Automaton name="light" type="Plant">
    """
    return nested(_tags(model))


def lacks(model: Model) -> list[str]:
    """Say what of ``model`` the format cannot hold."""
    names = [*part_names(model.plants, "plant"), *part_names(model.specs, "spec")]
    return ["two automata of one name (they are numbered)"] if len(set(names)) < len(names) else []


def _tags(model: Model) -> Iterator[str]:
    names = unique([*part_names(model.plants, "plant"), *part_names(model.specs, "spec")])
    yield start_tag("Automata", {"name": "model", "major": "0", "minor": "1"})
    for k, part in enumerate((*model.plants, *model.specs)):
        kind = "Plant" if k < len(model.plants) else "Specification"
        yield start_tag("Automaton", {"name": names[k], "type": kind})
        yield from _parts(part)
        yield "</Automaton>"
    yield "</Automata>"


def _parts(part: Automaton) -> Iterator[str]:
    yield "<Events>"
    for e, name in enumerate(part.alphabet):
        said = {"id": str(e), "label": name}
        said |= {"controllable": "false"} if name in part.alphabet.uncontrollable else {}
        said |= {"observable": "false"} if name in part.alphabet.unobservable else {}
        yield start_tag("Event", said, end="/>")
    yield "</Events>"
    yield "<States>"
    for s, name in enumerate(state_names(part)):
        said = {"id": str(s), "name": name}
        said |= {"initial": "true"} if s == 0 else {}
        said |= {"accepting": "true"} if part.marked[s] else {}
        yield start_tag("State", said, end="/>")
    yield "</States>"
    yield "<Transitions>"
    for source, event in np.argwhere(part.delta != NONE).tolist():
        said = {"source": str(source), "dest": str(part.delta[source, event]), "event": str(event)}
        yield start_tag("Transition", said, end="/>")
    yield "</Transitions>"

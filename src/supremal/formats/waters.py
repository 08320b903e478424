"""Supremica's modules, ``.wmod``: the XML of Waters.

::

    <Module Name="m">
      <EventDeclList>                       one for all components
        <EventDecl Kind="CONTROLLABLE | UNCONTROLLABLE | PROPOSITION" Name="e" Observable="false"/>
      <ComponentList>
        <SimpleComponent Kind="PLANT | SPEC | SUPERVISOR | PROPERTY" Name="MACH1">
          <Graph>
            <LabelBlock>                    events that the component blocks: it has no edge for them
              <SimpleIdentifier Name="e"/>
            <NodeList>
              <SimpleNode Initial="true" Name="I">
                <EventList>
                  <SimpleIdentifier Name=":accepting"/>         a marked state
            <EdgeList>
              <Edge Source="I" Target="W">
                <LabelBlock>
                  <SimpleIdentifier Name="e"/>                  one or more events

The events of a component are those on its edges and those that it blocks.  A component that says nothing of
``:accepting`` has all of its states marked.  Plants are plants; specifications, supervisors and properties
are specifications.  Instances, loops over events, variables, guards, groups of states and forbidden states
are beyond plain automata, and refused.

Source: the module editor of Supremica (Åkesson, Fabian, Flordal, Malik, "Supremica - an integrated
environment for verification, synthesis and simulation of discrete event systems", WODES 2006).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet, union
from supremal.automata.automaton import Automaton
from supremal.errors import FormatError
from supremal.formats._draft import Draft
from supremal.formats._names import part_names, state_names, unique
from supremal.formats._page import Page, shown
from supremal.formats._xml import Element, attribute, flag, nested, parse, start_tag
from supremal.formats.model import Model

ACCEPTING: Final = ":accepting"

_KINDS: Final = {"PLANT": 0, "SPEC": 1, "SUPERVISOR": 1, "PROPERTY": 1}
_EVENT_KINDS: Final = ("CONTROLLABLE", "UNCONTROLLABLE", "PROPOSITION")
_DECORATION: Final = ("AttributeMap", "Comment")
_BEYOND: Final = {
    "ConditionalBlock": "a condition on events",
    "ConditionalComponent": "a condition on components",
    "EventAlias": "another name for an event",
    "ForeachComponent": "a loop over components",
    "ForeachEvent": "a loop over events",
    "ForeachEventAlias": "a loop over events",
    "Foreach": "a loop",
    "GroupNode": "a group of states",
    "GuardActionBlock": "a guard or an action",
    "IndexedIdentifier": "an event of an array",
    "Instance": "an instance of another module",
    "QualifiedIdentifier": "an event of another module",
    "RangeList": "an array of events",
    "VariableComponent": "a variable",
}


def read(raw: bytes, path: str) -> Model:
    """Return the plants and specifications of a module."""
    page, root = parse(raw, path)
    if root.tag != "Module":
        page.fail(f"the file holds <{root.tag}>; a <Module> is needed", root.where)
    events: dict[str, tuple[bool, bool]] = {}
    groups: tuple[list[Automaton], list[Automaton]] = ([], [])
    lists = ("EventDeclList", "EventAliasList", "ComponentList", "ConstantAliasList")
    for part in _children(page, root, *lists):
        if part.tag == "EventDeclList":
            _declare(page, part, events)
        elif part.tag == "EventAliasList":
            _children(page, part)
        elif part.tag == "ComponentList":
            for component in _children(page, part, "SimpleComponent"):
                kind = attribute(page, component, "Kind")
                if kind not in _KINDS:
                    known = ", ".join(_KINDS)
                    page.fail(f"the component is of kind {shown(kind)}; known: {known}", component.where)
                groups[_KINDS[kind]].append(_component(page, component, events))
    return Model(*map(tuple, groups))


def _children(page: Page, element: Element, *tags: str) -> list[Element]:
    """Return the children of ``element`` that are called so; where there are others, refuse them."""
    for child in element.children:
        is_decoration = child.tag in _DECORATION or child.tag.endswith("Geometry")
        if not (child.tag in tags or is_decoration or _is_empty_guard(child)):
            what = f", {_BEYOND[child.tag]}," if child.tag in _BEYOND else ""
            page.fail(
                f"<{child.tag}>{what} in <{element.tag}> is beyond plain automata, and those are all that is "
                "read; let Supremica compile the module first",
                child.where,
            )
    return [child for child in element.children if child.tag in tags]


def _is_empty_guard(element: Element) -> bool:
    """Tell whether ``element`` is a block for guards and actions without any, as editors leave it behind."""
    parts = [part for part in element.children if part.tag in {"Guards", "Actions"}]
    return element.tag == "GuardActionBlock" and not any(part.children for part in parts)


def _declare(page: Page, declared: Element, events: dict[str, tuple[bool, bool]]) -> None:
    """Add the events that are no propositions: whether they are controllable, and observable."""
    for event in _children(page, declared, "EventDecl"):
        _children(page, event)
        kind = attribute(page, event, "Kind")
        if kind not in _EVENT_KINDS:
            page.fail(f"the event is of kind {shown(kind)}; known: {', '.join(_EVENT_KINDS)}", event.where)
        name = attribute(page, event, "Name")
        if name in events:
            page.fail(f"event {shown(name)} is declared twice; keep one of the two", event.where)
        if kind != "PROPOSITION":
            events[name] = kind == "CONTROLLABLE", flag(page, event, "Observable", default=True)


def _labels(page: Page, block: Element) -> list[tuple[str, int]]:
    return [
        (attribute(page, label, "Name"), label.where) for label in _children(page, block, "SimpleIdentifier")
    ]


def _component(page: Page, component: Element, events: dict[str, tuple[bool, bool]]) -> Automaton:
    draft = Draft(page, attribute(page, component, "Name"))
    graphs = _children(page, component, "Graph")
    if len(graphs) != 1:
        page.fail(f"component {draft.name!r} has {len(graphs)} graphs; one is needed", component.where)
    parts = _children(page, graphs[0], "LabelBlock", "NodeList", "EdgeList")
    blocked = [label for part in parts if part.tag == "LabelBlock" for label in _labels(page, part)]
    edges = [
        (edge, [label for block in _children(page, edge, "LabelBlock") for label in _labels(page, block)])
        for part in parts
        if part.tag == "EdgeList"
        for edge in _children(page, part, "Edge")
    ]
    used = dict(blocked) | {name: where for _, labels in edges for name, where in labels}
    knows_marking = used.pop(ACCEPTING, None) is not None
    for name, (controllable, observable) in events.items():
        if name in used:
            draft.event(name, used.pop(name), controllable=controllable, observable=observable)
    for name, where in used.items():
        page.fail(f"component {draft.name!r} uses the event {shown(name)}, which is not declared", where)
    for part in parts:
        if part.tag == "NodeList":
            for node in _children(page, part, "SimpleNode"):
                _state(page, node, draft)
    if draft.states and draft.initial is None:
        page.fail(f'component {draft.name!r} has no state with Initial="true"', component.where)
    if not draft.marked and not knows_marking:
        draft.marked.update(draft.states.values())
    for edge, labels in edges:
        ends = [draft.find_state(attribute(page, edge, end), edge.where) for end in ("Source", "Target")]
        for name, where in labels:
            draft.edge(ends[0], draft.find_event(name, where), ends[1], where)
    return draft.automaton()


def _state(page: Page, node: Element, draft: Draft) -> None:
    state = draft.state(attribute(page, node, "Name"), node.where)
    if flag(page, node, "Initial", default=False):
        draft.start(state, node.where)
    for propositions in _children(page, node, "EventList"):
        for name, where in _labels(page, propositions):
            if name != ACCEPTING:
                page.fail(
                    f"state {shown(attribute(page, node, 'Name'))} is {shown(name)}; the only "
                    f"proposition that is read is {ACCEPTING!r}: where a state is forbidden, leave it out",
                    where,
                )
            draft.marked.add(state)


def write(model: Model) -> str:
    r"""Return ``model`` as a module.

    Examples
    --------
    >>> from supremal import from_text
    >>> light = from_text("name light\ndark -on-> lit\nlit -off-> dark")
    >>> print(write(Model((light,), ())).splitlines()[8].strip())
    <SimpleComponent Kind="PLANT" Name="light">
    """
    return nested(_tags(model))


def lacks(model: Model) -> list[str]:
    """Say what of ``model`` the format cannot hold."""
    names = [*part_names(model.plants, "plant"), *part_names(model.specs, "spec")]
    return ["two automata of one name (they are numbered)"] if len(set(names)) < len(names) else []


def _tags(model: Model) -> Iterator[str]:
    sigma = union(*(part.alphabet for part in (*model.plants, *model.specs)))
    if ACCEPTING in sigma:
        message = f"an event is called {ACCEPTING!r}, which is what Supremica calls marking; rename it"
        raise FormatError(message, path="<model>")
    names = unique([*part_names(model.plants, "plant"), *part_names(model.specs, "spec")])
    yield start_tag(
        "Module",
        {
            "xmlns": "http://waters.sourceforge.net/xsd/module",
            "xmlns:B": "http://waters.sourceforge.net/xsd/base",
            "Name": "model",
        },
    )
    yield "<EventDeclList>"
    yield start_tag("EventDecl", {"Kind": "PROPOSITION", "Name": ACCEPTING}, end="/>")
    for name in sigma:
        yield start_tag("EventDecl", _declaration(sigma, name), end="/>")
    yield "</EventDeclList>"
    yield "<ComponentList>"
    for k, part in enumerate((*model.plants, *model.specs)):
        kind = "PLANT" if k < len(model.plants) else "SPEC"
        yield start_tag("SimpleComponent", {"Kind": kind, "Name": names[k]})
        yield from _graph(part)
        yield "</SimpleComponent>"
    yield "</ComponentList>"
    yield "</Module>"


def _declaration(sigma: Alphabet, name: str) -> dict[str, str]:
    kind = "UNCONTROLLABLE" if name in sigma.uncontrollable else "CONTROLLABLE"
    return {"Kind": kind, "Name": name} | ({"Observable": "false"} if name in sigma.unobservable else {})


def _block(tag: str, names: list[str]) -> Iterator[str]:
    if names:
        yield f"<{tag}>"
        yield from (start_tag("SimpleIdentifier", {"Name": name}, end="/>") for name in names)
        yield f"</{tag}>"


def _graph(part: Automaton) -> Iterator[str]:
    events, states = part.alphabet.names, state_names(part)
    blocked = [name for e, name in enumerate(events) if not (part.delta[:, e] != NONE).any()]
    yield "<Graph>"
    yield from _block("LabelBlock", blocked if part.marked.any() else [ACCEPTING, *blocked])
    yield "<NodeList>"
    for s, name in enumerate(states):
        given = {"Name": name} | ({"Initial": "true"} if s == 0 else {})
        yield start_tag("SimpleNode", given, end=">" if part.marked[s] else "/>")
        if part.marked[s]:
            yield from _block("EventList", [ACCEPTING])
            yield "</SimpleNode>"
    yield "</NodeList>"
    yield "<EdgeList>"
    sources, used = np.nonzero(part.delta != NONE)
    ends = zip(sources.tolist(), part.delta[sources, used].tolist(), used.tolist(), strict=True)
    for (source, target), edges in groupby(sorted(ends), key=lambda edge: edge[:2]):
        yield start_tag("Edge", {"Source": states[source], "Target": states[target]})
        yield from _block("LabelBlock", [events[e] for *_, e in edges])
        yield "</Edge>"
    yield "</EdgeList>"
    yield "</Graph>"

"""Three ways to write an automaton down: transitions, a table, a small text.

In all of them a state is a name, the first state named is the initial one unless another is given, and
every state is marked unless the marked ones are given.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.errors import AutomatonError, FormatError, ModelError, suggest


def from_transitions(
    alphabet: Alphabet,
    transitions: Iterable[tuple[str, str, str]],
    *,
    initial: str | None = None,
    marked: Iterable[str] | None = None,
    states: Iterable[str] = (),
    name: str = "",
) -> Automaton:
    """Return the automaton with these ``transitions``, each (from, event, to).

    Parameters
    ----------
    alphabet
        The events.
    transitions
        Where which event leads.  A transition may stand twice.
    initial
        The initial state; left out: the first one named.
    marked
        The marked states; left out: all.
    states
        States to name before those of the transitions, which settles their order.
    name
        What to call the automaton.

    Raises
    ------
    AlphabetError
        If an event is not in the alphabet.
    AutomatonError
        If one event leads from a state to two, or a state is unknown.

    Examples
    --------
    >>> from_transitions(Alphabet(("on", "off")), [("dark", "on", "lit"), ("lit", "off", "dark")])
    <Automaton: 2 states, 2 transitions, 2 events>
    """
    triples = [(str(source), event, str(target)) for source, event, target in transitions]
    names = dict.fromkeys(str(state) for state in states)
    for source, _, target in triples:
        names.update({source: None, target: None})
    if initial is not None and not names:
        names[str(initial)] = None
    order = list(names)
    start = str(initial) if initial is not None else (order[0] if order else "")
    _check_states([start] if order or start else [], names, name, "the initial state")
    if order:
        order.remove(start)
        order.insert(0, start)
    number = {state: s for s, state in enumerate(order)}

    delta = np.full((len(order), len(alphabet)), NONE, np.int32)
    for source, event, target in triples:
        s, e, t = number[source], alphabet.index(event), number[target]
        if delta[s, e] not in (NONE, t):
            message = (
                f"automaton {name!r} is not deterministic: event {event!r} leads from state {source!r} to "
                f"both {order[delta[s, e]]!r} and {target!r}; keep one of the two"
            )
            raise AutomatonError(message)
        delta[s, e] = t
    chosen = order if marked is None else [str(state) for state in marked]
    _check_states(chosen, names, name, "a marked state")
    is_marked = np.zeros(len(order), np.bool_)
    is_marked[[number[state] for state in chosen]] = True
    return Automaton(alphabet, delta, is_marked, state_names=tuple(order), name=name)


def _check_states(chosen: Iterable[str], names: Mapping[str, None], name: str, role: str) -> None:
    for state in chosen:
        if state not in names:
            message = f"automaton {name!r}: {role} is {state!r}, which is unknown; {suggest(state, names)}"
            raise AutomatonError(message)


def from_table(
    alphabet: Alphabet,
    table: Mapping[str, Mapping[str, str]],
    *,
    initial: str | None = None,
    marked: Iterable[str] | None = None,
    name: str = "",
) -> Automaton:
    """Return the automaton of a ``table``: state → event → next state.

    Parameters, errors and defaults are those of `from_transitions`.

    Examples
    --------
    >>> light = from_table(Alphabet(("on", "off")), {"dark": {"on": "lit"}, "lit": {"off": "dark"}})
    >>> light.run(["on", "off", "on"])
    1
    """
    triples = []
    for state, row in table.items():
        for event, target in row.items():
            targets = [target] if isinstance(target, str) or not isinstance(target, Iterable) else target
            triples += [(str(state), event, str(t)) for t in targets]
    return from_transitions(
        alphabet, triples, initial=initial, marked=marked, states=[str(s) for s in table], name=name
    )


_ARROW: Final = re.compile(r"(?P<source>\S+)\s+-\s*(?P<events>\S(?:(?!->).)*?)\s*->\s*(?P<target>\S+)$")
_BETWEEN: Final = re.compile(r"\s*,\s*|\s+")
_HEADS: Final = ("name", "initial", "marked", "events", "uncontrollable", "unobservable")


def from_text(text: str, *, alphabet: Alphabet | None = None, path: str = "<text>") -> Automaton:
    """Return the automaton that a small ``text`` draws, one arrow a line.

    A line is ``state -event, event-> state``, or one of ``name``, ``initial``, ``marked``, ``events``,
    ``uncontrollable`` and ``unobservable`` with what it lists; ``#`` starts a comment.  ``events`` is needed
    only for those that no arrow has.  An ``alphabet`` settles the events from outside.

    Raises
    ------
    FormatError
        If a line does not parse; gives the line and the column.
    AlphabetError, AutomatonError
        As `from_transitions`.

    Examples
    --------
    >>> machine = from_text('''
    ...     initial idle
    ...     marked idle
    ...     uncontrollable finish, break
    ...     idle -start-> busy
    ...     busy -finish-> idle
    ...     busy -break-> down
    ...     down -repair-> idle
    ... ''')
    >>> machine
    <Automaton: 3 states, 4 transitions, 4 events>
    """
    heads: dict[str, list[str]] = {}
    triples: list[tuple[str, str, str]] = []
    for line, raw in enumerate(text.splitlines(), 1):
        content = raw.split("#", 1)[0].rstrip()
        if not content.strip():
            continue
        column = len(content) - len(content.lstrip()) + 1
        head, *rest = content.split()
        arrow = _ARROW.match(content.strip())
        if arrow:
            events = _BETWEEN.split(arrow["events"])
            if "" in events:
                message = "an event is missing beside a comma: 'state -a, b-> state' is needed"
                raise FormatError(message, path=path, line=line, column=column + arrow.start("events"))
            triples += [(arrow["source"], event, arrow["target"]) for event in events]
        elif head in _HEADS:
            heads.setdefault(head, []).extend(word for word in _BETWEEN.split(" ".join(rest)) if word)
        else:
            known = ", ".join(_HEADS)
            message = f"{content.strip()!r} is neither an arrow 'state -event-> state' nor one of {known}"
            raise FormatError(message, path=path, line=line, column=column)
    if alphabet is None:
        uncontrollable, unobservable = (heads.get(head, []) for head in _HEADS[-2:])
        moved = [event for _, event, _ in triples]
        names = dict.fromkeys([*heads.get("events", []), *moved, *uncontrollable, *unobservable])
        alphabet = Alphabet(tuple(names), frozenset(uncontrollable), frozenset(unobservable))
    initial = heads.get("initial")
    if initial is not None and len(initial) != 1:
        message = f"'initial' names {len(initial)} states; exactly one is needed"
        raise FormatError(message, path=path)
    try:
        return from_transitions(
            alphabet,
            triples,
            initial=initial[0] if initial else None,
            marked=heads.get("marked"),
            name=" ".join(heads.get("name", [])),
        )
    except ModelError as error:
        message = f"{path}: {error}"
        raise type(error)(message) from None


def universal(alphabet: Alphabet, *, name: str = "Σ*") -> Automaton:
    """Return the automaton of Σ*: one marked state on which every event loops.

    It is the plant of which nothing is known: whatever can be enforced on it, can be enforced on any.
    """
    return Automaton(alphabet, np.zeros((1, len(alphabet)), np.int32), np.ones(1, np.bool_), name=name)


def empty(alphabet: Alphabet, *, name: str = "") -> Automaton:
    """Return the empty automaton: no state, no word."""
    return Automaton(alphabet, np.empty((0, len(alphabet)), np.int32), np.empty(0, np.bool_), name=name)

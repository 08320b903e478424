"""The Hanoi omega-automata format, version 1, ``.hoa``, read as automata of finite words.

::

    HOA: v1
    name: "light"
    States: 2
    Start: 0
    AP: 2 "on" "off"
    controllable-AP: 0          the others are not; left out: all are controllable
    unobservable-AP:            the others are observable
    role: plant                 or spec; left out: plant
    finite-words: t             a state of set 0 is a marked state
    acc-name: Buchi
    Acceptance: 1 Inf(0)        or, where all states are marked, acc-name: all and Acceptance: 0 t
    Alias: @on 0&!1
    Alias: @off 1&!0
    --BODY--
    State: 0 "dark" {0}
    [@on] 1
    State: 1 "lit"
    [@off] 0
    --END--

An event is a proposition, and a letter is one event: a label is read where exactly one proposition is true.
A file may hold several automata.  Other files are read if they are deterministic, with labels on edges, one
initial state at most, and ``Acceptance: 0 t``, which says of every finite run that it can go on well.  What
accepts infinite words in any other way is refused, for it has no meaning on finite ones.

Source: Babiak et al., "The Hanoi omega-automata format", CAV 2015; https://adl.github.io/hoaf.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.automaton import Automaton
from supremal.errors import FormatError
from supremal.formats._hoa_reader import Reader
from supremal.formats._hoa_tokens import MAX_PROPOSITIONS, Tokens
from supremal.formats._names import state_names, unique
from supremal.formats._page import decode
from supremal.formats.model import Model

_ALIAS: Final = re.compile(r"[0-9a-zA-Z_-]+")
_QUOTED: Final = re.compile(r'[\\"]')


def read(raw: bytes, path: str) -> Model:
    """Return the automata in a file."""
    tokens = Tokens(decode(raw, path))
    groups: dict[str, list[Automaton]] = {"plant": [], "spec": []}
    while True:
        reader = Reader(tokens)
        automaton = reader.automaton()  # which settles the role
        groups[reader.role].append(automaton)
        if not tokens.now.kind:
            return Model(tuple(groups["plant"]), tuple(groups["spec"]))


def write(model: Model) -> str:
    r"""Return ``model`` as one automaton after the other, the plants before the specifications.

    Examples
    --------
    >>> from supremal import from_text
    >>> light = from_text("name light\ndark -on-> lit\nlit -off-> dark")
    >>> print(*write(Model((light,), ())).splitlines()[-5:-1], sep="\n")
    State: 0 "dark"
    [@on] 1
    State: 1 "lit"
    [@off] 0
    """
    roles = ["plant"] * len(model.plants) + ["spec"] * len(model.specs)
    parts = zip(roles, (*model.plants, *model.specs), strict=True)
    return "".join(f"{line}\n" for role, part in parts for line in (*_header(part, role), *_body(part)))


def lacks(model: Model) -> list[str]:
    """Say what of ``model`` the format cannot hold."""
    marked = all(part.marked.all() for part in (*model.plants, *model.specs))
    return [] if marked else ["marking (other programs read it as Büchi acceptance of infinite words)"]


def _quoted(name: str) -> str:
    return '"' + _QUOTED.sub(r"\\\g<0>", name) + '"'


def _numbers(head: str, numbers: Iterable[int]) -> str:
    return " ".join([head, *map(str, numbers)])


def _aliases(part: Automaton) -> list[str]:
    """Return the alias of each event: its name, if an alias can be called so."""
    return unique(
        f"@{name if _ALIAS.fullmatch(name) else f'event-{e}'}" for e, name in enumerate(part.alphabet)
    )


def _header(part: Automaton, role: str) -> Iterator[str]:
    sigma = part.alphabet
    if len(sigma) > MAX_PROPOSITIONS:
        message = f"automaton {part.name!r} has {len(sigma)} events; a file has up to {MAX_PROPOSITIONS}"
        raise FormatError(message, path="<model>")
    yield "HOA: v1"
    if part.name:
        yield f"name: {_quoted(part.name)}"
    yield 'tool: "supremal"'
    yield f"States: {part.n_states}"
    if part.n_states:
        yield "Start: 0"
    yield " ".join([f"AP: {len(sigma)}", *map(_quoted, sigma)])
    yield _numbers("controllable-AP:", np.flatnonzero(sigma.controllable))
    yield _numbers("unobservable-AP:", (e for e, name in enumerate(sigma) if name in sigma.unobservable))
    yield f"role: {role}"
    yield "finite-words: t"
    if part.marked.all():
        yield from ["acc-name: all", "Acceptance: 0 t"]
    else:
        yield from ["acc-name: Buchi", "Acceptance: 1 Inf(0)"]
    yield "properties: trans-labels explicit-labels state-acc deterministic"
    for e, alias in enumerate(_aliases(part)):
        others = (f"!{other}" for other in range(len(sigma)) if other != e)
        yield f"Alias: {alias} {'&'.join([str(e), *others])}"


def _body(part: Automaton) -> Iterator[str]:
    aliases, names = _aliases(part), state_names(part)
    by_set = not part.marked.all()
    yield "--BODY--"
    for s, name in enumerate(names):
        called = f" {_quoted(name)}" if part.state_names else ""
        yield f"State: {s}{called}{' {0}' if by_set and part.marked[s] else ''}"
        for e in np.flatnonzero(part.delta[s] != NONE):
            yield f"[{aliases[e]}] {part.delta[s, e]}"
    yield "--END--"

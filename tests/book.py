"""The definitions of the book, on sets and dicts: slow, and right by being read.

Nothing here shares code with the library, whose kernels and verbs are compared with these definitions.
States are any hashable values; those of a composition are tuples.

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., chapters 2 and 3.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations, product
from pathlib import Path
from typing import Any

import pytest

from supremal import Automaton

CASES = Path(__file__).parent / "cases"
LOST = "lost"
Word = tuple[str, ...]
State = Any


@dataclass(frozen=True)
class Machine:
    """G = (Q, Σ, δ, q0, Qm); ``initial`` is None where there is no state at all."""

    events: frozenset[str]
    uncontrollable: frozenset[str]
    states: frozenset[State]
    moves: dict[tuple[State, str], State]
    initial: State | None
    marked: frozenset[State]


def read(automaton: Automaton) -> Machine:
    """Read an automaton off its public arrays."""
    states = range(automaton.n_states)
    return Machine(
        frozenset(automaton.alphabet.names),
        automaton.alphabet.uncontrollable,
        frozenset(states),
        {
            (s, event): int(automaton.delta[s, e])
            for s in states
            for e, event in enumerate(automaton.alphabet.names)
            if automaton.delta[s, e] >= 0
        },
        0 if states else None,
        frozenset(s for s in states if automaton.marked[s]),
    )


# --- words ------------------------------------------------------------------------------------------------


def all_words(events: Iterable[str], length: int) -> Iterator[Word]:
    """Σ*, up to ``length``, the shortest first."""
    for n in range(length + 1):
        yield from product(sorted(events), repeat=n)


def after(machine: Machine, word: Word) -> State | None:
    """δ*(word, q0), None where it is not defined."""
    state = machine.initial
    for event in word:
        state = None if state is None else machine.moves.get((state, event))
    return state


def generated(machine: Machine, length: int) -> set[Word]:
    """L(G), up to ``length``."""
    return {word for word in all_words(machine.events, length) if after(machine, word) is not None}


def marked_words(machine: Machine, length: int) -> set[Word]:
    """Lm(G), up to ``length``."""
    return {word for word in all_words(machine.events, length) if after(machine, word) in machine.marked}


def apart(one: Iterable[Word], two: Iterable[Word]) -> Word | None:
    """The shortest word that only one of two finite languages has; a better message than their difference."""
    return min(set(one) ^ set(two), key=lambda word: (len(word), word), default=None)


def project(word: Word, events: frozenset[str]) -> Word:
    """P(word): the events of a smaller alphabet, in order."""
    return tuple(event for event in word if event in events)


def prefixes(words: Iterable[Word]) -> frozenset[Word]:
    """The prefix closure of a finite language."""
    return frozenset(word[:n] for word in words for n in range(len(word) + 1))


def has_factor(word: Word, factors: set[Word]) -> bool:
    """Tell whether some word of ``factors`` stands anywhere in ``word``."""
    return any(word[i:j] in factors for i in range(len(word) + 1) for j in range(i, len(word) + 1))


# --- states -----------------------------------------------------------------------------------------------


def accessible(machine: Machine) -> frozenset[State]:
    """The states that some word leads to."""
    found = frozenset() if machine.initial is None else frozenset({machine.initial})
    while True:
        wider = found | {to for (source, _), to in machine.moves.items() if source in found}
        if wider == found:
            return found
        found = wider


def coaccessible(machine: Machine) -> frozenset[State]:
    """The states from which some word leads to a marked one."""
    found = machine.marked
    while True:
        wider = found | {source for (source, _), to in machine.moves.items() if to in found}
        if wider == found:
            return found
        found = wider


def restrict(machine: Machine, states: frozenset[State]) -> Machine:
    """Cut down to ``states``, and to what is accessible through them."""
    moves = {(s, e): to for (s, e), to in machine.moves.items() if s in states and to in states}
    initial = machine.initial if machine.initial in states else None
    inside = accessible(
        Machine(machine.events, machine.uncontrollable, states, moves, initial, machine.marked & states)
    )
    return Machine(
        machine.events,
        machine.uncontrollable,
        inside,
        {(s, e): to for (s, e), to in moves.items() if s in inside},
        initial,
        machine.marked & inside,
    )


def trim(machine: Machine) -> Machine:
    """Keep what is accessible and coaccessible."""
    return restrict(machine, coaccessible(machine))


def completed(machine: Machine, events: frozenset[str]) -> Machine:
    """Lead every missing transition to the state ``LOST``, which nothing leaves."""
    states = machine.states | {LOST}
    moves = {(s, e): machine.moves.get((s, e), LOST) for s in states for e in machine.events | events}
    initial = LOST if machine.initial is None else machine.initial
    return Machine(machine.events | events, machine.uncontrollable, states, moves, initial, machine.marked)


def sync(*parts: Machine) -> Machine:
    """A ∥ B ∥ ...: the accessible part of the product, by the three cases of the definition."""
    events = frozenset().union(*(part.events for part in parts))
    moves: dict[tuple[State, str], State] = {}
    states = frozenset(product(*(part.states for part in parts)))
    for state in states:
        for event in events:
            to = tuple(
                part.moves.get((q, event)) if event in part.events else q
                for part, q in zip(parts, state, strict=True)
            )
            if None not in to:
                moves[state, event] = to
    whole = Machine(
        events,
        frozenset().union(*(part.uncontrollable for part in parts)),
        states,
        moves,
        tuple(part.initial for part in parts) if states else None,
        frozenset(s for s in states if all(q in part.marked for part, q in zip(parts, s, strict=True))),
    )
    return restrict(whole, states)


def distance(machine: Machine, goals: frozenset[State]) -> int | None:
    """The length of the shortest word to one of ``goals``: go through all words of one length at once."""
    layer = set() if machine.initial is None else {machine.initial}
    for length in range(len(machine.states) + 1):
        if layer & goals:
            return length
        layer = {to for (source, _), to in machine.moves.items() if source in layer}
    return None


def estimate(machine: Machine, word: Word, events: frozenset[str]) -> frozenset[State]:
    """The states that some s with P(s) = ``word`` leads to, where P erases all but ``events``."""

    def unseen(states: frozenset[State]) -> frozenset[State]:
        while True:
            hidden = machine.events - events
            wider = states | {to for (s, e), to in machine.moves.items() if s in states and e in hidden}
            if wider == states:
                return states
            states = wider

    states = unseen(frozenset() if machine.initial is None else frozenset({machine.initial}))
    for event in word:
        states = unseen(frozenset(to for (s, e), to in machine.moves.items() if s in states and e == event))
    return states


def indistinguishable(machine: Machine) -> set[tuple[State, State]]:
    """Pairs of states with the same two languages: take out those that an event, or a mark, tells apart."""
    pairs = {(p, q) for p in machine.states for q in machine.states}
    pairs = {(p, q) for p, q in pairs if (p in machine.marked) == (q in machine.marked)}
    while True:
        ahead = pairs | {(None, None)}
        fewer = {
            (p, q)
            for p, q in pairs
            if all((machine.moves.get((p, e)), machine.moves.get((q, e))) in ahead for e in machine.events)
        }
        if fewer == pairs:
            return pairs
        pairs = fewer


# --- control ----------------------------------------------------------------------------------------------


def can(machine: Machine, state: State, event: str) -> bool:
    """Tell whether ``event`` can happen; what a machine does not know, it does not prevent."""
    return event not in machine.events or (state, event) in machine.moves


def escapes(plant: Machine, behaviour: Machine) -> frozenset[State]:
    """The states (x, y) of ``behaviour`` in which it forbids what nobody controls and the plant can do."""
    return frozenset(
        pair
        for pair in behaviour.states
        for event in behaviour.uncontrollable
        if can(plant, pair[0], event) and (pair, event) not in behaviour.moves
    )


def uncontrollable_words(plant: Machine, spec: Machine, length: int) -> set[tuple[Word, str]]:
    """All (s, u) with s ∈ K̄ and su ∈ L(G) \\ K̄, |s| ≤ ``length``: controllability, word for word."""
    closure = trim(spec)
    events = plant.events | spec.events

    def possible(word: Word) -> bool:
        return after(plant, project(word, plant.events)) is not None

    def allowed(word: Word) -> bool:
        return after(closure, project(word, spec.events)) is not None

    return {
        (word, event)
        for word in all_words(events, length)
        if possible(word) and allowed(word)
        for event in plant.uncontrollable | spec.uncontrollable
        if possible((*word, event)) and not allowed((*word, event))
    }


def idle(plant: Machine, behaviour: Machine) -> frozenset[State]:
    """The states in which ``behaviour`` forbids all that the plant can do and a supervisor can forbid."""
    free = behaviour.events - behaviour.uncontrollable
    return frozenset(
        pair
        for pair in behaviour.states
        if any(can(plant, pair[0], event) for event in free)
        and not any((pair, event) in behaviour.moves for event in free)
    )


def supcon(plant: Machine, spec: Machine, *, nonblocking: bool, must_act: bool = False) -> Machine:
    """The supremal controllable (nonblocking) sublanguage: take out bad states until none is left."""
    whole = sync(plant, spec)
    good = whole.states
    while True:
        inside = restrict(whole, good)
        bad = escapes(plant, inside)
        if nonblocking:
            bad |= inside.states - coaccessible(inside)
        if must_act:
            bad |= idle(plant, inside)
        if not bad:
            return inside
        good = inside.states - bad


def subautomata(machine: Machine) -> Iterator[Machine]:
    """Every machine that comes of taking out transitions: 2^n of them."""
    for n in range(len(machine.moves) + 1):
        for chosen in combinations(machine.moves.items(), n):
            kept = Machine(
                machine.events,
                machine.uncontrollable,
                machine.states,
                dict(chosen),
                machine.initial,
                machine.marked,
            )
            yield restrict(kept, machine.states)


def is_controllable_language(
    closure: frozenset[Word], plant: frozenset[Word], uncontrollable: set[str]
) -> bool:
    """K̄Σu ∩ L(G) ⊆ K̄ for finite languages, as Theorem 1 of the paper has it."""
    return all(
        (*word, event) in closure for word in closure for event in uncontrollable if (*word, event) in plant
    )


def supremal_language(
    words: frozenset[Word], plant: frozenset[Word], uncontrollable: set[str]
) -> frozenset[Word]:
    """K↑ for a finite K = ``words``: the union of all its controllable sublanguages, all 2^|K| tried."""
    found: frozenset[Word] = frozenset()
    for n in range(len(words) + 1):
        for chosen in combinations(sorted(words), n):
            if is_controllable_language(prefixes(chosen), plant, uncontrollable):
                found |= frozenset(chosen)
    return found


# --- its tables -------------------------------------------------------------------------------------------


def table(name: str) -> list[dict[str, Any]]:
    """The cases of ``tests/cases/<name>.toml``."""
    cases: list[dict[str, Any]] = tomllib.loads((CASES / f"{name}.toml").read_text(encoding="utf-8"))["case"]
    return cases


def named(cases: list[dict[str, Any]]) -> list[Any]:
    """Parameters of a test, each called by the name of its case."""
    return [pytest.param(case, id=case["name"]) for case in cases]

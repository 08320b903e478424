"""The same answers as libFAUDES, on seeded random automata.

Source: Moor, Schmidt, Perk, "libFAUDES - an open source C++ library for discrete event systems", WODES 2008;
https://fgdes.tf.fau.de.
"""

from __future__ import annotations

from collections import Counter

import faudes
import numpy as np
import pytest

from strategies import UNCONTROLLABLE
from supremal import (
    Alphabet,
    Automaton,
    complement,
    from_transitions,
    is_controllable,
    is_included,
    is_nonblocking,
    is_same_language,
    mark_all,
    sync,
    synthesize,
    trim,
    universal,
)
from supremal._jit import COMPILED
from supremal.automata.compose import extend

pytestmark = pytest.mark.engine

BATCHES = range(10)
BATCH = 20 if COMPILED else 3


def random_automaton(rng: np.random.Generator, controllable: float, uncontrollable: float) -> Automaton:
    """2 to 30 states, 3 to 5 of five events; an event is possible in a state with the chance of its kind."""
    names = rng.permutation(["a", "b", "c", "u", "v"])[: rng.integers(3, 6)].tolist()
    states = int(rng.integers(2, 31))
    chance = [uncontrollable if name in UNCONTROLLABLE else controllable for name in names]
    shape = (states, len(names))
    delta = np.where(rng.random(shape) < chance, rng.integers(0, states, shape), -1)
    return Automaton(Alphabet(tuple(names), UNCONTROLLABLE & set(names)), delta, rng.random(states) < 0.5)


def random_pairs(batch: int) -> list[tuple[Automaton, Automaton]]:
    """Plants, and specifications that rarely forbid an uncontrollable event: else nothing would be left."""
    rng = np.random.default_rng(batch)
    return [(random_automaton(rng, 0.6, 0.2), random_automaton(rng, 0.7, 0.97)) for _ in range(BATCH)]


def to_faudes(automaton: Automaton) -> faudes.System:
    """Hand an automaton over."""
    names = automaton.alphabet.names
    sources, events = np.nonzero(automaton.delta >= 0)
    return faudes.System.FromLists(
        [str(s) for s in range(automaton.n_states)],
        list(names),
        [name for name in names if name not in automaton.alphabet.uncontrollable],
        [(str(s), names[e], str(automaton.delta[s, e])) for s, e in zip(sources, events, strict=True)],
        ["0"] if automaton.n_states else [],
        [str(s) for s in np.flatnonzero(automaton.marked)],
    )


def accessible(generator: faudes.Generator) -> faudes.Generator:
    """A copy without the states that no word leads to."""
    copy = faudes.Generator(generator)
    copy.Accessible()
    return copy


def from_faudes(generator: faudes.Generator, alphabet: Alphabet) -> Automaton:
    """Take an automaton back; some results hold states that nothing leads to, and no initial one."""
    generator = accessible(generator)
    states, _, arrows, initial, marked = faudes.Generator.ToLists(generator)
    return from_transitions(
        alphabet, arrows, states=states, initial=initial[0] if initial else None, marked=marked
    )


def lifted(automaton: Automaton, alphabet: Alphabet) -> faudes.System:
    """Let it stand still on the events of ``alphabet`` that it does not know, by libFAUDES' own means."""
    system = to_faudes(automaton)
    faudes.InvProject(system, to_faudes(universal(alphabet)).Alphabet())
    for name in alphabet:
        if name not in alphabet.uncontrollable:
            system.SetControllable(name)
    return system


def assert_same(ours: Automaton, theirs: Automaton) -> None:
    """Both languages are the same, and so is the number of states."""
    assert is_same_language(ours, theirs)
    assert is_same_language(mark_all(ours), mark_all(theirs))
    assert ours.n_states == theirs.n_states


@pytest.mark.parametrize("batch", BATCHES)
def test_parallel(batch: int) -> None:
    for a, b in random_pairs(batch):
        both = sync(a, b)
        assert_same(both, from_faudes(faudes.Parallel(to_faudes(a), to_faudes(b)), both.alphabet))


@pytest.mark.parametrize("batch", BATCHES)
def test_supcon(batch: int) -> None:
    kinds = Counter[str]()
    for plant, spec in random_pairs(batch):
        both = sync(plant, spec)
        system, generator = lifted(plant, both.alphabet), lifted(spec, both.alphabet)
        found = synthesize(plant, spec).automaton
        assert_same(found, from_faudes(faudes.SupCon(system, generator), both.alphabet))
        closed = synthesize(plant, spec, nonblocking=False).automaton
        assert_same(closed, from_faudes(faudes.SupConClosed(system, generator), both.alphabet))
        assert is_controllable(plant, mark_all(spec)) == faudes.IsControllable(system, generator)
        kinds["empty" if not found.n_states else "whole" if found.n_states == both.n_states else "part"] += 1
    assert kinds["part"] >= BATCH // 5, kinds


@pytest.mark.parametrize("batch", BATCHES)
def test_languages(batch: int) -> None:
    for a, b in random_pairs(batch):
        theirs = to_faudes(a)
        assert is_nonblocking(a) == faudes.IsNonblocking(accessible(theirs))
        faudes.Trim(theirs)
        assert_same(trim(a), from_faudes(theirs, a.alphabet))
        other = faudes.Generator()
        faudes.LanguageComplement(to_faudes(a), other)
        assert is_same_language(complement(a), from_faudes(other, a.alphabet))
        both = sync(a, b)
        wide, whole = (extend(part, both.alphabet, stand_still=True) for part in (a, b))
        assert is_included(wide, whole) == faudes.LanguageInclusion(to_faudes(wide), to_faudes(whole))
        assert faudes.LanguageInclusion(to_faudes(both), to_faudes(whole))

"""The same languages, and the same numbers of states, as libFAUDES, on seeded random automata.

Source: Moor, Schmidt, Perk, "libFAUDES - an open source C++ library for discrete event systems", WODES 2008;
https://fgdes.tf.fau.de.
"""

from __future__ import annotations

import faudes
import numpy as np
import pytest

from strategies import UNCONTROLLABLE
from supremal import (
    Alphabet,
    Automaton,
    difference,
    inverse_project,
    is_included,
    is_isomorphic,
    is_same_language,
    language_union,
    mark_all,
    meet,
    minimise,
    project,
    reverse_language,
    right_quotient,
    trim,
)
from supremal._jit import COMPILED
from supremal.automata.reduce import breadth_first
from test_faudes import accessible, from_faudes, to_faudes

pytestmark = pytest.mark.engine

BATCHES = range(8)
BATCH = 15 if COMPILED else 3


def random_automaton(rng: np.random.Generator, states: int) -> Automaton:
    """Up to ``states`` states, 2 to 4 of four events, which are possible at three out of five times."""
    names = rng.permutation(["a", "b", "u", "v"])[: rng.integers(2, 5)].tolist()
    states = int(rng.integers(1, states + 1))
    shape = (states, len(names))
    delta = np.where(rng.random(shape) < 0.6, rng.integers(0, states, shape), -1)
    return Automaton(Alphabet(tuple(names), UNCONTROLLABLE & set(names)), delta, rng.random(states) < 0.4)


def random_pairs(batch: int, states: int = 12) -> list[tuple[Automaton, Automaton]]:
    """Automata over alphabets that overlap."""
    rng = np.random.default_rng(1_000 + batch)
    return [(random_automaton(rng, states), random_automaton(rng, states)) for _ in range(BATCH)]


def events(alphabet: Alphabet) -> faudes.EventSet:
    """Hand an alphabet over."""
    found = faudes.EventSet()
    for name in alphabet:
        found.Insert(name)
    return found


def least(generator: faudes.Generator) -> faudes.Generator:
    """The least automaton by libFAUDES' own means."""
    found = faudes.Generator()
    faudes.StateMin(accessible(generator), found)
    return found


def assert_languages(ours: Automaton, theirs: Automaton) -> None:
    """Both languages are the same."""
    assert is_same_language(ours, theirs)
    assert is_same_language(mark_all(ours), mark_all(theirs))


@pytest.mark.parametrize("batch", BATCHES)
def test_minimise(batch: int) -> None:
    for a, b in random_pairs(batch, 40):
        for one in (a, trim(b), language_union(a, b)):
            ours, theirs = minimise(one), from_faudes(least(to_faudes(one)), one.alphabet)
            assert ours.delta.tolist() == breadth_first(theirs).delta.tolist()
            assert ours.marked.tolist() == breadth_first(theirs).marked.tolist()


@pytest.mark.parametrize("batch", BATCHES)
def test_project(batch: int) -> None:
    for a, b in random_pairs(batch):
        shared = [name for name in a.alphabet if name in b.alphabet]
        found = project(a, shared)
        theirs = from_faudes(faudes.Project(to_faudes(a), events(found.alphabet)), found.alphabet)
        assert_languages(found, theirs)
        assert is_isomorphic(minimise(found), from_faudes(least(to_faudes(found)), found.alphabet))
        wide = to_faudes(b)
        faudes.InvProject(wide, events(meet(a, b).alphabet))
        sigma = meet(b, a).alphabet
        assert is_isomorphic(inverse_project(b, sigma), from_faudes(wide, sigma))


@pytest.mark.parametrize("batch", BATCHES)
def test_languages_as_sets(batch: int) -> None:
    for a, b in random_pairs(batch):
        one, two = to_faudes(a), to_faudes(b)
        sigma = meet(a, b).alphabet
        assert_languages(language_union(a, b), from_faudes(faudes.LanguageUnion(one, two), sigma))
        assert_languages(meet(a, b), from_faudes(faudes.LanguageIntersection(one, two), sigma))
        assert is_same_language(difference(a, b), from_faudes(faudes.LanguageDifference(one, two), sigma))
        assert (trim(meet(a, b)).n_states == 0) == faudes.LanguageDisjoint(one, two)
        wide_a, wide_b = (from_faudes(to_faudes(part), sigma) for part in (meet(a, a, a), b))
        assert is_included(wide_a, wide_b) == (trim(difference(a, b)).n_states == 0)


@pytest.mark.parametrize("batch", BATCHES)
def test_quotients_of_a_concatenation(batch: int) -> None:
    """(A·B)/B holds A where B holds a word; and the mirror image of A·B is that of B before that of A."""
    for a, b in random_pairs(batch, 5):
        sigma = meet(a, b).alphabet
        one, two = faudes.Generator(to_faudes(a)), faudes.Generator(to_faudes(b))
        both = from_faudes(faudes.LanguageConcatenate(one, two), sigma)
        assert trim(b).n_states == 0 or is_included(a, right_quotient(both, b))
        mirrored = [faudes.Generator(to_faudes(reverse_language(part))) for part in (b, a)]
        assert is_same_language(
            reverse_language(both), from_faudes(faudes.LanguageConcatenate(*mirrored), sigma)
        )

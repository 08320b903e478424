"""Local supervisors: conflicts by the definition, and the same behaviour as one supervisor for everything."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import book
from strategies import UNCONTROLLABLE, automata, languages, plants, specifications, trie
from supremal import (
    Alphabet,
    AlphabetError,
    Automaton,
    AutomatonError,
    from_text,
    is_included,
    is_nonblocking,
    is_same_language,
    mark_all,
    sync,
    synthesize,
    universal,
)
from supremal._jit import COMPILED
from supremal.synthesis.modular import Modular, find_conflict, is_nonconflicting, synthesize_modular

pytestmark = pytest.mark.engine

SIGMA = Alphabet(("a", "b", "u"), UNCONTROLLABLE & {"u"})


# --- conflicts --------------------------------------------------------------------------------------------


@settings(max_examples=50)
@given(st.lists(languages(max_size=5), max_size=3))
def test_conflicts_word_for_word(parts: list[frozenset[book.Word]]) -> None:
    """Nonconflicting: the closure of L1 ∩ ... ∩ Ln is the intersection of their closures."""
    shared = frozenset(book.all_words(SIGMA.names, 3)).intersection(*parts)
    closures = frozenset(book.all_words(SIGMA.names, 3)).intersection(*map(book.prefixes, parts))
    found = find_conflict(universal(SIGMA), *(trie(SIGMA, part) for part in parts))
    if not parts:  # Σ* alone
        assert found is None
        return
    wrong = closures - book.prefixes(shared)
    assert is_nonconflicting(universal(SIGMA), *(trie(SIGMA, part) for part in parts)) == (not wrong)
    assert (None if found is None else len(found)) == min(map(len, wrong), default=None)
    assert found is None or found in wrong


@given(st.lists(automata(), max_size=3))
def test_conflicts_state_by_state(parts: list[Automaton]) -> None:
    both = book.sync(*(book.trim(book.read(part)) for part in parts))
    blocked = both.states - book.coaccessible(both)
    found = find_conflict(*parts)
    assert (None if found is None else len(found)) == book.distance(both, blocked)
    assert found is None or book.after(both, found) in blocked
    assert is_nonconflicting(*parts) == (found is None)


# --- local supervisors ------------------------------------------------------------------------------------


def together(found: Modular, parts: list[Automaton]) -> Automaton:
    """What all supervisors allow all plants."""
    return sync(*(supervisor.automaton for supervisor in found.supervisors), *parts)


ANY = automata(max_states=3, max_events=2, events="abcuv")
SOME_PLANTS = st.lists(plants(3) | ANY, min_size=1, max_size=3)
SOME_SPECS = st.lists(specifications(3) | ANY, max_size=3)


@settings(max_examples=50)
@given(SOME_PLANTS, SOME_SPECS)
def test_nonconflicting_supervisors_are_the_monolithic_one(
    parts: list[Automaton], specs: list[Automaton]
) -> None:
    found, whole = synthesize_modular(parts, specs), synthesize(parts, specs).automaton
    both = together(found, parts)
    assert is_included(whole, both)
    assert (found.conflict is None) == is_nonblocking(both)
    assert found.conflict is None or both.run(found.conflict) >= 0
    assert is_same_language(mark_all(whole), mark_all(both)) == (found.conflict is None)
    if found.conflict is None:
        assert is_same_language(whole, both)
    for supervisor, group in zip(found.supervisors, found.groups, strict=True):
        assert supervisor.plant_state.shape == (supervisor.automaton.n_states, len(group))


@settings(max_examples=50)
@given(SOME_PLANTS, SOME_SPECS)
def test_closed_supervisors_always_are(parts: list[Automaton], specs: list[Automaton]) -> None:
    found = synthesize_modular(parts, specs, nonblocking=False)
    whole, both = synthesize(parts, specs, nonblocking=False).automaton, together(found, parts)
    assert found.conflict is None
    assert is_same_language(whole, both)
    assert is_same_language(mark_all(whole), mark_all(both))


def random_parts(rng: np.random.Generator, number: int, states: int, chance: float) -> list[Automaton]:
    """Automata that share events in pairs."""
    parts = []
    for _ in range(number):
        names = rng.permutation(["a", "b", "c", "d", "u", "v", "w"])[: rng.integers(1, 4)].tolist()
        size = int(rng.integers(2, states + 1))
        likely = [0.97 if name in "uvw" else chance for name in names]
        delta = np.where(
            rng.random((size, len(names))) < likely, rng.integers(0, size, (size, len(names))), -1
        )
        marked = np.append(rng.random(size - 1) < 0.5, True)
        parts.append(Automaton(Alphabet(tuple(names), frozenset("uvw") & set(names)), delta, marked))
    return parts


@pytest.mark.parametrize("seed", range(4))
def test_many_random_parts(seed: int) -> None:
    rng, kinds = np.random.default_rng(seed), Counter[str]()
    for _ in range(60 if COMPILED else 6):
        machines, specs = random_parts(rng, 4, 3, 0.8), random_parts(rng, 2, 3, 0.7)
        found, whole = synthesize_modular(machines, specs), synthesize(machines, specs).automaton
        both = together(found, machines)
        assert is_same_language(mark_all(whole), mark_all(both)) == (found.conflict is None)
        assert found.conflict is not None or is_same_language(whole, both)
        kinds["conflict" if found.conflict is not None else "some" if whole.n_states > 1 else "little"] += 1
    assert not COMPILED or min(kinds["conflict"], kinds["some"]) >= 2, kinds


def test_a_line_of_machines() -> None:
    """Each buffer looks at the two machines beside it; nothing is lost."""
    machines = [
        from_text(f"marked idle \n uncontrollable end{k} \n idle -start{k}-> busy \n busy -end{k}-> idle")
        for k in range(5)
    ]
    buffers = [
        from_text(
            f"marked empty \n uncontrollable end{k} \n empty -end{k}-> full \n full -start{k + 1}-> empty"
        )
        for k in range(4)
    ]
    found = synthesize_modular(machines, buffers)
    assert found.groups == ((0, 1), (1, 2), (2, 3), (3, 4))
    assert [supervisor.automaton.n_states for supervisor in found.supervisors] == [6, 6, 6, 6]
    assert found.conflict is None
    assert together(found, machines).n_states == synthesize(machines, buffers).automaton.n_states


def test_users_that_wait_for_each_other() -> None:
    """Coffman, Elphick, Shoshani, System deadlocks (1971): each resource is kept well, both users starve."""
    users = [
        from_text("marked idle \n idle -take_a1-> one \n one -take_b1-> both \n both -release1-> idle"),
        from_text("marked idle \n idle -take_b2-> one \n one -take_a2-> both \n both -release2-> idle"),
    ]
    resources = [
        from_text(f"marked free \n free -take_{r}1, take_{r}2-> taken \n taken -release1, release2-> free")
        for r in "ab"
    ]
    found = synthesize_modular(users, resources)
    assert found.conflict == ("take_a1", "take_b2")
    assert found.groups == ((0, 1), (0, 1))
    assert synthesize_modular(users, resources, nonblocking=False).conflict is None
    assert find_conflict(*users, *resources) == ("take_a1", "take_b2")


def test_a_plant_that_nobody_looks_at_can_block() -> None:
    machines = [from_text("marked x \n x -a-> x"), from_text("marked x \n x -b-> stuck")]
    found = synthesize_modular(machines, [from_text("marked s \n s -a-> s")])
    assert found.groups == ((0,),)
    assert found.conflict == ("b",)


def test_plants_that_prevent_what_nobody_controls() -> None:
    """The second plant holds u back for ever; without it the specification could not be kept."""
    one = from_text("uncontrollable u \n 0 -a-> 1 \n 1 -u-> 0")
    two = from_text("events u, c \n uncontrollable u \n initial x \n x -c-> x")
    other = from_text("events c \n initial x")
    spec = from_text("0 -a-> 1")
    found = synthesize_modular([one, two, other], [spec])
    assert found.groups == ((0, 1),)
    assert found.supervisors[0].automaton.n_states == 2


def test_bad_parts() -> None:
    loop, fault = from_text("0 -a-> 0"), from_text("uncontrollable a \n 0 -a-> 0")
    for verb in (find_conflict, is_nonconflicting):
        with pytest.raises(AlphabetError, match="event 'a' is uncontrollable in one automaton"):
            verb(loop, fault)
    ring = from_text("name ring \n 0 -a-> 1 \n 1 -a-> 2 \n 2 -a-> 0")
    with pytest.raises(AutomatonError, match=r"the product of ring \(3\).* has more than 2"):
        synthesize_modular([ring], [ring], max_states=2)

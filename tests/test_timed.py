"""Synthesis with forcible events, and the infimal superlanguage: definitions, libFAUDES, a textbook model."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import combinations

import faudes
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import book
from strategies import UNCONTROLLABLE, automata, languages, models, trie
from supremal import (
    Alphabet,
    AlphabetError,
    Automaton,
    find_uncontrollable,
    from_text,
    is_controllable,
    is_included,
    is_nonblocking,
    is_same_language,
    mark_all,
    prefix_closure,
    sync,
    synthesize,
    universal,
)
from supremal._arrays import NONE
from supremal._jit import COMPILED
from supremal.automata.compose import components
from supremal.synthesis.infimal import infimal_controllable
from supremal.synthesis.timed import synthesize_timed
from test_faudes import from_faudes, lifted, random_automaton, to_faudes

pytestmark = pytest.mark.engine

SIGMA = Alphabet(("a", "b", "u"), UNCONTROLLABLE & {"u"})
LENGTH = 4
BATCHES = range(4)
BATCH = 20 if COMPILED else 2


def forcible_events(events: str = "abu") -> st.SearchStrategy[frozenset[str]]:
    """Events that can be forced; ``v`` is the tick; ``u`` may be forcible all the same."""
    return st.frozensets(st.sampled_from(events))


def with_tick(automaton: Automaton, tick: str) -> Automaton:
    """Over an alphabet that has ``tick``; where it is new it is always possible."""
    return sync(automaton, universal(Alphabet((tick,), frozenset({tick}))))


# --- the definition ---------------------------------------------------------------------------------------


def is_controllable_in_time(
    closure: frozenset[book.Word],
    plant: frozenset[book.Word],
    uncontrollable: set[str],
    forcible: frozenset[str],
) -> bool:
    """After every s ∈ K̄ what nobody controls is allowed, and tick is too or some forcible event is."""

    def next_in(language: frozenset[book.Word], word: book.Word) -> set[str]:
        return {longer[-1] for longer in language if longer[:-1] == word and longer}

    for word in closure:
        can, may = next_in(plant, word), next_in(closure, word)
        if not can & uncontrollable - {"t"} <= may:
            return False
        if "t" in can - may and not may & forcible:
            return False
    return True


def supremal_in_time(
    words: frozenset[book.Word], plant: frozenset[book.Word], forcible: frozenset[str]
) -> frozenset[book.Word]:
    """The union of all controllable sublanguages of a finite language, all 2^|K| tried."""
    found: frozenset[book.Word] = frozenset()
    for n in range(len(words) + 1):
        for chosen in combinations(sorted(words), n):
            if is_controllable_in_time(book.prefixes(chosen), plant, {"u", "t"}, forcible):
                found |= frozenset(chosen)
    return found


@given(languages("aut"), languages("aut", max_size=6), languages("aut", max_size=5), forcible_events("au"))
def test_the_union_of_all_sublanguages_that_come_in_time(
    paths: frozenset[book.Word],
    ends: frozenset[book.Word],
    allowed: frozenset[book.Word],
    forcible: frozenset[str],
) -> None:
    sigma = Alphabet(("a", "u", "t"), frozenset({"u", "t"}))
    possible = book.prefixes(paths | ends)
    plant = trie(sigma, possible)
    marked = [name in {"".join(word) or "ε" for word in ends} for name in plant.state_names]
    plant = replace(plant, marked=np.array(marked, np.bool_))
    found = synthesize_timed(plant, trie(sigma, allowed), forcible=forcible, tick="t").automaton
    expected = supremal_in_time(ends & allowed, possible, forcible)
    assert book.marked_words(book.read(found), 3) == expected
    assert book.generated(book.read(found), 3) == book.prefixes(expected)


@given(languages("aut", max_size=6), languages("aut", max_size=3, max_length=2), forcible_events("au"))
def test_the_union_of_all_closed_ones(
    paths: frozenset[book.Word], allowed: frozenset[book.Word], forcible: frozenset[str]
) -> None:
    sigma = Alphabet(("a", "u", "t"), frozenset({"u", "t"}))
    found = synthesize_timed(
        trie(sigma, paths), trie(sigma, allowed), forcible=forcible, tick="t", nonblocking=False
    )
    both = book.prefixes(paths) & book.prefixes(allowed)
    expected = supremal_in_time(both, book.prefixes(paths), forcible)
    assert book.generated(book.read(found.automaton), 3) == expected


@pytest.mark.parametrize("nonblocking", [True, False])
@settings(max_examples=50)
@given(model=models(), forcible=forcible_events())
def test_what_a_supervisor_in_time_promises(
    model: tuple[Automaton, Automaton], forcible: frozenset[str], *, nonblocking: bool
) -> None:
    plant, spec = model
    plant, spec = with_tick(plant, "v"), sync(spec, universal(Alphabet(("a", "b", "u"), frozenset("u"))))
    supervisor = synthesize_timed(plant, spec, forcible=forcible, tick="v", nonblocking=nonblocking)
    behaviour, alphabet = supervisor.automaton, supervisor.automaton.alphabet
    assert alphabet.uncontrollable == {"u", "v"}
    assert not nonblocking or is_nonblocking(behaviour)
    for q, x in components(plant, behaviour)[1]:
        assert supervisor.plant_state[x] == [q]
    for s, (state,) in enumerate(supervisor.plant_state.tolist()):
        may = {event for e, event in enumerate(alphabet) if behaviour.delta[s, e] != NONE}
        can = {
            event for event in alphabet if event not in plant.alphabet or plant.run([event], state) != NONE
        }
        assert "u" not in can or "u" in may
        assert "v" not in can or "v" in may or may & forcible
        enabled = {event for e, event in enumerate(alphabet) if supervisor.enabled[s, e]}
        assert enabled & can == may
        assert "u" in enabled
    # Between the supervisors for which nobody controls the tick, and somebody does.
    plain = synthesize(plant, spec, nonblocking=nonblocking).automaton
    assert is_included(mark_all(plain), mark_all(behaviour))
    if not forcible:
        assert is_same_language(mark_all(plain), mark_all(behaviour))
        assert is_same_language(plain, behaviour)


# --- a textbook model -------------------------------------------------------------------------------------

BUS = """
    name bus
    uncontrollable tick, pass
    marked gone
    a0 -tick-> a1
    a1 -tick-> a2
    a2 -tick-> a2
    a2 -pass-> gone
    gone -tick-> gone
"""
PEDESTRIAN = """
    name pedestrian
    uncontrollable tick
    marked safe
    r0 -tick-> r1
    r1 -tick-> r1
    r1 -jump-> safe
    safe -tick-> safe
"""
SAVED = """
    name saved
    uncontrollable pass
    marked 2
    0 -jump-> 1
    1 -pass-> 2
"""


def test_the_endangered_pedestrian() -> None:
    """Brandin, Wonham (1994); Wonham, Cai, chapter 9: he jumps before the second tick, or the bus gets him.

    By hand: tick, jump, tick, pass, and ticks while he waits for the bus and when it is gone.
    """
    parts = [from_text(BUS), from_text(PEDESTRIAN)], from_text(SAVED)
    supervisor = synthesize_timed(*parts, forcible={"jump"})
    assert (supervisor.automaton.n_states, supervisor.automaton.n_transitions) == (5, 6)
    assert supervisor.plant_state.tolist() == [[0, 0], [1, 1], [1, 2], [2, 2], [3, 2]]
    monitor = supervisor.monitor()
    assert monitor.enabled == ("tick",)
    assert monitor.observe(["tick"])
    assert monitor.enabled == ("jump",)
    assert not supervisor.enabled[1, supervisor.automaton.alphabet.index("tick")]
    assert not monitor.observe(["tick"])
    assert synthesize_timed(*parts, forcible=()).is_empty


@pytest.mark.parametrize(
    ("forcible", "tick", "message"),
    [
        (["jmp"], "tick", "unknown event 'jmp'; did you mean 'jump'"),
        (["jump"], "tock", "unknown event 'tock'; did you mean 'tick'"),
        (["jump"], "jump", "event 'jump' is controllable, but time passes by itself"),
        (["jump", "tick"], "tick", "event 'tick' stands among the forcible ones"),
    ],
)
def test_events_that_make_no_sense_in_time(forcible: list[str], tick: str, message: str) -> None:
    with pytest.raises(AlphabetError, match=message):
        synthesize_timed(
            [from_text(BUS), from_text(PEDESTRIAN)], from_text(SAVED), forcible=forcible, tick=tick
        )


# --- libFAUDES --------------------------------------------------------------------------------------------

LAST = "z"
"""libFAUDES 2.34 overlooks a disabled tick that comes after all enabled events; so one comes after all."""


def supremal_by_faudes(plant: Automaton, spec: Automaton, forcible: list[str]) -> Automaton:
    """SupTcon, with tick ``v``, on automata with a loop by the event that libFAUDES came to know last."""
    alphabet = sync(plant, spec).alphabet
    loops = universal(Alphabet((*"abcuv", LAST), UNCONTROLLABLE))
    wide = sync(universal(alphabet), universal(Alphabet((LAST,)))).alphabet
    names = {name: faudes.EventSet() for name in ("controllable", "forcible", "preempted")}
    to_faudes(loops)  # so that all other events have lower numbers than the last
    for name in wide:
        if name not in wide.uncontrollable:
            names["controllable"].Insert(name)
    for name in forcible:
        names["forcible"].Insert(name)
    names["preempted"].Insert("v")
    system, generator = (faudes.Generator(lifted(part, wide)) for part in (plant, spec))
    return from_faudes(faudes.SupTcon(system, *names.values(), generator), wide)


@pytest.mark.parametrize("batch", BATCHES)
def test_timed_by_faudes(batch: int) -> None:
    rng, kinds = np.random.default_rng(batch), Counter[str]()
    for _ in range(BATCH):
        plant, spec = with_tick(random_automaton(rng, 0.6, 0.4), "v"), random_automaton(rng, 0.8, 0.8)
        both = sync(plant, spec)
        others = [name for name in both.alphabet if name != "v"]
        forcible = rng.permutation(others)[: rng.integers(0, 3)].tolist()
        found = synthesize_timed(plant, spec, forcible=forcible, tick="v").automaton
        theirs = supremal_by_faudes(plant, spec, forcible)
        ours = sync(found, universal(Alphabet((LAST,))))
        assert is_same_language(ours, theirs)
        assert is_same_language(mark_all(ours), mark_all(theirs))
        kinds["empty" if not found.n_states else "whole" if is_same_language(found, both) else "part"] += 1
    assert not COMPILED or kinds["part"] >= BATCH // 6, kinds


# --- the infimal superlanguage ----------------------------------------------------------------------------


@settings(max_examples=50)
@given(languages(max_size=6), languages(max_size=3, max_length=2))
def test_the_intersection_of_all_controllable_closed_superlanguages(
    paths: frozenset[book.Word], needed: frozenset[book.Word]
) -> None:
    possible = book.prefixes(paths)
    needed = book.prefixes(needed) & possible
    rest = sorted(possible - needed)[:10]
    possible = book.prefixes(needed | frozenset(rest))
    rest = sorted(possible - needed)
    expected = possible
    for n in range(len(rest) + 1):
        for chosen in combinations(rest, n):
            wider = needed | frozenset(chosen)
            if wider == book.prefixes(wider) and book.is_controllable_language(wider, possible, {"u"}):
                expected &= wider
    found = infimal_controllable(trie(SIGMA, possible), trie(SIGMA, needed))
    assert book.generated(book.read(found), 3) == expected
    assert found.marked.all()


@settings(max_examples=50)
@given(models())
def test_what_the_infimal_superlanguage_promises(model: tuple[Automaton, Automaton]) -> None:
    plant, spec = model
    found, both = infimal_controllable(plant, spec), sync(prefix_closure(spec), mark_all(plant))
    assert is_included(both, found)
    assert is_controllable(plant, found)
    assert is_included(found, sync(mark_all(plant), universal(found.alphabet)))
    assert is_same_language(found, both) == (find_uncontrollable(plant, spec) is None)
    again = infimal_controllable(plant, found)
    assert is_same_language(found, again)
    assert found.origin.shape == (found.n_states, 2)
    left = found.origin[:, 1] == NONE
    controllable = found.alphabet.controllable
    assert (found.delta[left][:, controllable] == NONE).all()


@settings(max_examples=50)
@given(automata(), automata(), automata())
def test_the_infimal_superlanguage_is_monotone(plant: Automaton, spec: Automaton, other: Automaton) -> None:
    wide = infimal_controllable(plant, spec)
    narrow = infimal_controllable(plant, sync(mark_all(spec), mark_all(other)))
    if is_nonblocking(spec):
        assert is_included(narrow, sync(wide, universal(narrow.alphabet)))
    parts = infimal_controllable([plant, other], [spec])
    assert parts.origin.shape == (parts.n_states, 3)
    assert is_same_language(parts, infimal_controllable(sync(plant, other), spec))

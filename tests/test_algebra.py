"""Operations on languages, maps between alphabets, least automata: against the definitions of the book."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import book
from strategies import alphabets, automata, words
from supremal import (
    Alphabet,
    AlphabetError,
    Automaton,
    AutomatonError,
    complement,
    difference,
    from_text,
    inverse_project,
    is_included,
    is_isomorphic,
    is_same_language,
    language_union,
    mark_all,
    meet,
    minimise,
    project,
    quotient,
    reachable,
    relabel,
    reverse_language,
    right_quotient,
    shuffle,
    sync,
    trim,
    universal,
)
from supremal.automata import subsets
from supremal.automata.build import empty
from supremal.automata.minimise import equivalence
from supremal.automata.reduce import determinise

pytestmark = pytest.mark.engine

LENGTH = 4
AB = Alphabet(("a", "b"))
few = partial(automata, max_states=3)


def both(automaton: Automaton) -> tuple[set[book.Word], set[book.Word]]:
    """L and Lm up to `LENGTH`, read off the arrays by the book."""
    machine = book.read(automaton)
    return book.generated(machine, LENGTH), book.marked_words(machine, LENGTH)


def table(automaton: Automaton) -> tuple[Any, ...]:
    """All of an automaton but where it comes from."""
    return automaton.alphabet, automaton.delta.tolist(), automaton.marked.tolist()


def same(a: Automaton, b: Automaton) -> bool:
    """Both languages are the same."""
    return is_same_language(a, b) and is_same_language(mark_all(a), mark_all(b))


def permuted(automaton: Automaton, data: st.DataObject) -> Automaton:
    """The same automaton: its states but the initial one in another order, and unreachable copies of them."""
    rest = data.draw(st.permutations(range(1, automaton.n_states)))
    order = np.array([*range(min(1, automaton.n_states)), *rest], np.int64)
    number = np.append(np.argsort(order), -1)
    delta, marked = number[automaton.delta[order]], automaton.marked[order]
    return Automaton(automaton.alphabet, np.vstack([delta, delta]), np.append(marked, marked))


# --- languages as sets ------------------------------------------------------------------------------------


@given(st.lists(few(), min_size=1, max_size=3), st.lists(words(), max_size=8))
def test_meet(parts: list[Automaton], some: list[list[str]]) -> None:
    found = meet(*parts)
    generated, marked = zip(*map(both, parts), strict=True)
    assert both(found) == (set.intersection(*generated), set.intersection(*marked))
    for word in some:
        if set(word) <= set(found.alphabet) and (state := found.run(word)) >= 0:
            assert found.origin[state].tolist() == [part.run(word) for part in parts]


@given(few(), few())
def test_union_and_difference(a: Automaton, b: Automaton) -> None:
    (generated, marked), (other, other_marked) = both(a), both(b)
    union = language_union(a, b)
    assert both(union) == (generated | other, marked | other_marked)
    rest = difference(a, b)
    assert both(rest) == (generated, marked - other_marked)
    for word in generated | other:
        here = [part.run(word) if set(word) <= set(part.alphabet) else -1 for part in (a, b)]
        assert union.origin[union.run(word)].tolist() == here
        if word in generated:
            assert rest.origin[rest.run(word)].tolist() == here


@given(st.lists(few(), max_size=4))
def test_union_of_many(parts: list[Automaton]) -> None:
    generated, marked = set[book.Word](), set[book.Word]()
    for part in parts:
        generated |= both(part)[0]
        marked |= both(part)[1]
    assert both(language_union(*parts)) == (generated, marked)


@settings(max_examples=40)
@given(alphabets(), st.data())
def test_laws_of_sets(sigma: Alphabet, data: st.DataObject) -> None:
    some = few(min_events=len(sigma), max_events=len(sigma))
    a, b, c = (replace(data.draw(some), alphabet=sigma) for _ in range(3))
    assert is_same_language(complement(language_union(a, b)), meet(complement(a), complement(b)))
    assert is_same_language(complement(meet(a, b)), language_union(complement(a), complement(b)))
    assert is_same_language(complement(complement(a)), a)
    assert is_same_language(language_union(a, complement(a)), universal(sigma))
    assert is_same_language(meet(a, complement(a)), empty(sigma))
    assert is_same_language(difference(a, b), meet(a, complement(b)))
    assert same(meet(a, language_union(b, c)), language_union(meet(a, b), meet(a, c)))
    assert same(meet(a, a), a)
    assert same(language_union(a, a), a)
    assert is_isomorphic(meet(a, b), sync(a, b))


def test_of_no_automaton() -> None:
    assert language_union().n_states == 0
    with pytest.raises(AutomatonError, match="meet of no automaton: at least one is needed"):
        meet()


def test_names_say_how_a_result_was_made() -> None:
    a, b = from_text("name A \n 0 -a-> 0"), from_text("name B \n 0 -a-> 0")
    assert [verb(a, b).name for verb in (meet, language_union, difference)] == ["A ∩ B", "A ∪ B", "A \\ B"]
    assert meet(a, from_text("0 -a-> 0")).name == ""


@pytest.mark.parametrize(
    "verb", [meet, language_union, difference, right_quotient, is_isomorphic], ids=lambda verb: verb.__name__
)
def test_an_event_is_controllable_everywhere_or_nowhere(
    verb: Callable[[Automaton, Automaton], object],
) -> None:
    here, there = from_text("0 -drop-> 0"), from_text("uncontrollable drop \n 0 -drop-> 0")
    with pytest.raises(AlphabetError, match="event 'drop' is uncontrollable in one automaton and contr"):
        verb(here, there)


@pytest.mark.parametrize("verb", [meet, language_union, shuffle], ids=lambda verb: verb.__name__)
def test_too_many_states(verb: Callable[..., Automaton]) -> None:
    ring = from_text("0 -a-> 1 \n 1 -a-> 2 \n 2 -a-> 0")
    other = relabel(ring, {"a": "b"}) if verb is shuffle else from_text("0 -a-> 1 \n 1 -a-> 0")
    with pytest.raises(AutomatonError, match="states has more than 2; raise max_states or split it"):
        verb(ring, other, max_states=2)


# --- maps between alphabets -------------------------------------------------------------------------------


@given(automata(), st.data())
def test_project(automaton: Automaton, data: st.DataObject) -> None:
    seen = data.draw(st.frozensets(st.sampled_from(["x", *automaton.alphabet]))) - {"x"}
    found, machine = project(automaton, seen), book.read(automaton)
    assert found.alphabet.names == tuple(name for name in automaton.alphabet if name in seen)
    assert found.alphabet.uncontrollable == automaton.alphabet.uncontrollable & seen
    for word in book.all_words(seen, LENGTH):
        reached = book.estimate(machine, word, seen)
        assert (found.run(word) >= 0) == bool(reached)
        assert found.accepts(word) == bool(reached & machine.marked)
    generated, marked = both(automaton)
    assert all(found.run(book.project(word, seen)) >= 0 for word in generated)
    assert all(found.accepts(book.project(word, seen)) for word in marked)


@given(automata(), st.data())
def test_projections_follow_each_other(automaton: Automaton, data: st.DataObject) -> None:
    events = st.frozensets(st.sampled_from(["x", *automaton.alphabet]))
    one, two = data.draw(events) - {"x"}, data.draw(events) - {"x"}
    assert is_isomorphic(
        minimise(project(project(automaton, one), one & two)), minimise(project(automaton, one & two))
    )
    assert is_isomorphic(project(automaton, automaton.alphabet), automaton)


@given(few(), few())
def test_inverse_project(a: Automaton, b: Automaton) -> None:
    sigma = sync(a, b).alphabet
    backwards = Alphabet(sigma.names[::-1], sigma.uncontrollable)
    wide = inverse_project(a, backwards)
    assert wide.alphabet == backwards
    machine, events = book.read(a), frozenset(a.alphabet)
    for word in book.all_words(sigma, 3):
        assert (wide.run(word) >= 0) == (book.after(machine, book.project(word, events)) is not None)
        assert wide.accepts(word) == (book.after(machine, book.project(word, events)) in machine.marked)
    assert same(project(wide, a.alphabet), a)
    assert is_isomorphic(meet(wide, inverse_project(b, backwards)), sync(a, b))
    back = inverse_project(project(b, set(a.alphabet) & set(b.alphabet)), b.alphabet)
    assert is_included(b, back)
    assert is_included(mark_all(b), mark_all(back))


def test_bad_maps() -> None:
    machine = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault-> idle")
    with pytest.raises(AlphabetError, match="unknown event 'strat'; did you mean 'start'"):
        project(machine, ["fault", "strat"])
    with pytest.raises(AlphabetError, match="must hold the events of the automaton; 'fault' is missing in s"):
        inverse_project(machine, Alphabet(("start", "stop")))
    with pytest.raises(AlphabetError, match="'start' is missing in the empty one"):
        inverse_project(machine, Alphabet(()))
    with pytest.raises(AlphabetError, match="event 'fault' is uncontrollable in one automaton and contr"):
        inverse_project(machine, Alphabet(("start", "fault")))
    with pytest.raises(AlphabetError, match="unknown event 'stop'; known: start, fault"):
        relabel(machine, {"stop": "halt"})
    with pytest.raises(AlphabetError, match="'start' and 'fault' would both be called 'fault'; give each"):
        relabel(machine, {"start": "fault"})
    with pytest.raises(AlphabetError, match="event 'go on' is no name"):
        relabel(machine, {"start": "go on"})


@given(automata(), st.data())
def test_relabel(automaton: Automaton, data: st.DataObject) -> None:
    sigma = automaton.alphabet
    targets = data.draw(st.permutations(["p", "q", "r", *sigma]))
    new = dict(zip(sigma, targets, strict=False))
    found = relabel(automaton, new)
    assert found.alphabet.names == tuple(new.values())
    assert found.alphabet.uncontrollable == {new[name] for name in sigma.uncontrollable}
    assert both(found) == tuple({tuple(new[e] for e in w) for w in language} for language in both(automaton))
    assert table(relabel(found, {value: key for key, value in new.items()})) == table(automaton)


def test_relabel_keeps_what_cannot_be_seen_and_may_exchange_names() -> None:
    sigma = Alphabet(("a", "b", "c"), frozenset("a"), frozenset("b"))
    found = relabel(universal(sigma), {"a": "b", "b": "a"})
    assert found.alphabet == Alphabet(("b", "a", "c"), frozenset("b"), frozenset("a"))
    assert project(universal(sigma), "bc").alphabet == Alphabet(("b", "c"), frozenset(), frozenset("b"))


# --- the least automaton ----------------------------------------------------------------------------------


@given(automata(max_states=6))
def test_minimise_is_least_and_does_the_same(automaton: Automaton) -> None:
    least = minimise(automaton)
    assert same(least, automaton)
    pairs = book.indistinguishable(book.read(least))
    assert pairs == {(s, s) for s in range(least.n_states)}
    assert reachable(least).all()
    assert table(minimise(least)) == table(least)
    assert least.alphabet == automaton.alphabet


@given(automata(max_states=6))
def test_equivalence_is_that_of_the_book(automaton: Automaton) -> None:
    classes = equivalence(automaton).tolist()
    states = range(automaton.n_states)
    assert {(p, q) for p in states for q in states if classes[p] == classes[q]} == book.indistinguishable(
        book.read(automaton)
    )


@given(automata(max_states=5), st.data())
def test_equal_languages_make_the_same_table(automaton: Automaton, data: st.DataObject) -> None:
    least = minimise(automaton)
    assert table(minimise(permuted(automaton, data))) == table(least)
    assert table(minimise(language_union(automaton, least))) == table(least)
    ours, others = minimise(trim(automaton)), minimise(trim(complement(complement(automaton))))
    assert table(ours) == table(others)
    other = data.draw(automata(max_states=5))
    if set(other.alphabet) == set(automaton.alphabet):
        assert is_isomorphic(minimise(other), least) == same(other, automaton)


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(1, 4))
def test_minimise_undoes_copies(seed: int, states: int, copies: int) -> None:
    """Every state stands there several times, and each arrow picks one of the copies of its target."""
    rng = np.random.default_rng(seed)
    delta = np.where(rng.random((states, 2)) < 0.8, rng.integers(0, states, (states, 2)), -1)
    one = Automaton(AB, delta, rng.random(states) < 0.3)
    shape = (states * copies, 2)
    wide = np.tile(delta, (copies, 1))
    blown = np.where(wide >= 0, wide + states * rng.integers(0, copies, shape), -1)
    assert table(minimise(Automaton(AB, blown, np.tile(one.marked, copies)))) == table(minimise(one))


def test_minimise_of_nothing_and_of_no_event() -> None:
    assert minimise(empty(AB)).n_states == 0
    no_event = Automaton(Alphabet(()), np.empty((2, 0)), [True, False])
    assert table(minimise(no_event)) == (Alphabet(()), [[]], [True])
    assert set(equivalence(no_event).tolist()) == {0, 1}


def test_a_long_way_to_tell_two_states_apart() -> None:
    """On a ring with one mark every state is its own class; with marks all round there is one class."""
    ring = np.roll(np.arange(200), -1)[:, None]
    one = Alphabet(("a",))
    assert minimise(Automaton(one, ring, np.arange(200) == 7)).n_states == 200
    assert minimise(Automaton(one, ring, np.arange(200) % 8 == 7)).n_states == 8
    assert minimise(Automaton(one, ring, np.ones(200))).n_states == 1


# --- isomorphism ------------------------------------------------------------------------------------------


@given(automata(max_states=5), st.data())
def test_isomorphic_up_to_the_numbers_of_states_and_events(automaton: Automaton, data: st.DataObject) -> None:
    names = data.draw(st.permutations(automaton.alphabet.names))
    columns = [automaton.alphabet.index(name) for name in names]
    other = permuted(automaton, data)
    other = replace(
        other,
        alphabet=Alphabet(tuple(names), automaton.alphabet.uncontrollable),
        delta=other.delta[:, columns],
    )
    assert is_isomorphic(automaton, other)
    if automaton.n_states:
        assert not is_isomorphic(automaton, replace(other, marked=~other.marked))
        assert not is_isomorphic(automaton, empty(other.alphabet))


def test_not_isomorphic() -> None:
    one = from_text("0 -a-> 1 \n 1 -a-> 0")
    assert is_same_language(one, from_text("0 -a-> 0"))
    assert not is_isomorphic(one, from_text("0 -a-> 0"))
    assert not is_isomorphic(one, from_text("events b \n 0 -a-> 1 \n 1 -a-> 0"))
    assert not is_isomorphic(one, from_text("0 -b-> 1 \n 1 -b-> 0"))


# --- quotients, mirror images, shuffles -------------------------------------------------------------------


@given(automata(), words())
def test_quotient(automaton: Automaton, by: list[str]) -> None:
    prefix = tuple(name for name in by if name in automaton.alphabet)
    found, machine = quotient(automaton, prefix), book.read(automaton)
    generated, marked = both(found)
    for word in book.all_words(automaton.alphabet, LENGTH):
        reached = book.after(machine, prefix + word)
        assert (word in generated) == (reached is not None)
        assert (word in marked) == (reached in machine.marked)
    assert found.n_states == 0 or found.origin[0].tolist() == [automaton.run(prefix)]


def test_quotient_by_an_unknown_event() -> None:
    with pytest.raises(AlphabetError, match="unknown event 'c'; known: a, b"):
        quotient(universal(AB), ["a", "c"])


@given(automata(), automata())
def test_right_quotient(automaton: Automaton, other: Automaton) -> None:
    found, one, two = right_quotient(automaton, other), book.read(automaton), book.read(other)
    shared = one.events & two.events

    def on_shared(machine: book.Machine, initial: book.State) -> book.Machine:
        moves = {(s, e): to for (s, e), to in machine.moves.items() if e in shared}
        return replace(machine, events=shared, uncontrollable=frozenset(), moves=moves, initial=initial)

    assert found.delta.tolist() == automaton.delta.tolist()
    for q in one.states:
        pairs = book.sync(on_shared(one, q), on_shared(two, two.initial))
        assert found.marked[q] == bool(pairs.marked)


@given(automata(max_states=3), automata(max_states=3))
def test_quotients_in_words(a: Automaton, b: Automaton) -> None:
    found, suffixes = right_quotient(a, b), both(b)[1]
    for word in both(a)[1]:
        for n in range(len(word) + 1):
            assert word[n:] not in suffixes or found.accepts(word[:n])
            assert quotient(a, word[:n]).accepts(word[n:])


@given(automata())
def test_mirror_images(automaton: Automaton) -> None:
    found = reverse_language(automaton)
    generated, marked = both(found)
    assert marked == {word[::-1] for word in both(automaton)[1]}
    assert generated == both(mark_all(trim(found)))[0]
    assert table(minimise(found)) == table(found)
    assert table(reverse_language(found)) == table(minimise(trim(automaton)))


@given(few(events="ab", max_events=2), few(events="uv", max_events=2))
def test_shuffle(a: Automaton, b: Automaton) -> None:
    found = shuffle(a, b)
    one, two = both(a), both(b)
    assert both(found) == tuple(
        {
            word
            for word in book.all_words(found.alphabet, LENGTH)
            if book.project(word, frozenset(a.alphabet)) in one[k]
            and book.project(word, frozenset(b.alphabet)) in two[k]
        }
        for k in (0, 1)
    )


def test_a_shuffle_shares_no_event() -> None:
    a, b = from_text("name left \n 0 -x-> 0"), from_text("0 -y-> 0 \n 0 -x-> 1")
    with pytest.raises(AlphabetError, match="event 'x' is in both left and part 2, and a shuffle is of disj"):
        shuffle(a, from_text("0 -z-> 0"), b)
    assert shuffle().n_states == 1


# --- sets of states ---------------------------------------------------------------------------------------


def test_all_subsets_of_a_projection() -> None:
    """Whether the n-th event from the end was an a: 2^n sets, which outgrow every first allowance."""
    n = 11
    delta = np.full((n + 1, 3), -1)
    delta[0] = 0, 0, 1  # the silent guess that the next event is the one
    delta[1, 0] = 2
    for s in range(2, n + 1):
        delta[s, :2] = s + 1 if s < n else -1
    sigma = Alphabet(("a", "b", "guess"))
    found = project(Automaton(sigma, delta, np.arange(n + 1) == n), "ab")
    assert found.n_states == 2 ** (n - 1)
    assert minimise(found).n_states == 2 ** (n - 1)
    for number in range(0, 2**n, 37):
        word = f"{number:0{n}b}".translate({48: "b", 49: "a"})
        assert found.accepts(word) == (word[-(n - 1)] == "a")
    with pytest.raises(AutomatonError, match="has more than 100 sets; raise max_states, or make"):
        project(Automaton(sigma, delta, np.arange(n + 1) == n), "ab", max_states=100)
    with (
        patch.object(subsets, "default_max_states", side_effect=lambda events: 10_000 if events else 50),
        pytest.raises(AutomatonError, match=r"sets, or these do not fit the memory: [\d,]+ members; raise"),
    ):
        project(Automaton(sigma, delta, np.arange(n + 1) == n), "ab")


def test_many_sets_keep_what_is_not_possible() -> None:
    """More than the first allowance holds, and most events of most sets lead nowhere."""
    line = np.full((1_500, 2), -1)
    line[:-1, 0] = np.arange(1, 1_500)
    one = Automaton(AB, line, np.arange(1_500) % 3 == 0)
    assert table(project(one, "ab")) == table(one)


@settings(max_examples=30)
@given(automata(max_states=6, min_events=2))
def test_sets_are_told_apart_where_their_hashes_agree(automaton: Automaton) -> None:
    seen, alike = (
        automaton.alphabet.names[:-1],
        SimpleNamespace(integers=lambda _, __, n: np.zeros(n, np.int64)),
    )
    expected = table(project(automaton, seen))
    with patch.object(np.random, "default_rng", lambda _: alike):
        assert table(project(automaton, seen)) == expected


def test_many_pairs_of_a_right_quotient() -> None:
    """Outgrows the first allowance for pairs, from the goals on as well as on the way."""
    ring, sigma = np.roll(np.arange(60), -1), Alphabet(("a",))
    some, all_ = np.arange(60) == 0, np.ones(60)
    assert right_quotient(
        Automaton(sigma, ring[:, None], some), Automaton(sigma, ring[:, None], all_)
    ).marked.all()
    found = right_quotient(
        Automaton(sigma, ring[:, None], some), Automaton(sigma, ring[:59, None] % 59, all_[:59])
    )
    assert found.marked.all()


def test_determinise_checks_its_numbers() -> None:
    assert determinise(AB, [(0, 0, 1)], [], [1]).n_states == 0
    with pytest.raises(AutomatonError, match="'x': 2 is no number of a state .* or of an event .0 to 1, -1 "):
        determinise(AB, [(0, 2, 1)], [0], [1], name="x")
    with pytest.raises(AutomatonError, match="-1 is no number of a state"):
        determinise(AB, [(0, 0, -1)], [0], [])

"""What a rule says of itself: its class, its shortest words, its events; against all words of a length."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

import book
from strategies import automata
from supremal import (
    Alphabet,
    Automaton,
    AutomatonError,
    from_text,
    inverse_project,
    is_same_language,
    universal,
)
from supremal.automata.build import empty
from supremal.rules.about import MEANING, classify, essence, events_that_matter, example_words, is_touched

AB = Alphabet(("a", "b"))


def parse(text: str) -> Automaton:
    return from_text(text.replace(";", "\n"), alphabet=AB)


SMALL = {
    "anything": (universal(AB), "safety", ["", "a", "b"], [], ""),
    "nothing": (empty(AB), "safety", [], ["", "a", "b"], ""),
    "nothing marked": (parse("marked ; 0 -a-> 0"), "safety", [], ["", "a", "b"], ""),
    "only the empty word": (parse("initial 0"), "safety", [""], ["a", "b", "aa"], "ab"),
    "never a": (parse("0 -b-> 0"), "safety", ["", "b", "bb"], ["a", "aa", "ab"], "a"),
    "in turns": (parse("0 -a-> 1 ; 1 -b-> 0"), "safety", ["", "a", "ab"], ["b", "aa", "ba"], "ab"),
    "some a": (
        parse("marked 1 ; 0 -b-> 0 ; 0 -a-> 1 ; 1 -a, b-> 1"),
        "progress",
        ["a", "aa", "ab"],
        ["", "b", "bb"],
        "a",
    ),
    "a is answered": (
        parse("marked 0 ; 0 -b-> 0 ; 0 -a-> 1 ; 1 -a-> 1 ; 1 -b-> 0"),
        "progress",
        ["", "b", "ab"],
        ["a", "aa", "ba"],
        "ab",
    ),
    "a is answered at once": (
        parse("marked 0 ; 0 -b-> 0 ; 0 -a-> 1 ; 1 -b-> 0"),
        "mixed",
        ["", "b", "ab"],
        ["a", "aa", "ba"],
        "ab",
    ),
    "one a and nothing else": (parse("marked 1 ; 0 -a-> 1"), "mixed", ["a"], ["", "b", "aa"], "ab"),
    "safe but for a dead state": (
        parse("marked 0 ; 0 -b-> 0 ; 0 -a-> dead ; dead -a, b-> dead"),
        "safety",
        ["", "b", "bb"],
        ["a", "aa", "ab"],
        "a",
    ),
    "two states that say the same": (
        parse("0 -a-> 1 ; 1 -a-> 0"),
        "safety",
        ["", "a", "aa"],
        ["b", "ab", "ba"],
        "b",
    ),
}


@pytest.mark.parametrize("case", SMALL)
def test_small_rules(case: str) -> None:
    rule, kind, accepted, rejected, matters = SMALL[case]
    assert classify(rule) == kind
    found = example_words(rule)
    assert ["".join(word) for word in found.accepted] == accepted
    assert ["".join(word) for word in found.rejected] == rejected
    assert "".join(events_that_matter(rule)) == matters
    assert [event for event in "abx" if is_touched(rule, event)] == [*matters]


def test_each_class_has_a_meaning() -> None:
    assert {kind for _, kind, *_ in SMALL.values()} == MEANING.keys()


@given(automata(max_states=3))
def test_the_class_by_all_words(rule: Automaton) -> None:
    """Three states tell words of up to three events apart, and lead to a marked one in two more."""
    machine = book.read(rule)
    good = book.marked_words(machine, 5)
    closure = {word for word in book.prefixes(good) if len(word) <= 3}
    if closure == {word for word in good if len(word) <= 3}:
        expected = "safety"
    elif closure == set(book.all_words(machine.events, 3)):
        expected = "progress"
    else:
        expected = "mixed"
    assert classify(rule) == expected


@given(automata(max_states=3), st.integers(0, 6))
def test_examples_are_the_first_of_all_words(rule: Automaton, count: int) -> None:
    found = example_words(rule, count)
    every = [word for length in range(6) for word in product(rule.alphabet, repeat=length)]
    for words, said in ((found.accepted, True), (found.rejected, False)):
        assert [*words] == [word for word in every if rule.accepts(word) is said][:count] or len(
            words[-1]
        ) > 5
        assert all(rule.accepts(word) is said for word in words)


@given(automata(max_states=3))
def test_events_that_matter_change_some_word(rule: Automaton) -> None:
    """Put the event into all words: two events before it and three behind it tell all states apart."""
    machine = book.read(rule)

    def good(word: book.Word) -> bool:
        return book.after(machine, word) in machine.marked

    before, behind = ([*book.all_words(machine.events, length)] for length in (2, 3))
    expected = tuple(
        event
        for event in rule.alphabet
        if any(good((*u, *v)) != good((*u, event, *v)) for u in before for v in behind)
    )
    assert events_that_matter(rule) == expected


@given(automata())
def test_the_essence_says_the_same(rule: Automaton) -> None:
    core = essence(rule)
    assert is_same_language(inverse_project(core, rule.alphabet), rule)
    assert core.alphabet.uncontrollable <= rule.alphabet.uncontrollable
    assert events_that_matter(core) == core.alphabet.names


def test_many_events() -> None:
    sigma = Alphabet(tuple(f"e{k}" for k in range(2_000)))
    rule = from_text("0 -e1999-> 1 \n 1 -e0-> 0")
    wide = inverse_project(rule, sigma)
    assert classify(wide) == "safety"
    assert events_that_matter(wide) == ("e0", "e1999")
    assert example_words(wide).accepted == ((), ("e1",), ("e2",))
    assert example_words(wide).rejected == (("e0",), ("e0", "e0"), ("e0", "e1"))
    assert example_words(universal(sigma)).rejected == example_words(empty(sigma)).accepted == ()


def test_a_negative_number_of_words() -> None:
    with pytest.raises(AutomatonError, match="-1; 0 or more is needed"):
        example_words(universal(AB), -1)

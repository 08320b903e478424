"""Listing, counting and drawing words, against all words of a length."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import count, islice, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import book
from strategies import automata
from supremal import (
    Alphabet,
    Automaton,
    AutomatonError,
    count_words,
    from_text,
    sample_word,
    shortest_words,
    universal,
    words,
)
from supremal._jit import COMPILED
from supremal.automata.build import empty

pytestmark = pytest.mark.engine

FIBONACCI = from_text("0 -a-> 0 \n 0 -b-> 1 \n 1 -a-> 0")  # no two b in a row


def listed(automaton: Automaton, length: int) -> list[book.Word]:
    """The marked words of one length, in the order of the alphabet: try all."""
    machine = book.read(automaton)
    return [
        word
        for word in product(automaton.alphabet, repeat=length)
        if book.after(machine, word) in machine.marked
    ]


@given(automata(), st.integers(0, 5))
def test_words_and_their_number(automaton: Automaton, length: int) -> None:
    expected = listed(automaton, length)
    assert list(words(automaton, length)) == expected
    assert count_words(automaton, length) == len(expected)
    drawn = {sample_word(automaton, length, seed) for seed in range(4)}
    assert drawn <= set(expected) if expected else drawn == {None}


@given(automata(), st.integers(0, 12))
def test_shortest_words(automaton: Automaton, n: int) -> None:
    expected: list[book.Word] = []
    for length in range(6):
        expected += listed(automaton, length)
    found = shortest_words(automaton, n)
    assert found[: len(expected)] == expected[:n]
    assert len(found) <= n
    assert len(set(found)) == len(found)
    assert all(map(automaton.accepts, found))
    if len(found) < n:  # then there are no more: none is as long as there are states
        assert all(len(word) < automaton.n_states for word in found)
        assert not any(count_words(automaton, length) for length in range(4, 10))


@given(automata(), st.integers(0, 40))
def test_long_words_are_counted_exactly(automaton: Automaton, length: int) -> None:
    """Forwards, with integers of Python: how many words lead to each state."""
    machine = book.read(automaton)
    ways = Counter({machine.initial: 1} if machine.initial is not None else {})
    for _ in range(length):
        after = Counter[book.State]()
        for (source, _event), to in machine.moves.items():
            after[to] += ways[source]
        ways = after
    assert count_words(automaton, length) == sum(ways[state] for state in machine.marked)


def test_counts_of_many_digits() -> None:
    sigma = universal(Alphabet(tuple("abcdefg")))
    assert [count_words(sigma, n) for n in (0, 1, 11, 12, 22, 23, 200)] == [
        7**n for n in (0, 1, 11, 12, 22, 23, 200)
    ]
    word = sample_word(sigma, 200, seed=3)
    assert word is not None
    assert set(word) == set("abcdefg")


def test_words_are_lazy_and_enter_no_dead_end() -> None:
    assert next(words(universal(Alphabet(("a", "b"))), 3_000)) == ("a",) * 3_000
    trap = from_text(
        "marked end \n start -a, b-> swamp \n swamp -a, b-> swamp \n start -c-> good \n good -c-> good \n"
        "good -d-> end \n end -a-> lost \n lost -a-> lost"
    )
    assert list(words(trap, 60)) == [("c",) * 59 + ("d",)]  # 2^60 words through the swamp
    assert shortest_words(trap, 3) == [("c",) * n + ("d",) for n in (1, 2, 3)]


def test_long_words_are_few_steps() -> None:
    """The only word is as long as the automaton, and the next one takes another round."""
    states = 1_500 if COMPILED else 60
    ring = Automaton(
        Alphabet(("a",)), np.roll(np.arange(states), -1)[:, None], np.arange(states) == states - 1
    )
    assert [len(word) for word in shortest_words(ring, 3)] == [states - 1, 2 * states - 1, 3 * states - 1]
    assert [count_words(ring, n) for n in (3, states - 1, states)] == [0, 1, 0]


def test_the_shortest_of_very_many() -> None:
    """2^40 words, all of one length: those that come too late at a state are not followed up."""
    line = np.tile(np.append(np.arange(1, 41), -1)[:, None], 2)
    found = shortest_words(Automaton(Alphabet(("a", "b")), line, np.arange(41) == 40), 3)
    assert [word[-2:] for word in found] == [("a", "a"), ("a", "b"), ("b", "a")]
    assert {word[:-2] for word in found} == {("a",) * 38}


def test_the_shortest_go_on_where_words_does() -> None:
    every = (word for length in count() for word in words(FIBONACCI, length))
    assert shortest_words(FIBONACCI, 500) == list(islice(every, 500))


def test_draws_are_uniform() -> None:
    """Chi-square over 34 words: below 67.6 with probability 0.9996."""
    drawn = Counter(sample_word(FIBONACCI, 7, seed) for seed in range(34 * 30))
    assert set(drawn) == set(words(FIBONACCI, 7))
    assert sum((n - 30) ** 2 / 30 for n in drawn.values()) < 67.6
    assert sample_word(FIBONACCI, 50, 1) == sample_word(FIBONACCI, 50, 1) != sample_word(FIBONACCI, 50, 2)


def test_of_nothing() -> None:
    nothing = empty(Alphabet(("a",)))
    assert list(words(nothing, 0)) == shortest_words(nothing, 3) == []
    assert (count_words(nothing, 0), sample_word(nothing, 0, 0)) == (0, None)
    silent = universal(Alphabet(()))
    assert (list(words(silent, 0)), list(words(silent, 1)), shortest_words(silent, 2)) == ([()], [], [()])
    assert (count_words(silent, 0), count_words(silent, 1), sample_word(silent, 0, 0)) == (1, 0, ())


@pytest.mark.parametrize(
    ("verb", "says"),
    [
        pytest.param(words, "the length of a word is -1; 0 or more is needed", id="words"),
        pytest.param(count_words, "the length of a word is -1; 0 or more", id="count"),
        pytest.param(lambda a, n: sample_word(a, n, 0), "the length of a word is -1", id="sample"),
        pytest.param(shortest_words, "a number of words is -1; 0 or more is needed", id="shortest"),
    ],
)
def test_less_than_nothing(verb: Callable[[Automaton, int], object], says: str) -> None:
    with pytest.raises(AutomatonError) as error:
        verb(FIBONACCI, -1)
    assert says in str(error.value)

"""How people say it: safe and unsafe sequences, against what the definitions say word for word."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given

import book
from strategies import alphabets, automata, trie, unsafe_sequences
from supremal import (
    Alphabet,
    AlphabetError,
    Automaton,
    RuleError,
    complete_factors,
    complete_safe,
    complete_unsafe,
    from_text,
    is_same_language,
    mark_all,
    rule_from_safe,
    rule_from_unsafe,
    sync,
    universal,
)
from supremal.automata.build import empty
from supremal.rules.sequences import cut_marked

pytestmark = pytest.mark.engine

LENGTH = 5
H_1 = """
    name no U-turn
    initial 0
    marked s_a
    0 -r-> 1
    0 -l-> 2
    1 -r-> s_a
    2 -l-> s_a
"""
FIGURE_5 = (
    H_1
    + """
    0 -f, b-> 0
    1 -l-> 2
    2 -r-> 1
    1 -f, b-> 0
    2 -f, b-> 0
    s_a -l, r, f, b-> s_a
"""
)
G_S_PRIME = """
    initial w0
    uncontrollable d_u
    w0 -d_u-> w1
    w1 -d2-> w2
    w2 -d3-> w3
    w3 -p1-> w4
    w4 -p2-> w5
    w5 -p3-> w0
"""


# --- unsafe sequences -------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", book.named(book.table("rules")))
def test_textbook_cases(case: dict[str, Any]) -> None:
    unsafe = trie(Alphabet(tuple(case["events"])), case["unsafe"], name=case["name"])
    rule, flagged = rule_from_unsafe(unsafe), complete_factors(unsafe)
    assert flagged.n_states == case["states"]
    assert flagged.name == rule.name == case["name"]
    assert (flagged.delta >= 0).all()
    for word in case["allowed"]:
        assert rule.accepts(word), word
    for word in case["forbidden"]:
        assert rule.run(word) == -1, word


def test_the_literal_construction_forgets_overlaps() -> None:
    aab = from_text("marked 3 \n 0 -a-> 1 \n 1 -a-> 2 \n 2 -b-> 3")
    literal, right = complete_unsafe(aab), complete_factors(aab)
    assert literal.accepts("aab")
    assert right.accepts("aab")
    assert not literal.accepts("aaab")
    assert right.accepts("aaab")
    assert cut_marked(literal).run("aaab") != -1
    assert rule_from_unsafe(aab).run("aaab") == -1


def test_the_paper_h_from_h_1() -> None:
    """Figure 5 keeps the overlap l r r, so it is the right completion and not the literal one."""
    sigma = Alphabet(tuple("lrfb"))
    unsafe, figure = from_text(H_1), from_text(FIGURE_5, alphabet=sigma)
    rule = rule_from_unsafe(unsafe, sigma)
    assert rule.n_states == 3
    assert is_same_language(rule, cut_marked(figure))
    for word in book.all_words(sigma, LENGTH):
        assert figure.accepts(word) == book.has_factor(word, {("l", "l"), ("r", "r")})
    assert cut_marked(complete_unsafe(unsafe, sigma)).accepts("lrr")


@given(unsafe_sequences())
def test_factors_by_their_definition(unsafe: Automaton) -> None:
    sequences = book.marked_words(book.read(unsafe), LENGTH)
    flagged, rule = complete_factors(unsafe), rule_from_unsafe(unsafe)
    for word in book.all_words(unsafe.alphabet, LENGTH):
        ends = any(word[i:] in sequences for i in range(len(word) + 1))
        assert flagged.accepts(word) == ends
        assert rule.accepts(word) == (rule.run(word) != -1) == (not book.has_factor(word, sequences))


@given(unsafe_sequences(), alphabets())
def test_events_that_h_1_does_not_have_break_a_sequence(unsafe: Automaton, more: Alphabet) -> None:
    sequences = book.marked_words(book.read(unsafe), 4)
    rule = rule_from_unsafe(unsafe, more)
    assert set(rule.alphabet) == {*unsafe.alphabet, *more}
    for word in book.all_words(rule.alphabet, 4):
        assert rule.accepts(word) == (not book.has_factor(word, sequences))


@given(automata(min_states=1), alphabets())
def test_the_literal_construction_step_by_step(unsafe: Automaton, more: Alphabet) -> None:
    machine, literal = book.read(unsafe), complete_unsafe(unsafe, more)
    for word in book.all_words(literal.alphabet, 4):
        state = 0
        for event in word:
            state = machine.moves.get((state, event), 0)
        assert literal.run(word) == state
        assert literal.accepts(word) == (state in machine.marked)


@given(unsafe_sequences())
def test_the_literal_construction_flags_no_safe_word_of_a_tree(unsafe: Automaton) -> None:
    """On a tree it may miss an unsafe sequence, but what it flags has just ended in one."""
    sequences = {word for word in book.marked_words(book.read(unsafe), 3) if word}
    tree = trie(unsafe.alphabet, sequences)
    if tree.n_states:
        literal, right = complete_unsafe(tree), complete_factors(tree)
        for word in book.all_words(unsafe.alphabet, 4):
            assert right.accepts(word) or not literal.accepts(word)


def test_two_rules_together_forbid_what_either_forbids() -> None:
    sigma = Alphabet(("a", "b"))
    aa, bb = (rule_from_unsafe(trie(sigma, [word])) for word in ("aa", "bb"))
    assert is_same_language(sync(aa, bb), rule_from_unsafe(trie(sigma, ["aa", "bb"])))


def test_nothing_unsafe() -> None:
    sigma = Alphabet(("a", "b"))
    for unsafe in (empty(sigma), trie(sigma, [])):
        assert is_same_language(rule_from_unsafe(unsafe), universal(sigma))


def test_the_empty_word_cannot_be_unsafe() -> None:
    with pytest.raises(
        RuleError, match="rule 'always' forbids the empty word, which every word contains; unmark"
    ):
        rule_from_unsafe(from_text("name always \n 0 -a-> 1"))


@pytest.mark.parametrize("complete", [complete_factors, complete_unsafe, rule_from_unsafe])
def test_an_alphabet_that_disagrees(complete: Any) -> None:
    with pytest.raises(AlphabetError, match="event 'l' is uncontrollable in one automaton"):
        complete(from_text(H_1), Alphabet(("l",), frozenset({"l"})))


# --- safe sequences ---------------------------------------------------------------------------------------


def test_the_paper_g_s_from_g_s_prime() -> None:
    g_s = complete_safe(from_text(G_S_PRIME))
    assert g_s.state_names == ("w0", "w1", "w2", "w3", "w4", "w5", "s_a")
    assert np.flatnonzero(g_s.marked).tolist() == [6]
    assert (g_s.delta[6] == 6).all()
    assert not g_s.accepts(["d_u", "d2", "d3", "p1", "p2", "p3", "d_u"])
    for event in ("d_u", "d3", "p1", "p2", "p3"):
        assert g_s.accepts(["d_u", event])


@given(automata(min_states=1))
def test_safe_completion_flags_what_is_not_generated(safe: Automaton) -> None:
    flagged, rule = complete_safe(safe), rule_from_safe(safe)
    generated = book.generated(book.read(safe), 4)
    for word in book.all_words(safe.alphabet, 4):
        assert flagged.accepts(word) == (word not in generated)
        assert rule.accepts(word) == (word in generated)
    assert is_same_language(cut_marked(flagged), rule)
    assert is_same_language(rule, mark_all(safe))


@given(automata(max_states=5))
def test_cutting_off_the_marked_states(automaton: Automaton) -> None:
    machine = book.read(automaton)
    allowed = {
        word
        for word in book.generated(machine, 4)
        if not any(book.after(machine, prefix) in machine.marked for prefix in book.prefixes([word]))
    }
    rule = book.read(cut_marked(automaton))
    assert book.apart(book.marked_words(rule, 4), allowed) is None
    assert book.apart(book.generated(rule, 4), allowed) is None

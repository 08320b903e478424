"""Regular expressions over events: against their definition on sets of words, and another program."""

from __future__ import annotations

import operator
import random
from typing import Any

import numpy as np
import pytest

import book
from supremal import Alphabet, Automaton, FormatError, RuleError, SupremalError, minimise, trim
from supremal.rules.existence import absence
from supremal.rules.ltlf import rule_from_ltlf
from supremal.rules.regex import rule_from_regex, sentence_of_regex

ABC = Alphabet(("a", "b", "c"))
LENGTH = 4
WORDS = frozenset(book.all_words(ABC, LENGTH))
Language = frozenset[book.Word]


def marked(text: str) -> Language:
    return frozenset(book.marked_words(book.read(rule_from_regex(text, ABC)), LENGTH))


def spelled(*texts: str) -> Language:
    return frozenset(tuple(text) for text in texts)


# --- a table ----------------------------------------------------------------------------------------------

CASES = [
    ("a", spelled("a")),
    ("a b", spelled("ab")),
    ("a\tb\n", spelled("ab")),
    ("a|b c", spelled("a", "bc")),
    ("(a|b) c", spelled("ac", "bc")),
    ("a b & . b | c", spelled("ab", "c")),
    (".", spelled("a", "b", "c")),
    ("[a c]", spelled("a", "c")),
    ("[^ a c ]", spelled("b")),
    ("[^a b c]", spelled()),
    ("()", spelled("")),
    ("a () b", spelled("ab")),
    ("(()|a)", spelled("", "a")),
    ("a{3}", spelled("aaa")),
    ("a{3,}", spelled("aaa", "aaaa")),
    ("a{ 1 , 2 }", spelled("a", "aa")),
    ("a{0}", spelled("")),
    ("a b{2}", spelled("abb")),
    ("(a b){2}", spelled("abab")),
    ("a?{2}", spelled("", "a", "aa")),
    ("(a{2}){2}", spelled("aaaa")),
    ("(a{2,}){1,2}?", spelled("", "aa", "aaa", "aaaa")),
    ("a**+?", spelled("", "a", "aa", "aaa", "aaaa")),
    ("~.*", spelled()),
    ("~~a", spelled("a")),
    ("~()", WORDS - spelled("")),
    ("~a*", WORDS - spelled("", "a", "aa", "aaa", "aaaa")),
    ("~(.* [b c] .*)", spelled("", "a", "aa", "aaa", "aaaa")),
    ("~.{2,} & ~[b c]", spelled("", "a")),
    ("'a' \"b\"", spelled("ab")),
]


@pytest.mark.parametrize(("text", "language"), CASES)
def test_cases(text: str, language: Language) -> None:
    assert marked(text) == language


def test_names() -> None:
    names = ("11", "d_u", "start1", "größe", "a.b", "go-on", "it's", '"', "|", "*")
    text = """11 d_u start1 größe 'a.b' "go-on" "it's" '"' "|" '*'"""
    rule = rule_from_regex(text, Alphabet(names), name="all")
    assert rule.accepts(names)
    assert (rule.n_states, rule.name) == (11, "all")


def test_it_is_over_the_whole_alphabet_and_keeps_its_properties() -> None:
    sigma = Alphabet(("a", "b", "u"), frozenset("u"), frozenset("b"))
    assert rule_from_regex("a", sigma).alphabet == sigma


def test_without_events() -> None:
    nothing = Alphabet(())
    assert [rule_from_regex(text, nothing).n_states for text in ("()", ".*", "~()", ".")] == [1, 1, 0, 0]


# --- random expressions -----------------------------------------------------------------------------------


class Expression:
    """A text, how tightly it holds together (0: a | ... 4: an atom), and its words by definition."""

    def __init__(self, text: str, level: int, words: Language) -> None:
        self.text, self.level, self.words = text, level, words

    def at(self, level: int) -> str:
        """As an operand that has to hold together this tightly."""
        return self.text if self.level >= level else f"({self.text})"


def concatenated(left: Language, right: Language) -> Language:
    return frozenset(v + w for v in left for w in right if len(v + w) <= LENGTH)


def repeated(words: Language, least: int, most: int | None) -> Language:
    """A word of at most LENGTH events is made of so many parts that are not empty."""
    powers = [frozenset({()})]
    for _ in range(max(least, LENGTH) if most is None else most):
        powers.append(concatenated(powers[-1], words))
    return frozenset().union(*powers[least:])


def atom(rng: random.Random) -> Expression:
    names = rng.sample("abc", rng.randint(1, 3))
    chosen = frozenset((name,) for name in names)
    singles = frozenset((name,) for name in "abc")
    return rng.choice(
        [
            Expression(names[0], 4, spelled(names[0])),
            Expression(".", 4, singles),
            Expression(f"[{' '.join(names)}]", 4, chosen),
            Expression(f"[^{' '.join(names)}]", 4, singles - chosen),
            Expression("()", 4, spelled("")),
        ]
    )


def expression(rng: random.Random, size: int, *, common: bool = False) -> Expression:
    """An expression of about ``size`` operators; ``common`` to all grammars: all in brackets, and no ~."""
    if size <= 0:
        return atom(rng)
    kind = rng.choice(["or", "and", "then", "then", "repeat", "not"])
    if kind == "repeat" or (kind == "not" and common):
        body = expression(rng, size - 1, common=common)
        least, more = rng.randint(0, 3), rng.randint(0, 3)
        sign, least, most = rng.choice(
            [
                ("*", 0, None),
                ("+", 1, None),
                ("?", 0, 1),
                (f"{{{least}}}", least, least),
                (f"{{{least},}}", least, None),
                (f"{{{least},{least + more}}}", least, least + more),
            ]
        )
        return Expression(body.at(4) + sign, 4, repeated(body.words, least, most))
    if kind == "not":
        body = expression(rng, size - 1)
        return Expression(f"~{body.at(3)}", 3, WORDS - body.words)
    cut = rng.randint(0, size - 1)
    left, right = (expression(rng, n, common=common) for n in (cut, size - 1 - cut))
    sign, level, combine = {
        "or": ("|", 0, operator.or_),
        "and": ("&", 1, operator.and_),
        "then": (" ", 2, concatenated),
    }[kind]
    text = left.at(level) + sign + right.at(level)
    return Expression(text, -1 if common else level, combine(left.words, right.words))


@pytest.mark.parametrize("block", range(10))
def test_random_expressions_against_their_definition(block: int) -> None:
    rng = random.Random(block)  # noqa: S311 - drawn to be repeated
    for _ in range(100):
        drawn = expression(rng, rng.randint(0, 12))
        rule = rule_from_regex(drawn.text, ABC)
        assert book.marked_words(book.read(rule), LENGTH) == drawn.words, drawn.text
        least = minimise(trim(rule))
        assert np.array_equal(rule.delta, least.delta), drawn.text
        assert np.array_equal(rule.marked, least.marked), drawn.text


def test_random_expressions_against_automata_lib() -> None:
    dfa = pytest.importorskip("automata.fa.dfa")
    nfa = pytest.importorskip("automata.fa.nfa")
    rng = random.Random(1)  # noqa: S311 - drawn to be repeated
    compared = 0
    while compared < 1000:
        text = expression(rng, rng.randint(0, 8), common=True).text
        if "[" in text or "{0}" in text or "{0,0}" in text:
            continue  # another syntax there; and a{0} matches a
        theirs = dfa.DFA.from_nfa(nfa.NFA.from_regex(text.replace(" ", ""), input_symbols=set("abc")))
        machine = book.read(rule_from_regex(text, ABC))
        ours = dfa.DFA(
            states=machine.states | {book.LOST},
            input_symbols=machine.events,
            transitions={
                s: {e: machine.moves.get((s, e), book.LOST) for e in machine.events}
                for s in machine.states | {book.LOST}
            },
            initial_state=book.LOST if machine.initial is None else machine.initial,
            final_states=machine.marked,
        )
        assert ours == theirs, text
        compared += 1


# --- size -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["[^e1]* (e1 [^e1]* e2 [^e1]*)*", "~(.* e3 . e3 .*)", ". & ~[e1 e2]", "e4"])
def test_many_events_cost_no_more_than_few(text: str) -> None:
    few, many = (rule_from_regex(text, Alphabet(tuple(f"e{i}" for i in range(n)))) for n in (20, 2000))
    others = np.repeat(few.delta[:, :1], 1980, axis=1)
    assert np.array_equal(many.delta, np.hstack([few.delta, others]))
    assert np.array_equal(many.marked, few.marked)


def test_counts_are_not_written_out() -> None:
    assert rule_from_regex("a{1000}", ABC).n_states == 1001
    assert rule_from_regex("(a b{10,1000} | c)*", ABC).n_states == 1001
    assert rule_from_regex("a{100000}{100000} & ~.*", ABC).n_states == 0


def test_long_and_deep_texts() -> None:
    rule = rule_from_regex(" ".join("abc"[i % 3] for i in range(9_000)), ABC)
    assert rule.n_states == 9_001
    assert rule_from_regex("|".join(["a", "a b"] * 10_000), ABC).n_states == 3
    assert rule_from_regex("~" * 20_000 + "a" + "*?" * 20_000, ABC).n_states == 1
    assert rule_from_regex("(b " * 30 + "a" + ")*" * 30, ABC).n_states == 31
    assert rule_from_regex("(b | c " * 100 + "a" + ")" * 100, ABC).n_states == 102


ENDLESS = [
    "a{10000}",
    "(.* a .{200}){3}",
    "~(a* b*){200} & ~((.* a){100} | c a*){200}",
    "(a? b? c?){3000}",
    "a? " * 20_000,
    ".* a " * 10_000,
    "(" * 99 + "a" + "{0,1000} b)" * 99,
    "~(" * 99 + "a" + "{0,1000} b)*" * 99,
    "(a{1,1000} | b{1,1000} | c{1,1000}){1,1000}",
    " & ".join(f"(.* a .{{{k}}})*" for k in range(1, 60)),
]


@pytest.mark.parametrize("text", ENDLESS, ids=lambda text: text[:20])
def test_too_much_work_is_an_error_that_names_the_rule(text: str) -> None:
    with pytest.raises(RuleError, match="rule 'mine' (unfolds to more than|takes too many steps)"):
        rule_from_regex(text, ABC, name="mine")


def test_too_many_states() -> None:
    assert rule_from_regex("a{8}", ABC, max_states=10).n_states == 9
    with pytest.raises(RuleError, match="rule 'mine' unfolds to more than 9 states.*max_states"):
        rule_from_regex("a{9}", ABC, name="mine", max_states=9)


# --- errors -----------------------------------------------------------------------------------------------

ERRORS = [
    ("", 1, "it ends too early"),
    ("  ", 3, "it ends too early"),
    ("a |", 4, "it ends too early"),
    ("a & | b", 5, "unexpected '|'"),
    ("| a", 1, "unexpected '|'"),
    ("* a", 1, "unexpected '*'"),
    ("{2} a", 1, "unexpected '{2}'"),
    ("~", 2, "it ends too early"),
    ("~* a", 2, "unexpected '*'"),
    ("(a b", 5, "')' is missing"),
    ("a b)", 4, "unexpected ')'"),
    ("( ", 3, "it ends too early"),
    ("[a b", 5, "it ends too early"),
    ("[]", 2, "unexpected ']'"),
    ("[^]", 3, "unexpected ']'"),
    ("[a .]", 4, "unexpected '.'"),
    ("[a, b]", 3, "unexpected ','"),
    ("a ^ b", 3, "unexpected '^'"),
    ("a ]", 3, "unexpected ']'"),
    ("a $ b", 3, "unexpected '$'"),
    ("a 'b c", 3, "a quote that is not closed"),
    ("a {2", 3, "unexpected '{'"),
    ("a{}", 2, "'{}' is no count"),
    ("a{,3}", 2, "'{,3}' is no count"),
    ("a{2 3}", 2, "'{2 3}' is no count"),
    ("a{-1}", 2, "'{-1}' is no count"),
    ("a{1111111111}", 2, "'{1111111111}' is no count"),
    ("a b{3,2}", 4, "{3,2} asks for at least 3 and at most 2"),
    ("a{100001}", 2, "{100001} counts further than 100,000"),
    ("a{1,100001}", 2, "{1,100001} counts further than 100,000"),
    ("a ab", 3, "unknown event 'ab'; did you mean 'b'?"),
    ("[a x]", 4, "unknown event 'x'; known: a, b, c"),
    ("a '' b", 3, "unknown event ''; known: a, b, c"),
    ("(" * 101 + "a" + ")" * 101, 102, "more than 100 levels of nesting"),
    ("a " * 50_001, 100_001, "100,002 characters"),
]


@pytest.mark.parametrize(("text", "column", "problem"), ERRORS, ids=lambda value: str(value)[:20])
def test_errors(text: str, column: int, problem: str) -> None:
    for name, path in [("", "expression"), ("mine", "mine")]:
        with pytest.raises(FormatError) as caught:
            rule_from_regex(text, ABC, name=name)
        error = caught.value
        assert (error.path, error.line, error.column) == (path, 1, column)
        assert str(error).startswith(f"{path}:1:{column}: {problem}")
        assert len(str(error)) < 400
    with pytest.raises(FormatError):
        sentence_of_regex(text, ABC)


def test_a_list_is_no_alphabet() -> None:
    says = r"alphabet is \['up', 'left'\]; an Alphabet is needed: Alphabet\(\[\.\.\.\]\)"
    words: Any = ["up", "left"]
    with pytest.raises(RuleError, match=says):
        rule_from_regex("left", words)
    with pytest.raises(RuleError, match=says):
        rule_from_ltlf("G left", words)
    with pytest.raises(RuleError, match=says):
        absence("left", alphabet=words)
    with pytest.raises(RuleError, match="alphabet is None; an Alphabet is needed"):
        absence("left", alphabet=None)  # type: ignore[arg-type]


def test_errors_say_the_line() -> None:
    with pytest.raises(FormatError, match="expression:2:4: unexpected '\\)'"):
        rule_from_regex("a b\n | ) c", ABC)


@pytest.mark.parametrize("block", range(6))
def test_any_text_is_a_rule_or_an_error(block: int) -> None:
    rng = random.Random(block)  # noqa: S311 - drawn to be repeated
    signs = [*"abcx().|&~*+?[]^{}, '\"019\\$é\n\t", "{2}", "{1,3}", "{2,}", "((", "))", "[^", "]*"]
    for _ in range(500):
        pieces = list(expression(rng, rng.randint(0, 10)).text)
        for _ in range(rng.randint(1, 6)):
            at = rng.randint(0, len(pieces))
            pieces[at : at + rng.randint(0, 2)] = rng.choices(signs, k=rng.randint(0, 2))
        text = "".join(pieces)
        try:
            assert isinstance(rule_from_regex(text, ABC, max_states=50), Automaton)
            assert sentence_of_regex(text, ABC).endswith(".")
        except SupremalError:
            pass


# --- sentences --------------------------------------------------------------------------------------------

SENTENCES = [
    ("(a b)*", "any number of times (a, then b)"),
    ("a", "a"),
    ("()", "nothing"),
    ("a . [^b] [^b c]", "a, then any event, then any event other than b, then any event other than b or c"),
    ("a* b+ c?", "any number of a, then at least one b, then at most one c"),
    (".* .+ .{1}", "any number of events, then at least one event, then one event"),
    ("a{3} b{2,} c{2,4} a{0,5}", "3 a, then at least 2 b, then 2 to 4 c, then at most 5 a"),
    (
        "(a b){3} (a b)? (a b)+",
        "3 times (a, then b), then at most once (a, then b), then at least once (a, then b)",
    ),
    ("[a b]{2} [a b]", "2 times (a or b), then (a or b)"),
    ("a|b c|()", "a, (b, then c) or nothing"),
    ("a b & ~c", "both (a, then b) and anything but c"),
    ("a & b & .", "all of a, b and any event"),
    ("~(.* a a .*)", "anything but (any number of events, then a, then a, then any number of events)"),
    ("(a*)*", "any number of times (any number of a)"),
]


@pytest.mark.parametrize(("text", "said"), SENTENCES)
def test_sentences(text: str, said: str) -> None:
    assert sentence_of_regex(text, ABC) == f"The events are, from beginning to end: {said}."


def test_a_long_expression_is_quoted() -> None:
    text = " ".join("abc" * 9)
    assert sentence_of_regex(f"  {text}\n b", ABC) == f"The events match `{text} b` from beginning to end."

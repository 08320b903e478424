"""LTLf and past LTL over events: against the definitions word for word, another program, and dualities."""

from __future__ import annotations

import random
import shutil
import time
from collections.abc import Iterable
from functools import reduce
from itertools import product
from operator import and_, or_
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import book
from supremal import (
    Alphabet,
    Automaton,
    FormatError,
    RuleError,
    SupremalError,
    is_isomorphic,
    is_same_language,
    minimise,
    trim,
)
from supremal._jit import COMPILED
from supremal.rules.ltlf import rule_from_ltlf, sentence_of_ltlf

pytestmark = pytest.mark.engine

ABC = Alphabet(("a", "b", "c"))
LENGTH = 6
WORDS = [np.array(list(product(range(3), repeat=n)), np.int64).reshape(3**n, n).T for n in range(LENGTH + 1)]
"""All words of each length, ``[n, 3 ** n]``: column w is a word."""

Truth = np.ndarray[Any, np.dtype[np.bool_]]


# --- formulas as trees, and what they mean ----------------------------------------------------------------

LEVEL = {"<->": 0, "->": 1, "|": 2, "&": 3, **dict.fromkeys("UWRMSBT", 4), **dict.fromkeys("!XNFGYZOH", 5)}
SPELLINGS = {
    "<->": ("<->", "<=>", "↔"),
    "->": ("->", "=>", "→"),
    "|": ("|", "||", "or", "∨"),
    "&": ("&", "&&", "and", "∧"),
    "!": ("!", "~", "not ", "¬"),
    "N": ("N", "WX"),
}


class Formula(NamedTuple):
    """An operator, its bound, its parts; of an event the events are in its name."""

    op: str
    parts: tuple[Formula, ...] = ()
    bound: int | None = None


def truth(formula: Formula, words: np.ndarray[Any, Any]) -> Truth:
    """Where ``formula`` holds, ``bool [max(n, 1), W]``: a row a moment, straight from the definitions."""
    op, parts, bound = formula
    n, count = words.shape
    no, yes = np.zeros(count, np.bool_), np.ones(count, np.bool_)
    below = [truth(part, words) for part in parts]
    p, q = (below[0], below[-1]) if below else (no, no)

    def some(rows: Iterable[Truth]) -> Truth:
        return reduce(or_, rows, no)

    def all_(rows: Iterable[Truth]) -> Truth:
        return reduce(and_, rows, yes)

    def at(i: int) -> Truth:
        far = n if bound is None else bound
        ahead = range(i, min(n, i + far + 1))
        back = range(max(0, i - far), i + 1) if i < n else range(0)
        match op:
            case "true":
                return yes
            case "false":
                return no
            case "!":
                return ~p[i]
            case "&":
                return p[i] & q[i]
            case "|":
                return p[i] | q[i]
            case "->":
                return ~p[i] | q[i]
            case "<->":
                return p[i] == q[i]
            case "X":
                return p[i + 1] if i + 1 < n else no
            case "N":
                return p[i + 1] if i + 1 < n else yes
            case "Y":
                return p[i - 1] if 0 < i < n else no
            case "Z":
                return p[i - 1] if 0 < i < n else yes
            case "F":
                return some(p[j] for j in ahead)
            case "G":
                return all_(p[j] for j in ahead)
            case "O":
                return some(p[j] for j in back)
            case "H":
                return all_(p[j] for j in back)
            case "U":
                return some(q[j] & all_(p[i:j]) for j in ahead)
            case "W":
                return some(q[j] & all_(p[i:j]) for j in ahead) | all_(p[j] for j in ahead)
            case "R":
                return all_(q[j] | some(p[i:j]) for j in ahead)
            case "M":
                return some(p[j] & all_(q[i : j + 1]) for j in ahead)
            case "S":
                return some(q[j] & all_(p[j + 1 : i + 1]) for j in back)
            case "B":
                return some(q[j] & all_(p[j + 1 : i + 1]) for j in back) | all_(p[j] for j in back)
            case "T":
                return all_(q[j] | some(p[j + 1 : i + 1]) for j in back)
            case events:
                return some(words[i] == "abc".index(e) for e in events.strip("[]").split()) if i < n else no

    return np.array([at(i) for i in range(max(n, 1))])


def accepted(rule: Automaton, words: np.ndarray[Any, Any]) -> Truth:
    """Which of ``words [n, W]`` the automaton marks."""
    delta = np.vstack([rule.delta, np.full((1, 3), -1)])  # the last row is that of NONE
    state = np.full(words.shape[1], 0 if rule.n_states else -1)
    for events in words:
        state = delta[state, events]
    return np.append(rule.marked, False)[state]


def text_of(formula: Formula, rng: random.Random) -> str:
    """The formula in any spelling, with the brackets that it needs and some more."""

    def inside(part: Formula, level: int) -> str:
        text = text_of(part, rng)
        return text if LEVEL.get(part.op, 6) >= level and rng.random() < 0.8 else f"({text})"

    op, parts, bound = formula
    sign = rng.choice(SPELLINGS.get(op, (op,))) + ("" if bound is None else f"[<={bound}]")
    level = LEVEL.get(op, 6)
    if not parts:
        return sign
    if len(parts) == 1:
        return f"{sign} {inside(parts[0], 5)}"
    return f"{inside(parts[0], level + 1)} {sign} {inside(parts[1], level)}"


def random_formula(rng: random.Random, size: int, *, back: bool = False) -> Formula:
    """A formula of about ``size`` operators; with ``back`` one that does not look ahead."""
    if size == 0:
        return Formula(rng.choice(["a", "b", "c", "a", "b", "c", "[a b]", "[b c]", "true", "false"]))
    ahead = [] if back else [*"XNFGUWRMFGU"]
    op = rng.choice(["!", "!", "&", "|", "->", "<->", *ahead, *"YZOHSBT"])
    back = back or op in "YZOHSBT"
    bound = rng.randint(0, 3) if op in "FGOHUWRMSBT" and rng.random() < 0.4 else None
    if LEVEL[op] == 5:
        return Formula(op, (random_formula(rng, size - 1, back=back),), bound)
    left = rng.randint(0, size - 1)
    sizes = (left, size - 1 - left)
    return Formula(op, tuple(random_formula(rng, part, back=back) for part in sizes), bound)


@pytest.mark.parametrize("seed", range(10))
def test_random_formulas_mean_what_the_definitions_say(seed: int) -> None:
    rng = random.Random(seed)  # noqa: S311 - drawn to be repeated
    for _ in range(100 if COMPILED else 5):
        formula = random_formula(rng, rng.randint(0, 6))
        text = text_of(formula, rng)
        rule = rule_from_ltlf(text, ABC, name="random")
        for words in WORDS:
            assert (accepted(rule, words) == truth(formula, words)[0]).all(), text
        least = minimise(trim(rule))
        assert np.array_equal(rule.delta, least.delta), text
        assert np.array_equal(rule.marked, least.marked), text


def test_large_formulas_are_put_together_from_their_parts() -> None:
    rng = random.Random(1)  # noqa: S311 - drawn to be repeated
    for op in "&|" * 8:
        parts = tuple(random_formula(rng, 5) for _ in range(6))
        formula = reduce(lambda left, right: Formula(op, (left, right)), parts)
        text = f" {op} ".join(f"({text_of(part, rng)})" for part in parts)
        rule = rule_from_ltlf(text, ABC)
        for words in WORDS[:-1]:
            assert (accepted(rule, words) == truth(formula, words)[0]).all(), text


# --- one by one -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("loose", "brackets"),
    [
        ("a -> b -> c", "a -> (b -> c)"),
        ("a <-> b -> c", "a <-> (b -> c)"),
        ("a | b -> c", "(a | b) -> c"),
        ("X a | X b & N c", "X a | (X b & N c)"),
        ("a & b U c", "a & (b U c)"),
        ("a U b U c", "a U (b U c)"),
        ("!a U b", "(!a) U b"),
        ("! X a & b", "(!(X a)) & b"),
        ("F a U b", "(F a) U b"),
        ("G a -> F b & c U a", "(G a) -> ((F b) & (c U a))"),
        ("G F[<=2] a | b", "(G (F[<=2] a)) | b"),
        ("F[ <= 2 ][a b]", "F[<=2] (a | b)"),
        ("a U[<=2] b", "a & X b | b | a & X (a & X b)"),
        ("WX a", "N a"),
        ("a & !a", "false"),
    ],
)
def test_precedence(loose: str, brackets: str) -> None:
    assert is_isomorphic(rule_from_ltlf(loose, ABC), rule_from_ltlf(brackets, ABC))


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        *[
            (text, False)
            for text in ("a", "F a", "X a", "O a", "Y a", "F true", "X true", "a U b", "a S b", "a M b")
        ],
        *[
            (text, True)
            for text in ("!a", "G a", "N a", "H a", "Z a", "G false", "a W b", "a R b", "a B b", "a T b")
        ],
        ("F[<=0] !a", False),
        ("G[<=0] a", True),
    ],
)
def test_the_empty_word(text: str, holds: bool) -> None:  # noqa: FBT001 - the answer
    assert rule_from_ltlf(text, ABC).accepts([]) is holds


def test_names() -> None:
    names = ("11", "d_u", "start1", "größe", "a.b", "it's", "F", "not", "Xa")
    sigma = Alphabet(names, frozenset({"d_u"}), frozenset({"11"}))
    text = """[11 d_u start1] & X größe & X X "a.b" & X X X "it's" & X X X X "F" & X X X X X [not Xa F]"""
    rule = rule_from_ltlf(text, sigma, name="all")
    assert (rule.alphabet, rule.name) == (sigma, "all")
    assert rule.accepts(["d_u", "größe", "a.b", "it's", "F", "not", "d_u"])
    assert rule.run(["d_u", "größe", "a.b", "it's", "d_u"]) == -1


def test_without_events() -> None:
    nothing = Alphabet(())
    large = " & ".join(["G false"] * 2 + [f"N N {'X ' * k} true" for k in range(20)])
    assert [rule_from_ltlf(text, nothing).n_states for text in ("true", "N false", "X true", large)] == [
        1,
        1,
        0,
        1,
    ]


@pytest.mark.parametrize(
    ("text", "states"),
    [
        ("G (a -> F[<=1000] b)", 1001),
        ("G (a -> G[<=1000] !b)", 1001),
        ("G (b -> O[<=1000] a)", 1001),
        ("G (b -> H[<=1000] !a)", 1001),
        ("F[<=1000] (a & F[<=1] b)", 2003),
    ],
)
def test_a_bound_costs_its_states_and_no_more(text: str, states: int) -> None:
    begin = time.process_time()
    rule = rule_from_ltlf(text, ABC)
    assert rule.n_states == states
    assert time.process_time() - begin < 1.5 or not COMPILED


def test_a_deadline_of_a_thousand() -> None:
    rule = rule_from_ltlf("G (a -> F[<=1000] b)", ABC)
    for wait, kept in ((999, True), (1000, False)):
        assert (rule.run(["a", *["c"] * wait, "b"]) != -1) is kept
        assert (rule.run(["a", *["c"] * 500, "a", *["c"] * (wait - 501), "b"]) != -1) is kept


ATOMS = ["a", "b", "[a c]", "!b", "true", "(a -> X b)", "F c", "(b S a)", "(a U[<=1] c)"]
MIRROR = ["a", "b", "[a c]", "!b", "true", "(b S a)", "O[<=1] c"]


def same(left: str, right: str) -> bool:
    return is_same_language(rule_from_ltlf(left, ABC), rule_from_ltlf(right, ABC))


@settings(max_examples=30)
@given(st.sampled_from(ATOMS), st.sampled_from(ATOMS), st.sampled_from(["", "[<=0]", "[<=2]"]))
def test_dualities(p: str, q: str, k: str) -> None:
    assert same(f"!F{k} {p}", f"G{k} !{p}")
    assert same(f"!({p} U{k} {q})", f"!{p} R{k} !{q}")
    assert same(f"!({p} W{k} {q})", f"!{p} M{k} !{q}")
    assert same(f"{p} W{k} {q}", f"({p} U{k} {q}) | G{k} {p}")
    assert same(f"!X {p}", f"N !{p}")
    assert same(f"F{k} {p}", f"true U{k} {p}")


@settings(max_examples=30)
@given(st.sampled_from(MIRROR), st.sampled_from(MIRROR), st.sampled_from(["", "[<=0]", "[<=2]"]))
def test_dualities_of_the_past(p: str, q: str, k: str) -> None:
    for left, right in (
        (f"!O{k} {p}", f"H{k} !{p}"),
        (f"!({p} S{k} {q})", f"!{p} T{k} !{q}"),
        (f"!Y {p}", f"Z !{p}"),
        (f"{p} B{k} {q}", f"({p} S{k} {q}) | H{k} {p}"),
    ):
        assert same(f"G ({left})", f"G ({right})")
        assert same(f"F ({left})", f"F ({right})")


@settings(max_examples=30)
@given(st.sampled_from(ATOMS), st.integers(0, 5))
def test_a_bounded_operator_is_nested_next(p: str, k: int) -> None:
    nested, weak = p, p
    for _ in range(k):
        nested, weak = f"({p} | X {nested})", f"({p} & N {weak})"
    assert same(f"F[<={k}] {p}", f"F true & {nested}")
    assert same(f"G[<={k}] {p}", f"G false | {weak}")


# --- another program --------------------------------------------------------------------------------------

AHEAD = """
    a ; X(a) ; WX(a) ; F(a) ; G(a) ; (a) U (b) ; (a) R (b) ; G((a) -> (F(b))) ; G((a) -> (X(b)))
    G(!((a) & (X(a)))) ; F((a) & (X((b) & (F(c))))) ; ((a) U (b)) U (c) ; (a) U ((b) U (c))
    (F(a)) -> ((!(b)) U (a)) ; G((a) -> (WX((b) R (!(a))))) ; (G(F(a))) <-> (F(G(b))) ; !((a) U (G(b)))
    X(X(WX(a))) ; G((a) | ((b) & (X(c)))) ; (F(a)) & (F(b)) & (G(!(c))) ; ((a) R (b)) | ((b) R (F(c)))
"""
BACK = """
    a ; Y(a) ; O(a) ; H((a) | (b)) ; (a) S (b) ; (!(a)) S ((b) & (Y(c))) ; O((a) & (Y(O(b))))
    H((a) -> (O(b))) ; (Y(a)) <-> (O(c)) ; H((b) -> (Y((!(b)) S (a)))) ; (a) & (!(Y((a) | (O(c)))))
"""


def formulas(listed: str) -> list[str]:
    return [text.strip() for line in listed.strip().splitlines() for text in line.split(";")]


class Mona:
    """The automaton that MONA prints: over propositions, of which one at a time holds here."""

    def __init__(self, printed: str) -> None:
        lines = [line.split() for line in printed.splitlines()]
        (names,) = (line[6:] for line in lines if line[:3] == ["DFA", "for", "formula"])
        (self.marked,) = (set(line[2:]) for line in lines if line[:1] == ["Accepting"])
        self.moves = [
            (line[1][:-1], line[2], line[-1]) for line in lines if line[:1] == ["State"] and "->" in line
        ]
        self.names = [name.lower() for name in names]

    def accepts(self, word: Iterable[str]) -> bool:
        state = self.after("0", "")  # the first transition reads what is no position of the word
        for event in word:
            state = self.after(state, event)
        return state in self.marked

    def after(self, state: str, event: str) -> str:
        def fits(guard: str) -> bool:
            return all(
                bit == "X" or (bit == "1") == (name == event)
                for bit, name in zip(guard, self.names, strict=True)
            )

        return next(
            (target for source, guard, target in self.moves if source == state and fits(guard)), state
        )


@pytest.fixture
def mona(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The package ltlf2dfa, made to write its file where no other test does."""
    module = pytest.importorskip("ltlf2dfa.ltlf2dfa")
    if shutil.which("mona") is None:
        pytest.skip("mona is not installed")
    monkeypatch.setattr(module, "PACKAGE_DIR", str(tmp_path))
    return module


@pytest.mark.parametrize("text", formulas(AHEAD))
def test_the_same_words_as_ltlf2dfa(text: str, mona: Any) -> None:
    from ltlf2dfa.parser.ltlf import LTLfParser

    theirs, ours = Mona(mona.to_dfa(LTLfParser()(text), mona_dfa_out=True)), rule_from_ltlf(text, ABC)
    words = [word for word in book.all_words(ABC, 5) if word]
    assert [ours.accepts(word) for word in words] == [theirs.accepts(word) for word in words]


@pytest.mark.parametrize("text", formulas(BACK))
def test_the_same_words_as_ltlf2dfa_for_the_past(text: str, mona: Any) -> None:
    """Its formulas of the past speak of the last moment."""
    from ltlf2dfa.parser.ppltl import PPLTLParser

    theirs = Mona(mona.to_dfa(PPLTLParser()(text), mona_dfa_out=True))
    ours = rule_from_ltlf(f"F (N false & ({text}))", ABC)
    words = [word for word in book.all_words(ABC, 5) if word]
    assert [ours.accepts(word) for word in words] == [theirs.accepts(word) for word in words]


# --- what does not go -------------------------------------------------------------------------------------

OPERATORS = Alphabet(("a", "b", "d1", "F", "true"))


@pytest.mark.parametrize(
    ("text", "line", "column", "says"),
    [
        ("", 1, 1, "it ends too early in ''"),
        ("  ", 1, 3, "it ends too early"),
        ("a &", 1, 4, "it ends too early"),
        ("& a", 1, 1, "unexpected '&'"),
        ("a b", 1, 3, "unexpected 'b'"),
        ("(a", 1, 3, "')' is missing"),
        ("a)", 1, 2, "unexpected ')'"),
        ("()", 1, 2, "unexpected ')'"),
        ("a U", 1, 4, "it ends too early"),
        ("a ! b", 1, 3, "unexpected '!'"),
        ("a Until b", 1, 3, "unexpected 'Until'"),
        ("$", 1, 1, "unexpected '$'"),
        ("G a.b", 1, 4, "unexpected '.'"),
        ("G 'a", 1, 3, "a quote that is not closed"),
        ("G (a ->\n  c)", 2, 3, "unknown event 'c'; known: a, b, d1"),
        ("G d", 1, 3, "unknown event 'd'; did you mean 'd1'?"),
        ("'x y'", 1, 1, "unknown event 'x y'"),
        ("[]", 1, 1, "'[]' names no event"),
        ("[a", 1, 3, "it ends too early"),
        ("[a, b]", 1, 3, "unexpected ','"),
        ("[!a]", 1, 2, "unexpected '!'"),
        ("[a c]", 1, 4, "unknown event 'c'"),
        ("F[5] a", 1, 3, "'5' is no event, and a bound is written [<=k]"),
        ("F[<=x] a", 1, 2, "'[<=x]' is no bound, which is [<=k] with k from 0 to 100,000"),
        ("F[<=-1] a", 1, 2, "'[<=-1]' is no bound"),
        ("F[<=2.5] a", 1, 2, "'[<=2.5]' is no bound"),
        ("a U[<=100001] b", 1, 4, "'[<=100001]' is no bound"),
        ("F[<=" + "9" * 5000 + "] a", 1, 2, "is no bound"),
        ("F[<=5 a", 1, 2, "'[<=5 a' is no bound"),
        ("X[<=2] a", 1, 2, "'X' takes no bound"),
        ("![<=2] a", 1, 2, "'!' takes no bound"),
        ("a ->[<=2] b", 1, 5, "'->' takes no bound"),
        ("a [<=2]", 1, 3, "unexpected '[<=2]'"),
        ("G H F a", 1, 5, "'H' looks back and may not contain what looks ahead; put that outside"),
        ("O (a & X b)", 1, 8, "'O' looks back and may not contain"),
        ("a S (b & WX b)", 1, 10, "'S' looks back and may not contain"),
        ("(a U b) S b", 1, 4, "'S' looks back and may not contain"),
        ("G (F -> a)", 1, 6, "unexpected '->'"),
        ("G (F -> a)", 1, 6, """an event that is named like an operator has to be quoted: "F\""""),
        ("G F", 1, 4, """has to be quoted: "F\""""),
        ("true", 1, 1, "'true' is a constant and an event"),
        ("(" * 200 + "a" + ")" * 200, 1, 101, "more than 100 levels of nesting"),
        ("!" * 200 + "a", 1, 101, "more than 100 levels of nesting"),
        ("a -> " * 200 + "a", 1, 501, "more than 100 levels of nesting"),
        ("a" * 200_000, 1, 100_001, "200,000 characters"),
    ],
)
def test_texts_that_do_not_parse(text: str, line: int, column: int, says: str) -> None:
    with pytest.raises(FormatError) as caught:
        rule_from_ltlf(text, OPERATORS, name="delivery")
    assert says in str(caught.value)
    assert (caught.value.path, caught.value.line, caught.value.column) == ("delivery", line, column)


def test_a_long_list_is_no_deep_nesting() -> None:
    assert rule_from_ltlf(" | ".join(["X (a & F b)", "c"] * 3000), ABC).accepts("cab")


def test_the_deepest_nesting_does_not_overflow() -> None:
    text = "F a"
    for _ in range(95):
        text = f"({text} & N a U b | c -> b <-> c)"
    assert rule_from_ltlf(text, ABC).alphabet == ABC
    assert sentence_of_ltlf(text).startswith("Every run satisfies")


MANY = [f"{kind}{k}" for kind in "ab" for k in range(20)]
TWENTY = " & ".join(f"(F a{k} | G b{k})" for k in range(20))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("G (a0 -> F[<=100000] b0)", "rule 'big' unfolds to more than 2,000 states"),
        ("G (a0 -> " + "X " * 20 + "b0)", "rule 'big' unfolds to more than 2,000 states"),
        (TWENTY, "rule 'big' unfolds to more than 2,000 states where its parts come together"),
        (f"({TWENTY}) U [a0 b0]", "rule 'big' takes too many steps to unfold; split it into several rules"),
        (" & ".join(f"F {name}" for name in MANY), "rule 'big' unfolds to more than 2,000 states"),
    ],
)
@pytest.mark.skipif(not COMPILED, reason="slow")
def test_formulas_that_explode(text: str, says: str) -> None:
    with pytest.raises(RuleError) as caught:
        rule_from_ltlf(text, Alphabet(tuple(MANY)), name="big", max_states=2000)
    assert says in str(caught.value)


def test_the_bound_on_states_is_the_callers() -> None:
    assert rule_from_ltlf("F[<=10] a", ABC, max_states=13).n_states == 12
    with pytest.raises(RuleError, match="more than 12 states"):
        rule_from_ltlf("F[<=10] a", ABC, max_states=12)


@pytest.mark.parametrize("seed", range(4))
def test_any_text_is_a_rule_or_an_error_of_ours(seed: int) -> None:
    rng = random.Random(seed)  # noqa: S311 - drawn to be repeated
    pieces = [
        *"abc()[]!&|<>=-~$.'\" XNFGUWRMYZOHSBT",
        "[<=2]",
        "[<=",
        "true",
        "->",
        "WX ",
        " U[<=1] ",
        "é",
        "\n",
        "9",
    ]
    for _ in range(600 if COMPILED else 50):
        text = text_of(random_formula(rng, rng.randint(0, 6)), rng)
        for _ in range(rng.randint(1, 4)):
            cut = rng.randint(0, len(text))
            text = text[:cut] + rng.choice(["", *pieces]) + text[cut + rng.randint(0, 2) :]
        try:
            assert isinstance(rule_from_ltlf(text, ABC, max_states=50), Automaton)
            assert sentence_of_ltlf(text).endswith(".")
        except SupremalError:
            pass


# --- in words ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("G (p1 -> F[<=5] d1)", "At every moment: if p1 happens, then d1 happens within the next 5 events."),
        ("G F[<=5] d1", "At every moment: d1 happens now or within the next 5 events."),
        ("G (a -> F b)", "At every moment: if a happens, then b happens sooner or later."),
        ("G !(a & X a)", "At no moment: a happens and a comes next."),
        ("G (a -> N !a)", "At every moment: if a happens, then a does not come next."),
        ("(!b) W a", "From the start: b does not happen until a happens, or to the end."),
        ("!b U a", "From the start: b does not happen until a happens, and that has to come."),
        ("G (b -> O a)", "At every moment: if b happens, then a has happened before."),
        ("G (b -> O[<=1] a)", "At every moment: if b happens, then a has happened within the last event."),
        ("G (d -> Y [a b c])", "At every moment: if d happens, then a, b or c came just before."),
        (
            "G (a -> G[<=3] !b)",
            "At every moment: if a happens, then for the next 3 events b does not happen.",
        ),
        ("G ![a b]", "At no moment: a or b happens."),
        ("F (![a b] & N false)", "At some moment: none of a and b happens and nothing follows."),
        ("F[<=3] a", "At one of the first 4 events: a happens."),
        (
            "F a & G[<=1] (b | c)",
            "At some moment: a happens. At each of the first 2 events: b happens or c happens.",
        ),
        (
            "b -> a S[<=9] c",
            "At the start: if b happens, then (a happens ever since c happens, within the last 9 events).",
        ),
        ("  |\n".join("a" * 26), f"Every run satisfies `{' | '.join('a' * 26)}`."),
    ],
)
def test_sentences(text: str, sentence: str) -> None:
    assert sentence_of_ltlf(text) == sentence


def test_a_sentence_needs_a_formula() -> None:
    with pytest.raises(FormatError, match="formula:1:3: it ends too early"):
        sentence_of_ltlf("G ")

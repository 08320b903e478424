"""Guards: what they mean, which one binds tighter, and what is said about those that do not parse."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import book
from strategies import Formula, formulas
from supremal import FormatError, RuleError
from supremal.decisions.guards import MAX_PROPOSITIONS, truth_table

PROPOSITIONS = ["a", "b", "door_open", "S"]


def truth(holds: Any, propositions: list[str]) -> list[bool]:
    """The truth for every label; bit i is proposition i."""
    return [
        holds({name for i, name in enumerate(propositions) if label >> i & 1})
        for label in range(1 << len(propositions))
    ]


@given(formulas(PROPOSITIONS))
def test_guards_mean_what_their_trees_mean(formula: Formula) -> None:
    assert truth_table(formula.text, PROPOSITIONS).tolist() == truth(formula.holds, PROPOSITIONS)


@given(formulas(PROPOSITIONS), st.sampled_from([" ", "\t", "\n", "  \n"]))
def test_space_around_a_guard_does_not_matter(formula: Formula, space: str) -> None:
    text = f"{space}{formula.text.replace(' ', space)}{space}"
    assert truth_table(text, PROPOSITIONS).tolist() == truth_table(formula.text, PROPOSITIONS).tolist()


@pytest.mark.parametrize(
    ("loose", "brackets"),
    [
        ("a | b & S", "a | (b & S)"),
        ("a & b | S", "(a & b) | S"),
        ("!a & b", "(!a) & b"),
        ("!a | b", "(!a) | b"),
        ("not a and b or S", "((not a) and b) or S"),
        ("!!a", "a"),
        ("!a & !b & !S", "!(a | b | S)"),
        ("a∧¬b∨S", "(a & (!b)) | S"),
        ("a&b", "b & a"),
        ("true", "a | !a"),
        ("false", "a & !a"),
        ("not(a)", "!a"),
    ],
)
def test_precedence(loose: str, brackets: str) -> None:
    assert truth_table(loose, PROPOSITIONS).tolist() == truth_table(brackets, PROPOSITIONS).tolist()


def test_names_may_begin_like_words() -> None:
    names = ["order", "android", "notes", "true_", "_x1"]
    table = truth_table("order & android & !notes | true_ & _x1", names)
    expected = truth(
        lambda true: ({"order", "android"} <= true and "notes" not in true) or {"true_", "_x1"} <= true, names
    )
    assert table.tolist() == expected


def test_no_proposition_at_all() -> None:
    assert truth_table("true", []).tolist() == [True]
    assert truth_table("!true | false", []).tolist() == [False]


def test_bit_i_is_proposition_i() -> None:
    for i, name in enumerate(PROPOSITIONS):
        assert truth_table(name, PROPOSITIONS).tolist() == [bool(label >> i & 1) for label in range(16)]


@pytest.mark.parametrize("case", book.named(book.table("bad_guards")))
def test_bad_guards(case: dict[str, Any]) -> None:
    with pytest.raises(FormatError) as error:
        truth_table(case["text"], ["a", "b", "door_open"], path="guard of 0 → 1")
    assert case["says"] in str(error.value)
    assert (error.value.path, error.value.line, error.value.column) == ("guard of 0 → 1", 1, case["column"])
    assert str(error.value).startswith(f"guard of 0 → 1:1:{case['column']}: ")


@pytest.mark.parametrize(
    "text",
    [
        "(" * 10_000 + "a" + ")" * 10_000,
        "!" * 10_000 + "a",
        "(" * 10_000,
        "!(" * 10_000 + "a",
        "a & (" * 10_000,
    ],
)
def test_ten_thousand_brackets_are_too_deep(text: str) -> None:
    with pytest.raises(FormatError, match="more than 200 levels"):
        truth_table(text, ["a"])


def test_what_is_deep_but_not_too_deep() -> None:
    assert truth_table("(" * 199 + "a" + ")" * 199, ["a"]).tolist() == [False, True]
    assert truth_table("!" * 199 + "a", ["a"]).tolist() == [True, False]


@pytest.mark.parametrize(("sign", "both"), [("&", "a & b"), ("|", "a | b")])
def test_long_is_not_deep(sign: str, both: str) -> None:
    assert (
        truth_table(sign.join(["a", "b"] * 5_000), ["a", "b"]).tolist()
        == truth_table(both, ["a", "b"]).tolist()
    )


def test_too_many_propositions() -> None:
    names = [f"p{i}" for i in range(MAX_PROPOSITIONS + 1)]
    assert truth_table("p15", names[:-1]).sum() == 2**15
    with pytest.raises(RuleError, match="17 propositions; a reward machine may have 16"):
        truth_table("p16", names)


@given(st.text(alphabet="ab()&|! \n", max_size=12))
def test_any_text_is_a_guard_or_a_format_error(text: str) -> None:
    try:
        table = truth_table(text, ["a", "b"])
    except FormatError as error:
        assert 1 <= error.column <= len(text) + 1  # noqa: PT017 - not to parse is one of two right answers
    else:
        assert table.shape == (4,)

"""Patterns: each is one automaton with an expression and a formula, and what it says is checked on words."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import book
from supremal import Alphabet, Automaton, RuleError, is_same_language, minimise, trim
from supremal.rules.about import classify
from supremal.rules.ltlf import rule_from_ltlf
from supremal.rules.patterns import PATTERNS, REQUIRED, sentence_of
from supremal.rules.regex import rule_from_regex

Word = tuple[str, ...]
PAGE = Path(__file__).parents[1] / "docs" / "rules.md"
SIGMA = Alphabet(tuple("abcde"), frozenset("b"))
LENGTH = 5


# --- what they say on words -------------------------------------------------------------------------------


def at(word: Word, events: Word) -> list[int]:
    """Where one of ``events`` happens."""
    return [i for i, event in enumerate(word) if event in events]


def between(word: Word, one: Word, other: Word) -> Iterator[Word]:
    """What happens between ``one`` and a later ``other``, for all pairs of them."""
    return (word[i + 1 : j] for i in at(word, one) for j in at(word, other) if i < j)


def time(word: Word, counting: Any, *ends: str) -> int:
    return sum((counting == "all" or event in counting) and event not in ends for event in word)


def precedence(word: Word, cause: Word, effect: Word) -> bool:
    return all(at(word[:j], cause) for j in at(word, effect))


def response(word: Word, trigger: Word, reaction: Word) -> bool:
    return all(at(word[i:], reaction) for i in at(word, trigger))


def alternate_precedence(word: Word, cause: Word, effect: Word) -> bool:
    """From one effect, or the beginning, to the next there is a cause."""
    ends = at(word, effect)
    return all(at(word[i + 1 : j], cause) for i, j in zip([-1, *ends], ends, strict=False))


def alternate_response(word: Word, trigger: Word, reaction: Word) -> bool:
    """From one trigger to the next, or the end, there is a reaction."""
    ends = at(word, trigger)
    return all(at(word[i:j], reaction) for i, j in zip(ends, [*ends[1:], len(word)], strict=False))


def chain_precedence(word: Word, cause: Word, effect: Word) -> bool:
    return all(j > 0 and word[j - 1] in cause for j in at(word, effect))


def chain_response(word: Word, trigger: Word, reaction: Word) -> bool:
    return all(at(word[i + 1 : i + 2], reaction) for i in at(word, trigger))


def both(one: Callable[..., bool], other: Callable[..., bool]) -> Callable[..., bool]:
    return lambda word, *events: one(word, *events) and other(word, *events)


def absence_in_scope(word: Word, forbidden: Word, opening: Word, closing: Word, scope: str) -> bool:
    if scope == "before":
        return not at(word, closing) or not at(word[: at(word, closing)[0]], forbidden)
    if scope == "after":
        return not [*between(word, opening, forbidden)]
    if scope == "between":
        return all(at(gap, closing) or not at(gap, forbidden) for gap in between(word, opening, closing))
    return all(at(gap, closing) for gap in between(word, opening, forbidden))


def one_inside(word: Word, enter: list[Word], leave: list[Word]) -> bool:
    inside: set[int] = set()
    for event in word:
        inside |= {k for k, events in enumerate(enter) if event in events}
        inside -= {k for k, events in enumerate(leave) if event in events}
        if len(inside) > 1:
            return False
    return True


def in_bounds(word: Word, up: Word, down: Word, maximum: int, minimum: int, start: int | None) -> bool:
    level = minimum if start is None else start
    steps = [(event in up) - (event in down) for event in word]
    return all(minimum <= level + sum(steps[:n]) <= maximum for n in range(len(word) + 1))


SAYS: dict[str, Callable[..., bool]] = {
    "absence": lambda w, of: not at(w, of),
    "exactly": lambda w, of, times: len(at(w, of)) == times,
    "at_most": lambda w, of, times: len(at(w, of)) <= times,
    "at_least": lambda w, of, times: len(at(w, of)) >= times,
    "first": lambda w, of: w != () and w[0] in of,
    "last": lambda w, of: w != () and w[-1] in of,
    "responded_existence": lambda w, trigger, partner: not at(w, trigger) or at(w, partner) != [],
    "precedence": precedence,
    "response": response,
    "succession": both(precedence, response),
    "alternate_precedence": alternate_precedence,
    "alternate_response": alternate_response,
    "alternate_succession": both(alternate_precedence, alternate_response),
    "chain_precedence": chain_precedence,
    "chain_response": chain_response,
    "chain_succession": both(chain_precedence, chain_response),
    "not_coexistence": lambda w, one, other: not at(w, one) or not at(w, other),
    "not_succession": lambda w, trigger, forbidden: not [*between(w, trigger, forbidden)],
    "not_chain_succession": lambda w, trigger, forbidden: () not in between(w, trigger, forbidden),
    "between": absence_in_scope,
    "priority": lambda w, request, high, low: all(at(gap, high) for gap in between(w, request, low)),
    "never_sequence": lambda w, sequence: not book.has_factor(w, {sequence}),
    "only_sequence": lambda w, trigger, sequence: all(
        w[i + 1 :][: len(sequence)] == sequence for i in at(w, trigger)
    ),
    "mutex": one_inside,
    "alternation": lambda w, one, other: all(
        w[i] in (one, other)[n % 2] for n, i in enumerate(at(w, one + other))
    ),
    "counter": in_bounds,
    "within": lambda w, trigger, reaction, limit, counting: all(
        any(time(w[i:j], counting, *trigger, *reaction) <= limit for j in at(w, reaction) if i < j)
        for i in at(w, trigger)
    ),
    "wait_at_least": lambda w, trigger, delayed, count, counting: all(
        time(gap, counting, *trigger, *delayed) >= count for gap in between(w, trigger, delayed)
    ),
}


def several(value: Any) -> Word:
    return (value,) if isinstance(value, str) else tuple(value)


def values_of(name: str, arguments: dict[str, Any]) -> list[Any]:
    """All arguments in their order, events as tuples."""
    values = []
    for key, known in PATTERNS[name].parameters.items():
        value = arguments.get(key, known.default)
        if known.kind in ("events", "sequence"):
            value = several(value)
        elif known.kind == "lists":
            value = [several(events) for events in value]
        values.append(value)
    return values


def check_words(rule: Automaton, name: str, arguments: dict[str, Any], length: int) -> None:
    values = values_of(name, arguments)
    for word in book.all_words(rule.alphabet, length):
        assert rule.accepts(word) == SAYS[name](word, *values), word


def assert_same_table(one: Automaton, other: Automaton) -> None:
    assert one.alphabet == other.alphabet
    assert one.delta.tolist() == other.delta.tolist()
    assert one.marked.tolist() == other.marked.tolist()


@st.composite
def calls(draw: st.DrawFn, name: str) -> dict[str, Any]:
    """Arguments for a pattern: sets of events that are apart, and small numbers."""
    free = draw(st.permutations("abcdef"))
    if name == "mutex":
        return {"enter": [free[0], free[1:3]], "leave": draw(st.permutations([free[3:5], free[5]]))}
    arguments: dict[str, Any] = {}
    for key, known in PATTERNS[name].parameters.items():
        if known.kind == "events":
            arguments[key] = [free.pop() for _ in range(draw(st.integers(1, 2)))]
        elif known.kind == "sequence":
            arguments[key] = draw(st.lists(st.sampled_from(free[:2]), min_size=1, max_size=4))
        elif known.kind == "number":
            arguments[key] = draw(st.integers(0, 3))
        elif known.kind == "choice":
            arguments[key] = draw(st.sampled_from(known.choices))
        else:
            arguments[key] = draw(st.just("all") | st.lists(st.sampled_from("abcdef"), min_size=1))
    if name == "between":
        arguments.pop({"before": "opening", "after": "closing"}.get(arguments["scope"], ""), None)
    if name == "counter":
        order = "minimum", "start", "maximum"
        arguments |= zip(order, sorted(arguments[key] for key in order), strict=True)
    return arguments


@pytest.mark.parametrize("name", PATTERNS)
@settings(max_examples=10)
@given(data=st.data())
def test_what_patterns_say_on_words(name: str, data: st.DataObject) -> None:
    arguments = data.draw(calls(name))
    rule = PATTERNS[name].build(**arguments, alphabet=Alphabet(tuple("fabcde")), name="its name")
    assert rule.name == "its name"
    assert_same_table(rule, minimise(trim(rule)))
    check_words(rule, name, arguments, 3)
    for word in data.draw(st.lists(st.lists(st.sampled_from("abcdef"), max_size=12).map(tuple), max_size=9)):
        assert rule.accepts(word) == SAYS[name](word, *values_of(name, arguments))


@pytest.mark.parametrize("forbidden", ["a", ["a"], ["a", "b"]])
@pytest.mark.parametrize("name", ["not_succession", "not_chain_succession"])
def test_an_event_on_both_sides(name: str, forbidden: Any) -> None:
    arguments = {"trigger": ["c", "a"], "forbidden": forbidden}
    check_words(PATTERNS[name].build(**arguments, alphabet=SIGMA), name, arguments, LENGTH)


# --- the catalogue ----------------------------------------------------------------------------------------


class Entry(NamedTuple):
    """A pattern as docs/rules.md shows it; ``ltlf`` is None where there is no formula."""

    name: str
    arguments: dict[str, Any]
    kind: str
    sentence: str
    regex: str
    ltlf: str | None


_ENTRY = re.compile(
    r"""^(?P<call>(?P<name>\w+)\(.*\))\ +(?P<kind>safety|progress|mixed)
    \n\ {4}(?P<sentence>.*)
    \n\ {4}regex\ \ (?P<regex>.*)
    (?:\n\ {4}ltlf\ {3}(?P<ltlf>.*))?$""",
    re.MULTILINE | re.VERBOSE,
)


def catalogue() -> list[Any]:
    entries = []
    for entry in _ENTRY.finditer(PAGE.read_text(encoding="utf-8")):
        call = ast.parse(entry["call"], mode="eval").body
        assert isinstance(call, ast.Call)
        arguments = {str(given.arg): ast.literal_eval(given.value) for given in call.keywords}
        texts = entry.group("kind", "sentence", "regex", "ltlf")
        entries.append(pytest.param(Entry(entry["name"], arguments, *texts), id=entry["call"]))
    return entries


def test_the_catalogue_is_complete() -> None:
    text = PAGE.read_text(encoding="utf-8")
    entries = [entry.values[0] for entry in catalogue()]
    assert len(entries) == text.count("    regex  ")
    assert {entry.name for entry in entries} == set(PATTERNS) == set(SAYS)
    assert [entry.name for entry in entries if entry.ltlf is None] == ["counter"]


@pytest.mark.parametrize("entry", catalogue())
def test_the_catalogue_says_what_the_patterns_do(entry: Entry) -> None:
    rule = PATTERNS[entry.name].build(**entry.arguments, alphabet=SIGMA)
    assert sentence_of(entry.name, **entry.arguments) == entry.sentence
    assert classify(rule) == entry.kind
    assert_same_table(rule, rule_from_regex(entry.regex, SIGMA))
    if entry.ltlf is not None:
        assert_same_table(rule, rule_from_ltlf(entry.ltlf, SIGMA))
    check_words(rule, entry.name, entry.arguments, LENGTH)


@pytest.mark.parametrize("entry", catalogue())
def test_several_events_for_one(entry: Entry) -> None:
    """Wherever there is an event there may be two: in the call, the expression and the formula."""
    parameters = PATTERNS[entry.name].parameters
    single = {
        e for key, value in entry.arguments.items() if parameters[key].kind == "sequence" for e in value
    }

    def twice(events: Any) -> list[str]:
        return [
            name
            for event in several(events)
            for name in ((event,) if event in single else (event, event * 2))
        ]

    arguments = dict(entry.arguments)
    for key, value in arguments.items():
        if parameters[key].kind == "lists":
            arguments[key] = [twice(events) for events in value]
        elif parameters[key].kind == "events" or (parameters[key].kind == "counting" and value != "all"):
            arguments[key] = twice(value)
    alphabet = Alphabet(("aa", *SIGMA, "dd", "cc", "bb"))
    rule = PATTERNS[entry.name].build(**arguments, alphabet=alphabet)

    def wide(text: str) -> str:
        return re.sub(
            r"\[\^?|\b[a-e]\b|\]",
            lambda found: found[0] if found[0][0] in "[]" else " ".join(twice(found[0])),
            re.sub(r"(\[[^]]*\])|\b([a-e])\b", lambda found: found[1] or f"[{found[2]}]", text),
        )

    assert_same_table(rule, rule_from_regex(wide(entry.regex), alphabet))
    if entry.ltlf is not None:
        assert_same_table(rule, rule_from_ltlf(wide(entry.ltlf), alphabet))


# --- sentences --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "arguments", "sentence"),
    [
        ("at_most", {"of": "p1", "times": 0}, "p1 happens at most 0 times."),
        ("at_most", {"of": ["p1", "p2"], "times": 1}, "p1 and p2 together happen at most once."),
        (
            "exactly",
            {"of": ["x", "y", "z"], "times": 1000},
            "x, y and z together happen exactly 1,000 times.",
        ),
        ("first", {"of": ["x", "y"]}, "The first event is x or y."),
        (
            "within",
            {"trigger": "p", "reaction": ["d", "e"], "limit": 1, "counting": ["l", "r", "f"]},
            "Every p is followed by d or e, with at most 1 event in between, counting l, r and f only.",
        ),
        (
            "counter",
            {"up": "put", "down": ["get", "lose"], "maximum": 3},
            "The count that put raises and get or lose lowers, from 0 on, stays between 0 and 3.",
        ),
        (
            "mutex",
            {"enter": ["x", ["y", "z"]], "leave": ["u", "v"]},
            "At most one at a time is inside: from x to u, from y or z to v.",
        ),
    ],
)
def test_sentences(name: str, arguments: dict[str, Any], sentence: str) -> None:
    assert sentence_of(name, **arguments) == sentence


# --- parameters and errors --------------------------------------------------------------------------------


def test_parameters_can_be_read_from_the_registry() -> None:
    counter = PATTERNS["counter"]
    assert {key: known.kind for key, known in counter.parameters.items()} == {
        "up": "events",
        "down": "events",
        "maximum": "number",
        "minimum": "number",
        "start": "number",
    }
    required = [key for key, known in counter.parameters.items() if known.default is REQUIRED]
    assert required == ["up", "down", "maximum"]
    assert PATTERNS["between"].parameters["scope"].choices == ("before", "after", "between", "until")
    assert PATTERNS["between"].parameters["scope"].default == "between"
    kinds = {known.kind for found in PATTERNS.values() for known in found.parameters.values()}
    assert kinds == {"events", "sequence", "lists", "number", "choice", "counting"}
    assert all(found.name == name == found.build.__name__ for name, found in PATTERNS.items())


EVENTS = {"trigger": "a", "reaction": "b"}


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("absence", {"of": "A"}, r"absence: of has the unknown event 'A'; known: a, b, c, d, e"),
        ("absence", {"of": []}, r"absence: of is \[\]; the name of an event, or a list of names, is needed"),
        ("absence", {"of": ["a", 3]}, r"absence: of is \['a', 3\]; the name of an event, or a list of"),
        ("absence", {"of": 3}, r"absence: of is 3; the name of an event, or a list of names, is needed"),
        ("absence", {}, r"absence: missing a required argument: 'of'; it takes of"),
        ("absence", {"of": "a", "x": 1}, r"absence: got an unexpected keyword argument 'x'; it takes of"),
        ("at_most", {"of": "a", "times": -1}, r"times is -1; a whole number from 0 to 10,000 is needed"),
        ("at_most", {"of": "a", "times": 10**9}, r"times is 1000000000; a whole number from 0 to 10,000 is"),
        ("at_most", {"of": "a", "times": 1.5}, r"times is 1.5; a whole number"),
        ("at_most", {"of": "a", "times": True}, r"times is True; a whole number"),
        ("counter", {"up": "a", "down": "b", "maximum": 2, "minimum": False}, r"minimum is False; a whole"),
        (
            "counter",
            {"up": "a", "down": "b", "maximum": 2, "start": 3},
            r"counter: minimum 0 <= start 3 <= maximum 2 is needed",
        ),
        (
            "response",
            {"trigger": ["a", "c"], "reaction": ["b", "c"]},
            r"response: trigger and reaction share the event 'c'; take it out of one of them",
        ),
        (
            "only_sequence",
            {"trigger": "a", "sequence": ["b", "a"]},
            r"trigger and sequence share the event 'a'",
        ),
        ("never_sequence", {"sequence": []}, r"never_sequence: sequence is \[\]; the name of an event"),
        ("never_sequence", {"sequence": "ab"}, r"sequence has the unknown event 'ab'"),
        ("never_sequence", {"sequence": ["a"] * 1001}, r"sequence has the length 1,001; 1 to 1,000"),
        ("between", {"forbidden": "a", "opening": "b"}, r"between: scope 'between' needs closing"),
        (
            "between",
            {"forbidden": "a", "opening": "b", "closing": "c", "scope": "after"},
            r"between: scope 'after' takes no closing",
        ),
        (
            "between",
            {"forbidden": "a", "closing": "c", "scope": "til"},
            r"scope is 'til'; did you mean 'until'",
        ),
        (
            "mutex",
            {"enter": "a", "leave": ["b"]},
            r"mutex: enter is 'a'; a list is needed, with an event or a",
        ),
        ("mutex", {"enter": [], "leave": []}, r"mutex: enter has the length 0; 1 to 1,000 is needed"),
        (
            "mutex",
            {"enter": ["a", "b"], "leave": ["c"]},
            r"enter lists 2 processes and leave 1; lists of one length",
        ),
        (
            "mutex",
            {"enter": ["a", "a"], "leave": ["c", "d"]},
            r"mutex: 'a' lets a process in and has another part",
        ),
        (
            "within",
            EVENTS | {"limit": 1},
            r"within: missing a required argument: 'counting'; it takes trigger,",
        ),
        (
            "within",
            EVENTS | {"limit": 1, "counting": []},
            r"within: counting is \[\]; 'all', the name of an event, or",
        ),
        (
            "within",
            EVENTS | {"limit": 1, "counting": "al"},
            r"counting has the unknown event 'al'; did you mean 'all'",
        ),
    ],
)
def test_errors_name_the_pattern_and_the_argument(name: str, arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(RuleError, match=message):
        PATTERNS[name].build(**arguments, alphabet=SIGMA)
    with pytest.raises(RuleError, match=rf"rule 'mine': {name}: .*{message.removeprefix(f'{name}: ')}"):
        PATTERNS[name].build(**arguments, alphabet=SIGMA, name="mine")


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("between", {"forbidden": "a"}, "between: scope 'between' needs opening"),
        ("mutex", {"enter": ["a", "b"], "leave": ["c"]}, "mutex: enter lists 2 processes and leave 1"),
        ("counter", {"up": "a", "down": "b", "minimum": 3, "maximum": 2}, "minimum 3 <= maximum 2 is needed"),
        ("response", {"trigger": "a", "reaction": "a"}, "trigger and reaction share the event 'a'"),
    ],
)
def test_what_cannot_be_built_cannot_be_said(name: str, arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(RuleError, match=message):
        sentence_of(name, **arguments)


def test_sentences_check_their_arguments() -> None:
    with pytest.raises(RuleError, match="unknown pattern 'respons'; did you mean 'response'"):
        sentence_of("respons", **EVENTS)
    with pytest.raises(RuleError, match="response: trigger is 3; the name of an event"):
        sentence_of("response", trigger=3, reaction="b")


# --- sizes ------------------------------------------------------------------------------------------------


def test_many_events_and_large_numbers() -> None:
    alphabet = Alphabet(tuple(f"e{n}" for n in range(2000)))
    some = alphabet.names[:1000]
    rule = PATTERNS["within"].build(some, alphabet.names[1000:1500], 200, "all", alphabet=alphabet)
    assert rule.delta.shape == (202, 2000)
    assert PATTERNS["at_most"].build("a", 10_000, alphabet=SIGMA).n_states == 10_001
    assert PATTERNS["never_sequence"].build(some, alphabet=alphabet).n_states == 1000
    assert PATTERNS["mutex"].build(some[:300], some[300:600], alphabet=alphabet).n_states == 301


def test_an_alphabet_without_other_events() -> None:
    sigma = Alphabet(("a", "b"))
    assert PATTERNS["within"].build("a", "b", 9, "all", alphabet=sigma).n_states == 2
    assert PATTERNS["first"].build(["a", "b"], alphabet=sigma).n_states == 2


def test_numpy_numbers_count() -> None:
    one, other = (PATTERNS["at_most"].build("a", times, alphabet=SIGMA) for times in (2, np.int64(2)))
    assert is_same_language(one, other)

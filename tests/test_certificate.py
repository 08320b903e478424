"""Certificates: what is made is valid, and whatever makes one false is found, decided here by definition."""

from __future__ import annotations

import copy
import json
import random
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import product as combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from hypothesis import given, settings
from hypothesis import strategies as st

from processes import random_process, random_rule
from strategies import SEEDS
from supremal import (
    Alphabet,
    Automaton,
    MDPError,
    RuleError,
    TabularMDP,
    evaluate,
    from_outcomes,
    is_same_language,
    product,
    reward_machine,
    safe_actions,
    verifier,
)
from supremal.cli import main
from supremal.cli.certify import certify_command, verify_command
from supremal.decisions.certificate import certificate_text, certify
from supremal.rules.ltlf import rule_from_ltlf
from supremal.rules.patterns import PATTERNS
from supremal.rules.regex import rule_from_regex
from supremal.rules.rule import Form, Rule
from supremal.show import figures
from supremal.task import page, publish
from supremal.task.reading import read_task
from supremal.verifier import find_difference, statements, texts, verify, verify_text
from supremal.verifier.patterns import TEMPLATES, WALKS, read_call

ROOT = Path(__file__).parents[1]
ABC = Alphabet(("a", "b", "c"))
Document = dict[str, Any]


# --- rules and their texts --------------------------------------------------------------------------------


def entry(form: Form, text: str, automaton: Automaton) -> Document:
    return {
        "name": "rule",
        "form": form,
        "text": text,
        "events": list(automaton.alphabet),
        "delta": automaton.delta.tolist(),
        "marked": np.flatnonzero(automaton.marked).tolist(),
    }


def changed(automaton: Automaton, seed: int) -> Automaton:
    """An automaton with one transition or one mark changed."""
    rng = np.random.default_rng(seed)
    delta, marked = automaton.delta.copy(), automaton.marked.copy()
    if rng.random() < 0.7:
        delta[rng.integers(len(delta)), rng.integers(delta.shape[1])] = rng.integers(-1, len(delta))
    else:
        marked[rng.integers(len(delta))] ^= True
    return replace(automaton, delta=delta, marked=marked)


def means_the_same(one: Automaton, other: Automaton) -> bool:
    """Whether both allow the same words and break at once where nothing can be allowed any more."""
    return bool(
        is_same_language(one, other)
        and is_same_language(
            replace(one, marked=one.marked | True), replace(other, marked=other.marked | True)
        )
    )


def check_text(form: Form, text: str, automaton: Automaton, seed: int) -> None:
    """The text is that of the automaton, and of a changed one only where that is as good."""
    assert find_difference(entry(form, text, automaton)) is None
    if automaton.n_states:
        other = changed(automaton, seed)
        problem = find_difference(entry(form, text, other))
        assert (problem is None) == means_the_same(automaton, other), problem


CATALOGUE = re.findall(
    r"^((\w+)\(.*\)) +(?:safety|progress|mixed)\n.*\n    regex  (.*)(?:\n    ltlf   (.*))?$",
    (ROOT / "docs" / "rules.md").read_text(encoding="utf-8"),
    re.MULTILINE,
)


@pytest.mark.parametrize(("call", "name", "regex", "formula"), CATALOGUE, ids=[e[0] for e in CATALOGUE])
def test_the_catalogue_of_patterns(call: str, name: str, regex: str, formula: str) -> None:
    sigma = Alphabet(tuple("abcd"))
    rule = PATTERNS[name].build(**read_call(call)[1], alphabet=sigma)
    for seed in range(3):
        check_text("pattern", call, rule, seed)
        check_text("regex", regex, rule, seed)
        if formula:
            check_text("ltlf", formula, rule, seed)


def test_every_pattern_is_known() -> None:
    assert {name.split()[0] for name in (TEMPLATES | WALKS)} == set(PATTERNS) == {e[1] for e in CATALOGUE}


@st.composite
def calls(draw: st.DrawFn) -> tuple[str, str, Automaton]:
    """A call of a pattern with several events for one, and numbers of all sizes."""
    name = draw(st.sampled_from(sorted(PATTERNS)))
    free = draw(st.permutations("abcdef"))
    given_: Document = {}
    for key, known in PATTERNS[name].parameters.items():
        match known.kind:
            case "events":
                given_[key] = draw(st.sampled_from([free[-1], [free[-1]], free[-2:]]))
                del free[-len(given_[key]) :]
            case "sequence":
                given_[key] = draw(st.lists(st.sampled_from(free[:2]), min_size=1, max_size=4))
            case "number":
                given_[key] = draw(st.integers(0, 5))
            case "choice":
                given_[key] = draw(st.sampled_from(known.choices))
            case "counting":
                given_[key] = draw(st.just("all") | st.lists(st.sampled_from("abcdef"), min_size=1))
    if name == "mutex":
        given_ = {"enter": [free[0], free[1:3], "f"], "leave": [free[3], free[3:5], free[4]]}
        given_["enter"] = given_["enter"][: 3 if "f" in free[5:] else 2]
        given_["leave"] = given_["leave"][: len(given_["enter"])]
    elif name == "between":
        given_.pop({"before": "opening", "after": "closing"}.get(given_["scope"], ""), None)
    elif name == "counter":
        order = ("minimum", "start", "maximum")
        given_ |= zip(order, sorted(given_[key] for key in order), strict=True)
    rule = PATTERNS[name].build(**given_, alphabet=Alphabet(tuple("fabcde")))
    return name, f"{name}({', '.join(f'{key}={value!r}' for key, value in given_.items())})", rule


@settings(max_examples=40)
@given(call=calls(), seed=SEEDS)
def test_patterns_of_any_arguments(call: tuple[str, str, Automaton], seed: int) -> None:
    check_text("pattern", *call[1:], seed)


@pytest.mark.parametrize(
    "call",
    [
        "within(trigger='a', reaction='b', limit=200, counting='all')",
        "wait_at_least(trigger='a', delayed='b', count=200, counting=['c'])",
        "counter(up='a', down='b', maximum=30, start=10)",
        "exactly(of='a', times=500)",
        "never_sequence(sequence=['a', 'a', 'b', 'a', 'a', 'b', 'a', 'a', 'b', 'c'])",
    ],
)
def test_large_numbers(call: str) -> None:
    name, arguments = read_call(call)
    check_text("pattern", call, PATTERNS[name].build(**arguments, alphabet=ABC), 1)


def expressions() -> st.SearchStrategy[str]:
    atoms = st.sampled_from(["a", "b", "'c'", ".", "[a b]", "[^a]", "[^ b 'c']", "()"])
    return st.recursive(
        atoms,
        lambda part: (
            st.builds(lambda x, op, y: f"({x}{op}{y})", part, st.sampled_from([" ", " | ", "&"]), part)
            | st.builds(lambda x, y: f"{x} {y}", part, part)
            | st.builds(
                lambda x, op: f"({x}){op}", part, st.sampled_from(["*", "+", "?", "{2}", "{1,}", "{0,2}"])
            )
            | part.map(lambda x: f"~({x})")
            | part.map(lambda x: f"~{x}")
        ),
        max_leaves=6,
    )


def formulas() -> st.SearchStrategy[str]:
    atoms = st.sampled_from(["a", "b", "[a c]", "true", "false", "'c'"])
    bound = st.sampled_from(["", "", "[<=0]", "[<=1]", "[ <= 2 ]"])
    back = grown(atoms, bound, "! Y Z", "O H", "& | ->", "S B T", 3)
    return grown(atoms | back, bound, "! X N ~ WX", "F G", "& | -> <-> && or", "U W R M", 5)


def grown(
    atoms: st.SearchStrategy[str],
    bound: st.SearchStrategy[str],
    plain: str,
    one: str,
    join: str,
    two: str,
    leaves: int,
) -> st.SearchStrategy[str]:
    return st.recursive(
        atoms,
        lambda part: (
            st.builds(lambda op, x: f"{op} {x}", st.sampled_from(plain.split()), part)
            | st.builds(lambda op, k, x: f"{op}{k} {x}", st.sampled_from(one.split()), bound, part)
            | st.builds(lambda x, op, y: f"({x} {op} {y})", part, st.sampled_from(join.split()), part)
            | st.builds(
                lambda x, op, k, y: f"({x} {op}{k} {y})", part, st.sampled_from(two.split()), bound, part
            )
        ),
        max_leaves=leaves,
    )


@settings(max_examples=40)
@given(text=expressions(), seed=SEEDS)
def test_expressions(text: str, seed: int) -> None:
    check_text("regex", text, rule_from_regex(text, ABC), seed)


@settings(max_examples=60)
@given(text=formulas(), seed=SEEDS)
def test_formulas(text: str, seed: int) -> None:
    check_text("ltlf", text, rule_from_ltlf(text, ABC), seed)


@pytest.mark.parametrize(
    ("form", "text", "problem"),
    [
        ("regex", "a b", "its automaton accepts a, its text does not allow it"),
        ("regex", "a?", "its text allows the empty word, its automaton does not accept it"),
        ("ltlf", "a & N a", "its text allows a a, its automaton does not accept it"),
        ("ltlf", "F a & N false", "None"),
        ("pattern", "absence(of='b')", "its text allows the empty word, its automaton does not accept it"),
        ("regex", "a (", "its text 'a (' cannot be read: it ends too early"),
        ("regex", "a{2,1}", "its text 'a{2,1}' cannot be read: {2,1} asks for at least 2 and at most 1"),
        ("regex", "x", "its text 'x' cannot be read: 'x' is not known"),
        ("ltlf", "O X a", "its text 'O X a' cannot be read: what looks back contains what looks ahead"),
        ("ltlf", "a b", "its text 'a b' cannot be read: unexpected 'b'"),
        ("pattern", "absence('a')", "cannot be read: a call of a pattern is needed, such as absence(of='a')"),
        ("pattern", "absence(of='a', times=1)", "cannot be read: absence takes no times"),
        ("pattern", "exactly(of='a')", "cannot be read: 'times' is no count"),
        ("pattern", "within(trigger='a', reaction='b', limit=1)", "cannot be read: 'counting'"),
        ("pattern", "counter(up='a', down='b', maximum=1, start=2)", "minimum <= start <= maximum is needed"),
    ],
)
def test_what_is_wrong_with_a_text(form: Form, text: str, problem: str) -> None:
    assert problem in str(find_difference(entry(form, text, rule_from_regex("a", ABC))))


@pytest.mark.parametrize(
    ("form", "text"),
    [
        ("regex", "(" * 99 + "a" + ") .*" * 99),
        ("regex", "~(b " * 99 + "a" + ")" * 99),
        ("ltlf", "(" * 45 + "a" + ") -> b" * 45),
        ("ltlf", "G ! " * 24 + "a"),
    ],
)
def test_texts_as_deep_as_the_library_reads(form: Form, text: str) -> None:
    rule = (rule_from_regex if form == "regex" else rule_from_ltlf)(text, ABC)
    assert find_difference(entry(form, text, rule)) is None


def test_names_of_all_kinds() -> None:
    sigma = Alphabet(("F", "true", "it's", '"', "a.b", "größe", "11"))
    formula = """G (!"F" | X [F true 'a.b' "it's"]) & F (größe | '"') & !"true" """
    check_text("ltlf", formula, rule_from_ltlf(formula, sigma), 1)
    expression = """F true "it's"? ['"' 'a.b'] {2} größe* | [^ 11 F]"""
    check_text("regex", expression, rule_from_regex(expression, sigma), 1)
    call = """response(trigger=['F', "it's"], reaction='"')"""
    check_text("pattern", call, PATTERNS["response"].build(["F", "it's"], '"', alphabet=sigma), 1)


def test_an_alphabet_of_thousands() -> None:
    sigma = Alphabet(tuple(f"e{k}" for k in range(2000)))
    cases: list[tuple[Form, str]] = [("regex", "~(.* e1 e2 .*)"), ("ltlf", "G (e1 -> N !e2)")]
    for form, text in cases:
        rule = (rule_from_regex if form == "regex" else rule_from_ltlf)(text, sigma)
        assert find_difference(entry(form, text, rule)) is None


def test_forms_without_a_text() -> None:
    rule = entry("automaton", "", rule_from_regex("a", ABC))
    assert find_difference(rule) is None
    assert find_difference(rule | {"text": "G !a"}) == (
        "the automaton is all that is said, and 'G !a' says more; no text is needed"
    )
    assert "'poem' is no form of a rule" in str(find_difference(rule | {"form": "poem"}))


def test_a_state_that_leads_nowhere() -> None:
    rule = entry("regex", "a", rule_from_regex("a", ABC))
    rule["delta"][1][0] = 2
    rule["delta"].append([-1, -1, -1])
    assert find_difference(rule) == (
        "state 2 of its automaton leads to no marked state; what leads to it is to be left out"
    )


@pytest.mark.parametrize("form", ["regex", "ltlf", "pattern"])
def test_too_large_to_check(form: Form, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(texts, "LIMIT", 100)
    text = {
        "regex": "[^a]* (a [^a]*){50}",
        "ltlf": "G (a -> F[<=50] b)",
        "pattern": "exactly(of='a', times=50)",
    }[form]
    rule = rule_from_ltlf(text, ABC) if form == "ltlf" else rule_from_regex("[^a]* (a [^a]*){50}", ABC)
    with pytest.raises(verifier.TooLargeError, match=r"too large to check: more than 100 steps"):
        find_difference(entry(form, text, rule))


@pytest.mark.parametrize(
    ("form", "text"), [("regex", "(" * 5000 + "a" + ")" * 5000), ("ltlf", "! " * 5000 + "a")]
)
def test_too_deep_to_check(form: Form, text: str) -> None:
    with pytest.raises(verifier.TooLargeError, match="too large to check: its text is nested too deeply"):
        find_difference(entry(form, text, rule_from_regex("a", ABC)))


# --- small certificates -----------------------------------------------------------------------------------


def small(*, nonblocking: bool = True, machine: bool = True) -> Document:
    """A certificate of everything: words of two events, chance, rules that owe, a machine, a choice."""
    sigma = Alphabet(("a", "b", "u"), frozenset("u"))
    mdp = from_outcomes(
        [
            (0, "a", 1, 0.75, ("a",), -1.0),
            (0, "a", 0, 0.25, ("u",), 0.0),
            (0, "b", 1, 1.0, ("b",), 0.5),
            (1, "a", 1, 1.0, ("a", "u"), -2.0),
            (1, "b", 2, 0.5, ("b",), 1.0),
            (1, "b", 0, 0.5, (), 0.0),
        ],
        alphabet=sigma,
        actions=("a", "b"),
        terminal=[2],
        labels={1: "x", 2: "xy"},
        propositions="xy",
    )
    edges = [("u0", "x & !y", "u1", 1.0), ("u1", "y", "u0", 4.0), ("u1", "!y", "u1", -0.25)]
    texts: list[tuple[Form, str]] = [
        ("pattern", "response(trigger='a', reaction='b')"),
        ("regex", "~(.* a a .*)"),
        ("ltlf", "G (u -> N !u)"),
        ("automaton", ""),
    ]
    return certify(
        mdp,
        [said(form, text, sigma) for form, text in texts],
        reward_machine("xy", edges) if machine else None,
        gamma=0.5,
        nonblocking=nonblocking,
        name="small",
    )


def said(form: Form, text: str, sigma: Alphabet) -> Rule:
    match form:
        case "pattern":
            name, arguments = read_call(text)
            automaton = PATTERNS[name].build(**arguments, alphabet=sigma)
        case "ltlf":
            automaton = rule_from_ltlf(text, sigma)
        case _:
            automaton = rule_from_regex(text or "~(.* u a u .*)", sigma)
    return Rule(text or "no u a u", automaton, "", form, text)


def signed(document: Document) -> Document:
    """The certificate with the words and the hash of its numbers."""
    document["claims"]["words"] = verifier.claims_in_words(document)
    document["sha256"] = verifier.digest(document)
    return document


@pytest.mark.parametrize("machine", [True, False])
@pytest.mark.parametrize("nonblocking", [True, False])
def test_a_certificate_is_valid_and_says_so(*, nonblocking: bool, machine: bool) -> None:
    document = small(nonblocking=nonblocking, machine=machine)
    report = verify_text(certificate_text(document))
    assert (report.verdict, report.exit_code, report.failures) == ("valid", 0, [])
    assert list(report.lines()) == ["valid", *(f"  {words}" for words in document["claims"]["words"])]
    assert len(report.words) == 5 + nonblocking


def test_the_hash_covers_everything() -> None:
    document = small()
    document["made_by"] = "somebody else"
    ((statement, where, problem),) = verify(document).failures
    assert (statement, where) == ("hash", "sha256")
    assert problem.endswith("it has been changed after it was signed")


# --- by definition ----------------------------------------------------------------------------------------

Step = tuple[Fraction, Fraction, tuple[int, ...]]


class Meaning:
    """What the statements of a certificate mean, on sets and lists; ``true``: whether all of them hold."""

    def __init__(self, document: Document, texts: list[Document]) -> None:
        self.d, self.rules = document, document["rules"]
        self.texts = texts
        self.gamma = Fraction(str(document["gamma"]))
        found = document["reward_machine"]
        self.machine = None
        if found:
            self.machine = reward_machine(found["propositions"], found["edges"], initial=found["states"][0])
            self.order = [self.machine.states.index(name) for name in found["states"]]
        self.rows = {tuple(row[0]): row for row in document["states"]}

    @property
    def true(self) -> bool:
        try:
            return all(
                [self.probabilities(), self.meanings(), 0 <= self.gamma < 1, self.numbers(), self.kept()]
            ) and (self.reaching() and self.values())
        except (IndexError, KeyError, ValueError):  # it refers to what is not there
            return False

    def numbers(self) -> bool:
        """A negative number is no number of anything, though Python would count from the end."""
        labels = all(
            0 <= label < 1 << len(self.d["propositions"]) for _, _, label, _ in self.d["environment"]
        )
        return labels and all(min(at) >= 0 for at in self.rows)

    def probabilities(self) -> bool:
        rows = [[p for _, p in self.d["initial"]]]
        rows += [[o[0] for o in outs] for *_, choices in self.d["environment"] for _, outs in choices]
        return all(min(row) > 0 and abs(sum(row) - 1) < 1e-9 for row in rows)

    def meanings(self) -> bool:
        """Rules with a text accept, and go on with, the same short words as when the text was read."""
        words = [word for n in range(6) for word in combinations(range(3), repeat=n)]
        return all(
            self.fate(rule, word) == self.fate(text, word)
            for rule, text in zip(self.rules, self.texts, strict=True)
            if rule["text"] and rule != text
            for word in words
        )

    @staticmethod
    def fate(rule: Document, word: tuple[int, ...]) -> tuple[bool, bool]:
        q = 0
        for e in word:
            q = rule["delta"][q][e]
            if q == -1:
                return False, False
            if q < -1 or q >= len(rule["delta"]):
                raise IndexError
        return True, q in rule["marked"]

    def read(self, k: int, q: int, word: list[str]) -> int:
        rule = self.rules[k]
        for event in word:
            if event in rule["events"] and q >= 0:
                q = rule["delta"][q][rule["events"].index(event)]
        return q

    def steps(self, at: tuple[int, ...], action: int) -> list[Step]:
        """The outcomes of an action; a `KeyError` where one of them must not be."""
        s, *qs, u = at
        (outcomes,) = [outs for a, outs in self.d["environment"][s][3] if a == action] or [None]
        if outcomes is None:
            raise KeyError
        steps = []
        for p, to, reward, w in outcomes:
            if min(to, w) < 0:
                raise KeyError
            after = [self.read(k, q, self.d["words"][w]) for k, q in enumerate(qs)]
            v, paid = 0, reward
            if self.machine:
                label = self.d["environment"][to][2]
                true = [x for i, x in enumerate(self.d["propositions"]) if label >> i & 1]
                v, paid = self.machine.step(self.order[u], true)
                v = self.order.index(v)
            if -1 in after or (to, *after, v) not in self.rows:
                raise KeyError
            steps.append((Fraction(str(p)), Fraction(str(paid)), (to, *after, v)))
        return steps

    def kept(self) -> bool:
        """Follow all enabled actions from the start: no rule breaks, nothing is owed at an end."""
        start = [(s, *[0] * len(self.rules), 0) for s, _ in self.d["initial"]]
        self.met: dict[tuple[int, ...], dict[int, list[Step]]] = {}
        while start:
            at = start.pop()
            if at not in self.met:
                _, enabled, policy, *_ = self.rows[at]
                terminal = self.d["environment"][at[0]][0]
                if terminal and self.d["nonblocking"] and not self.satisfied(at):
                    return False
                if terminal and enabled:
                    return False
                if not terminal and policy not in enabled:
                    return False
                self.met[at] = {a: self.steps(at, a) for a in enabled}
                start += [t for outs in self.met[at].values() for _, _, t in outs]
        return True

    def satisfied(self, at: tuple[int, ...]) -> bool:
        return all(q in rule["marked"] for q, rule in zip(at[1:-1], self.rules, strict=True))

    def reaching(self) -> bool:
        good = {
            at
            for at in self.met
            if self.d["environment"][at[0]][0] or (self.d["environment"][at[0]][1] and self.satisfied(at))
        }
        while (
            more := {
                at for at in self.met if any(t in good for outs in self.met[at].values() for _, _, t in outs)
            }
            - good
        ):
            good |= more
        return good == set(self.met) or not self.d["nonblocking"]

    def values(self) -> bool:
        own = dict.fromkeys(self.met, 0.0)
        best = dict.fromkeys(self.met, 0.0)
        gamma = float(self.gamma)
        for _ in range(30):  # the contraction is by at most 1/2 in all that is tried here

            def worth(outs: list[Step], value: dict[tuple[int, ...], float]) -> float:
                return sum(float(p) * (float(r) + gamma * value[t]) for p, r, t in outs)

            own = {
                at: worth(choices[self.rows[at][2]], own) if choices else 0.0
                for at, choices in self.met.items()
            }
            best = {
                at: max((worth(outs, best) for outs in choices.values()), default=0.0)
                for at, choices in self.met.items()
            }
        within = all(
            self.rows[at][4] <= own[at] + 1e-6 and self.rows[at][5] >= best[at] - 1e-6 for at in self.met
        )
        starts = [(p, (s, *[0] * len(self.rules), 0)) for s, p in self.d["initial"]]
        low, high = (sum(p * value[at] for p, at in starts) for value in (own, best))
        claims = self.d["claims"]
        return (
            within
            and claims["value_at_least"] <= low + 1e-6
            and claims["optimum_at_most"] >= high - 1e-6
            and claims["gap_at_most"] >= high - low - 1e-6
        )


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The path to every number, and every yes and no."""
    if isinstance(value, int | float):
        yield path
    elif isinstance(value, list | dict):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from places(value[key], (*path, key))


def put(document: Document, path: tuple[Any, ...], value: object) -> Document:
    other = copy.deepcopy(document)
    inside = other
    for key in path[:-1]:
        inside = inside[key]
    inside[path[-1]] = value
    return other


def at(document: Document, path: tuple[Any, ...]) -> Any:
    inside: Any = document
    for key in path:
        inside = inside[key]
    return inside


@pytest.fixture
def each_rule_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rule that has been compared with its text is not compared again."""
    known = cache(lambda text: find_difference(json.loads(text)))
    monkeypatch.setattr(statements, "find_difference", lambda rule: known(json.dumps(rule)))


@pytest.mark.usefixtures("each_rule_once")
@pytest.mark.parametrize(("machine", "least"), [(True, 300), (False, 80)])
def test_every_number_that_makes_a_statement_false_is_found(*, machine: bool, least: int) -> None:
    document = small(machine=machine)
    texts = copy.deepcopy(document["rules"])
    assert Meaning(document, texts).true
    found = passed = 0
    agreed = []
    for path in places(document):
        if path[0] == "version" or (path[0] in ("rules", "states") and not machine):  # as with one
            continue
        old = at(document, path)
        values = {not old} if isinstance(old, bool) else {old + 1, old - 1, -old, 0.5} - {old}
        for value in values:
            if isinstance(old, int) and not isinstance(value, int):
                continue
            other = signed(put(document, path, value))
            if verify(other).verdict == "valid":
                passed += 1
                assert Meaning(other, texts).true, (path, old, value)
            else:
                found += 1
                if found % 5 == 0:  # to see that the definition can say no
                    agreed.append(not Meaning(other, texts).true)
    assert found > least
    assert passed > 10
    assert np.mean(agreed) > 0.7


@pytest.mark.parametrize(
    ("k", "text"),
    [
        (0, "response(trigger='b', reaction='a')"),
        (0, "response(trigger='a', reaction='u')"),
        (0, "precedence(cause='a', effect='b')"),
        (0, "absence(of='u')"),
        (1, "~(.* a b .*)"),
        (1, "~(.* a a)"),
        (1, "~(.* a a .+)"),
        (2, "G (u -> X !u)"),
        (2, "G (u -> !u)"),
        (2, "G[<=3] (u -> N !u)"),
    ],
)
def test_other_texts_are_found(k: int, text: str) -> None:
    document = small()
    document["rules"][k]["text"] = text
    assert {statement for statement, _, _ in verify(signed(document)).failures} == {"rules"}


@pytest.mark.parametrize(
    ("k", "text"),
    [(0, "succession(trigger='a', reaction='b') "), (1, "( . (?)"), (1, ""), (2, "G"), (0, "import os")],
)
def test_texts_that_are_none_are_found(k: int, text: str) -> None:
    document = small()
    document["rules"][k]["text"] = text
    assert verify(signed(document)).verdict == "not valid"


def test_same_texts_may_be_written_differently() -> None:
    document = small()
    document["rules"][0]["text"] = 'response( trigger = ["a"], reaction = "b" )'
    document["rules"][1]["text"] = "(a? [^a])* a?"
    document["rules"][2]["text"] = "!F (u & X u)"
    assert verify(signed(document)).verdict == "valid"


# --- any process and any rules ----------------------------------------------------------------------------


@settings(max_examples=40)
@given(seed=SEEDS, nonblocking=st.booleans())
def test_any_process_and_any_rules(seed: int, *, nonblocking: bool) -> None:
    mdp = random_process(seed, silent=True)
    rules = [Rule(f"rule {k}", random_rule(seed + k, owing=0.2)) for k in range(2)]
    automata = [rule.automaton for rule in rules]
    edges = [("one", "x", "two", 1.0), ("two", "y | !x", "one", -3.5)]
    machine = reward_machine("xy", edges) if seed % 2 else None
    try:
        document = certify(mdp, rules, machine, gamma=0.9, nonblocking=nonblocking)
    except MDPError as error:
        if "cannot be kept" not in str(error):
            raise
        model = product(mdp, automata, machine)
        assert not nonblocking or not safe_actions(model)[model.initial > 0].any()
        return
    assert verify_text(certificate_text(document)).verdict == "valid"
    if nonblocking:
        model = product(mdp, automata, machine)
        mask = safe_actions(model)
        worst = np.where(mask.any(axis=1), mask.argmax(axis=1), -1).astype(np.int32)
        other = certify(mdp, rules, machine, worst, gamma=0.9)
        value = evaluate(model, worst, gamma=0.9).value
        claims = other["claims"]
        assert abs(claims["value_at_least"] - value) < 1e-8
        assert claims["gap_at_most"] >= claims["optimum_at_most"] - value - 1e-12
        assert abs(claims["optimum_at_most"] - document["claims"]["optimum_at_most"]) < 1e-8


@pytest.mark.parametrize("gamma", [0.0, 0.5, 0.999, 0.999999])
def test_bounds_are_inductive_for_any_discount(gamma: float) -> None:
    mdp = random_process(7)
    document = certify(replace(mdp, reward=mdp.reward * 1e6 / 3), [], None, gamma=gamma)
    assert verify(document).verdict == "valid"


def test_what_cannot_be_certified() -> None:
    mdp = random_process(7)
    with pytest.raises(MDPError, match=r"the rules of 'walk' cannot be kept"):
        certify(mdp, [said("regex", ".{0}", mdp.alphabet)], None, gamma=0.9, name="walk")
    with pytest.raises(MDPError, match=r"the policy has shape \(3,\) and type int64"):
        certify(mdp, [], None, np.zeros(3, np.int64), gamma=0.9)
    with pytest.raises(MDPError, match=r"the policy takes 7 in state 0 of the product, where"):
        certify(mdp, [], None, np.full(5, 7), gamma=0.9)
    wrong = Rule("wrong", rule_from_regex(".*", mdp.alphabet), "", "regex", ".* a .*")
    with pytest.raises(RuleError, match=r"no certificate for 'walk': rules: rule 'wrong': its automaton"):
        certify(mdp, [wrong], None, gamma=0.9, name="walk", nonblocking=False)


# --- garbage ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "it is no JSON"),
        ("[" * 100_000, "nested too deeply"),
        ("[]", "an object with format 'supremal certificate' is needed"),
        ('{"format": "supremal certificate"}', "version None is not known; this program reads 1"),
        ('{"format": "supremal certificate", "version": 1}', "the file: an object with format, version"),
        ("9" * 10_000, "it is no JSON"),
        ('{"a": 1, "a": 2}', "it is no JSON: a key stands twice in an object"),
    ],
)
def test_what_is_no_certificate(text: str, problem: str) -> None:
    report = verify_text(text)
    assert problem in report.unreadable
    assert (report.verdict, report.exit_code) == ("unreadable", 2)


def test_anything_in_any_place_is_told_without_a_traceback() -> None:
    document = json.loads(certificate_text(small()))
    rng = random.Random(1)  # noqa: S311 - a test has no secrets
    nodes = [*inner(document)]
    for path in rng.sample(nodes, 100):
        for value in rng.sample([None, [], {}, "", "x", -1, 10**30, 1e308, float("nan"), [[]], True], 3):
            other = put(document, path, value)
            assert verify(other).verdict in ("valid", "not valid", "unreadable")
            if not isinstance(value, float):
                assert list(verify(signed_if_possible(other)).lines())
    text = certificate_text(small())
    for _ in range(50):
        cut = rng.randrange(len(text))
        assert verify_text(text[:cut] + rng.choice(["", "]", "1", ",", '"']) + text[cut + 1 :]).exit_code in (
            0,
            1,
            2,
        )


def inner(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    for key in value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
        yield (*path, key)
        yield from inner(value[key], (*path, key))


def signed_if_possible(document: Document) -> Document:
    try:
        return signed(document)
    except (KeyError, TypeError, AttributeError):
        return document


# --- alone, and from the command line ---------------------------------------------------------------------


@pytest.mark.parametrize("by", [["-I", "verifier"], ["-m", "verifier"]])
def test_the_verifier_runs_alone(tmp_path: Path, by: list[str]) -> None:
    source = Path(verifier.__file__).parent
    shutil.copytree(source, tmp_path / "verifier", ignore=shutil.ignore_patterns("__pycache__"))
    file = tmp_path / "certificate.json"

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-S", "-W", "error", *by, *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env={})

    document = small()
    file.write_text(certificate_text(document), encoding="utf-8")
    done = run(str(file))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(
        "valid\n  As long as only enabled actions are taken, no rule is ever broken"
    )

    file.write_text(certificate_text(signed(put(document, ("states", 0, 4), 99.0))), encoding="utf-8")
    done = run(str(file), "--json")
    assert done.returncode == 1
    told = json.loads(done.stdout)
    assert told["verdict"] == "not valid"
    assert told["failures"][0]["statement"] == "bounds"
    assert "lower is 99.0" in told["failures"][0]["problem"]

    file.write_bytes(b"\xff")
    done = run(str(file))
    assert (done.stdout, done.returncode) == ("unreadable: it is no text in UTF-8\n", 2)
    assert (run("nowhere").returncode, run().returncode) == (2, 2)


TASK = """
[events]
controllable = ["go", "rest"]
[[plant]]
name = "walk"
transitions = "marked out\\n in -go-> out\\n in -rest-> in\\n out -rest-> in"
[environment]
chances = {}
[[rule]]
name = "no rest twice"
pattern = "never_sequence"
sequence = ["rest", "rest"]
[learner]
gamma = 0.5
"""


@pytest.fixture
def run_folder(tmp_path: Path) -> Path:
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "task.toml").write_text(TASK, encoding="utf-8")
    (folder / "result.json").write_text('{"settings": {"gamma": 0.5}}', encoding="utf-8")
    task = read_task(folder / "task.toml")
    assert isinstance(task.environment, TabularMDP)
    model = product(task.environment, [rule.automaton for rule in task.rules])
    policy = np.where(safe_actions(model).any(axis=1), safe_actions(model).argmax(axis=1), -1)
    np.savez(
        folder / "learned.npz", seeds=np.array([3, 4]), policy=np.stack([policy, policy]).astype(np.int32)
    )
    return folder


def test_certify_and_verify(run_folder: Path) -> None:
    done = CliRunner().invoke(certify_command, [str(run_folder), "--seed", "4"], catch_exceptions=False)
    assert done.exit_code == 0
    file = run_folder / "certificate.json"
    assert done.output.endswith(f"Written to {file}: {len(json.loads(file.read_text())['states'])} states.\n")
    done = CliRunner().invoke(verify_command, [str(file)])
    assert (done.exit_code, done.output.splitlines()[0]) == (0, "valid")
    done = CliRunner().invoke(verify_command, [str(file), "--json"])
    assert json.loads(done.output)["verdict"] == "valid"
    assert CliRunner().invoke(verify_command, [str(run_folder / "task.toml")]).exit_code == 2


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("task.toml", None, "cannot read it: No such file"),
        ("learned.npz", None, "cannot read it: No such file"),
        ("learned.npz", b"nothing", "it has no arrays seeds"),
        ("result.json", None, "cannot read it: No such file"),
        ("result.json", b"[]", "settings.gamma is missing"),
        ("certificate.json", b"", "the file exists already; choose another with --out"),
    ],
)
def test_a_run_that_is_none(run_folder: Path, name: str, content: bytes | None, problem: str) -> None:
    (run_folder / name).unlink(missing_ok=True)
    if content is not None:
        (run_folder / name).write_bytes(content)
    done = CliRunner().invoke(certify_command, [str(run_folder)])
    assert problem in str(done.exception)


def test_a_policy_that_is_not_there(run_folder: Path) -> None:
    done = CliRunner().invoke(certify_command, [str(run_folder), "--seed", "9"])
    assert "seed 9 was not run; known: 3, 4" in str(done.exception)
    np.savez(run_folder / "learned.npz", seeds=np.array([3]), policy=np.zeros(4))
    done = CliRunner().invoke(certify_command, [str(run_folder)])
    assert "seeds has shape (1,), policy (4,); [N] and [N, S] are needed" in str(done.exception)


def supremal(*arguments: str) -> Result:
    return CliRunner().invoke(main, arguments, catch_exceptions=False)


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawing takes most of the time of a short run."""
    monkeypatch.setattr(figures, "check_figures", lambda: None)  # does not import matplotlib
    monkeypatch.setattr(publish, "save_curves", lambda *_, **__: None)
    monkeypatch.setattr(page, "automaton_svg", lambda *_, **__: "")


def certified(name: str, folder: Path) -> Path:
    """The certificate of a short run of an example, whose folder has been moved in between."""
    run = folder / "run"
    task = ROOT / "examples" / f"{name}.toml"
    assert supremal("run", str(task), "--episodes", "300", "--out", str(run)).exit_code == 0
    moved = run.rename(folder / "moved")
    done = supremal("certify", str(moved))
    assert done.exit_code == 0, done.output
    return moved / "certificate.json"


@pytest.mark.usefixtures("no_pictures")
def test_a_run_from_its_task_file_to_its_verdict(tmp_path: Path) -> None:
    file = certified("frozen_lake", tmp_path)
    done = supremal("verify", str(file))
    assert (done.exit_code, done.output.splitlines()[0]) == (0, "valid")
    document = json.loads(file.read_text(encoding="utf-8"))
    i, row = next((i, row) for i, row in enumerate(document["states"]) if row[1])
    row[4] = row[5] + 1
    file.write_text(certificate_text(document), encoding="utf-8")
    done = supremal("verify", str(file))
    assert done.exit_code == 1
    assert done.output.startswith(f"not valid\n  bounds: state {i}, action ")


@pytest.mark.usefixtures("no_pictures")
def test_a_run_whose_task_names_files(tmp_path: Path) -> None:
    file = certified("manufacturing_cell", tmp_path)
    assert len(list((file.parent / "files").iterdir())) == 1
    assert supremal("verify", str(file)).output.startswith("valid\n")

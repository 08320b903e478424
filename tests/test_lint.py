"""What is worth a second look about rules: a least example of each, and all words as the other road."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import get_args

import click
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

import book
from strategies import automata
from supremal import (
    Alphabet,
    AlphabetError,
    Automaton,
    from_outcomes,
    from_text,
    from_transitions,
    inverse_project,
    universal,
)
from supremal.automata.build import empty
from supremal.cli import main
from supremal.cli.rules import document, text
from supremal.rules.finding import Kind
from supremal.rules.lint import Finding, lint
from supremal.rules.rule import Rule
from supremal.task.task import Options, Task

AB = Alphabet(("a", "b"))
ANYTHING = universal(AB)
EXAMPLES = Path(__file__).parents[1] / "examples"


def parse(text: str, alphabet: Alphabet = AB) -> Automaton:
    return from_text(text.replace(";", "\n"), alphabet=alphabet)


RULES = {
    name: Rule(name, parse(text))
    for name, text in {
        "never a": "0 -b-> 0",
        "never b": "0 -a-> 0",
        "never a, again": "0 -b-> 1 ; 1 -b-> 0",
        "once a": "0 -a-> 1 ; 0 -b-> 0 ; 1 -b-> 1",
        "twice a": "0 -a-> 1 ; 1 -a-> 2 ; 0 -b-> 0 ; 1 -b-> 1 ; 2 -b-> 2",
        "some a": "marked 1 ; 0 -b-> 0 ; 0 -a-> 1 ; 1 -a, b-> 1",
        "some b": "marked 1 ; 0 -a-> 0 ; 0 -b-> 1 ; 1 -a, b-> 1",
        "a first": "0 -a-> 1 ; 1 -a, b-> 1",
        "a first, some": "marked 1 ; 0 -a-> 1 ; 1 -a, b-> 1",
        "odd": "marked 1 ; 0 -a-> 1 ; 1 -a-> 0 ; 0 -b-> 0 ; 1 -b-> 1",
        "even": "marked 0 ; 0 -a-> 1 ; 1 -a-> 0 ; 0 -b-> 0 ; 1 -b-> 1",
        "a is answered": "marked 0 ; 0 -b-> 0 ; 0 -a-> 1 ; 1 -a-> 1 ; 1 -b-> 0",
        "no bb": "0 -a-> 0 ; 0 -b-> 1 ; 1 -a-> 0",
        "dead after aa": "marked 0 ; 0 -b-> 0 ; 0 -a-> 1 ; 1 -b-> 0 ; 1 -a-> dead ; dead -a, b-> dead",
    }.items()
} | {"nothing": Rule("nothing", empty(AB)), "anything": Rule("anything", ANYTHING)}


def found(*names: str, plants: tuple[Automaton, ...] = (ANYTHING,), nonblocking: bool = True) -> list[str]:
    return [str(each) for each in lint([RULES[name] for name in names], plants, nonblocking=nonblocking)]


# --- a least example of each ------------------------------------------------------------------------------


def test_nothing_is_found_where_nothing_is_odd() -> None:
    assert found() == found("no bb", "a is answered") == found("no bb", "a is answered", plants=()) == []
    assert found("never a", plants=(parse("0 -a, b-> 1 ; 1 -b-> 0"),)) == []


def test_contradictions() -> None:
    assert found("nothing", "no bb") == ["rule 'nothing' accepts no word at all"]
    assert found("no bb", "some a", "once a", "never a") == [
        "rules 'some a' and 'never a' contradict each other: no word satisfies both",
        "rule 'once a' is implied by rule 'never a'",
    ]
    assert found("never a", "never b", "odd", "no bb")[0] == (
        "rules 'never a' and 'odd' contradict each other: no word satisfies both"
    )
    three = [Rule(f"some {e}", parse(f"marked 1 ; 0 -{e}-> 1 ; 1 -{e}-> 1", Alphabet((e,)))) for e in "ab"]
    three.append(Rule("one of all", parse("marked 1 ; 0 -a, b-> 1")))
    texts = [str(each) for each in lint(three, [ANYTHING])]
    assert texts == [
        "rules 'some a', 'some b' and 'one of all' contradict each other: no word satisfies all of them"
    ]


def test_contradictions_with_what_can_happen() -> None:
    only_b, a_or_b = parse("0 -b-> 0"), parse("0 -a-> 1 ; 0 -b-> 2")
    assert found("some a", plants=(only_b,)) == [
        "rule 'some a' contradicts what can happen: no such word satisfies it",
        "rule 'some a' speaks of 'a', which can never happen",
    ]
    assert found("some a", "no bb", "some b", plants=(a_or_b,))[0] == (
        "rules 'some a' and 'some b' contradict what can happen: no such word satisfies both"
    )
    halves = (parse("0 -a-> 1"), parse("0 -b-> 1", Alphabet(("b", "a"))))  # together they can do nothing
    assert found("some a", plants=halves)[0].startswith("rule 'some a' contradicts what can happen")


def test_never_bites() -> None:
    assert found("anything", plants=()) == ["rule 'anything' never bites: " + NEVER]
    assert found("no bb", plants=(parse("0 -a, b-> 1 ; 1 -a-> 0"),)) == ["rule 'no bb' never bites: " + NEVER]
    busy = parse("marked 0 ; 0 -a-> 1 ; 1 -b-> 0")
    assert found("a is answered", plants=(busy,)) == ["rule 'a is answered' never bites: " + NEVER]
    closed = found("dead after aa", plants=(busy,), nonblocking=False)
    assert closed[-1] == "rule 'dead after aa' never bites: nothing that can happen breaks it"


NEVER = "nothing that can happen breaks it or leaves it unsatisfied in the end"


def test_implied() -> None:
    assert found("once a", "twice a") == ["rule 'twice a' is implied by rule 'once a'"]
    assert found("twice a", "once a") == ["rule 'twice a' is implied by rule 'once a'"]
    assert found("never a", "never a, again", "once a") == [
        "rule 'never a, again' says the same as rule 'never a'",
        "rule 'once a' is implied by rule 'never a'",
    ]
    assert found("no bb", "a first, some", "a first", "some a") == [
        "rule 'a first' is implied by rule 'a first, some'",
        "rule 'some a' is implied by rule 'a first, some'",
    ]


def test_implied_by_others_together() -> None:
    assert found("no bb", "a first", "some a", "a first, some") == [
        "rule 'a first, some' is implied by rules 'a first' and 'some a' together"
    ]
    alone = [
        Rule("a before b", parse("0 -a-> 1 ; 1 -a, b-> 1")),
        Rule("c before a", parse("0 -c-> 1 ; 1 -a, c-> 1", Alphabet(("a", "c")))),
        Rule("few", parse("0 -d-> 1", Alphabet(("d",)))),
        Rule("c before b", parse("0 -c-> 1 ; 1 -b, c-> 1", Alphabet(("b", "c")))),
    ]
    assert [(each.kind, each.rules) for each in lint(alone)] == [
        ("implied", ("c before b", "a before b", "c before a"))
    ]
    assert str(lint(alone)[0]).endswith("is implied by rules 'a before b' and 'c before a' together")


def test_rules_that_contradict_imply_nothing() -> None:
    assert [each.kind for each in lint([RULES[name] for name in ("odd", "even", "no bb")])] == [
        "contradiction"
    ]


def test_events_in_no_plant() -> None:
    plant = parse("marked 0 ; 0 -a-> 0 ; away -c-> away", Alphabet(("a", "c")))
    rule = Rule("rule", parse("0 -a-> 1 ; 1 -b-> 0 ; 0 -c, d-> 0 ; 1 -c-> 1", Alphabet(tuple("abcd"))))
    (finding,) = (each for each in lint([rule], [plant]) if each.kind == "event in no plant")
    assert str(finding) == "rule 'rule' speaks of 'b' and 'd', which can never happen"
    cs = Rule("cs", parse("0 -c-> 1", Alphabet(("c",))))
    assert str(lint([cs], [plant])[0]) == "rule 'cs' speaks of 'c', which can never happen"
    assert lint([cs]) == []


def test_dead_states() -> None:
    (text,) = found("dead after aa", plants=())
    assert text.startswith("rule 'dead after aa' lets a a pass, and can never be satisfied after it: ")
    assert text.endswith("from its state dead no marked one can be reached")
    plant = parse("0 -a-> 1 ; 1 -b-> 0 ; 1 -a-> 2 ; 2 -a-> 2")
    (finding,) = lint([RULES["a is answered"]], [plant])
    assert finding == Finding(
        "dead state",
        ("a is answered",),
        "after a a, nothing that can happen satisfies rule 'a is answered' any more",
        ("a", "a"),
    )
    assert found("a is answered", plants=(plant,), nonblocking=False)[0].endswith("it has no force")


def test_no_force() -> None:
    assert found("some a", "no bb", nonblocking=False) == [
        "rule 'some a' owes something, but nothing has to be completed: it has no force"
    ]
    assert found("a first, some", nonblocking=False) == [
        "rule 'a first, some' owes something, but nothing has to be completed: that part of it has no force"
    ]


# --- bounds -----------------------------------------------------------------------------------------------


def counter(name: str, event: str, states: int) -> Rule:
    arrows = [(str(k), event, str((k + 1) % states)) for k in range(states)]
    return Rule(name, from_transitions(Alphabet((event,)), arrows, marked=["0"]))


def test_what_takes_too_many_states_is_left_open() -> None:
    rules = [counter("one", "a", 7), counter("two", "b", 7)]
    assert lint(rules, max_states=100) == []
    assert [str(each) for each in lint(rules, max_states=40)] == [
        "too many states to say whether others imply rules 'one' and 'two'"
    ]
    odd = [RULES["odd"], counter("one", "b", 7)]
    plants = [counter(name, name, 7).automaton for name in "cd"]
    assert [str(each) for each in lint(odd, plants, max_states=10)] == [
        "rule 'odd' speaks of 'a', which can never happen",
        "rule 'one' speaks of 'b', which can never happen",
        "too many states to say whether any word satisfies all of rules 'odd' and 'one'",
        "too many states to say how what can happen bears on rules 'odd' and 'one'",
        "too many states to say whether any word that can happen satisfies all of rules 'odd' and 'one'",
        "too many states to say whether others imply rules 'odd' and 'one'",
    ]


def test_many_events_and_many_rules() -> None:
    sigma = Alphabet(tuple(f"e{k}" for k in range(2_000)))
    rules = [
        Rule(f"r{k}", inverse_project(from_text(f"0 -e{k}-> 1 \n 1 -e{k + 1}-> 0"), sigma)) for k in range(12)
    ]
    kinds = {each.kind for each in lint([*rules, rules[3]], [universal(sigma)], max_states=1_000)}
    assert kinds == {"implied", "left open"}


def test_events_have_to_agree() -> None:
    with pytest.raises(AlphabetError, match="'a' is uncontrollable in one"):
        lint([RULES["never a"]], [from_text("uncontrollable a \n 0 -a-> 0")])


# --- supremal rules ---------------------------------------------------------------------------------------

SENTENCE = "b is never done twice in a row."
TASK = Task(
    "demo",
    Alphabet(("a", "b", "c", "d")),
    (universal(Alphabet(("a", "b", "c", "d"))),),
    rules=(
        Rule("no bb", RULES["no bb"].automaton, SENTENCE, "unsafe"),
        replace(RULES["a is answered"], form="ltlf", text="G (a -> F b)"),
        RULES["never a, again"],
    ),
)


def told(task: Task) -> str:
    return click.unstyle("\n".join(text(task, document(task))))


def test_rules_are_told() -> None:
    assert (
        told(TASK)
        == """\
rule no bb
  b is never done twice in a row.
  given as unsafe
  safety: it forbids words, and owes nothing
  accepts ε; a; b
  rejects b b; a b b; b b a
  2 states, 3 transitions
    0
      b → 1
      any other event: stays
    1
      a → 0
      b: breaks the rule
      any other event: stays
rule a is answered
  ltlf: G (a -> F b)
  progress: it forbids no word, but owes something; without nonblocking it has no force
  accepts ε; b; a b
  rejects a; a a; b a
  2 states, 4 transitions
    0
      a → 1
      any other event: stays
    1 (not satisfied)
      b → 0
      any other event: stays
rule never a, again
  given as automaton
  safety: it forbids words, and owes nothing
  accepts ε; b; b b
  rejects a; a a; a b
  2 states, 2 transitions
    0
      a: breaks the rule
      b → 1
      any other event: stays
    1
      a: breaks the rule
      b → 0
      any other event: stays
worth a second look:
  - rule 'a is answered' is implied by rule 'never a, again'"""
    )


def test_large_rules_are_told_in_short() -> None:
    many = Alphabet(tuple(f"e{k}" for k in range(2_000)))
    strict = Rule("strict", from_text("0 -e5-> 1 \n 1 -e7-> 0", alphabet=many))
    ring = counter("ring", "e0", 50)
    free = Rule("free", universal(many))
    lines = told(Task("large", many, rules=(strict, ring, free))).splitlines()
    assert [line.strip() for line in lines if "any" in line or "more states" in line] == [
        *["any other event: breaks the rule"] * 2,
        *["any other event: stays"] * 20,
        "and 30 more states: --json has all",
        "any event: stays",
    ]
    assert f"  - rule 'free' never bites: {NEVER}" in lines
    assert f"  accepts ε; {'e0 ' * 20}… (50 events); {'e0 ' * 20}… (100 events)" in lines
    assert "  rejects no word" in lines


def test_what_is_told_is_the_document() -> None:
    said = json.loads(json.dumps(document(TASK)))
    assert said.keys() == {"task", "rules", "findings"}
    first = said["rules"][0]
    assert first.pop("automaton") == {
        "name": "no bb",
        "events": ["a", "b"],
        "states": ["0", "1"],
        "initial": "0",
        "marked": ["0", "1"],
        "transitions": [["0", "a", "0"], ["0", "b", "1"], ["1", "a", "0"]],
    }
    assert first == {
        "name": "no bb",
        "form": "unsafe",
        "text": "",
        "sentence": SENTENCE,
        "class": "safety",
        "states": 2,
        "transitions": 3,
        "accepted": [[], ["a"], ["b"]],
        "rejected": [["b", "b"], ["a", "b", "b"], ["b", "b", "a"]],
    }
    (finding,) = said["findings"]
    assert finding.pop("text") in told(TASK)
    assert finding == {"kind": "implied", "rules": ["a is answered", "never a, again"], "word": []}


def test_options_and_environment_of_a_task_count() -> None:
    lamp = from_outcomes([(0, "a", 0, 1.0, ("a",))], alphabet=AB)
    assert "speaks of 'b', which can never happen" in told(
        Task("lamp", AB, environment=lamp, rules=(RULES["no bb"],))
    )
    closed = Task("closed", AB, rules=(RULES["some a"],), options=Options(nonblocking=False))
    assert "- rule 'some a' owes something" in told(closed)
    small = Task("small", AB, rules=(RULES["no bb"], RULES["odd"]), options=Options(max_states=2))
    assert "- too many states to say" in told(small)
    assert told(Task("fine", AB, rules=(RULES["no bb"],))).endswith("nothing odd was found")


@pytest.mark.parametrize(("names", "code"), [(["no bb", "some a"], 0), (["never a", "some a"], 1)])
def test_a_contradiction_is_the_answer_no(
    names: list[str], code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    task = Task("demo", AB, rules=tuple(RULES[name] for name in names))
    monkeypatch.setattr("supremal.task.reading.read_task", lambda _: task)
    spoken, as_json = (CliRunner().invoke(main, ["rules", "demo.toml", *more]) for more in ([], ["--json"]))
    assert spoken.exit_code == as_json.exit_code == code
    assert spoken.output == told(task) + "\n"
    assert json.loads(as_json.output) == json.loads(json.dumps(document(task)))


def test_a_task_file() -> None:
    result = CliRunner().invoke(main, ["rules", str(EXAMPLES / "pickup_delivery.toml")])
    assert result.exit_code == 0, result.output
    assert "rule no U-turn\n  No U-turn: never two rights or two lefts in a row.\n" in result.output
    assert result.output.endswith("nothing odd was found\n")
    missing = CliRunner().invoke(main, ["rules", str(EXAMPLES / "missing.toml")])
    assert missing.exit_code == 2
    assert "missing.toml" in missing.output


# --- all words --------------------------------------------------------------------------------------------

EVERY = [*book.all_words("ab", 7)]
SHORT = [word for word in EVERY if len(word) <= 4]
"""Two rules and a plant of two states each: what can be told apart is by words of at most seven events."""


class Said:
    """A rule or a plant as sets of words over a and b, what it does not know being free."""

    def __init__(self, automaton: Automaton) -> None:
        machine = book.read(automaton)
        state = {word: book.after(machine, book.project(word, machine.events)) for word in EVERY}
        self.can = {word for word in EVERY if state[word] is not None}
        self.marks = {word for word in EVERY if state[word] in machine.marked}
        self.may = book.prefixes(self.marks)

    def matters(self, event: str) -> bool:
        return any(
            ((*word[:k], *word[k:]) in self.marks) != ((*word[:k], event, *word[k:]) in self.marks)
            for word in SHORT
            for k in range(len(word) + 1)
        )


def expected(
    rules: list[Rule], plant: Automaton, *, nonblocking: bool
) -> Iterator[tuple[Kind, tuple[str, ...]]]:
    """The definitions of the lints, on sets of words."""
    said = {rule.name: Said(rule.automaton) for rule in rules}
    world = Said(plant)
    sound = [name for name in said if said[name].marks]
    clash = len(sound) < len(said)
    yield from (("contradiction", (name,)) for name in said if name not in sound)
    if len(sound) == 2 and not said["r1"].marks & said["r2"].marks:
        clash = True
        yield "contradiction", ("r1", "r2")
    for rule in rules:
        if rule.name in sound and any(
            word not in said[rule.name].may for word in said[rule.name].can & {*SHORT}
        ):
            yield "dead state", (rule.name,)
    for name in sound:
        rule = said[name]
        strange = [e for e in "ab" if e not in plant.alphabet or not any(e in word for word in world.can)]
        if any(rule.matters(event) for event in strange):
            yield "event in no plant", (name,)
        owes = any(word not in rule.marks for word in rule.may if word in SHORT)
        if owes and not nonblocking:
            yield "no force", (name,)
        good = rule.marks & world.can
        if not good:
            clash = True
            yield "contradiction", (name,)
            continue
        forbids = [word for word in SHORT if word not in rule.may]
        bites = not world.can.isdisjoint(forbids) or (nonblocking and not world.marks <= rule.marks)
        if not bites and (nonblocking or forbids or not owes):
            yield "never bites", (name,)
        if nonblocking and not rule.may & world.can & {*SHORT} <= book.prefixes(good):
            yield "dead state", (name,)
    if not clash and len(sound) == 2 and not said["r1"].marks & said["r2"].marks & world.can:
        yield "contradiction", ("r1", "r2")
    new = [name for name in sound if len(said[name].marks) < len(EVERY)]
    if len(new) == 2 and said["r1"].marks <= said["r2"].marks:
        yield "implied", ("r2", "r1")
    elif len(new) == 2 and said["r2"].marks <= said["r1"].marks:
        yield "implied", ("r1", "r2")


RANDOM = automata(events="ab", max_events=2, max_states=2, missing=0.25, marked=0.6)


@given(parts=st.tuples(RANDOM, RANDOM), plant=RANDOM, nonblocking=st.booleans())
def test_all_lints_by_all_words(parts: tuple[Automaton, ...], plant: Automaton, *, nonblocking: bool) -> None:
    rules = [Rule(f"r{k}", part) for k, part in enumerate(parts, 1)]
    findings = lint(rules, [plant], nonblocking=nonblocking)
    assert sorted((each.kind, each.rules) for each in findings) == sorted(
        expected(rules, plant, nonblocking=nonblocking)
    )
    for each in findings:
        assert (each.kind == "dead state") == bool(each.word)
        assert all(repr(name) in each.text for name in each.rules)
    order = [get_args(Kind).index(each.kind) for each in findings]
    assert order == sorted(order)


@given(st.lists(RANDOM, min_size=3, max_size=4))
def test_what_is_implied_can_be_left_out(parts: list[Automaton]) -> None:
    rules = [Rule(f"r{k}", part) for k, part in enumerate(parts)]
    implied = {each.rules[0]: each.rules[1:] for each in lint(rules) if each.kind == "implied"}
    marks = {rule.name: Said(rule.automaton).marks for rule in rules}
    for name, others in implied.items():
        assert set.intersection(*(marks[other] for other in others)) <= marks[name]
    kept = [marks[rule.name] for rule in rules if rule.name not in implied]
    assert set.intersection(*kept) == set.intersection(*marks.values())

"""The rules of a task: by a pattern, an expression, a formula or an automaton."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, Literal

from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.compose import extend
from supremal.errors import RuleError
from supremal.rules.ltlf import rule_from_ltlf, sentence_of_ltlf
from supremal.rules.patterns import PATTERNS, REQUIRED, Pattern, sentence_of
from supremal.rules.regex import rule_from_regex, sentence_of_regex
from supremal.rules.rule import Rule
from supremal.rules.sequences import complete_safe, complete_unsafe, rule_from_safe, rule_from_unsafe
from supremal.task._automata import DRAWN, named, read_drawn, read_model_file, settle
from supremal.task._fields import (
    Field,
    anything,
    called,
    check_keys,
    choose,
    distinct,
    event_of,
    need,
    one_of,
    take,
    text,
    whole,
)
from supremal.task._slips import placed, placed_in

_WAYS: Final = ("pattern", "regex", "ltlf", "file", "transitions")
_ALWAYS: Final = ("name", "sentence", "over")
_FORMS: Final = ("rule", "safe", "unsafe")


def read_rules(field: Field, alphabet: Alphabet | None, folder: Path) -> list[Rule]:
    """Read one ``[[rule]]``: one rule, or all that a model file has; those without a name are called "".

    Without an ``alphabet`` nothing is made of it: what needs none is checked.
    """
    arguments = [key for known in PATTERNS.values() for key in known.parameters]
    way = choose(field, _WAYS, (*_ALWAYS, *arguments, *DRAWN, "form", "max_states"))
    if alphabet is None:
        if way == "pattern":
            _said_by_pattern(field)
        return []
    match way:
        case "pattern":
            return [_by_pattern(field, alphabet)]
        case "regex" | "ltlf":
            return [_by_text(field, way, alphabet)]
    return _by_automata(field, way, alphabet, folder)


def rename(rule: Rule, called: str) -> Rule:
    """Return ``rule``, and its automata, with another name."""
    drawn = None if rule.drawn is None else replace(rule.drawn, name=called)
    return replace(rule, name=called, automaton=replace(rule.automaton, name=called), drawn=drawn)


def _about(field: Field, alphabet: Alphabet) -> Alphabet:
    """Read ``over``, the events that a rule is about; left out: all."""
    if "over" not in field:
        return alphabet
    chosen = frozenset(distinct(event_of(alphabet))(field["over"]))
    return Alphabet(
        tuple(word for word in alphabet if word in chosen),
        alphabet.uncontrollable.intersection(chosen),
        alphabet.unobservable.intersection(chosen),
    )


# --- by name ----------------------------------------------------------------------------------------------

_RIGHT: Final = {
    "events": "an event, or a list of events,",
    "sequence": "a list of events, in their order,",
    "lists": "a list, with an event or a list of events for each,",
    "number": "a whole number",
    "choice": "a word",
    "counting": '"all", an event or a list of events',
}


def _by_pattern(field: Field, alphabet: Alphabet) -> Rule:
    chosen, arguments, sentence = _said_by_pattern(field)
    over, rule = _about(field, alphabet), called(field)
    for key in arguments:
        if chosen.parameters[key].kind not in ("number", "choice") and arguments[key] != "all":
            _check_events(field[key], over)
    with _argued(field, chosen.name, rule):
        automaton = chosen.build(**arguments, alphabet=over, name=rule)
    written = ", ".join(f"{key}={value!r}" for key, value in arguments.items())
    said = take(field, "sentence", text, sentence)
    return Rule(rule, automaton, said, "pattern", f"{chosen.name}({written})")


def _said_by_pattern(field: Field) -> tuple[Pattern, dict[str, Any], str]:
    """Read a pattern, its arguments, any names in which are those of events, and what it says in words."""
    chosen = PATTERNS[one_of(PATTERNS, "docs/rules.md")(field["pattern"])]
    check_keys(field, ("pattern", *chosen.parameters, *_ALWAYS))
    for key, parameter in chosen.parameters.items():
        if parameter.default is REQUIRED:
            need(field, key, anything, _RIGHT[parameter.kind])
    arguments = {key: field[key].value for key in chosen.parameters if key in field}
    with _argued(field, chosen.name):
        return chosen, arguments, sentence_of(chosen.name, **arguments)


@contextmanager
def _argued(field: Field, pattern: str, rule: str = "") -> Iterator[None]:
    """Put the place of an argument in front of what is wrong with it."""
    with placed(field["pattern"], table=field):
        try:
            yield
        except RuleError as error:
            message = str(error).removeprefix(f"rule {rule!r}: ").removeprefix(f"{pattern}: ")
            raise RuleError(message) from None


def _check_events(field: Field, alphabet: Alphabet) -> None:
    """Check that all names in a field, however deep, are events."""
    if isinstance(field.value, list):
        for element in field.elements():
            _check_events(element, alphabet)
    elif isinstance(field.value, str):
        event_of(alphabet)(field)


# --- by an expression or a formula ------------------------------------------------------------------------


def _by_text(field: Field, form: Literal["regex", "ltlf"], alphabet: Alphabet) -> Rule:
    check_keys(field, (form, "max_states", *_ALWAYS))
    over, rule = _about(field, alphabet), called(field)
    bound = {"max_states": field["max_states"].value} if take(field, "max_states", whole(1), 0) else {}
    said = text(field[form])
    with placed_in(field[form]):
        if form == "regex":
            automaton = rule_from_regex(said, over, name=rule, **bound)
            sentence = sentence_of_regex(said, over)
        else:
            automaton = rule_from_ltlf(said, over, name=rule, **bound)
            sentence = sentence_of_ltlf(said)
    return Rule(rule, automaton, take(field, "sentence", text, sentence), form, " ".join(said.split()))


# --- by automata ------------------------------------------------------------------------------------------


def _by_automata(field: Field, way: str, alphabet: Alphabet, folder: Path) -> list[Rule]:
    keys = DRAWN if way == "transitions" else (way,)
    check_keys(field, (*keys, "form", *_ALWAYS))
    form = take(field, "form", one_of(_FORMS), "rule")
    if way == "transitions":
        automata: Sequence[Automaton] = (read_drawn(field, alphabet),)
    else:
        model = read_model_file(field["file"], folder)
        automata = named(field, model.specs or model.plants)
    sentence = take(field, "sentence", text, "")
    with placed(field[way]):
        return [_of_form(form, _over(field, way, part, alphabet), sentence) for part in automata]


def _over(field: Field, way: str, automaton: Automaton, alphabet: Alphabet) -> Automaton:
    """Return ``automaton`` over the events that the rule is about; left out: its own."""
    settled = settle(field[way], automaton, alphabet)
    if "over" not in field:
        return settled
    over = _about(field, alphabet)
    for word in settled.alphabet:
        if word not in over:
            field["over"].fail(f"lacks {word!r}, which the automaton has; name it too")
    return extend(settled, over, stand_still=False)


def _of_form(form: str, automaton: Automaton, sentence: str) -> Rule:
    """Return the rule that an automaton means in one of the paper's forms."""
    match form:
        case "safe":
            rule, drawn = rule_from_safe(automaton), complete_safe(automaton)
        case "unsafe":
            rule, drawn = rule_from_unsafe(automaton), complete_unsafe(automaton)
        case _:
            return Rule(automaton.name, automaton, sentence)
    return Rule(automaton.name, rule, sentence, "safe" if form == "safe" else "unsafe", drawn=drawn)

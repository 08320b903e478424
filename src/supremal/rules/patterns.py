"""Patterns: rules by name, the primary way to write one.

A pattern is a plain function from events to the automaton of a rule::

    response("start", "stop", alphabet=sigma)

What all of them share:

- An argument that is an event takes one name or several, any of which is meant.  An event may not stand in
  two arguments, but for `not_succession` and `not_chain_succession`.
- ``alphabet`` has all events of the rule, and ``name`` is what to call it.
- The result is the minimal partial automaton over ``alphabet``: it breaks where the rule can no longer be
  kept, and is marked where it is satisfied.  Two ways of saying the same give the same table.
- A `RuleError` says which pattern, which argument, what is wrong with it and what would be right.
- Time and memory: a few states more than the largest number or length that is given, times the events that
  the rule tells apart; then one row of the alphabet's length for each state.  Numbers go up to 10,000, lists
  and sequences up to 1,000.

`PATTERNS` lists them by name with their parameters, and `sentence_of` says what a rule means in plain
English.  ``docs/rules.md`` has the catalogue, with each pattern as a regular expression and as a formula.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from supremal.rules._arguments import REQUIRED, Parameter
from supremal.rules._pattern import REGISTRY, Pattern, sentence_of
from supremal.rules.exclusions import not_chain_succession, not_coexistence, not_succession
from supremal.rules.existence import absence, at_least, at_most, exactly, first, last
from supremal.rules.relations import (
    alternate_precedence,
    alternate_response,
    alternate_succession,
    chain_precedence,
    chain_response,
    chain_succession,
    precedence,
    responded_existence,
    response,
    succession,
)
from supremal.rules.resources import alternation, counter, mutex
from supremal.rules.scopes import between, priority
from supremal.rules.sequencing import never_sequence, only_sequence
from supremal.rules.timing import wait_at_least, within

PATTERNS: Final[Mapping[str, Pattern]] = MappingProxyType(REGISTRY)
"""All patterns by their names."""

__all__ = [
    "PATTERNS",
    "REQUIRED",
    "Parameter",
    "Pattern",
    "absence",
    "alternate_precedence",
    "alternate_response",
    "alternate_succession",
    "alternation",
    "at_least",
    "at_most",
    "between",
    "chain_precedence",
    "chain_response",
    "chain_succession",
    "counter",
    "exactly",
    "first",
    "last",
    "mutex",
    "never_sequence",
    "not_chain_succession",
    "not_coexistence",
    "not_succession",
    "only_sequence",
    "precedence",
    "priority",
    "responded_existence",
    "response",
    "sentence_of",
    "succession",
    "wait_at_least",
    "within",
]

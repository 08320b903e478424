"""A rule: what was said, and the automaton that it means.

However a rule is written, one type comes out: a minimal partial deterministic automaton over events.  It
*breaks* on a word that contains an event of its alphabet for which it has no transition; events outside its
alphabet do not touch it.  Its marked states say where it is *satisfied*: where all of them are marked the
rule only forbids; where some are not, something is still owed there.

One convention for the empty word: it is a word like any other.  Where nothing has happened, no event has
happened: ``absence`` holds of it and ``at_least`` does not, a formula that asks for an event (``a``, ``F a``,
``X a``) is false of it, and one that speaks of all events (``G !a``) is true.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from supremal.automata.automaton import Automaton

Form = Literal["pattern", "regex", "ltlf", "automaton", "safe", "unsafe"]


@dataclass(frozen=True, slots=True, eq=False)
class Rule:
    """A rule as it was said, and what it means.

    Parameters
    ----------
    name
        What messages and files call it.
    automaton
        What it means: a partial automaton that breaks where it has no transition, and is marked where the
        rule is satisfied.
    sentence
        The rule in words.
    form
        How it was written.
    text
        What was written, on one line: a call of a pattern, an expression, a formula, or "".
    drawn
        The automaton that a picture shows, where that is another: the paper's completion with its state s_a.
    """

    name: str
    automaton: Automaton
    sentence: str = ""
    form: Form = "automaton"
    text: str = ""
    drawn: Automaton | None = None

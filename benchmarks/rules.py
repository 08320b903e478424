"""Writing rules: from text to the minimal automaton, beside automata-lib and ltlf2dfa.

The peers read other syntaxes, so each line has the same rule in both: expressions for automata-lib, formulas
for ltlf2dfa.  That calls MONA, a program of its own, and its traces are sets of propositions; it is left out
where it is not installed.  Besides: fifteen rules over sixteen events and their minimised product, a bound of
1,000, and 2,000 events.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from importlib import import_module
from time import perf_counter
from typing import Any

from automata.fa.dfa import DFA
from automata.fa.nfa import NFA

from supremal import Alphabet, minimise, sync, trim
from supremal.rules.ltlf import rule_from_ltlf
from supremal.rules.patterns import PATTERNS
from supremal.rules.regex import rule_from_regex

EVENTS = tuple("abcdefghijklmnop")
SIGMA = Alphabet(EVENTS)
OTHERS = {name: "|".join(e for e in EVENTS if e != name) for name in "ab"}
REGEXES = {
    "[^a]* (a [^a]* b [^a]*)*": f"({OTHERS['a']})*(a({OTHERS['a']})*b({OTHERS['a']})*)*",
    "(a b)* c?": "(ab)*c?",
    ".* a b c .*": ".*abc.*",
    "(a | b){2,9}": "(a|b){2,9}",
}
FORMULAS = ["G(a -> F(b))", "G(!(a & X(a)))", "(!(b)) U a", "G(a -> X(b))", "F(a) & F(b) & F(c)"]
FIFTEEN = [
    ("response", {"trigger": "a", "reaction": "b"}),
    ("precedence", {"cause": "a", "effect": "c"}),
    ("absence", {"of": "p"}),
    ("at_most", {"of": "d", "times": 2}),
    ("never_sequence", {"sequence": ["e", "e"]}),
    ("never_sequence", {"sequence": ["f", "g"]}),
    ("alternation", {"one": "h", "other": "i"}),
    ("not_coexistence", {"one": "j", "other": "k"}),
    ("responded_existence", {"trigger": "l", "partner": "a"}),
    ("counter", {"up": "m", "down": "n", "maximum": 2}),
    ("within", {"trigger": "a", "reaction": "b", "limit": 3, "counting": "all"}),
    ("chain_response", {"trigger": "o", "reaction": "a"}),
    ("not_succession", {"trigger": "k", "forbidden": "l"}),
    ("wait_at_least", {"trigger": "d", "delayed": "f", "count": 2, "counting": "all"}),
    ("priority", {"request": "g", "high": "h", "low": "j"}),
]


def best(verb: Callable[[], object], times: int = 20, budget: float = 2.0) -> float:
    """Return the least seconds that ``verb`` takes, of some times within a budget."""
    least, end = float("inf"), perf_counter() + budget
    for _ in range(times):
        begin = perf_counter()
        verb()
        least = min(least, perf_counter() - begin)
        if perf_counter() > end:
            break
    return least


def peer_regex(text: str) -> int:
    """Return the states of automata-lib's minimal automaton."""
    nfa = NFA.from_regex(text, input_symbols=set(EVENTS))
    return len(DFA.from_nfa(nfa, minify=True).states)


def peer_formula() -> Callable[[str], object] | None:
    """Return ltlf2dfa's translation, None where it or MONA is not installed."""
    try:
        parser = import_module("ltlf2dfa.parser.ltlf").LTLfParser()
    except ImportError:
        return None
    return (lambda text: parser(text).to_dfa()) if shutil.which("mona") else None


def row(what: str, ours: float, theirs: float | None, states: int) -> dict[str, Any]:
    """Print one line and return it."""
    peer = "" if theirs is None else f"{theirs * 1e3:12.2f} ms {theirs / ours:8.0f} ×"
    print(f"{what:32} {states:6,} states {ours * 1e3:10.3f} ms{peer}")
    return {"rule": what, "states": states, "ms": ours * 1e3, "peer_ms": theirs and theirs * 1e3}


def run() -> dict[str, Any]:
    """Print the table; return the record."""
    minimise(trim(rule_from_regex("a", SIGMA)))  # compiles the kernels
    record: dict[str, Any] = {"regex": [], "ltlf": [], "patterns": []}
    print("expressions over 16 events, beside automata-lib")
    for text, other in REGEXES.items():
        rule = rule_from_regex(text, SIGMA)
        ours, theirs = best(lambda t=text: rule_from_regex(t, SIGMA)), best(lambda t=other: peer_regex(t), 3)  # type: ignore[misc]
        record["regex"].append(row(text, ours, theirs, rule.n_states))
    peer = peer_formula()
    print("formulas over 16 events, beside ltlf2dfa" + ("" if peer else " (not installed)"))
    for text in FORMULAS:
        rule = rule_from_ltlf(text, SIGMA)
        ours = best(lambda t=text: rule_from_ltlf(t, SIGMA))  # type: ignore[misc]
        record["ltlf"].append(
            row(text, ours, best(lambda t=text: peer(t), 3) if peer else None, rule.n_states)
        )  # type: ignore[misc]
    print("patterns over 16 events")
    for name, said in FIFTEEN:
        rule = PATTERNS[name].build(**said, alphabet=SIGMA)
        ours = best(lambda n=name, s=said: PATTERNS[n].build(**s, alphabet=SIGMA))  # type: ignore[misc]
        record["patterns"].append(row(name, ours, None, rule.n_states))

    def fifteen() -> int:
        rules = [PATTERNS[name].build(**said, alphabet=SIGMA) for name, said in FIFTEEN]
        return minimise(trim(sync(*rules))).n_states

    many = Alphabet((*(f"e{k}" for k in range(1_998)), "a", "b"))
    record["larger"] = [
        row("15 rules, minimised product", best(fifteen, 3), None, fifteen()),
        row(
            "G (a -> F[<=1000] b)",
            best(lambda: rule_from_ltlf("G (a -> F[<=1000] b)", SIGMA), 3),
            None,
            1_001,
        ),
        row("a{1000}", best(lambda: rule_from_regex("a{1000}", SIGMA), 3), None, 1_001),
        row("G (a -> F b), 2,000 events", best(lambda: rule_from_ltlf("G (a -> F b)", many)), None, 2),
    ]
    return record

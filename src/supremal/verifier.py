r"""Checking a certificate by definition, with exact arithmetic and nothing but Python's standard library.

A certificate holds a decision process, rules, a reward machine, a set of states (s, q₁, …, qₙ, u) of their
product, and for each of them the enabled actions, the action of a policy, a rank and two bounds.  It is
*valid* if ten statements about these numbers hold:

 1. rules: each automaton accepts exactly what its text says, and breaks where nothing can be accepted;
 2. probabilities: those of an action are above 0 and sum to 1, as do those of the start;
 3. start: where the process starts is among the states;
 4. closed: each outcome of an enabled action keeps every rule and leads to one of the states, and where
    an episode ends nothing is owed;
 5. actions: enabled actions are feasible, and who is not at the end has one;
 6. ranks: a state of rank 0 is an end or marked, any other has an enabled action with an outcome of less;
 7. policy: it takes an enabled action wherever there is one;
 8. bounds: lower(s) ≤ E[r + γ lower(s')] for the policy's action, upper(s) ≥ E[r + γ upper(s')] for every
    enabled one, both 0 at an end;
 9. claims: the numbers that are claimed follow from the bounds at the start, and the words from the numbers;
10. hash: the SHA-256 of the content is the one that is given.

By induction over time 3, 4 and 5 mean that no rule is ever broken, whatever happens, and 6 that an end or a
marked state stays within reach; 8 bounds the values, since the operators are monotone and contract by γ < 1.

A number means the shortest decimal of its double, 0.1 one tenth.  Decimals cannot always sum to 1: what is
read is weights, a probability is a weight over the sum of its weights, and that has to be 1 within 1e-9.

This file imports nothing of supremal and runs alone: ``python verifier.py FILE``.  ``docs/certificate.md``
describes the format.

Source: McConnell, Mehlhorn, Näher, Schweitzer, "Certifying algorithms", Computer Science Review 5 (2011);
Brzozowski, "Derivatives of regular expressions", JACM 11 (1964), for expressions; formulas by definition.
"""

from __future__ import annotations

import ast
import hashlib
import json
import math
import re
import sys
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple, NoReturn, TypeAlias, TypeVar

FORMAT: Final = "supremal certificate"
VERSION: Final = 1
STATEMENTS: Final = (
    *("rules", "probabilities", "start", "closed", "actions", "ranks", "policy", "bounds", "claims", "hash"),
)
TEXTS: Final = ("pattern", "regex", "ltlf")
DRAWN: Final = ("automaton", "safe", "unsafe")
"""The forms of a rule: those that have a text, and those in which the automaton is all that is said."""

NONE: Final = -1
LIMIT: Final = 3_000_000
"""How many steps the meaning of one rule's text may take: some seconds."""

_TOLERANCE: Final = Fraction(1, 10**9)
_SHOWN: Final = 20
_LONGEST: Final = 100_000
Row = Any  # of a document whose shape has been checked
State = TypeVar("State", bound=Hashable)
_Failure: TypeAlias = tuple[str, str]


class UnreadableError(Exception):
    """What was read is no certificate; the message says where and what would be right."""


class TextError(Exception):
    """A text of a rule or a guard cannot be read."""


class TooLargeError(Exception):
    """The meaning of a text is too large to work out."""


def _refuse(problem: str) -> NoReturn:
    raise TextError(problem)


# --- texts ------------------------------------------------------------------------------------------------

_NAME: Final = r"""(?P<name>\w+)|(?P<quoted>"[^"]*"|'[^']*')"""


class _Reader:
    """The tokens of a text, one after another; each has a kind and what it says."""

    def __init__(self, text: str, pattern: str) -> None:
        if len(text) > _LONGEST:
            _refuse(f"it has {len(text):,} characters; {_LONGEST:,} are allowed")
        self.tokens: list[tuple[str, str]] = []
        at = 0
        for match in re.finditer(pattern, text):
            if text[at : match.start()].strip():
                break
            self.tokens.append((str(match.lastgroup), match[0]))
            at = match.end()
        if text[at:].strip():
            _refuse(f"unexpected {text[at:].strip()[0]!r}")
        self.tokens.reverse()

    @property
    def kind(self) -> str:
        return self.tokens[-1][0] if self.tokens else "end"

    @property
    def sign(self) -> str:
        return self.tokens[-1][1] if self.kind == "sign" else ""

    def next(self) -> str:
        if not self.tokens:
            _refuse("it ends too early")
        kind, text = self.tokens.pop()
        return text[1:-1] if kind == "quoted" else text

    def take(self, *signs: str) -> bool:
        return self.sign in signs and bool(self.next())

    def expect(self, sign: str) -> None:
        if not self.take(sign):
            _refuse(f"{sign!r} is missing")

    def expect_end(self) -> None:
        if self.tokens:
            _refuse(f"unexpected {self.next()!r}")


def _known(name: str, names: Mapping[str, Any] | frozenset[str]) -> str:
    if name not in names:
        _refuse(f"{name!r} is not known")
    return name


class _Budget:
    """How many steps are left."""

    def __init__(self) -> None:
        self.left = LIMIT

    def spend(self, steps: int) -> None:
        self.left -= steps
        if self.left < 0:
            message = f"too large to check: more than {LIMIT:,} steps; split the rule into smaller ones"
            raise TooLargeError(message)


# --- expressions: each term once, with Brzozowski's derivatives -------------------------------------------

_NOTHING, _EMPTY, _ALL = 0, 1, 2


class _Terms:
    """Terms by number: ``letter`` (a set), ``or``, ``and``, ``then``, ``not``, ``repeat`` (least, most)."""

    def __init__(self, budget: _Budget) -> None:
        self.budget = budget
        self.number: dict[tuple[Any, ...], int] = {}
        self.terms: list[tuple[Any, ...]] = []
        self.empty: list[bool] = []
        self.after: dict[tuple[int, str], int] = {}
        for op, empty in (("or", False), ("then", True), ("and", True)):  # of no parts
            self.make(op, (), empty=empty)

    def make(self, op: str, args: tuple[Any, ...], *, empty: bool) -> int:
        """Return the number of a term; ``empty``: whether it has the empty word."""
        self.budget.spend(1 + len(args))
        term = self.number.setdefault((op, *args), len(self.terms))
        if term == len(self.terms):
            self.terms.append((op, *args))
            self.empty.append(empty)
        return term

    def letter(self, events: frozenset[str]) -> int:
        self.budget.spend(len(events))
        return self.make("letter", (events,), empty=False)

    def join(self, op: str, parts: Iterable[int]) -> int:
        """Return the union ("or") or intersection ("and"); parts of the same kind are taken apart."""
        zero, flat = (_ALL, set[int]()) if op == "or" else (_NOTHING, set[int]())
        for part in parts:
            flat.update(self.terms[part][1:] if self.terms[part][0] == op else (part,))
        if zero in flat:
            return zero
        if len(flat) == 1:
            return flat.pop()
        empty = (any if op == "or" else all)(self.empty[part] for part in flat)
        return self.make(op, tuple(sorted(flat)), empty=empty)

    def then(self, parts: Iterable[int]) -> int:
        flat: list[int] = []
        for part in parts:
            flat += self.terms[part][1:] if self.terms[part][0] == "then" else (part,)
        if _NOTHING in flat:
            return _NOTHING
        if len(flat) == 1:
            return flat[0]
        if flat and self.terms[flat[0]][0] == "or":
            return self.join("or", [self.then([part, *flat[1:]]) for part in self.terms[flat[0]][1:]])
        return self.make("then", tuple(flat), empty=all(self.empty[part] for part in flat))

    def repeat(self, term: int, least: int, most: float) -> int:
        if most == 0 or term == _EMPTY or (term == _NOTHING and least == 0):
            return _EMPTY
        least = 0 if self.empty[term] else least
        return self.make("repeat", (term, least, most), empty=least == 0)

    def invert(self, term: int) -> int:
        if self.terms[term][0] == "not":
            return int(self.terms[term][1])
        if term in (_NOTHING, _ALL):
            return _ALL - term
        return self.make("not", (term,), empty=not self.empty[term])

    def derive(self, term: int, event: str) -> int:
        """Return what may follow ``event``."""
        if (term, event) not in self.after:
            op, *args = self.terms[term]
            if op == "letter":
                after = _EMPTY if event in args[0] else _NOTHING
            elif op in ("or", "and"):
                after = self.join(op, [self.derive(part, event) for part in args])
            elif op == "not":
                after = self.invert(self.derive(args[0], event))
            elif op == "repeat":
                part, least, most = args
                rest = self.repeat(part, max(least - 1, 0), most - 1)
                after = self.then([self.derive(part, event), rest])
            else:
                ways: list[int] = []
                for i, part in enumerate(args):
                    ways.append(self.then([self.derive(part, event), *args[i + 1 :]]))
                    if not self.empty[part]:
                        break
                after = self.join("or", ways)
            self.after[term, event] = after
        return self.after[term, event]


class _Expression(_Reader):
    """Reading an expression: ``names`` stand for terms, and ``numbers`` may stand in counts."""

    def __init__(
        self,
        text: str,
        terms: _Terms,
        sigma: frozenset[str],
        names: Mapping[str, int],
        numbers: Mapping[str, int],
    ) -> None:
        super().__init__(text, rf"{_NAME}|(?P<count>\{{[^{{}}]*\}})|(?P<sign>[().|&~*+?\[\]^])")
        self.terms, self.sigma, self.names, self.numbers = terms, sigma, names, numbers
        terms.budget.spend(len(text))

    def read(self) -> int:
        term = self.either()
        self.expect_end()
        return term

    def either(self) -> int:
        parts = [self.both()]
        while self.take("|"):
            parts.append(self.both())
        return self.terms.join("or", parts)

    def both(self) -> int:
        parts = [self.sequence()]
        while self.take("&"):
            parts.append(self.sequence())
        return self.terms.join("and", parts)

    def sequence(self) -> int:
        parts = [self.factor()]
        while self.kind in ("name", "quoted") or self.sign in ("(", "[", ".", "~"):
            parts.append(self.factor())
        return self.terms.then(parts)

    def factor(self) -> int:
        inverted = False
        while self.take("~"):
            inverted = not inverted
        term = self.atom()
        while self.kind == "count" or self.sign in ("*", "+", "?"):
            term = self.terms.repeat(term, *self.count(self.next()))
        return self.terms.invert(term) if inverted else term

    def count(self, text: str) -> tuple[int, float]:
        if text in "*+?":
            return {"*": (0, math.inf), "+": (1, math.inf), "?": (0, 1)}[text]
        least, comma, most = text[1:-1].partition(",")
        low = self.amount(least)
        high = low if not comma else self.amount(most) if most.strip() else math.inf
        if high < low:
            _refuse(f"{text} asks for at least {low} and at most {high}")
        return low, high

    def amount(self, text: str) -> int:
        word = text.strip()
        if word in self.numbers:
            return self.numbers[word]
        if not re.fullmatch("[0-9]{1,9}", word):
            _refuse(f"{word!r} is no count")
        return int(word)

    def atom(self) -> int:
        if self.take("("):
            if self.take(")"):
                return _EMPTY
            term = self.either()
            self.expect(")")
            return term
        if self.take("."):
            return self.terms.letter(self.sigma)
        if self.take("["):
            others = self.take("^")
            events = self.set()
            while not self.take("]"):
                events |= self.set()
            return self.terms.letter(self.sigma - events if others else events)
        return self.name()

    def name(self) -> int:
        if self.kind not in ("name", "quoted"):
            _refuse(f"unexpected {self.next()!r}")
        return self.names[_known(self.next(), self.names)]

    def set(self) -> frozenset[str]:
        op, *args = self.terms.terms[self.name()]
        if op != "letter":
            _refuse("a set may hold events only")
        found: frozenset[str] = args[0]
        return found


# --- patterns: the expression that each name stands for ---------------------------------------------------

_WAIT: Final = "([^trigger delayed counted]* counted)"
PATTERNS: Final[dict[str, str]] = {
    "absence": "[^of]*",
    "exactly": "[^of]* (of [^of]*){times}",
    "at_most": "[^of]* (of [^of]*){0,times}",
    "at_least": "([^of]* of){times} .*",
    "first": "of .*",
    "last": ".* of",
    "responded_existence": "[^trigger]* | .* partner .*",
    "precedence": "[^cause effect]* (cause .*)?",
    "response": "[^trigger]* | .* reaction [^trigger]*",
    "succession": "([^trigger]* | .* reaction [^trigger]*) & [^trigger reaction]* (trigger .*)?",
    "alternate_precedence": "([^effect]* cause [^effect]* effect)* [^effect]*",
    "alternate_response": "[^trigger]* (trigger [^trigger]* reaction [^trigger]*)*",
    "alternate_succession": "([^trigger reaction] | trigger [^trigger reaction]* reaction)*",
    "chain_precedence": "([^effect] | cause effect)*",
    "chain_response": "([^trigger] | trigger reaction)*",
    "chain_succession": "([^trigger reaction] | trigger reaction)*",
    "not_coexistence": "[^one]* | [^other]*",
    "not_succession": "~(.* trigger .* forbidden .*)",
    "not_chain_succession": "~(.* trigger forbidden .*)",
    "between before": "[^closing]* | [^forbidden closing]* closing .*",
    "between after": "~(.* opening .* forbidden .*)",
    "between between": "~(.* opening [^closing]* forbidden [^closing]* closing .*)",
    "between until": "~(.* opening [^closing]* forbidden .*)",
    "priority": "~(.* request [^high]* low .*)",
    "never_sequence": "~(.* sequence .*)",
    "only_sequence": "([^trigger] | trigger sequence)*",
    "mutex": "[^inside]* (outing [^inside]*)* (visit?)",
    "alternation": "([^one other] | one [^one other]* other)* (one [^one other]*)?",
    "counter": "(idle | up above down | down below up)* (() | up high | down low)",
    "within": "([^trigger] | trigger ([^reaction counted]* counted){0,limit} [^reaction counted]* reaction)*",
    "wait_at_least": f"[^trigger]* (trigger ({_WAIT}{{0,less}} [^trigger delayed counted]* | "
    f"{_WAIT}{{count}} [^trigger]*))*",
}
"""Each pattern as an expression over its arguments; what else stands in one is explained in `_pattern`."""

_SPECIAL: Final = {
    "between": {"scope"},
    "mutex": {"enter", "leave"},
    "counter": {"maximum", "minimum", "start"},
    "within": {"counting"},
    "wait_at_least": {"counting"},
}


def _pattern(text: str, terms: _Terms, sigma: frozenset[str]) -> int:
    """Return the term of a call of a pattern."""
    called, given = _call(text)
    key = f"between {given.get('scope', 'between')}" if called == "between" else called
    template = PATTERNS[_known(key, PATTERNS)]
    names: dict[str, int] = {}
    numbers: dict[str, int] = {}

    def letter(value: object) -> int:
        events = [value] if isinstance(value, str) else value
        if not isinstance(events, list) or not events or not all(isinstance(e, str) for e in events):
            _refuse(f"{value!r} is no event or list of events")
        return terms.letter(frozenset(_known(e, sigma) for e in events))

    def term(piece: str) -> int:
        return _Expression(piece, terms, sigma, names, numbers).read()

    for argument, value in given.items():
        if argument in _SPECIAL.get(called, ()):
            continue
        if not re.search(rf"\b{argument}\b", template):
            _refuse(f"{called} takes no {argument}")
        if argument == "sequence":
            names[argument] = terms.then(map(letter, [value] if isinstance(value, str) else value))
        elif type(value) is int and value >= 0:
            numbers[argument] = value
        else:
            names[argument] = letter(value)
    if called in ("within", "wait_at_least"):  # the ends of a time are no part of it
        counting = given["counting"]
        counted = sigma if counting == "all" else terms.terms[letter(counting)][1]
        ends = "[trigger reaction]" if called == "within" else "[trigger delayed]"
        names["counted"] = terms.letter(counted - terms.terms[term(ends)][1])
        numbers["less"] = max(numbers.get("count", 0) - 1, 0)
    elif called == "mutex":  # an outing: one enters, nobody else does, it leaves; a visit may go on
        pairs = list(zip(map(letter, given["enter"]), map(letter, given["leave"]), strict=True))
        inside = frozenset[str]().union(*(terms.terms[enter][1] for enter, _ in pairs))
        names["inside"] = terms.letter(inside)
        outings, visits = [], []
        for enter, leave in pairs:
            names["enter"], names["leave"] = enter, leave
            names["others"] = terms.letter(inside - terms.terms[enter][1])
            visits.append(term("enter [^others leave]*"))
            outings.append(term("enter [^others leave]* leave"))
        names["outing"], names["visit"] = terms.join("or", outings), terms.join("or", visits)
    elif called == "counter":
        _counter(names, term, given)
    return term(template)


def _counter(names: dict[str, int], term: Callable[[str], int], given: Mapping[str, Any]) -> None:
    """Name the walks of a counter from its start: back to it, ``above`` and ``below``, and anywhere.

    With room for k levels a walk that comes back is (idle | up (one with room for k-1) down)*, and one that
    need not come back is such a walk, then nothing or up and one that need not with room for k-1.
    """
    minimum = given.get("minimum", 0)
    start = minimum if given.get("start") is None else given["start"]
    names["idle"] = term("[^up down]")
    rooms = {"above high up down": given["maximum"] - start, "below low down up": start - minimum}
    if min(rooms.values()) < 0:
        _refuse("minimum <= start <= maximum is needed")
    for words, room in rooms.items():
        back, anywhere, out, home = words.split()
        names[back] = names[anywhere] = _NOTHING if not room else term("idle*")
        for _ in range(room - 1):
            names[back] = term(f"(idle | {out} {back} {home})*")
            names[anywhere] = term(f"{back} (() | {out} {anywhere})")


def _call(text: str) -> tuple[str, dict[str, Any]]:
    """Read a call with keyword arguments, such as ``response(trigger='a', reaction=['b', 'c'])``."""
    try:
        call = ast.parse(text, mode="eval").body
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and not call.args:
            return call.func.id, {str(one.arg): ast.literal_eval(one.value) for one in call.keywords}
    except (SyntaxError, ValueError, MemoryError):
        pass
    _refuse("a call of a pattern is needed, such as absence(of='a')")


# --- formulas: what holds at a moment, from the moments beside it -----------------------------------------

_AHEAD: Final = "XU"
_BACK: Final = "YS"
_TIGHTNESS: Final = {"<->": 0, "->": 1, "|": 2, "&": 3, **dict.fromkeys("UWRMSBT", 4)}
_BOUNDED: Final = "FGUWRMOHSBT"
_SPELLINGS: Final = {
    "WX": "N",
    **dict.fromkeys(("not", "~", "¬"), "!"),
    **dict.fromkeys(("and", "&&", "∧"), "&"),
    **dict.fromkeys(("or", "||", "∨"), "|"),
    **dict.fromkeys(("=>", "→"), "->"),
    **dict.fromkeys(("<=>", "↔"), "<->"),
}
_GUARD_WORDS: Final = frozenset({"true", "false", "not", "and", "or"})
_WORDS: Final = _GUARD_WORDS | {"WX", *"XNFGUWRMYZOHSBT"}
_FORMULA: Final = rf"(?P<bound>\[\s*<=[^\]]*\])|{_NAME}|(?P<sign><->|<=>|->|=>|&&|\|\||[][()!~&|¬∧∨→↔])"


class _Node(NamedTuple):
    """One of ``true``, ``event`` (of a set), ``not``, ``and``, X, U[<=k], and their mirror images Y and S."""

    op: str
    args: tuple[int, ...] = ()
    events: frozenset[str] = frozenset()
    bound: int | None = None


class _Formula(_Reader):
    """A formula as nodes, parts before wholes; ``root`` is the last of them to be read."""

    def __init__(self, text: str, names: frozenset[str], words: frozenset[str] = _WORDS) -> None:
        super().__init__(text, _FORMULA)
        self.tokens = [
            ("sign", _SPELLINGS.get(said, said)) if kind == "sign" or said in words else (kind, said)
            for kind, said in self.tokens
        ]
        self.names = names
        self.nodes: list[_Node] = []
        self.number: dict[_Node, int] = {}
        self.ahead: set[int] = set()
        self.root = self.formula(0)
        self.expect_end()

    def node(self, op: str, *args: int, events: Iterable[str] = (), bound: int | None = None) -> int:
        node = _Node(op, args, frozenset(events), bound)
        number = self.number.setdefault(node, len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(node)
        if op in _AHEAD or not self.ahead.isdisjoint(args):
            self.ahead.add(number)
            if op in _BACK:
                _refuse("what looks back contains what looks ahead")
        return number

    def no(self, part: int) -> int:
        return self.node("not", part)

    def derived(self, op: str, bound: int | None, *parts: int) -> int:
        """Return the node of an operator, in terms of those of `_Node`."""
        a, b = parts[0], parts[-1]
        match op:
            case "!":
                return self.no(a)
            case "&":
                return self.node("and", a, b)
            case "|":
                return self.no(self.node("and", self.no(a), self.no(b)))
            case "->":
                return self.no(self.node("and", a, self.no(b)))
            case "<->":
                return self.node("and", self.derived("->", None, a, b), self.derived("->", None, b, a))
            case "X" | "Y" | "U" | "S":
                return self.node(op, *parts, bound=bound)
            case "N" | "Z":
                return self.no(self.node("XY"[op == "Z"], self.no(a)))
            case "F" | "O":
                return self.node("US"[op == "O"], self.node("true"), a, bound=bound)
            case "G" | "H":
                return self.no(self.derived("FO"[op == "H"], bound, self.no(a)))
            case "W" | "B":
                always = self.derived("GH"[op == "B"], bound, a)
                return self.derived("|", None, always, self.node("US"[op == "B"], a, b, bound=bound))
            case "R" | "T":
                return self.no(self.node("US"[op == "T"], self.no(a), self.no(b), bound=bound))
        return self.node("U", b, self.node("and", a, b), bound=bound)  # M

    def formula(self, loosest: int) -> int:
        left = self.factor()
        while _TIGHTNESS.get(self.sign, NONE) >= loosest:
            op = self.next()
            bound = self.bound(op)
            right = self.formula(_TIGHTNESS[op] + (op in "&|"))
            left = self.derived(op, bound, left, right)
        return left

    def factor(self) -> int:
        if self.kind in ("name", "quoted"):
            return self.event([self.next()])
        op = self.next()
        if op == "(":
            inside = self.formula(0)
            self.expect(")")
            return inside
        if op == "[":
            names = [self.next()]
            while not self.take("]"):
                names.append(self.next())
            return self.event(names)
        if op in ("true", "false"):
            return self.node("true") if op == "true" else self.no(self.node("true"))
        if op not in ("!", *"XNFGYZOH"):
            _refuse(f"unexpected {op!r}")
        bound = self.bound(op)
        return self.derived(op, bound, self.factor())

    def event(self, names: list[str]) -> int:
        return self.node("event", events=[_known(name, self.names) for name in names])

    def bound(self, op: str) -> int | None:
        if self.kind != "bound":
            return None
        match = re.fullmatch(r"\[\s*<=\s*([0-9]{1,9})\s*\]", self.next())
        if match is None or op not in _BOUNDED:
            _refuse(f"{op!r} has a bound that cannot be read")
        return int(match[1])

    def moment(
        self,
        happening: frozenset[str],
        before: Sequence[int] | None,
        after: Sequence[int] | None,
        *,
        empty: bool = False,
    ) -> list[int]:
        """Return what holds at a moment, a number a node: `NONE` where it does not, 0 where it does.

        ``before`` and ``after`` are these numbers at the moments beside it, None where there is none.  U and
        S with a bound have the distance to where their second part holds.
        """
        now: list[int] = []
        for i, (op, args, events, bound) in enumerate(self.nodes):
            near = after if op in _AHEAD else before
            if op == "true":
                value = 0
            elif op == "event":
                value = NONE if events.isdisjoint(happening) else 0
            elif op == "not":
                value = NONE if now[args[0]] != NONE else 0
            elif op == "and":
                value = min(now[args[0]], now[args[1]], 0)
            elif empty or (near is None and op in "XY"):
                value = NONE
            elif op in "XY":
                value = min(near[args[0]], 0)  # type: ignore[index]
            elif now[args[1]] != NONE:
                value = 0
            elif near is None or NONE in (near[i], now[args[0]]) or near[i] == bound:
                value = NONE
            else:
                value = near[i] + (bound is not None)
            now.append(value)
        return now


# --- an automaton and its text ----------------------------------------------------------------------------


def find_difference(rule: Mapping[str, Any]) -> str | None:
    """Return what is wrong with the automaton of a rule by its text, None where they agree.

    Parameters
    ----------
    rule
        An entry of the certificate's ``rules``.

    Raises
    ------
    TooLargeError
        If the text takes too many steps to work out.

    Notes
    -----
    An expression or a pattern is read forwards, its derivatives beside the automaton; a formula is read
    backwards, from the end of a word to its beginning, beside the set of states from which the word is
    accepted, with a memory of what looks back.  Either covers all words, however long.

    Examples
    --------
    >>> once = {"form": "regex", "text": "b* (a b*)?", "events": ["a", "b"], "delta": [[1, 0], [-1, 1]]}
    >>> find_difference(once | {"marked": [0, 1]})
    >>> find_difference(once | {"marked": [1]})
    'its text allows the empty word, its automaton does not accept it'
    """
    form, text, budget = rule["form"], rule["text"], _Budget()
    if form in DRAWN:
        return (
            f"the automaton is all that is said, and {text!r} says more; no text is needed" if text else None
        )
    if form not in TEXTS:
        return f"{form!r} is no form of a rule; one of {', '.join(TEXTS + DRAWN)} is needed"
    marked, delta, sigma = frozenset(rule["marked"]), rule["delta"], frozenset(rule["events"])
    stuck = _stuck(delta, marked)
    if stuck != NONE:
        return f"state {stuck} of its automaton leads to no marked state; what leads to it is to be left out"
    try:
        if form == "ltlf":
            word = _by_moments(_Formula(text, sigma), rule["events"], delta, marked, budget)
        else:
            terms = _Terms(budget)
            if form == "pattern":
                start = _pattern(text, terms, sigma)
            else:
                names = {event: terms.letter(frozenset({event})) for event in sigma}
                start = _Expression(text, terms, sigma, names, {}).read()
            word = _by_derivatives(start, terms, rule["events"], delta, marked)
    except (TextError, KeyError, TypeError, ValueError) as error:
        return f"its text {text[:80]!r} cannot be read: {error}"
    except RecursionError:
        message = "too large to check: its text is nested too deeply"
        raise TooLargeError(message) from None
    if word is None:
        return None
    state = 0 if delta else NONE
    for event in word:
        state = NONE if state == NONE else delta[state][rule["events"].index(event)]
    said = " ".join(word) or "the empty word"
    if state in marked:
        return f"its automaton accepts {said}, its text does not allow it"
    return f"its text allows {said}, its automaton does not accept it"


def _stuck(delta: list[list[int]], marked: frozenset[int]) -> int:
    """Return a state that can be reached and leads to no marked one, `NONE` where there is none."""
    into: dict[int, list[int]] = {}
    for state, row in enumerate(delta):
        for target in row:
            into.setdefault(target, []).append(state)
    reached = _spread([0] if delta else [], lambda state: [t for t in delta[state] if t != NONE])
    live = _spread(marked, lambda state: into.get(state, []))
    return min(reached - live, default=NONE)


def _spread(start: Iterable[State], steps: Callable[[State], Iterable[State]]) -> set[State]:
    found = set(start)
    queue = list(found)
    for state in queue:  # grows while it is walked through
        fresh = [target for target in steps(state) if target not in found]
        found.update(fresh)
        queue += dict.fromkeys(fresh)
    return found


def _classes(events: Sequence[str], sets: Iterable[frozenset[str]], delta: list[list[int]]) -> list[int]:
    """Return the place of one event of each class that neither ``sets`` nor the automaton tell apart."""
    distinct = set(sets)
    first: dict[Any, int] = {}
    for e, event in enumerate(events):
        sorts = (tuple(event in one for one in distinct), tuple(row[e] for row in delta))
        first.setdefault(sorts, e)
    return list(first.values())


def _find_word(
    start: State, letters: Sequence[int], step: Callable[[State, int], State], wrong: Callable[[State], bool]
) -> list[int] | None:
    """Return the letters of a shortest way from ``start`` to where something is wrong."""
    via: dict[State, tuple[State, int] | None] = {start: None}
    queue = [start]
    for state in queue:  # grows while it is walked through
        if wrong(state):
            word, back = [], via[state]
            while back:
                word.append(back[1])
                back = via[back[0]]
            return word[::-1]
        for letter in letters:
            after = step(state, letter)
            if after not in via:
                via[after] = state, letter
                queue.append(after)
    return None


def _by_derivatives(
    start: int, terms: _Terms, events: Sequence[str], delta: list[list[int]], marked: frozenset[int]
) -> list[str] | None:
    """Return a word that a term and an automaton do not agree on."""
    letters = _classes(events, [term[1] for term in terms.terms if term[0] == "letter"], delta)

    def step(state: tuple[int, int], e: int) -> tuple[int, int]:
        terms.budget.spend(1)
        term, q = state
        return terms.derive(term, events[e]), NONE if q == NONE else delta[q][e]

    def wrong(state: tuple[int, int]) -> bool:
        return terms.empty[state[0]] != (state[1] in marked)

    word = _find_word((start, 0 if delta else NONE), letters, step, wrong)
    return None if word is None else [events[e] for e in word]


def _by_moments(
    formula: _Formula, events: Sequence[str], delta: list[list[int]], marked: frozenset[int], budget: _Budget
) -> list[str] | None:
    """Return a word that a formula and an automaton do not agree on."""
    nodes, root = formula.nodes, formula.root
    letters = _classes(events, [node.events for node in nodes if node.op == "event"], delta)
    kept = {"ahead": {root}, "back": set[int]()}  # what the moment beside it has to know
    for i, node in enumerate(nodes):
        if node.op in _AHEAD + _BACK:
            kept["ahead" if node.op in _AHEAD else "back"].add(node.args[0] if node.op in "XY" else i)

    def moment(e: int, before: Row, after: Row, side: str) -> tuple[int, ...]:
        budget.spend(len(nodes))
        now = formula.moment(frozenset({events[e]}), before, after)
        return tuple(value if i in kept[side] else 0 for i, value in enumerate(now))

    pasts: dict[Row, int] = {None: 0}  # what can have been; None before the first moment
    moves: dict[tuple[int, int], int] = {}
    for past in (queue := [None]):
        for e in letters:
            after: Row = moment(e, past, None, "back")
            if after not in pasts:
                pasts[after] = len(pasts)
                queue.append(after)
            moves[pasts[past], e] = pasts[after]

    def prepend(state: tuple[Row, frozenset[int]], e: int) -> tuple[Row, frozenset[int]]:
        budget.spend(len(delta))
        rest, accepting = state
        now = tuple(moment(e, past, rest[moves[p, e]], "ahead") for past, p in pasts.items())
        return now, frozenset(q for q, row in enumerate(delta) if row[e] in accepting)

    nothing = formula.moment(frozenset(), None, None, empty=True)

    def wrong(state: tuple[Row, frozenset[int]]) -> bool:
        values = nothing if state[0][0] is None else state[0][0]
        return bool((values[root] != NONE) != (0 in state[1]))

    word = _find_word(((None,) * len(pasts), marked), letters, prepend, wrong)
    return None if word is None else [events[e] for e in reversed(word)]


# --- the file ---------------------------------------------------------------------------------------------

_TYPES: Final = {int: "a whole number", str: "a text", bool: "true or false"}
_RULE: Final = {"name": str, "form": str, "text": str, "events": [str], "delta": [[int]], "marked": [int]}
_MACHINE: Final = {"states": [str], "propositions": [str], "edges": [(str, str, str, float)]}
_SHAPE: Final[dict[str, Any]] = {
    "format": str,
    "version": int,
    "made_by": str,
    "task": str,
    "events": [str],
    "uncontrollable": [str],
    "actions": [str],
    "propositions": [str],
    "words": [[str]],
    "gamma": float,
    "nonblocking": bool,
    "rules": [_RULE],
    "reward_machine": object,
    "initial": [(int, float)],
    "environment": [(bool, bool, int, [(int, [(float, int, float, int)])])],
    "states": [([int], [int], int, int, float, float)],
    "claims": {"value_at_least": float, "optimum_at_most": float, "gap_at_most": float, "words": [str]},
    "sha256": str,
}


def _check_shape(value: Row, shape: Row, where: str) -> None:
    """Raise an `UnreadableError` where ``value`` is not laid out as ``shape``, which shows it by types."""
    parts: list[tuple[Row, Row]] = []
    if isinstance(shape, dict):
        right = isinstance(value, dict) and value.keys() == shape.keys()
        wanted = f"an object with {', '.join(shape)}"
        parts = list(shape.items())
    elif isinstance(shape, list):
        right, wanted = isinstance(value, list), "a list"
        parts = [(i, shape[0]) for i in range(len(value))] if right else []
    elif isinstance(shape, tuple):
        right, wanted = isinstance(value, list) and len(value) == len(shape), f"a list of {len(shape)}"
        parts = list(enumerate(shape))
    elif shape is float:
        right = type(value) in (int, float) and abs(value) <= sys.float_info.max
        wanted = "a finite number"
    else:
        right, wanted = shape is object or type(value) is shape, _TYPES.get(shape, "")
    if not right:
        message = f"{where or 'the file'}: {wanted} is needed"
        raise UnreadableError(message)
    for key, part in parts:
        _check_shape(value[key], part, f"{where} {key}".strip())


def digest(document: Mapping[str, Any]) -> str:
    """Return the SHA-256 of all but ``sha256``, as JSON in ASCII with sorted keys and no blanks.

    Examples
    --------
    >>> digest({"b": 0.1, "a": 1, "sha256": "any"}) == hashlib.sha256(b'{"a":1,"b":0.1}').hexdigest()
    True
    """
    content = {key: value for key, value in document.items() if key != "sha256"}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()


@cache
def _exact(number: float) -> Fraction:
    """Return the decimal that a number is written as."""
    return Fraction(repr(number))


def _near(number: Fraction) -> str:
    """Return about ``number``, as messages show it."""
    try:
        return repr(float(number))
    except OverflowError:
        return "a number beyond all doubles"


# --- the statements ---------------------------------------------------------------------------------------


@dataclass
class Report:
    """What came out: the statements that are false, or why the file cannot be read.

    Parameters
    ----------
    failures
        For each false statement its name, where it is false, and what is wrong and would be right.
    unreadable
        Why the file is no certificate; "" where it is one.
    words
        What a valid certificate says.
    """

    failures: list[tuple[str, str, str]] = field(default_factory=list)
    unreadable: str = ""
    words: list[str] = field(default_factory=list)

    @property
    def verdict(self) -> str:
        """One of "valid", "not valid", "unreadable"."""
        return "unreadable" if self.unreadable else "not valid" if self.failures else "valid"

    @property
    def exit_code(self) -> int:
        """0 if the certificate is valid, 1 if it is not, 2 if it cannot be read."""
        return ("valid", "not valid", "unreadable").index(self.verdict)

    def lines(self) -> Iterator[str]:
        """Tell it in lines: the verdict, and what is claimed, or what is wrong."""
        yield f"{self.verdict}: {self.unreadable}" if self.unreadable else self.verdict
        yield from (f"  {said}" for said in self.words)
        yield from (f"  {': '.join(failure)}" for failure in self.failures[:_SHOWN])
        if len(self.failures) > _SHOWN:
            yield f"  and {len(self.failures) - _SHOWN:,} more"

    def document(self) -> dict[str, Any]:
        """Return it as an object for JSON."""
        failures = [dict(zip(("statement", "where", "problem"), one, strict=True)) for one in self.failures]
        return {
            "verdict": self.verdict,
            "claims": self.words,
            "failures": failures,
            "unreadable": self.unreadable or None,
        }


class _Move(NamedTuple):
    """An outcome of an enabled action, and what is wrong with it; where it leads, `NONE` if nowhere."""

    weight: Fraction
    reward: Fraction
    target: int
    problem: str


def verify_text(text: str) -> Report:
    """Check a certificate that was read from a file.

    Examples
    --------
    >>> verify_text("{").unreadable
    'it is no JSON: Expecting property name enclosed in double quotes'
    """
    try:
        document = json.loads(text, object_pairs_hook=_object)
    except ValueError as error:
        return Report(unreadable=f"it is no JSON: {getattr(error, 'msg', error)}")
    except RecursionError:
        return Report(unreadable="it is no certificate: nested too deeply")
    return verify(document)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        message = "a key stands twice in an object"
        raise ValueError(message)
    return found


def verify(document: object) -> Report:
    """Check a certificate.

    Parameters
    ----------
    document
        What ``json.loads`` makes of the file.

    Returns
    -------
    Report
        The verdict, and each statement that is false.

    Notes
    -----
    Linear in the outcomes of enabled actions, in fractions; and what each rule's text takes.
    """
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        return Report(unreadable=f"it is no certificate; an object with format {FORMAT!r} is needed")
    version = document.get("version")
    if version != VERSION:
        return Report(unreadable=f"version {version!r} is not known; this program reads {VERSION}")
    try:
        _check_shape(document, _SHAPE, "")
        if document["reward_machine"] is not None:
            _check_shape(document["reward_machine"], _MACHINE, "reward_machine")
    except UnreadableError as error:
        return Report(unreadable=str(error))
    failures = _Checker(document).failures()
    return Report(failures, words=[] if failures else document["claims"]["words"])


class _Checker:
    """A document of the right shape; the method of a statement yields where it is false, and why."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document
        self.rule_list, self.machine = document["rules"], document["reward_machine"]
        self.environment, self.states = document["environment"], document["states"]
        self.at = [tuple(row[0]) for row in self.states]
        self.number = {at: i for i, at in enumerate(self.at)}
        self.terminal: list[bool] = []
        self.moves: list[dict[int, list[_Move]]] = []

    def failures(self) -> list[tuple[str, str, str]]:
        found = [("references", *failure) for failure in self.references()]
        if not found:  # what refers to nothing cannot be followed
            self.terminal = [self.environment[at[0]][0] for at in self.at]
            for statement in STATEMENTS:
                found += [(statement, *failure) for failure in getattr(self, statement)()]
        return found

    # --- that every name is known, and every number one of something

    def references(self) -> Iterator[_Failure]:
        d, machine = self.document, self.machine
        actions, events, ends = len(d["actions"]), d["events"], len(self.environment)
        for key in ("events", "actions", "propositions"):
            yield from _twice(key, d[key])
        for names in (d["uncontrollable"], *d["words"]):
            yield from _unknown("words", names, events)
        for rule in self.rule_list:
            where, size = f"rule {rule['name']!r}", len(rule["delta"])
            yield from _twice(where, rule["events"])
            yield from _outside(where, rule["marked"], 0, size)
            for row in rule["delta"]:
                yield from _outside(where, row, NONE, size)
                if len(row) != len(rule["events"]):
                    yield where, f"a row has {len(row)} entries; one for each event is needed"
        sizes = [ends, *(len(rule["delta"]) for rule in self.rule_list), 1]
        if machine:
            sizes[-1] = len(machine["states"])
            yield from _twice("reward_machine", machine["states"])
            yield from _unknown("reward_machine", machine["propositions"], d["propositions"])
            for edge in machine["edges"]:
                yield from _unknown("reward_machine", edge[:4:2], machine["states"])
        yield from _twice("initial", [s for s, _ in d["initial"]])
        yield from _outside("initial", [s for s, _ in d["initial"]], 0, ends)
        for s, (_, _, label, choices) in enumerate(self.environment):
            where = f"environment state {s}"
            yield from _outside(where, [label], 0, 1 << len(d["propositions"]))
            yield from _twice(where, [action for action, _ in choices])
            yield from _outside(where, [action for action, _ in choices], 0, actions)
            for _, outcomes in choices:
                yield from _outside(where, [to for _, to, _, _ in outcomes], NONE, ends)
                yield from _outside(where, [word for *_, word in outcomes], 0, len(d["words"]))
        yield from _twice("states", self.at)
        for i, (at, enabled, action, *_) in enumerate(self.states):
            if len(at) != len(sizes) or not all(0 <= q < size for q, size in zip(at, sizes, strict=True)):
                yield f"state {i}", f"is {at}; {len(sizes)} numbers, each below that of {sizes}, are needed"
            yield from _outside(f"state {i}", enabled, 0, actions)
            yield from _outside(f"state {i}", [action], NONE, actions)

    # --- 1 to 3

    def rules(self) -> Iterator[_Failure]:
        for rule in self.rule_list:
            try:
                problem = find_difference(rule)
            except TooLargeError as error:
                problem = str(error)
            if problem:
                yield f"rule {rule['name']!r}", problem

    def probabilities(self) -> Iterator[_Failure]:
        rows = [("initial", [p for _, p in self.document["initial"]])]
        for s, (*_, choices) in enumerate(self.environment):
            rows += [(f"environment state {s}, action {a}", [o[0] for o in outs]) for a, outs in choices]
        for where, weights in rows:
            total = sum(map(_exact, weights), Fraction(0))
            if min(weights, default=0) <= 0 or abs(total - 1) > _TOLERANCE:
                yield where, f"{weights}; numbers above 0 that sum to 1 are needed"

    def start(self) -> Iterator[_Failure]:
        for at, _ in self.starts():
            if at not in self.number:
                yield "initial", f"{[*at]} is not among the states"

    def starts(self) -> list[tuple[tuple[int, ...], Fraction]]:
        return [((s, *[0] * len(self.rule_list), 0), _exact(p)) for s, p in self.document["initial"]]

    # --- 4: what an enabled action leads to

    def closed(self) -> Iterator[_Failure]:
        for i, (at, *_) in enumerate(self.states):
            if self.terminal[i] and self.document["nonblocking"]:
                for rule, q in zip(self.rule_list, at[1:-1], strict=True):
                    if q not in rule["marked"]:
                        yield (
                            f"state {i}",
                            f"the episode has ended and rule {rule['name']!r} is not satisfied",
                        )
            moves = self.moves_of(i)
            self.moves.append(moves)
            for action, outcomes in moves.items():
                for move in outcomes:
                    if move.problem:
                        yield f"state {i}, action {self.document['actions'][action]!r}", move.problem

    def moves_of(self, i: int) -> dict[int, list[_Move]]:
        at, enabled, *_ = self.states[i]
        choices = dict(self.environment[at[0]][3])
        return {a: [self.follow(at, outcome) for outcome in choices[a]] for a in enabled if a in choices}

    def follow(self, at: list[int], outcome: Row) -> _Move:
        weight, to, reward, word = outcome
        after = [self.read_word(k, q, word) for k, q in enumerate(at[1:-1])]
        problem, target = "", NONE
        if NONE in after:
            broken = self.rule_list[after.index(NONE)]["name"]
            problem = f"{self.document['words'][word]} breaks rule {broken!r}; it must not be enabled"
        elif to == NONE:
            problem = "leads to a state that is not given"
        else:
            v, paid, problem = self.read_label(at[-1], self.environment[to][2])
            reward = paid if self.machine else reward
            target = self.number.get((to, *after, v), NONE)
            if target == NONE:
                problem = problem or f"leads to {[to, *after, v]}, which is not among the states"
        return _Move(_exact(weight), _exact(reward), target, problem)

    @cache  # noqa: B019 - a checker lives as long as its one check
    def read_word(self, k: int, q: int, word: int) -> int:
        """Return where rule k comes to from its state q, `NONE` if that breaks it."""
        rule = self.rule_list[k]
        for event in self.document["words"][word]:
            if q != NONE and event in rule["events"]:
                q = rule["delta"][q][rule["events"].index(event)]
        return q

    @cache  # noqa: B019 - as above
    def read_label(self, u: int, label: int) -> tuple[int, float, str]:
        """Return the next state of the machine, its reward, and what is wrong with it."""
        if self.machine is None:
            return 0, 0, ""
        name, names = self.machine["states"][u], frozenset(self.machine["propositions"])
        true = frozenset(p for i, p in enumerate(self.document["propositions"]) if label >> i & 1)
        loops, taken = set(), set()
        try:
            for source, text, target, reward in self.machine["edges"]:
                if source == name:
                    guard = _Formula(text, names, _GUARD_WORDS)
                    if guard.moment(true, None, None)[guard.root] != NONE:
                        taken.add((target, reward))
                    if target == name:
                        loops.add((target, reward))
        except (TextError, RecursionError) as error:
            return NONE, 0, f"a guard of the reward machine cannot be read: {error}"
        ways = taken or loops or {(name, 0)}
        if len(ways) > 1:
            return NONE, 0, f"the reward machine has several ways from {name!r} with {sorted(true)}"
        ((target, reward),) = ways
        return self.machine["states"].index(target), reward, ""

    # --- 5 to 7

    def actions(self) -> Iterator[_Failure]:
        for i, (at, enabled, *_) in enumerate(self.states):
            if self.terminal[i] == bool(enabled):
                right = "none is needed, for the episode has ended" if enabled else "one is needed"
                yield f"state {i}", f"enabled are {enabled}; {right}"
            for action in sorted(set(enabled).difference(a for a, _ in self.environment[at[0]][3])):
                yield f"state {i}", f"{self.document['actions'][action]!r} is not feasible there"

    def ranks(self) -> Iterator[_Failure]:
        for i, (at, _, _, rank, *_) in enumerate(self.states if self.document["nonblocking"] else ()):
            satisfied = all(q in rule["marked"] for rule, q in zip(self.rule_list, at[1:-1], strict=True))
            goal = self.terminal[i] or (self.environment[at[0]][1] and satisfied)
            targets = {move.target for moves in self.moves[i].values() for move in moves} - {NONE}
            if rank < 0 or (rank == 0 and not goal):
                yield f"state {i}", f"has rank {rank}; 0 is for an end or a marked state, others have more"
            elif rank > 0 and all(self.states[t][3] >= rank for t in targets):
                yield f"state {i}", f"has rank {rank}, and no enabled action can lead to a lower one"

    def policy(self) -> Iterator[_Failure]:
        for i, (_, enabled, action, *_) in enumerate(self.states):
            right = [NONE] if self.terminal[i] else enabled
            if action not in right:
                yield f"state {i}", f"takes {action}; one of {right} is needed"

    # --- 8 to 10

    def bounds(self) -> Iterator[_Failure]:
        gamma = _exact(self.document["gamma"])
        if not 0 <= gamma < 1:
            yield "gamma", f"is {self.document['gamma']}; a number from 0 up to, not including, 1 is needed"
        lower, upper = ([_exact(row[k]) for row in self.states] for k in (4, 5))

        def expected(moves: list[_Move], value: list[Fraction]) -> Fraction:
            total = sum((move.weight for move in moves), Fraction(0))
            worth = (move.weight * (move.reward + gamma * value[move.target]) for move in moves)
            return sum(worth, Fraction(0)) / total

        for i, (_, _, chosen, *_) in enumerate(self.states):
            if self.terminal[i] and (lower[i] or upper[i]):
                yield f"state {i}", "the episode has ended; both bounds have to be 0"
            for action, moves in self.moves[i].items():
                if not moves or any(move.target == NONE or move.weight <= 0 for move in moves):
                    continue  # as has been told
                where, most = (
                    f"state {i}, action {self.document['actions'][action]!r}",
                    expected(moves, upper),
                )
                if upper[i] < most:
                    yield where, f"upper is {_near(upper[i])}; at least {_near(most)} is needed"
                if action == chosen and lower[i] > (least := expected(moves, lower)):
                    yield where, f"lower is {_near(lower[i])}; at most {_near(least)} is needed"

    def claims(self) -> Iterator[_Failure]:
        said, starts = self.document["claims"], self.starts()
        rows = [(p, self.states[self.number[at]]) for at, p in starts if at in self.number]
        if len(rows) < len(starts) or min((p for p, _ in rows), default=0) <= 0:
            return  # as has been told
        total = sum((p for p, _ in rows), Fraction(0))
        least, most = (sum((p * _exact(row[k]) for p, row in rows), Fraction(0)) / total for k in (4, 5))
        low, high, gap = (_exact(said[key]) for key in ("value_at_least", "optimum_at_most", "gap_at_most"))
        if low > least:
            yield "value_at_least", f"is {_near(low)}; at most {_near(least)} follows"
        if high < most:
            yield "optimum_at_most", f"is {_near(high)}; at least {_near(most)} follows"
        if gap < high - low:
            yield "gap_at_most", f"is {_near(gap)}; at least {_near(high - low)} follows"
        if said["words"] != claims_in_words(self.document):
            yield "words", f"they should be {claims_in_words(self.document)}"

    def hash(self) -> Iterator[_Failure]:
        found = digest(self.document)
        if found != self.document["sha256"]:
            yield "sha256", f"the content has {found}; it has been changed after it was signed"


def _twice(where: str, names: Sequence[Hashable]) -> Iterator[_Failure]:
    yield from (
        (where, f"{name!r} stands {n} times; once is right") for name, n in Counter(names).items() if n > 1
    )


def _unknown(where: str, names: Iterable[str], among: Sequence[str]) -> Iterator[_Failure]:
    yield from (
        (where, f"{name!r} is not known; known: {', '.join(among)}") for name in names if name not in among
    )


def _outside(where: str, numbers: Iterable[int], least: int, end: int) -> Iterator[_Failure]:
    yield from ((where, f"{n}; {least} to {end - 1} is possible") for n in numbers if not least <= n < end)


def claims_in_words(document: Mapping[str, Any]) -> list[str]:
    """Return what a certificate claims, as sentences."""
    claims, gamma = document["claims"], document["gamma"]
    names = ", ".join(rule["name"] for rule in document["rules"]) or "there is none"
    words = [
        f"As long as only enabled actions are taken, no rule is ever broken, whatever happens: {names}.",
        "There is always an enabled action until the episode ends.",
        f"From the start the policy is worth at least {claims['value_at_least']}, discounted by {gamma}.",
        f"Nothing that takes enabled actions only is worth more than {claims['optimum_at_most']}.",
        f"So the policy is at most {claims['gap_at_most']} below the best.",
    ]
    if document["nonblocking"]:
        words.insert(
            2, "An end or a marked state stays within reach, and where an episode ends nothing is owed."
        )
    return words


def main(arguments: Sequence[str]) -> int:
    """Check the file that is named, tell the verdict, and return the exit code."""
    paths = [argument for argument in arguments if argument != "--json"]
    if len(paths) != 1:
        sys.stderr.write("usage: python verifier.py FILE [--json]\n")
        return 2
    try:
        report = verify_text(Path(paths[0]).read_text(encoding="utf-8"))
    except OSError as error:
        report = Report(unreadable=f"cannot read {paths[0]}: {error.strerror}")
    except UnicodeDecodeError:
        report = Report(unreadable="it is no text in UTF-8")
    told = json.dumps(report.document(), indent=2) if "--json" in arguments else "\n".join(report.lines())
    sys.stdout.write(told + "\n")
    return report.exit_code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

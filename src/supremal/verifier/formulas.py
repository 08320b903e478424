"""Formulas by definition: what holds at a moment follows from what is so then and from its neighbours.

    X f: f holds at the next moment, and there is one        Y f: at the one before
    f U g: g holds now, or f does and f U g at the next      f S g: at the one before
    f U[<=k] g: as f U g, with g at most k moments away      f S[<=k] g

All other operators stand for formulas with these.  A word is read from its end, once for each of the pasts
that the operators that look back can tell apart.

Source: De Giacomo, Vardi, "Linear temporal logic and linear dynamic logic on finite traces", IJCAI 2013.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Final, NamedTuple, TypeAlias

from .texts import NONE, Budget, Meaning, Reader, TextError, known, refuse

STANDS_FOR: Final = {
    "|": "!(!a & !b)",
    "->": "!(a & !b)",
    "<->": "(a -> b) & (b -> a)",
    "N": "!X !a",
    "F": "true U a",
    "G": "!F !a",
    "R": "!(!a U !b)",
    "W": "G a | (a U b)",
    "M": "b U (a & b)",
    "Z": "!Y !a",
    "O": "true S a",
    "H": "!O !a",
    "T": "!(!a S !b)",
    "B": "H a | (a S b)",
}
"""What each operator on a (and b) means; its bound is that of each operator in there that can have one."""

_AHEAD: Final = ("X", "U")
_BACK: Final = ("Y", "S")
_BOUNDED: Final = frozenset("FGUWRMOHSBT")
_UNARY: Final = frozenset("!XNFGYZOH")
_TIGHTNESS: Final = {"<->": 0, "->": 1, "|": 2, "&": 3, **dict.fromkeys("UWRMSBT", 4)}
_SIGNS: Final = r"\[\s*<=[^\]]*\]|<->|<=>|->|=>|&&|\|\||[][()!~&|¬∧∨→↔]"
_IN_GUARDS: Final = {
    **dict.fromkeys(("not", "~", "¬"), "!"),
    **dict.fromkeys(("and", "&&", "∧"), "&"),
    **dict.fromkeys(("or", "||", "∨"), "|"),
    **dict.fromkeys(("=>", "→"), "->"),
    **dict.fromkeys(("<=>", "↔"), "<->"),
    "true": "true",
    "false": "false",
}
_SPELLINGS: Final = {**_IN_GUARDS, "WX": "N", **{op: op for op in "XNFGUWRMYZOHSBT"}}

Values: TypeAlias = tuple[int, ...]
"""What holds at a moment, a number a node: `NONE` where it does not, else 0; for U and S with a bound, how
far away their second part holds."""


class Node(NamedTuple):
    """One of ``true``, ``event`` (of a set), ``!``, ``&``, ``X``, ``U``, ``Y`` and ``S``."""

    op: str
    args: tuple[int, ...] = ()
    events: frozenset[str] = frozenset()
    bound: int | None = None


class Formula(Reader):
    """A formula as nodes, parts before wholes; ``root`` is the whole."""

    def __init__(self, text: str, names: frozenset[str], spellings: Mapping[str, str] = _SPELLINGS) -> None:
        super().__init__(text, _SIGNS, spellings)
        self.names = names
        self.nodes: list[Node] = []
        self.number: dict[Node, int] = {}
        self.ahead: set[int] = set()
        self.root = self._joined(0)
        self._expect_end()

    def _node(self, op: str, *args: int, events: Iterable[str] = (), bound: int | None = None) -> int:
        node = Node(op, args, frozenset(events), bound)
        number = self.number.setdefault(node, len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(node)
        if op in _AHEAD or not self.ahead.isdisjoint(args):
            self.ahead.add(number)
            if op in _BACK:
                refuse("what looks back contains what looks ahead")
        return number

    def _apply(self, op: str, bound: int | None, *parts: int) -> int:
        """Return the node of an operator, or read on with what it stands for."""
        if op not in STANDS_FOR:
            return self._node(op, *parts, bound=bound)
        for token in _meant(op):
            if bound is not None and token in _BOUNDED:
                self.tokens.append(f"[<={bound}]")
            self.tokens.append(f"#{parts['ab'.index(token[1])]}" if token[0] == '"' else token)
        return self._part()

    def _joined(self, loosest: int) -> int:
        left = self._part()
        while _TIGHTNESS.get(self.tokens[-1], NONE) >= loosest:
            op = self._next()
            bound = self._bound(op)
            right = self._joined(_TIGHTNESS[op] + (op in "&|"))
            left = self._apply(op, bound, left, right)
        return left

    def _part(self) -> int:
        if self.tokens[-1].startswith('"'):
            return self._node("event", events=[self._event()])
        op = self._next()
        if op[0] == "#":
            return int(op[1:])
        if op == "(":
            inside = self._joined(0)
            self._expect(")")
            return inside
        if op == "[":
            events = [self._event()]  # where an operator's letter is a name too
            while not self._take("]"):
                events.append(self._event())
            return self._node("event", events=events)
        if op in ("true", "false"):
            true = self._node("true")
            return true if op == "true" else self._node("!", true)
        if op not in _UNARY:
            refuse(f"unexpected {op!r}")
        bound = self._bound(op)
        return self._apply(op, bound, self._part())

    def _event(self) -> str:
        return known(self._next().removeprefix('"'), self.names)

    def _bound(self, op: str) -> int | None:
        if not re.match(r"\[.", self.tokens[-1]):
            return None
        match = re.fullmatch(r"\[\s*<=\s*([0-9]{1,9})\s*\]", self._next())
        if match is None or op not in _BOUNDED:
            refuse(f"{op!r} has a bound that cannot be read")
        return int(match[1])

    def true_of(self, holding: Iterable[str]) -> frozenset[int]:
        """Return the nodes of events (or propositions) that are true where ``holding`` are so."""
        return frozenset(i for i, node in enumerate(self.nodes) if not node.events.isdisjoint(holding))

    def values(
        self, true: frozenset[int] | None, before: Sequence[int] | None, after: Sequence[int] | None
    ) -> list[int]:
        """Return the `Values` of a moment: None for ``true``: of the empty word; beside it: there is none."""
        now: list[int] = []
        for i, (op, args, _, bound) in enumerate(self.nodes):
            near = after if op in _AHEAD else before
            holds, value = False, 0
            if op == "true":
                holds = True
            elif op == "!":
                holds = now[args[0]] == NONE
            elif op == "&":
                holds = NONE not in (now[args[0]], now[args[1]])
            elif true is None:
                pass
            elif op == "event":
                holds = i in true
            elif op in "XY":
                holds = near is not None and near[args[0]] != NONE
            elif now[args[1]] != NONE:
                holds = True
            elif near is not None and NONE not in (near[i], now[args[0]]) and near[i] != bound:
                holds, value = True, near[i] + (bound is not None)
            now.append(value if holds else NONE)
        return now


@cache
def _meant(op: str) -> list[str]:
    """Return what an operator stands for, from the last token to the first."""
    return Reader(f"({STANDS_FOR[op]})", _SIGNS, _SPELLINGS).tokens[1:]


def formula_meaning(text: str, sigma: frozenset[str], budget: Budget) -> Meaning:
    """Return which words over ``sigma`` a formula allows; they are read backwards."""
    formula = Formula(text, sigma)
    nodes, root = formula.nodes, formula.root
    true = {event: formula.true_of({event}) for event in sigma}
    ahead, back = {root}, set[int]()  # what the moment beside it has to know
    for i, node in enumerate(nodes):
        if node.op in _AHEAD + _BACK:
            (ahead if node.op in _AHEAD else back).add(node.args[0] if node.op in "XY" else i)

    def moment(sort: frozenset[int], before: Values | None, after: Values | None, kept: set[int]) -> Values:
        budget.spend(len(nodes))
        return tuple(value if i in kept else 0 for i, value in enumerate(formula.values(sort, before, after)))

    pasts: dict[Values | None, int] = {None: 0}  # what can have been; None before the first moment
    moves: dict[tuple[int, frozenset[int]], int] = {}
    for past in (queue := list(pasts)):
        for sort in set(true.values()):
            now = moment(sort, past, None, back)
            if now not in pasts:
                pasts[now] = len(pasts)
                queue.append(now)
            moves[pasts[past], sort] = pasts[now]

    def step(rest: tuple[Values | None, ...], event: str) -> tuple[Values, ...]:
        """Put a moment before the rest of a word, of which the values for each past are known."""
        sort = true[event]
        return tuple(moment(sort, past, rest[moves[p, sort]], ahead) for past, p in pasts.items())

    def accepts(word: tuple[Values | None, ...]) -> bool:
        return (formula.values(None, None, None) if word[0] is None else word[0])[root] != NONE

    sets = [node.events for node in nodes if node.op == "event"]
    return Meaning((None,) * len(pasts), step, accepts, sets, backwards=True)


def is_true(guard: str, propositions: Iterable[str], holding: Iterable[str]) -> bool:
    """Return whether a guard is true where, of the propositions, ``holding`` are.

    Raises
    ------
    TextError
        If it cannot be read.
    """
    try:
        formula = Formula(guard, frozenset(propositions), _IN_GUARDS)
    except RecursionError:
        message = "it is nested too deeply"
        raise TextError(message) from None
    return formula.values(formula.true_of(holding), None, None)[formula.root] != NONE

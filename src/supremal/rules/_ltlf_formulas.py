r"""Formulas in a core of seven kinds, each held once.

A formula is an integer: 2i is that of node i, and 2i + 1 its negation.  So negating is flipping a bit, two
formulas are the same iff they are the same integer, and the parts of a node come before it.  The core is

    true    an event of a set happens    φ₁ & ... & φₙ    X φ    φ U[<=k] ψ    Y φ    φ S[<=k] ψ

and all else is said by duality: the negation of X is N, of U it is R, of & it is |.  What looks back is the
mirror image of what looks ahead: Y of X, and S of U; so one table says what both kinds of operators mean.

Source: the sharing of nodes and the bit for negation are those of and-inverter graphs, Kuehlmann, Paruthi,
Krohm, Ganai, "Robust Boolean reasoning for equivalence checking", IEEE Trans. CAD 21 (2002).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final, Literal, NamedTuple

from supremal.rules._ltlf_parser import BACK, Tree

UNBOUNDED: Final = 1 << 20
"""The bound of an operator that has none: more than any bound."""

TRUE: Final = 0
FALSE: Final = 1

Op = Literal["true", "event", "and", "next", "until", "previous", "since"]

LOOKING_BACK: Final = ("previous", "since")

_KINDS: Final[tuple[tuple[Op, Op], ...]] = (("next", "until"), ("previous", "since"))


class Node(NamedTuple):
    """A core formula: its kind, what it is applied to, the events of an ``event``, and a bound."""

    op: Op
    parts: tuple[int, ...] = ()
    events: frozenset[str] = frozenset()
    bound: int = UNBOUNDED


class Formulas:
    """The nodes of some formulas, parts before wholes.

    Examples
    --------
    >>> from supremal.rules._ltlf_parser import parse
    >>> core = Formulas()
    >>> core.of_tree(parse("! F a")) == core.of_tree(parse("G !a")), len(core.nodes)
    (True, 3)
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._on_nothing: list[bool] = []
        self._number: dict[Node, int] = {}
        self._formula(Node("true"))

    def node(self, formula: int) -> Node:
        """Return the node of ``formula``, whether it is that of the node or its negation."""
        return self.nodes[formula >> 1]

    def _formula(self, node: Node) -> int:
        number = self._number.setdefault(node, len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(node)
            conjunction = node.op in ("true", "and")
            self._on_nothing.append(conjunction and all(map(self.holds_on_nothing, node.parts)))
        return 2 * number

    def holds_on_nothing(self, formula: int) -> bool:
        """Tell whether the empty word satisfies ``formula``: where nothing happens, only negations hold."""
        return self._on_nothing[formula >> 1] ^ bool(formula & 1)

    def at_next(self, formula: int) -> int:
        """Return X φ."""
        return self._formula(Node("next", (formula,)))

    def all_of(self, formulas: Iterable[int]) -> int:
        """Return the conjunction: flat, sorted, each part once."""
        parts = set[int]()
        for formula in formulas:
            nested = formula % 2 == 0 and self.node(formula).op == "and"
            parts.update(self.node(formula).parts if nested else [formula])
        parts.discard(TRUE)
        if FALSE in parts or any(part ^ 1 in parts for part in parts):
            return FALSE
        if len(parts) < 2:
            return parts.pop() if parts else TRUE
        return self._formula(Node("and", tuple(sorted(parts))))

    def any_of(self, formulas: Iterable[int]) -> int:
        """Return the disjunction."""
        return self.all_of(formula ^ 1 for formula in formulas) ^ 1

    def parts(self, formula: int) -> list[int]:
        """Return what ``formula`` is applied to; of a negation, as if it were written with its dual."""
        return [part ^ (formula & 1) for part in self.node(formula).parts]

    def inside(self, formula: int) -> Iterator[int]:
        """Return an iterator of all that ``formula`` is made of, down to what looks back."""
        found, rest = set[int](), [formula]
        while rest:
            part = rest.pop()
            if part not in found:
                found.add(part)
                yield part
                if self.node(part).op not in LOOKING_BACK:
                    rest += self.parts(part)

    def of_tree(self, tree: Tree) -> int:
        """Return the core formula of what was written."""
        meaning: dict[int, int] = {}
        for part in reversed(tree.walk()):
            meaning[id(part)] = self._of_one(part, [meaning[id(inner)] for inner in part.parts])
        return meaning[id(tree)]

    def _of_one(self, tree: Tree, parts: list[int]) -> int:
        """Return what a tree means whose ``parts`` mean these formulas."""
        match tree.op:
            case "event":
                return self._formula(Node("event", events=frozenset(tree.events)))
            case "true" | "false":
                return TRUE if tree.op == "true" else FALSE
            case "!":
                return parts[0] ^ 1
            case "&":
                return self.all_of(parts)
            case "|":
                return self.any_of(parts)
            case "->":
                return self.any_of([parts[0] ^ 1, parts[1]])
            case "<->":
                both, neither = self.all_of(parts), self.all_of(part ^ 1 for part in parts)
                return self.any_of([both, neither])
            case op:
                return self._temporal(op, parts, UNBOUNDED if tree.bound is None else tree.bound)

    def _temporal(self, op: str, parts: list[int], bound: int) -> int:
        """Return what a temporal operator means: one that looks back as its mirror image means it."""
        step, stretch = _KINDS[op in BACK]
        p, q = parts[0], parts[-1]

        def until(left: int, right: int) -> int:
            return self._formula(Node(stretch, (left, right), bound=bound))

        match op:
            case "X" | "Y":
                return self._formula(Node(step, (p,)))
            case "N" | "Z":
                return self._formula(Node(step, (p ^ 1,))) ^ 1
            case "F" | "O":
                return until(TRUE, p)
            case "G" | "H":
                return until(TRUE, p ^ 1) ^ 1
            case "U" | "S":
                return until(p, q)
            case "M":
                return until(q, self.all_of([p, q]))
            case "R" | "T":
                return until(p ^ 1, q ^ 1) ^ 1
            case _:  # W and B: no end to p that q does not justify
                return until(q ^ 1, self.all_of([p ^ 1, q ^ 1])) ^ 1

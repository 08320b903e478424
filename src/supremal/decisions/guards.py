"""Guards: propositional formulas over what is true in a state.

The grammar, loosest first; words and signs may be mixed::

    formula  :=  term (("|" | "or") term)*
    term     :=  factor (("&" | "and") factor)*
    factor   :=  ("!" | "not") factor  |  "(" formula ")"  |  "true"  |  "false"  |  NAME

A formula over n propositions becomes a table of 2ⁿ truth values, one a label, by array operations.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, NoReturn

import numpy as np

from supremal._arrays import Bools
from supremal.errors import FormatError, RuleError, suggest

_TOKEN: Final = re.compile(r"\s*(?:(?P<name>[A-Za-z_]\w*)|(?P<sign>[()&|!∧∨¬]))")
_WORDS: Final = {"or": "|", "and": "&", "not": "!", "∨": "|", "∧": "&", "¬": "!"}
RESERVED: Final = ("and", "or", "not", "true", "false")
_MAX_DEPTH: Final = 200
MAX_PROPOSITIONS: Final = 16
"""The most propositions of one machine: its truth tables have 2¹⁶ entries."""


def truth_table(formula: str, propositions: Sequence[str], *, path: str = "guard") -> Bools:
    """Return the truth of ``formula`` for every label, ``bool [2 ** n]``; bit i is proposition i.

    Raises
    ------
    FormatError
        If the formula does not parse or names an unknown proposition; gives the column.
    RuleError
        If there are more than 16 propositions, or one is no name or stands twice.

    Examples
    --------
    >>> truth_table("a & !b", ["a", "b"]).tolist()
    [False, True, False, False]
    """
    check_propositions(propositions)
    return _Parser(formula, propositions, path).parse()


def check_propositions(propositions: Sequence[str]) -> None:
    """Raise a `RuleError` if guards could not tell ``propositions`` apart, or there are too many of them."""
    if len(propositions) > MAX_PROPOSITIONS:
        message = f"{len(propositions)} propositions; a reward machine may have {MAX_PROPOSITIONS}"
        raise RuleError(message)
    for i, name in enumerate(propositions):
        if name in propositions[:i]:
            message = f"proposition {name!r} stands twice; name each once"
            raise RuleError(message)
        if not name.isidentifier() or name in RESERVED:
            message = f"proposition {name!r}: a word other than {', '.join(RESERVED)} is needed"
            raise RuleError(message)


class _Parser:
    """Recursive descent; every method returns the truth table of what it has read."""

    def __init__(self, formula: str, propositions: Sequence[str], path: str) -> None:
        self.formula, self.path = formula, path
        labels = np.arange(1 << len(propositions))
        self.tables = {name: (labels >> i & 1).astype(np.bool_) for i, name in enumerate(propositions)}
        self.true = np.ones(labels.size, np.bool_)
        self.tokens = self.tokenize()
        self.at = 0
        self.depth = 0

    def tokenize(self) -> list[tuple[str, int]]:
        tokens, end = [], 0
        length = len(self.formula.rstrip())
        while end < length:
            match = _TOKEN.match(self.formula, end)
            if match is None:
                column = end + len(self.formula[end:]) - len(self.formula[end:].lstrip())
                self.fail(f"unexpected {self.formula[column]!r}", column)
            kind = "name" if match["name"] else "sign"
            token = match[kind]
            tokens.append((_WORDS.get(token, token), match.start(kind)))
            end = match.end()
        return [*tokens, ("", length)]

    def fail(self, problem: str, column: int) -> NoReturn:
        message = f"{problem} in {self.formula!r}; a formula of names with & | ! ( ) and true is needed"
        raise FormatError(message, path=self.path, line=1, column=column + 1)

    def parse(self) -> Bools:
        table = self.formula_()
        token, column = self.tokens[self.at]
        if token:
            self.fail(f"unexpected {token!r}", column)
        return table

    def take(self, *wanted: str) -> bool:
        found = self.tokens[self.at][0] in wanted
        self.at += found
        return found

    def formula_(self) -> Bools:
        table = self.term()
        while self.take("|"):
            table = table | self.term()
        return table

    def term(self) -> Bools:
        table = self.factor()
        while self.take("&"):
            table = table & self.factor()
        return table

    def factor(self) -> Bools:
        token, column = self.tokens[self.at]
        self.at += bool(token)
        self.depth += 1
        if self.depth > _MAX_DEPTH:
            self.fail(f"more than {_MAX_DEPTH} levels", column)
        table = self.true
        if token == "!":
            table = ~self.factor()
        elif token == "(":
            table = self.formula_()
            if not self.take(")"):
                self.fail("a ')' is missing", self.tokens[self.at][1])
        elif token == "false":
            table = ~self.true
        elif token in self.tables:
            table = self.tables[token]
        elif token != "true":
            known = f"unknown proposition {token!r} ({suggest(token, self.tables)})"
            self.fail(known if token[:1].isidentifier() else "a proposition is missing", column)
        self.depth -= 1
        return table

"""A reader and a runner of structured text, as much of it as the exported function blocks are made of.

Source: IEC 61131-3:2013, 7.3 (operators and statements).  A number outside its type, an index outside its
array and a name that is not declared are errors, as an assignment to a constant is.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

TOKEN = re.compile(
    r"\(\*.*?\*\)|\s+|(\d+|[A-Za-z][A-Za-z0-9]*(?:_[A-Za-z0-9]+)*|:=|<=|>=|<>|\.\.|[-+*=<>()\[\],;:.])",
    re.DOTALL,
)
RANGES = {"INT": 1 << 15, "DINT": 1 << 31}
LEVELS = (("OR",), ("AND",), ("=", "<>"), ("<", ">", "<=", ">="), ("+", "-"), ("*",))  # the loosest first
OPERATIONS = {
    "OR": lambda a, b: a or b,
    "AND": lambda a, b: a and b,
    "=": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
}


@dataclass
class Block:
    """A function block: what it declares, as (section, type, size, start), and its statements."""

    variables: dict[str, tuple[str, str, int | None, Any]] = field(default_factory=dict)
    body: list[Any] = field(default_factory=list)


class Reader:
    """Recursive descent over the tokens of a file."""

    def __init__(self, text: str) -> None:
        assert text.isascii()
        self.tokens, at = [], 0
        while at < len(text):
            found = TOKEN.match(text, at)
            assert found, text[at : at + 40]
            at = found.end()
            if found[1]:
                self.tokens.append(found[1])
        self.tokens.append("")

    def take(self, *wanted: str) -> str:
        token = self.tokens[0]
        assert not wanted or token in wanted, (wanted, self.tokens[:8])
        return self.tokens.pop(0)

    def accept(self, wanted: str) -> bool:
        return self.tokens[0] == wanted and bool(self.take())

    def file(self) -> dict[str, Block]:
        blocks = {}
        while self.tokens[0]:
            self.take("FUNCTION_BLOCK")
            name, block = self.take(), Block()
            while self.tokens[0].startswith("VAR"):
                self.section(block)
            block.body = self.statements("END_FUNCTION_BLOCK")
            blocks[name] = block
        return blocks

    def section(self, block: Block) -> None:
        kind = self.take("VAR", "VAR_INPUT", "VAR_OUTPUT")
        if self.accept("CONSTANT"):
            kind = "CONSTANT"
        while not self.accept("END_VAR"):
            name, size = self.take(), None
            assert name.upper() not in map(str.upper, block.variables), name
            self.take(":")
            if self.accept("ARRAY"):
                self.take("["), self.take("0"), self.take("..")
                size = int(self.take()) + 1
                self.take("]"), self.take("OF")
            of = self.take()
            start = None
            if self.accept(":="):
                start = self.listed("]") if self.accept("[") else self.constant()
            self.take(";")
            block.variables[name] = (kind, of, size, start)

    def listed(self, end: str) -> list[Any]:
        found = [self.constant()]
        while self.accept(","):
            found.append(self.constant())
        self.take(end)
        return found

    def constant(self) -> Any:
        sign = -1 if self.accept("-") else 1
        token = self.take()
        return token == "TRUE" if token in ("TRUE", "FALSE") else sign * int(token)

    def statements(self, *ends: str) -> list[Any]:
        found = []
        while self.tokens[0] not in ends:
            found.append(self.statement())
        self.end = self.take(*ends)
        return found

    def statement(self) -> Any:
        if self.accept("IF"):
            test = self.expression()
            self.take("THEN")
            then = self.statements("ELSE", "END_IF")
            other = self.statements("END_IF") if self.end == "ELSE" else []
            self.take(";")
            return ("if", test, then, other)
        if self.accept("FOR"):
            name = self.take()
            self.take(":=")
            first = self.expression()
            self.take("TO")
            last = self.expression()
            self.take("DO")
            body = self.statements("END_FOR")
            self.take(";")
            return ("for", name, first, last, body)
        target = self.place()
        if self.accept("("):
            given = {}
            while not self.accept(")"):
                name = self.take()
                self.take(":=")
                given[name] = self.expression()
                self.accept(",")
            self.take(";")
            return ("call", target, given)
        self.take(":=")
        value = self.expression()
        self.take(";")
        return ("set", target, value)

    def place(self) -> Any:
        found: Any = ("name", self.take())
        while self.tokens[0] in ("[", "."):
            if self.take() == "[":
                found = ("at", found, self.expression())
                self.take("]")
            else:
                found = ("of", found, self.take())
        return found

    def expression(self, level: int = 0) -> Any:
        if level == len(LEVELS):
            return self.unary()
        left = self.expression(level + 1)
        while self.tokens[0] in LEVELS[level]:
            left = (self.take(), left, self.expression(level + 1))
        return left

    def unary(self) -> Any:
        token = self.tokens[0]
        if token in ("NOT", "-"):
            self.take()
            return (f"{token} 1", self.unary())
        if self.accept("("):
            inner = self.expression()
            self.take(")")
            return inner
        return ("value", self.constant()) if token.isdigit() or token in ("TRUE", "FALSE") else self.place()


class Instance:
    """A function block that runs; its variables are ``values``."""

    def __init__(self, blocks: dict[str, Block], name: str) -> None:
        self.block, self.values = blocks[name], {}
        for variable, (_, of, size, start) in self.block.variables.items():
            zero = False if of == "BOOL" else 0 if of in RANGES else Instance(blocks, of)
            value = (zero if start is None else start) if size is None else start or [zero] * size
            assert size is None or len(value) == size, variable
            for number in value if isinstance(value, list) else [value]:
                self.check(of, number)
            self.values[variable] = value

    def check(self, of: str, value: Any) -> None:
        if of in RANGES:
            assert type(value) is int, value
            assert -RANGES[of] <= value < RANGES[of], value
        elif of == "BOOL":
            assert type(value) is bool, value

    def __call__(self, **given: Any) -> None:
        """Run once, as a scan does."""
        for name, value in given.items():
            assert self.block.variables[name][0] == "VAR_INPUT"
            self.store(name, value)
        self.run(self.block.body)

    def store(self, name: str, value: Any) -> None:
        kind, of, size, _ = self.block.variables[name]
        assert kind != "CONSTANT", name
        assert size is None, name
        self.check(of, value)
        self.values[name] = value

    def run(self, statements: list[Any]) -> None:
        for what, *parts in statements:
            if what == "if":
                test = self.value(parts[0])
                assert type(test) is bool
                self.run(parts[1] if test else parts[2])
            elif what == "for":
                for number in range(self.value(parts[1]), self.value(parts[2]) + 1):
                    self.store(parts[0], number)
                    self.run(parts[3])
            elif what == "call":
                self.value(parts[0])(**{name: self.value(given) for name, given in parts[1].items()})
            elif parts[0][0] == "at":
                _, (_, name), index = parts[0]
                kind, of, *_ = self.block.variables[name]
                assert kind != "CONSTANT"
                value = self.value(parts[1])
                self.check(of, value)
                self.values[name][self.index(name, index)] = value
            else:
                self.store(parts[0][1], self.value(parts[1]))

    def index(self, name: str, index: Any) -> int:
        number = self.value(index)
        assert 0 <= number < len(self.values[name]), (name, number)
        return number

    def value(self, tree: Any) -> Any:
        what, *parts = tree
        if what == "value":
            return parts[0]
        if what == "name":
            return self.values[parts[0]]
        if what == "of":
            return self.value(parts[0]).values[parts[1]]
        if what == "at":
            array, number = self.value(parts[0]), self.value(parts[1])
            assert 0 <= number < len(array), tree
            return array[number]
        if what in ("NOT 1", "- 1"):
            inner = self.value(parts[0])
            return not inner if what == "NOT 1" else -inner
        left, right = map(self.value, parts)
        assert type(left) is type(right), tree
        return OPERATIONS[what](left, right)


def read(text: str) -> dict[str, Block]:
    """Return the function blocks of a file."""
    return Reader(text).file()

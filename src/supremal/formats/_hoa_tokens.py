"""The tokens and the label expressions of the HOA format.

The value of an expression over n propositions, on letters in which exactly one of them is true, is a set of
propositions: the bits of an integer, of which those from n on say nothing.  Then ``t`` is -1, ``!x`` is ~x.

Source: https://adl.github.io/hoaf.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple, NoReturn

from supremal.formats._page import Page, Word, shown

MAX_PROPOSITIONS: Final = 3000
"""The most propositions that are read or written: a label names them all."""

_MAX_DEPTH: Final = 100
_COMMENT: Final = re.compile(r"/\*|\*/")
_ESCAPE: Final = re.compile(r"\\(.)", re.DOTALL)
_TOKEN: Final = re.compile(
    r"""(?P<space> [\ \t\n\r]++ )
      | (?P<comment> /\* )
      | "(?P<string> (?: \\. | [^\\"] )*+ )"
      | (?P<header> [a-zA-Z_][0-9a-zA-Z_-]*+ : )
      | (?P<word> [a-zA-Z_][0-9a-zA-Z_-]*+ )
      | (?P<mark> --[A-Z]++-- )
      | (?P<number> [0-9]++ )
      | @(?P<alias> [0-9a-zA-Z_-]++ )
      | (?P<sign> [][!&|(){}] )""",
    re.VERBOSE | re.DOTALL,
)


class Token(NamedTuple):
    """``kind`` is a group of the pattern, empty at the end of the text; ``text`` is what it holds."""

    kind: str
    text: str
    where: int


class Tokens:
    """The tokens of ``page``; ``now`` is the one that is next.

    Examples
    --------
    >>> tokens = Tokens(Page("a.hoa", "[0 | !(1 & @on)] 7"), {"on": 2})
    >>> tokens.label() & 0b111, tokens.number("a state", 9)
    (5, 7)
    """

    def __init__(self, page: Page, aliases: dict[str, int] | None = None) -> None:
        self.page, self.here = page, 0
        self.aliases = {} if aliases is None else aliases
        self.now = self._next()

    def _next(self) -> Token:
        text = self.page.text
        while self.here < len(text):
            found = _TOKEN.match(text, self.here)
            if found is None:
                self.page.fail("a string is not closed, or this is no token", self.here)
            where, self.here = self.here, found.end()
            kind = str(found.lastgroup)
            if kind == "comment":
                self._pass_comment(where)
            elif kind == "string":
                return Token(kind, _ESCAPE.sub(r"\1", found[kind]), where)
            elif kind != "space":
                return Token(kind, found[kind], where)
        return Token("", "", len(text))

    def _pass_comment(self, where: int) -> None:
        depth = 1
        while depth:
            found = _COMMENT.search(self.page.text, self.here)
            if found is None:
                self.page.fail("a comment is not closed", where)
            depth += 1 if found[0] == "/*" else -1
            self.here = found.end()

    def get(self) -> Token:
        """Return the next token, and go on."""
        token, self.now = self.now, self._next()
        return token

    def has(self, kind: str, text: str | None = None) -> bool:
        """Tell whether the next token is of this kind, and text."""
        return self.now.kind == kind and (text is None or self.now.text == text)

    def wrong(self, wanted: str, token: Token | None = None) -> NoReturn:
        """Say that a token is not what was wanted."""
        token = token or self.now
        said = shown(token.text) if token.kind else "the file ends"
        self.page.fail(f"{said} where {wanted} is needed", token.where)

    def take(self, kind: str, text: str | None, wanted: str) -> str:
        """Return the text of the next token, which has to be of this kind, and text."""
        if not self.has(kind, text):
            self.wrong(wanted)
        return self.get().text

    def number(self, what: str, most: int) -> int:
        """Return the next token, which has to be a number."""
        if not self.has("number"):
            self.wrong(what)
        token = self.get()
        return self.page.number(Word(token.text, token.where), what, most)

    def label(self) -> int:
        """Return the value of a label."""
        self.take("sign", "[", "a label in brackets")
        value = self.either()
        self.take("sign", "]", "']'")
        return value

    def either(self, depth: int = 0) -> int:
        """Return the value of an expression."""
        value = self._both(depth)
        while self.has("sign", "|"):
            self.get()
            value |= self._both(depth)
        return value

    def _both(self, depth: int) -> int:
        value = self._one(depth)
        while self.has("sign", "&"):
            self.get()
            value &= self._one(depth)
        return value

    def _one(self, depth: int) -> int:
        if depth > _MAX_DEPTH:
            self.page.fail(f"a label is nested more than {_MAX_DEPTH} deep", self.now.where)
        if self.has("number"):
            return 1 << self.number("a proposition", MAX_PROPOSITIONS - 1)
        token = self.get()
        if token.kind == "alias":
            if token.text not in self.aliases:
                self.page.fail(f"unknown alias {shown('@' + token.text)}; define it first", token.where)
            return self.aliases[token.text]
        if token.kind == "word" and token.text in {"t", "f"}:
            return -1 if token.text == "t" else 0
        if token[:2] == ("sign", "!"):
            return ~self._one(depth + 1)
        if token[:2] == ("sign", "("):
            value = self.either(depth + 1)
            self.take("sign", ")", "')'")
            return value
        return self.wrong("a proposition, an alias, t, f, ! or (", token)

"""The tokens of libFAUDES' files: words, quoted strings, flags between plus signs, and tags.

Source: https://fgdes.tf.fau.de, the notes on token input and output.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, NamedTuple, NoReturn

from supremal.formats._page import Page, shown

# Quantifiers that never give back (`*+`) keep a hostile text from taking quadratic time.
_TOKEN: Final = re.compile(
    r"""(?P<skip> \s++ | %[^\n\r]*+ | <!--.*?--> | <\?.*?\?> )
      | < (?P<begin> [A-Za-z_:][^\s/<>]*+ ) (?P<attributes> [^<>]*? ) (?P<empty> /? ) >
      | </ (?P<end> [^\s<>]++ ) >
      | "(?P<quoted> [^"<>]*+ )" | '(?P<apostrophed> [^'<>]*+ )'
      | \+ (?P<option> [^+<>]*+ ) \+
      | (?P<plain> [^\s<>%"'+=][^\s<>]*+ )""",
    re.VERBOSE | re.DOTALL,
)
_ATTRIBUTE: Final = re.compile(
    r"""(?:^|(?<=\s))([^\s=/"']++)\s*+=\s*+(?:"([^"]*+)"|'([^']*+)'|([^\s"']++))"""
)
_ENTITY: Final = re.compile(r"&(amp|lt|gt|quot|apos);")
_CHARACTERS: Final = {"amp": "&", "lt": "<", "gt": ">", "quot": '"', "apos": "'"}
_ENTITIES: Final = str.maketrans({text: f"&{name};" for name, text in _CHARACTERS.items() if name != "apos"})

WORDS: Final = frozenset({"quoted", "apostrophed", "plain", "option"})
"""The kinds of tokens that can be names."""


class Token(NamedTuple):
    """``kind`` is begin, end, quoted, apostrophed, option or plain, and empty at the end of the text."""

    kind: str
    text: str
    where: int
    attributes: dict[str, str]


class Tokens:
    """The tokens of ``page``, from left to right.

    Examples
    --------
    >>> tokens = Tokens(Page("a.gen", '<States> "I" W </States>'))
    >>> [token.text for token in tokens.inside(tokens.get().text)]
    ['I', 'W']
    """

    def __init__(self, page: Page) -> None:
        self.page, self.here = page, 0
        self.end = ""  # the section that an empty tag has opened, and that ends next

    def get(self) -> Token:
        """Return the next token; its kind is empty at the end of the text."""
        if self.end:
            token, self.end = Token("end", self.end, self.here, {}), ""
            return token
        while self.here < len(self.page.text):
            found = _TOKEN.match(self.page.text, self.here)
            if found is None:
                self.page.fail("a quote, a '+' or a tag is not closed, or this is no token", self.here)
            where, self.here = self.here, found.end()
            if found["skip"] is None:
                return self._made(found, where)
        return Token("", "", self.here, {})

    def peek(self) -> Token:
        """Return the next token, and stay where it begins."""
        here, end = self.here, self.end
        token = self.get()
        self.here, self.end = here, end
        return token

    def _made(self, found: re.Match[str], where: int) -> Token:
        kind = "begin" if found["begin"] is not None else str(found.lastgroup)
        if kind != "begin":
            return Token(kind, _plain(found[kind]), where, {})
        pairs = _ATTRIBUTE.findall(found["attributes"])
        self.end = found["begin"] if found["empty"] else ""
        values = {name: _plain("".join(value)) for name, *value in pairs}
        return Token(kind, found["begin"], where, values)

    def wrong(self, token: Token, wanted: str) -> NoReturn:
        """Say that ``token`` is not what was wanted."""
        what = {"": "the file ends", "begin": f"<{token.text}>", "end": f"</{token.text}>"}
        said = what.get(token.kind, shown(token.text))
        self.page.fail(f"{said} where {wanted} is needed", token.where)

    def inside(self, section: str) -> Iterator[Token]:
        """Give the tokens up to the end of ``section``, which has to come."""
        while True:
            token = self.get()
            if (token.kind, token.text) == ("end", section):
                return
            if token.kind in {"", "end"}:
                self.wrong(token, f"</{section}>")
            yield token


def _plain(text: str) -> str:
    return _ENTITY.sub(lambda found: _CHARACTERS[found[1]], text)


def quoted(text: str) -> str:
    """Return ``text`` in quotes, as a token.

    Examples
    --------
    >>> quoted('a "<" b')
    '"a &quot;&lt;&quot; b"'
    """
    return f'"{text.translate(_ENTITIES)}"'

"""TOML with places: the scanner sees what `tomllib` reads, where it stands; and what is said of bad files."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from supremal import FormatError
from supremal.formats.toml import MAX_BYTES, MAX_DEPTH, Document, KeyPath, parse_toml, read_toml

WORDS = ["a", "b-2", "_c", "über", "d.e", "", "say 'x'", 'say "y"', "[[z]]", "k = 1 # no"]
STRINGS = [*WORDS, "back\\slash", "two\nlines", "\n first", "tab\t", "a]b}c,d", '"', '""', "'''", "é\u20ac😀"]
PLAIN = [
    "0",
    "-17",
    "1_000",
    "3.5e-7",
    "inf",
    "true",
    "false",
    "1979-05-27",
    "1979-05-27 07:32:00Z",
    "07:32:00",
]
SIGNS = ["", "[", "]", "=", '"', "'", "\n", "{", "\\", ".", ","]
LONG = "more than 100 characters without quotes; a string needs quotes, a number fewer digits"
RANDOMS = st.randoms(use_true_random=True)  # from a seed, which leaves less to Hypothesis and is quicker


class Writer:
    """Writes a random document, and notes where it puts what."""

    def __init__(self, random: Random) -> None:
        self.random, self.text = random, ""
        self.value: dict[KeyPath, tuple[int, str]] = {}  # where the value stands, and how it is written
        self.key: dict[KeyPath, int] = {}
        self.defined: dict[KeyPath, int] = {}  # headers: -1, or how many there are of an array of tables

    def put(self, text: str) -> None:
        self.text += text

    def any(self, *choices: str) -> str:
        return self.random.choice(choices)

    def gap(self, *, lines: bool) -> None:
        self.put(self.any("", " ", "\t", "\n", " # [[no]] = '''\n") if lines else self.any("", " ", "  \t"))

    def part(self, word: str) -> str:
        bare = bool(word) and all(c.isascii() and (c.isalnum() or c in "-_") for c in word)
        ways = [json.dumps(word, ensure_ascii=self.random.random() < 0.5)]
        ways += [word] * bare + [f"'{word}'"] * ("'" not in word)
        return self.random.choice(ways)

    def string(self, value: str) -> str:
        ways = [json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")]
        if "'" not in value and "\n" not in value:
            ways.append(f"'{value}'")
        if "'''" not in value and not value.endswith("'"):
            ways.append(f"'''{self.any(chr(10), '') if not value.startswith(chr(10)) else chr(10)}{value}'''")
        if "\\" not in value and '"""' not in value:
            ways.append(f'"""\n{value}"""')
        return self.random.choice(ways)

    def put_value(self, path: KeyPath, depth: int) -> None:
        at = len(self.text)
        kind = self.random.random()
        if depth and kind < 0.2:
            self.put("[")
            for k in range(self.random.randrange(4)):
                self.gap(lines=True)
                self.key[*path, k] = len(self.text)
                self.put_value((*path, k), depth - 1)
                self.gap(lines=True)
                self.put(",")
            self.gap(lines=True)
            self.put("]")
        elif depth and kind < 0.35:
            self.put("{")
            for k, word in enumerate(self.words(3)):
                self.put("," * bool(k))
                self.gap(lines=False)
                self.put_pair(path, word, depth - 1)
                self.gap(lines=False)
            self.put("}")
        else:
            self.put(self.string(self.any(*STRINGS)) if kind < 0.7 else self.any(*PLAIN))
        self.value[path] = (at, self.text[at:])

    def words(self, most: int) -> list[str]:
        return self.random.sample(WORDS, self.random.randrange(most + 1))

    def put_pair(self, path: KeyPath, word: str, depth: int) -> None:
        for at in range(self.random.choice([0, 0, 0, 1, 2])):  # dotted: through tables of nobody else
            inner = f"{word}.{at}"
            self.key[*path, inner] = len(self.text)
            self.put(self.part(inner) + self.any("", " ") + "." + self.any("", "\t"))
            path = (*path, inner)
        self.key[*path, word] = len(self.text)
        self.put(self.part(word) + self.any("", " ") + "=" + self.any("", " "))
        self.put_value((*path, word), depth)

    def put_header(self, path: KeyPath, word: str) -> KeyPath:
        """Open a new table, or one more of an array, in the table ``path``."""
        whole = (*path, word)
        many = self.defined.get(whole, self.random.choice([-1, 0])) >= 0
        at = len(self.text)
        self.put("[[" if many else "[")
        names = [part for part in whole if isinstance(part, str)]
        self.put(self.any(" . ", ".").join(map(self.part, names)) + ("]]" if many else "]"))
        self.key.setdefault(whole, at)
        self.defined[whole] = self.defined.get(whole, 0) + 1 if many else -1
        if many:
            whole = (*whole, self.defined[whole] - 1)
            self.key[whole] = at
        return whole

    def document(self) -> str:
        for word in self.words(3):
            self.put_pair((), f"top {word}", 3)
            self.put(self.any("\n", " # c\n", "\r\n"))
        tables: list[KeyPath] = [()]
        for n in range(self.random.randrange(7)):
            arrays = [whole for whole, size in self.defined.items() if size > 0 and whole[:-1] in tables]
            *parent, word = self.random.choice([*arrays, (*self.random.choice(tables), f"t {n}")])
            path = self.put_header(tuple(parent), str(word))
            self.put("\n")
            tables = [old for old in tables if old == path[: len(old)]] + [path]
            for word in self.words(3):
                self.put_pair(path, word, 2)
                self.put("\n")
                self.gap(lines=True)
            self.put("\n")
        return self.text


def paths(value: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    """All keys and elements of what a document says."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in inner:
        yield (*path, key), child
        yield from paths(child, (*path, key))


def check(document: Document) -> None:
    """Check that the scanner has seen what there is, and that each string stands where it says."""
    said = dict(paths(document.data))
    assert said.keys() == document.places.keys()
    for path, place in document.places.items():
        if isinstance(said[path], str) and place.text >= 0:
            assert document.text.startswith(said[path], place.text)
        assert not document.text[place.key].isspace()
        assert not document.text[place.value].isspace()


@given(RANDOMS)
def test_places_of_random_documents(random: Random) -> None:
    writer = Writer(random)
    document = parse_toml(writer.document())
    check(document)
    shift = [k for k, c in enumerate(writer.text) if c == "\r"]
    for path, (at, written) in writer.value.items():
        place = document.places[path].value
        assert document.text.startswith(written.replace("\r\n", "\n"), place)
        assert place == at - sum(k < at for k in shift)
    for path, at in writer.key.items():
        assert document.places[path].key == at - sum(k < at for k in shift)
    for path, value in paths(document.data):
        if isinstance(value, str) and not any(c in value for c in "\\\n\"'\t"):
            assert document.places[path].text >= 0


@given(RANDOMS)
def test_broken_documents_are_told(random: Random) -> None:
    text = list(Writer(random).document())
    for _ in range(random.randrange(1, 4)):
        at = random.randrange(len(text) + 1)
        text[at : at + random.randrange(3)] = random.choice(SIGNS)
    try:
        check(parse_toml("".join(text)))
    except FormatError as error:
        assert error.line > 0  # noqa: PT017
        assert error.column > 0  # noqa: PT017


@given(st.text())
def test_any_text_is_read_or_told(text: str) -> None:
    try:
        check(parse_toml(text))
    except FormatError:
        with pytest.raises(tomllib.TOMLDecodeError):
            tomllib.loads(text)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a = 1\nb = \n", "t.toml:2:5: this is not TOML: invalid value"),
        ("a = 1\nof = hole\n", "t.toml:2:6: this is not TOML: invalid value (a text needs quotes)"),
        ("a = [b]", "t.toml:1:6: this is not TOML: invalid value (a text needs quotes)"),
        ("a = [1,", "t.toml:1:8: this is not TOML: invalid value"),
        ("é = 1", "t.toml:1:1: this is not TOML: invalid statement"),
        ("a = 1\na = 2", "t.toml:2:6: this is not TOML: cannot overwrite a value"),
        ("[a]\n[a]", "t.toml:2:3: this is not TOML: cannot declare ('a',) twice"),
        ("a = 'b", 't.toml:1:7: this is not TOML: expected "\'"'),
        ('a = "\\ud800"', "t.toml:1:12: this is not TOML: escaped character is not a Unicode scalar value"),
        (f"a = {'[' * 31}", "t.toml:1:35: more than 30 levels of brackets and dots; fewer are needed"),
        (f"a = {'[' * 100_000}", "t.toml:1:35: more than 30 levels of brackets and dots; fewer are needed"),
        (f"a{'.a' * 100_000} = 1", "t.toml:1:61: more than 30 levels of brackets and dots; fewer are needed"),
        (f"[a{'.a' * 100_000}]", "t.toml:1:62: more than 30 levels of brackets and dots; fewer are needed"),
        (f"a = [0x{'f' * 99}]", f"t.toml:1:6: {LONG}"),
    ],
)
def test_what_is_told(text: str, says: str) -> None:
    with pytest.raises(FormatError) as caught:
        parse_toml(text, "t.toml")
    assert str(caught.value) == says


def test_the_deepest_that_is_read() -> None:
    document = parse_toml(f"a = {'[' * (MAX_DEPTH - 1)}{']' * (MAX_DEPTH - 1)}")
    assert len(document.places) == MAX_DEPTH - 1


def test_files(tmp_path: Path) -> None:
    path = tmp_path / "t.toml"
    path.write_bytes(b"\xef\xbb\xbfa = 'b'\r\nc = 1")
    document = read_toml(path)
    assert document.data == {"a": "b", "c": 1}
    assert document.places["a",].text == 5
    path.write_bytes(b"\xef\xbb\xbfa = 1\nb = '\xc3\xa9\xff'")
    with pytest.raises(FormatError, match="t.toml:2:7: byte 13 is not UTF-8"):
        read_toml(path)
    path.write_bytes(b"#" * (MAX_BYTES + 1))
    with pytest.raises(FormatError, match="t.toml: the file is larger than 1 MiB"):
        read_toml(path)
    with pytest.raises(OSError, match="No such file"):
        read_toml(tmp_path / "no.toml")

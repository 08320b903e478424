"""Strict JSON: what a document may say, and what every slip is told."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any, NoReturn

from supremal.errors import FormatError, suggest
from supremal.formats.model import too_large


class WrongError(Exception):
    """What is wrong in a document; who reads the file adds its path."""


def parse(raw: bytes, path: str, most: int) -> Any:  # noqa: ANN401 - JSON may hold anything
    """Return what the JSON text ``raw``, of at most ``most`` bytes, says."""
    if len(raw) > most:
        fail(too_large(most))
    try:
        text = raw.decode("utf-8-sig")
        document = json.loads(text, object_pairs_hook=_object, parse_constant=_no_number)
        if "\\" in text:
            json.dumps(document, ensure_ascii=False).encode()  # an escape may stand for half a character
    except UnicodeDecodeError as error:
        fail(f"byte {error.start} is not UTF-8; save the file in that encoding")
    except UnicodeEncodeError:
        fail("an escape from \\ud800 to \\udfff stands alone, which is half a character; write both halves")
    except json.JSONDecodeError as error:
        message = f"this is not JSON: {error.msg}"
        raise FormatError(message, path=path, line=error.lineno, column=error.colno) from None
    except RecursionError:
        fail("brackets are nested too deeply for any document of supremal")
    except ValueError:
        fail("a number has too many digits")
    return document


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make an object of ``pairs``; JSON itself would let the last of two equal keys win."""
    document = dict(pairs)
    if len(document) != len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        fail(f"key {twice!r} stands twice in one object; keep one of the two")
    return document


def _no_number(text: str) -> NoReturn:
    fail(f"{text} is no number of JSON; a finite number is needed")


def fail(message: str) -> NoReturn:
    """Say what is wrong."""
    raise WrongError(message)


def shown(value: object) -> str:
    """Return ``value`` as a message shows it."""
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."


def check_keys(value: object, what: str, needed: Iterable[str], also: Iterable[str]) -> None:
    """Check that ``value`` is an object with all keys of ``needed`` and no others but those of ``also``."""
    if not isinstance(value, dict):
        fail(f"{what} is {shown(value)}; an object with the keys {', '.join(needed)} is needed")
    known = (*needed, *also)
    for key in value:
        if key not in known:
            fail(f"{what} has the unknown key {key!r}; {suggest(key, known)}")
    for key in needed:
        if key not in value:
            fail(f"{what} has no key {key!r}; {', '.join(needed)} are needed")


def text_of(value: object, what: str) -> str:
    """Return a string."""
    if not isinstance(value, str):
        fail(f"{what} is {shown(value)}; a string is needed")
    return value


def list_of(value: object, what: str) -> list[Any]:
    """Return a list."""
    if not isinstance(value, list):
        fail(f"{what} is {shown(value)}; a list is needed")
    return value


def distinct(value: object, what: str) -> dict[str, None]:
    """Return the names in a list, in order, each of which has to stand there once."""
    names: dict[str, None] = {}
    for name in list_of(value, what):
        text = text_of(name, f"an entry of {what}")
        if text in names:
            fail(f"{what} names {text!r} twice; name each once")
        names[text] = None
    return names

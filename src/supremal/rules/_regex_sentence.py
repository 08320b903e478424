"""What an expression says, in plain English: its program is run with phrases in place of terms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from supremal._arrays import NONE
from supremal.rules._regex_parser import Complement, Events, Join, Op, Repeat, Step

MAX_STEPS: Final = 25
"""The longest program that is easier to read in words."""


class _Phrase(NamedTuple):
    """What is said, and how one and many of it are counted; ``simple``: it needs no brackets."""

    text: str
    one: str
    many: str
    simple: bool = True


def sentence(program: Sequence[Step]) -> str:
    """Return what ``program`` says, without a full stop.

    Examples
    --------
    >>> sentence([Events(("a",)), Events(("b", "c"), others=True), Repeat(2, NONE), Join("then", 2)])
    'a, then at least 2 events other than b or c'
    """
    stack: list[_Phrase] = []
    for step in program:
        match step:
            case Events(names, others):
                stack.append(_event(names, others=others))
            case Repeat(least, most):
                body = stack.pop()
                stack.append(_phrase(_count(least, most, body.one, body.many)))
            case Complement():
                stack.append(_phrase(f"anything but {_bracketed(stack.pop())}"))
            case Join(op, parts):
                cut = len(stack) - parts
                stack[cut:] = [_joined(op, stack[cut:])]
    return stack.pop().text


def _event(names: Sequence[str], *, others: bool) -> _Phrase:
    listed = " or ".join(names)
    if others:
        rest = f" other than {listed}" if names else ""
        return _Phrase(f"any event{rest}", f"one event{rest}", f"events{rest}")
    if len(names) == 1:
        return _Phrase(listed, f"one {listed}", listed)
    return _phrase(listed, simple=False)


def _phrase(text: str, *, simple: bool = True) -> _Phrase:
    """Return a phrase that is counted as a whole."""
    return _Phrase(text, f"once ({text})", f"times ({text})", simple)


def _bracketed(phrase: _Phrase) -> str:
    return phrase.text if phrase.simple else f"({phrase.text})"


def _joined(op: Op, parts: Sequence[_Phrase]) -> _Phrase:
    if not parts:
        return _phrase("nothing")
    link, last = {"then": (", then ", ", then "), "or": (", ", " or "), "and": (", ", " and ")}[op]
    texts = [_bracketed(part) for part in parts]
    text = link.join(texts[:-1]) + last + texts[-1]
    if op == "and":
        text = f"both {text}" if len(parts) == 2 else f"all of {text}"
    return _phrase(text, simple=False)


def _count(least: int, most: int, one: str, many: str) -> str:
    if (least, most) == (0, NONE):
        return f"any number of {many}"
    if most == NONE:
        return f"at least {one if least == 1 else f'{least} {many}'}"
    if least == most:
        return one if least == 1 else f"{least} {many}"
    if least == 0:
        return f"at most {one if most == 1 else f'{most} {many}'}"
    return f"{least} to {most} {many}"

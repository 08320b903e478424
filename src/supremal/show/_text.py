"""Labels of diagrams: lines of runs of text, and about how wide they are.

SVG has no layout of its own, so a label has to know its size before it finds its place.  The widths are those
of an average text face, on the generous side: a label then keeps some air in any font.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple, TypeAlias
from xml.sax.saxutils import escape as xml_escape

SIZE: Final = 14.0
"""The size of a label, in units of the drawing."""
LEADING: Final = 17.0
"""From one base line to the next."""
_SUB: Final = 0.72  # the size of a subscript, as a part of the text's
_MONO: Final = 0.8  # guards are code, and code looks larger than text
_NAME: Final = 9  # letters of the name of a state, on one line,
_WORD: Final = 12  # and where it has a longer word
_ROWS: Final = 3
_LETTERS: Final = 20  # of a guard, on one line
_WIDTHS: Final = {
    **dict.fromkeys("ijlft.,:;|!'()[]{} /\\", 0.31),
    **dict.fromkeys("mwΣ⟨⟩…—@%", 0.8),
    **dict.fromkeys("MW", 0.94),
}
"""Of letters that are not like most, as parts of the size of the text."""
_SYMBOL: Final = re.compile(r"(?P<base>[^\W\d_])(?:_(?P<under>\w{1,2})|(?P<number>\d{1,2}))$")
_LISTED: Final = 6  # the most events of an edge that are named one by one
_BRIEF: Final = 4  # up to here a list is as short as "all but"
_INVALID: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class Run(NamedTuple):
    """Text in one style: "" (symbol), "guard", "reward" or "free" (an event that nobody controls)."""

    text: str
    style: str = ""
    sub: bool = False


Line: TypeAlias = tuple[Run, ...]


def escape(text: str) -> str:
    """Return ``text`` as XML, in content and in quoted attributes; what XML cannot hold becomes U+FFFD."""
    return xml_escape(_INVALID.sub("\ufffd", text), {'"': "&quot;", "'": "&#39;"})


def symbol(name: str, style: str = "") -> Line:
    """Return ``name`` as the paper sets it: a letter and a short index become a letter with a subscript.

    Examples
    --------
    >>> symbol("d_u")
    (Run(text='d', style='', sub=False), Run(text='u', style='', sub=True))
    >>> symbol("start")
    (Run(text='start', style='', sub=False),)
    """
    match = _SYMBOL.match(name)
    if match is None:
        return (Run(name, style),)
    return (Run(match["base"], style), Run(match["under"] or match["number"], style, sub=True))


def plain(lines: Iterable[Line]) -> str:
    """Return what ``lines`` say, without their style."""
    return " ".join("".join(run.text for run in line) for line in lines)


def width(line: Line, size: float = SIZE) -> float:
    """Return about how wide ``line`` is."""
    total = 0.0
    for run in line:
        if run.style in ("guard", "reward"):
            total += 0.602 * _MONO * size * len(run.text)
            continue
        scale = size * (_SUB if run.sub else 1.0)
        for letter in run.text:
            total += scale * _WIDTHS.get(letter, 0.72 if letter.isupper() else 0.53)
    return total


def box(lines: Sequence[Line]) -> tuple[float, float]:
    """Return width and height of a label of ``lines``."""
    return max((width(line) for line in lines), default=0.0), LEADING * len(lines)


def shorten(name: str, limit: int) -> str:
    """Return ``name`` with at most ``limit`` letters, the last of them "…" where some are left out."""
    return name if len(name) <= limit else name[: limit - 1] + "…"


def in_lines(name: str) -> tuple[Line, ...]:
    """Return the name of a state as a node has room for it: in up to three lines, and what is longer cut.

    Examples
    --------
    >>> [plain([line]) for line in in_lines("working, idle, (0,2)")]
    ['working,', 'idle,', '(0,2)']
    >>> [plain([line]) for line in in_lines("a_very_long_name_indeed")]
    ['a_very_', 'long_', 'name_ind…']
    """
    if len(name) <= _NAME:
        return (symbol(name),)
    lines: list[str] = []
    for part in _syllables(name):
        if lines and len((lines[-1] + part).rstrip()) <= _NAME:
            lines[-1] += part
        else:
            lines.append(part)
    if len(lines) > _ROWS:
        lines[_ROWS - 1 :] = ["".join(lines[_ROWS - 1 :])]
    *lines, last = map(str.rstrip, lines)
    cut = shorten(last, _WORD if last in name.split() else _NAME)
    return tuple((Run(line),) for line in (*(shorten(line, _WORD) for line in lines), cut))


def _syllables(name: str) -> list[str]:
    """Return the parts between which a name may be broken: words, and of long ones what "_", "-" or "," end.

    Examples
    --------
    >>> _syllables("(0,2) half_loaded")
    ['(0,2) ', 'half_', 'loaded']
    """
    words = re.findall(r"\S+\s*", name)
    return [
        part
        for word in words
        for part in ([word] if len(word.rstrip()) <= _NAME else re.findall(r".+?(?:[_,-]\s*|$)", word))
    ]


def joined(words: Sequence[Line], *, across: float = 120.0) -> tuple[Line, ...]:
    """Return the list of ``words``, with commas, broken into lines of about ``across``."""
    lines: list[list[Run]] = [[]]
    for at, word in enumerate(words):
        comma = (Run(","),) if at + 1 < len(words) else ()
        if lines[-1] and width((*lines[-1], *word, *comma)) > across:
            lines.append([])
        elif lines[-1]:
            lines[-1].append(Run(" "))
        lines[-1] += [*word, *comma]
    return tuple(tuple(line) for line in lines)


def event_label(events: Sequence[str], alphabet: Sequence[str], free: frozenset[str]) -> tuple[Line, ...]:
    r"""Return the label of an edge of ``events``; many are told as "Σ \ {those that are not}".

    ``free`` are the events that nobody controls.

    Examples
    --------
    >>> plain(event_label(["l", "r"], ["l", "r", "f", "b"], frozenset()))
    'l, r'
    >>> plain(event_label(list("abcdfg"), list("abcdefg"), frozenset()))
    'Σ \\ {e}'
    """
    others = [name for name in alphabet if name not in events]
    if len(events) > _BRIEF and len(others) < _BRIEF and len(others) < len(events):
        if not others:
            return ((Run("Σ", "set"),),)
        inside = joined([symbol(name, "free" if name in free else "") for name in others], across=1e9)[0]
        return ((Run("Σ \\ {", "set"), *inside, Run("}", "set")),)
    shown = list(events)
    if len(shown) > _LISTED:
        shown = shown[: _BRIEF - 1]
    words = [symbol(shorten(name, 24), "free" if name in free else "") for name in shown]
    if len(shown) < len(events):
        words.append((Run(f"… ({len(events)} in all)", "set"),))
    return joined(words)


def guard_label(guards: Sequence[str], reward: float) -> tuple[Line, ...]:
    """Return the label "guard, reward" of an edge; long guards are broken at their signs."""
    pieces: list[str] = []
    for guard in guards:
        text = " ".join(guard.split())
        parts = [text] if len(text) <= _LETTERS else _alternatives(text)
        pieces += [piece for part in parts for piece in _broken(part)]
        pieces[-1] += " |"
    pieces[-1] = pieces[-1].removesuffix(" |") + ","
    gain = Run(f"{reward:g}".replace("-", "\u2212"), "reward")
    *lines, last = ((Run(piece, "guard"),) for piece in pieces)
    if len(pieces[-1]) + len(gain.text) < _LETTERS + 6:
        return (*lines, (*last, Run(" ", "guard"), gain))
    return (*lines, last, (gain,))


def _alternatives(guard: str) -> list[str]:
    """Return ``guard`` cut after each "|" that stands in no bracket."""
    parts, depth = [""], 0
    for letter in guard:
        depth += (letter == "(") - (letter == ")")
        parts[-1] += letter
        if letter in "|∨" and depth == 0:
            parts.append("")
    return [part.strip() for part in parts]


def _broken(text: str) -> list[str]:
    """Return ``text`` in lines of about as many letters as a guard may have, cut before a sign."""
    lines = [""]
    for part in re.split(r"(?<=\S) (?=[&∧|∨]|and\b|or\b)", text):
        if lines[-1] and len(text) > _LETTERS and len(lines[-1]) + 1 + len(part) > _LETTERS:
            lines.append("")
        lines[-1] = f"{lines[-1]} {part}".strip()
    return lines


def as_svg(lines: Sequence[Line], x: float, y: float, css: str) -> str:
    """Return ``lines`` as SVG text centred on (x, y)."""
    first = y - LEADING * (len(lines) - 1) / 2 + 0.33 * SIZE
    rows = []
    for at, line in enumerate(lines):
        spans, lowered = [], False
        for run in line:
            shift = "" if run.sub == lowered else f' dy="{0.22 * SIZE * (1 if run.sub else -1):.1f}"'
            lowered = run.sub
            names = " ".join(name for name in (run.style, "sub" if run.sub else "") if name)
            kind = f' class="{names}"' if names else ""
            spans.append(
                f"<tspan{kind}{shift}>{escape(run.text)}</tspan>" if kind or shift else escape(run.text)
            )
        rows.append(
            f'<text class="{css}" x="{x:.1f}" y="{first + at * LEADING:.1f}" xml:space="preserve">'
            f"{''.join(spans)}</text>"
        )
    return "".join(rows)

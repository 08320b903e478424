r"""Names of automata, states and events, in formats that do not take every name.

A character that a format cannot take is written as ``\u{...}`` with its number in base 16, and read back from
that.  So names survive, and a program that knows nothing of it sees names that are odd, but distinct.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

from supremal.automata.automaton import Automaton

EMPTY: Final = r"\u{}"
"""The empty name, where there has to be something."""

_ESCAPED: Final = re.compile(r"\\u\{([0-9a-f]{0,6})\}")
_BACKSLASH: Final = re.compile(r"\\(?=u\{)")


def escape(name: str, bad: re.Pattern[str]) -> str:
    r"""Return ``name`` with each character that is ``bad`` as its number.

    Examples
    --------
    >>> bad = re.compile(r"[^!-~]")
    >>> escape("idle", bad), escape("à table", bad), escape("", bad)
    ('idle', '\\u{e0}\\u{20}table', '')
    """
    safe = _BACKSLASH.sub(r"\\u{5c}", name)
    return bad.sub(lambda found: f"\\u{{{ord(found[0]):x}}}", safe)


def unescape(name: str) -> str:
    r"""Return the name that `escape` has written.

    Examples
    --------
    >>> unescape(r"\u{e0}\u{20}table"), unescape(r"\u{}"), unescape(r"\u{d800}")
    ('à table', '', '\\u{d800}')
    """
    return _ESCAPED.sub(_character, name) if "\\u{" in name else name


def _character(found: re.Match[str]) -> str:
    if not found[1]:
        return ""
    code = int(found[1], 16)
    return found[0] if code > 0x10FFFF or 0xD800 <= code < 0xE000 else chr(code)


def unique(names: Iterable[str]) -> list[str]:
    """Return ``names``, those that stand there again with a number behind them.

    Examples
    --------
    >>> unique(["a", "a", "a_2", "b"])
    ['a', 'a_2', 'a_2_2', 'b']
    """
    taken: dict[str, None] = {}
    counts: dict[str, int] = {}
    for name in names:
        candidate, count = name, counts.get(name, 1)
        while candidate in taken:
            count += 1
            candidate = f"{name}_{count}"
        counts[name] = count
        taken[candidate] = None
    return list(taken)


def state_names(automaton: Automaton) -> list[str]:
    """Return a name for every state, no two of them the same."""
    return unique(automaton.state_name(s) for s in range(automaton.n_states))


def part_names(parts: Iterable[Automaton], kind: str) -> list[str]:
    """Return a name for every automaton, none of them empty; ``kind`` and a number where it has none."""
    return [part.name or f"{kind}{k}" for k, part in enumerate(parts, 1)]

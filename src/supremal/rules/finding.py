"""A finding about rules: which lint found it, about which rules, in words, and the word that shows it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from supremal.automata.words import Word
from supremal.rules.rule import Rule

Kind = Literal[
    "contradiction", "dead state", "no force", "event in no plant", "never bites", "implied", "left open"
]
"""The lints, the gravest first; "left open" where one could not be decided within bounds."""

_NAMED: Final = 8
"""Rules or events that a text names."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something about rules that is worth a second look.

    Parameters
    ----------
    kind
        Which of the lints found it.
    rules
        The names of the rules that it is about.  Of an "implied" one: that rule, then those that imply it.
    text
        What was found, in words.
    word
        The word that shows it, () where none is needed.
    """

    kind: Kind
    rules: tuple[str, ...]
    text: str
    word: Word = ()

    def __str__(self) -> str:
        return self.text


def finding(kind: Kind, rules: Sequence[Rule], text: str, word: Word = ()) -> Finding:
    """Return a finding about ``rules``."""
    return Finding(kind, tuple(rule.name for rule in rules), text, word)


def called(rules: Sequence[Rule]) -> str:
    """Say "rule 'a'", or "rules 'a', 'b' and 'c'"."""
    return f"rule{'s' * (len(rules) > 1)} {listed([repr(rule.name) for rule in rules])}"


def listed(names: Sequence[str], last: str = "and") -> str:
    """Put commas between names, and a word before the last; of many, only the first are named.

    Examples
    --------
    >>> listed(["a", "b", "c"], "or"), listed([str(n) for n in range(2_000)])
    ('a, b or c', '0, 1, 2, 3, 4, 5, 6 and 1,993 more')
    """
    if len(names) > _NAMED:
        names = [*names[: _NAMED - 1], f"{len(names) - _NAMED + 1:,} more"]
    return f" {last} ".join(part for part in (", ".join(names[:-1]), names[-1]) if part)

"""The phrases that fill the blanks of a pattern's sentence."""

from __future__ import annotations

from collections.abc import Iterable


def joined(names: Iterable[str], word: str) -> str:
    """Return ``names`` as a list in words.

    Examples
    --------
    >>> joined(["a"], "or"), joined(["a", "b"], "or"), joined(["a", "b", "c"], "and")
    ('a', 'a or b', 'a, b and c')
    """
    *head, last = names
    return f"{', '.join(head)} {word} {last}" if head else last


class Names(tuple[str, ...]):
    """Events, any of which is meant.

    Examples
    --------
    The specification is a verb in the singular, where they are counted together:

    >>> f"no {Names(['a', 'b'])}", f"{Names(['a']):happens} once", f"{Names(['a', 'b']):happens} once"
    ('no a or b', 'a happens once', 'a and b together happen once')
    """

    __slots__ = ()

    def __format__(self, verb: str) -> str:
        if not verb:
            return joined(self, "or")
        if len(self) == 1:
            return f"{self[0]} {verb}"
        return f"{joined(self, 'and')} together {verb.removesuffix('s')}"


class Amount(int):
    """A number of something.

    Examples
    --------
    The specification is a noun in the singular, or ``time``:

    >>> [f"{Amount(n):time}, {Amount(n):event}" for n in range(4)]
    ['0 times, 0 events', 'once, 1 event', 'twice, 2 events', '3 times, 3 events']
    """

    def __format__(self, noun: str) -> str:
        if noun == "time" and self in (1, 2):
            return ("once", "twice")[self - 1]
        number = f"{int(self):,}"
        return f"{number} {noun}{'' if self == 1 else 's'}" if noun else number


def counted(what: str | Iterable[str]) -> str:
    """Return what is counted, to be put behind a number of events.

    Examples
    --------
    >>> counted("all"), counted(["a", "b"])
    ('', ', counting a and b only')
    """
    return "" if what == "all" else f", counting {joined(what, 'and')} only"

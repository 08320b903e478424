"""Alphabets: the events, and what can be done about each.

Σ = Σc ∪ Σu: a supervisor can forbid a *controllable* event and has to live with an *uncontrollable* one.
An event that is not observable cannot be seen by it either.

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., section 3.2.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from supremal._arrays import Bools
from supremal.errors import AlphabetError, suggest


@dataclass(frozen=True, slots=True)
class Alphabet:
    """A finite, ordered set of events.

    Two alphabets are equal when names, order and properties are; alphabets are hashable.

    Parameters
    ----------
    names
        The events, each a non-empty name without white space.
    uncontrollable
        Those that no supervisor can forbid.
    unobservable
        Those that no supervisor can see.

    Raises
    ------
    AlphabetError
        If a name is empty, has white space in it or stands twice, or a property names an unknown event.

    Examples
    --------
    >>> sigma = Alphabet(("start", "finish"), uncontrollable=frozenset({"finish"}))
    >>> sigma.index("finish"), sigma.controllable.tolist()
    (1, [True, False])
    """

    names: tuple[str, ...]
    uncontrollable: frozenset[str] = frozenset()
    unobservable: frozenset[str] = frozenset()
    _index: dict[str, int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        names = tuple(self.names)
        index = {name: e for e, name in enumerate(names)}
        for name in names:
            if not isinstance(name, str) or not name or any(c.isspace() for c in name):
                message = f"event {name!r} is no name: a non-empty string without white space is needed"
                raise AlphabetError(message)
        if len(index) != len(names):
            twice = next(name for e, name in enumerate(names) if index[name] != e)
            message = f"event {twice!r} stands twice in the alphabet; name each event once"
            raise AlphabetError(message)
        object.__setattr__(self, "names", names)
        object.__setattr__(self, "uncontrollable", frozenset(self.uncontrollable))
        object.__setattr__(self, "unobservable", frozenset(self.unobservable))
        object.__setattr__(self, "_index", index)
        for name in sorted(self.uncontrollable | self.unobservable):
            self.index(name)

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self._index

    def index(self, name: str) -> int:
        """Return the number of event ``name``; an unknown one is an `AlphabetError`."""
        try:
            return self._index[name]
        except KeyError:
            message = f"unknown event {name!r}; {suggest(str(name), self.names)}"
            raise AlphabetError(message) from None

    @property
    def controllable(self) -> Bools:
        """Which events a supervisor can forbid, ``bool [E]``."""
        return np.array([name not in self.uncontrollable for name in self.names], np.bool_)

    def spell(self, word: Iterable[int]) -> tuple[str, ...]:
        """Return the names of a word of event numbers."""
        return tuple(self.names[e] for e in word)


def union(*alphabets: Alphabet) -> Alphabet:
    """Return the events of all ``alphabets``, in the order in which they first appear.

    Raises
    ------
    AlphabetError
        If an event is controllable (observable) in one of them and not in another.

    Examples
    --------
    >>> union(Alphabet(("a", "b")), Alphabet(("b", "c"))).names
    ('a', 'b', 'c')
    """
    names = tuple(dict.fromkeys(name for sigma in alphabets for name in sigma.names))
    for prop in ("uncontrollable", "unobservable"):
        for name in names:
            says = {name in getattr(sigma, prop) for sigma in alphabets if name in sigma}
            if len(says) > 1:
                message = (
                    f"event {name!r} is {prop} in one automaton and {prop.removeprefix('un')} in another; "
                    f"declare it {prop} in all of them or in none"
                )
                raise AlphabetError(message)
    return Alphabet(
        names,
        frozenset().union(*(sigma.uncontrollable for sigma in alphabets)),
        frozenset().union(*(sigma.unobservable for sigma in alphabets)),
    )

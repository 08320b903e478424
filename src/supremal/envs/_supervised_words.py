"""Words of N environments at once, as numbers.

An environment says mostly the same few words again and again.  Each word that comes along gets a *code*; a
table has for each code the numbers of its events, padded by their count E; a batch of words is a gather from
it.  The first A codes are the events of the actions, the next one is the word with no event.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal.automata.alphabet import Alphabet
from supremal.envs._supervised_setup import environment
from supremal.envs._supervised_word import as_word, check_name
from supremal.errors import MDPError

WordsOf: TypeAlias = Callable[[Any, Any, Any, Any, Any, dict[str, Any]], Any]
Objects: TypeAlias = NDArray[np.object_]

_MANY: Final = 1 << 13  # words that are kept; an environment may make up ever new names


class Words:
    """What knows the words of an alphabet.

    Parameters
    ----------
    alphabet
        Whose numbers events get; a name that it does not have is in no row.
    events
        The event of each action.

    Notes
    -----
    ``silent`` is the code of the word with no event.
    """

    def __init__(self, alphabet: Alphabet, events: Sequence[str]) -> None:
        self._alphabet, self._events = alphabet, tuple(events)
        self._number = {name: e for e, name in enumerate(alphabet)}
        self.silent = len(events)
        self._forget()

    def said(self, words: Any, places: Longs, heard: Bools) -> Longs:  # noqa: ANN401 - whatever a user's function returned
        """Return the code of each of N words, ``int64 [N]``.

        Parameters
        ----------
        words
            N words; or an array ``int [N, L]`` of numbers of events, padded by `NONE`.
        places
            ``[N]``: the action that was carried out.
        heard
            ``bool [N]``: which environments said something; elsewhere the word is that action's event.

        Raises
        ------
        MDPError
            If these are no words; tells which environment's is none.
        """
        if len(self._codes) > _MANY:
            self._forget()
        n = len(places)
        numbers = isinstance(words, np.ndarray) and words.dtype.kind in "iu" and words.ndim == 2
        if not numbers and (isinstance(words, str) or not hasattr(words, "__len__")):
            message = f"word returned {words!r:.60}; {n} words are needed, or an array of numbers of events"
            raise MDPError(message)
        if len(words) != n:
            message = f"word returned {len(words)} words; {n} are needed, one an environment"
            raise MDPError(message)
        if numbers:
            said = np.where(heard[:, None], words.astype(np.int64), NONE)
            return np.where(heard, self._numbered(said), places)
        codes = places.copy()
        for i in np.flatnonzero(heard).tolist():
            try:
                codes[i] = self._codes[words[i]]
            except (KeyError, TypeError):
                codes[i] = self._learn(words[i], i)
        return codes

    def rows(self, codes: Longs) -> Ints:
        """Return the numbers of the events of N words, ``int32 [N, L]``, padded by E."""
        return self._rows.take(codes, axis=0)

    def names(self, codes: Longs) -> Objects:
        """Return the names of the events of N words, each a tuple."""
        return self._names.take(codes)

    def _forget(self) -> None:
        """Begin with the events of the actions."""
        self._codes: dict[tuple[str, ...], int] = {}
        words = [*((name,) for name in self._events), ()]
        self._rows: Ints = np.array(
            [[self._number[name] for name in word] or [len(self._alphabet)] for word in words], np.int32
        )
        self._names: Objects = np.empty(len(words), object)
        for code, word in enumerate(words):
            self._names[code] = word
            self._codes.setdefault(word, code)

    def _learn(self, said: Any, i: int) -> int:  # noqa: ANN401 - whatever a user's function returned
        """Return the code of a word that is new, or no tuple."""
        with environment(i):
            word = as_word(said)
            for name in word:
                check_name(name)
        if word in self._codes:
            return self._codes[word]
        row = [self._number[name] for name in word if name in self._number]
        code, length = len(self._rows), self._rows.shape[1]
        wider = ((0, 1), (0, max(0, len(row) - length)))
        self._rows = np.pad(self._rows, wider, constant_values=len(self._alphabet))
        self._rows[code, : len(row)] = row
        self._names = np.append(self._names, [None])
        self._names[code] = word
        self._codes[word] = code
        return code

    def _numbered(self, numbers: Longs) -> Longs:
        """Return the code of each row ``[N, L]`` of numbers; each that occurs is looked up once."""
        size, length = len(self._alphabet), numbers.shape[1]
        wrong = ((numbers < NONE) | (numbers >= size)).any(axis=1)
        if wrong.any():
            i = int(wrong.argmax())
            message = (
                f"environment {i}: the word of a step is {numbers[i].tolist()}; numbers of events, from 0 to "
                f"{size - 1}, are needed, and {NONE} for none"
            )
            raise MDPError(message)
        if (size + 1) ** length < 1 << 62:  # the digits of one number
            digits = (numbers + 1) @ (size + 1) ** np.arange(length)
            _, first, inverse = np.unique(digits, return_index=True, return_inverse=True)
        else:
            _, first, inverse = np.unique(numbers, axis=0, return_index=True, return_inverse=True)
        names = self._alphabet.names
        words = [tuple(names[e] for e in numbers[i].tolist() if e != NONE) for i in first]
        codes = [self._codes[word] if word in self._codes else self._learn(word, 0) for word in words]
        found: Longs = np.array(codes, np.int64)[inverse.reshape(-1)]
        return found

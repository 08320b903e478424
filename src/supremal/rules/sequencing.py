"""Sequences of events that follow each other without a break.

A sequence that is forbidden anywhere is looked for as Knuth, Morris and Pratt do: the state is how much of it
has just happened, and where the next event does not go on with that, it goes on with the longest end of what
has happened that is a beginning of the sequence.  So overlaps are not forgotten: with ``a a b`` forbidden,
``a a a b`` breaks the rule.

Source: Knuth, Morris, Pratt, "Fast pattern matching in strings", SIAM J. Comput. 6 (1977); section III of the
paper, for both kinds.
"""

from __future__ import annotations

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.rules._arguments import Events, Word
from supremal.rules._pattern import pattern
from supremal.rules._table import from_rows


@pattern("Never {sequence} in a row.")
def never_sequence(sequence: Word, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``sequence`` does not happen anywhere, one event right after the other.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = never_sequence(["a", "a", "b"], alphabet=Alphabet(("a", "b")))
    >>> rule.accepts(["a", "b", "a", "a"]), rule.run(["a", "a", "a", "b"])
    (True, -1)
    """
    column = {event: k for k, event in enumerate(dict.fromkeys(sequence), 1)}
    rows: list[list[int]] = []
    end = 0  # how long the longest proper end of what has happened is that is a beginning of the sequence
    for n, event in enumerate(sequence, 1):
        row = rows[end].copy() if rows else [0] * (len(column) + 1)
        end = row[column[event]]
        row[column[event]] = n if n < len(sequence) else NONE
        rows.append(row)
    return from_rows([[event] for event in column], rows, alphabet=alphabet, name=name)


@pattern("Every {trigger} is followed at once by {sequence}, with nothing in between.")
def only_sequence(trigger: Events, sequence: Word, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that after ``trigger`` there is nothing but ``sequence`` until it is complete.

    Elsewhere the events of the sequence are free.

    Examples
    --------
    The paper's recovery after an accidental drop:

    >>> from supremal import Alphabet
    >>> sigma = Alphabet(("d_u", "d2", "d3", "p1", "p2", "p3", "left"))
    >>> rule = only_sequence("d_u", ["d2", "d3", "p1", "p2", "p3"], alphabet=sigma)
    >>> rule.accepts(["p1", "d_u", "d2", "d3", "p1", "p2", "p3", "left"]), rule.run(["d_u", "p1"])
    (True, -1)
    """
    column = {event: k for k, event in enumerate(dict.fromkeys(sequence), 2)}
    rows = [[0, 1] + [0] * len(column)]
    for n, event in enumerate(sequence, 2):
        row = [NONE] * (len(column) + 2)
        row[column[event]] = n if n <= len(sequence) else 0
        rows.append(row)
    groups = [trigger, *([event] for event in column)]
    return from_rows(groups, rows, marked=[0], alphabet=alphabet, name=name)

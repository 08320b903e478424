"""From a small table to the automaton over all events."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.rules._derive import derived, event_classes


def from_rows(
    groups: Sequence[Iterable[str]],
    rows: Sequence[Sequence[int]],
    *,
    initial: int = 0,
    marked: Iterable[int] | None = None,
    alphabet: Alphabet,
    name: str,
) -> Automaton:
    """Return the minimal partial automaton of a table.

    Parameters
    ----------
    groups
        Sets of events.  An event of several does what each of them does, one after the other.
    rows
        For each state the next one: by an event of no group, then by one of each group; `NONE`: it breaks.
    initial
        The initial state.
    marked
        Where the rule is satisfied; left out: everywhere.
    alphabet, name
        Its events, and what to call it.

    Examples
    --------
    >>> rows = [[0, 1, NONE], [1, NONE, 0]]
    >>> by_turns = from_rows([["a"], ["b"]], rows, alphabet=Alphabet(tuple("abc")), name="by turns")
    >>> by_turns.accepts("acba"), by_turns.accepts("acab")
    (True, False)
    """
    sets = [frozenset(group) for group in groups]
    classes, first = event_classes(alphabet, sets)
    columns: list[list[int]] = []
    for event in first:
        column = list(range(len(rows)))
        for k in [k for k, names in enumerate(sets, 1) if event in names] or [0]:
            column = [NONE if to == NONE else rows[to][k] for to in column]
        columns.append([*column, NONE])  # the last entry keeps NONE at NONE
    satisfied = frozenset(range(len(rows)) if marked is None else marked)
    return derived(
        initial,
        lambda state, kind: columns[kind][state],
        satisfied.__contains__,
        alphabet=alphabet,
        classes=classes,
        name=name,
        max_states=len(rows) + 1,
    )

"""What is shared: room for one, room for many, and turns.

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., section 3.3, on what
specifications say: mutual exclusion, alternation and buffers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import chain
from typing import Annotated, Any, TypeAlias

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.rules._arguments import Events, Lists, Number, Parameter
from supremal.rules._pattern import pattern
from supremal.rules._phrases import Amount, Names
from supremal.rules._table import from_rows

Start: TypeAlias = Annotated[int | None, Parameter("number")]


def _one_at_a_time(enter: Iterable[Names], leave: Iterable[Names]) -> str:
    ways = [f"from {one} to {other}" for one, other in zip(enter, leave, strict=True)]
    return f"At most one at a time is inside: {', '.join(ways)}."


def _check_processes(arguments: Mapping[str, Any]) -> None:
    enter, leave = arguments["enter"], arguments["leave"]
    if len(enter) != len(leave):
        message = f"enter lists {len(enter)} processes and leave {len(leave)}; lists of one length are needed"
        raise ValueError(message)
    taken = {*chain(*leave)}
    for event in chain(*enter):
        if event in taken:
            message = f"{event!r} lets a process in and has another part to play; one part for each is needed"
            raise ValueError(message)
        taken.add(event)


@pattern(_one_at_a_time, check=_check_processes)
def mutex(enter: Lists, leave: Lists, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that of several processes at most one is inside: mutual exclusion.

    Parameters
    ----------
    enter, leave
        For each process what lets it in, and what lets it out.  Whoever enters again is still inside, and for
        whoever is not inside leaving means nothing.  One event may let out several.
    alphabet, name
        The events, and what to call the rule.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> sigma = Alphabet(("in1", "in2", "out1", "out2"))
    >>> rule = mutex(["in1", "in2"], ["out1", "out2"], alphabet=sigma)
    >>> rule.accepts(["in1", "out2", "out1", "in2"]), rule.run(["in1", "out2", "in2"])
    (True, -1)
    """
    n = len(enter)
    rows = [[0, *range(1, n + 1), *[0] * n]]
    for k in range(1, n + 1):
        row = [k] + [NONE] * n + [k] * n
        row[k], row[n + k] = k, 0
        rows.append(row)
    return from_rows([*enter, *leave], rows, alphabet=alphabet, name=name)


@pattern("Strictly by turns: {one}, then {other}, and so on.")
def alternation(one: Events, other: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``one`` and ``other`` happen by turns, ``one`` first.

    Where a last ``other`` is owed, it is `alternate_succession`.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = alternation("tick", "tock", alphabet=Alphabet(("tick", "tock")))
    >>> rule.accepts(["tick", "tock", "tick"]), rule.run(["tick", "tick"]), rule.run(["tock"])
    (True, -1, -1)
    """
    return from_rows([one, other], [[0, 1, NONE], [1, NONE, 0]], alphabet=alphabet, name=name)


def _in_bounds(up: Names, down: Names, maximum: Amount, minimum: Amount, start: Amount | None) -> str:
    return (
        f"The count that {up} raises and {down} lowers, from {minimum if start is None else start} on, "
        f"stays between {minimum} and {maximum}."
    )


def _check_bounds(arguments: Mapping[str, Any]) -> None:
    levels = {key: arguments[key] for key in ("minimum", "start", "maximum") if arguments[key] is not None}
    if sorted(levels.values()) != [*levels.values()]:
        message = f"{' <= '.join(f'{key} {level}' for key, level in levels.items())} is needed"
        raise ValueError(message)


@pattern(_in_bounds, check=_check_bounds)
def counter(
    up: Events,
    down: Events,
    maximum: Number,
    minimum: Number = 0,
    start: Start = None,
    *,
    alphabet: Alphabet,
    name: str = "",
) -> Automaton:
    """Return the rule that a count stays in its bounds, as that of the parts in a buffer.

    Parameters
    ----------
    up, down
        What raises it by one, and what lowers it.
    maximum, minimum
        The bounds.
    start
        Where it begins; left out: at ``minimum``.
    alphabet, name
        The events, and what to call the rule.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = counter("put", "get", 2, alphabet=Alphabet(("put", "get")))
    >>> rule.accepts(["put", "put", "get"]), rule.run(["put", "put", "put"]), rule.run(["get"])
    (True, -1, -1)
    """
    room, level = maximum - minimum, 0 if start is None else start - minimum
    rows = [[n, n + 1 if n < room else NONE, n - 1 if n else NONE] for n in range(room + 1)]
    return from_rows([up, down], rows, initial=level, alphabet=alphabet, name=name)

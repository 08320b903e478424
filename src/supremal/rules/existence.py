"""How often something happens, and what happens first and last.

Where an argument takes several events they are counted together.

Source: van der Aalst, Pesic, Schonenberg, "Declarative workflows: balancing between flexibility and support",
Computer Science - Research and Development 23 (2009): the existence templates of Declare.
"""

from __future__ import annotations

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.rules._arguments import Events, Number
from supremal.rules._pattern import pattern
from supremal.rules._table import from_rows


@pattern("No {of} ever happens.")
def absence(of: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``of`` never happens.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = absence("crash", alphabet=Alphabet(("go", "crash")))
    >>> rule.accepts(["go"]), rule.run(["crash"])
    (True, -1)
    """
    return from_rows([of], [[0, NONE]], alphabet=alphabet, name=name)


@pattern("{of:happens} exactly {times:time}.")
def exactly(of: Events, times: Number, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``of`` happens ``times`` times: not more, and in the end not fewer.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = exactly("pay", 1, alphabet=Alphabet(("pay", "look")))
    >>> rule.accepts([]), rule.accepts(["look", "pay"]), rule.run(["pay", "pay"])
    (False, True, -1)
    """
    rows = [*_count(times), [times, NONE]]
    return from_rows([of], rows, marked=[times], alphabet=alphabet, name=name)


@pattern("{of:happens} at most {times:time}.")
def at_most(of: Events, times: Number, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``of`` happens ``times`` times or less.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = at_most(["try", "retry"], 2, alphabet=Alphabet(("try", "retry", "wait")))
    >>> rule.accepts(["try", "wait", "retry"]), rule.run(["try", "retry", "try"])
    (True, -1)
    """
    return from_rows([of], [*_count(times), [times, NONE]], alphabet=alphabet, name=name)


@pattern("{of:happens} at least {times:time}.")
def at_least(of: Events, times: Number, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``of`` happens ``times`` times or more, sooner or later.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = at_least("save", 1, alphabet=Alphabet(("save", "edit")))
    >>> rule.accepts(["edit"]), rule.accepts(["edit", "save", "save"])
    (False, True)
    """
    rows = [*_count(times), [times, times]]
    return from_rows([of], rows, marked=[times], alphabet=alphabet, name=name)


def _count(times: int) -> list[list[int]]:
    """Return the rows in which something has happened 0, 1, ... and ``times`` - 1 times."""
    return [[n, n + 1] for n in range(times)]


@pattern("The first event is {of}.")
def first(of: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that what happens first is ``of``; where nothing happens it is not kept.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = first("log_in", alphabet=Alphabet(("log_in", "work")))
    >>> rule.accepts(["log_in", "work"]), rule.run(["work"]), rule.accepts([])
    (True, -1, False)
    """
    rows = [
        [NONE, 1],
        [1, 1],  # something has happened
    ]
    return from_rows([of], rows, marked=[1], alphabet=alphabet, name=name)


@pattern("The last event is {of}.")
def last(of: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that what happens last is ``of``; where nothing happens it is not kept.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = last("park", alphabet=Alphabet(("park", "drive")))
    >>> rule.accepts(["drive", "park"]), rule.accepts(["park", "drive"])
    (True, False)
    """
    return from_rows([of], [[0, 1], [0, 1]], marked=[1], alphabet=alphabet, name=name)

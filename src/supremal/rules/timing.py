"""Deadlines and delays, with events for a clock.

What counts as time is said by ``counting``: "all" events, or those of a list, such as the moves of one robot
or the ticks of a clock.  The events that begin and end the time are not counted, even where they are listed.
An event of the name "all" is listed as ``["all"]``.

A trigger may come again while time is running.  Each of them has its own deadline, so the first one that is
pending decides, and one reaction answers all; each has its own delay, so the last one decides.

Source: Koymans, "Specifying real-time properties with metric temporal logic", Real-Time Systems 2 (1990):
bounded response and minimal distance; the cell of the paper, "with at most 5 own actions in between".
"""

from __future__ import annotations

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.rules._arguments import Counting, Events, Number
from supremal.rules._pattern import pattern
from supremal.rules._table import from_rows


@pattern("Every {trigger} is followed by {reaction}, with at most {limit:event} in between{counting}.")
def within(
    trigger: Events,
    reaction: Events,
    limit: Number,
    counting: Counting,
    *,
    alphabet: Alphabet,
    name: str = "",
) -> Automaton:
    """Return the rule that each ``trigger`` is answered before its time is over.

    Parameters
    ----------
    trigger, reaction
        What begins the time, and what has to happen in it.
    limit
        How many counted events there may be in between.
    counting
        What is counted: "all", or a list of events.
    alphabet, name
        The events, and what to call the rule.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = within("pick", "drop", 1, "all", alphabet=Alphabet(("pick", "drop", "go")))
    >>> rule.accepts(["pick", "go", "drop"]), rule.run(["pick", "go", "go"]), rule.accepts(["pick"])
    (True, -1, False)
    """
    pending = [[n + 1, n + 1, 0, n + 2] for n in range(limit)]  # n events have been counted
    rows = [[0, 1, 0, 0], *pending, [limit + 1, limit + 1, 0, NONE]]
    counted = _counted(counting, alphabet, trigger, reaction)
    return from_rows([trigger, reaction, counted], rows, marked=[0], alphabet=alphabet, name=name)


@pattern("After every {trigger}, {delayed} waits for at least {count:event}{counting}.")
def wait_at_least(
    trigger: Events, delayed: Events, count: Number, counting: Counting, *, alphabet: Alphabet, name: str = ""
) -> Automaton:
    """Return the rule that after each ``trigger`` some time has to pass before ``delayed`` may happen.

    Parameters
    ----------
    trigger, delayed
        What begins the time, and what must not happen in it.
    count
        How many counted events there have to be in between.
    counting
        What is counted: "all", or a list of events.
    alphabet, name
        The events, and what to call the rule.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> sigma = Alphabet(("wash", "open", "tick", "call"))
    >>> rule = wait_at_least("wash", "open", 2, ["tick"], alphabet=sigma)
    >>> rule.accepts(["wash", "tick", "tick", "open"]), rule.run(["wash", "tick", "call", "open"])
    (True, -1)
    """
    waiting = [[n, count, NONE, n - 1] for n in range(1, count + 1)]  # n events have to be counted yet
    rows = [[0, count, 0, 0], *waiting]
    counted = _counted(counting, alphabet, trigger, delayed)
    return from_rows([trigger, delayed, counted], rows, alphabet=alphabet, name=name)


def _counted(counting: Counting, alphabet: Alphabet, begin: Events, end: Events) -> set[str]:
    return {*(alphabet if counting == "all" else counting)} - {*begin, *end}

"""What keeps something else from happening: ever, later, or next.

They owe nothing: all their states are marked.  In `not_succession` and `not_chain_succession` an event may
stand on both sides, which says "at most once" and "never twice in a row".

Source: van der Aalst, Pesic, Schonenberg, "Declarative workflows: balancing between flexibility and support",
Computer Science - Research and Development 23 (2009): the negative relation templates of Declare.
"""

from __future__ import annotations

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.rules._arguments import Events
from supremal.rules._pattern import pattern
from supremal.rules._table import from_rows


@pattern("If {one} happens, no {other} happens, before or after.")
def not_coexistence(one: Events, other: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``one`` and ``other`` do not both happen, in whatever order.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = not_coexistence("accept", "reject", alphabet=Alphabet(("accept", "reject")))
    >>> rule.accepts(["reject", "reject"]), rule.run(["reject", "accept"])
    (True, -1)
    """
    rows = [
        [0, 1, 2],
        [1, 1, NONE],
        [2, NONE, 2],
    ]
    return from_rows([one, other], rows, alphabet=alphabet, name=name)


@pattern("Once {trigger} has happened, no {forbidden} happens any more.", may_share=True)
def not_succession(trigger: Events, forbidden: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that after ``trigger`` there is no ``forbidden``, at any time.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = not_succession("close", "write", alphabet=Alphabet(("close", "write")))
    >>> rule.accepts(["write", "close"]), rule.run(["close", "write"])
    (True, -1)
    """
    rows = [
        [0, 0, 1],
        [1, NONE, 1],  # the trigger has happened
    ]
    return from_rows([forbidden, trigger], rows, alphabet=alphabet, name=name)


@pattern("No {forbidden} comes directly after {trigger}.", may_share=True)
def not_chain_succession(
    trigger: Events, forbidden: Events, *, alphabet: Alphabet, name: str = ""
) -> Automaton:
    """Return the rule that the next event after ``trigger`` is not ``forbidden``.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = not_chain_succession("right", "right", alphabet=Alphabet(("left", "right")))
    >>> rule.accepts(["right", "left", "right"]), rule.run(["left", "right", "right"])
    (True, -1)
    """
    rows = [
        [0, 0, 1],
        [0, NONE, 1],  # the trigger has just happened
    ]
    return from_rows([forbidden, trigger], rows, alphabet=alphabet, name=name)

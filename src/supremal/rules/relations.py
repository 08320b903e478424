"""What needs something else to happen: before it, after it, or ever.

===================  ===========================  ======================  =======================
                     effect after a cause         reaction to a trigger   both
===================  ===========================  ======================  =======================
some time            `precedence`                 `response`              `succession`
none of it between   `alternate_precedence`       `alternate_response`    `alternate_succession`
directly             `chain_precedence`           `chain_response`        `chain_succession`
===================  ===========================  ======================  =======================

The left column forbids an event until it may happen; the middle one owes an event, and is satisfied where
nothing is owed.

Source: van der Aalst, Pesic, Schonenberg, "Declarative workflows: balancing between flexibility and support",
Computer Science - Research and Development 23 (2009), the relation templates of Declare; Di Ciccio, Mecella,
"On the discovery of declarative control flows for artful processes", ACM Trans. Manag. Inf. Syst. 5 (2015).
"""

from __future__ import annotations

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.rules._arguments import Events
from supremal.rules._pattern import pattern
from supremal.rules._table import from_rows


@pattern("If {trigger} happens, {partner} happens too, before or after.")
def responded_existence(trigger: Events, partner: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that where ``trigger`` happens, ``partner`` does too, at any time.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = responded_existence("buy", "pay", alphabet=Alphabet(("buy", "pay")))
    >>> rule.accepts(["pay", "buy"]), rule.accepts(["buy"]), rule.accepts([])
    (True, False, True)
    """
    rows = [
        [0, 1, 2],
        [1, 1, 2],  # the partner is owed
        [2, 2, 2],
    ]
    return from_rows([trigger, partner], rows, marked=[0, 2], alphabet=alphabet, name=name)


@pattern("No {effect} happens before the first {cause}.")
def precedence(cause: Events, effect: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``effect`` happens only once ``cause`` has happened.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = precedence("open", "enter", alphabet=Alphabet(("open", "enter")))
    >>> rule.accepts(["open", "enter", "enter"]), rule.run(["enter"])
    (True, -1)
    """
    return from_rows([cause, effect], [[0, 1, NONE], [1, 1, 1]], alphabet=alphabet, name=name)


@pattern("Every {trigger} is followed, sooner or later, by {reaction}.")
def response(trigger: Events, reaction: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that each ``trigger`` is followed by a ``reaction``; one may answer several.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = response("ask", "answer", alphabet=Alphabet(("ask", "answer")))
    >>> rule.accepts(["ask", "ask", "answer"]), rule.accepts(["answer", "ask"])
    (True, False)
    """
    rows = [
        [0, 1, 0],
        [1, 1, 0],  # a reaction is owed
    ]
    return from_rows([trigger, reaction], rows, marked=[0], alphabet=alphabet, name=name)


@pattern(
    "Every {trigger} is followed, sooner or later, by {reaction}, "
    "and no {reaction} happens before the first {trigger}."
)
def succession(trigger: Events, reaction: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that is both `response` and, with ``trigger`` as the cause, `precedence`.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = succession("order", "deliver", alphabet=Alphabet(("order", "deliver")))
    >>> rule.accepts(["order", "deliver", "deliver"]), rule.run(["deliver"]), rule.accepts(["order"])
    (True, -1, False)
    """
    rows = [
        [0, 1, NONE],
        [1, 1, 2],  # a reaction is owed
        [2, 1, 2],
    ]
    return from_rows([trigger, reaction], rows, marked=[0, 2], alphabet=alphabet, name=name)


@pattern("Every {effect} comes after {cause}, with no other {effect} in between.")
def alternate_precedence(cause: Events, effect: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that each ``effect`` has a ``cause`` of its own before it.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = alternate_precedence("ticket", "ride", alphabet=Alphabet(("ticket", "ride")))
    >>> rule.accepts(["ticket", "ticket", "ride"]), rule.run(["ticket", "ride", "ride"])
    (True, -1)
    """
    rows = [
        [0, 1, NONE],
        [1, 1, 0],  # the effect may happen once
    ]
    return from_rows([cause, effect], rows, alphabet=alphabet, name=name)


@pattern("Every {trigger} is followed, sooner or later, by {reaction}, with no other {trigger} in between.")
def alternate_response(trigger: Events, reaction: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that each ``trigger`` has a ``reaction`` of its own after it.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = alternate_response("lock", "unlock", alphabet=Alphabet(("lock", "unlock")))
    >>> rule.accepts(["lock", "unlock", "unlock"]), rule.run(["lock", "lock"]), rule.accepts(["lock"])
    (True, -1, False)
    """
    rows = [
        [0, 1, 0],
        [1, NONE, 0],  # a reaction is owed
    ]
    return from_rows([trigger, reaction], rows, marked=[0], alphabet=alphabet, name=name)


@pattern(
    "Every {trigger} is followed, sooner or later, by {reaction}, with no other {trigger} in between, "
    "and every {reaction} comes after {trigger}, with no other {reaction} in between."
)
def alternate_succession(
    trigger: Events, reaction: Events, *, alphabet: Alphabet, name: str = ""
) -> Automaton:
    """Return the rule that ``trigger`` and ``reaction`` happen by turns, and the last turn is a reaction's.

    Where the last reaction need not come, it is `alternation`.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = alternate_succession("up", "down", alphabet=Alphabet(("up", "down")))
    >>> rule.accepts(["up", "down"]), rule.run(["up", "down", "down"]), rule.accepts(["up"])
    (True, -1, False)
    """
    rows = [
        [0, 1, NONE],
        [1, NONE, 0],  # a reaction is owed
    ]
    return from_rows([trigger, reaction], rows, marked=[0], alphabet=alphabet, name=name)


@pattern("Every {effect} comes directly after {cause}.")
def chain_precedence(cause: Events, effect: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``effect`` happens only as the next event after ``cause``.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = chain_precedence("aim", "shoot", alphabet=Alphabet(("aim", "shoot", "rest")))
    >>> rule.accepts(["aim", "shoot", "aim"]), rule.run(["aim", "rest", "shoot"])
    (True, -1)
    """
    rows = [
        [0, 1, NONE],
        [0, 1, 0],  # a cause has just happened
    ]
    return from_rows([cause, effect], rows, alphabet=alphabet, name=name)


@pattern("Every {trigger} is followed at once by {reaction}.")
def chain_response(trigger: Events, reaction: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that the next event after ``trigger`` is ``reaction``.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = chain_response("alarm", "stop", alphabet=Alphabet(("alarm", "stop", "go")))
    >>> rule.accepts(["go", "alarm", "stop", "stop"]), rule.run(["alarm", "go"]), rule.accepts(["alarm"])
    (True, -1, False)
    """
    rows = [
        [0, 1, 0],
        [NONE, NONE, 0],  # a reaction is owed now
    ]
    return from_rows([trigger, reaction], rows, marked=[0], alphabet=alphabet, name=name)


@pattern(
    "Every {trigger} is followed at once by {reaction}, and every {reaction} comes directly after {trigger}."
)
def chain_succession(trigger: Events, reaction: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``trigger`` and ``reaction`` happen only as a pair, one right after the other.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> rule = chain_succession("take", "put", alphabet=Alphabet(("take", "put", "go")))
    >>> rule.accepts(["take", "put", "go"]), rule.run(["put"]), rule.run(["take", "go"])
    (True, -1, -1)
    """
    rows = [
        [0, 1, NONE],
        [NONE, NONE, 0],  # a reaction is owed now
    ]
    return from_rows([trigger, reaction], rows, marked=[0], alphabet=alphabet, name=name)

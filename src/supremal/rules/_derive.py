"""From derivatives to an automaton.

The derivative of a language K by an event σ is what may follow it: σ⁻¹K = {w : σw ∈ K}.  Where the texts of
a language (expressions, formulas) have derivatives that are texts again, the automaton is there already: its
states are the derivatives, σ leads from K to σ⁻¹K, and a state is marked iff its language has the empty word.

Events that no text tells apart have the same derivatives for ever, so one of each *class* of events is
derived by, and its column copied: a rule over 2,000 events costs no more than one over the few that it names.

Source: Brzozowski, "Derivatives of regular expressions", JACM 11 (1964); Owens, Reppy, Turon, "Regular-
expression derivatives re-examined", JFP 19 (2009), for the classes.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from dataclasses import replace
from typing import Final, TypeVar

import numpy as np

from supremal._arrays import Ints
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.minimise import minimise
from supremal.automata.reduce import trim
from supremal.errors import RuleError

MAX_STATES: Final = 10_000
"""The default bound on the states that a rule's text may unfold to, before they are minimised."""

Text = TypeVar("Text", bound=Hashable)


class Budget:
    """How many steps may still be taken for the rule ``name``."""

    def __init__(self, steps: int, name: str) -> None:
        self.left, self.name = steps, name

    def spend(self, steps: int) -> None:
        """Take ``steps``; a `RuleError` where there are not so many left."""
        self.left -= steps
        if self.left < 0:
            message = (
                f"rule {self.name!r} takes too many steps to unfold; split it into several rules, nest or "
                "count less, or raise max_states"
            )
            raise RuleError(message)


def event_classes(alphabet: Alphabet, sets: Iterable[frozenset[str]]) -> tuple[Ints, list[str]]:
    """Return the class of each event, ``int32 [E]``, and one event of each: classes tell ``sets`` apart.

    Examples
    --------
    >>> classes, first = event_classes(Alphabet(("a", "b", "c")), [frozenset("b")])
    >>> classes.tolist(), first
    ([0, 1, 0], ['a', 'b'])
    """
    distinct = list(dict.fromkeys(sets))
    holding: dict[str, list[int]] = {}
    for k, names in enumerate(distinct):
        for name in names:
            holding.setdefault(name, []).append(k)
    number: dict[tuple[int, ...], int] = {}
    first: list[str] = []
    classes = np.empty(len(alphabet), np.int32)
    for e, name in enumerate(alphabet.names):
        signature = tuple(holding.get(name, ()))
        if signature not in number:
            number[signature] = len(number)
            first.append(name)
        classes[e] = number[signature]
    return classes, first


def derived(
    start: Text,
    derive: Callable[[Text, int], Text],
    accepts: Callable[[Text], bool],
    *,
    alphabet: Alphabet,
    classes: Ints,
    name: str = "",
    max_states: int = MAX_STATES,
) -> Automaton:
    """Return the minimal partial automaton of the language of ``start``.

    Parameters
    ----------
    start
        A text; equal texts have to have equal languages, so that there are finitely many derivatives.
    derive
        The derivative of a text by a class of events.
    accepts
        Whether the empty word is in its language.
    alphabet, classes
        The events, and the class of each, ``int32 [E]``, numbered in the order of their first events.
    name
        What messages call the rule.
    max_states
        The most derivatives.

    Raises
    ------
    RuleError
        If there are more; the message names the rule.
    """
    number = {start: 0}
    queue = [start]
    rows: list[list[int]] = []
    kinds = range(int(classes.max(initial=-1)) + 1)
    for text in queue:  # grows while it is walked through
        row = []
        for kind in kinds:
            after = derive(text, kind)
            if after not in number:
                number[after] = len(queue)
                queue.append(after)
            row.append(number[after])
        rows.append(row)
        if len(queue) > max_states:
            message = (
                f"rule {name!r} unfolds to more than {max_states:,} states; make a bound in it smaller, "
                "split it into several rules, or raise max_states"
            )
            raise RuleError(message)
    table = np.array(rows, np.int32).reshape(len(rows), len(kinds))
    marked = np.fromiter(map(accepts, queue), np.bool_, len(queue))
    least = minimise(trim(Automaton(Alphabet(tuple(map(str, kinds))), table, marked)))
    delta = least.delta[:, classes]
    return replace(least, alphabet=alphabet, delta=delta, name=name)

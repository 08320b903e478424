"""What a rule says: its class, some of its words, and the events that it speaks of.

A rule means the language K that its automaton marks, and K̄ holds the prefixes of its words: what may happen
while it can still be kept.  K is a *safety* rule iff K = K̄: it forbids words, and is satisfied as long as no
forbidden one has happened.  It is a *progress* rule iff K̄ = Σ*: it forbids no word, since each can still be
made good, but owes something.  A *mixed* rule does both, and is one of each kind together:
K = K̄ ∩ (K ∪ Σ*∖K̄), where the first is its own closure, and that of the second is Σ*.

On finite words: a progress rule is never broken, only not satisfied yet.  So it has no force unless what is
unfinished must stay possible to finish, which is what *nonblocking* asks.

Events outside the alphabet of a rule do not touch it, and neither do those of its alphabet that may be put
into a word or taken out of it anywhere: in the least automaton of K, these loop on every state.

Source: Lamport, "Proving the correctness of multiprocess programs", IEEE Trans. Softw. Eng. 3 (1977);
Alpern, Schneider, "Defining liveness", Inf. Process. Lett. 21 (1985), and "Recognizing safety and liveness",
Distributed Computing 2 (1987), which are about infinite words and call progress liveness.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.minimise import minimise
from supremal.automata.reduce import complement, trim
from supremal.automata.words import Word, shortest_words

Class = Literal["safety", "progress", "mixed"]

MEANING: Final[dict[Class, str]] = {
    "safety": "it forbids words, and owes nothing",
    "progress": "it forbids no word, but owes something; without nonblocking it has no force",
    "mixed": "it forbids words, and owes something besides; without nonblocking only the first has force",
}
"""What each class means, in words."""


def classify(rule: Automaton) -> Class:
    r"""Tell whether ``rule`` forbids, owes, or both.

    Parameters
    ----------
    rule
        What it marks, K, is what it means.

    Returns
    -------
    "safety", "progress" or "mixed"
        *safety* iff K = K̄, the prefix closure: nothing that may happen leaves it unsatisfied.  *progress* iff
        K̄ = Σ* and K is not: every word can still be made good, so that without nonblocking the rule has no
        force.  *mixed* otherwise.  Σ* and ∅ count as safety.

    Notes
    -----
    Linear in the table.  See the module for the theory and its source.

    Examples
    --------
    >>> from supremal import from_text
    >>> classify(from_text("0 -a-> 1 \n 1 -b-> 0"))
    'safety'
    >>> classify(from_text("marked 1 \n 0 -a-> 1 \n 0 -b-> 0 \n 1 -a, b-> 1"))
    'progress'
    >>> classify(from_text("marked 0 \n 0 -a-> 1 \n 1 -b-> 0"))
    'mixed'
    """
    closure = trim(rule)
    if closure.marked.all():
        return "safety"
    return "progress" if (closure.delta != NONE).all() else "mixed"


@dataclass(frozen=True, slots=True)
class Examples:
    """The shortest words that a rule accepts, and the shortest that it does not."""

    accepted: tuple[Word, ...]
    rejected: tuple[Word, ...]


def example_words(rule: Automaton, count: int = 3) -> Examples:
    r"""Return the ``count`` shortest words in K and the ``count`` shortest that are not.

    They are words over the rule's alphabet, the shortest first, those of one length in its order.

    Parameters
    ----------
    rule
        What it marks is K.
    count
        How many words of each kind; fewer come back where there are fewer.

    Raises
    ------
    AutomatonError
        If ``count`` is negative.

    Notes
    -----
    Time and memory at most count·S·E, whatever the length of the words.

    Examples
    --------
    >>> from supremal import from_text
    >>> example_words(from_text("0 -a-> 1 \n 1 -b-> 0"), 2)
    Examples(accepted=((), ('a',)), rejected=(('b',), ('a', 'a')))
    """
    accepted, rejected = shortest_words(rule, count), shortest_words(complement(rule), count)
    return Examples(tuple(accepted), tuple(rejected))


def essence(rule: Automaton) -> Automaton:
    r"""Return the least automaton that marks K, over no events but those that matter to it.

    Two rules say the same iff their essences are the same up to the order of events; the essence of Σ* has
    one state and no event, that of ∅ no state.

    Notes
    -----
    Time S·E·log S.

    Examples
    --------
    >>> from supremal import from_text
    >>> essence(from_text("0 -a-> 1 \n 1 -b-> 0 \n 0 -c-> 0 \n 1 -c-> 1"))
    <Automaton: 2 states, 2 transitions, 2 events>
    """
    least = minimise(trim(rule))
    sigma = least.alphabet
    matters = (least.delta != np.arange(least.n_states)[:, None]).any(axis=0)
    names = sigma.spell(np.flatnonzero(matters).tolist())
    kept = Alphabet(names, sigma.uncontrollable & set(names), sigma.unobservable & set(names))
    return Automaton(kept, least.delta[:, matters], least.marked, name=least.name)


def events_that_matter(rule: Automaton) -> tuple[str, ...]:
    r"""Return the events that ``rule`` is not indifferent to, in the order of its alphabet.

    All others may be put into a word or taken out of it anywhere, and it is in K as it was.  A rule that
    accepts all words, or none, is indifferent to all.

    Examples
    --------
    >>> from supremal import from_text
    >>> events_that_matter(from_text("0 -a-> 1 \n 1 -b-> 0 \n 0 -c-> 0 \n 1 -c-> 1"))
    ('a', 'b')
    """
    return essence(rule).alphabet.names


def is_touched(rule: Automaton, event: str) -> bool:
    """Tell whether ``event`` matters to ``rule``; one that is not in its alphabet does not."""
    return event in essence(rule).alphabet

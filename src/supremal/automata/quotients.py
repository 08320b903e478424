"""What is left of a language: after a word, before a word, read backwards, or woven into another.

- The left quotient s⁻¹L = {t : st ∈ L} is what can still come after s.
- The right quotient L/M = {s : st ∈ L for some t ∈ M} is what has come before a word of M.
- The mirror image of a word is the word read backwards.
- The shuffle of two languages over disjoint alphabets is all ways to run them side by side.

Source: Hopcroft, Ullman, *Introduction to Automata Theory, Languages, and Computation* (1979), section 3.2;
Brzozowski, "Canonical regular expressions and minimal state graphs for definite events" (1962), for reversal.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs, frozen
from supremal._hash import grow
from supremal._jit import kernel
from supremal.automata.alphabet import union
from supremal.automata.automaton import Automaton
from supremal.automata.build import empty
from supremal.automata.compose import sync
from supremal.automata.preimages import preimages
from supremal.automata.reduce import breadth_first, trim
from supremal.automata.subsets import subset_automaton
from supremal.errors import AlphabetError


def quotient(automaton: Automaton, by: Iterable[str]) -> Automaton:
    r"""Return the left quotient of both languages by the word ``by``: what can come after it.

    The empty automaton where ``by`` is not possible.  States are in breadth-first order from the one that
    ``by`` leads to; they keep their names and origins.

    Raises
    ------
    AlphabetError
        If the word has an event that is not in the alphabet.

    Notes
    -----
    Linear in the transitions and the length of the word.

    Examples
    --------
    >>> from supremal import from_text, quotient
    >>> quotient(from_text("0 -a-> 1 \n 1 -b-> 2 \n 2 -a-> 0"), ["a", "b"]).state_names
    ('2', '0', '1')
    """
    state = automaton.run(by)
    if state == NONE:
        return empty(automaton.alphabet, name=automaton.name)
    return breadth_first(automaton, state)


def right_quotient(automaton: Automaton, other: Automaton) -> Automaton:
    r"""Return ``automaton`` marked where a word of Lm(other) leads to a marked state: Lm(a) / Lm(other).

    It generates L(a) as before; `trim` it for the prefixes of the quotient alone.

    Raises
    ------
    AlphabetError
        If an event is controllable in one and not in the other.

    Notes
    -----
    Backwards from the pairs of marked states, time S·S'·E for the S' states of ``other``, memory S·S' bytes
    and eight for every pair that is found.

    Examples
    --------
    >>> from supremal import from_text, right_quotient
    >>> batch = from_text("marked 3 \n 0 -a-> 1 \n 1 -b-> 2 \n 2 -b-> 3")
    >>> right_quotient(batch, from_text("0 -b-> 0")).marked.tolist()
    [False, True, True, True]
    """
    union(automaton.alphabet, other.alphabet)
    part = trim(other)
    shared = [name for name in automaton.alphabet if name in other.alphabet]
    found = _before(
        *preimages(
            frozen(automaton.delta[:, [automaton.alphabet.index(name) for name in shared]], np.int32, 2)
        ),
        *preimages(frozen(part.delta[:, [other.alphabet.index(name) for name in shared]], np.int32, 2)),
        np.flatnonzero(automaton.marked),
        np.flatnonzero(part.marked),
        automaton.n_states,
        part.n_states,
    )
    return replace(automaton, marked=found)


def reverse_language(automaton: Automaton) -> Automaton:
    r"""Return the automaton that marks the words of Lm read backwards, and generates their prefixes.

    It has the fewest states that such an automaton can have: the subset construction on a reversed
    deterministic automaton always gives the least one (Brzozowski).

    Raises
    ------
    AutomatonError
        If the sets of states do not fit the machine.

    Notes
    -----
    Up to 2^S states; time is linear in the transitions into the members of all the sets that are reached.

    Examples
    --------
    >>> from supremal import from_text, reverse_language
    >>> mirror = reverse_language(from_text("marked 2 \n 0 -a-> 1 \n 1 -b-> 2 \n 1 -c-> 2"))
    >>> mirror.accepts(["b", "a"]), mirror.accepts(["c", "a"]), mirror.accepts(["a", "b"])
    (True, True, False)
    """
    part = trim(automaton)
    first = np.zeros(part.n_states, np.bool_)
    first[:1] = True
    silent = np.zeros(part.n_states + 1, np.int64), np.empty(0, np.int32)
    return subset_automaton(
        part.alphabet, preimages(part.delta), silent, part.marked, first, name=automaton.name
    )


def shuffle(*parts: Automaton, max_states: int | None = None) -> Automaton:
    r"""Return all interleavings of ``parts``, which share no event: `sync` that says so where they do.

    Parameters
    ----------
    parts
        With alphabets that are disjoint.
    max_states
        The most states that the result may have; left out: what fits the machine.

    Raises
    ------
    AlphabetError
        If an event is in two alphabets; names it.
    AutomatonError
        If the result would have more than ``max_states`` states.

    Examples
    --------
    >>> from supremal import from_text, shuffle
    >>> shuffle(from_text("0 -a-> 1"), from_text("0 -b-> 1 \n 1 -c-> 2")).n_states
    6
    """
    owner: dict[str, int] = {}
    for k, part in enumerate(parts):
        for name in part.alphabet:
            if owner.setdefault(name, k) != k:
                one, two = (parts[i].name or f"part {i}" for i in (owner[name], k))
                message = (
                    f"event {name!r} is in both {one} and {two}, and a shuffle is of disjoint alphabets; "
                    "rename it in one of them (relabel), or use sync if they share it on purpose"
                )
                raise AlphabetError(message)
    return sync(*parts, max_states=max_states)


@kernel
def _before(
    start_a: Longs,
    source_a: Ints,
    start_b: Longs,
    source_b: Ints,
    goals_a: Longs,
    goals_b: Longs,
    states_a: int,
    states_b: int,
) -> Bools:
    """Return from which states of a some word leads to a goal of a, and in b from state 0 to a goal of b."""
    events = (start_a.shape[0] - 1) // max(states_a, 1)
    seen = np.zeros((states_a, states_b), np.bool_)
    pairs = np.empty(1024, np.int64)
    count = 0
    for a in goals_a:
        for b in goals_b:
            seen[a, b] = True
            if count == pairs.shape[0]:
                pairs = grow(pairs)
            pairs[count] = a * states_b + b
            count += 1
    while count > 0:
        count -= 1
        row_a = pairs[count] // states_b * events
        row_b = pairs[count] % states_b * events
        for e in range(events):
            for i in range(start_a[row_a + e], start_a[row_a + e + 1]):
                for j in range(start_b[row_b + e], start_b[row_b + e + 1]):
                    a, b = np.int64(source_a[i]), source_b[j]
                    if seen[a, b]:
                        continue
                    seen[a, b] = True
                    if count == pairs.shape[0]:
                        pairs = grow(pairs)
                    pairs[count] = a * states_b + b
                    count += 1
    found = np.zeros(states_a, np.bool_)
    if states_b > 0:
        for a in range(states_a):
            found[a] = seen[a, 0]
    return found

r"""The words that an automaton marks: listed, counted, drawn, the shortest first.

Let N(q, k) be how many words of length k lead from q to a marked state.  N(q, 0) is 1 where q is marked and 0
elsewhere, and N(q, k + 1) = Σₑ N(δ(q, e), k).  Where N(q, k) is 0 no word of length k is worth looking for,
which is what keeps a listing from dead ends; and choosing event e with probability
N(δ(q, e), k) / N(q, k + 1) in each step makes all words of a length equally likely.

Counts grow like a power of the length and soon pass 64 bits; they are kept exact as digits to base 2^32.

Source: Bernardi, Giménez, "A linear algorithm for the random sampling from regular languages", Algorithmica
62 (2012), for counting and drawing.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._hash import grow
from supremal._jit import kernel
from supremal.automata.automaton import Automaton
from supremal.automata.reduce import trim
from supremal.errors import AutomatonError

Word = tuple[str, ...]


def words(automaton: Automaton, length: int) -> Iterator[Word]:
    r"""Return an iterator of the marked words of exactly this ``length``, in the order of the alphabet.

    Raises
    ------
    AutomatonError
        If ``length`` is negative.

    Notes
    -----
    Lazy: what is not asked for is not computed, and no dead end is entered, so each word costs at most
    length·E steps.  To begin with, time length·S·E and length·S bytes are needed.

    Examples
    --------
    >>> from supremal import from_text, words
    >>> turns = from_text("marked 0 \n 0 -a, b-> 1 \n 1 -a-> 0 \n 1 -b-> 2")
    >>> list(words(turns, 2)), list(words(turns, 3))
    ([('a', 'a'), ('b', 'a')], [])
    """
    _check("the length of a word", length)
    part = trim(automaton)
    alive = [part.marked]
    while len(alive) <= length and alive[-1].any():
        before = np.append(alive[-1], np.False_)  # the last entry stands for NONE
        alive.append(np.any(before[part.delta], axis=1))
    if len(alive) <= length or not alive[length][:1].any():
        return iter(())
    return _walk(part, alive)


def count_words(automaton: Automaton, length: int) -> int:
    r"""Return how many words of exactly this ``length`` are marked: an exact integer, however large.

    Raises
    ------
    AutomatonError
        If ``length`` is negative.

    Notes
    -----
    Time length·S·E, times the digits of the counts, of which there are at most 1 + length·log2(E)/32.

    Examples
    --------
    No two b in a row: the Fibonacci numbers.

    >>> from supremal import count_words, from_text
    >>> rule = from_text("0 -a-> 0 \n 0 -b-> 1 \n 1 -a-> 0")
    >>> [count_words(rule, n) for n in range(8)], count_words(rule, 100)
    ([1, 2, 3, 5, 8, 13, 21, 34], 927372692193078999176)
    """
    _check("the length of a word", length)
    part = trim(automaton)
    counts = _counts_of_none(part)
    for _ in range(length):
        counts = _counts_of_one_more(part, counts)
    return _number(counts, 0)


def sample_word(automaton: Automaton, length: int, seed: int) -> Word | None:
    r"""Return one of the marked words of exactly this ``length``, each as likely as any other.

    Parameters
    ----------
    automaton
        Whose words.
    length
        How many events the word shall have.
    seed
        Settles the draw: the same seed draws the same word.

    Returns
    -------
    tuple of str, or None
        None where no word of this length is marked.

    Raises
    ------
    AutomatonError
        If ``length`` is negative.

    Notes
    -----
    One number below `count_words` is drawn, which is exactly uniform, and the word of that number in the
    order of the alphabet is spelled.  Time as of `count_words`; all the counts on the way are kept.

    Examples
    --------
    >>> from supremal import from_text, sample_word
    >>> rule = from_text("0 -a-> 0 \n 0 -b-> 1 \n 1 -a-> 0")
    >>> "".join(sample_word(rule, 12, seed=1))
    'babaaabaaaab'
    """
    _check("the length of a word", length)
    part = trim(automaton)
    counts = [_counts_of_none(part)]
    for _ in range(length):
        counts.append(_counts_of_one_more(part, counts[-1]))
    total = _number(counts[length], 0)
    if total == 0:
        return None
    rest = _below(total, np.random.default_rng(seed))
    state, word = 0, list[str]()
    for left in reversed(counts[:length]):
        for name, to in zip(part.alphabet, part.delta[state].tolist(), strict=True):
            found = _number(left, to) if to != NONE else 0
            if rest < found:
                word.append(name)
                state = to
                break
            rest -= found
    return tuple(word)


def shortest_words(automaton: Automaton, n: int) -> list[Word]:
    r"""Return the ``n`` shortest marked words, those of one length in the order of the alphabet.

    Fewer where the language has fewer.

    Raises
    ------
    AutomatonError
        If ``n`` is negative.

    Notes
    -----
    Breadth-first over words instead of states, but no state is entered more than n times: a word that passes
    a state after n others have would come after theirs.  Time and memory at most n·S·E.

    Examples
    --------
    >>> from supremal import from_text, shortest_words
    >>> shortest_words(from_text("marked 0 \n 0 -a, b-> 1 \n 1 -a-> 0"), 4)
    [(), ('a', 'a'), ('b', 'a'), ('a', 'a', 'a', 'a')]
    """
    _check("a number of words", n)
    part = trim(automaton)
    if n == 0 or not part.n_states:
        return []
    ends, parent, event = _shortest(part.delta, part.marked, n)
    found = []
    for node in ends:
        word = []
        while node != 0:
            word.append(event[node])
            node = parent[node]  # noqa: PLW2901 - it climbs
        found.append(part.alphabet.spell(reversed(word)))
    return found


def _check(what: str, number: int) -> None:
    if number < 0:
        message = f"{what} is {number}; 0 or more is needed"
        raise AutomatonError(message)


def _walk(part: Automaton, alive: list[Bools]) -> Iterator[Word]:
    """Depth first from state 0 through the states that are ``alive`` for what is left of the length."""
    length = len(alive) - 1

    def choices(state: int, left: int) -> Iterator[tuple[str, int]]:
        row = part.delta[state]
        useful = np.flatnonzero((row != NONE) & alive[left - 1][row])
        return zip(part.alphabet.spell(useful.tolist()), row[useful].tolist(), strict=True)

    word: list[str] = []
    stack = [choices(0, length)] if length else []
    if not length:
        yield ()
    while stack:
        step = next(stack[-1], None)
        if step is None:
            stack.pop()
            del word[-1:]
        elif len(stack) == length:
            yield (*word, step[0])
        else:
            word.append(step[0])
            stack.append(choices(step[1], length - len(word)))


def _counts_of_none(part: Automaton) -> Longs:
    """Return N(·, 0), ``int64 [S, D]``: the digits to base 2^32, the lowest first."""
    return part.marked.astype(np.int64)[:, None]


def _counts_of_one_more(part: Automaton, counts: Longs) -> Longs:
    """Return N(·, k + 1) for ``counts`` N(·, k)."""
    if counts[:, -1].any():  # one more digit holds the sum of any number of events below 2^31
        counts = np.pad(counts, ((0, 0), (0, 1)))
    return _add_up(part.delta, counts)


@kernel
def _add_up(delta: Ints, counts: Longs) -> Longs:
    """Return Σₑ counts[δ(·, e)], digit by digit, with the carries."""
    states, events = delta.shape
    digits = counts.shape[1]
    total = np.zeros((states, digits), np.int64)
    for s in range(states):
        for e in range(events):
            if delta[s, e] != NONE:
                for d in range(digits):
                    total[s, d] += counts[delta[s, e], d]
        for d in range(digits - 1):
            total[s, d + 1] += total[s, d] >> 32
            total[s, d] &= 0xFFFFFFFF
    return total


def _number(counts: Longs, state: int) -> int:
    """Return the count of ``state`` as one integer; 0 of a state that is not there."""
    digits = counts[state : state + 1].astype("<u4")
    return int.from_bytes(digits.tobytes(), "little")


def _below(total: int, rng: np.random.Generator) -> int:
    """Draw an integer from 0 to ``total`` - 1: as many random bits as it has, until they fit."""
    bits = total.bit_length()
    while True:
        number = int.from_bytes(rng.bytes(-(-bits // 8)), "little") >> (-bits % 8)
        if number < total:
            return number


@kernel
def _shortest(delta: Ints, marked: Bools, n: int) -> tuple[Longs, Longs, Ints]:
    """Return the nodes of the n shortest words, and of each node its parent and the event that leads to it.

    A node is a word: node 0 the empty one, from then on in the order of length and alphabet.
    """
    states, events = delta.shape
    visits = np.zeros(states, np.int64)
    state = np.zeros(1024, np.int32)
    parent = np.zeros(1024, np.int64)
    event = np.zeros(1024, np.int32)
    ends = np.zeros(16, np.int64)
    found = 0
    visits[0] = 1
    count = 1
    head = 0
    while head < count and found < n:
        s = state[head]
        if marked[s]:
            if found == ends.shape[0]:
                ends = grow(ends)
            ends[found] = head
            found += 1
        for e in range(events):
            t = delta[s, e]
            if t == NONE or visits[t] == n:
                continue
            if count == state.shape[0]:
                state, parent, event = grow(state), grow(parent), grow(event)
            visits[t] += 1
            state[count] = t
            parent[count] = head
            event[count] = e
            count += 1
        head += 1
    return ends[:found].copy(), parent[:count].copy(), event[:count].copy()

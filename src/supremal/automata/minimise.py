"""The least automaton that does the same.

Two states are equivalent when every word is possible from both or from neither, and leads from both to marked
states or from neither: q ~ r iff L(q) = L(r) and Lm(q) = Lm(r).  With one state for each class the automaton
has the same two languages, and no deterministic automaton that has them has fewer states (Myhill, Nerode).

The classes come out of refining a partition: whatever can be told apart is.  A *splitter* is a block B that
tells s from t by event e, because δ(s, e) lies in B and δ(t, e) does not.  When a block falls into two, the
smaller part alone has to be tried as a splitter, since what the larger one could tell, the two together did
before.  So a state is in a splitter at most log2 S times, and all is done in time S·E·log S (Hopcroft).
Where an event is not possible it leads, in thought, to one more state, the sink, which is in a block of its
own and the first splitter of all.

Source: Hopcroft, "An n log n algorithm for minimizing states in a finite automaton" (1971); Gries,
"Describing an algorithm by Hopcroft", Acta Informatica 2 (1973); Valmari, "Fast brief practical DFA
minimization", Inf. Process. Lett. 112 (2012), for the partition in arrays.
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._jit import kernel
from supremal.automata.automaton import Automaton
from supremal.automata.preimages import preimages
from supremal.automata.reduce import breadth_first


def minimise(automaton: Automaton) -> Automaton:
    r"""Return the automaton with the fewest states that generates and marks the same words.

    Two automata with the same alphabet and the same two languages become the same table, state by state: a
    state stands for the words that lead to it, and they are numbered in the order of the first of these,
    the shortest first.  ``minimise(trim(a))`` is the least automaton for the marked language alone.

    Notes
    -----
    Time S·E·log S, memory about 20 bytes an entry of the table.  See the module for the theory.

    Examples
    --------
    >>> from supremal import from_text, minimise
    >>> twice = from_text("marked off off2 \n off -go-> on \n on -stop-> off2 \n off2 -go-> on")
    >>> minimise(twice).delta.tolist()
    [[1, -1], [-1, 0]]
    """
    part = breadth_first(automaton)
    block = equivalence(part)
    number = np.append(block, np.int32(NONE))  # the last entry renames NONE to itself
    member = np.zeros(number.max(initial=NONE) + 1, np.int32)
    member[block] = np.arange(part.n_states)
    least = Automaton(part.alphabet, number[part.delta[member]], part.marked[member], name=part.name)
    return breadth_first(least, int(block[0]) if block.size else 0)


def equivalence(automaton: Automaton) -> Ints:
    r"""Return the class of each state, ``int32 [S]``: states of one number are equivalent.

    Unreachable states have a class as well.  Time S·E·log S.

    Examples
    --------
    >>> from supremal import from_text
    >>> equivalence(from_text("0 -a-> 1 \n 1 -a-> 1 \n 2 -b-> 1")).tolist()
    [0, 0, 1]
    """
    start, source = preimages(automaton.delta)
    return _refine(automaton.delta, automaton.marked, start, source)


@kernel
def _pick(s: int, elems: Ints, place: Ints, block: Ints, bound: Ints, hit: Ints, hits: int) -> int:
    """Move state ``s`` to the picked ones, at the front of its block; ``hit`` lists the blocks with any."""
    b = block[s]
    first, mid, end = bound[b, 0], bound[b, 1], bound[b, 2]
    if end - first == 1:  # nothing to split: most blocks, towards the end
        return hits
    if mid == first:
        hit[hits] = b
        hits += 1
    here, other = place[s], elems[mid]
    elems[here], place[other] = other, here
    elems[mid], place[s] = s, mid
    bound[b, 1] = mid + 1
    return hits


@kernel
def _split(hit: Ints, hits: int, elems: Ints, block: Ints, bound: Ints, blocks: int) -> int:
    """Part the picked states of each block from the others; the smaller part becomes a new block."""
    for i in range(hits):
        b = hit[i]
        first, mid, end = bound[b, 0], bound[b, 1], bound[b, 2]
        bound[b, 1] = first
        if mid == end:
            continue
        if mid - first <= end - mid:
            bound[b, 0] = bound[b, 1] = mid
            end = mid
        else:
            bound[b, 2] = mid
            first = mid
        bound[blocks, 0] = bound[blocks, 1] = first
        bound[blocks, 2] = end
        for k in range(first, end):
            block[elems[k]] = blocks
        blocks += 1
    return blocks


@kernel
def _refine(delta: Ints, marked: Bools, start: Longs, source: Ints) -> Ints:
    """Return the coarsest partition that is stable, ``int32 [S]``; ``start, source`` are the `preimages`.

    ``bound [b]`` is (first, mid, end): block b is ``elems[first:end]``, of which those before mid are picked.
    New blocks are the smaller parts, so all but block 0 are splitters, each once, in the order in which they
    came.
    """
    states, events = delta.shape
    elems = np.arange(states).astype(np.int32)
    place = elems.copy()
    block = np.zeros(states, np.int32)
    bound = np.zeros((states, 3), np.int32)
    bound[:1, 2] = states
    hit = np.empty(states, np.int32)
    blocks = min(states, 1)
    for e in range(-1, events):  # the marked states, then the sink as a splitter
        hits = 0
        for s in range(states):
            if marked[s] if e < 0 else delta[s, e] == NONE:
                hits = _pick(s, elems, place, block, bound, hit, hits)
        blocks = _split(hit, hits, elems, block, bound, blocks)
    splitter = np.empty(states, np.int32)
    b = 1
    while b < blocks < states:  # once every state is alone, nothing is left to tell apart
        size = bound[b, 2] - bound[b, 0]
        splitter[:size] = elems[bound[b, 0] : bound[b, 2]]  # a copy: the block may be split by itself
        for e in range(events):
            hits = 0
            for i in range(size):
                row = splitter[i] * np.int64(events) + e
                for k in range(start[row], start[row + 1]):
                    hits = _pick(source[k], elems, place, block, bound, hit, hits)
            blocks = _split(hit, hits, elems, block, bound, blocks)
        b += 1
    return block

"""Small supervisors, and local ones, that do the same to the plant.

A supervisor S may have far fewer states than the supervised behaviour it was read off, as it need not know
what the plant knows by itself.  Each state x of S has four indicators:

- E(x), the events that S enables in x, and D(x), those that it disables, among those that the plant can do in
  some state in which it can be while S is in x;
- T(x), whether the plant can be in a marked state there, and M(x), whether S marks x.

States x, x' are consistent iff E(x) ∩ D(x') = E(x') ∩ D(x) = ∅, and M(x) = M(x') if T(x) and T(x').  A
*control congruence* is a partition of the states into cells of pairwise consistent states such that an event
leads from all members of a cell into one cell.  With one state for each cell the supervisor is *control
equivalent*: plant and supervisor together generate and mark the same words.

The least congruence is NP-hard to find.  Here cells are merged two by two, with all that their merging forces
upon their successors, and a merger that comes to a contradiction is undone.  What comes out is maximal: no
two cells can be merged any more.  How small it is depends on the order in which mergers are tried, so a few
orders are, and the smallest result is taken.

The same with E(x) and D(x) cut down to the events that one agent controls gives this agent a local
controller, which disables none of the others' events.  Together these are control equivalent to S.

Source: Su, Wonham, "Supervisor reduction for discrete-event systems", Discrete Event Dynamic Systems 14
(2004); Cai, Wonham, "Supervisor localization: a top-down approach to distributed control of discrete-event
systems", IEEE Trans. Automatic Control 55 (2010).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._jit import kernel
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.build import empty
from supremal.automata.explore import as_parts, explore
from supremal.automata.reduce import breadth_first
from supremal.errors import AutomatonError
from supremal.synthesis._plants import possible
from supremal.synthesis.supervisor import Supervisor

ENABLED: Final = 1
DISABLED: Final = 2
Bits: TypeAlias = NDArray[np.int8]


def reduce_supervisor(plant: Automaton | Sequence[Automaton], supervisor: Supervisor) -> Automaton:
    r"""Return a small automaton that is control equivalent to ``supervisor`` with respect to ``plant``.

    `sync` of the plant and it has both languages of ``supervisor.automaton``.  Its alphabet has only the
    events that it listens to.  Those that are not observable are not among them if the supervisor can do
    without, as that of `synthesize_normal` can unless it marks one of two words that look alike.

    Parameters
    ----------
    plant
        What can happen: one automaton, or several that run side by side.
    supervisor
        A supervisor of it.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another.

    Notes
    -----
    Tries to merge S² pairs of states, each of which costs E and, where it gets further, up to S E.
    Supervisors of a few thousand states take seconds.

    Examples
    --------
    >>> from supremal import from_text, synthesize
    >>> from supremal.synthesis.reduction import reduce_supervisor
    >>> machine = "marked idle \n uncontrollable end{0} \n idle -start{0}-> busy \n busy -end{0}-> idle"
    >>> machines = [from_text(machine.format(k)) for k in range(2)]
    >>> buffer = from_text("marked 0 \n uncontrollable end0 \n 0 -end0-> 1 \n 1 -start1-> 0")
    >>> supervisor = synthesize(machines, buffer)
    >>> supervisor.automaton.n_states, reduce_supervisor(machines, supervisor).n_states
    (6, 2)
    """
    if supervisor.is_empty:
        return empty(supervisor.automaton.alphabet)
    plants = as_parts(plant)
    return _smallest(plants, supervisor.automaton, _indicators(plants, supervisor.automaton))


def localise(agents: Sequence[Automaton], supervisor: Supervisor) -> tuple[Automaton, ...]:
    r"""Return a local controller for each of ``agents``, which together do what ``supervisor`` does.

    A controller disables only events that its agent controls, and listens to what it has to know of the
    others.  An agent that has nothing to do gets an automaton without events.

    Parameters
    ----------
    agents
        The plants, side by side.
    supervisor
        A supervisor of them.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another.
    AutomatonError
        If the supervisor disables an event that no agent controls: one that only the specification knows, or
        a tick that is pre-empted.

    Notes
    -----
    As `reduce_supervisor`, for each agent.

    Examples
    --------
    >>> from supremal import from_text, synthesize
    >>> from supremal.synthesis.reduction import localise
    >>> machine = "marked idle \n uncontrollable end{0} \n idle -start{0}-> busy \n busy -end{0}-> idle"
    >>> machines = [from_text(machine.format(k)) for k in range(2)]
    >>> buffer = from_text("marked 0 \n uncontrollable end0 \n 0 -end0-> 1 \n 1 -start1-> 0")
    >>> [local.n_states for local in localise(machines, synthesize(machines, buffer))]
    [2, 2]
    """
    behaviour = supervisor.automaton
    if supervisor.is_empty:
        return tuple(empty(behaviour.alphabet) for _ in agents)
    need = _indicators(agents, behaviour)
    names = behaviour.alphabet.names
    owned = [{n for n in agent.alphabet if n not in agent.alphabet.uncontrollable} for agent in agents]
    for name, disabled in zip(names, np.any(need[:, :-1] & DISABLED, axis=0), strict=True):
        if disabled and not any(name in own for own in owned):
            message = (
                f"the supervisor disables event {name!r}, which none of the {len(agents)} agents controls"
            )
            raise AutomatonError(message)
    keeps = [np.array([*(name in own for name in names), True]) for own in owned]
    return tuple(_smallest(agents, behaviour, np.where(keep, need, np.int8(0))) for keep in keeps)


def _indicators(plants: Sequence[Automaton], behaviour: Automaton) -> Bits:
    """Return the indicators of each state as bits, ``int8 [S, E + 1]``.

    Marking is like one more event: enabled where plant and supervisor mark, disabled where the plant does and
    the supervisor does not.
    """
    graph = explore([*plants, behaviour])
    x = graph.states[:, -1]
    can = possible(plants, graph.states, behaviour.alphabet)
    done = np.all(
        [np.ones(len(x), np.bool_), *(p.marked[graph.states[:, k]] for k, p in enumerate(plants))], axis=0
    )
    can = np.column_stack([can, done])
    does = np.column_stack([behaviour.delta != NONE, behaviour.marked])[x]
    need = np.zeros((behaviour.n_states, can.shape[1]), np.int8)
    for e in range(can.shape[1]):
        need[x[can[:, e] & does[:, e]], e] |= ENABLED
        need[x[can[:, e] & ~does[:, e]], e] |= DISABLED
    return need


def _smallest(plants: Sequence[Automaton], behaviour: Automaton, need: Bits) -> Automaton:
    """Return the smallest of the quotients by the congruences that are tried."""
    known = {name for plant in plants for name in plant.alphabet}
    hidden = np.array([name in behaviour.alphabet.unobservable for name in behaviour.alphabet], np.bool_)
    found = [
        _quotient(behaviour, need, _merge_all(order, behaviour.delta, need, hidden, column), known)
        for order in _orders(behaviour, need)
        for column in (True, False)
    ]
    return min(found, key=lambda small: (small.n_states, len(small.alphabet)))


def _orders(behaviour: Automaton, need: Bits) -> Iterator[Longs]:
    """Yield the orders in which mergers are tried."""
    yield np.arange(behaviour.n_states)
    yield np.argsort(-np.count_nonzero(need & ENABLED, axis=1), kind="stable")
    yield np.lexsort(behaviour.origin.T[::-1])
    patterns, which, many = np.unique(need, axis=0, return_inverse=True, return_counts=True)
    swapped = (patterns >> 1 & ENABLED) | (patterns << 1 & DISABLED)
    rivals = np.array([many[np.any(patterns & row, axis=1)].sum() for row in swapped])
    yield np.argsort(-rivals[which.reshape(-1)], kind="stable")


def _quotient(behaviour: Automaton, need: Bits, cell: Longs, known: set[str]) -> Automaton:
    """Return the automaton with a state for each cell; ``cell [S]`` is one member for all of a cell."""
    alphabet = behaviour.alphabet
    _, number = np.unique(cell, return_inverse=True)
    cells, events = int(number.max()) + 1, len(alphabet)
    delta = np.full((cells, events), NONE, np.int32)
    s, e = np.nonzero(behaviour.delta != NONE)
    delta[number[s], e] = number[behaviour.delta[s, e]]
    needs = np.zeros((cells, events + 1), np.int8)
    np.bitwise_or.at(needs, number, need)
    itself = np.arange(cells)[:, None]
    # What cannot happen in any member is allowed, and changes nothing: it may not have to be listened to.
    delta = np.where((delta == NONE) & (needs[:, :-1] & DISABLED == 0), itself, delta)
    heard = np.any(delta != itself, axis=0) | np.array([name not in known for name in alphabet], np.bool_)
    names = tuple(alphabet.names[e] for e in np.flatnonzero(heard))
    heard_alphabet = Alphabet(names, alphabet.uncontrollable & {*names}, alphabet.unobservable & {*names})
    small = Automaton(heard_alphabet, delta[:, heard], needs[:, -1] & DISABLED == 0, name=behaviour.name)
    return breadth_first(small, int(number[0]))


# --- merging ----------------------------------------------------------------------------------------------


@kernel
def _cell(parent: Longs, s: int) -> int:
    """Return the root of the tree that is the cell of ``s``; no path is shortened, so it can be undone."""
    while parent[s] != s:
        s = parent[s]
    return s


@kernel
def _copy_row(source: NDArray[np.integer], i: int, target: NDArray[np.integer], j: int) -> None:
    """Copy row ``i`` of ``source`` to row ``j`` of ``target``; as a slice it would compile for seconds."""
    for e in range(source.shape[1]):
        target[j, e] = source[i, e]


@kernel
def _merge_all(order: Longs, delta: Ints, need: Bits, hidden: Bools, column: bool) -> Longs:  # noqa: FBT001 - a kernel
    """Return a congruence to which no merger can be added: ``cell [S]``, one member for all of a cell.

    First come states that a ``hidden`` event joins, then pairs of cells in ``order`` of their first states,
    ``column`` by column or row by row.
    """
    states, events = delta.shape
    parent, size, first = np.arange(states), np.ones(states, np.int64), np.empty(states, np.int64)
    next_, needs = delta.copy(), need.copy()
    todo = np.empty((states * (events + 1) + 1, 2), np.int64)
    pairs, old_first = np.empty((states, 2), np.int64), np.empty(states, np.int64)
    old_next, old_needs = delta.copy(), need.copy()
    for i in range(states):
        first[order[i]] = i
    for s in range(states):
        for e in range(events):
            if hidden[e] and delta[s, e] != NONE:
                a, b = _cell(parent, s), _cell(parent, delta[s, e])
                _merge(a, b, parent, size, first, next_, needs, todo, pairs, old_first, old_next, old_needs)
    for i in range(states):
        for j in range(i + 1, states) if column else range(i):
            a, b = _cell(parent, order[i]), _cell(parent, order[j])
            if first[a] != i:
                break
            if first[b] == j:
                _merge(a, b, parent, size, first, next_, needs, todo, pairs, old_first, old_next, old_needs)
    cell = np.empty(states, np.int64)
    for s in range(states):
        cell[s] = _cell(parent, s)
    return cell


@kernel
def _merge(
    a: int,
    b: int,
    parent: Longs,
    size: Longs,
    first: Longs,
    next_: Ints,
    needs: Bits,
    todo: Longs,
    pairs: Longs,
    old_first: Longs,
    old_next: Ints,
    old_needs: Bits,
) -> None:
    """Merge cells ``a`` and ``b`` and all that this forces, or leave everything as it was."""
    todo[0, 0], todo[0, 1] = a, b
    top, done = 1, 0
    while top > 0:
        top -= 1
        x, y = _cell(parent, todo[top, 0]), _cell(parent, todo[top, 1])
        if x == y:
            continue
        for e in range(needs.shape[1]):
            if needs[x, e] | needs[y, e] == ENABLED | DISABLED:
                top = NONE
        if top == NONE:
            break
        if size[x] < size[y]:
            x, y = y, x
        pairs[done, 0], pairs[done, 1], old_first[done] = x, y, first[x]
        _copy_row(next_, x, old_next, done)
        _copy_row(needs, x, old_needs, done)
        done += 1
        parent[y] = x
        size[x] += size[y]
        first[x] = min(first[x], first[y])
        for e in range(needs.shape[1]):
            needs[x, e] |= needs[y, e]
        for e in range(next_.shape[1]):
            if next_[x, e] == NONE:
                next_[x, e] = next_[y, e]
            elif next_[y, e] != NONE:
                todo[top, 0], todo[top, 1] = next_[x, e], next_[y, e]
                top += 1
    while top == NONE and done > 0:
        done -= 1
        x, y = pairs[done, 0], pairs[done, 1]
        parent[y], first[x] = y, old_first[done]
        size[x] -= size[y]
        _copy_row(old_next, done, next_, x)
        _copy_row(old_needs, done, needs, x)

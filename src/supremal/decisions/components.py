"""Strong components and end components: where a process can stay for ever.

The *strong components* of a graph are its largest sets of nodes that all reach one another.  Tarjan's
search finds them sinks first, so that every edge between two components leads to a smaller number: what lies
downstream, such as the next state of a reward machine, can be solved before what leads there.

An *end component* of a decision process is a set of states with a choice of actions that stays in it for
ever and goes everywhere in it.  Whatever the policy, the states seen infinitely often form one, with
probability 1.  The largest ones are disjoint: cut what leaves a strong component, and begin again.

Source: Tarjan, "Depth-first search and linear graph algorithms", SIAM J. Comput. 1 (1972); Baier, Katoen,
*Principles of Model Checking*, algorithm 47 and theorem 10.120.
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._jit import kernel


@kernel
def strong_components(start: Longs, target: Ints) -> Ints:
    """Return each node's strong component, ``int32 [S]``; edges between them lead to smaller numbers."""
    nodes = start.shape[0] - 1
    component = np.full(nodes, NONE, np.int32)
    found = np.zeros(nodes, np.int32)  # when a node was found, from 1; 0: not yet
    low = np.zeros(nodes, np.int32)  # the earliest node known to be reached, still without a component
    edge = start[:-1].copy()
    path, waiting = np.empty(nodes, np.int32), np.empty(nodes, np.int32)
    clock = components = depth = waits = 0
    for root in range(nodes):
        if found[root]:
            continue
        path[0] = root
        depth = 1
        while depth:
            s = path[depth - 1]
            if found[s] == 0:
                clock += 1
                found[s] = low[s] = clock
                waiting[waits] = s
                waits += 1
            deeper = False
            while edge[s] < start[s + 1]:
                t = target[edge[s]]
                if t != NONE and component[t] == NONE:
                    if found[t] == 0:
                        path[depth] = t
                        depth += 1
                        deeper = True
                        break
                    low[s] = min(low[s], low[t])
                edge[s] += 1
            if deeper:
                continue  # the edge is read again when t is done, and takes over its low
            depth -= 1
            if low[s] == found[s]:
                while True:
                    waits -= 1
                    t = waiting[waits]
                    component[t] = components
                    if t == s:
                        break
                components += 1
    return component


def any_outcome(outcome: Ints, flags: Bools) -> Bools:
    """Tell for each choice whether one of its outcomes ``outcome[c]`` to ``outcome[c + 1]`` is flagged."""
    before = np.append(0, np.cumsum(flags))
    hit: Bools = before[outcome[1:]] > before[outcome[:-1]]
    return hit


def end_components(choice: Ints, outcome: Ints, target: Ints, allowed: Bools) -> tuple[Ints, Bools]:
    """Return the maximal end components that the ``allowed`` choices form.

    Parameters
    ----------
    choice, outcome, target
        A process as flat arrays, see `supremal.decisions.planning.Choices`.
    allowed
        ``bool [C]``: the choices that may be used.

    Returns
    -------
    int32 [S], bool [C]
        The number of each state's component, `NONE` where it is in none; and the choices that stay in one.

    Notes
    -----
    Linear for each round, at most S of them and usually two or three.
    """
    counts = np.diff(outcome)
    state = np.repeat(np.arange(len(choice) - 1), np.diff(choice))
    source = np.repeat(state, counts)
    kept = allowed
    while True:
        edges = np.where(np.repeat(kept, counts), target, np.int32(NONE))
        component = strong_components(outcome[choice].astype(np.int64), edges)
        fewer = kept & ~any_outcome(outcome, component[source] != component[target])
        if fewer.sum() == kept.sum():
            break
        kept = fewer
    inside = np.zeros(len(choice) - 1, np.bool_)
    inside[state[kept]] = True
    numbered = np.full(len(inside), NONE, np.int32)
    numbered[inside] = np.unique(component[inside], return_inverse=True)[1]
    return numbered, kept

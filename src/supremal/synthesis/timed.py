"""Synthesis where time passes: the event tick, and events that come in time.

In a timed discrete event system the passing of a unit of time is an event, *tick*.  Nobody can forbid it, but
a *forcible* event can be made to happen before the next tick comes: it pre-empts it.  So K is controllable
with respect to a plant G iff after every s ∈ K̄

- an uncontrollable event that G can do is allowed in K̄;
- if G can do tick, tick is allowed in K̄, or some forcible event is.

Such languages are closed under union, so there is a supremal one.  Like the untimed one it is a greatest
fixpoint on the product of plant and specification: take out the states from which an uncontrollable event
breaks the specification or leads to a state taken out, those where tick does and no forcible event leads to a
state that is left, and those from which no marked state can be reached, until nothing more goes.

Source: Brandin, Wonham, "Supervisory control of timed discrete-event systems", IEEE Trans. Automatic Control
39 (1994); Wonham, Cai, *Supervisory Control of Discrete-Event Systems*, chapter 9.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal._graph import coreachable_to
from supremal._jit import kernel
from supremal.automata.alphabet import Alphabet, union
from supremal.automata.automaton import Automaton
from supremal.automata.explore import Exploration, as_parts, explore
from supremal.automata.reduce import keep
from supremal.errors import AlphabetError
from supremal.synthesis._plants import possible
from supremal.synthesis.supervisor import Supervisor


def synthesize_timed(
    plant: Automaton | Sequence[Automaton],
    spec: Automaton | Sequence[Automaton],
    *,
    forcible: Collection[str],
    tick: str = "tick",
    nonblocking: bool = True,
    max_states: int | None = None,
) -> Supervisor:
    r"""Return the supervisor of the supremal controllable sublanguage where events can be forced.

    Parameters
    ----------
    plant
        What can happen: one automaton, or several that run side by side.
    spec
        What may happen: one automaton, or several that all have to hold.
    forcible
        The events that can be made to happen before the next tick; they may be uncontrollable.
    tick
        The event that says that a unit of time has passed.  The alphabet has it as uncontrollable.
    nonblocking
        False gives the prefix-closed one, for which marked states play no part.
    max_states
        The most states that the product may have; left out: what fits the machine.

    Returns
    -------
    Supervisor
        Where it does not enable ``tick``, one of the forcible events that it enables is to be forced.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another, a forcible event or ``tick`` is unknown,
        or ``tick`` is controllable or forcible.
    AutomatonError
        If the product has more than ``max_states`` states.

    Notes
    -----
    Linear in the transitions of the product for each round of the fixpoint, of which there are at most as
    many as states, and one if ``nonblocking`` is False.

    Examples
    --------
    A train is here two ticks after it was announced, unless the signal stops it before.

    >>> from supremal import from_text
    >>> from supremal.synthesis.timed import synthesize_timed
    >>> line = from_text('''
    ...     uncontrollable tick
    ...     far -tick-> near
    ...     near -tick-> here
    ...     near -stop-> held
    ...     held -tick-> held
    ... ''')
    >>> never_here = from_text('''
    ...     uncontrollable tick
    ...     ok -tick-> soon
    ...     soon -stop-> safe
    ...     safe -tick-> safe
    ... ''')
    >>> monitor = synthesize_timed(line, never_here, forcible=["stop"]).monitor()
    >>> monitor.observe(["tick"]), monitor.enabled
    (True, ('stop',))
    >>> synthesize_timed(line, never_here, forcible=[]).is_empty
    True
    """
    plants, specs = as_parts(plant), as_parts(spec)
    alphabet = union(*(part.alphabet for part in (*plants, *specs)))
    clock, forces = _check(alphabet, forcible, tick)
    graph = explore([_free(p, tick) for p in plants], [_free(s, tick) for s in specs], max_states=max_states)
    good = _fixpoint(
        graph,
        forced=~alphabet.controllable & (np.arange(len(alphabet)) != clock),
        forces=forces,
        clock=clock,
        late=possible(plants, graph.states, alphabet)[:, clock],
        nonblocking=nonblocking,
    )
    name = " ∥ ".join(part.name for part in (*plants, *specs) if part.name)
    behaviour = keep(Automaton(alphabet, graph.delta(), graph.marked, graph.states, name=name), good)
    enabled = (behaviour.delta != NONE) | ~alphabet.controllable
    passes = possible(plants, behaviour.origin, alphabet)[:, clock]
    enabled[:, clock] = (behaviour.delta[:, clock] != NONE) | ~passes
    return Supervisor(behaviour, behaviour.origin[:, : len(plants)], enabled)


def _check(alphabet: Alphabet, forcible: Collection[str], tick: str) -> tuple[int, Bools]:
    """Return the number of ``tick`` and which events are forcible."""
    clock = alphabet.index(tick)
    if alphabet.controllable[clock]:
        message = f"event {tick!r} is controllable, but time passes by itself; declare it uncontrollable"
        raise AlphabetError(message)
    forces = np.zeros(len(alphabet), np.bool_)
    forces[[alphabet.index(name) for name in forcible]] = True
    if forces[clock]:
        message = f"event {tick!r} stands among the forcible ones, which come before it; leave it out"
        raise AlphabetError(message)
    return clock, forces


def _free(part: Automaton, tick: str) -> Automaton:
    """Return ``part`` with ``tick`` controllable: exploring goes on where a specification stops it."""
    sigma = part.alphabet
    return replace(part, alphabet=Alphabet(sigma.names, sigma.uncontrollable - {tick}, sigma.unobservable))


def _fixpoint(
    graph: Exploration, *, forced: Bools, forces: Bools, clock: int, late: Bools, nonblocking: bool
) -> Bools:
    """Return the states that the supremal sublanguage keeps.

    ``forced`` and ``forces`` tell which events nobody controls and which are forcible; ``late`` where the
    plant can do tick.
    """
    states = len(graph.bad)
    source = np.repeat(np.arange(states, dtype=np.int32), np.diff(graph.start))
    order = np.argsort(graph.target, kind="stable")
    into = np.append(0, np.cumsum(np.bincount(graph.target, minlength=states)))
    late = late & (np.bincount(source[graph.event == clock], minlength=states) == 0)
    hands = np.bincount(source[forces[graph.event]], minlength=states)
    good: Bools = ~graph.bad & ~(late & (hands == 0))
    gone = np.flatnonzero(~good)
    while True:
        _spread(into, source[order], graph.event[order], forced, forces, clock, late, hands, gone, good)
        alive = coreachable_to(graph.start, graph.target, graph.marked, good) if nonblocking else good
        gone = np.flatnonzero(good & ~alive)
        if not gone.size:
            return good
        good[gone] = False


@kernel
def _spread(
    into: Longs,
    source: Ints,
    event: Ints,
    forced: Bools,
    forces: Bools,
    clock: int,
    late: Bools,
    hands: Longs,
    gone: Longs,
    good: Bools,
) -> None:
    """Take out of ``good`` the states that cannot do without those that are ``gone``.

    The edges into t are ``into[t]`` to ``into[t + 1]``.  ``late`` tells where tick leads astray, ``hands``
    counts the forcible edges that are left.
    """
    queue = np.empty(good.shape[0], np.int64)
    tail = gone.shape[0]
    queue[:tail] = gone
    head = 0
    while head < tail:
        t = queue[head]
        head += 1
        for k in range(into[t], into[t + 1]):
            s, e = source[k], event[k]
            if forces[e]:
                hands[s] -= 1
            if e == clock:
                late[s] = True
            if good[s] and (forced[e] or (late[s] and hands[s] == 0)):
                good[s] = False
                queue[tail] = s
                tail += 1

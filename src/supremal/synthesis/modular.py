"""A supervisor for each specification, and whether they get along.

Instead of one supervisor for all specifications, each has its own, which looks at some of the plants only.
Together they enforce all of them, and never forbid what nobody controls.  They may be in *conflict*: from
some state each can reach one of its marked states, and all together cannot.  Languages L1, ..., Ln are
nonconflicting iff the closure of L1 ∥ ... ∥ Ln is the composition of their closures.

The plants of a specification are those that share an event with it, those that share an uncontrollable event
with one of these, and so on.  A plant left out can then only prevent controllable events of these, so the
local supervisor forbids no more than has to be: prefix-closed supervisors together are the supremal one of
all plants and all specifications, and so are nonblocking ones that are nonconflicting with each other and
with the plants that none of them looks at.

Source: Wonham, Ramadge, "Modular supervisory control of discrete-event systems", Math. Control Signals
Systems 1 (1988); de Queiroz, Cury, "Modular supervisory control of large scale discrete event systems",
WODES 2000.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from supremal.automata.automaton import Automaton
from supremal.automata.compose import sync
from supremal.automata.reduce import trim
from supremal.synthesis.supcon import synthesize
from supremal.synthesis.supervisor import Supervisor
from supremal.synthesis.verify import find_blocking


class Modular(NamedTuple):
    """What `synthesize_modular` returns.

    Parameters
    ----------
    supervisors
        One for each specification.
    conflict
        A shortest word after which all together cannot reach a marked state any more; None if there is none.
    groups
        The numbers of the plants that each supervisor looks at, in the order of its ``plant_state``.
    """

    supervisors: tuple[Supervisor, ...]
    conflict: tuple[str, ...] | None
    groups: tuple[tuple[int, ...], ...]


def find_conflict(*automata: Automaton, max_states: int | None = None) -> tuple[str, ...] | None:
    r"""Return a shortest word that brings ``automata`` into conflict, None if none does.

    After it each of the (trimmed) automata can reach a marked state on its own, and all together cannot.

    Raises
    ------
    AlphabetError
        If an event is controllable in one automaton and not in another.
    AutomatonError
        If the product has more than ``max_states`` states.

    Notes
    -----
    Linear in the transitions of the product.

    Examples
    --------
    >>> from supremal import from_text
    >>> from supremal.synthesis.modular import find_conflict
    >>> one = from_text("marked 3 \n 0 -a-> 1 \n 0 -b-> 2 \n 1 -c-> 3 \n 2 -d-> 3")
    >>> two = from_text("marked 3 \n 0 -a-> 1 \n 0 -b-> 2 \n 1 -d-> 3 \n 2 -d-> 3 \n 2 -c-> 2")
    >>> find_conflict(one, two)
    ('a',)
    """
    return find_blocking(sync(*map(trim, automata), max_states=max_states))


def is_nonconflicting(*automata: Automaton, max_states: int | None = None) -> bool:
    """Tell whether no word brings ``automata`` into conflict; see `find_conflict`."""
    return find_conflict(*automata, max_states=max_states) is None


def synthesize_modular(
    plants: Sequence[Automaton],
    specs: Sequence[Automaton],
    *,
    nonblocking: bool = True,
    max_states: int | None = None,
) -> Modular:
    r"""Return a supervisor for each of ``specs``, each for as few of ``plants`` as will do.

    Parameters
    ----------
    plants
        What can happen: automata that run side by side.
    specs
        What may happen; all have to hold.
    nonblocking
        False gives the prefix-closed ones, for which there is no conflict.
    max_states
        The most states that a product may have; left out: what fits the machine.

    Returns
    -------
    Modular
        If ``conflict`` is None, the supervisors together with the plants that none of them looks at are the
        supremal supervisor of everything.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another.
    AutomatonError
        If a product has more than ``max_states`` states.

    Notes
    -----
    A supervisor takes time linear in the transitions of the product of its specification and its plants, in
    each round of the fixpoint.  Looking for a conflict goes through the product of all supervisors.

    Examples
    --------
    >>> from supremal import from_text
    >>> from supremal.synthesis.modular import synthesize_modular
    >>> machine = "marked idle \n uncontrollable end{0} \n idle -start{0}-> busy \n busy -end{0}-> idle"
    >>> buffer = "marked empty \n uncontrollable end{0} \n empty -end{0}-> full \n full -start{1}-> empty"
    >>> machines = [from_text(machine.format(k)) for k in range(3)]
    >>> buffers = [from_text(buffer.format(k, k + 1)) for k in range(2)]
    >>> found = synthesize_modular(machines, buffers)
    >>> [supervisor.automaton.n_states for supervisor in found.supervisors], found.groups, found.conflict
    ([6, 6], ((0, 1), (1, 2)), None)
    """
    groups = tuple(_group(spec, plants) for spec in specs)
    supervisors = tuple(
        synthesize([plants[k] for k in group], spec, nonblocking=nonblocking, max_states=max_states)
        for spec, group in zip(specs, groups, strict=True)
    )
    if not nonblocking:
        return Modular(supervisors, None, groups)
    looked_at = {k for group in groups for k in group}
    rest = [plant for k, plant in enumerate(plants) if k not in looked_at]
    together = sync(*(supervisor.automaton for supervisor in supervisors), *rest, max_states=max_states)
    return Modular(supervisors, find_blocking(together), groups)


def _group(spec: Automaton, plants: Sequence[Automaton]) -> tuple[int, ...]:
    """Return the plants that ``spec`` has to look at."""

    def sharing(events: set[str]) -> set[int]:
        return {k for k, plant in enumerate(plants) if events.intersection(plant.alphabet)}

    group = sharing(set(spec.alphabet))
    while True:
        wider = group | sharing({event for k in group for event in plants[k].alphabet.uncontrollable})
        if wider == group:
            return tuple(sorted(group))
        group = wider

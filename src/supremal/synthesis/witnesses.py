r"""Shortest words that say no: to a violation, to blocking, to where the agent is stuck; with names.

A rule that holds against some of the plants holds against all of them, because more plants allow fewer words.
So `explain_violation` begins with the plants that share an uncontrollable event with the rules, and takes
in another only when it rules a witness out: counterexample-guided refinement.  A shortest witness that all
plants can follow is a shortest one of all, because theirs are among those of fewer plants.  Fewer plants can
have the larger product, though; where it is too large, all of them are taken.

Source: as `supremal.synthesis.verify`, whose answers these are; Clarke, Grumberg, Jha, Lu, Veith,
"Counterexample-guided abstraction refinement for symbolic model checking", J. ACM 50 (2003).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from supremal._arrays import NONE
from supremal._graph import coreachable_to
from supremal.automata.alphabet import union
from supremal.automata.automaton import Automaton
from supremal.errors import AutomatonError
from supremal.synthesis import _kernels
from supremal.synthesis.causes import (
    Break,
    Causes,
    Parts,
    Product,
    as_rules,
    find_causes,
    named,
    product_of,
    whole_product_of,
)
from supremal.synthesis.reasons import listed

_FEW: Final = 100_000
"""The most states of a product with only some of the plants."""


@dataclass(frozen=True, slots=True)
class Breach:
    """A shortest word that the rules allow, and an uncontrollable event that can follow and breaks some."""

    word: tuple[str, ...]
    event: str
    breaks: tuple[Break, ...]

    def __str__(self) -> str:
        after = f"after {' '.join(self.word)}" if self.word else "at once"
        return f"{after}, {self.event} can happen, which nobody controls: {listed(self.breaks, 'it')}"


@dataclass(frozen=True, slots=True)
class Blocking:
    """A shortest word after which no marked state can be reached any more.

    ``waiting`` are the parts that are not in a marked state there, each with its state.
    """

    word: tuple[str, ...]
    waiting: tuple[tuple[str, str], ...]

    def __str__(self) -> str:
        after = f"after {' '.join(self.word)}" if self.word else "from the start"
        where = ", ".join(f"{name} in {state}" for name, state in self.waiting[:8])
        more = f" and {len(self.waiting) - 8} more" if len(self.waiting) > 8 else ""
        return f"{after}, no marked state can be reached any more; not marked: {where}{more}"


@dataclass(frozen=True, slots=True)
class Deadlock:
    """A shortest word after which the agent has to act, and every choice breaks a rule."""

    word: tuple[str, ...]
    breaks: tuple[Break, ...]

    def __str__(self) -> str:
        after = f"after {' '.join(self.word)}" if self.word else "at the start"
        return f"{after}, one has to act and no choice is left: {listed(self.breaks)}"


def explain_violation(
    plants: Parts, specs: Parts, *, nonblocking: bool = True, max_states: int | None = None
) -> Breach | None:
    r"""Return a shortest violation of controllability by the rules that break, None if there is none.

    Parameters
    ----------
    plants
        What can happen: one automaton, or several that run side by side.
    specs
        What may happen: one automaton, or several, each of which is a rule.
    nonblocking
        Whether a rule is its marked language; False: its generated one.
    max_states
        The most states that a product may have.

    Raises
    ------
    AlphabetError
        If an event is controllable in one part and not in another.
    AutomatonError
        If the product has more than ``max_states`` states.

    Notes
    -----
    For one rule it answers as `find_uncontrollable`.  Several rules hold if each does, and each is taken
    as its own language here; where they cannot be completed together, that is blocking.

    Examples
    --------
    >>> from supremal import from_text
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> calm = from_text("name calm \n uncontrollable fault \n ready -start-> going \n going -stop-> ready")
    >>> print(explain_violation(plant, calm))
    after start, fault can happen, which nobody controls: it breaks calm in its state going
    """
    parts, rules = named(plants, "plant"), as_rules(specs, nonblocking=nonblocking)
    sigma = union(*(part.alphabet for part in (*parts, *(rule.whole for rule in rules))))
    forced = frozenset().union(*(rule.whole.alphabet for rule in rules)) & sigma.uncontrollable
    chosen = [bool(forced & set(part.alphabet)) for part in parts]
    while forced:
        some = tuple(part for part, is_in in zip(parts, chosen, strict=True) if is_in)
        try:
            room = max_states if all(chosen) else min(_FEW, max_states or _FEW)
            found = breach_in(product_of(some, rules, max_states=room))
        except AutomatonError:
            if all(chosen):
                raise
            chosen = [True] * len(parts)
            continue
        if found is None:
            return None
        word = (*found.word, found.event)
        against = [not (is_in or _can(part, word)) for part, is_in in zip(parts, chosen, strict=True)]
        if not any(against):
            return found
        chosen = [a or b for a, b in zip(chosen, against, strict=True)]
    return None


def _can(part: Automaton, word: Sequence[str]) -> bool:
    return part.run(event for event in word if event in part.alphabet) != NONE


def breach_in(product: Product) -> Breach | None:
    """Return a shortest violation in a `product_of` plants and rules, None if there is none."""
    bad = product.graph.bad
    if not bad.any():
        return None
    state = int(np.argmax(bad))  # states come in breadth-first order
    breaks = product.escaping(state)
    return Breach(product.shortest_word(state), breaks[0].event, breaks)


def explain_blocking(plants: Parts, specs: Parts = (), *, max_states: int | None = None) -> Blocking | None:
    r"""Return a shortest word to where nothing marked can be reached any more, None if there is none.

    Parameters and errors are those of `explain_violation`; all plants take part.

    Examples
    --------
    >>> from supremal import from_text
    >>> one = from_text("name one \n marked idle \n idle -a1-> a \n a -b1-> both \n both -free1-> idle")
    >>> two = from_text("name two \n marked idle \n idle -b2-> b \n b -a2-> both \n both -free2-> idle")
    >>> a = from_text("name A \n marked free \n free -a1, a2-> taken \n taken -free1, free2-> free")
    >>> b = from_text("name B \n marked free \n free -b1, b2-> taken \n taken -free1, free2-> free")
    >>> print(explain_blocking([one, two], [a, b]))
    after a1 b2, no marked state can be reached any more; not marked: one in a, two in b, A in taken,
    B in taken
    """
    rules = as_rules(specs, nonblocking=True)
    return blocking_in(whole_product_of(named(plants, "plant"), rules, max_states=max_states))


def blocking_in(product: Product) -> Blocking | None:
    """Return a shortest word to a blocked state of a `whole_product_of` plants and rules."""
    graph = product.graph
    blocked = ~coreachable_to(graph.start, graph.target, graph.marked)
    if not blocked.any():
        return None
    state = int(np.argmax(blocked))
    own = graph.states[state].tolist()
    waiting = [
        (part.name, part.state_name(q))
        for part, q in zip(product.plants, own, strict=False)
        if not part.marked[q]
    ]
    for rule, q in zip(product.rules, own[len(product.plants) :], strict=True):
        if not rule.closure.marked[q]:
            waiting.append((rule.whole.name, rule.whole.state_name(int(rule.number[q]))))
    return Blocking(product.shortest_word(state), tuple(waiting))


def explain_deadlock(plants: Parts, specs: Parts, *, max_states: int | None = None) -> Deadlock | None:
    r"""Return a shortest word after which one has to act and every choice breaks a rule; None: there is none.

    Only words along which nothing uncontrollable can break a rule count.  Parameters and errors are those of
    `explain_violation`; all plants take part.

    Examples
    --------
    >>> from supremal import from_text
    >>> robot = from_text("left -go-> right \n right -back-> left")
    >>> once = from_text("name once \n events back \n fresh -go-> done")
    >>> print(explain_deadlock(robot, once))
    after go, one has to act and no choice is left: back breaks once in its state done
    """
    return deadlock_in(find_causes(plants, specs, nonblocking=False, must_act=True, max_states=max_states))


def deadlock_in(causes: Causes) -> Deadlock | None:
    """Return the nearest state that is stuck because every choice breaks a rule at once."""
    stuck = (causes.cause == _kernels.STUCK) & (causes.after == NONE)
    if not stuck.any():
        return None
    state, product = int(np.argmax(stuck)), causes.product
    breaks = tuple(b for event in product.events(state) for b in product.broken(state, event))
    return Deadlock(product.shortest_word(state), breaks)

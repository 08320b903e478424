r"""What is given up, and whose fault it is.

K \ K↑ are the words that the rules allow and no supervisor can.  The shortest of them are found by a search
that knows, for every state of the product, how far it still is from a word that counts; it never looks at a
word that does not lead to one.  A word that has left the supervised behaviour has left it for good, even
where it comes back to a state that is kept.

Where nothing at all can be enforced, some of the rules are to blame.  A set of rules that cannot be kept
stays so when rules are added; so dropping each in turn, unless the rest can be kept without it, leaves a set
that is minimal with respect to inclusion.

Source: Hart, Nilsson, Raphael, "A formal basis for the heuristic determination of minimum cost paths", IEEE
Trans. SSC 4 (1968), with a perfect heuristic; Bakker, Dikker, Tempelman, Wognum, "Diagnosing and solving
over-determined constraint satisfaction problems", IJCAI 1993, for the deletion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import islice

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal.automata.build import universal
from supremal.automata.explore import Exploration, as_parts
from supremal.errors import ModelError
from supremal.synthesis import _kernels, _why
from supremal.synthesis.causes import Parts, Product, as_rules, named, whole_product_of
from supremal.synthesis.supcon import synthesize
from supremal.synthesis.supervisor import Supervisor


@dataclass(frozen=True, slots=True)
class GivenUp:
    """A word that the rules allow and the supervisor does not.

    It disables what follows the first ``kept`` events; None: it is empty, and allows no word at all.
    """

    word: tuple[str, ...]
    kept: int | None

    def __str__(self) -> str:
        text = " ".join(self.word) or "the empty word"
        if self.kept is None:
            return text
        after = f"after {' '.join(self.word[: self.kept])}" if self.kept else "at the start"
        return f"{text}: {self.word[self.kept]} is disabled {after}"


@dataclass(frozen=True, slots=True)
class Guilty:
    """A minimal set of rules that cannot be kept; empty where the plants alone are to blame.

    ``number`` are their places among the specifications, counted from 0.
    """

    rules: tuple[str, ...]
    number: tuple[int, ...]

    def __str__(self) -> str:
        if not self.rules:
            return "the plants alone are to blame: nothing can be enforced even without a rule"
        if len(self.rules) == 1:
            return f"{self.rules[0]} alone cannot be kept"
        named = f"{', '.join(self.rules[:-1])} and {self.rules[-1]}"
        return f"{named} cannot be kept together; any fewer of them can"


def given_up(
    plants: Parts,
    specs: Parts,
    supervisor: Supervisor,
    n: int = 10,
    *,
    nonblocking: bool = True,
    max_states: int | None = None,
) -> tuple[GivenUp, ...]:
    r"""Return up to ``n`` shortest words that are given up, the shortest first.

    Parameters
    ----------
    plants, specs, nonblocking, max_states
        What the supervisor was synthesized from, and how.
    supervisor
        What `synthesize` returned for them.
    n
        How many words at most.

    Returns
    -------
    tuple of GivenUp
        Words of K \ K↑: marked ones, generated ones if not ``nonblocking``.  () where the rules are kept
        whole, or all that is lost are ways into blocking.

    Raises
    ------
    ModelError
        If ``supervisor`` is not the one of these plants and specifications.
    AutomatonError
        If the product of plants and rules, with nothing left out, has more than ``max_states`` states.

    Notes
    -----
    Linear in the transitions of that product, and in the letters of the words times the events.

    Examples
    --------
    >>> from supremal import from_text, synthesize
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> spec = from_text("uncontrollable fault \n ready -start-> going \n going -stop-> ready")
    >>> for lost in given_up(plant, spec, synthesize(plant, spec), 2):
    ...     print(lost)
    start: start is disabled at the start
    start stop: start is disabled at the start
    """
    rules = as_rules(specs, nonblocking=nonblocking)
    product = whole_product_of(named(plants, "plant"), rules, max_states=max_states)
    return given_up_in(product, supervisor, n, nonblocking=nonblocking)


def given_up_in(
    product: Product, supervisor: Supervisor, n: int, *, nonblocking: bool
) -> tuple[GivenUp, ...]:
    """Return what `given_up` does, from a `whole_product_of` plants and rules."""
    graph = product.graph
    image = np.empty(0, np.int32)
    if graph.alphabet == supervisor.automaton.alphabet and len(graph.bad):
        image = _why.follow(supervisor.automaton.delta, graph.start, graph.event, graph.target)
    if len(image) != supervisor.automaton.n_states or NONE in image:
        message = (
            "the supervisor is not the one of these plants and specifications; give those it was made of"
        )
        raise ModelError(message)
    if not len(graph.bad):
        return ()
    kept = np.zeros(len(graph.bad), np.bool_)
    kept[image] = True
    goals = graph.marked if nonblocking else np.ones(len(graph.bad), np.bool_)
    found = _words(graph, kept, _distances(graph, kept, goals), goals)
    return tuple(islice(found, n))


def _distances(graph: Exploration, kept: Bools, goals: Bools) -> tuple[Ints, Ints]:
    """Return how far each state is from a goal, and how far if it is kept and has to leave first."""
    into, source = _kernels.turn_round(graph.start, graph.event, graph.target, graph.alphabet.controllable)
    ready = np.where(goals, np.int32(0), np.int32(NONE))
    outside = _why.distances(into, source, ready, np.flatnonzero(goals), np.ones_like(kept))

    ready = _why.leaving(graph.start, graph.target, kept, outside)
    seeds = np.flatnonzero(ready != NONE)
    seeds = seeds[np.argsort(ready[seeds], kind="stable")]
    return outside, _why.distances(into, source, ready, seeds, kept)


def _words(graph: Exploration, kept: Bools, away: tuple[Ints, Ints], goals: Bools) -> Iterator[GivenUp]:
    """Go through the words that leave the kept states and end in a goal, the shortest first."""
    outside, inside = away
    names = graph.alphabet.names
    heap: list[tuple[int, int, tuple[int, ...], int, int]] = []

    def push(word: tuple[int, ...], state: int, left: int) -> None:
        far = int((inside if left == NONE else outside)[state])
        if far != NONE:
            heappush(heap, (len(word) + far, -len(word), word, state, left))

    push((), 0, NONE if kept[0] else 0)
    while heap:
        _, _, word, state, left = heappop(heap)
        if left != NONE and goals[state]:
            yield GivenUp(tuple(names[e] for e in word), left if kept[0] else None)
        for k in range(graph.start[state], graph.start[state + 1]):
            target = int(graph.target[k])
            leaves = left == NONE and not kept[target]
            push((*word, int(graph.event[k])), target, len(word) if leaves else left)


def find_guilty(
    plants: Parts,
    specs: Parts,
    *,
    nonblocking: bool = True,
    must_act: bool = False,
    max_states: int | None = None,
) -> Guilty | None:
    r"""Return a minimal set of rules that cannot be kept, None if all of them can.

    Parameters and errors are those of `synthesize`.

    Notes
    -----
    One synthesis a rule, besides two.  A rule that is dropped still knows its events: it allows them all.

    Examples
    --------
    >>> from supremal import from_text
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> busy = from_text("name busy \n uncontrollable fault \n marked going \n ready -start-> going")
    >>> brief = from_text("name brief \n ready -start-> going \n going -stop-> ready")
    >>> calm = from_text("name calm \n uncontrollable fault \n initial ok \n events fault")
    >>> print(find_guilty(plant, [brief, busy, calm]))
    busy alone cannot be kept
    """
    rules = list(named(specs, "rule"))
    anything = [universal(rule.alphabet) for rule in rules]

    def is_hopeless(chosen: list[bool]) -> bool:
        these = [r if c else a for r, a, c in zip(rules, anything, chosen, strict=True)]
        supervisor = synthesize(
            as_parts(plants), these, nonblocking=nonblocking, must_act=must_act, max_states=max_states
        )
        return supervisor.is_empty

    chosen = [True] * len(rules)
    if not is_hopeless(chosen):
        return None
    if is_hopeless([False] * len(rules)):
        return Guilty((), ())
    for k in range(len(rules)):
        chosen[k] = False
        chosen[k] = not is_hopeless(chosen)
    number = tuple(k for k, is_in in enumerate(chosen) if is_in)
    return Guilty(tuple(rules[k].name for k in number), number)

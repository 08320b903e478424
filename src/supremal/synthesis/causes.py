"""Why states of the product have to go: synthesis, with a cause for everything that it takes out.

K↑ is what is left of the product of plants and rules when states are taken out until nothing more has to go.
Each goes for one of four causes:

escapes
    something uncontrollable that can happen breaks a rule;
forced
    something uncontrollable leads to a state that has gone;
stuck
    the agent has to act, and every event that it could choose breaks a rule or leads to what has gone;
blocked
    no marked state can be reached any more through what is left.

Every cause but the first points at a state that has gone before, or is nearer to one.  So following the
causes spells, in time linear in the answer, a word that ends where a rule breaks, where nothing is left to
choose, or where nothing is marked any more.

A rule is its marked language: where it has states from which no marked one can be reached, entering them
breaks it, whatever its automaton goes on to allow.  Source: as `supremal.synthesis.supcon`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal._graph import first_seed, path_to, search
from supremal.automata.automaton import Automaton
from supremal.automata.explore import Exploration, as_parts, explore
from supremal.automata.reduce import coreachable, keep, reachable
from supremal.synthesis import _kernels
from supremal.synthesis.supcon import cut_out, find_removed
from supremal.synthesis.supervisor import Supervisor

Parts = Automaton | Sequence[Automaton]
Columns = tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Break:
    """A rule that forbids an event.

    In ``state`` of ``rule`` the event is not possible, or (not ``at_once``) no marked state of the rule could
    be reached after it.
    """

    event: str
    rule: str
    state: str
    at_once: bool = True

    def __str__(self) -> str:
        if self.at_once:
            return f"{self.event} breaks {self.rule} in its state {self.state}"
        return f"after {self.event}, {self.rule} could never be completed from its state {self.state}"


@dataclass(frozen=True, slots=True, eq=False)
class Rule:
    """A rule and its closure.

    ``closure`` is what is reachable, and for the marked language coreachable; ``number`` are the numbers of
    its states in ``whole``.
    """

    whole: Automaton
    closure: Automaton
    number: Ints


def named(parts: Parts, kind: str) -> tuple[Automaton, ...]:
    """Return ``parts``, those without a name called by their kind and place."""
    return tuple(p if p.name else replace(p, name=f"{kind} {k}") for k, p in enumerate(as_parts(parts), 1))


def as_rules(specs: Parts, *, nonblocking: bool) -> tuple[Rule, ...]:
    """Return specifications as rules, their marked (or, not ``nonblocking``, generated) language closed."""
    rules = []
    for spec in named(specs, "rule"):
        kept = reachable(spec) & coreachable(spec) if nonblocking else reachable(spec)
        own = replace(spec, origin=np.empty((0, 0), np.int32))  # so that it numbers its own states
        closure = keep(own, kept)
        rules.append(Rule(spec, closure, closure.origin[:, 0]))
    return tuple(rules)


@dataclass(frozen=True, slots=True, eq=False)
class Product:
    """Plants and rules side by side: ``graph.states`` are the states of the plants, then of the closures.

    ``takes_part`` are, for every event, the plants that know it, with its column in each, and the rules.
    """

    plants: tuple[Automaton, ...]
    rules: tuple[Rule, ...]
    graph: Exploration
    takes_part: tuple[tuple[Columns, Columns], ...] = field(init=False)

    def __post_init__(self) -> None:
        closures = [rule.closure for rule in self.rules]
        pairs = tuple((_columns(name, self.plants), _columns(name, closures)) for name in self.graph.alphabet)
        object.__setattr__(self, "takes_part", pairs)

    def broken(self, state: int, event: str) -> tuple[Break, ...]:
        """Return the rules that forbid ``event`` in ``state``."""
        own = self.graph.states[state, len(self.plants) :].tolist()
        found = []
        for k, column in self.takes_part[self.graph.alphabet.index(event)][1]:
            rule = self.rules[k]
            if rule.closure.delta[own[k], column] == NONE:
                at = int(rule.number[own[k]])
                at_once = bool(rule.whole.delta[at, column] == NONE)
                found.append(Break(event, rule.whole.name, rule.whole.state_name(at), at_once))
        return tuple(found)

    def possible(self, states: Ints) -> Bools:
        """Return which events all plants can follow in ``states [N]``, ``bool [N, E]``."""
        can = np.ones((len(states), len(self.graph.alphabet)), np.bool_)
        for k, plant in enumerate(self.plants):
            columns = [self.graph.alphabet.index(name) for name in plant.alphabet]
            can[:, columns] &= (plant.delta != NONE)[self.graph.states[states, k]]
        return can

    def events(self, state: int) -> dict[str, int]:
        """Return the events that all plants can follow in ``state``, and where each leads (`NONE`)."""
        edges = slice(self.graph.start[state], self.graph.start[state + 1])
        leads = dict(zip(self.graph.event[edges].tolist(), self.graph.target[edges].tolist(), strict=True))
        own = self.graph.states[state].tolist()
        return {
            name: leads.get(e, NONE)
            for e, name in enumerate(self.graph.alphabet)
            if e in leads or all(self.plants[k].delta[own[k], c] != NONE for k, c in self.takes_part[e][0])
        }

    def escaping(self, state: int) -> tuple[Break, ...]:
        """Return the rules that the first uncontrollable event to break any in ``state`` breaks."""
        uncontrollable = self.graph.alphabet.uncontrollable
        broken = (self.broken(state, event) for event in self.events(state) if event in uncontrollable)
        return next((rules for rules in broken if rules), ())

    def shortest_word(self, state: int) -> tuple[str, ...]:
        """Return a shortest word to ``state``."""
        graph = self.graph
        everywhere = np.ones(len(graph.bad), np.bool_)
        _, via = search(graph.start, graph.target, first_seed(len(graph.bad)), everywhere)
        return graph.alphabet.spell(graph.event[path_to(state, via, graph.start)].tolist())


def _columns(name: str, parts: Sequence[Automaton]) -> Columns:
    return tuple((k, p.alphabet.index(name)) for k, p in enumerate(parts) if name in p.alphabet)


def product_of(
    plants: tuple[Automaton, ...], rules: tuple[Rule, ...], *, max_states: int | None = None
) -> Product:
    """Return the product, not explored beyond what escapes from a rule."""
    graph = explore(plants, [rule.closure for rule in rules], max_states=max_states)
    return Product(plants, rules, graph)


def whole_product_of(
    plants: tuple[Automaton, ...], rules: tuple[Rule, ...], *, max_states: int | None = None
) -> Product:
    """Return the product with nothing left out; none of its states counts as ``bad``."""
    graph = explore([*plants, *(rule.closure for rule in rules)], max_states=max_states)
    return Product(plants, rules, graph)


@dataclass(frozen=True, slots=True, eq=False)
class Causes:
    """Why the states of a product have to go.

    Parameters
    ----------
    product
        Of plants and rules.
    cause, after
        ``int8 [S]`` and ``int32 [S]``, as `_kernels.remove` returns them.
    """

    product: Product
    cause: _kernels.Causes
    after: Ints

    @property
    def enforceable(self) -> bool:
        """Whether nothing has to go: the rules alone are a supervisor."""
        return bool(self.cause.size) and not self.cause.any()


def find_causes(
    plants: Parts,
    specs: Parts,
    *,
    nonblocking: bool = True,
    must_act: bool = False,
    max_states: int | None = None,
) -> Causes:
    r"""Return why states of the product of ``plants`` and ``specs`` have to go.

    Parameters and errors are those of `synthesize`.

    Examples
    --------
    >>> from supremal import from_text
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> spec = from_text("uncontrollable fault \n ready -start-> going \n going -stop-> ready")
    >>> causes = find_causes(plant, spec)
    >>> causes.cause.tolist(), causes.enforceable
    ([0, 1], False)
    """
    rules = as_rules(specs, nonblocking=nonblocking)
    product = product_of(named(plants, "plant"), rules, max_states=max_states)
    cause, after = find_removed(product.graph, nonblocking=nonblocking, must_act=must_act)
    return Causes(product, cause, after)


def supervisor_of(causes: Causes) -> tuple[Supervisor, Ints]:
    """Return what is left as a supervisor, and ``int32 [S]``, the state of the product in each of its states.

    It is the one that `synthesize` returns.
    """
    graph, plants, rules = causes.product.graph, causes.product.plants, causes.product.rules
    states = graph.states.copy()
    for k, rule in enumerate(rules, len(plants)):
        states[:, k] = rule.number[states[:, k]]
    name = " ∥ ".join(part.name for part in (*plants, *(rule.whole for rule in rules)))
    return cut_out(graph, causes.cause == _kernels.KEPT, states, plants=len(plants), name=name)

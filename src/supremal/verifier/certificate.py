"""The parts of a certificate, and where an outcome leads in the product that they describe."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cache, cached_property
from typing import Any, NamedTuple

from .formulas import is_true
from .reading import exact
from .texts import NONE, TextError


class Move(NamedTuple):
    """An outcome of an enabled action; its target is a state's number, `NONE` where ``problem`` says why."""

    weight: Fraction
    reward: Fraction
    target: int
    problem: str


class Certificate:
    """A document whose parts refer to one another as they should, and what follows from them."""

    def __init__(self, document: Mapping[str, Any]) -> None:
        self.document = document
        self.rules, self.machine = document["rules"], document["reward_machine"]
        self.environment, self.states = document["environment"], document["states"]
        self.nonblocking = document["nonblocking"]
        self.number = {tuple(at): i for i, (at, *_) in enumerate(self.states)}
        self.ended = [self.environment[at[0]][0] for at, *_ in self.states]
        self.owed = [
            [rule["name"] for rule, q in zip(self.rules, at[1:-1], strict=True) if q not in rule["marked"]]
            for at, *_ in self.states
        ]
        first = [0] * (len(self.rules) + 1)
        self.read_word, self.read_label = cache(self._read_word), cache(self._read_label)
        self.starts = [((s, *first), exact(weight)) for s, weight in document["initial"]]

    def action(self, i: int, a: int) -> str:
        """Say which action of which state is meant."""
        return f"state {i}, action {self.document['actions'][a]!r}"

    @cached_property
    def moves(self) -> list[dict[int, list[Move]]]:
        """For each state and each enabled action, which has to be feasible, its outcomes."""
        choices = [dict(row[3]) for row in self.environment]
        return [
            {a: [self.follow(at, outcome) for outcome in choices[at[0]][a]] for a in enabled}
            for at, enabled, *_ in self.states
        ]

    def follow(self, at: list[int], outcome: tuple[float, int, float, int]) -> Move:
        """Return what an outcome of the environment is in the product."""
        weight, to, reward, word = outcome
        after = [self.read_word(k, q, word) for k, q in enumerate(at[1:-1])]
        problem, target = "", NONE
        if NONE in after:
            broken = self.rules[after.index(NONE)]["name"]
            problem = f"{self.document['words'][word]} breaks rule {broken!r}; it must not be enabled"
        elif to == NONE:
            problem = "leads to a state that is not given"
        else:
            u, paid, problem = self.read_label(at[-1], self.environment[to][2])
            reward = paid if self.machine else reward
            target = self.number.get((to, *after, u), NONE)
            if target == NONE and not problem:
                problem = f"leads to {[to, *after, u]}, which is not among the states"
        return Move(exact(weight), exact(reward), target, problem)

    def _read_word(self, k: int, q: int, word: int) -> int:
        """Return where rule k comes to from its state q, `NONE` if the word breaks it."""
        rule = self.rules[k]
        for event in self.document["words"][word]:
            if q != NONE and event in rule["events"]:
                q = rule["delta"][q][rule["events"].index(event)]
        return q

    def _read_label(self, u: int, label: int) -> tuple[int, float, str]:
        """Return the next state of the machine, its reward, and what is wrong with it."""
        if not self.machine:
            return 0, 0, ""
        states, names = self.machine["states"], self.machine["propositions"]
        true = [name for i, name in enumerate(self.document["propositions"]) if label >> i & 1]
        edges = [edge for edge in self.machine["edges"] if edge[0] == states[u]]
        try:
            taken = {(target, paid) for _, guard, target, paid in edges if is_true(guard, names, true)}
        except TextError as error:
            return NONE, 0, f"a guard of the reward machine cannot be read: {error}"
        loops = {(target, paid) for _, _, target, paid in edges if target == states[u]}
        ways = taken or loops or {(states[u], 0)}
        if len(ways) > 1:
            return NONE, 0, f"the reward machine has several ways from {states[u]!r} with {true}"
        ((target, reward),) = ways
        return states.index(target), reward, ""

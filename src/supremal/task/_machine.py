"""The reward machine of a task, and what it needs the environment to say."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from supremal.decisions.guards import RESERVED, truth_table
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.reward_machine import Edge, RewardMachine, reward_machine
from supremal.decisions.shaping import label_end, label_with_rule, machine_from_rule, potentials, shaped
from supremal.errors import suggest
from supremal.formats.documents import read_reward_machine
from supremal.formats.machine_text import read_machine_text
from supremal.rules.rule import Rule
from supremal.task._automata import in_file, path_of
from supremal.task._fields import (
    Field,
    Reader,
    check_keys,
    choose,
    distinct,
    name,
    number,
    one_of,
    take,
    text,
)
from supremal.task._slips import placed, placed_in

_WAYS: Final = {"file": (), "edges": ("name", "propositions", "initial"), "rule": ("reward",)}
_NAME: Final = re.compile(r"\b[A-Za-z_]\w*")
_SATISFIED: Final = "satisfied"
"""The proposition that a rule is."""


def read_machine(
    field: Field, environment: TabularMDP, rules: Sequence[Rule], folder: Path, gamma: float
) -> tuple[RewardMachine, RewardMachine | None, TabularMDP]:
    """Read ``[reward_machine]``.

    Parameters
    ----------
    field
        The table.
    environment
        What has the propositions that the machine reads.
    rules
        Those of the task, one of which may be rewarded.
    folder
        That of the task file.
    gamma
        The learner's discount factor, for shaping.

    Returns
    -------
    RewardMachine
        The machine.
    RewardMachine or None
        The same with its rewards told earlier, where that is asked for.
    TabularMDP
        The environment, with a proposition more where the machine needs one.
    """
    way = choose(field, list(_WAYS), ("shaping", *(key for keys in _WAYS.values() for key in keys)))
    check_keys(field, (way, *_WAYS[way], "shaping"))
    match way:
        case "file":
            machine = _in_file(field["file"], environment, folder)
        case "edges":
            machine = _drawn(field, environment)
        case _:
            machine, environment = _of_rule(field, environment, rules)
    factor = take(field, "shaping", _factor(gamma), None)
    if factor is None:
        return machine, None, environment
    with placed(field["shaping"]):
        return machine, shaped(machine, gamma, potential=potentials(machine, factor)), label_end(environment)


def _factor(gamma: float) -> Reader[float | None]:
    """Return a reader of a discount factor, or of true for that of the learner."""

    def read(field: Field) -> float | None:
        if isinstance(field.value, bool):
            return gamma if field.value else None
        return number(field)

    return read


def _in_file(field: Field, environment: TabularMDP, folder: Path) -> RewardMachine:
    path = path_of(field, folder)
    machine = in_file(
        field, path, read_machine_text if path.suffix.lower() == ".txt" else read_reward_machine
    )
    for proposition in machine.propositions:
        if proposition not in environment.propositions:
            field.fail(f"reads the {_unknown(proposition, environment.propositions)}")
    return machine


def _unknown(proposition: str, known: Sequence[str]) -> str:
    right = suggest(proposition, known) if known else "[environment.labels] has to say where it is true"
    return f"unknown proposition {proposition!r}; {right}"


def _proposition(known: Sequence[str]) -> Reader[str]:
    """Return a reader of a proposition."""

    def read(field: Field) -> str:
        if text(field) not in known:
            field.fail(_unknown(field.value, known))
        return text(field)

    return read


def _drawn(field: Field, environment: TabularMDP) -> RewardMachine:
    known = environment.propositions
    said = take(field, "propositions", distinct(_proposition(known)), None)
    rows = field["edges"].elements()
    edges = [_edge(row) for row in rows]
    named = [_named_in(row[1], known if said is None else said) for row in rows]
    used = [proposition for proposition in known if any(proposition in names for names in named)]
    propositions = used if said is None else said
    for row in rows:
        with placed_in(row[1]):
            truth_table(row[1].value, propositions)
    initial, called = take(field, "initial", name, None), take(field, "name", name, "rewards")
    with placed(field["edges"]):
        return reward_machine(propositions, edges, initial=initial, name=called)


def _edge(row: Field) -> Edge:
    if not isinstance(row.value, list) or len(row.value) != 4:
        row.wrong("[from, guard, to, reward]")
    return Edge(name(row[0]), text(row[1]), name(row[2]), number(row[3]))


def _named_in(guard: Field, known: Sequence[str]) -> set[str]:
    """Return the propositions that a guard names; all have to be ``known``."""
    names = set()
    for found in _NAME.finditer(guard.value):
        if found[0] not in (*known, *RESERVED):
            guard.fail(_unknown(found[0], known), at=found.start())
        names.add(found[0])
    return names


def _of_rule(
    field: Field, environment: TabularMDP, rules: Sequence[Rule]
) -> tuple[RewardMachine, TabularMDP]:
    """Pay whenever a rule becomes satisfied."""
    automata = {rule.name: rule.automaton for rule in rules}
    if not automata:
        field["rule"].fail("the task has no rules; give the [[rule]] that it names")
    rule, reward = automata[one_of(automata)(field["rule"])], take(field, "reward", number, 1.0)
    with placed(field["rule"]):
        machine = machine_from_rule(rule, reward=reward, proposition=_SATISFIED)
        return machine, label_with_rule(environment, rule, proposition=_SATISFIED)

"""The environment of a task: one of Gymnasium's, or made of the plants and of chances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from supremal._arrays import Ints
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.compose import components
from supremal.decisions.conditions import Factor, states_where
from supremal.decisions.guards import check_propositions
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.plant_process import process_of
from supremal.task._automata import agree
from supremal.task._fields import (
    Field,
    check_keys,
    choose,
    distinct,
    event,
    name,
    number,
    table,
    table_of,
    take,
    whole,
)
from supremal.task._slips import placed

_BY_ID: Final = ("id", "options", "actions", "marked", "labels", "events")
_OF_PLANTS: Final = ("chances", "labels")


def read_environment(
    field: Field,
    plants: Sequence[Automaton],
    known: Alphabet | None,
    *,
    rewards: bool,
    max_states: int | None,
) -> TabularMDP:
    """Read ``[environment]``.

    Parameters
    ----------
    field
        The table.
    plants
        What an environment that is given by chances is made of.
    known
        The events of ``[events]``, where they are given.
    rewards
        Whether the environment's own are wanted.
    max_states
        The most states of the plants together; None: what fits.
    """
    if choose(field, ("id", "chances"), (*_BY_ID, *_OF_PLANTS)) == "chances":
        check_keys(field, _OF_PLANTS)
        return _of_plants(field, plants, max_states)
    check_keys(field, _BY_ID)
    if plants:
        field["id"].fail("this environment is a plant of its own; leave out the [[plant]]s")
    model = _by_id(field, rewards=rewards)
    if known is not None:
        agree(field["id"], model.alphabet, known)
    return model


# --- by its id --------------------------------------------------------------------------------------------


def _by_id(field: Field, *, rewards: bool) -> TabularMDP:
    from supremal.envs.tabular import environment_model

    called = name(field["id"])
    if ":" in called:
        module, _, own = called.partition(":")
        field["id"].fail(
            f"{called!r} names a module to run, and a task file is data; say {own!r} here, and import the "
            f"module on the command line: supremal --import {module} ..."
        )
    said: dict[str, Any] = {
        "options": take(field, "options", lambda options: table(options).value, None),
        "labels": take(field, "labels", _labels, None),
        "events": take(field, "events", table_of(_condition), None),
        "marked": take(field, "marked", _condition, None),
        "actions": take(field, "actions", distinct(event), None),
    }
    told = [field[key] for key in ("options", "labels", "events") if key in field]
    with placed(field["id"], *told, table=field):
        return environment_model(called, rewards=rewards, **said)


def _labels(field: Field) -> dict[str, Any]:
    """Read the states in which propositions are true."""
    for key in table(field).value:
        with placed(field[key]):
            check_propositions([key])
    return table_of(_condition)(field)


def _condition(field: Field) -> Any:  # noqa: ANN401 - a list of numbers, or a table of anything
    if isinstance(field.value, list):
        return [whole()(element) for element in field.elements()]
    if not isinstance(field.value, dict):
        field.wrong("a table {factor = value}, or a list of state numbers,")
    return field.value


# --- of plants --------------------------------------------------------------------------------------------


def _of_plants(field: Field, plants: Sequence[Automaton], max_states: int | None) -> TabularMDP:
    """Make a process of the plants together; their states are its factors."""
    if not plants:
        field["chances"].fail("these are chances of what happens in plants; give a [[plant]]", key=True)
    chances = table_of(number)(field["chances"])
    with placed(field["chances"], field["chances"]):
        together, states = components(*plants, max_states=max_states)
        process = process_of(together, chances)
    labels = take(field, "labels", _labels, {})
    if not labels:
        return process
    return _labelled(process, field["labels"], plants, states)


def _labelled(process: TabularMDP, labels: Field, plants: Sequence[Automaton], states: Ints) -> TabularMDP:
    """Return ``process`` with propositions about its plants, of which ``states [S, K]`` are those."""
    of = states[process.origin[:, 0]]
    factors = {
        plant.name: Factor({plant.state_name(q): q for q in range(plant.n_states)}, of[:, k])
        for k, plant in enumerate(plants)
    }
    label = np.zeros(process.n_states, np.int64)
    for i, key in enumerate(labels.value):
        with placed(labels[key]):
            holds = states_where(table(labels[key]).value, f"label {key!r}", factors, process.n_states)
        label |= holds.astype(np.int64) << i
    with placed(labels):
        return replace(process, propositions=tuple(labels.value), label=label)

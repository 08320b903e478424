"""The parts of a file that `supremal show` can show, each under a name, and made when it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from supremal.automata.automaton import Automaton
from supremal.cli.models import TASK_ENDING, InputError
from supremal.decisions.reward_machine import RewardMachine
from supremal.errors import suggest
from supremal.formats import read_model
from supremal.formats._names import unique
from supremal.synthesis.causes import named
from supremal.synthesis.supervisor import Supervisor
from supremal.task.copy import TASK
from supremal.task.findings import plants_of, study
from supremal.task.reading import read_task
from supremal.task.task import Options

Shown: TypeAlias = Automaton | RewardMachine | Supervisor


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Something to show.

    Parameters
    ----------
    kind
        "plant", "rule", "reward machine" or "supervisor".
    name
        What it is asked for by.
    make
        Gives it.
    plants
        Of a supervisor: gives what it was synthesized for.
    """

    kind: str
    name: str
    make: Callable[[], Shown]
    plants: Callable[[], tuple[Automaton, ...]] = tuple


def parts_of(path: Path) -> list[Part]:
    """Return the parts of a model file, of a task file (``.toml``), or of the folder of a run.

    Raises
    ------
    InputError
        If it cannot be read.
    FormatError, ModelError
        If it is not laid out as its format wants.
    """
    if (path / TASK).is_file():
        path /= TASK
    if path.suffix == TASK_ENDING:
        return _task_parts(path)
    if path.is_dir() and not path.suffix:
        message = (
            f"{path} is a folder without a {TASK}; give the folder of a run, a task file or a model file"
        )
        raise InputError(message)
    try:
        model = read_model(path)
    except OSError as error:
        message = (
            f"cannot read {path}: {error.strerror}; give a model file, a task file or the folder of a run"
        )
        raise InputError(message) from None
    plants, rules = named(model.plants, "plant"), named(model.specs, "rule")
    found = [_part("plant", plant) for plant in plants] + [_part("rule", rule) for rule in rules]
    return _called([*found, *_supervisor(lambda: plants, rules, Options())])


def _task_parts(path: Path) -> list[Part]:
    task = read_task(path)
    found = [_part("plant", plant) for plant in task.plants]
    if task.environment is not None and not task.plants:
        found.append(Part("plant", "environment", lambda: plants_of(task)[0]))
    found += [_part("rule", replace(rule.drawn or rule.automaton, name=rule.name)) for rule in task.rules]
    machine = task.reward_machine
    if machine is not None:
        found.append(Part("reward machine", machine.name or "rewards", lambda: machine))
    rules = tuple(rule.automaton for rule in task.rules)
    return _called([*found, *_supervisor(lambda: plants_of(task), rules, task.options)])


def _part(kind: str, automaton: Automaton) -> Part:
    return Part(kind, automaton.name, lambda: automaton)


def _supervisor(
    plants: Callable[[], tuple[Automaton, ...]], rules: tuple[Automaton, ...], options: Options
) -> list[Part]:
    """Return the supervisor as a part, where there are rules that it could enforce."""
    if not rules:
        return []
    return [
        Part(
            "supervisor", "supervisor", lambda: study(plants(), rules, options, lost=False).supervisor, plants
        )
    ]


def _called(parts: list[Part]) -> list[Part]:
    """Return ``parts`` with names of which no two are the same."""
    names = unique(part.name for part in parts)
    return [Part(part.kind, name, part.make, part.plants) for part, name in zip(parts, names, strict=True)]


def find_part(parts: list[Part], name: str | None, path: Path) -> Part | None:
    """Return the part of this name, or the only one that there is; None where there is a choice.

    Raises
    ------
    InputError
        If there is none, or nothing at all.
    """
    if not parts:
        message = f"{path} has nothing to show: no plant, no rule, no reward machine"
        raise InputError(message)
    if name is None:
        return parts[0] if len(parts) == 1 else None
    for part in parts:
        if part.name == name:
            return part
    message = f"{path} has no part {name!r}; {suggest(name, [part.name for part in parts])}"
    raise InputError(message)

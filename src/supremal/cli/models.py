"""What ``supremal check`` and ``supremal synthesize`` are asked about, and the file of a supervisor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from supremal.automata.automaton import Automaton
from supremal.errors import FormatError, SupremalError
from supremal.formats import Model, read_model, write_model
from supremal.formats.files import find_ending
from supremal.synthesis.causes import named
from supremal.task.findings import Findings, plants_of
from supremal.task.reading import read_task
from supremal.task.task import Options

TASK_ENDING = ".toml"


class InputError(SupremalError):
    """Files that cannot be read, or do not go together."""


class OutputError(SupremalError):
    """A file that is there already, or cannot be written."""


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """What can happen, what is wanted, how that is meant, and what the answer rests on."""

    plants: tuple[Automaton, ...]
    rules: tuple[Automaton, ...]
    options: Options
    worst_case: bool = False


def read(paths: Sequence[Path], *, closed: bool, must_act: bool, max_states: int | None) -> Subject:
    """Return what a task file says, or the plants and the rules of several model files together.

    What the command line asks for comes before what a task file says.

    Raises
    ------
    InputError
        If a file cannot be opened, or a task file is not alone.
    FormatError, ModelError
        If one is not laid out as its format wants.
    """
    if any(path.suffix == TASK_ENDING for path in paths):
        if len(paths) > 1:
            message = f"{len(paths)} files, one of them a task file; a task file says it all: give it alone"
            raise InputError(message)
        task = read_task(paths[0])
        options = Options(
            nonblocking=task.options.nonblocking and not closed,
            must_act=task.options.must_act or must_act,
            max_states=max_states or task.options.max_states,
        )
        rules = tuple(rule.automaton for rule in task.rules)
        return Subject(plants_of(task), rules, options, worst_case=task.model == "anything")
    plants: list[Automaton] = []
    specs: list[Automaton] = []
    for path in paths:
        _check_ending(path)
        try:
            model = read_model(path)
        except OSError as error:
            message = f"cannot read {path}: {error.strerror}; give the path of a model file"
            raise InputError(message) from None
        plants += model.plants
        specs += model.specs
    options = Options(nonblocking=not closed, must_act=must_act, max_states=max_states)
    return Subject(named(plants, "plant"), named(specs, "rule"), options)


def _check_ending(path: Path) -> None:
    """Raise unless the ending of ``path`` is that of a model file."""
    try:
        find_ending(str(path))
    except FormatError as error:
        message = f"{error}, and {TASK_ENDING} for a task file"
        if path.is_dir():
            message = f"{path} is a folder; give a task file ({TASK_ENDING}) or a model file"
        raise InputError(message) from None


def check_place(path: Path, *, force: bool) -> None:
    """Raise if nothing can be written to ``path``, before any work is done."""
    find_ending(str(path))
    if path.exists() and not force:
        message = f"{path} exists already; choose another file with --out, or replace it with --force"
        raise OutputError(message)


def write(findings: Findings, path: Path) -> None:
    """Write the supervisor as a model of one automaton, its states named by those of the parts."""
    parts, automaton = (*findings.plants, *findings.rules), findings.supervisor.automaton
    states = tuple(
        ", ".join(part.state_name(q) for part, q in zip(parts, row, strict=True))
        for row in automaton.origin.tolist()
    )
    try:
        write_model(path, Model((replace(automaton, state_names=states, name="supervisor"),), ()))
    except OSError as error:
        message = f"cannot write {path}: {error.strerror}; choose another file with --out"
        raise OutputError(message) from None

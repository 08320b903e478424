"""Reading a task file: TOML in, a `Task` out.

The tables are read in the order in which they speak of each other: events, plants, the environment, rules,
the reward machine.  What is wrong in one of them is told together with what is wrong in others, unless it
could follow from it.  ``docs/task-file.md`` has every key.

A task file is data: nothing in it is run, the files that it names are data too, and an environment is one of
those that Gymnasium knows already.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final

from supremal.automata.alphabet import Alphabet, union
from supremal.automata.automaton import Automaton
from supremal.errors import FormatError
from supremal.formats.toml import Document, read_toml
from supremal.learning.settings import Settings
from supremal.rules.rule import Rule
from supremal.task._automata import read_events, read_plants
from supremal.task._environment import read_environment
from supremal.task._fields import Field, anything, check_keys, name, read_each, tables, take, text
from supremal.task._machine import read_machine
from supremal.task._rules import read_rules, rename
from supremal.task._settings import read_options, read_reported, read_run, read_settings
from supremal.task._slips import Slips, placed
from supremal.task.task import Options, Task

_KEYS: Final = (
    "name", "title", "source", "events", "plant", "environment", "rule", "reward_machine", "learner", "run",
    "check", "reported",
)  # fmt: skip
_MODEL: Final = ("events", "plant", "environment")


def read_task(source: str | Path | Document) -> Task:
    """Return the task that a file describes.

    Parameters
    ----------
    source
        The path of a TOML file, or what has been read from it.  Paths in it start from its own folder.

    Raises
    ------
    FormatError
        If it cannot be read, is no TOML, or says something that makes no task.  Gives line and column; the
        message names the key, and has a line for each of up to ten slips.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "walk.toml")
    ...     _ = path.write_text('''
    ...         [events]
    ...         controllable = ["l", "r"]
    ...         [[rule]]
    ...         pattern = "never_sequence"
    ...         sequence = ["l", "l"]
    ...     ''')
    ...     task = read_task(path)
    >>> task.name, task.model, task.rules[0].automaton
    ('walk', 'anything', <Automaton 'rule 1': 2 states, 3 transitions, 2 events>)
    """
    document = source if isinstance(source, Document) else read_document(source)
    path = Path(document.path)
    root, folder, slips = Field(document, (), document.data), path.parent, Slips()
    said = _settled(root, slips, path)
    known = None
    with slips.noting():
        known = take(root, "events", read_events, None)
        if not _is_misspelt(root):
            said |= _model(root, known, folder, said["options"].max_states)
    with slips.noting():
        said["rules"] = _rules(root, slips, said.get("alphabet", known), folder)
    if "reward_machine" in root and not slips.found:
        with slips.noting():
            said |= _machine(root["reward_machine"], said, folder)
    slips.check()
    return Task(path=document.path, **said)


def read_document(source: str | Path, kind: str = "task") -> Document:
    """Return what a TOML file says; ``kind`` is the file that is needed.

    Raises
    ------
    FormatError
        If it cannot be read, or is no TOML.
    """
    try:
        return read_toml(Path(source))
    except OSError as error:
        message = f"cannot read it: {error.strerror}; give the path of a {kind} file"
        raise FormatError(message, path=str(source)) from None


def _settled(root: Field, slips: Slips, path: Path) -> dict[str, Any]:
    """Read the fields of a task that depend on no others."""
    acts = "environment" in root
    said: dict[str, Any] = {"name": path.stem, "settings": Settings(), "options": Options(must_act=acts)}
    with slips.noting():
        check_keys(root, _KEYS)
    for key, read in (
        ("name", lambda field: {"name": name(field)}),
        ("title", lambda field: {"title": text(field)}),
        ("source", lambda field: {"source": text(field)}),
        ("learner", lambda field: {"settings": read_settings(field)}),
        ("check", lambda field: {"options": read_options(field, must_act=acts)}),
        ("run", lambda field: read_run(field, path.parent)),
        ("reported", lambda field: {"reported": tuple(read_each(tables(field), read_reported))}),
    ):
        with slips.noting():
            said |= take(root, key, read, {})
    return said


def _is_misspelt(root: Field) -> bool:
    """Return whether an unknown key may be meant to say what can happen, on which all else rests."""
    absent = [key for key in _MODEL if key not in root]
    return any(get_close_matches(key, absent) for key in root.value if key not in _KEYS)


def _model(root: Field, known: Alphabet | None, folder: Path, max_states: int | None) -> dict[str, Any]:
    """Read what can happen: the alphabet, the plants, the environment."""
    sigma, plants = known or Alphabet(()), dict[str, Automaton]()
    drawn = take(root, "plant", tables, [])
    for field, found in zip(drawn, read_each(drawn, lambda f: read_plants(f, known, folder)), strict=True):
        with placed(field):
            sigma = union(sigma, *(plant.alphabet for plant in found))
        for plant in found:
            called = plant.name or f"plant {len(plants) + 1}"
            _check_new(field, called, plants)
            plants[called] = replace(plant, name=called)
    model: dict[str, Any] = {"alphabet": sigma, "plants": tuple(plants.values())}
    if "environment" in root:
        environment = read_environment(
            root["environment"],
            model["plants"],
            known,
            rewards="reward_machine" not in root,
            max_states=max_states,
        )
        model |= {"environment": environment, "alphabet": known or environment.alphabet}
    elif not sigma:
        root.fail("there are no events; give [events], a [[plant]] or an [environment]")
    return model


def _rules(root: Field, slips: Slips, alphabet: Alphabet | None, folder: Path) -> tuple[Rule, ...]:
    rules: dict[str, Rule] = {}
    for field in take(root, "rule", tables, []):
        with slips.noting():
            for rule in read_rules(field, alphabet, folder):
                called = rule.name or f"rule {len(rules) + 1}"
                _check_new(field, called, rules)
                rules[called] = rename(rule, called)
    return tuple(rules.values())


def _check_new(field: Field, called: str, others: Container[str]) -> None:
    """Check that nothing else has this name."""
    if called in others:
        kind = field.path[0]
        message = f"another {kind} is called {called!r}; give each a name of its own"
        take(field, "name", anything, field).fail(message)


def _machine(field: Field, said: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Read what is worth how much; the environment may have to say more for it."""
    if "environment" not in said:
        field.fail("there is nothing that earns its rewards; give an [environment]", key=True)
    machine, told_earlier, environment = read_machine(
        field, said["environment"], said["rules"], folder, said["settings"].gamma
    )
    return {"reward_machine": machine, "shaped": told_earlier, "environment": environment}

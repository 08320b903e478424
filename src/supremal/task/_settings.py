"""How a task is learned, run and checked, and what its source reports: the fields of small dataclasses."""

from __future__ import annotations

from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin, get_type_hints

from supremal.learning.schedules import Schedule
from supremal.learning.settings import Settings
from supremal.task._fields import (
    Field,
    Reader,
    choose,
    name,
    need,
    number,
    one_of,
    switch,
    take_all,
    text,
    whole,
)
from supremal.task._slips import placed
from supremal.task.task import REPORTABLE, Options, Reported


def _said(field: Field, kind: type) -> dict[str, Any]:
    """Read a table whose keys are the fields of a dataclass, each as its type has it."""
    return take_all(field, {key: _reader(hint) for key, hint in get_type_hints(kind).items()})


def _reader(hint: Any) -> Reader[Any]:  # noqa: ANN401 - a type is an object like others
    """Return the reader of what a field of this type takes."""
    plain: dict[Any, Reader[Any]] = {
        bool: switch,
        int: whole(1),
        float: number,
        str: text,
        str | float: _word,
        float | Schedule: _rate,
    }
    if hint in plain:
        return plain[hint]
    if get_origin(hint) is Literal:
        return one_of([word for word in get_args(hint) if word])
    (inner,) = (one for one in get_args(hint) if one is not NoneType)
    return _reader(inner)


def _word(field: Field) -> str | float:
    """Read a number, or what is said in its place."""
    return name(field) if isinstance(field.value, str) else number(field)


def _rate(field: Field) -> float | Schedule:
    """Read a number, or a table that says how it changes."""
    if not isinstance(field.value, dict):
        return number(field)
    need(field, "kind", name, "the kind of a schedule")
    said = _said(field, Schedule)
    with placed(field, table=field):
        return Schedule(**said)


def read_settings(field: Field) -> Settings:
    """Read ``[learner]``."""
    said = _said(field, Settings)
    with placed(field, table=field):
        return Settings(**said)


def read_options(field: Field, *, must_act: bool) -> Options:
    """Read ``[check]``; what it does not say of having to act is ``must_act``."""
    return Options(**{"must_act": must_act} | _said(field, Options))


def read_run(field: Field, folder: Path) -> dict[str, Any]:
    """Read ``[run]`` as fields of a task; ``out`` starts from the ``folder`` of the task file."""
    return take_all(
        field,
        {
            "seed": whole(),
            "seeds": whole(1),
            "interval": whole(1),
            "out": lambda path: folder / name(path),
        },
    )


def read_reported(field: Field) -> Reported:
    """Read one ``[[reported]]``."""
    way = choose(field, ("key", "curve"), get_type_hints(Reported))
    if way == "key":
        one_of(REPORTABLE)(field["key"])
    said = _said(field, Reported)
    need(field, "what", name, "the name of a number")
    need(field, "said", _word, "a number, or a text,")
    if way == "curve":
        need(field, "episodes", whole(1), "the last episode of an interval")
    elif "episodes" in field:
        field["episodes"].fail("goes with curve; leave it out", key=True)
    with placed(field, field):
        return Reported(**said)

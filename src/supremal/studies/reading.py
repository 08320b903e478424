"""Reading a study file: TOML in, a `Study` out.

Every setting is the task file read again with other values, before anything is learned, so that what is
wrong with a value is told at once, with its place in the study file.  ``docs/studies.md`` has every key.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, Final, NoReturn

from supremal import __version__
from supremal.errors import FormatError, ModelError
from supremal.formats.toml import Document
from supremal.studies._axes import read_axes
from supremal.studies._changes import changed
from supremal.studies.study import LOWER_IS_BETTER, Metric, Setting, Study
from supremal.task._fields import Field, check_keys, name, need, one_of, shown, take, whole
from supremal.task._settings import read_settings
from supremal.task.reading import read_document, read_task
from supremal.task.task import Task

_KEYS: Final = ("name", "task", "seeds", "metric", "grid", "random")
_IDLE: Final = ("name", "title", "source", "run", "reported", "learner")
"""The tables of a task file that its model does not depend on, but for γ, which shaped rewards do."""

_Values = Mapping[str, tuple[Any, Field]]


def read_study(source: str | Path) -> Study:
    r"""Return the study that a file describes.

    Parameters
    ----------
    source
        The path of a TOML file.  The task's path starts from its folder.

    Raises
    ------
    FormatError
        If it or its task cannot be read, or a value makes no task.  Gives file, line and column.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "ice.toml").write_text("[environment]\nid = 'FrozenLake-v1'")
    ...     path = Path(folder, "rates.toml")
    ...     _ = path.write_text('''
    ...         task = "ice.toml"
    ...         seeds = 3
    ...         [grid]
    ...         learner.alpha = [0.05, 0.1]
    ...     ''')
    ...     study = read_study(path)
    >>> study.name, study.seeds, [setting.values for setting in study.settings]
    ('rates', (0, 1, 2), [{'learner.alpha': 0.05}, {'learner.alpha': 0.1}])
    """
    path = Path(source)
    document = read_document(path, "study")
    root = Field(document, (), document.data)
    check_keys(root, _KEYS)
    task = need(root, "task", _task, "the path of a task file")
    called = take(root, "name", _called, path.stem)
    seeds = take(root, "seeds", _seeds, (0,))
    metric: Metric = take(root, "metric", one_of(LOWER_IS_BETTER), "gap")
    reader = _Reader(task)
    settings = tuple(reader.setting(number, values) for number, values in enumerate(read_axes(root)))
    return Study(
        name=called,
        task=task.path,
        settings=settings,
        seeds=seeds,
        models=tuple(reader.models),
        metric=metric,
        fingerprint=reader.fingerprint(settings),
    )


def _task(field: Field) -> Document:
    """Read the path of a task file, from the folder of the study; return what is there."""
    path = Path(field.document.path).parent / name(field)
    if not path.is_file():
        field.fail(f"there is no file {str(path)!r}; the path of a task file is needed")
    return read_document(path)


def _called(field: Field) -> str:
    """Read a name that files can have."""
    if Path(name(field)).name != field.value:
        field.wrong("a name without /")
    return name(field)


def _seeds(field: Field) -> tuple[int, ...]:
    """Read a list of seeds, or how many, counted up from 0."""
    if not isinstance(field.value, list):
        return tuple(range(whole(1)(field)))
    seeds = tuple(whole()(element) for element in field.elements())
    if not seeds or len(set(seeds)) < len(seeds):
        field.wrong("a list of different seeds")
    return seeds


class _Reader:
    """Reads the settings of a study; ``models`` are the tasks that they were found to need so far."""

    def __init__(self, task: Document) -> None:
        self.task = task
        self.models: list[Task] = []
        self.files: set[str] = set()
        self._known: dict[str, int] = {}

    def setting(self, number: int, values: _Values) -> Setting:
        plain = {key: value for key, (value, _) in values.items()}
        try:
            document = changed(self.task, plain)
            known = _model_of(document.data)
            if known not in self._known:
                self.models.append(_learnable(read_task(document)))
                self.files.update(_files(document.data))
                self._known[known] = len(self.models) - 1
            learner = document.data.get("learner", {})
            settings = read_settings(Field(document, ("learner",), learner))
        except (FormatError, ModelError) as error:
            _blame(error, number, values)
        return Setting(plain, self._known[known], settings)

    def fingerprint(self, settings: Sequence[Setting]) -> str:
        """Return a hash of the task, the files that it names, and what ``settings`` change."""
        changes = [setting.values for setting in settings]
        said = json.dumps([__version__, self.task.data, changes], sort_keys=True, default=str)
        digest = sha256(said.encode())
        for file in sorted(self.files):
            digest.update(f"\n{file}\n".encode())
            digest.update((Path(self.task.path).parent / file).read_bytes())
        return digest.hexdigest()


def _learnable(task: Task) -> Task:
    if task.environment is None:
        message = "a study learns; give the task the id of an [environment], or the chances of its plants"
        raise FormatError(message, path=task.path)
    return task


def _model_of(data: Mapping[str, Any]) -> str:
    """Return, as a text, what the model of a task depends on."""
    kept = {key: value for key, value in data.items() if key not in _IDLE}
    machine, learner = (data.get(key) for key in ("reward_machine", "learner"))
    if isinstance(machine, dict) and "shaping" in machine and isinstance(learner, dict):
        kept["learner"] = {"gamma": learner.get("gamma")}
    return json.dumps(kept, sort_keys=True, default=str)


def _files(data: Mapping[str, Any]) -> list[str]:
    """Return the files that a task names."""
    tables = [*data.get("plant", ()), *data.get("rule", ()), data.get("reward_machine", {})]
    return [table["file"] for table in tables if "file" in table]


def _blame(error: FormatError | ModelError, number: int, values: _Values) -> NoReturn:
    """Raise ``error`` at the value that it is about; where it is about none, say which setting has it."""
    message = error.message if isinstance(error, FormatError) else str(error)
    for key, (value, field) in values.items():
        if message.startswith((f"{key}:", f"{key}.")):
            field.fail(f"{shown(value)} makes no task: {message}")
    if not isinstance(error, FormatError) or not values:
        raise error
    said = ", ".join(f"{key} = {shown(value)}" for key, (value, _) in values.items())
    message = f"{message}\nin setting {number} of the study: {said}"
    raise FormatError(message, path=error.path, line=error.line, column=error.column) from None

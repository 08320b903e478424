"""The results of a study: a row for each cell that is finished, in one Parquet file.

Whenever rows come, the file is written anew beside its place and moved there, so that it is whole at any
moment, and what was finished before a program was killed is in it.  A study that is run again reads it, and
runs what is missing.

Columns: ``setting``, each key that varies, and the other fields of a `Row`; rows are in the order of settings
and seeds.  Values that Parquet has no column for, such as schedules or a mixture of types, are JSON.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any, Final, get_args, get_type_hints

from supremal import __version__
from supremal.errors import FormatError, SupremalError
from supremal.studies._parquet import read_parquet, write_parquet
from supremal.studies.study import Cell, Study
from supremal.studies.trial import Row

_KINDS: Final[dict[str, type]] = {
    name: next((one for one in get_args(hint) if one is not type(None)), hint)
    for name, hint in get_type_hints(Row).items()
}
"""The type of each field of a row, where it is not None."""


class ResultsError(SupremalError):
    """A file of results that cannot be written."""


class Results:
    """The rows of a study, and the file that they are in.

    Parameters
    ----------
    path
        The file; where there is one already, its rows are taken up.
    study
        What they are the results of.

    Raises
    ------
    FormatError
        If the file is that of another study, or no Parquet file.
    """

    def __init__(self, path: str | Path, study: Study) -> None:
        self.path, self.study = Path(path), study
        self.rows: dict[Cell, Row] = {}
        self._varied = _varied(study)
        if self.path.exists():
            self._take_up()

    def _take_up(self) -> None:
        columns, notes = read_parquet(self.path)
        names = {field.name for field in fields(Row)}
        if notes.get("fingerprint") != self.study.fingerprint or not names <= columns.keys():
            message = (
                "this file has other results: of another study, or from before the study, its task or "
                "supremal was changed; choose another file with --out, or remove it"
            )
            raise FormatError(message, path=str(self.path))
        for values in zip(*(columns[name] for name in _KINDS), strict=True):
            row = Row(*values)
            self.rows[row.setting, row.seed] = row

    @property
    def missing(self) -> list[Cell]:
        """The cells that are still to be run, in order."""
        return [cell for cell in self.study.cells if cell not in self.rows]

    def add(self, rows: Iterable[Row]) -> None:
        """Take up rows, and write the file.

        Raises
        ------
        ResultsError
            If it cannot be written.
        """
        new = {(row.setting, row.seed): row for row in rows}
        self.rows = dict(sorted((self.rows | new).items()))
        work = self.path.with_name(f"{self.path.name}.{os.getpid()}.partial")
        notes = {"supremal": __version__, "study": self.study.name, "fingerprint": self.study.fingerprint}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            write_parquet(work, self._columns(), notes)
            with work.open("rb+") as file:
                os.fsync(file.fileno())
            work.replace(self.path)
        except OSError as error:
            message = f"cannot write {self.path}: {error.strerror}; choose another file with --out"
            raise ResultsError(message) from None
        finally:
            with suppress(OSError):
                work.unlink()

    def _columns(self) -> dict[str, tuple[type, list[Any]]]:
        rows = self.rows.values()
        own = {name: (kind, [getattr(row, name) for row in rows]) for name, kind in _KINDS.items()}
        varied = {
            key: (kind, [values[row.setting] for row in rows]) for key, (kind, values) in self._varied.items()
        }
        return {"setting": own["setting"], **varied, **own}


def _varied(study: Study) -> dict[str, tuple[type, list[Any]]]:
    """Return the type of each key that varies, and its value in every setting."""
    keys = study.settings[0].values
    return {key: _column([setting.values[key] for setting in study.settings]) for key in keys}


def _column(values: list[Any]) -> tuple[type, list[Any]]:
    kinds = {type(value) for value in values}
    if len(kinds) == 1 and kinds <= {bool, int, float, str}:
        return kinds.pop(), values
    if kinds == {int, float}:
        return float, [float(value) for value in values]
    return str, [json.dumps(value, default=str, ensure_ascii=False) for value in values]

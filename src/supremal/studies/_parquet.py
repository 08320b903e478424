"""The one module that imports pyarrow: a table of columns in a Parquet file, and what is noted beside it.

Source: the Apache Parquet format, parquet.apache.org.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from supremal.errors import FormatError, MissingDependencyError

try:
    import pyarrow as pa
    from pyarrow import parquet
except ImportError:
    package = "pyarrow"
    raise MissingDependencyError(package, extra="study", purpose="keeping the results of a study") from None

__all__ = ["read_parquet", "write_parquet"]

_NOTES: Final = b"supremal"
_TYPES: Final = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}


def write_parquet(
    path: Path, columns: Mapping[str, tuple[type, list[Any]]], notes: Mapping[str, str]
) -> None:
    """Write columns, each of a type and with None where there is nothing, and ``notes`` about them."""
    table = pa.table({name: pa.array(values, _TYPES[kind]) for name, (kind, values) in columns.items()})
    parquet.write_table(table.replace_schema_metadata({_NOTES: json.dumps(notes)}), path)


def read_parquet(path: Path) -> tuple[dict[str, list[Any]], dict[str, str]]:
    """Return the columns of a file, and the notes that `write_parquet` made beside them.

    Raises
    ------
    FormatError
        If it is no Parquet file.
    """
    try:
        with parquet.ParquetFile(path) as file:  # opened once: it may be replaced at any moment
            table = file.read()
        notes = json.loads((table.schema.metadata or {}).get(_NOTES, b"{}"))
    except (pa.ArrowException, OSError, ValueError) as error:
        message = f"cannot be read as Parquet: {str(error).splitlines()[0]}; choose another file with --out"
        raise FormatError(message, path=str(path)) from None
    return table.to_pydict(), notes

"""A task file and the files that it names, copied to where a run keeps them."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Final

from supremal.formats.toml import KeyPath, read_toml

TASK: Final = "task.toml"
"""What a run calls its task file."""

_FILES: Final = "files"
_STRING: Final = re.compile(r'"""(.*?)"""|\'\'\'(.*?)\'\'\'|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'', re.DOTALL)


def copy_task(source: str | Path, folder: Path) -> None:
    """Copy a task file that reads to ``folder``, as ``task.toml``, and what it names to ``files`` beside it.

    Only the names of the files change in the copy, so that it reads wherever the folder is moved.
    """
    document = read_toml(source)
    text, start = document.text, Path(source).parent
    named = [path for path in document.places if _names_a_file(path)]
    copies: dict[Path, str] = {}
    for path in sorted(named, key=lambda path: document.places[path].value, reverse=True):
        value = document.data
        for part in path:
            value = value[part]  # type: ignore[index] # the places are those of the data
        original = (start / str(value)).resolve()
        if original not in copies:
            copies[original] = f"{_FILES}/{len(copies)}-{original.name}"
            (folder / _FILES).mkdir(exist_ok=True)
            shutil.copyfile(original, folder / copies[original])
        at = document.places[path].value
        string = _STRING.match(text, at)
        if string is not None:
            text = text[:at] + json.dumps(copies[original]) + text[string.end() :]
    (folder / TASK).write_text(text, encoding="utf-8", newline="\n")


def _names_a_file(path: KeyPath) -> bool:
    return path[-1] == "file" and path[0] in ("plant", "rule", "reward_machine")

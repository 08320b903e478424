"""The tutorial, done as it says: files written, commands typed, programs run, what is shown compared."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from pages import TUTORIAL

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PROGRAMS = {"supremal": [sys.executable, "-m", "supremal"], "python": [sys.executable]}


def is_as_shown(printed: str, shown: list[str]) -> bool:
    """Return whether ``printed`` is what the page shows, where `...` is anything."""
    anything = "".join(f"{line}\n" for line in shown).replace("\n...\n", "\n...")
    pattern = ".*".join(re.escape(part) for part in anything.removesuffix("\n").split("..."))
    return re.fullmatch(pattern + r"\s*", printed, re.DOTALL) is not None


def type_in(block: str, folder: Path) -> None:
    """Run the commands of a console block; fail where one prints something else than the page shows."""
    for said in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, *shown = said.splitlines()
        program, *arguments = shlex.split(command)
        done = subprocess.run(
            [*PROGRAMS[program], *arguments], cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode in {0, 1}, f"{command}\n{done.stderr}"
        assert is_as_shown(done.stdout, shown), f"{command}\n{done.stdout}"


def test_tutorial_can_be_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    counts = dict.fromkeys(("toml", "console", "python", "text"), 0)
    for kind, block in BLOCK.findall(TUTORIAL.read_text(encoding="utf-8")):
        counts[kind] += 1
        if kind == "toml":
            name = block.splitlines()[0].removeprefix("# ")
            (tmp_path / name).write_text(block, encoding="utf-8")
        elif kind == "console":
            type_in(block, tmp_path)
        elif kind == "python":
            done = subprocess.run(
                [sys.executable, "-W", "error", "-c", block],
                cwd=tmp_path,
                text=True,
                capture_output=True,
                check=False,
            )
            assert not done.returncode, done.stderr
    assert counts == {"toml": 3, "console": 7, "python": 1, "text": 1}

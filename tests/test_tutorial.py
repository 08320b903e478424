"""The tutorial, done as it says: files written, commands typed, programs run, what is shown compared."""

import re
import subprocess
import sys
from pathlib import Path

from pages import TUTORIAL, type_in

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_tutorial_can_be_followed(tmp_path: Path) -> None:
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

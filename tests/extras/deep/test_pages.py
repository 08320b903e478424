"""The published text runs as printed, and a newcomer's path is short."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


def blocks(name: str) -> list[str]:
    """Return the blocks of a page that need the extra."""
    parts = (ROOT / name).read_text(encoding="utf-8").split("```python deep\n")[1:]
    return [part.split("```")[0] for part in parts]


@pytest.mark.parametrize("name", ["README.md", "docs/deep.md"])
def test_the_blocks_run_as_printed(name: str, tmp_path: Path) -> None:
    found = blocks(name)
    assert found, f"{name} has no block for this extra"
    script = tmp_path / "page.py"
    script.write_text("\n".join(found), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error", script], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_newcomer_needs_fifteen_lines_at_most() -> None:
    (first,) = blocks("README.md")
    assert len([line for line in first.splitlines() if line.strip()]) <= 15
    assert first in blocks("docs/deep.md")

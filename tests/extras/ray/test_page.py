"""What ``docs/studies.md`` shows runs as it stands.

It has a program of its own: once a process had a cluster of ``--ray local``, it asks others for Ray's token.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "studies.md"


def blocks(kind: str) -> list[str]:
    """Return what stands between the fences of one kind."""
    return [block.split("```")[0] for block in PAGE.read_text(encoding="utf-8").split(f"```{kind}\n")[1:]]


def test_the_page_runs_as_printed(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    study, code = blocks("toml study"), blocks("python ray")
    assert study
    assert code
    (tmp_path / "study.toml").write_text(study[0], encoding="utf-8")
    (tmp_path / "page.py").write_text("\n".join(code), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "page.py"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout == blocks("text page")[0]

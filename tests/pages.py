"""The Python blocks of a published page, run as they are printed.

A fence ``python`` runs with the core alone, ``python deep`` where the extra `deep` is installed, and so on.
"""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TUTORIAL = ROOT / "docs" / "tutorial.md"  # is typed in as a whole
PAGES = [
    ROOT / "README.md",
    *sorted({*(ROOT / "docs").rglob("*.md")} - {TUTORIAL}),
    *sorted((ROOT / "examples").rglob("*.md")),
]


def code_of(page: Path, extra: str = "") -> str:
    """Return the blocks for ``extra``, each in its own lines: so a traceback names the lines of the page."""
    opening = f"```python {extra}".rstrip()
    inside, lines = False, []
    for line in page.read_text(encoding="utf-8").splitlines():
        fence = line.startswith("```")
        inside = line == opening or (inside and not fence)
        lines.append(line if inside and not fence else "")
    return "\n".join(lines)


def pages_with(extra: str) -> list[Path]:
    """Return the pages that have blocks for ``extra``."""
    return [page for page in PAGES if code_of(page, extra).strip()]


def name_of(page: Path) -> str:
    """Return the path that a report shows for ``page``."""
    return str(page.relative_to(ROOT))


def run_page(page: Path, folder: Path, extra: str = "") -> None:
    """Run the blocks of ``page`` for ``extra`` as one program beside the examples; a warning is an error."""
    (folder / "examples").symlink_to(ROOT / "examples")
    script = folder / page.with_suffix(".py").name
    script.write_text(code_of(page, extra), encoding="utf-8")
    run(sys.executable, "-W", "error", script, cwd=folder)


def run(*command: str | Path, cwd: Path) -> str:
    """Return what ``command`` prints; where it fails, fail with what it said."""
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.fail(f"{command[0]} {command[1]} ...: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout

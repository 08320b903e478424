"""The blocks of a published page, run as they are printed.

A fence ``python`` runs with the core alone, ``python deep`` where the extra `deep` is installed, and so on.
A fence ``console`` has commands behind ``$``, and what they print; ``...`` stands for anything.
"""

import os
import re
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


def lay_out(folder: Path) -> None:
    """Put into ``folder`` what pages take to be beside them."""
    for name in ("examples", "tests"):
        (folder / name).symlink_to(ROOT / name)


def run_page(page: Path, folder: Path, extra: str = "") -> None:
    """Run the blocks of ``page`` for ``extra`` as one program beside the examples; a warning is an error."""
    lay_out(folder)
    script = folder / page.with_suffix(".py").name
    script.write_text(code_of(page, extra), encoding="utf-8")
    run(sys.executable, "-W", "error", script, cwd=folder)


def consoles_of(page: Path) -> list[str]:
    """Return the console blocks of ``page``."""
    return re.findall(r"^```console\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def type_in(block: str, folder: Path, *, all_of_it: bool = True) -> None:
    """Run the commands of a console block in ``folder``; fail where one prints something else than is shown.

    Unless ``all_of_it`` is wanted, commands that are shown without what they print are left out.
    """
    programs = folder / ".programs"
    programs.mkdir(exist_ok=True)
    for name, what in (("supremal", f"{sys.executable} -m supremal"), ("python", sys.executable)):
        (programs / name).write_text(f'#!/bin/sh\nexec {what} "$@"\n', encoding="utf-8")
        (programs / name).chmod(0o755)
    env = os.environ | {"PATH": f"{programs}:{os.environ['PATH']}", "COLUMNS": "200"}
    for said in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, *shown = said.splitlines()
        if shown or all_of_it:
            done = subprocess.run(
                ["bash", "-c", command], cwd=folder, env=env, capture_output=True, text=True, check=False
            )
            assert done.returncode in {0, 1}, f"{command}\n{done.stderr}"
            assert is_as_shown(done.stdout, shown), f"{command}\n{done.stdout}"


def is_as_shown(printed: str, shown: list[str]) -> bool:
    """Return whether ``printed`` is what a page shows, where `...` is anything."""
    anything = "".join(f"{line}\n" for line in shown).replace("\n...\n", "\n...")
    pattern = ".*".join(re.escape(part) for part in anything.removesuffix("\n").split("..."))
    return re.fullmatch(pattern + r"\s*", printed, re.DOTALL) is not None


def run(*command: str | Path, cwd: Path) -> str:
    """Return what ``command`` prints; where it fails, fail with what it said."""
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.fail(f"{command[0]} {command[1]} ...: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout

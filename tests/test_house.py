"""The gates of the house: the front door, the wheel, the published text."""

import json
import os
import re
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

import supremal
from pages import PAGES, ROOT, consoles_of, lay_out, name_of, run, run_page, type_in

SOURCE = ROOT / "src" / "supremal"
HEAVY = {
    "gymnasium", "matplotlib", "moviepy", "numba", "pettingzoo", "pyarrow", "ray", "stable_baselines3",
    "tensorboard", "torch",
}  # fmt: skip
IMPORT_SECONDS = 0.5


def files_of(package: Path) -> set[Path]:
    """Return the files of ``package``, without what Python and numba cache beside them."""
    folders = os.walk(package, followlinks=True)  # the examples are linked to
    files = (Path(folder, name).relative_to(package) for folder, _, names in folders for name in names)
    return {file for file in files if "__pycache__" not in file.parts}


def test_front_door_is_sorted_and_documented() -> None:
    names = supremal.__all__
    assert names == sorted(set(names))
    assert [name for name in names if not (getattr(supremal, name).__doc__ or "").strip()] == []


def test_import_is_light(tmp_path: Path) -> None:
    script = """if True:
        import json, sys, time
        begin = time.process_time()  # the time that it takes where nothing else runs
        import supremal
        print(json.dumps([time.process_time() - begin, list(sys.modules)]))
    """
    runs = [json.loads(run(sys.executable, "-c", script, cwd=tmp_path)) for _ in range(5)]
    assert HEAVY.isdisjoint(runs[0][1])
    assert min(seconds for seconds, _ in runs) < IMPORT_SECONDS


def test_wheel_works_away_from_the_sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", tmp_path, ROOT, cwd=tmp_path)
    (wheel,) = tmp_path.glob("supremal-*.whl")
    home = tmp_path / "venv"
    venv.create(home, symlinks=True)
    base = {"base": str(home), "platbase": str(home)}
    python = Path(sysconfig.get_path("scripts", "venv", base)) / Path(sys.executable).name
    site = Path(sysconfig.get_path("purelib", "venv", base))
    monkeypatch.delenv("PYTHONPATH", raising=False)
    run(sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", wheel, cwd=tmp_path)
    # The dependencies come from here; a path named in a .pth brings no other .pth along, so not the sources.
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib"), encoding="utf-8")

    assert Path(run(python, "-c", "import supremal; print(supremal.__file__)", cwd=tmp_path).strip()) == (
        site / "supremal" / "__init__.py"
    )
    assert files_of(site / "supremal") == files_of(SOURCE)
    assert supremal.__version__ in run(python.with_name("supremal"), "--version", cwd=tmp_path)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_python_blocks_run_as_printed(page: Path, tmp_path: Path) -> None:
    run_page(page, tmp_path)


@pytest.mark.parametrize(
    "page", [page for page in PAGES if consoles_of(page) and "examples" not in page.parts], ids=name_of
)
def test_consoles_show_what_is_printed(page: Path, tmp_path: Path) -> None:
    lay_out(tmp_path)
    for block in consoles_of(page):
        type_in(block, tmp_path, all_of_it=False)


def test_no_address_of_a_package_registry() -> None:
    listed = run("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", cwd=ROOT)
    address = re.compile(rb"https?://[^\s\"]*(pypi|pythonhosted|npmjs|debian)\.")
    files = [ROOT / name for name in listed.split("\0") if name]
    assert [str(file) for file in files if file.is_file() and address.search(file.read_bytes())] == []

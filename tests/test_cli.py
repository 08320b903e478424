"""The command line, as a user meets it."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from supremal.cli import main

FILES = [
    "completion.png",
    "completion.svg",
    "config.json",
    "curves.csv",
    "learned.npz",
    "regret.png",
    "regret.svg",
    "report.html",
    "result.json",
    "score.png",
    "score.svg",
    "task.toml",
]


def demo(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["demo", *arguments])


def test_a_run_is_written_whole(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "run"
    result = demo("--episodes", "12000", "--seed", "7", "--out", str(out))
    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in out.iterdir()) == FILES
    assert sorted(path.name for path in out.parent.iterdir()) == ["run"]
    assert "The rules can be kept as they stand." in result.output
    config = json.loads((out / "config.json").read_text())
    assert (config["seed"], config["settings"]["episodes"]) == (7, 12_000)
    rows = list(csv.DictReader((out / "curves.csv").read_text().splitlines()))
    assert [(row["learner"], row["episodes"]) for row in rows] == [
        ("supervised", "10000"),
        ("supervised", "12000"),
        ("baseline", "10000"),
        ("baseline", "12000"),
    ]


def test_json_is_what_the_file_holds_and_the_seed_settles_it(tmp_path: Path) -> None:
    results = []
    for name in ("a", "b"):
        got = demo("--episodes", "300", "--seeds", "2", "--json", "--out", str(tmp_path / name))
        assert got.exit_code == 0
        document = json.loads(got.stdout)
        assert document == json.loads((tmp_path / name / "result.json").read_text())
        del document["check"]["seconds"]
        for learner in ("training", "baseline"):
            del document[learner]["seconds"], document[learner]["steps_per_second"]
        results.append(document)
    assert results[0] == results[1]
    assert len(results[0]["per_seed"]) == 2
    wanted = {
        "product": {"states", "state_actions"},
        "optimal": {"value", "expected_steps", "steps_undisturbed", "completion_within_limit"},
        "greedy": {"value", "completion"},
        "training": {"violations", "steps", "score", "completion"},
        "baseline": {"violations"},
    }
    for part, keys in wanted.items():
        assert keys <= results[0][part].keys()


def test_the_default_folder_is_under_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert demo("--episodes", "10", "--preset", "published").exit_code == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert run.name.startswith("pickup-delivery-published-0-")


def test_an_existing_run_is_never_overwritten(tmp_path: Path) -> None:
    result = demo("--episodes", "10", "--out", str(tmp_path))
    assert result.exit_code == 2
    reason = "exists already, and a run is never overwritten; choose another folder with --out"
    assert result.stderr == f"Error: {tmp_path} {reason}\n"


def test_an_unwritable_folder_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    result = demo("--episodes", "10", "--out", str(tmp_path / "file" / "run"))
    assert result.exit_code == 2
    assert "cannot write to" in result.stderr
    assert "choose another folder with --out" in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "arguments", [["--episodes", "0"], ["--preset", "other"], ["--seed", "-1"], ["--seeds", "x"]]
)
def test_bad_options_exit_with_2(arguments: list[str]) -> None:
    assert demo(*arguments).exit_code == 2


def test_without_matplotlib_nothing_is_begun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "supremal.show._matplotlib", raising=False)
    result = demo("--episodes", "10", "--out", str(tmp_path / "run"))
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr == "Error: drawing figures needs matplotlib: pip install 'supremal[plot]'\n"
    assert not list(tmp_path.iterdir())


def test_ctrl_c_leaves_a_usable_partial_run(tmp_path: Path) -> None:
    out = tmp_path / "run"
    command = [sys.executable, "-m", "supremal", "demo", "--episodes", "5000000", "--out", str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if line.startswith("  supervised 1:"):
                process.send_signal(signal.SIGINT)
                break
        rest = process.stdout.read()
        assert process.wait() == 130, rest
    assert "Stopped before the end" in rest
    assert sorted(path.name for path in out.iterdir()) == sorted([*FILES, "checkpoints"])
    result = json.loads((out / "result.json").read_text())
    assert result["partial"]
    assert result["baseline"] is None
    assert result["training"]["episodes"] < 5_000_000

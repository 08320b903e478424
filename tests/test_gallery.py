"""The gallery: its pages quote what is printed, what is learned is optimal, and no rule is ever broken."""

from __future__ import annotations

import re
import shlex
from functools import cache
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from rich.console import Console

from supremal import evaluate, value_iteration
from supremal.cli import main
from supremal.cli.text import describe
from supremal.decisions.evaluation import Evaluation
from supremal.task.experiment import check, run, supervise
from supremal.task.reading import read_task
from supremal.task.summary import summary

ROOT = Path(__file__).parents[1]
GALLERY = ROOT / "examples" / "gallery"
NAMES = ["appliances", "job_shop", "taxi", "tool_agent", "traffic_light", "warehouse"]
RAIN = ("taxi", "is_rainy = false", "is_rainy = true")


@cache
def result_of(name: str) -> dict[str, Any]:
    """What `supremal run` finds; the report is left out."""
    task = read_task(GALLERY / name / "task.toml")
    return summary(run(task, check(task)))


def page_of(name: str) -> str:
    return (GALLERY / name / "README.md").read_text(encoding="utf-8")


def printed(command: str) -> str:
    """What a command prints, as a page quotes it: without blanks at the ends of lines."""
    program, verb, *arguments = shlex.split(command)
    assert program == "supremal"
    if verb == "run":
        out = StringIO()
        describe(Console(file=out, width=110), result_of(Path(arguments[0]).parent.name), Path("runs"))
        told = out.getvalue()
    else:
        result = CliRunner().invoke(main, [verb, *arguments])
        assert result.exit_code in (0, 1), result.output
        told = result.output
    return "".join(f"{line.rstrip()}\n" for line in told.splitlines())


def changed(name: str, old: str, new: str) -> str:
    text = (GALLERY / name / "task.toml").read_text(encoding="utf-8")
    assert text.count(old) == 1
    return text.replace(old, new)


def rule(text: str, name: str) -> str:
    """The table of a rule."""
    found = re.search(rf'\[\[rule]]\nname = "{name}".*\n(?:.+\n)+', text)
    assert found is not None
    return found[0]


def optimum(path: Path) -> Evaluation:
    """The exact evaluation of an optimal policy."""
    task = read_task(path)
    assert task.environment is not None
    model, enabled = supervise(task.environment, task)
    gamma = task.settings.gamma
    policy = value_iteration(model, gamma=gamma, enabled=enabled).policy
    return evaluate(model, policy, gamma=gamma, horizon=1)


def test_the_gallery_is_whole() -> None:
    assert sorted(folder.name for folder in GALLERY.iterdir() if folder.is_dir()) == NAMES
    index = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    for name in NAMES:
        assert f"../examples/gallery/{name}/README.md" in index


@pytest.mark.parametrize("name", NAMES)
def test_a_page_quotes_what_is_printed(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "RAIN.toml").write_text(changed(*RAIN), encoding="utf-8")
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"^```console\n\$ (.*)\n((?:.*\n)*?)```$", page_of(name), re.MULTILINE)
    assert {shlex.split(command)[1] for command, _ in blocks} >= {"check", "run"}
    for command, quoted in blocks:
        told, at = printed(command.replace("RAIN.toml", str(tmp_path / "RAIN.toml"))), 0
        for part in re.split(r"^\.\.\.\n", quoted, flags=re.MULTILINE):
            assert part in told[at:], (command, part)
            at = told.index(part, at) + len(part)


@pytest.mark.parametrize("name", NAMES)
def test_the_optimum_is_learned_and_no_rule_is_broken(name: str) -> None:
    found = result_of(name)
    assert found["check"]["verdict"] == "enforceable_in_part"
    assert found["training"]["violations"] == found["greedy"]["violation_probability"] == 0
    assert abs(found["greedy"]["gap"]) <= found["optimal"]["bound"] + found["greedy"]["bound"]
    assert found["baseline"]["violations"] > 0
    assert found["baseline"]["greedy"]["violation_probability"] > 0.5
    assert all(about["sentence"] for about in found["check"]["rules"])
    index = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert f"{found['baseline']['violations']:,}" in index
    assert f"{found['optimal']['value']:.2f}" in index


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [("warehouse", "limit = 5", "limit = 8"), ("traffic_light", "limit = 3", "limit = 4")],
)
def test_a_longer_limit_gives_up_less(name: str, old: str, new: str, tmp_path: Path) -> None:
    (tmp_path / "task.toml").write_text(changed(name, old, new), encoding="utf-8")
    better = optimum(tmp_path / "task.toml").value
    before = result_of(name)["optimal"]["value"]
    assert better > before
    assert new in page_of(name)
    assert {f"{before:.2f}", f"{better:.2f}"} <= set(re.findall(r"-?\d\.\d\d\b", page_of(name)))


def test_the_better_rule_of_the_appliances_is_controllable(tmp_path: Path) -> None:
    text, page = (GALLERY / "appliances" / "task.toml").read_text(encoding="utf-8"), page_of("appliances")
    better = text.replace(rule(text, "cheap drying"), rule(page, "cheap drying").replace("```\n", ""))
    (tmp_path / "task.toml").write_text(better, encoding="utf-8")
    findings = check(read_task(tmp_path / "task.toml"))
    assert all(controllable.holds for controllable, _ in findings.each)
    assert f"{optimum(tmp_path / 'task.toml').value:.2f}" == "19.22"
    assert "from 14.72 to 19.22" in page


@pytest.mark.parametrize(
    ("name", "left_out", "key"),
    [("job_shop", "one mechanic", "expected_steps"), ("tool_agent", "consent", "value")],
)
def test_what_a_rule_costs(name: str, left_out: str, key: str, tmp_path: Path) -> None:
    text = (GALLERY / name / "task.toml").read_text(encoding="utf-8")
    (tmp_path / "task.toml").write_text(text.replace(rule(text, left_out), ""), encoding="utf-8")
    without, before = getattr(optimum(tmp_path / "task.toml"), key), result_of(name)["optimal"][key]
    assert {f"{before:.2f}", f"{without:.2f}"} <= set(re.findall(r"\d+\.\d\d\b", page_of(name)))


def test_taxi_in_the_rain_cannot_be_kept(tmp_path: Path) -> None:
    (tmp_path / "task.toml").write_text(changed(*RAIN), encoding="utf-8")
    assert check(read_task(tmp_path / "task.toml")).verdict == "not_enforceable"

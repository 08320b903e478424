"""The report: complete, the same twice, safe to open, and written from what a run has left."""

from __future__ import annotations

import json
import re
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from rich.console import Console

from supremal import explain_disabled, from_text, reward_machine
from supremal.cli.report import report_command
from supremal.cli.run import run_command
from supremal.cli.text import describe
from supremal.errors import FormatError
from supremal.show import _words
from supremal.show._story import story
from supremal.show.diagram import automaton_svg, reward_machine_svg
from supremal.show.disabled import disabled_table, listed
from supremal.show.figures import Series, curves_svg
from supremal.show.playback import Episode, Look, Part, Playback, Reel, Step
from supremal.show.report import Diagram, RuleView, report_html
from supremal.task.page import rule_views
from supremal.task.reading import read_task

EXAMPLES = Path(__file__).parents[1] / "examples"

RESULT = {
    "supremal": "0.1.0",
    "task": "grid",
    "source": "A paper, 2022",
    "partial": False,
    "seed": 1,
    "seeds": 2,
    "settings": {
        "episodes": 500_000,
        "episode_steps": 60,
        "alpha": 0.1,
        "gamma": 0.9,
        "epsilon": 0.25,
        "epsilon_decay": 0.95,
        "decay_every": 10_000,
    },
    "check": {
        "verdict": "enforceable",
        "plants": [{"name": "grid", "states": 4032}],
        "rules": [
            {
                "name": "H_1",
                "sentence": "No <script>alert(1)</script> U-turn.",
                "states": 3,
                "transitions": 10,
                "controllable": True,
                "witness": None,
                "without_plant": {"controllable": True, "witness": None, "text": "The plant is not needed."},
            },
            {
                "name": "G_s'",
                "sentence": "After a drop: put down 2 and 3, then pick up 1, 2, 3",
                "text": "only_sequence(...)",
                "states": 6,
                "transitions": 16,
                "controllable": True,
                "witness": None,
                "without_plant": {
                    "controllable": False,
                    "witness": {"word": ["d_u"], "event": "d_u", "plant_state": "0", "spec_state": "w1"},
                    "text": "",
                },
            },
        ],
    },
    "product": {"states": 12_380, "state_actions": 24_110, "disabled": 31_740},
    "optimal": {"value": -90.844936, "bound": 3e-12, "expected_steps": 41.0, "steps_undisturbed": 35.0},
    "greedy": {
        "value": -90.844936,
        "bound": 1e-12,
        "gap": 0.0,
        "completion": 1.0,
        "violation_probability": 0.0,
    },
    "training": {
        "violations": 0,
        "steps": 27_612_345,
        "seconds": 41.3,
        "steps_per_second": 668_580.0,
        "final_epsilon": 0.0192,
        "interval": 10_000,
        "score": [-979.0, -305.0],
        "completion": [0.0, 0.946],
    },
    "baseline": {
        "violations": 1_491_949,
        "violations_per_episode": 2.98,
        "steps": 21_392_793,
        "score": [-900.0, -290.0],
        "completion": [0.0, 0.99],
        "greedy": {"value": -90.78, "completion": 1.0, "violation_probability": 1.0},
    },
    "comparison": [{"what": "Average score, episodes 1–10,000", "reported": "-979.3", "here": None}],
    "per_seed": [
        {"seed": seed, "greedy_value": -90.8, "gap": 0.0, "completion": 0.99999, "violations": 0}
        for seed in (1, 2)
    ],
}

SERIES = [
    Series("here", [10, 250, 500], [-950.0, None, -300.0]),
    Series("published", [10, 250, 500], [-979.3, -454.5, -305.0], "reference"),
]
CHART = curves_svg(SERIES, xlabel="Episodes", ylabel="Average score")
ONCE = from_text(
    "name once \n uncontrollable u \n marked w_0 \n w_0 -u-> w_1 \n w_1 -a-> w_0 \n w_0 -b-> w_0"
)
MACHINE = reward_machine(["p"], [("u_0", "p", "u_1", 1.0), ("u_1", "p", "u_0", 0.0)], name="R")
RULES = [
    RuleView("H_1", automaton_svg(ONCE), accepted=((), ("b",)), rejected=(("u",),)),
    RuleView("G_s'", "", rejected=(("d_u", "d_u"),)),
]
DIAGRAMS = [Diagram("R", reward_machine_svg(MACHINE), "What <b>pays</b> at u_4")]
MOMENT = Step((0, 2), ("l",), ("d_u",), (("r", "it breaks </script><b>"),), Look(facts=("S",)), chosen="l")
AFTER = Step((1, 2), (), (), (), Look(facts=("S",)), action="l", word=("d_u",), reward=-1.5)
PLAYBACK = Playback(
    (Part("H_1", ("w_0", "w_1")), Part("G_s'", ())),
    (Reel("As it goes", "By <i>chance</i>.", (Episode("Seed 0: 1 step, return -1.5", (MOMENT, AFTER)),)),),
    frozenset({"d_u"}),
    facts=("true here",),
)
PLANT = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
CALM = from_text("name calm \n uncontrollable fault \n ready -start-> going \n going -stop-> ready")
DISABLED = disabled_table(explain_disabled(PLANT, CALM), ("start", "stop", "fault"))


def visible(page):
    """Return the words of the page."""
    body = re.sub(r"<(style|svg|head|script)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return " ".join(re.sub(r"<[^>]+>", "", body).split())


def test_the_report_says_what_was_found():
    page = report_html(RESULT, rules=RULES, diagrams=DIAGRAMS, charts=[CHART])
    words = visible(page)
    assert "The rules can be kept, and were: no\xa0violation in 27,612,345 steps of training." in page
    for said in (
        "The learned policy is worth −90.8449, the best that the rules allow, and completes the task in",
        "the same learner broke them 1,491,949 times",
        "What can happen: grid, 4,032 states.",
        "After du, du can happen again, which nobody controls and the rule forbids.",
        "3 states, 10 transitions",
        "Rule automaton: 6 states, 16 transitions.",
        "Written as only_sequence(...)",
        "it allows(nothing happened yet)b",
        "it forbidsdu du",
        "−979.3",
        "3 × 10⁻¹²",
        "Completed, last interval94.6 %99 %",
        "99.99 %",
        "668,580 steps a second",
        "Discount γ0.9",
    ):
        assert said in words.replace("\xa0", " "), said
    assert page.count('class="sm-diagram"') == 2
    assert page.count('class="sm-chart"') == 1


def test_the_report_escapes_names():
    page = report_html(RESULT, rules=RULES, diagrams=DIAGRAMS, playback=PLAYBACK)
    assert "<script>alert" not in page
    assert page.count("<script") == page.count("</script>") == 2
    assert "it breaks \\u003c/script>\\u003cb>" in page
    assert "By &lt;i&gt;chance&lt;/i&gt;." in page
    assert "No &lt;script&gt;alert(1)&lt;/script&gt; U-turn" in page
    assert "What &lt;b&gt;pays&lt;/b&gt; at <i>u</i><sub>4</sub>" in page


def test_the_report_loads_nothing():
    page = report_html(RESULT, rules=RULES, diagrams=DIAGRAMS, charts=[CHART], playback=PLAYBACK)
    assert set(re.findall(r"https?://[^\s\"'<>]+", page)) == {
        "http://www.w3.org/2000/svg"
    }  # a name, not an address
    assert not re.search(r"<(link|img|iframe|object|embed)\b|@import|url\(|\bsrc=", page)
    assert not re.search(r"fetch\(|XMLHttp|WebSocket|import\(|\beval\(|innerHTML", page)


def test_the_report_is_one_outline():
    page = report_html(RESULT, rules=RULES, diagrams=DIAGRAMS, playback=PLAYBACK, disabled=DISABLED)
    assert page.count("<h1>") == page.count("<main") == 1
    assert page.startswith("<!DOCTYPE html>")
    assert '<html lang="en">' in page
    targets = re.findall(r'href="#([\w-]+)"', page)
    assert targets
    assert set(targets) <= set(re.findall(r'id="(\w+)"', page))


def test_an_interrupted_run_says_so_and_shows_dashes():
    training = RESULT["training"] | {"steps_per_second": None, "seconds": None}
    page = report_html(RESULT | {"partial": True, "greedy": None, "baseline": None, "training": training})
    words = visible(page)
    assert "This run was interrupted. It stopped after 20,000 of 500,000 episodes." in words
    assert "–" in words
    assert "interrupted" not in visible(report_html(RESULT))


def test_missing_parts_are_left_out():
    page = report_html({})
    assert "A run without a check." in page
    assert re.findall(r'<section id="(\w+)"', page) == ["settings"]
    report_html(
        {"check": {"verdict": "enforceable"}, "training": {}, "greedy": {"value": None}, "comparison": []}
    )


def test_rules_that_cannot_be_kept():
    rule = {"name": "r", "controllable": False, "witness": {"word": ["a", "b"], "event": "fault"}}
    page = report_html({"check": {"verdict": "not_enforceable", "rules": [rule]}})
    words = visible(page)
    assert "These rules cannot be kept." in words
    assert "After a b, fault can happen, which nobody controls and the rule forbids." in words
    assert '<li class="last">fault</li>' in page


def test_rules_that_can_be_kept_in_part():
    rules = [rule | {"controllable": False, "without_plant": None} for rule in RESULT["check"]["rules"]]
    check = RESULT["check"] | {"verdict": "enforceable_in_part", "rules": rules}
    words = visible(report_html(RESULT | {"check": check}))
    assert "The rules can be kept by forbidding more than they do, and were: no" in words
    assert words.count("not by itself: more has to be forbidden") == len(rules)
    assert "cannot be kept" not in words


def test_a_word_is_told_in_one_form():
    witness = {"word": ["left", "@8", "!gust", "?up", "@9"], "event": "hole"}
    rule = {"name": "dry", "controllable": False, "witness": witness}
    words = visible(report_html({"check": {"verdict": "enforceable_in_part", "rules": [rule]}}))
    assert "left→state 8→up→state 9→hole" in words
    assert "After left (state 8) up (state 9), hole can happen, which nobody controls" in words


def test_the_words_of_a_rule_are_worth_a_look() -> None:
    task = read_task(EXAMPLES / "frozen_lake.toml")
    dry, dithering, _ = rule_views(task)
    assert dry.accepted == ((), ("left",), ("down",))  # of the events that matter to it no other is allowed
    assert dry.rejected == (("hole",),)  # all others begin or end like it
    assert dithering.rejected == (("left", "right"), ("right", "left"), ("left", "left", "right"))
    for view, rule in zip(rule_views(task), task.rules, strict=True):
        assert all(rule.automaton.accepts(word) for word in view.accepted)
        assert not any(rule.automaton.accepts(word) for word in view.rejected)
        assert all(rule.automaton.accepts(word[:k]) for word in view.rejected for k in range(len(word)))


def test_broken_rules_are_not_hidden():
    training = RESULT["training"] | {"violations": 2}
    assert "but were broken twice in" in report_html(RESULT | {"training": training})


def test_nothing_is_rounded_in_favour_of_the_run():
    assert _words.percent(0.999999) == "99.99\xa0%"
    assert _words.percent(1e-9) == "<\xa00.01\xa0%"
    assert _words.percent(float("nan")) == "–"
    assert _words.gap({"greedy": {"gap": 1e-13, "bound": 1e-12}, "optimal": {"bound": 1e-12}}) == "0"
    assert _words.gap({"greedy": {"gap": 0.25}}) == "0.2500"
    lede = _words.lede({"greedy": {"value": -1.0, "gap": 0.25}, "baseline": {"violations": 1}})
    assert lede == [
        "The learned policy is worth −1.0000, 0.2500 below the best that the rules allow.",
        "Without the rules, the same learner broke them once.",
    ]
    assert _words.witness_sentence({"word": [], "event": "f"}).startswith("at once, f can happen, ")


# --- the story, the rules, what is disabled ---------------------------------------------------------------


def test_the_story_tells_who_decides() -> None:
    breach = {"word": ["?go", "!x", "@17", "f"], "event": "f", "breaks": [{"event": "f", "rule": "calm"}]}
    told = story({"together": {"witness": breach}}, {"f"})
    assert told.steps == (("go", "agent"), ("state 17", "seen"), ("f", "nobody"))
    assert told.end == "f can happen now. Nobody controls it, and it breaks calm."
    deadlock = {"word": ["a"], "breaks": [{"event": "b", "rule": "r"}, {"event": "?c", "rule": "r"}]}
    end = "The agent has to act now, and has no choice left: b and c would break r."
    assert story({"together": {"deadlock": deadlock, "blocking": {}}}, ()).end == end
    blocking = {"word": [], "waiting": [["R1", "loaded"], ["R2", "down"]]}
    end = "From here on, what has to be completed never can be. Not complete: R1 in loaded and R2 in down."
    assert story({"together": {"blocking": blocking}}, ()).end == end
    assert story({"reason": {"text": "nothing can be enforced", "chain": []}}, ()).end.endswith("enforced.")
    assert story({"together": None}, ()) is None
    page = report_html(
        {"check": {"verdict": "enforceable_in_part", "together": {"witness": breach}}}, free={"f"}
    )
    assert "How it would go wrong without a supervisor" in page
    assert '<li class="nobody"><span class="event">f</span>' in page


def test_the_legend_has_the_signs_that_pictures_use() -> None:
    plain = report_html(RESULT, rules=[RuleView("H_1", automaton_svg(from_text("0 -a-> 0")))])
    assert 'class="legend"' not in plain  # an arrow at the initial state speaks for itself
    full = report_html(RESULT, rules=RULES)
    assert "marked</li>" in full
    assert "nobody controls it</li>" in full
    assert "nothing leads on" not in full


def test_a_rule_without_a_word_is_called_that() -> None:
    rule = {"name": "never", "states": 0, "transitions": 0, "controllable": True, "nonblocking": True}
    words = visible(report_html({"check": {"verdict": "not_enforceable", "rules": [rule]}}))
    assert "No word at all satisfies this rule" in words
    assert "can be kept" not in words.replace("cannot be kept", "").replace("Can the rules be kept?", "")


def test_a_rule_of_which_nothing_is_known_alone_is_left_open() -> None:
    rule = {"name": "huge", "states": 9, "controllable": None, "nonblocking": None}
    words = visible(report_html({"check": {"verdict": "enforceable", "rules": [rule]}}))
    assert "left open: too many states to say of it alone" in words
    assert "cannot be kept" not in words


def test_what_is_disabled_is_told_by_reason() -> None:
    page = report_html(RESULT, disabled=DISABLED)
    words = visible(page)
    assert "fault can follow, which nobody controls and breaks calm" in words
    assert "start 1" in words
    assert "Nothing is given up: the rules are kept as they stand" in words
    assert "start at the start" in words


def test_a_supervisor_that_lets_nothing_be_chosen_is_called_that() -> None:
    assert DISABLED.idle
    part = {"check": {"verdict": "enforceable_in_part"}}
    words = visible(report_html(part, disabled=DISABLED))
    assert "The rules can be kept only by never doing anything." in words
    assert "Only by never doing anything: nothing that can be chosen is enabled anywhere." in words


def test_a_long_table_says_what_it_leaves_out() -> None:
    """Twenty rules, each broken by an event of its own: twenty reasons."""
    events = [f"e{k}" for k in range(20)]
    plant = from_text(f"0 -{', '.join(events)}-> 0")
    rules = [from_text(f"name r{k} \n events {event} \n initial 0") for k, event in enumerate(events)]
    whole = disabled_table(explain_disabled(plant, rules), events)
    assert (len(whole.rows), whole.pairs, whole.explained, whole.left_out) == (20, 20, 20, 0)
    cut = disabled_table(explain_disabled(plant, rules), events, explained=12, rows=5)
    assert (len(cut.rows), cut.pairs, cut.explained, cut.left_out) == (5, 20, 12, 7)
    assert len(cut.counts) == 20
    words = visible(report_html(RESULT, disabled=cut))
    assert "the rows count the 12 that the shortest words lead to" in words
    assert "7 more rows of fewer states are left out" in words
    assert listed(["a"]) == "a"


def test_gaps_within_the_bounds_are_none() -> None:
    within = RESULT["greedy"] | {"gap": -4.2e-13}
    seeds = [row | {"gap": -4.2e-13} for row in RESULT["per_seed"]]
    page = report_html(RESULT | {"greedy": within, "per_seed": seeds})
    assert "10⁻¹³" not in page
    assert "4.2" not in visible(page)
    assert _words.below(0.1, 1e-9) == "0.1000"


# --- supremal report --------------------------------------------------------------------------------------


def ask(command: Any, *arguments: object) -> Result:
    return CliRunner().invoke(command, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "lake"
    arguments = ("--episodes", 2000, "--seed", 3, "--seeds", 2, "--out", folder)
    assert ask(run_command, EXAMPLES / "frozen_lake.toml", *arguments).exit_code == 0
    return folder


def test_the_report_of_a_run_is_made_again_as_it_was(run_folder: Path, tmp_path: Path) -> None:
    before = (run_folder / "report.html").read_text(encoding="utf-8")
    assert ask(report_command, run_folder).output == f"Written to {run_folder / 'report.html'}.\n"
    assert (run_folder / "report.html").read_text(encoding="utf-8") == before
    other = tmp_path / "other.html"
    assert ask(report_command, run_folder, "-o", other, "--seed", 7, "--episodes", 2).exit_code == 0
    page = other.read_text(encoding="utf-8")
    reels = json.loads(re.search(r'id="playback-data">(.*?)</script>', page)[1])["reels"]
    assert [episode["title"][:6] for episode in reels[0]["episodes"]] == ["Seed 7", "Seed 8"]
    assert [reel["title"] for reel in reels] == ["As it goes", "The worst case"]
    assert "interquartile mean" in page
    assert len(page.encode()) < 300_000


def test_the_report_of_a_task_file(tmp_path: Path) -> None:
    task = tmp_path / "cell.toml"
    text = (EXAMPLES / "manufacturing_cell.toml").read_text(encoding="utf-8")
    task.write_text(text, encoding="utf-8")
    (tmp_path / "manufacturing_cell_plants.json").write_bytes(
        (EXAMPLES / "manufacturing_cell_plants.json").read_bytes()
    )
    assert ask(report_command, task, "--episodes", 1).exit_code == 0
    words = visible((tmp_path / "cell.html").read_text(encoding="utf-8"))
    assert "The rules can be kept by forbidding more than they do." in words
    assert "Anything allowed" in words
    refused = ask(report_command, task)
    assert isinstance(refused.exception, FormatError)
    assert "cell.html: the file exists already; name the one to write with --out" in str(refused.exception)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda run: (run / "result.json").unlink(), "result.json: cannot read it: No such file"),
        (lambda run: (run / "result.json").write_text("[1]"), "result.json: it is no result of a run"),
        (lambda run: (run / "result.json").write_text("{"), "result.json: it is no result of a run"),
        (lambda run: (run / "learned.npz").write_bytes(b"?"), "learned.npz: it has no arrays"),
        (
            lambda run: np.savez(run / "learned.npz", seeds=[0], policy=np.zeros((1, 5), np.int32)),
            "learned.npz: the learned policy has 5 states, and the product of the task 329",
        ),
        (
            lambda run: np.savez(run / "learned.npz", seeds=[0], policy=np.full((1, 329), 2, np.int32)),
            "learned.npz: the learned policy does what the supervisor disables",
        ),
        (lambda run: (run / "task.toml").write_text("?"), "task.toml:1:1"),
    ],
    ids=["no result", "a list", "no JSON", "no arrays", "another task's", "a forbidden policy", "no task"],
)
def test_a_run_that_is_no_longer_whole_is_told(
    run_folder: Path, tmp_path: Path, change: Any, message: str
) -> None:
    broken = tmp_path / "run"
    broken.mkdir()
    for name in ("result.json", "learned.npz", "task.toml"):
        (broken / name).write_bytes((run_folder / name).read_bytes())
    change(broken)
    refused = ask(report_command, broken)
    assert isinstance(refused.exception, FormatError), refused.output
    assert message in str(refused.exception)
    assert not (broken / "report.html").exists()


def test_a_page_that_cannot_be_written_leaves_nothing(run_folder: Path, tmp_path: Path) -> None:
    refused = ask(report_command, run_folder, "-o", tmp_path / "no" / "where.html")
    assert isinstance(refused.exception, FormatError)
    assert "cannot write it: No such file or directory; choose another file with --out" in str(
        refused.exception
    )


def test_the_terminal_says_what_the_check_found(tmp_path: Path) -> None:
    done = ask(run_command, EXAMPLES / "frozen_lake.toml", "--episodes", 50, "--out", tmp_path / "run")
    lines = [line.strip() for line in done.output.splitlines()]  # no terminal: none of them is wrapped
    assert any(
        line.startswith("stay dry (safety, 1 state): not controllable. After left")
        and line.endswith("it breaks stay dry in its state 0.")
        for line in lines
    )
    assert any(
        line.startswith("no dithering (safety, 3 states): controllable. The plant is not needed")
        for line in lines
    )


@pytest.mark.parametrize("terminal", [True, False])
def test_lines_are_wrapped_on_a_terminal_only(run_folder: Path, *, terminal: bool) -> None:
    result = json.loads((run_folder / "result.json").read_text(encoding="utf-8"))
    said = said_of(result, width=90, force_terminal=terminal, color_system=None)
    before = said[: said.index("rules broken")]
    assert (max(map(len, before.splitlines())) <= 90) is terminal


def test_a_baseline_that_completes_nothing_is_explained(run_folder: Path) -> None:
    result = json.loads((run_folder / "result.json").read_text(encoding="utf-8"))
    assert result["baseline"]["greedy"]["completion"] > 0
    assert "never completes the task" not in said_of(result)
    nothing = "Without the rules the greedy policy never completes the task within 200 steps; its episodes"
    for steps, ends in ((4.04, "end after 4.0 on average."), (None, "may never end.")):
        greedy = result["baseline"]["greedy"] | {"completion": 0.0, "expected_steps": steps}
        baseline = result["baseline"] | {"greedy": greedy}
        assert f"\n{nothing} {ends}\n" in said_of(result | {"baseline": baseline})
    assert "never completes the task" not in said_of(result | {"baseline": None})


def said_of(result: dict[str, Any], **console: Any) -> str:
    out = StringIO()
    describe(Console(file=out, **console), result, Path("run"))
    return out.getvalue()

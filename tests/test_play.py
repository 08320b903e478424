"""A game: exactly what the supervisor allows, replayed from its moves, over HTTP and in the terminal."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from served import LAMP, served, studied
from strategies import plants, specifications
from supremal import Alphabet, Automaton, MDPError, ModelError, from_outcomes
from supremal.automata.alphabet import union
from supremal.cli._serving import PageServer
from supremal.cli.models import OutputError
from supremal.cli.play import play_command
from supremal.errors import FormatError
from supremal.rules.rule import Rule
from supremal.show.board import Board, Place, Tile, Token
from supremal.show.board_text import board_text
from supremal.show.play import Moment, content_policy, moment_document, play_html, tell_apart
from supremal.show.playback import Look
from supremal.task.experiment import rules_of, supervise
from supremal.task.game import Game, game_of
from supremal.task.page import checked, rule_views
from supremal.task.reading import read_task
from supremal.task.task import Task

EXAMPLES = Path(__file__).parents[1] / "examples"
PROCESSES = ["frozen_lake", "taxi", "manufacturing_cell", "pickup_delivery_published"]
NEVER = LAMP.replace("times = 1", "times = 0").replace("dark -on-> lit", "initial lit")


@cache
def example(name: str) -> tuple[Task, Game]:
    task = read_task(EXAMPLES / f"{name}.toml")
    return task, game_of(task, studied(task))


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    path = tmp_path / "lamp.toml"
    path.write_text(LAMP, encoding="utf-8")
    return path


@pytest.fixture
def lamp_game(lamp: Path) -> Game:
    task = read_task(lamp)
    return game_of(task, studied(task))


def names(moment: Moment) -> list[str]:
    return [" ".join(option.word) for option in moment.options]


# --- plants -----------------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(plants(), specifications(), st.lists(st.integers(0, 100), max_size=12))
def test_what_is_offered_is_what_the_supervisor_enables(
    plant: Automaton, spec: Automaton, draws: list[int]
) -> None:
    plant, spec = replace(plant, name="plant"), replace(spec, name="spec")
    task = Task("any", union(plant.alphabet, spec.alphabet), (plant,), rules=(Rule("spec", spec),))
    findings = studied(task)
    game = game_of(task, findings)
    assert (game is None) == findings.supervisor.is_empty
    assume(game is not None)
    monitor, moves, word = findings.supervisor.monitor(), list[int](), list[str]()
    for draw in draws:
        moment = game.moment(moves)
        step, free = moment.step, task.alphabet.uncontrollable
        assert set(names(moment)) == set(monitor.enabled)
        assert names(moment) == [*step.can, *step.may]
        assert [name in free for name in names(moment)] == [False] * len(step.can) + [True] * len(step.may)
        after = plant.run([e for e in word if e in plant.alphabet])
        possible = {e for e in task.alphabet if e not in plant.alphabet or plant.run([e], after) >= 0}
        assert {name for name, _ in step.cannot} == possible - set(monitor.enabled)
        assert spec.run([e for e in word if e in spec.alphabet]) == step.at[0] >= 0  # not broken
        assert moment.history == tuple((e,) for e in word)
        if not moment.options:
            assert moment.chance == -1
            break
        moves.append(draw % len(moment.options))
        word.append(names(moment)[moves[-1]])
        assert monitor.observe(word[-1:])


def test_where_nothing_is_known_anything_can_happen() -> None:
    sigma = Alphabet(("go", "fall"), frozenset({"fall"}))
    game = game_of(Task("any", sigma), studied(Task("any", sigma)))
    assert names(game.moment([0, 1, 0])) == ["go", "fall"]
    assert game.moment([0, 1, 0]).history == (("go",), ("fall",), ("go",))
    assert game.moment().score is None


# --- processes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PROCESSES)
@settings(max_examples=25)
@given(draws=st.lists(st.integers(0, 1000), max_size=40))
def test_a_game_of_a_process_is_an_episode_of_the_product(name: str, draws: list[int]) -> None:
    task, game = example(name)
    model, mask = product_of(name)
    state, asked, moves, rewards = game.start.state, "", list[int](), 0.0
    rules = [(rule, rule.run(())) for rule in rules_of(task)]
    for draw in draws:
        moment = game.moment(moves)
        assert moment.asked == asked
        assert moment.score == pytest.approx(rewards)
        if not asked:
            enabled = np.flatnonzero(mask[state] & ~model.terminal[state])
            assert names(moment) == [model.actions[a] for a in enabled] == list(moment.step.can)
            barred = np.flatnonzero(model.feasible[state] & ~mask[state] & ~model.terminal[state])
            assert [event for event, _ in moment.step.cannot] == [model.actions[a] for a in barred]
            if not moment.options:
                assert model.terminal[state]
                break
        choice = draw % len(moment.options)
        moves.append(choice)
        action = model.actions.index(asked or names(moment)[choice])
        outcomes = model.outcomes(state, action)
        several = outcomes.stop - outcomes.start > 1
        if asked:
            assert sum(option.probability for option in moment.options) == pytest.approx(1)
            assert len({(option.word, option.tells) for option in moment.options}) == len(moment.options)
            assert [option.word for option in moment.options] == [
                model.spell(w) for w in model.word[outcomes]
            ]
        elif several:
            asked = model.actions[action]
            continue
        o = outcomes.start + (choice if several else 0)
        asked, state, rewards = "", int(model.next_state[o]), rewards + float(model.reward[o])
        word = model.spell(int(model.word[o]))
        rules = [(rule, rule.run([e for e in word if e in rule.alphabet], q)) for rule, q in rules]
        assert all(q >= 0 for _, q in rules)  # none is broken, whoever plays


@cache
def product_of(name: str) -> tuple[Any, np.ndarray]:
    task = example(name)[0]
    numbered = replace(task.environment, origin=np.arange(task.environment.n_states, dtype=np.int32)[:, None])
    return supervise(numbered, task)


def test_while_an_outcome_is_asked_for_nothing_else_can_be_chosen() -> None:
    _, game = example("frozen_lake")
    here, asked = game.moment(), game.moment([2])
    assert (asked.asked, asked.step.chosen) == ("right", "right")
    assert (asked.step.can, asked.step.may, asked.step.cannot) == ((), (), ())
    assert asked.step.look == here.step.look
    assert (asked.history, len(asked.options)) == ((), 3)
    assert [option.tells for option in asked.options] == [
        "the agent stays",
        "the agent moves right",
        "the agent moves down",
    ]
    assert game.moment([2, 1]).history == (("right",),)
    assert (game.moment([2, 1]).step.action, game.moment([2, 1]).asked) == ("right", "")


def test_chance_takes_outcomes_by_their_probability() -> None:
    coin = from_outcomes(
        [(0, "toss", 1, 0.9, ("heads",), 1.0), (0, "toss", 1, 0.1, ("tails",), 0.0)],
        alphabet=Alphabet(("heads", "tails"), frozenset({"heads", "tails"})),
        terminal=[1],
    )
    task = Task("coin", coin.alphabet, environment=coin)
    findings = studied(task)
    taken = [game_of(task, findings, seed=seed).moment([0]).chance for seed in range(100)]
    assert 80 <= taken.count(0) < 100
    assert game_of(task, findings, seed=3).moment([0]).chance == taken[3]
    won = game_of(task, findings).moment([0, 0])
    assert (won.options, won.score, won.chance) == ((), 1.0, -1)


def test_a_seed_draws_the_start() -> None:
    task, game = example("taxi")
    findings = studied(task)
    starts = {game_of(task, findings, seed=seed).start.state for seed in range(5)}
    assert len(starts) > 1
    assert game_of(task, findings, seed=0).start == game.start


def test_a_move_that_there_is_not_says_which_there_are(lamp_game: Game) -> None:
    with pytest.raises(ModelError, match=r"move 2 is 5, .*; choose one of 0 \(off\), 1 \(fuse\)"):
        lamp_game.moment([0, 5])
    with pytest.raises(ModelError, match="move 1 is -1"):
        lamp_game.moment([-1])
    with pytest.raises(ModelError, match="move 3 is 0, .* the game is over before it"):
        lamp_game.moment([0, 1, 0])


# --- what is said of it -----------------------------------------------------------------------------------


def test_outcomes_that_look_alike_are_numbered() -> None:
    one, other = Look(facts=("a",)), Look(facts=("b",))
    assert tell_apart(one, [one, one, other], facts=["door"]) == ["door a (1)", "door a (2)", "door b"]
    assert tell_apart(one, [one, one], facts=["door"]) == ["(1)", "(2)"]


def test_tokens_tell_how_they_move() -> None:
    def at(x: float, y: float, angle: float = 0.0) -> Look:
        return Look((Place(x, y, angle),))

    looks = [at(1, 1), at(3, 1), at(0, 0), at(1, 1, 90.0), Look((None,))]
    assert tell_apart(at(1, 1), looks, tokens=["it"]) == [
        "it stays",
        "it moves right by 2",
        "it moves left and up",
        "it turns",
        "it is gone",
    ]
    assert tell_apart(Look((None,)), looks[-2:], tokens=["it"]) == ["it appears", "it stays"]


def test_a_document_has_what_a_page_needs(lamp_game: Game) -> None:
    document = moment_document(lamp_game.moment([0]), lamp_game.scene.free)
    assert json.loads(json.dumps(document)) == document
    assert [document["names"][n] for n in document["step"]["may"]] == ["fuse"]
    assert [document["names"][n] for n in document["free"]] == ["fuse"]
    assert document["options"][1] == {"word": ["fuse"], "share": "", "tells": ""}
    assert (document["history"], document["score"], document["asked"]) == ([["on"]], None, "")
    _, game = example("frozen_lake")
    asked = moment_document(game.moment([2]), game.scene.free)
    assert asked["options"][0] == {"word": ["right"], "share": "33.33\u00a0%", "tells": "the agent stays"}


def test_a_map_as_text() -> None:
    board = Board(
        ((0, 0), (1, 0), (1, 1)),
        (Token("it", "arrow"), Token("item", "disc", "1"), Token("cab", "square"), Token("far")),
        {(1, 1): Tile("G", "goal")},
        (((1, 0), (1, 1), (2, 1)),),
        slots=((3, 0.5),),
    )
    places = [Place(0.5, 0.5, 180), Place(0.4, 0.6, size=0.5, look="hollow"), None, Place(3, 0.5)]
    assert board_text(board, places).split("\n") == ["↓(1)| .", "     ----", "      G", "beside it: far"]
    walled = replace(board, walls=(((0, 0), (0, 1)),), tokens=())
    assert board_text(walled).split("\n") == ["| .   .", "      G"]


# --- the server -------------------------------------------------------------------------------------------


Ask = Callable[..., tuple[int, Any, Any]]


@pytest.fixture
def ask(lamp: Path) -> Iterator[Ask]:
    """Send a request; what comes back is the status, the headers and the text, or what its JSON says."""
    with served(lamp) as server:

        def send(method: str, path: str, body: Any = None, **headers: Any) -> tuple[int, Any, Any]:
            said = {"Content-Type": "application/json"} if method == "POST" else {}
            said |= {name.replace("_", "-"): value for name, value in headers.items()}
            text = body if body is None or isinstance(body, bytes) else json.dumps(body)
            with closing(http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=5)) as link:
                link.request(method, path, text, said)
                answer = link.getresponse()
                found = answer.read().decode()
            is_json = (answer.headers["Content-Type"] or "").startswith("application/json")
            return answer.status, answer.headers, json.loads(found) if is_json else found

        send.server = server
        yield send


def test_the_page_is_served_with_a_policy_for_its_own_script(ask: Ask) -> None:
    status, headers, page = ask("GET", "/")
    assert (status, headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    assert "A lamp that burns out" in page
    assert "The rules can be kept by forbidding more than they do." in page
    assert headers["Content-Security-Policy"] == content_policy(page)
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "unsafe-inline" not in re.search("script-src[^;]*", headers["Content-Security-Policy"])[0]
    assert headers["Server"] == "supremal "
    assert ask("GET", "/?again")[0] == 200
    assert not re.search(r'(?:src|href)="(?!#|data:)', page)  # it loads nothing


def test_a_question_brings_all_its_moves(ask: Ask) -> None:
    status, headers, start = ask("POST", "/moment", {"moves": []})
    assert (status, headers["Cache-Control"]) == (200, "no-store")
    assert [option["word"] for option in start["options"]] == [["on"]]
    _, _, end = ask("POST", "/moment", {"moves": [0, 1]})
    assert (end["history"], end["options"]) == ([["on"], ["fuse"]], [])
    assert end["texts"] == ["fuse can follow, which nobody controls and breaks once", "dark"]
    assert ask("POST", "/moment", {"moves": []})[2] == start


def test_one_connection_serves_several_questions(ask: Ask) -> None:
    kind = {"Content-Type": "application/json"}
    with closing(http.client.HTTPConnection("localhost", ask.server.server_port, timeout=5)) as link:
        for moves in ([], [0], [0, 0]):
            link.request("POST", "/moment", json.dumps({"moves": moves}), kind)
            assert len(json.loads(link.getresponse().read())["history"]) == len(moves)


@pytest.mark.parametrize(
    ("wrong", "status", "said"),
    [
        ({"body": {"moves": [7]}}, 400, "move 1 is 7, and there is no such option; choose one of 0 (on)"),
        ({"body": {"moves": "0"}}, 400, 'send {"moves": [...]}'),
        ({"body": {"moves": [True]}}, 400, 'send {"moves": [...]}'),
        ({"body": {"moves": [-1]}}, 400, 'send {"moves": [...]}'),
        ({"body": {"moves": [0.0]}}, 400, 'send {"moves": [...]}'),
        ({"body": [0]}, 400, 'send {"moves": [...]}'),
        ({"body": b"{"}, 400, 'send {"moves": [...]}'),
        ({"body": b"\xff\xfe"}, 400, 'send {"moves": [...]}'),
        ({"body": b"[" * 60_000}, 400, 'send {"moves": [...]}'),
        ({"body": b"9" * 60_000}, 400, 'send {"moves": [...]}'),
        ({"body": b""}, 400, 'send {"moves": [...]}'),
        ({"body": {"moves": []}, "Content_Type": "text/plain"}, 415, "send application/json"),
        ({"body": {"moves": []}, "Content_Length": "-1"}, 411, "send a Content-Length"),
        ({"body": {"moves": []}, "Content_Length": "²"}, 411, "send a Content-Length"),
        ({"body": {"moves": []}, "Content_Length": "9" * 99}, 413, "at most 65536 are read"),
        ({"path": "/other"}, 404, "nothing is asked at /other; ask at /moment"),
        ({"method": "GET", "path": "/moment"}, 404, "there is no /moment; open http://127.0.0.1:"),
        ({"method": "GET", "path": "/../etc/passwd"}, 404, "there is no /../etc/passwd"),
        ({"Host": "evil.example"}, 403, "the host 'evil.example' is not served here; open http://127.0.0.1:"),
        ({"method": "GET", "path": "/", "Host": "127.0.0.1.evil.example"}, 403, "is not served here"),
        ({"method": "GET", "path": "/", "Host": ""}, 403, "the host '' is not served here"),
    ],
)
def test_what_cannot_be_answered_says_what_could(
    ask: Ask, wrong: dict[str, Any], status: int, said: str
) -> None:
    asked = {"method": "POST", "path": "/moment", **wrong}
    if "Content_Length" in asked:
        asked["Content_Length"] = asked["Content_Length"].encode("latin-1")
    found, headers, answer = ask(asked.pop("method"), asked.pop("path"), **asked)
    assert found == status
    assert said in answer["error"]
    assert headers["Connection"] == "close"
    assert ask("POST", "/moment", {"moves": []})[0] == 200  # it goes on


def test_other_methods_are_refused(ask: Ask) -> None:
    assert ask("PUT", "/moment")[0] == ask("DELETE", "/")[0] == 501


def test_it_listens_on_loopback_only(ask: Ask) -> None:
    assert ask.server.server_address[0] == "127.0.0.1"
    with pytest.raises(OSError, match=r"refused|unreachable|assign"):  # another address of this machine
        socket.create_connection(("127.0.0.2", ask.server.server_port), timeout=1)


def test_names_are_text_whatever_they_are() -> None:
    title = "</script><script>alert(1)</script>"
    task = Task(title, Alphabet(("<b>",)), rules=(Rule("<i>", plant_of("<b>")),), title=title)
    findings = studied(task)
    page = play_html(checked(task, findings), game_of(task, findings).scene, rule_views(task))
    assert "<script>alert" not in page
    assert "<b>supremal</b>" in page
    assert page.count("<b>") == 1
    assert len(re.findall("<script>", page)) == 1


def plant_of(event: str) -> Automaton:
    return Automaton(Alphabet((event,)), np.zeros((1, 1), np.int32), np.ones(1, bool))


# --- the command ------------------------------------------------------------------------------------------


def play(*arguments: object, answers: str = "") -> Result:
    return CliRunner().invoke(play_command, [*map(str, arguments)], input=answers)


def test_in_the_terminal_numbers_choose(lamp: Path) -> None:
    played = play(lamp, "--terminal", answers="1\n2\nu\n1\nq\n")
    assert played.exit_code == 0
    moments = played.output.split("\n\n")
    assert "The start." in moments[1]
    assert "1  on" in moments[1]
    assert "Can happen, nobody controls it\n     2  fuse" in moments[3]
    assert "on: fuse can follow, which nobody controls and breaks once" in moments[5]
    assert "Nothing more may happen." in moments[5]
    assert "off happened." in played.output
    assert played.output.endswith("> q\n2 steps played.\n")


def test_the_terminal_says_what_would_be_right(lamp: Path) -> None:
    played = play(lamp, "--terminal", answers="x\n\n9\nu\n0\n1\nr\nC\n")
    assert played.exit_code == 0
    right = "is none of the choices: 1, c let chance decide, u undo, r start again, q quit."
    assert all(f"{wrong!r} {right}" in played.output for wrong in ("x", "", "9", "0"))
    assert "There is nothing to undo." in played.output
    assert played.output.count("The start.") == 2
    assert "Chance takes on." in played.output
    assert played.output.endswith("1 step played.\n")  # at the end of the input


def test_the_terminal_asks_for_outcomes_and_draws_the_map() -> None:
    lake = EXAMPLES / "frozen_lake.toml"
    played = play(lake, "--terminal", answers="3\n2\nc\nc\n")
    assert "| @   .   .   .   .   .   .   . |" in played.output
    assert "right is chosen. What happens?" in played.output
    assert "2  right, 33.33\u00a0%: the agent moves right" in played.output
    assert "right happened. Reward 0, so far 0." in played.output
    assert "| S   @   ." in played.output
    assert "no dithering in 2" in played.output
    assert "left: it breaks no dithering" in played.output
    assert played.output.endswith("2 steps played, score 0.\n")
    assert played.output == play(lake, "--terminal", answers="3\n2\nc\nc\n").output
    taxi = play(EXAMPLES / "taxi.toml", "--terminal", "--seed", 3).output
    assert "passenger " in taxi
    assert taxi != play(EXAMPLES / "taxi.toml", "--terminal", "--seed", 4).output


def test_what_cannot_be_kept_cannot_be_played(lamp: Path) -> None:
    lamp.write_text(NEVER, encoding="utf-8")
    played = play(lamp, "--terminal")
    assert played.exit_code == 1
    assert "The rules cannot be kept." in played.output
    assert "nothing can be enforced: fuse can happen, which nobody controls: it breaks once" in played.output


def test_where_one_has_to_act_resting_is_no_game(lamp: Path) -> None:
    resting = "[environment]\nchances = { fuse = 0.1 }\n[check]\nmust_act = false\n"
    lamp.write_text(LAMP.replace("times = 1", "times = 0") + resting, encoding="utf-8")
    refused = play(lamp, "--terminal")
    assert isinstance(refused.exception, MDPError)
    assert "can only be kept by never doing anything" in str(refused.exception)
    lamp.write_text(lamp.read_text(encoding="utf-8").replace("must_act = false", ""), encoding="utf-8")
    assert play(lamp, "--terminal").exit_code == 1


def test_bad_input_is_told(lamp: Path) -> None:
    refused = play(lamp.with_name("none.toml"))
    assert isinstance(refused.exception, FormatError)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        refused = play(lamp, "--no-browser", "--port", port)
    assert isinstance(refused.exception, OutputError)
    assert f"cannot listen at port {port}: " in str(refused.exception)
    assert str(refused.exception).endswith("; leave --port out for a free one")
    assert play(lamp, "--port", 70_000).exit_code == 2


def test_the_browser_is_opened_unless_it_is_not_wanted(lamp: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(PageServer, "serve_forever", stop)
    first = play(lamp)
    assert (first.exit_code, len(opened)) == (0, 1)
    assert f"Play at {opened[0]}, only from this machine." in first.output
    assert first.output.endswith("Ended.\n")
    assert play(lamp, "--no-browser").exit_code == 0
    assert len(opened) == 1


def test_ctrl_c_ends_it_well(lamp: Path) -> None:
    script = "from supremal.cli.play import play_command; play_command()"
    with subprocess.Popen(
        [sys.executable, "-c", script, str(lamp), "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    ) as running:
        address = re.search(r"127\.0\.0\.1:(\d+)", running.stdout.readline())
        with closing(http.client.HTTPConnection("127.0.0.1", int(address[1]), timeout=5)) as link:
            link.request("GET", "/")
            assert link.getresponse().status == 200
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=10)
    assert (running.returncode, out, err) == (0, "\nEnded.\n", "")

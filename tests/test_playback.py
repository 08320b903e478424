"""Playback and the worst case: exact, reproducible, and never doing what the supervisor forbids."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from processes import random_process
from served import LAMP
from supremal import MDPError, TabularMDP, evaluate, from_outcomes, safe_actions
from supremal.automata.alphabet import Alphabet
from supremal.decisions.worst_case import worst_case
from supremal.envs import decode, draw
from supremal.show.board import Board, Place, Tile, Token, board_svg, spread_out
from supremal.show.playback import Playback, Step, playback_document
from supremal.task.boards import view_of
from supremal.task.experiment import check, supervise
from supremal.task.findings import Findings, plants_of, study
from supremal.task.playback import playback_of, sample
from supremal.task.reading import read_task
from supremal.task.task import Task

EXAMPLES = Path(__file__).parents[1] / "examples"


# --- the worst case ---------------------------------------------------------------------------------------


def worst_by_definition(mdp: TabularMDP, policy: np.ndarray, state: int, steps: int) -> float:
    """Return the least return over all sequences of possible outcomes, each followed to its end."""
    if steps == 0 or mdp.terminal[state]:
        return 0.0
    outcomes = mdp.outcomes(state, int(policy[state]))
    return min(
        float(mdp.reward[o]) + worst_by_definition(mdp, policy, int(mdp.next_state[o]), steps - 1)
        for o in range(outcomes.start, outcomes.stop)
    )


@given(st.integers(0, 10**6), st.integers(0, 6))
def test_the_worst_case_is_that_of_the_definition(seed: int, steps: int) -> None:
    mdp = random_process(seed)
    rng = np.random.default_rng(seed)
    policy = np.array([rng.choice(np.flatnonzero(row)) if row.any() else -1 for row in mdp.feasible])
    found = worst_case(mdp, policy, steps)
    assert found.value == pytest.approx(worst_by_definition(mdp, policy, 0, steps), abs=1e-9)
    state, total = found.start, 0.0
    for o in found.outcomes.tolist():  # and it is an episode of the policy
        outcomes = mdp.outcomes(state, int(policy[state]))
        assert outcomes.start <= o < outcomes.stop
        assert not mdp.terminal[state]
        total, state = total + float(mdp.reward[o]), int(mdp.next_state[o])
    assert total == pytest.approx(found.value, abs=1e-9)
    assert len(found.outcomes) == steps or mdp.terminal[state]
    assert found.value <= mean_return(mdp, policy, steps) + 1e-9


def mean_return(mdp: TabularMDP, policy: np.ndarray, steps: int) -> float:
    value = np.zeros(mdp.n_states)
    for _ in range(steps):
        new = np.zeros(mdp.n_states)
        for s in np.flatnonzero(~mdp.terminal & (policy >= 0)):
            o = mdp.outcomes(s, int(policy[s]))
            new[s] = mdp.prob[o] @ (mdp.reward[o] + value[mdp.next_state[o]])
        value = new
    return float(mdp.initial @ value)


def test_the_longest_episode_is_the_worst_where_steps_cost_1() -> None:
    wait = from_outcomes(
        [(0, "go", 1, 0.9, ("go",), 5.0), (0, "go", 0, 0.1, ("late",), 5.0)],
        alphabet=Alphabet(("go", "late"), uncontrollable=frozenset({"late"})),
        terminal=[1],
    )
    assert worst_case(wait, np.array([0, -1]), 4).outcomes.tolist() == [0]  # every step earns: one only
    dear = replace(wait, reward=np.full(2, -1.0))
    assert worst_case(dear, np.array([0, -1]), 4).outcomes.tolist()[:3] == [1, 1, 1]


def test_the_worst_start_is_chosen_and_an_episode_may_be_over_before_it_begins() -> None:
    two = from_outcomes(
        [(0, "go", 1, 1.0, ("go",), 3.0), (2, "go", 1, 1.0, ("go",), -2.0)],
        alphabet=Alphabet(("go",)),
        terminal=[1],
    )
    policy = np.array([0, -1, 0])
    both = replace(two, initial=np.array([0.5, 0.0, 0.5]))
    assert (worst_case(both, policy, 5).start, worst_case(both, policy, 5).value) == (2, -2.0)
    over = replace(two, initial=np.array([0.0, 1.0, 0.0]))
    assert worst_case(over, policy, 5).outcomes.size == 0


def test_a_policy_that_does_not_fit_is_refused() -> None:
    mdp = random_process(3)
    with pytest.raises(MDPError, match="steps is -1"):
        worst_case(mdp, np.zeros(mdp.n_states, np.int32), -1)
    with pytest.raises(MDPError, match=r"the policy has shape \(2,\)"):
        worst_case(mdp, np.zeros(2, np.int32), 1)
    with pytest.raises(MDPError, match="takes action -1 in state 0, which it reaches"):
        worst_case(mdp, np.full(mdp.n_states, -1, np.int32), 1)


# --- episodes ---------------------------------------------------------------------------------------------


def studied(name: str) -> tuple[Task, Findings]:
    task = read_task(EXAMPLES / f"{name}.toml")
    return task, check(task)


def any_policy(model: TabularMDP, enabled: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(7)
    return np.array([rng.choice(np.flatnonzero(row)) if row.any() else -1 for row in enabled], np.int32)


@pytest.mark.parametrize("name", ["pickup_delivery", "manufacturing_cell", "frozen_lake", "taxi"])
def test_a_playback_is_what_the_product_does(name: str) -> None:
    task, findings = studied(name)
    model, enabled = supervise(task.environment, task)
    policy = any_policy(model, enabled)
    played = playback_of(task, findings, policy, seed=5, episodes=2)
    typical, worst = played.reels
    assert [episode.title.split(":")[0] for episode in typical.episodes] == ["Seed 5", "Seed 6"]
    start, outcomes = sample(model, policy, enabled, seed=5, steps=task.settings.episode_steps)
    follow(task, model, enabled, start, outcomes, typical.episodes[0].steps)
    found = worst_case(model, policy, task.settings.episode_steps)
    follow(task, model, enabled, found.start, found.outcomes.tolist(), worst.episodes[0].steps)
    assert f"return {found.value:.6g}" in worst.episodes[0].title
    assert played == playback_of(task, findings, policy, seed=5, episodes=2)


def follow(
    task: Task,
    model: TabularMDP,
    enabled: np.ndarray,
    start: int,
    outcomes: list[int],
    steps: tuple[Step, ...],
) -> None:
    """Check each step against the product and the rules themselves."""
    assert len(steps) == len(outcomes) + 1
    state, word = start, []
    for k, step in enumerate(steps):
        live = not model.terminal[state]
        assert set(step.can) == {model.actions[a] for a in np.flatnonzero(enabled[state] & live)}
        barred = model.feasible[state] & ~enabled[state] & live
        assert [name for name, _ in step.cannot] == [model.actions[a] for a in np.flatnonzero(barred)]
        assert all(why for _, why in step.cannot)
        for rule, at in zip(task.rules, step.at, strict=False):
            drawn = rule.drawn or rule.automaton
            assert at == drawn.run([event for event in word if event in drawn.alphabet])
        if k < len(outcomes):
            assert step.chosen in step.can
            word += model.spell(int(model.word[outcomes[k]]))
            assert steps[k + 1].reward == model.reward[outcomes[k]]
            state = int(model.next_state[outcomes[k]])
    assert steps[-1].chosen == ""


def test_reasons_name_the_rule_and_what_nobody_controls() -> None:
    task, findings = studied("frozen_lake")
    steps = [step for e in playback_of(task, findings).reels[0].episodes for step in e.steps]
    reasons = {why for step in steps for _, why in step.cannot}
    assert "it breaks no dithering" in reasons
    assert "hole can follow, which nobody controls and breaks stay dry" in reasons
    cell = playback_of(*studied("manufacturing_cell"), episodes=6)
    found = {(event, why) for e in cell.reels[0].episodes for step in e.steps for event, why in step.cannot}
    assert ("p2", "it breaks buffer") in found
    assert any(event == "p1" and "breaking deadline_R1" in why for event, why in found)


def test_the_grid_looks_as_its_text_does() -> None:
    view = view_of(read_task(EXAMPLES / "pickup_delivery.toml"))
    for code in (24, 24 + 252 * 7, 24 + 252 * 8, 252 * 60 + 100, 252 * 200 + 9):
        state, places = decode(code), view.look((code,)).tokens
        agent = places[0]
        assert (agent.x - 0.5, 6.5 - agent.y) == (state.x, state.y)
        assert agent.angle == {"up": 0, "right": 90, "down": 180, "left": 270}[state.heading]
        assert [place.x > 9 for place in places[1:]] == [item == "carried" for item in state.items]
        assert [place.look == "hollow" for place in places[1:]] == [item == "dropped" for item in state.items]
        assert draw(code)


def test_worlds_without_cells_are_told_in_words(tmp_path: Path) -> None:
    taxi = view_of(read_task(EXAMPLES / "taxi.toml"))
    assert taxi.facts == ("passenger", "destination")
    assert len(taxi.board.walls) > 1
    assert taxi.look((0,)).facts == ("red", "red")
    path = tmp_path / "task.toml"
    path.write_text('[environment]\nid = "Blackjack-v1"\n', encoding="utf-8")
    plain = view_of(replace(read_task(EXAMPLES / "taxi.toml"), path=str(path)))
    assert plain.look((3,)).facts == ("3",)


def task_of(text: str, folder: Path) -> tuple[Task, Findings]:
    path = folder / "task.toml"
    path.write_text(text, encoding="utf-8")
    task = read_task(path)
    return task, study(plants_of(task), tuple(rule.automaton for rule in task.rules), task.options)


def test_plants_alone_play_what_their_supervisor_enables(tmp_path: Path) -> None:
    task, findings = task_of(LAMP, tmp_path)
    played = playback_of(task, findings, episodes=4)
    assert played == playback_of(task, findings, episodes=4)
    assert len({episode.steps for episode in played.reels[0].episodes}) > 1
    supervisor = findings.supervisor.automaton
    for episode in played.reels[0].episodes:
        word = [event for step in episode.steps for event in step.word or ()]
        assert supervisor.run(word) >= 0
        assert word.count("fuse") <= 1
    barred = {pair for e in played.reels[0].episodes for step in e.steps for pair in step.cannot}
    assert barred == {("on", "fuse can follow, which nobody controls and breaks once")}


def test_what_cannot_be_kept_is_not_played(tmp_path: Path) -> None:
    task, findings = task_of(
        LAMP.replace("times = 1", "times = 0").replace("dark -on-> lit", "initial lit"), tmp_path
    )
    assert findings.verdict == "not_enforceable"
    assert playback_of(task, findings) is None


def test_a_policy_of_another_task_is_refused() -> None:
    task, findings = studied("frozen_lake")
    with pytest.raises(MDPError, match="the learned policy has 3 states, and the product of the task 329"):
        playback_of(task, findings, np.zeros(3, np.int32))
    model, enabled = supervise(task.environment, task)
    free = safe_actions(model, nonblocking=False, lookahead="one_step")
    worse = any_policy(model, enabled)
    wrong = np.flatnonzero((free & ~enabled).any(axis=1) & enabled.any(axis=1))
    worse[wrong] = np.argmax((free & ~enabled)[wrong], axis=1)
    assert evaluate(model, any_policy(model, enabled), gamma=0.9).violation == 0
    with pytest.raises(MDPError, match="does what the supervisor disables in state"):
        playback_of(task, findings, worse)


# --- boards and the document ------------------------------------------------------------------------------


def test_a_board_draws_what_it_has() -> None:
    board = Board(
        ((0, 0), (1, 0)),
        (Token("<a>", "arrow"), Token("b", sign="&")),
        {(1, 0): Tile("H", "hole")},
        title="x & y",
    )
    svg = board_svg(board, [Place(0.5, 0.5, angle=90, look="hollow")])
    assert '<g class="token arrow hollow" style="transform:translate(20px,20px) scale(1)">' in svg
    assert "rotate(90deg)" in svg
    assert svg.count("display:none") == 1  # b is nowhere
    assert "&lt;a&gt;" in svg
    assert "x &amp; y" in svg
    assert 'class="tile hole"' in svg


def test_tokens_at_one_place_stand_beside_each_other() -> None:
    one, two, three = spread_out({0: (1, 1), 1: (1, 1), 2: (5, 5)}, 3)
    assert one.x < 1 < two.x
    assert one.size == two.size < three.size == 1


def test_a_document_counts_in_names_and_texts() -> None:
    task, findings = studied("frozen_lake")
    document = playback_document(playback_of(task, findings, episodes=1))
    names, texts = document["names"], document["texts"]
    assert len(set(names)) == len(names)
    assert len(set(texts)) == len(texts)
    for step in document["reels"][0]["episodes"][0]["steps"]:
        assert all(0 <= n < len(names) for n in [*step["can"], *step["may"], *(n for n, _ in step["not"])])
        assert all(0 <= t < len(texts) for _, t in step["not"])
    assert playback_document(Playback((), ()))["reels"] == []

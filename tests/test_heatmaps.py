"""Heat maps of grids: on which cell a state stands, what a cell tells, where a policy points; the files."""

import re
import sys
from collections import Counter
from importlib import import_module
from math import log10
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from supremal import (
    Alphabet,
    MDPError,
    MissingDependencyError,
    ModelError,
    evaluate,
    from_outcomes,
    value_iteration,
)
from supremal.decisions.visits import expected_visits
from supremal.envs import environment_model
from supremal.envs.pickup_delivery import decode
from supremal.show._scale import limits, tick_labels, ticks
from supremal.show.board import Board, Place
from supremal.show.heatmaps import (
    cells_of,
    mean_on_cells,
    policy_arrows,
    save_heatmap,
    total_on_cells,
)
from supremal.show.playback import Look
from supremal.task.boards import view_of
from supremal.task.experiment import supervise
from supremal.task.reading import read_task

ROOT = Path(__file__).parents[1]
LANE = Board(((0, 0), (1, 0), (2, 0)), ())


@pytest.fixture(scope="module")
def worlds():
    """Three grids under their rules: the model, the mask, the map, and the cell of each state."""
    found = {}
    for name in ("frozen_lake", "taxi", "pickup_delivery"):
        task = read_task(ROOT / "examples" / f"{name}.toml")
        model, enabled = supervise(task.environment, task)
        view = view_of(task)
        found[name] = model, enabled, view.board, cells_of(view.board, model, view.look)
    return found


# --- visits -----------------------------------------------------------------------------------------------


def test_visits_agree_with_the_exact_evaluation(worlds):
    """An episode's expected steps are its visits of states that are no end."""
    model, enabled, _, _ = worlds["pickup_delivery"]
    plan = value_iteration(model, gamma=0.9, enabled=enabled)
    exact = evaluate(model, plan.policy, gamma=0.9, horizon=60)
    visits = expected_visits(model, plan.policy, horizon=200)
    assert visits[~model.terminal].sum() == pytest.approx(exact.expected_steps)
    assert visits[model.terminal & model.marked].sum() == pytest.approx(exact.completion)
    short = expected_visits(model, plan.policy, horizon=41)
    assert short[model.terminal & model.marked].sum() == pytest.approx(exact.completion_within[41])


def test_visits_are_what_playing_counts():
    model = environment_model("FrozenLake-v1")
    policy, random, counted = np.full(model.n_states, 2), np.random.default_rng(0), Counter()
    for _ in range(4000):
        state = int(random.choice(model.n_states, p=model.initial))
        counted[state] += 1
        for _ in range(10):
            if model.terminal[state]:
                break
            outcomes = model.outcomes(state, 2)
            state = int(random.choice(model.next_state[outcomes], p=model.prob[outcomes]))
            counted[state] += 1
    mean = np.array([counted[s] / 4000 for s in range(model.n_states)])
    assert expected_visits(model, policy, horizon=10) == pytest.approx(mean, abs=0.08)


def test_no_steps_visit_the_start_alone():
    model = environment_model("FrozenLake-v1")
    assert expected_visits(model, np.zeros(model.n_states, int), horizon=0).tolist() == model.initial.tolist()


def test_visits_of_what_cannot_be():
    sigma = Alphabet(("a",))
    model = from_outcomes([(0, "a", 1, 1.0, ("a",)), (2, "a", 1, 1.0, ("a",))], alphabet=sigma, terminal=[1])
    with pytest.raises(MDPError, match="the horizon is -1; a whole number of steps, 0 or more"):
        expected_visits(model, [0, 0, 0], horizon=-1)
    with pytest.raises(MDPError, match="takes an infeasible action, or none, in a state that it reaches"):
        expected_visits(model, [-1, -1, -1], horizon=3)


# --- cells ------------------------------------------------------------------------------------------------


def test_states_stand_on_the_cells_of_their_environment(worlds):
    model, _, board, where = worlds["frozen_lake"]
    for own, cell in zip(model.origin[:, 0].tolist(), where.tolist(), strict=True):
        assert cell == own  # FrozenLake counts its cells row by row, and -1 is where a rule is broken
    model, _, board, where = worlds["taxi"]
    for own, cell in zip(model.origin[:, 0].tolist(), where.tolist(), strict=True):
        assert own < 0 or board.cells[cell] == (own // 20 % 5, own // 100)
    model, _, board, where = worlds["pickup_delivery"]
    for own, cell in zip(model.origin[::97, 0].tolist(), where[::97].tolist(), strict=True):
        assert own < 0 or board.cells[cell] == (decode(own).x, 6 - decode(own).y)


def test_who_is_nowhere_or_beside_the_map_is_on_no_cell():
    model = from_outcomes([(s, "a", s, 1.0, ()) for s in range(3)], alphabet=Alphabet(("a",)))
    at = (Place(2.9, 0.1), None, Place(1.0, 1.0))
    found = cells_of(LANE, model, lambda state: Look((None, at[state[0]])), token=1)
    assert found.tolist() == [2, -1, -1]
    assert found.dtype == np.int32


@given(
    st.lists(
        st.tuples(st.integers(-1, 2), st.floats(-9, 9), st.integers(0, 3)),
        max_size=12,
    )
)
def test_means_and_totals_by_definition(rows):
    where = np.array([cell for cell, _, _ in rows], int)
    values, weights = np.array([v for _, v, _ in rows], float), np.array([w for *_, w in rows], float)
    for cell in range(3):
        mine = [(v, w) for k, v, w in rows if k == cell]
        total = total_on_cells(LANE, where, values)[cell]
        assert (
            np.isnan(total)
            if not any(v for v, _ in mine)
            else total == pytest.approx(sum(v for v, _ in mine))
        )
        mass = sum(w for _, w in mine)
        mean = mean_on_cells(LANE, where, values, weights)[cell]
        assert np.isnan(mean) if not mass else mean == pytest.approx(sum(v * w for v, w in mine) / mass)


@pytest.mark.parametrize(
    ("where", "values", "weights", "said"),
    [
        ([0, 1], [1.0], None, r"where has shape \(2,\) and type int64; a whole number for each of 1 states"),
        ([0.0], [1.0], None, "type float64"),
        ([3], [1.0], None, "where holds 3 to 3; the cells are 0 to 2, or -1"),
        ([-2], [1.0], None, "where holds -2"),
        ([0, 1], [1.0, 2.0], [1.0], r"the weights have shape \(1,\)"),
        ([0], [1.0], [-1.0], "from -1 up; 1 numbers are needed, none below 0"),
        ([0], [1.0], [np.nan], "none endless"),
    ],
)
def test_what_does_not_fit(where, values, weights, said):
    with pytest.raises(ModelError, match=said):
        mean_on_cells(LANE, np.array(where), np.array(values), None if weights is None else np.array(weights))


# --- arrows -----------------------------------------------------------------------------------------------


def walk(*lines):
    sigma = Alphabet(("left", "hop", "stay"))
    return from_outcomes([(s, act, to, p, (act,)) for s, act, to, p in lines], alphabet=sigma)


def test_a_name_points_whatever_chance_does_and_others_where_they_lead():
    model = walk(
        (0, "left", 1, 1.0), (1, "hop", 2, 0.5), (1, "hop", 1, 0.5), (2, "hop", 0, 1.0), (3, "stay", 3, 1.0)
    )
    where = np.array([0, 1, 2, 2])
    left, hop, stay = (model.actions.index(name) for name in ("left", "hop", "stay"))
    arrows = policy_arrows(LANE, where, model, [left, hop, hop, stay])
    assert arrows == [(0, -1, 0, 1), (1, 1, 0, 1), (2, -1, 0, 0.5), (2, 0, 0, 0.5)]
    weighted = policy_arrows(LANE, where, model, [left, hop, hop, stay], weights=np.array([0.0, 1, 3, 1]))
    assert weighted == [(1, 1, 0, 1), (2, -1, 0, 0.75), (2, 0, 0, 0.25)]
    turned = policy_arrows(LANE, where, model, [left, -1, -1, -1], compass={"left": (0.0, 5.0)})
    assert turned == [(0, 0, 1, 1)]


def test_a_policy_that_draws_lots_has_an_arrow_for_each_lot():
    model = walk((0, "left", 0, 1.0), (0, "hop", 1, 1.0), (1, "stay", 1, 1.0))
    policy = np.zeros((2, model.n_actions))
    policy[0, model.actions.index("left")], policy[0, model.actions.index("hop")] = 0.25, 0.75
    assert policy_arrows(LANE, np.array([0, 1]), model, policy) == [(0, -1, 0, 0.25), (0, 1, 0, 0.75)]


def test_the_arrows_of_a_lake_are_its_policy(worlds):
    model, enabled, board, where = worlds["frozen_lake"]
    plan = value_iteration(model, gamma=0.99, enabled=enabled)
    ways = {"left": (-1, 0), "down": (0, 1), "right": (1, 0), "up": (0, -1)}
    arrows = policy_arrows(board, where, model, plan.policy)
    told = {(arrow.cell, arrow.x, arrow.y): arrow.share for arrow in arrows}
    live = [
        s for s in range(model.n_states) if where[s] >= 0 and plan.policy[s] >= 0 and not model.terminal[s]
    ]
    count = Counter((int(where[s]), *ways[model.actions[plan.policy[s]]]) for s in live)
    whole = Counter(int(where[s]) for s in live)
    assert told == {way: pytest.approx(n / whole[way[0]]) for way, n in count.items()}


def test_the_grid_has_no_names_of_directions_and_points_all_the_same(worlds):
    """The agent of the grid turns left and right: where it goes from a cell is where it is next."""
    model, enabled, board, where = worlds["pickup_delivery"]
    plan = value_iteration(model, gamma=0.9, enabled=enabled)
    visits = expected_visits(model, plan.policy, horizon=60)
    cells = np.array(board.cells)
    for cell, x, y, share in policy_arrows(board, where, model, plan.policy, weights=visits):
        assert 0 < share <= 1
        assert (x, y) == (0, 0) or tuple(cells[cell] + (int(x), int(y))) in board.cells
        assert abs(x) + abs(y) in {0, 1}


# --- files ------------------------------------------------------------------------------------------------


def test_maps_are_written_the_same_twice(worlds, tmp_path):
    model, enabled, board, where = worlds["taxi"]
    plan = value_iteration(model, gamma=0.9, enabled=enabled)
    heat = mean_on_cells(board, where, plan.value, ~model.terminal)
    arrows = policy_arrows(board, where, model, plan.policy)
    one = save_heatmap(tmp_path / "new" / "map", board, heat, arrows=arrows, title="A $", unit="%")
    two = save_heatmap(tmp_path / "map.v2", board, heat, arrows=arrows, title="A $", unit="%")
    assert [path.name for path in one + two] == ["map.png", "map.svg", "map.v2.png", "map.v2.svg"]
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]
    assert one[0].read_bytes().startswith(b"\x89PNG")


def test_cells_are_vectors_and_say_their_colours(tmp_path):
    """The darkest cell is the largest, the palest the least, and one without a number has no colour."""
    _, svg = save_heatmap(tmp_path / "lane", LANE, np.array([1.0, np.nan, 3.0]))
    text = svg.read_text(encoding="utf-8")
    colours = re.findall(r"fill: (#[0-9a-f]{6}); stroke: #ffffff", text.split("QuadMesh_1")[1])
    assert len(colours) == 2
    pale, dark = (int(colour[1:3], 16) for colour in colours)  # how much red
    assert pale > 0xC0
    assert dark < 0x20
    assert "<pattern" in text  # the hatch of the cell between


@pytest.mark.parametrize("heat", [None, [np.nan] * 3, [2.0] * 3, [0.0] * 3, [-np.inf, 1e-7, 1e9]])
def test_odd_heats_have_a_picture(tmp_path, heat):
    assert (
        save_heatmap(tmp_path / "map", LANE, None if heat is None else np.array(heat))[0].stat().st_size > 0
    )


def test_a_heat_has_a_number_for_each_cell(tmp_path):
    with pytest.raises(ModelError, match=r"shape \(2,\); a number for each of 3 cells is needed"):
        save_heatmap(tmp_path / "map", LANE, np.zeros(2))
    assert [*tmp_path.iterdir()] == []


def test_without_matplotlib_maps_say_what_to_install(monkeypatch, tmp_path):
    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    show = import_module("supremal.show")
    for name in ("_matplotlib", "_heat"):
        monkeypatch.delitem(sys.modules, f"supremal.show.{name}", raising=False)
        monkeypatch.delattr(show, name, raising=False)
    with pytest.raises(
        MissingDependencyError, match=r"drawing figures needs matplotlib: pip install 'supremal\[plot\]'"
    ):
        save_heatmap(tmp_path / "map", LANE)


# --- scales -----------------------------------------------------------------------------------------------


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6))
def test_ticks_say_their_own_values_and_no_two_the_same(low, span):
    marks = ticks(*limits([low, low + span]))
    said = tick_labels(marks)
    assert len(set(said)) == len(marks)
    step = 10.0 ** (log10(span) - 1)
    for mark, text in zip(marks, said, strict=True):
        assert float(text.replace(",", "").replace("\u2212", "-")) == pytest.approx(mark, abs=1e-3 * step)


# --- the published text -----------------------------------------------------------------------------------


def test_the_page_runs_as_printed(tmp_path, monkeypatch):
    page = (ROOT / "docs" / "plots.md").read_text(encoding="utf-8")
    blocks = [block.split("```")[0] for block in page.split("```python plot\n")[1:]]
    assert len(blocks) == 5
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    exec(compile("\n".join(blocks), "docs/plots.md", "exec"), {})  # noqa: S102 - our own page
    assert sorted(path.name for path in (tmp_path / "maps").iterdir()) == [
        f"{name}.{ending}"
        for name in ("cell", "policy", "score", "value", "visits")
        for ending in ("png", "svg")
    ]

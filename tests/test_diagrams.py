"""Diagrams: nothing covers anything, every sign is there, and notebooks and files get the same pictures."""

from __future__ import annotations

import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from io import BytesIO
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from matplotlib.image import imread

import supremal as sp
from strategies import SEEDS
from supremal import (
    Alphabet,
    Automaton,
    AutomatonError,
    FormatError,
    ModelError,
    Monitor,
    Outcome,
    Violation,
    from_outcomes,
    from_text,
    from_transitions,
    reward_machine,
    sync,
    synthesize,
)
from supremal.cli._parts import parts_of
from supremal.show import _graphviz
from supremal.show._curves import Link
from supremal.show._ink import style_of
from supremal.show._layered import layered
from supremal.show._layers import layers_of
from supremal.show._layout import arrange
from supremal.show._raster import _letters, png_of
from supremal.show._scene import Circle, Scene, Words
from supremal.show._scene import Path as Outline
from supremal.show._scene import svg_of as svg_of_scene
from supremal.show._text import SIZE, Run, box, plain, width
from supremal.show.diagram import MAX_STATES, automaton_scene, automaton_svg, machine_scene
from supremal.show.legend import SIGNS, signs_in
from supremal.show.neighbourhood import neighbourhood
from supremal.show.notebook import html_of, svg_of
from supremal.show.pictures import dot_of, save_picture, scene_of
from supremal.show.supervised import supervisor_scene, supervisor_svg, with_removed
from supremal.show.tables import rows_of
from supremal.synthesis.supervisor import Supervisor

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.toml"))
TOUCH = 1.0  # units of the drawing: as much as two boxes may share
PNG = b"\x89PNG\r\n\x1a\n"

LAMP = from_text("name lamp \n marked dark \n uncontrollable burn \n dark -on-> lit \n lit -off, burn-> dark")
OVEN = from_text("""
    name oven
    uncontrollable fail
    marked idle
    idle -start-> busy
    busy -stop-> idle
    busy -push-> hot
    hot -fail-> burnt
    hot -stop-> idle
""")
COOL = from_text("name cool \n events push \n cool -start, stop-> cool")  # never push
CHAIN = from_text("\n".join(f"{k} -next-> {k + 1}" for k in range(100)))
COFFEE = reward_machine(["c"], [("u", "c", "v", 1.0), ("v", "!c", "u", -0.5)], name="coffee")


def random_automaton(states: int, seed: int, *, events: int = 2) -> Automaton:
    """An automaton whose states can all be reached, a third of them marked; `u` is uncontrollable."""
    rng = np.random.default_rng(seed)
    names = tuple("uabcd"[:events])
    delta = np.where(rng.random((states, events)) < 0.4, -1, rng.integers(0, states, (states, events)))
    for s in range(1, states):
        free = np.argwhere(delta[:s] == -1)
        source, event = free[rng.integers(len(free))] if len(free) else (s - 1, 0)
        delta[source, event] = s
    return Automaton(Alphabet(names, frozenset("u")), delta, rng.random(states) < 1 / 3)


def labels_of(scene: Scene) -> list[tuple[float, float, float, float]]:
    """Where each label of a scene is: x, y, width, height."""
    words = [mark for group in scene.groups for mark in group.marks if isinstance(mark, Words)]
    return [(text.x, text.y, *box(text.lines)) for text in words if text.css == "label"]


def nodes_of(scene: Scene) -> list[tuple[float, float, float]]:
    """Where each node of a scene is: x, y, radius."""
    found = []
    for group in scene.groups:
        for mark in group.marks:
            if mark.css == "node" and isinstance(mark, Circle):
                found.append((mark.x, mark.y, mark.r))
            elif mark.css == "node" and isinstance(mark, Outline):
                corners = [tuple(map(float, pair.split(","))) for pair in mark.d.strip("MZ ").split(" L")]
                (x, y), (u, v) = np.mean(corners, axis=0), corners[0]
                found.append((float(x), float(y), float(np.hypot(u - x, v - y))))
    return found


def overlaps(scene: Scene) -> list[str]:
    """Say which labels and nodes of a scene share more than a hair's breadth."""
    labels, nodes, found = labels_of(scene), nodes_of(scene), []
    for (x, y, w, h), (a, b, c, d) in combinations(labels, 2):
        if min((w + c) / 2 - abs(x - a), (h + d) / 2 - abs(y - b)) > TOUCH:
            found.append(f"labels at {x:.0f},{y:.0f} and {a:.0f},{b:.0f}")
    for x, y, w, h in labels:
        for u, v, r in nodes:
            if np.hypot(max(abs(x - u) - w / 2, 0), max(abs(y - v) - h / 2, 0)) < r - TOUCH:
                found.append(f"label at {x:.0f},{y:.0f} and node at {u:.0f},{v:.0f}")
    for (x, y, r), (u, v, q) in combinations(nodes, 2):
        if np.hypot(x - u, y - v) < r + q - TOUCH:
            found.append(f"nodes at {x:.0f},{y:.0f} and {u:.0f},{v:.0f}")
    return found


def outside(scene: Scene) -> list[str]:
    """Say which nodes and labels of a scene leave its frame."""
    x, y, w, h = scene.frame
    boxes = labels_of(scene) + [(u, v, 2 * r, 2 * r) for u, v, r in nodes_of(scene)]
    return [
        f"{a:.0f},{b:.0f}"
        for a, b, c, d in boxes
        if not (x <= a - c / 2 and a + c / 2 <= x + w and y <= b - d / 2 and b + d / 2 <= y + h)
    ]


def drawn(automaton: Automaton, **options: object) -> Scene:
    return automaton_scene(automaton, legend=False, **options)


# --- nothing covers anything ------------------------------------------------------------------------------


def example_scenes() -> Iterator[tuple[str, Scene]]:
    """Every part of the examples; of what is large the part around its initial state."""
    for file in EXAMPLES:
        for part in parts_of(file):
            model = part.make()
            seen = model.automaton if isinstance(model, Supervisor) else model
            large = isinstance(seen, Automaton) and seen.n_states > MAX_STATES
            yield f"{file.stem}: {part.name}", scene_of(model, **({"around": 0} if large else {}))


def test_no_label_of_the_examples_covers_anything() -> None:
    bad = {name: overlaps(scene) + outside(scene) for name, scene in example_scenes()}
    assert len(bad) >= 20
    assert {name: found for name, found in bad.items() if found} == {}


@pytest.mark.parametrize("states", [1, 2, 7, 12, 30, MAX_STATES])
def test_no_label_of_a_random_automaton_covers_anything(states: int) -> None:
    for seed in range(1 if states > 20 else 3):
        scene = drawn(random_automaton(states, seed))
        assert len(nodes_of(scene)) == states
        assert overlaps(scene) + outside(scene) == []


@settings(max_examples=8, deadline=None)
@given(SEEDS)
def test_any_small_automaton_is_drawn_without_overlaps(seed: int) -> None:
    states = 1 + seed % 9
    scene = drawn(random_automaton(states, seed, events=1 + seed % 5))
    assert overlaps(scene) + outside(scene) == []


def test_the_check_of_overlaps_can_fail() -> None:
    scene = drawn(LAMP)
    assert overlaps(Scene("", "", scene.frame, scene.groups * 2)) != []
    assert outside(Scene("", "", (0, 0, 1, 1), scene.groups)) != []


@pytest.mark.parametrize("weight", ["normal", "bold"])
def test_text_is_no_wider_than_its_box(weight: str) -> None:
    for text in ("environment", "R2 is down", "(0,2)", "MMWW", "illicit", "repair_3", "dropoff", "MOW"):
        outline = _letters(text, "STIXGeneral", "italic", weight, SIZE)
        assert np.ptp(outline.vertices[:, 0]) <= width((Run(text),))


# --- layout -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_layers_hold_every_node_once_and_chains_go_layer_by_layer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    links = [Link(int(a), int(b), 20, 17) for a, b in rng.integers(0, 15, (30, 2))]
    layers = layers_of(15, links)
    assert sorted(item for layer in layers.layers for item in layer) == list(range(layers.items))
    level = {item: at for at, layer in enumerate(layers.layers) for item in layer}
    assert all(level[node] % 2 == 0 for node in range(15))
    for link, chain in zip(links, layers.chains, strict=True):
        if link.source != link.target:
            assert (chain[0], chain[-1]) == (link.source, link.target)
            assert {abs(level[a] - level[b]) for a, b in pairwise(chain)} == {1}
        else:
            assert chain == ()


def test_a_tree_is_drawn_without_crossings() -> None:
    links = [Link((k - 1) // 2, k, 20, 17) for k in range(1, 31)]
    layers = layers_of(31, links)
    assert layers.crossings() == 0
    assert layered([17.0] * 31, links, layers).clash < TOUCH


def test_small_rounds_are_circles_and_long_ways_are_layers() -> None:
    around = [Link(k, (k + 1) % 6, 20, 17) for k in range(6)]
    along = [Link(k, k + 1, 20, 17) for k in range(6)]
    size = [17.0] * 7
    assert np.array_equal(arrange(size[:6], around).where, arrange(size[:6], around, "circle").where)
    assert np.array_equal(arrange(size, along).where, arrange(size, along, "layered").where)


def test_an_unknown_layout_says_which_there_are() -> None:
    with pytest.raises(ModelError, match="there is no layout 'layer'; did you mean 'layered'"):
        automaton_svg(LAMP, layout="layer")


# --- Graphviz: its program, and programs that misbehave ---------------------------------------------------


def other_dot(folder: Path, monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    program = folder / "dot"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setattr(_graphviz.shutil, "which", lambda _: str(program))


ANSWER = """cat >/dev/null; cat <<'END'
{"bb": "0,0,200,50", "objects": [{"name": "-1", "pos": "0,25"}, {"name": "0", "pos": "40,25"},
 {"name": "1", "pos": "160,25"}], "edges": [{"id": "-1", "pos": "e,1,1 0,0 0,0 0,0 0,0"},
 {"id": "0", "pos": "e,140,25 60,25 80,25 100,25 131,25", "lp": "100,38"},
 {"id": "1", "pos": "e,60,20 140,20 120,20 100,20 69,20", "lp": "100,8"}]}
END"""


def test_graphviz_gives_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other_dot(tmp_path, monkeypatch, ANSWER)
    drawing = arrange([17.0, 17.0], [Link(0, 1, 20, 17), Link(1, 0, 20, 17)], "graphviz")
    assert drawing.where.tolist() == [[40, 25], [160, 25]]
    assert drawing.labels.tolist() == [[100, 12], [100, 42]]  # its y-axis points up
    assert drawing.curves[0].tip == (140, 25)
    assert "graphviz" not in automaton_svg(LAMP, layout="graphviz").lower()


def test_what_stands_in_a_model_does_not_reach_graphviz(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = tmp_path / "asked"
    other_dot(tmp_path, monkeypatch, ANSWER.replace("/dev/null", str(kept)))
    automaton_svg(LAMP, layout="graphviz")
    asked = kept.read_text()
    assert "0 -> 1" in asked
    assert not any(name in asked for name in ("dark", "lit", "burn", "lamp"))


@pytest.mark.skipif(_graphviz.shutil.which("dot") is None, reason="Graphviz is not installed")
@pytest.mark.parametrize("states", [4, 30])
def test_the_real_graphviz_draws_the_same_nodes(states: int) -> None:
    scene = drawn(random_automaton(states, 1), layout="graphviz")
    assert len(nodes_of(scene)) == states
    assert len(labels_of(scene)) == len(labels_of(drawn(random_automaton(states, 1))))


def test_graphviz_that_is_slow_broken_or_absent_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_graphviz, "_SECONDS", 0.2)
    other_dot(tmp_path, monkeypatch, "exec sleep 20")
    with pytest.raises(ModelError, match=r"took more than 0\.2 seconds"):
        automaton_svg(LAMP, layout="graphviz")
    for script in ("exit 3", "echo no JSON"):
        other_dot(tmp_path, monkeypatch, script)
        with pytest.raises(ModelError, match="Graphviz failed"):
            automaton_svg(LAMP, layout="graphviz")
    monkeypatch.setattr(_graphviz.shutil, "which", lambda _: None)
    with pytest.raises(ModelError, match="Graphviz is not there"):
        automaton_svg(LAMP, layout="graphviz")
    with pytest.raises(ModelError, match="too many for Graphviz"):
        arrange([17.0], [Link(0, 0)] * 2_001, "graphviz")


# --- signs ------------------------------------------------------------------------------------------------


def css_of(scene: Scene) -> set[str]:
    return {name for group in scene.groups for name in group.css.split()}


def test_every_sign_is_in_the_legend_of_a_picture_that_uses_it() -> None:
    mask = np.ones(OVEN.delta.shape, bool)
    mask[1, OVEN.alphabet.index("push")] = False
    scene = automaton_scene(OVEN, current="busy", removed=["hot"], enabled=mask, around="busy", legend=True)
    assert {"initial", "free", "disabled", "marked", "trap", "current", "focus", "removed"} <= set(
        signs_in(scene)
    )
    words = [
        plain(mark.lines)
        for g in scene.groups
        for mark in g.marks
        if isinstance(mark, Words) and mark.css == "key"
    ]
    assert words[1:] == [SIGNS[sign] for sign in signs_in(scene)]  # the first says which part it is


def test_signs_differ_without_colour() -> None:
    """A state and an edge of each kind differ in their marks or in what is no colour of their style."""
    kinds = (
        "initial",
        "plain",
        "free",
        "mixed",
        "disabled",
        "marked",
        "trap",
        "current",
        "focus",
        "removed",
        "open",
    )
    looks = []
    for sign in kinds:
        edge = sign in ("plain", "free", "mixed", "disabled")
        group = f"{'edge' if edge else 'state'} {sign}"
        marks = ("cross",) if sign == "disabled" else ("ring",) if sign == "marked" else ()
        shape = "octagon" if sign == "trap" else "hatched" if sign == "removed" else ""
        style = style_of(group, "line" if edge else "node")
        if sign != "initial":
            looks.append(
                (
                    edge,
                    marks,
                    shape,
                    style.get("stroke-dasharray"),
                    style.get("stroke-width"),
                    style.get("fill-opacity"),
                )
            )
    assert len(set(looks)) == len(looks)


def test_a_removed_state_is_hatched_and_its_edges_light() -> None:
    scene = drawn(OVEN, removed=["hot"])
    (hot,) = [group for group in scene.groups if "removed" in group.css and group.css.startswith("state")]
    assert "hatch" in {mark.css for mark in hot.marks}
    assert "trap" in css_of(scene)  # burnt
    mask = np.array([False, False, True, False])
    assert svg_of_scene(drawn(OVEN, removed=mask)) == svg_of_scene(scene)


def test_wrong_states_and_masks_are_refused() -> None:
    with pytest.raises(AutomatonError, match="has no state 'bussy'; did you mean 'busy'"):
        automaton_svg(OVEN, current="bussy")
    with pytest.raises(AutomatonError, match="has no state 9; its states are 0 to 3"):
        automaton_svg(OVEN, around=9)
    with pytest.raises(AutomatonError, match=r"a mask of states has shape \(2,\)"):
        automaton_svg(OVEN, removed=np.array([True, False]))
    with pytest.raises(AutomatonError, match=r"enabled has shape \(1, 1\)"):
        automaton_svg(OVEN, enabled=np.ones((1, 1), bool))


# --- large ones -------------------------------------------------------------------------------------------


def test_a_neighbourhood_is_what_some_steps_reach() -> None:
    near = neighbourhood(CHAIN, "50", most=8)
    assert sorted(near.states.tolist()) == list(range(47, 54))
    assert near.states[0] == 50  # comes first where the initial state is not there
    assert near.open[[near.states.tolist().index(s) for s in (47, 53)]].all()
    assert near.open.sum() == 2
    whole = neighbourhood(LAMP, "lit")
    assert (whole.complete, whole.states.tolist(), whole.open.any()) == (True, [0, 1], False)


def test_of_a_crowd_some_are_shown() -> None:
    star = from_transitions(
        Alphabet(tuple(f"e{k}" for k in range(99))), [("hub", f"e{k}", f"s{k}") for k in range(99)]
    )
    near = neighbourhood(star, "hub")
    assert (len(near.states), near.complete) == (24, False)
    assert "some of those within 1 step of hub" in str(near)


def test_around_draws_a_part_and_says_which() -> None:
    svg = automaton_svg(CHAIN, around="50")
    assert "states: those within" in svg
    assert 'class="edge initial"' not in svg.split("those within")[0]  # state 0 is not in it
    assert "too large to draw" in automaton_svg(CHAIN)


def test_tables_of_transitions() -> None:
    assert [tuple(row) for row in rows_of(COFFEE)] == [("→ u", "c, 1", "v"), ("v", "!c, -0.5", "→ u")]
    assert [tuple(row) for row in rows_of(LAMP, [1])] == [("lit", "off, burn!", "→ dark *")]


# --- supervisors ------------------------------------------------------------------------------------------


def test_a_supervisor_shows_what_it_takes_away() -> None:
    supervisor = synthesize(OVEN, COOL)
    whole, removed, enabled = with_removed(supervisor, (OVEN,))
    assert [whole.state_name(s) for s in np.flatnonzero(removed)] == ["hot", "burnt"]
    assert np.argwhere(~enabled & (whole.delta >= 0)).tolist() == [[1, OVEN.alphabet.index("push")]]
    svg = supervisor_svg(supervisor, OVEN, legend=True)
    assert "busy → hot: push (disabled)" in svg
    assert "disabled" not in supervisor_svg(supervisor)


def test_a_supervisor_that_remembers_ends_in_removed_states() -> None:
    plant = from_text("here -a, b-> here")
    supervisor = synthesize(plant, from_text("0 -a-> 1 \n 0 -b-> 0 \n 1 -b-> 0"))
    whole, removed, enabled = with_removed(supervisor, (plant,))
    assert (supervisor.automaton.n_states, int(removed.sum())) == (2, 1)
    assert whole.state_name(2) == "here"
    assert int((~enabled & (whole.delta >= 0)).sum()) == 1


def test_a_supervisor_and_another_plant_are_refused() -> None:
    supervisor = synthesize(OVEN, COOL)
    with pytest.raises(ModelError, match="synthesized for 1 plants, and 2 are given"):
        supervisor_svg(supervisor, [OVEN, LAMP])
    with pytest.raises(ModelError, match="not the one that this supervisor was synthesized for"):
        supervisor_svg(synthesize(OVEN, COOL), LAMP)


def test_an_empty_supervisor_says_so() -> None:
    plant = from_text("uncontrollable fail \n on -fail-> off")
    nothing = synthesize(plant, Automaton(plant.alphabet, [[-1]], [True]))
    assert nothing.automaton.n_states == 0
    assert "no state, no word" in supervisor_svg(nothing, plant)
    assert "nothing can be enforced" in html_of(nothing)


# --- files ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "model", [LAMP, COFFEE, synthesize(OVEN, COOL)], ids=["automaton", "machine", "supervisor"]
)
def test_pictures_are_written_the_same_twice(model: Automaton, tmp_path: Path) -> None:
    for ending in (".svg", ".png", ".dot"):
        one, two = (save_picture(tmp_path / f"{name}{ending}", model) for name in "ab")
        assert one.read_bytes() == two.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        f"{n}.{e}" for n in "ab" for e in ("dot", "png", "svg")
    ]
    assert (tmp_path / "a.png").read_bytes().startswith(PNG)
    svg = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert "var(" not in svg  # any program understands its colours
    ET.fromstring(svg)  # noqa: S314 - our own text
    assert (tmp_path / "a.dot").read_text(encoding="utf-8") == dot_of(model)


def test_a_picture_of_no_known_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"pictures end in \.svg, \.png, \.dot, not in '\.gif'"):
        save_picture(tmp_path / "lamp.gif", LAMP)
    with pytest.raises(OSError, match="No such file"):
        save_picture(tmp_path / "nowhere" / "lamp.svg", LAMP)
    assert list(tmp_path.iterdir()) == []


def test_a_png_shows_ink_where_the_scene_has_it() -> None:
    scene = scene_of(LAMP, current="lit")
    image = imread(BytesIO(png_of(scene, scale=1.0)))[..., :3].mean(axis=2)
    left, top, wide, high = scene.frame
    assert np.abs(np.array(image.shape) - (high, wide)).max() <= 1
    (x, y, r), (u, v, q) = nodes_of(scene)
    dark, lit = image[int(y - top - 0.5 * r), int(x - left)], image[int(v - top - 0.5 * q), int(u - left)]
    assert dark > 0.8
    assert lit < 0.3  # the current state is filled


@pytest.mark.skipif(_graphviz.shutil.which("dot") is None, reason="Graphviz is not installed")
def test_graphviz_reads_what_we_write() -> None:
    for model in (LAMP, COFFEE, from_text('name a"b \n x -go-> y')):
        done = subprocess.run(
            ["dot", "-Tplain"], input=dot_of(model), capture_output=True, text=True, check=True
        )
        assert sum(line.startswith("node") for line in done.stdout.splitlines()) == 3


# --- notebooks --------------------------------------------------------------------------------------------


def test_notebooks_get_pictures_and_tables() -> None:
    supervisor = synthesize(OVEN, COOL)
    rule = sp.rule_from_regex("~(.* push push .*)", OVEN.alphabet, name="gently")
    for value in (LAMP, supervisor, Monitor(supervisor), COFFEE, rule):
        svg, html = value._repr_svg_(), value._repr_html_()
        ET.fromstring(svg)  # noqa: S314 - our own text
        assert svg in html
    assert "gently" in rule._repr_html_()
    found = Violation(("start",), "<fail>", "busy", "1")
    assert "&lt;fail&gt;" in found._repr_html_()
    assert not hasattr(found, "_repr_svg_")


def test_a_notebook_shows_a_part_of_what_is_large() -> None:
    assert "those within" in svg_of(CHAIN)
    assert "101" in html_of(CHAIN)
    large = sync(CHAIN, LAMP)
    monitor = Monitor(synthesize(large, CHAIN))
    monitor.observe(["next", "on"])
    assert "those within" in svg_of(monitor)


def test_results_have_tables() -> None:
    model = from_outcomes(
        [Outcome(0, "go", 0, 0.5, ("go",), -1.0), Outcome(0, "go", 1, 0.5, ("go",))],
        alphabet=Alphabet(("go",)),
        terminal=[1],
    )
    plan, learned = (
        sp.value_iteration(model, gamma=0.9),
        sp.q_learning(model, settings=sp.Settings(episodes=20), seed=1),
    )
    exact = sp.evaluate(model, plan.policy, gamma=0.9, horizon=9)
    assert "<td>20</td>" in learned._repr_html_()
    for value in (model, plan, exact, synthesize(OVEN, COOL)):
        assert value._repr_html_().count("<") > 4


def test_what_has_no_picture_says_so() -> None:
    with pytest.raises(TypeError, match="no picture of a int"):
        svg_of(1)
    assert html_of("<x>") == "<pre>&#39;&lt;x&gt;&#39;</pre>"


def test_a_machine_knows_its_state() -> None:
    assert "current" in css_of(machine_scene(COFFEE, current="v"))
    assert "current" in css_of(supervisor_scene(synthesize(OVEN, COOL), OVEN, current=0))

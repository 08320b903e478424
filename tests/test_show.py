"""Pictures and curves: well formed, complete, and the same twice."""

import re
import sys
import xml.etree.ElementTree as ET
from importlib import import_module

import numpy as np
import pytest

from supremal import (
    Alphabet,
    Automaton,
    MissingDependencyError,
    ModelError,
    complete_safe,
    complete_unsafe,
    from_text,
    from_transitions,
    reward_machine,
    universal,
)
from supremal.automata.build import empty
from supremal.show._circle import place, route
from supremal.show._curves import Link, crossings
from supremal.show._labels import covered, settle, touching
from supremal.show._scale import limits, number, ticks
from supremal.show._text import event_label, guard_label, plain, symbol
from supremal.show.diagram import MAX_STATES, automaton_svg, reward_machine_svg
from supremal.show.figures import Series, curves_svg, save_curves

SVG = "{http://www.w3.org/2000/svg}"

# the three figures of the paper, section IV
H = complete_unsafe(
    from_text("""
        name H
        initial 0
        marked s_a
        0 -r-> 1
        0 -l-> 2
        1 -r-> s_a
        1 -l-> 2
        2 -l-> s_a
        2 -r-> 1
        s_a -l, r, f, b-> s_a
    """)
)
G_S = complete_safe(
    from_text("""
        name G_s
        initial w_0
        uncontrollable d_u
        w_0 -d_u-> w_1
        w_1 -d_2-> w_2
        w_2 -d_3-> w_3
        w_3 -p_1-> w_4
        w_4 -p_2-> w_5
        w_5 -p_3-> w_0
    """)
)
MACHINE = reward_machine(
    ["i1", "i2", "i3", "S"],
    [
        ("u_0", "!i1 & !i2 & !i3", "u_0", -10),
        ("u_0", "(!i1 & i2 & !i3) | (!i1 & !i2 & i3)", "u_1", -20),
        ("u_0", "i1 & !i2 & !i3", "u_2", -8),
        ("u_1", "true", "u_1", -20),
        ("u_2", "i1 & !i2 & !i3", "u_2", -8),
        ("u_2", "i1 & !i2 & i3", "u_1", -20),
        ("u_2", "i1 & i2 & !i3", "u_3", -6),
        ("u_3", "i1 & i2 & !i3", "u_3", -6),
        ("u_3", "i1 & i2 & i3", "u_4", -1),
        ("u_4", "i1 & i2 & i3 & !S", "u_4", -1),
        ("u_4", "i1 & i2 & i3 & S", "u_5", 0),
        ("u_5", "true", "u_5", 0),
    ],
    name="R",
)
PICTURES = [(automaton_svg, H), (automaton_svg, G_S), (reward_machine_svg, MACHINE)]


def parsed(svg):
    root = ET.fromstring(svg)  # noqa: S314 - our own text
    assert root.tag == f"{SVG}svg"
    assert root.get("role") == "img"
    assert root.find(f"{SVG}title").text
    return root


def texts(root, css):
    return [
        "".join(node.itertext()) for node in root.iter(f"{SVG}text") if css in node.get("class", "").split()
    ]


def edges(root):
    return [node for node in root.iter(f"{SVG}g") if "edge" in node.get("class", "").split()]


def boxes(root):
    """Return (x, y, w, h) of each label, from its lines."""
    found = []
    for group in root.findall(f"{SVG}g"):
        lines = [t for t in group.findall(f"{SVG}text") if t.get("class") == "label"]
        if lines:
            ys = [float(line.get("y")) for line in lines]
            wide = max(6.2 * len("".join(line.itertext())) for line in lines)
            found.append((float(lines[0].get("x")), (ys[0] + ys[-1]) / 2 - 4, wide, ys[-1] - ys[0] + 12))
    return found


# --- diagrams ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("automaton", [H, G_S], ids=["H", "G_s"])
def test_a_diagram_shows_every_state_and_says_every_transition(automaton):
    root = parsed(automaton_svg(automaton))
    names = [name.replace("_", "") for name in automaton.state_names]  # w_0 becomes w with a subscript 0
    assert texts(root, "name") == names
    told = root.find(f"{SVG}desc").text
    for s, name in enumerate(automaton.state_names):
        for event in automaton.alphabet:
            target = automaton.state_name(automaton.delta[s, automaton.alphabet.index(event)])
            line = next(part for part in told.split("; ") if f"{name} → {target}: " in part)
            assert event in line.split(": ")[1].split(", ")


def test_labels_are_those_of_the_paper():
    assert sorted(texts(parsed(automaton_svg(H)), "label")) == sorted(
        ["r", "l", "r", "l", "l", "r", "f, b", "f, b", "f, b", "r, l, f, b"]
    )
    labels = texts(parsed(automaton_svg(G_S)), "label")
    assert {"du", "d2", "d3", "p1", "p2", "p3", "Σ"} <= set(labels)
    assert {"Σ \\ {d2}", "Σ \\ {d3}", "Σ \\ {p1}", "Σ \\ {p2}", "Σ \\ {p3}"} <= set(labels)


def test_a_reward_machine_shows_guards_and_rewards():
    root = parsed(reward_machine_svg(MACHINE))
    shown = " ".join(texts(root, "label"))
    for edge in MACHINE.edges:
        assert edge.guard in shown
    assert "i1 & i2 & i3, −1" in shown
    assert "(!i1 & !i2 & i3), −20" in shown
    assert "u_4 → u_5: i1 & i2 & i3 & S, reward 0" in root.find(f"{SVG}desc").text


def test_guards_with_different_rewards_share_an_arrow():
    machine = reward_machine(["c", "d"], [("u", "c", "v", 1.0), ("u", "d & !c", "v", 2.0)])
    root = parsed(reward_machine_svg(machine))
    assert texts(root, "label") == ["c, 1", "d & !c, 2"]
    assert "u → v: c, reward 1 or d & !c, reward 2" in root.find(f"{SVG}desc").text


def test_edges_that_nobody_controls_are_dashed():
    svg = automaton_svg(G_S)
    css = [edge.get("class") for edge in edges(parsed(svg))]
    assert css.count("edge free") == 1  # d_u from w_0
    assert css.count("edge mixed stop") == 6  # what is forbidden holds d_u too; and the loop of s_a
    assert css.count("edge stop") == 1
    assert re.search(r"\.edge\.free \.line\{stroke-dasharray", svg)
    assert not any(re.search("free|mixed", edge.get("class")) for edge in edges(parsed(automaton_svg(H))))


def test_initial_marked_and_trap_states_are_told_apart_without_colour():
    root = parsed(automaton_svg(H))
    assert sum("initial" in edge.get("class") for edge in edges(root)) == 1
    (trap,) = [g for g in root.iter(f"{SVG}g") if "trap" in g.get("class", "")]
    assert trap.find(f"{SVG}title").text == "s_a"
    outlines = [path.get("d") for path in trap.findall(f"{SVG}path")]
    assert [outline.count("L") for outline in outlines] == [7, 7]  # an octagon, marked
    assert len(root.findall(f".//{SVG}circle")) == 3


def test_rings_are_left_out_where_every_state_is_marked():
    assert 'class="ring"' not in automaton_svg(universal(Alphabet(("a",))))
    assert 'class="ring"' in automaton_svg(from_text("marked 1 \n 0 -a-> 1"))


def test_a_dead_end_is_a_trap_and_a_goal_is_not():
    svg = automaton_svg(from_text("marked goal \n start -win-> goal \n start -lose-> dead"))
    (trap,) = [g for g in parsed(svg).iter(f"{SVG}g") if "trap" in g.get("class", "")]
    assert trap.find(f"{SVG}title").text == "dead"


def test_a_picture_is_the_same_twice():
    assert [draw(model) for draw, model in PICTURES] == [draw(model) for draw, model in PICTURES]


@pytest.mark.parametrize(("draw", "model"), PICTURES, ids=["H", "G_s", "R"])
def test_labels_cover_neither_nodes_nor_each_other(draw, model):
    root = parsed(draw(model))
    circles = [c for c in root.iter(f"{SVG}circle") if c.get("class") == "node"]
    nodes = [tuple(float(c.get(key)) for key in ("cx", "cy", "r")) for c in circles]
    found = boxes(root)
    assert len(found) == len(edges(root)) - 1  # all but the initial arrow
    for k, (x, y, w, h) in enumerate(found):
        for u, v, r in nodes:
            near = max(abs(x - u) - w / 2, 0), max(abs(y - v) - h / 2, 0)
            assert near[0] ** 2 + near[1] ** 2 > (r - 1) ** 2
        for a, b, c, d in found[:k]:
            assert abs(x - a) >= (w + c) / 2 - 1 or abs(y - b) >= (h + d) / 2 - 1


def test_all_lies_inside_the_frame():
    for draw, model in PICTURES:
        root = parsed(draw(model))
        x, y, w, h = map(float, root.get("viewBox").split())
        for text in root.iter(f"{SVG}text"):
            assert x < float(text.get("x")) < x + w
            assert y < float(text.get("y")) < y + h


def test_a_large_automaton_is_told_in_numbers():
    states = MAX_STATES + 1
    chain = from_transitions(Alphabet(("a",)), [(str(s), "a", str(s + 1)) for s in range(states - 1)])
    root = parsed(automaton_svg(chain))
    assert f"{states} states, {states - 1} transitions: too large to draw" in texts(root, "notice")
    assert not edges(root)
    machine = reward_machine(["p"], [(f"u{k}", "p", f"u{k + 1}", 0.0) for k in range(70)])
    assert "71 states, 70 edges" in texts(parsed(reward_machine_svg(machine)), "notice")[0]


def test_every_size_is_drawn():
    assert "no state" in texts(parsed(automaton_svg(empty(Alphabet(("a",))))), "notice")[0]
    alphabet = Alphabet(("a", "b"))
    for states in (1, 2, 3, 9, 17, MAX_STATES):
        moves = [(str(s), e, str(s * k % states)) for s in range(states) for k, e in ((3, "a"), (5, "b"))]
        root = parsed(automaton_svg(from_transitions(alphabet, moves)))
        assert len(texts(root, "name")) == states


def test_names_are_escaped_and_bad_letters_replaced():
    strange = from_text('a<b -x&y-> "q"')
    root = parsed(automaton_svg(strange, title="<script>"))
    assert root.find(f"{SVG}title").text == "<script>"
    assert texts(root, "name") == ["a<b", '"q"']
    bad = Automaton(Alphabet(("e\x01",)), [[0]], [True], state_names=("s\x0b",))
    assert texts(parsed(automaton_svg(bad)), "name") == ["s�"]


def test_long_names_are_cut_and_told_in_full():
    svg = automaton_svg(from_text("a_very_long_name_indeed -go-> b"))
    assert texts(parsed(svg), "name")[:3] == ["a_very_", "long_", "name_ind…"]
    assert "<title>a_very_long_name_indeed</title>" in svg


def test_symbols_and_labels():
    assert [run.sub for run in symbol("p12")] == [False, True]
    assert len(symbol("start")) == len(symbol("d_very")) == 1
    sigma = [f"e{k}" for k in range(20)]
    assert plain(event_label(sigma, sigma, frozenset())) == "Σ"
    assert plain(event_label(sigma[:9], sigma, frozenset())) == "e0, e1, e2, … (9 in all)"
    assert [plain([line]) for line in guard_label(["a | b"], 0.5)] == ["a | b, 0.5"]
    long = guard_label(["alpha & beta & gamma | delta & epsilon"], -1)
    assert plain(long) == "alpha & beta & gamma | delta & epsilon, −1"
    assert len(long) > 1
    assert plain(guard_label(["a", "b"], 1)) == "a | b, 1"


def test_layout_parts():
    links = [Link(0, 1, 20, 17), Link(1, 0, 20, 17), Link(1, 1, 20, 17)]
    radius = [17.0, 17.0]
    where = place(radius, links)
    curves, entry = route(where, radius, links)
    assert crossings(curves[0].points, curves[1].points[None]) == 0  # there and back keep apart
    centres, clash = settle(where, radius, links, curves, entry)
    assert clash == 0
    assert touching(centres, 20, 17, where, 17.0).max() == 0
    assert covered(centres[:1], 20, 17, np.array([[*centres[1], 20, 17]])).max() == 0


# --- curves -----------------------------------------------------------------------------------------------

SERIES = [
    Series("here", [10, 250, 500], [-950.0, None, -300.0]),
    Series("", [10, 250, 500], [-960.0, -500.0, -310.0]),
    Series("baseline & co", [10, 250, 500], [-900.0, -400.0, -290.0], "second"),
    Series("published", [10, 250, 500], [-979.3, -454.5, -305.0], "reference"),
]
AXES = {"xlabel": "Episodes (×10³)", "ylabel": "Average score", "ylim": (-1000, -200)}


def test_a_chart_has_axes_legend_lines_and_markers():
    root = parsed(curves_svg(SERIES, **AXES))
    assert texts(root, "key") == ["here", "baseline & co", "published"]
    assert texts(root, "end")[:5] == ["−1,000", "−800", "−600", "−400", "−200"]
    assert len(list(root.iter(f"{SVG}polyline"))) == 2  # "here" has a gap: two single points
    assert len(list(root.iter(f"{SVG}g"))) == 3
    told = [title.text for title in root.iter(f"{SVG}title")]
    assert "published, 250: Average score −454.5" in told
    assert "here, 10: Average score −950" in told
    assert texts(root, "value") == ["−979.3", "−454.5", "−305"]
    assert curves_svg(SERIES, **AXES) == curves_svg(SERIES, **AXES)


def test_a_curve_is_cut_off_where_the_axes_end():
    root = parsed(
        curves_svg([Series("wild", [0, 1, 2], [0.0, 9.0, 1.0])], xlabel="x", ylabel="y", ylim=(0, 1))
    )
    frame = root.find(f"{SVG}svg")
    assert frame.find(f"{SVG}polyline") is not None
    assert frame.get("viewBox").split() == [frame.get(key) for key in ("x", "y", "width", "height")]


def test_a_chart_without_data_says_so():
    assert "no data yet" in curves_svg([], xlabel="x", ylabel="y")
    assert "no data yet" in curves_svg([Series("empty", [], [])], xlabel="x", ylabel="y")


def test_a_long_legend_takes_more_rows():
    many = [Series(f"a rather long label {k}", [0, 1], [k, k + 1]) for k in range(5)]
    root = parsed(curves_svg(many, xlabel="x", ylabel="y"))
    top = float(root.get("viewBox").split()[1])
    assert top < 0
    ys = {float(text.get("y")) for text in root.iter(f"{SVG}text") if text.get("class") == "key"}
    assert len(ys) > 1
    assert min(ys) > top


def test_a_series_that_does_not_fit_is_refused():
    with pytest.raises(ModelError, match="2 x and 1 y"):
        Series("s", [1, 2], [1.0])
    with pytest.raises(ModelError, match="main, second or reference"):
        Series("s", [1], [1.0], "loud")


def test_round_numbers():
    assert limits([]) == (0.0, 1.0)
    assert limits([3.0, 3.0]) == (2.5, 3.5)
    assert limits([0.0], (-1, 1)) == (-1.0, 1.0)
    assert ticks(0, 100) == [0.0, 25.0, 50.0, 75.0, 100.0]
    told = ["−1,000", "0.25", "1,234.5", "27,612,345", "0"]
    assert [number(value) for value in (-1000, 0.25, 1234.5, 27_612_345, 0)] == told


def test_figures_are_written_as_png_and_svg_the_same_twice(tmp_path):
    one = save_curves(tmp_path / "new" / "score", SERIES, **AXES)
    two = save_curves(tmp_path / "other.v2", SERIES, **AXES)
    assert [path.name for path in one + two] == ["score.png", "score.svg", "other.v2.png", "other.v2.svg"]
    assert one[0].read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in one[1].read_bytes()
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]
    save_curves(
        tmp_path / "empty", [Series("no $ yet", [1], [None])], xlabel="x", ylabel="$", title="Nothing"
    )


def test_without_matplotlib_figures_say_what_to_install(monkeypatch, tmp_path):
    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "supremal.show._matplotlib", raising=False)
    monkeypatch.delattr(import_module("supremal.show"), "_matplotlib", raising=False)
    said = r"drawing figures needs matplotlib: pip install 'supremal\[plot\]'"
    with pytest.raises(MissingDependencyError, match=said):
        save_curves(tmp_path / "score", SERIES, **AXES)
    assert "<svg" in curves_svg(SERIES, **AXES)  # the report does not need it

"""Model files: what is written is read back the same, by us and by libFAUDES, and nothing else gets in."""

from __future__ import annotations

import random
import tomllib
from collections.abc import Iterator
from pathlib import Path

import faudes
import numpy as np
import pytest
from click.testing import CliRunner, Result
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from strategies import automata
from supremal import Alphabet, AlphabetError, Automaton, FormatError, SupremalError, from_text, universal
from supremal import errors as errors_module
from supremal.automata.build import empty
from supremal.cli import main
from supremal.cli.convert import convert
from supremal.formats import FORMATS, Model, model, read_model, write_model
from supremal.formats.files import find_losses

CASES = Path(__file__).parent / "cases"
MODELS = sorted((CASES / "models").glob("*.json"))
BAD = tomllib.loads((CASES / "bad_models.toml").read_text(encoding="utf-8"))["case"]
READABLE = [ending for ending, form in FORMATS.items() if form.read]
NAMED = [ending for ending in READABLE if ending != ".fsm"]  # its files say no name


def table(automaton: Automaton) -> tuple[object, ...]:
    """All of an automaton but its name, and the order of events and states."""
    sigma, names = automaton.alphabet, [automaton.state_name(s) for s in range(automaton.n_states)]
    arrows = {
        (names[s], sigma.names[e], names[automaton.delta[s, e]])
        for s, e in np.argwhere(automaton.delta >= 0).tolist()
    }
    marked = {names[s] for s in np.flatnonzero(automaton.marked)}
    return (set(sigma), sigma.uncontrollable, sigma.unobservable, names[:1], set(names), marked, arrows)


def tables(read: Model) -> tuple[dict[str, tuple[object, ...]], ...]:
    """The tables of a model's automata, by their names."""
    groups = tuple({part.name: table(part) for part in parts} for parts in read)
    assert [len(group) for group in groups] == [len(parts) for parts in read]
    return groups


def one(automaton: Automaton) -> Model:
    return Model((automaton,), ())


def text_of(ending: str, written: Model) -> str:
    """The text of a model of one automaton."""
    text = FORMATS[ending].write(written)
    return text if isinstance(text, str) else text[0]


@pytest.fixture
def read(tmp_path):
    """Read a text, as a file with some ending."""

    def from_file(ending: str, text: str | bytes) -> Model:
        path = tmp_path / f"model{ending}"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_model(path)

    return from_file


# --- there and back ---------------------------------------------------------------------------------------


def test_models_are_there() -> None:
    assert len(MODELS) >= 16


@pytest.mark.parametrize("ending", READABLE)
@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_models_come_back(path: Path, ending: str, tmp_path: Path) -> None:
    original = read_model(path)
    write_model(tmp_path / f"there{ending}", original)
    there = read_model(tmp_path / f"there{ending}")
    assert tables(there) == tables(original)
    write_model(tmp_path / "back.json", there)
    back = read_model(tmp_path / "back.json")
    assert tables(back) == tables(original)
    write_model(tmp_path / f"again{ending}", back)
    assert tables(read_model(tmp_path / f"again{ending}")) == tables(original)


@pytest.mark.parametrize("ending", sorted(set(READABLE) - {".ads", ".fsm"}))
def test_order_of_automata_is_kept(ending: str, tmp_path: Path) -> None:
    parts = [from_text(f"name {name}\n0 -{name}-> 0") for name in ("c", "a", "b")]
    write_model(tmp_path / f"m{ending}", Model((parts[0], parts[1]), (parts[2],)))
    plants, specs = read_model(tmp_path / f"m{ending}")
    assert [part.name for part in plants + specs] == ["c", "a", "b"]


CHARACTERS = st.characters(exclude_categories=["Cs"])
EVENTS = st.text(CHARACTERS, min_size=1, max_size=6).filter(lambda name: not any(map(str.isspace, name)))
ODD = st.sampled_from(
    [
        "",
        " ",
        '"',
        "#",
        "%",
        "<&>",
        "'",
        "\\u{41}",
        "\\",
        "\n\t",
        "a b",
        "é→Σ",
        "\x00",
        "EVENTS",
        "*",
        "0x3",
        "+C+",
        "true",
    ]
)


@st.composite
def named_automata(draw: st.DrawFn) -> Automaton:
    """Any automaton, with any names and properties."""
    drawn = draw(automata(max_states=5))
    count, states = len(drawn.alphabet), drawn.n_states
    events = draw(st.lists(EVENTS, min_size=count, max_size=count, unique=True))
    hidden = draw(st.lists(st.sampled_from(events), unique=True)) if events else []
    forced = draw(st.lists(st.sampled_from(events), unique=True)) if events else []
    names = st.one_of(ODD, st.text(CHARACTERS, max_size=6))
    return Automaton(
        Alphabet(tuple(events), frozenset(forced), frozenset(hidden)),
        drawn.delta,
        drawn.marked,
        state_names=tuple(draw(st.lists(names, min_size=states, max_size=states, unique=True))),
        name=draw(st.one_of(ODD, st.text(CHARACTERS, max_size=6))),
    )


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@pytest.mark.parametrize("ending", READABLE)
@given(automaton=named_automata())
def test_any_automaton_comes_back(ending: str, automaton: Automaton, tmp_path: Path) -> None:
    path = tmp_path / f"plant1{ending}"
    write_model(path, one(automaton))
    (back,), specs = read_model(path)
    assert specs == ()
    assert table(back) == table(automaton)
    name = automaton.name or ("plant1" if ending in {".wmod", ".xml"} else "")
    assert back.name == (path.stem if ending == ".fsm" else name)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
@pytest.mark.parametrize("ending", READABLE)
@given(first=named_automata(), second=named_automata())
def test_any_two_automata_come_back(ending: str, first: Automaton, second: Automaton, tmp_path: Path) -> None:
    try:
        write_model(tmp_path / f"m{ending}", Model((first,), (second,)))
    except AlphabetError:
        assert ending not in {".xml", ".gen", ".fsm", ".hoa"}  # these have properties for each automaton
        return
    plants, specs = read_model(tmp_path / f"m{ending}")
    assert [list(map(table, parts)) for parts in (plants, specs)] == [[table(first)], [table(second)]]


@pytest.mark.parametrize("ending", READABLE)
def test_states_of_one_name_are_told_apart(ending: str, tmp_path: Path) -> None:
    same = Automaton(Alphabet(("a",)), [[1], [0]], [True, False], state_names=("s", "s"), name="m")
    write_model(tmp_path / f"m{ending}", one(same))
    (back,), _ = read_model(tmp_path / f"m{ending}")
    assert back.delta.tolist() == [[1], [0]]
    assert back.state_names == ("s", "s_2")


@pytest.mark.parametrize("ending", sorted(set(READABLE) - {".ads", ".hoa"}))
def test_states_without_names_are_called_by_their_numbers(ending: str, tmp_path: Path) -> None:
    write_model(tmp_path / f"m{ending}", one(universal(Alphabet(("a",)))))
    assert read_model(tmp_path / f"m{ending}").plants[0].state_names == ("0",)


@pytest.mark.parametrize("ending", READABLE)
def test_empty_automaton(ending: str, tmp_path: Path) -> None:
    sigma = Alphabet(("a", "b"), frozenset({"b"}))
    write_model(tmp_path / f"m{ending}", one(empty(sigma, name="m")))
    (back,), _ = read_model(tmp_path / f"m{ending}")
    assert (back.n_states, set(back.alphabet), back.alphabet.uncontrollable) == (0, {"a", "b"}, {"b"})


@pytest.mark.parametrize("ending", sorted(set(READABLE) - {".ads", ".fsm"}))
def test_model_without_automata(ending: str, tmp_path: Path) -> None:
    write_model(tmp_path / f"m{ending}", Model((), ()))
    if ending == ".hoa":
        with pytest.raises(FormatError, match="the file ends where 'HOA:'"):
            read_model(tmp_path / f"m{ending}")
    else:
        assert read_model(tmp_path / f"m{ending}") == Model((), ())


# --- one text, as others write it -------------------------------------------------------------------------


def test_document_is_written_a_transition_a_line() -> None:
    light = from_text("name light\ndark -on-> lit\nlit -off-> dark\nmarked dark\nuncontrollable off")
    assert FORMATS[".json"].write(one(light)) == (
        '{\n  "events": {\n    "on": {"controllable": true},\n    "off": {"controllable": false}\n  },\n'
        '  "plants": [\n    {\n      "name": "light",\n      "events": ["on", "off"],\n'
        '      "states": ["dark", "lit"],\n      "initial": "dark",\n      "marked": ["dark"],\n'
        '      "transitions": [\n        ["dark", "on", "lit"],\n        ["lit", "off", "dark"]\n      ]\n'
        '    }\n  ],\n  "specs": []\n}\n'
    )


def test_document_of_one_automaton_is_a_model_of_one_plant(read) -> None:
    text = (
        '{"name": "m", "events": {"a": {"controllable": true}}, "states": ["0"], "initial": "0", '
        '"marked": [], "transitions": [["0", "a", "0"]]}'
    )
    plants, specs = read(".json", text)
    assert (len(plants), specs, plants[0].name) == (1, (), "m")


MODULE = """<?xml version="1.0" encoding="windows-1252"?>
<Module xmlns="http://waters.sourceforge.net/xsd/module" Name="m"
 xmlns:B="http://waters.sourceforge.net/xsd/base">
<B:Comment>Zwei Maschinen</B:Comment>
<ConstantAliasList><ConstantAlias Name="N"/></ConstantAliasList>
<EventDeclList>
<EventDecl Kind="PROPOSITION" Name=":accepting"/><EventDecl Kind="PROPOSITION" Name=":forbidden"/>
<EventDecl Kind="CONTROLLABLE" Name="start"><AttributeMap/></EventDecl>
<EventDecl Kind="UNCONTROLLABLE" Name="end" Observable="false"/>
<EventDecl Kind="UNCONTROLLABLE" Name="never"/>
</EventDeclList>
<EventAliasList/>
<ComponentList>
<SimpleComponent Kind="{kind}" Name="P"><Graph>
{block}
<NodeList>
<SimpleNode Name="W">{marking}<PointGeometry><Point X="1" Y="2"/></PointGeometry></SimpleNode>
<SimpleNode Initial="true" Name="I"/>
</NodeList>
<EdgeList>
<Edge Source="I" Target="W"><LabelBlock><SimpleIdentifier Name="start"/><SimpleIdentifier Name="end"/>
<LabelGeometry Anchor="NW"/></LabelBlock><SplineGeometry/>
<GuardActionBlock><LabelGeometry/></GuardActionBlock></Edge>
<Edge Source="W" Target="I"><LabelBlock><SimpleIdentifier Name="end"/></LabelBlock></Edge>
</EdgeList>
</Graph></SimpleComponent>
</ComponentList>
</Module>
"""
ACCEPTING = '<EventList><SimpleIdentifier Name=":accepting"/></EventList>'


def test_module_as_supremica_writes_it(read) -> None:
    plants, specs = read(".wmod", MODULE.format(kind="PLANT", block="", marking=ACCEPTING))
    assert specs == ()
    assert table(plants[0]) == (
        {"start", "end"},
        {"end"},
        {"end"},
        ["I"],
        {"I", "W"},
        {"W"},
        {("I", "start", "W"), ("I", "end", "W"), ("W", "end", "I")},
    )


@pytest.mark.parametrize(("kind", "group"), [("PLANT", 0), ("SPEC", 1), ("SUPERVISOR", 1), ("PROPERTY", 1)])
def test_kinds_of_components(read, kind: str, group: int) -> None:
    assert len(read(".wmod", MODULE.format(kind=kind, block="", marking=""))[group]) == 1


@pytest.mark.parametrize(
    ("block", "marked", "events"),
    [
        ("", {"I", "W"}, {"start", "end"}),
        ('<LabelBlock><SimpleIdentifier Name="never"/></LabelBlock>', {"I", "W"}, {"start", "end", "never"}),
        ('<LabelBlock><SimpleIdentifier Name=":accepting"/></LabelBlock>', set(), {"start", "end"}),
    ],
)
def test_component_that_says_nothing_of_marking_is_marked_throughout(read, block, marked, events) -> None:
    (part,), _ = read(".wmod", MODULE.format(kind="PLANT", block=block, marking=""))
    assert table(part)[5] == marked
    assert set(part.alphabet) == events


def test_project_as_others_write_it(read) -> None:
    text = """<?xml version="1.0" encoding="ISO-8859-1"?>
    <SupremicaProject name="p" major="0" minor="11"><Automaton name="A" type="Supervisor">
    <Events><Event id="e0" label="a" prioritized="true"/><Event id="b" controllable="false"/></Events>
    <States><State id="7" name="seven" cost="2"/><State id="x" initial="true" accepting="true"/></States>
    <Transitions><Transition source="x" dest="7" event="e0"/></Transitions><Layout/></Automaton>
    <Automaton name="B"><Events/><States/></Automaton><Animation/></SupremicaProject>"""
    plants, specs = read(".xml", text)
    assert [part.name for part in plants + specs] == ["B", "A"]
    assert table(specs[0]) == ({"a", "b"}, {"b"}, set(), ["x"], {"x", "seven"}, {"x"}, {("x", "a", "seven")})


def test_generator_by_hand(read) -> None:
    text = """% a comment <!-- -->
    <Generator>
    "My machine"
    <A> start +C+ 'end' "fail" +o+ both 0x1 none 0x0 </A>
    <S> idle#5 busy#6 7 <Consecutive> 8 9 </Consecutive> </S>
    <T> idle start busy +F+ 6 end 7  7 "fail" 9 </T>
    <I> 5 </I>
    <M> <Consecutive> 7 9 </Consecutive> idle </M>
    </Generator>"""
    (part,), _ = read(".gen", text)
    assert part.name == "My machine"
    assert table(part) == (
        {"start", "end", "fail", "both", "none"},
        {"end", "fail", "none"},
        {"fail", "both", "none"},
        ["idle"],
        {"idle", "busy", "7", "8", "9"},
        {"idle", "7", "8", "9"},
        {("idle", "start", "busy"), ("busy", "end", "7"), ("7", "fail", "9")},
    )


def test_generator_of_transitions_alone(read) -> None:
    (part,), _ = read(".gen", "<Generator><T>1 a 2  2 b 1</T><I>2</I></Generator>")
    assert (part.state_names, part.alphabet.names, part.delta.tolist()) == (
        ("2", "1"),
        ("a", "b"),
        [[-1, 1], [0, -1]],
    )


def test_generator_without_initial_state_is_empty(read) -> None:
    (part,), _ = read(".gen", "<Generator><States> 1 2 </States><TransRel/></Generator>")
    assert part.n_states == 0


def test_vectors_of_generators(read) -> None:
    part = "<Generator name='{}'><T>1 a 1</T></Generator>"
    first = f"<GeneratorVector>{part.format('p')}</GeneratorVector>"
    second = f"<SystemVector name='specs'>{part.format('s')}</SystemVector>"
    plants, specs = read(".gen", first + second + part.format("q"))
    assert ([p.name for p in plants], [p.name for p in specs]) == (["p", "q"], ["s"])


def test_tct_file_as_tct_writes_it(read) -> None:
    text = """# CTCT ADS auto-generated

    MACH1

    State size (State set will be (0,1....,size-1)):
    # <-- Enter state size, in range 0 to 2000000, on line below.
    3

    Marker states:
    # To mark all states, enter *.
    *

    Vocal states:
    # Example: 0 10

    Transitions:
    # Format: Exit_(Source)_State  Transition_Label  Entrance_(Target)_State.
    0     11  1
    1     10  0
    """
    (part,), specs = read(".ads", text.replace("\n", "\r\n"))
    assert specs == ()
    assert (part.name, part.state_names, part.alphabet.names) == ("MACH1", (), ("11", "10"))
    assert part.alphabet.uncontrollable == {"10"}
    assert part.delta.tolist() == [[1, -1], [-1, 0], [-1, -1]]
    assert part.marked.all()


def test_numbers_of_tct_are_one_for_a_whole_model() -> None:
    plant = from_text("name p\n0 -a, u-> 0\nuncontrollable u")
    spec = from_text("name s\n0 -b, a-> 0")
    texts = FORMATS[".ads"].write(Model((plant,), (spec,)))
    assert [text.splitlines()[-2:] for text in texts] == [["0 1 0", "0 2 0"], ["0 3 0", "0 1 0"]]


def test_numbers_that_tct_takes_stay_as_they_are() -> None:
    part = from_text("name p\n0 -11, 10, 0-> 0\nuncontrollable 10, 0")
    text = FORMATS[".ads"].write(one(part))[0]
    assert text.splitlines()[-3:] == ["0 11 0", "0 10 0", "0 0 0"]
    assert "event" not in text
    wrong = from_text("name p\n0 -10-> 0")  # even, and yet controllable
    assert '# supremal: event 1 "10"' in FORMATS[".ads"].write(one(wrong))[0]


def test_tct_has_not_enough_numbers(tmp_path: Path) -> None:
    many = universal(Alphabet(tuple(f"e{k}" for k in range(5001))))
    with pytest.raises(FormatError, match=r"m\.ads: TCT has numbers for events up to 9999"):
        write_model(tmp_path / "m.ads", one(many))


def test_automaton_as_desuma_writes_it(read) -> None:
    states = "3\n\nidle\t1\t1\nstart\tbusy\n\nbusy\t0\t1\nend\tidle\tuo uc\n\nlost 0 0\n"
    text = f"{states}\nEVENTS\nfail uc uo\nrepair\n"
    (part,), _ = read(".fsm", text)
    assert part.name == "model"
    assert table(part) == (
        {"start", "end", "fail", "repair"},
        {"end", "fail"},
        {"end", "fail"},
        ["idle"],
        {"idle", "busy", "lost"},
        {"idle"},
        {("idle", "start", "busy"), ("busy", "end", "idle")},
    )


def test_monitor_as_other_programs_write_it(read) -> None:
    text = """HOA: v1
    name: "never \\"b\\" after c" /* /* nested */ comment */
    States: 2 Start: 1 AP: 3 "a" "b" "c"
    acc-name: all Acceptance: 0 t
    properties: trans-labels explicit-labels state-acc deterministic
    tool: "spot" "2.11"
    Alias: @x 2
    --BODY--
    State: 1 [!@x] 1 [@x & (t | f)] 0
    State: 0 "after"
    [!1 & (0 | 2) & !f] 0
    --END--"""
    (part,), specs = read(".hoa", text)
    assert specs == ()
    assert (part.name, part.state_names) == ('never "b" after c', ("1", "after"))
    assert part.alphabet == Alphabet(("a", "b", "c"))
    assert part.delta.tolist() == [[0, 0, 1], [1, -1, 1]]
    assert part.marked.all()


def test_omega_automaton_is_of_one_hot_letters() -> None:
    light = from_text("name light\ndark -on-> lit\nlit -off-> dark\nmarked dark\nuncontrollable off")
    lines = FORMATS[".hoa"].write(one(light)).splitlines()
    assert 'AP: 2 "on" "off"' in lines
    assert "controllable-AP: 0" in lines
    assert "Alias: @off 1&!0" in lines
    assert "Acceptance: 1 Inf(0)" in lines
    assert lines[-5:] == ['State: 0 "dark" {0}', "[@on] 1", 'State: 1 "lit"', "[@off] 0", "--END--"]


def test_omega_automaton_of_too_many_events(tmp_path: Path) -> None:
    many = universal(Alphabet(tuple(f"e{k}" for k in range(3001))))
    with pytest.raises(FormatError, match="has 3001 events; a file has up to 3000"):
        write_model(tmp_path / "m.hoa", one(many))


def test_picture_of_a_model() -> None:
    parts = (from_text('name "a"\n0 -x-> 1\n0 -y-> 1'), from_text("name b\n0 -u-> 0\nuncontrollable u"))
    text = FORMATS[".dot"].write(Model(parts[:1], parts[1:]))
    assert '    label="\\"a\\"";' in text
    assert '"0.0" -> "0.1" [label="x, y"];' in text
    assert '"1.0" -> "1.0" [label="u", style=dashed];' in text
    assert text.count("subgraph") == 2


# --- libFAUDES --------------------------------------------------------------------------------------------


def of_faudes(system: faudes.System) -> tuple[object, ...]:
    """The table of a system, as `table` has it."""
    states, events, arrows, initial, marked = faudes.Generator.ToLists(system)
    return (
        set(events),
        {event for event in events if not system.Controllable(event)},
        {event for event in events if not system.Observable(event)},
        list(initial),
        set(states),
        set(marked),
        set(arrows),
    )


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_libfaudes_reads_what_we_write(path: Path, tmp_path: Path) -> None:
    original = read_model(path)
    file = tmp_path / "m.gen"
    for part in (*original.plants, *original.specs):
        write_model(file, one(part))
        system = faudes.System(str(file))
        assert of_faudes(system) == table(part)
        assert system.Name() == part.name
    write_model(file, original)
    whole = file.read_text(encoding="utf-8")
    for text, parts in zip(whole.split('<SystemVector name="specs">'), original, strict=True):
        vector = faudes.SystemVector()
        vector.FromString(text if "<SystemVector" in text else f"<SystemVector>{text}")
        systems = [vector.At(k) for k in range(vector.Size())]
        assert [(system.Name(), of_faudes(system)) for system in systems] == [
            (part.name, table(part)) for part in parts
        ]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(automaton=named_automata())
def test_libfaudes_takes_any_names_of_ours(automaton: Automaton, tmp_path: Path) -> None:
    write_model(tmp_path / "m.gen", one(automaton))
    system = faudes.System(str(tmp_path / "m.gen"))
    assert system.Size() == automaton.n_states
    assert system.AlphabetSize() == len(automaton.alphabet)
    assert system.TransRelSize() == automaton.n_transitions


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_we_read_what_libfaudes_writes(path: Path, tmp_path: Path) -> None:
    original = read_model(path)
    for part in (*original.plants, *original.specs):
        *_, names, marked, arrows = table(part)
        events = list(part.alphabet)
        free = [event for event in events if event not in part.alphabet.uncontrollable]
        system = faudes.System.FromLists(
            list(names), events, free, list(arrows), [part.state_name(0)], list(marked)
        )
        system.Name(part.name)
        system.Write(str(tmp_path / "m.gen"))
        (back,), _ = read_model(tmp_path / "m.gen")
        assert (back.name, table(back)) == (part.name, table(part))


def test_we_read_states_without_names_of_libfaudes(tmp_path: Path) -> None:
    generator = faudes.System()
    generator.InsEvent("a")
    for _ in range(12):
        generator.InsState()
    for state in range(1, 12):
        generator.SetTransition(state, generator.EventIndex("a"), state + 1)
    generator.SetInitState(1)
    for state in range(3, 13):
        generator.SetMarkedState(state)
    generator.Write(str(tmp_path / "m.gen"))
    assert "<Consecutive>" in (tmp_path / "m.gen").read_text()
    (back,), _ = read_model(tmp_path / "m.gen")
    assert back.state_names == tuple(map(str, range(1, 13)))
    assert back.delta.ravel().tolist() == [*range(1, 12), -1]
    assert back.marked.tolist() == [False] * 2 + [True] * 10


# --- what does not get in ---------------------------------------------------------------------------------


@pytest.mark.parametrize("case", BAD, ids=lambda case: f"{case['ending']}: {case['name']}")
def test_bad_file(case: dict[str, object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path(f"model{case['ending']}")
    path.write_text(str(case["text"]), encoding="utf-8")
    kind = getattr(errors_module, str(case.get("error", "FormatError")))
    with pytest.raises(SupremalError) as error:
        read_model(path)
    assert type(error.value) is kind
    assert str(case["says"]) in str(error.value)
    assert str(error.value).startswith(f"{path}:")
    if kind is FormatError:
        assert (error.value.line, error.value.column) == (case.get("line", 0), case.get("column", 0))


@pytest.mark.parametrize("ending", READABLE)
def test_file_that_is_no_text(read, ending: str) -> None:
    with pytest.raises(FormatError):
        read(ending, b"\xff\xfe\x00\xd8")


@pytest.mark.parametrize("ending", [ending for ending in READABLE if ending != ".json"])
def test_large_file(read, ending: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model, "MAX_BYTES", 1 << 20)
    with pytest.raises(FormatError, match="the file is larger than 1 MiB"):
        read(ending, b" " * ((1 << 20) + 1))


def test_elements_have_bounds(read) -> None:
    with pytest.raises(FormatError, match="elements are nested more than 100 deep"):
        read(".wmod", "<a>" * 200)


@pytest.mark.parametrize(
    "text",
    [
        '<!DOCTYPE a [<!ENTITY b "bb"><!ENTITY c "&b;&b;">]><a>&c;</a>',
        '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>',
        '<!DOCTYPE a [<!ENTITY % b SYSTEM "http://127.0.0.1/b">%b;]><a/>',
    ],
)
@pytest.mark.parametrize("ending", [".wmod", ".xml"])
def test_entities_are_refused(read, ending: str, text: str) -> None:
    with pytest.raises(FormatError, match="declares an entity or refers to another file"):
        read(ending, text)


@pytest.mark.parametrize(
    ("ending", "text"),
    [
        (".gen", "<" + "a" * 300_000),
        (".gen", "<a " + "b" * 300_000 + ">"),
        (".ads", "state size" + " " * 300_000),
        (".ads", '# supremal: event 1 "a"' + " " * 300_000 + "x"),
        (".hoa", "HOA: v1 Alias: @a " + "!" * 300_000),
        (".hoa", "/*" * 150_000),
        (".hoa", 'HOA: v1 name: "' + "\\" * 300_000),
    ],
)
def test_hostile_text_takes_no_longer_than_it_has_to(read, ending: str, text: str) -> None:
    with pytest.raises(FormatError):  # quadratic time would be minutes
        read(ending, text)


def mutations(raw: bytes, seed: int, count: int) -> Iterator[bytes]:
    """Cut, repeat, change and insert at places that the seed draws."""
    rng = random.Random(seed)  # noqa: S311 - drawn to be repeated
    for _ in range(count):
        text = bytearray(raw)
        for _ in range(rng.randint(1, 4)):
            place, other = rng.randrange(len(text) + 1), rng.randrange(len(text) + 1)
            change = rng.randrange(5)
            if change == 0:
                del text[place:]
            elif change == 1:
                del text[place : place + rng.randrange(1, 9)]
            elif change == 2:
                text[place:place] = text[other : other + rng.randrange(1, 30)]
            elif change == 3:
                text[place:place] = rng.randbytes(rng.randrange(1, 3))
            else:
                text[place:place] = rng.choice(
                    [b"<", b">", b'"', b"\n", b"&", b"0", b"-", b"{", b"]", b"%", b"+"]
                )
        yield bytes(text)


@pytest.mark.parametrize("ending", READABLE)
def test_broken_files_are_models_or_errors_of_ours(ending: str, tmp_path: Path) -> None:
    part = from_text(
        "name m\nidle -start-> busy\nbusy -end, fail-> idle\nuncontrollable end, fail\nmarked idle"
    )
    hidden = Automaton(
        Alphabet(part.alphabet.names, part.alphabet.uncontrollable, frozenset({"fail"})),
        part.delta,
        part.marked,
        state_names=("à la", "busy"),
        name="m",
    )
    raw = text_of(ending, one(hidden)).encode()
    path = tmp_path / f"m{ending}"
    cuts = [raw[:k] for k in range(0, len(raw), 7)]
    refusals = []
    for text in (*cuts, *mutations(raw, seed=7, count=300)):
        path.write_bytes(text)
        try:
            found = read_model(path)
        except SupremalError as error:
            refusals.append(str(error))
        else:
            assert isinstance(found, Model)
    assert all(said.startswith(f"{path}:") for said in refusals)
    assert len(refusals) > 100


# --- files and folders ------------------------------------------------------------------------------------


@pytest.mark.parametrize("call", [read_model, lambda path: write_model(path, Model((), ()))])
@pytest.mark.parametrize(
    ("name", "says"), [("m.foo", "'.foo' is no ending of a model file"), ("m", "the file has no ending")]
)
def test_unknown_ending(call, name: str, says: str) -> None:
    with pytest.raises(FormatError) as error:
        call(name)
    assert str(error.value) == f"{name}: {says}; known: .json, .wmod, .xml, .gen, .ads, .fsm, .hoa, .dot"


def test_every_format_says_what_it_is() -> None:
    assert all(form.about and "\n" not in form.about for form in FORMATS.values())


def test_format_may_be_named(tmp_path: Path) -> None:
    part = from_text("name m\n0 -a-> 0")
    write_model(tmp_path / "m.txt", one(part), form="gen")
    assert read_model(tmp_path / "m.txt", form=".GEN").plants[0].name == "m"


def test_missing_file_is_an_os_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_model(tmp_path / "nowhere.wmod")


def small_factory() -> Model:
    return read_model(CASES / "models" / "small_factory.json")


@pytest.mark.parametrize("ending", [".ads", ".fsm"])
def test_model_of_several_automata_is_a_folder(ending: str, tmp_path: Path) -> None:
    folder = tmp_path / f"factory{ending}"
    write_model(folder, small_factory())
    write_model(folder, small_factory())  # a folder of such files is replaced
    assert sorted(str(file.relative_to(folder)) for file in folder.rglob("*.*")) == [
        f"plants/MACH1{ending}",
        f"plants/MACH2{ending}",
        f"specs/BR{ending}",
        f"specs/BUF{ending}",
    ]
    assert list(tmp_path.iterdir()) == [folder]
    (folder / "plants" / f"MACH1{ending}").rename(folder / f"MACH1{ending}")
    assert [part.name for part in read_model(folder).plants] == ["MACH1", "MACH2"]


def test_files_of_a_folder_come_as_people_count(tmp_path: Path) -> None:
    parts = tuple(from_text(f"name M{k}\n0 -a-> 0") for k in (10, 2, 1))
    write_model(tmp_path / "m.fsm", Model(parts, ()))
    assert [part.name for part in read_model(tmp_path / "m.fsm").plants] == ["M1", "M2", "M10"]


def test_names_of_files_are_safe(tmp_path: Path) -> None:
    names = ["../../m", "a b", "a_b", "A_B", "..", ""]
    parts = tuple(from_text(f"0 -e{k}-> 0") for k in range(len(names)))
    named = tuple(
        Automaton(part.alphabet, part.delta, part.marked, name=name)
        for part, name in zip(parts, names, strict=True)
    )
    write_model(tmp_path / "m.ads", Model(named, ()))
    files = sorted(file.name for file in (tmp_path / "m.ads" / "plants").iterdir())
    assert files == ["A_B_3.ads", "_.ads", "__.._m.ads", "a_b.ads", "a_b_2.ads", "plant6.ads"]
    assert {part.name for part in read_model(tmp_path / "m.ads").plants} == set(names)


def test_folder_with_other_things_is_left_alone(tmp_path: Path) -> None:
    folder = tmp_path / "m.ads"
    write_model(folder, small_factory())
    (folder / "diary.txt").write_text("mine")
    with pytest.raises(FormatError, match=r"the folder holds 'diary\.txt', which is no \.ads file"):
        write_model(folder, small_factory())
    with pytest.raises(FormatError, match="this is a folder, and one file is to be written"):
        write_model(folder, one(from_text("0 -a-> 0")))
    assert (folder / "diary.txt").read_text() == "mine"


def test_folder_without_models(tmp_path: Path) -> None:
    (tmp_path / "m.ads").mkdir()
    with pytest.raises(FormatError, match=r"the folder has no \.ads files"):
        read_model(tmp_path / "m.ads")
    (tmp_path / "m.json").mkdir()
    with pytest.raises(FormatError, match="this is a folder"):
        read_model(tmp_path / "m.json")


def test_what_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    half = Automaton(Alphabet(("\ud800",)), [[0]], [True])
    for ending in (".json", ".hoa", ".dot"):
        with pytest.raises(FormatError, match="half a character"):
            write_model(tmp_path / f"m{ending}", one(half))
    marking = universal(Alphabet((":accepting",)))
    with pytest.raises(FormatError, match=r"m\.wmod: an event is called ':accepting'"):
        write_model(tmp_path / "m.wmod", one(marking))
    assert list(tmp_path.iterdir()) == []


def test_properties_of_events_have_to_agree_in_one_table(tmp_path: Path) -> None:
    free, forced = from_text("name a\n0 -a-> 0"), from_text("name b\n0 -a-> 0\nuncontrollable a")
    for ending in (".json", ".wmod", ".ads"):
        with pytest.raises(AlphabetError, match="event 'a' is uncontrollable in one automaton"):
            write_model(tmp_path / f"m{ending}", Model((free,), (forced,)))


# --- supremal convert -------------------------------------------------------------------------------------

if "convert" not in main.commands:
    main.add_command(convert)


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["convert", *map(str, arguments)])


FACTORY = CASES / "models" / "small_factory.json"


@pytest.mark.parametrize("ending", FORMATS)
def test_convert(ending: str, tmp_path: Path) -> None:
    target = tmp_path / f"factory{ending}"
    result = run(FACTORY, target)
    assert result.exit_code == 0, result.output
    files = ", one automaton a file" if FORMATS[ending].single else ""
    assert result.stdout == f"Wrote {target}: 2 plants, 2 specs, 10 states, 13 transitions{files}.\n"
    losses = find_losses(str(target), small_factory())
    assert result.stderr == (f"Note: {losses}.\n" if losses else "")
    if FORMATS[ending].read:
        assert tables(read_model(target)) == tables(small_factory())


@pytest.mark.parametrize(
    ("ending", "says"),
    [
        (".ads", "names of states (comments hold what is lost to TCT)"),
        (".fsm", "the names of automata (files have them)"),
        (".hoa", "marking (other programs read it as Büchi acceptance of infinite words)"),
        (".dot", "anything that could be read back"),
    ],
)
def test_convert_says_what_is_lost(ending: str, says: str, tmp_path: Path) -> None:
    assert run(FACTORY, tmp_path / f"m{ending}").stderr == f"Note: {ending} cannot hold {says}.\n"


def test_losses_of_odd_names() -> None:
    odd = Automaton(
        Alphabet(("é", "never"), unobservable=frozenset({"é"})),
        [[0, -1]],
        [True],
        state_names=("a b",),
        name="m",
    )
    twice = Model((odd,), (odd,))
    assert find_losses("m.wmod", twice) == ".wmod cannot hold two automata of one name (they are numbered)"
    assert find_losses("m.gen", twice).endswith("names that are not plain ASCII words (they are escaped)")
    assert find_losses("m.fsm", twice).endswith("blanks in names (they are escaped)")
    assert find_losses("m.ads", twice) == (
        ".ads cannot hold names of events, names of states, observability "
        "(comments hold what is lost to TCT), events that are blocked everywhere"
    )
    assert find_losses("m.json", twice) == find_losses("m.hoa", twice) == ""


def test_convert_never_overwrites_unless_forced(tmp_path: Path) -> None:
    target = tmp_path / "m.wmod"
    target.write_text("mine")
    result = run(FACTORY, target)
    assert (result.exit_code, target.read_text()) == (2, "mine")
    assert (
        result.stderr
        == f"Error: {target}: the file exists already; choose another name, or replace it with --force\n"
    )
    assert run(FACTORY, target, "--force").exit_code == 0
    assert len(read_model(target).plants) == 2


def test_convert_a_file_to_a_folder_in_its_place(tmp_path: Path) -> None:
    target = tmp_path / "m.fsm"
    target.write_text("mine")
    assert run(FACTORY, target, "--force").exit_code == 0
    assert len(read_model(target).specs) == 2
    assert list(tmp_path.iterdir()) == [target]


def test_convert_by_named_formats(tmp_path: Path) -> None:
    (tmp_path / "factory").write_bytes(FACTORY.read_bytes())
    result = run(tmp_path / "factory", tmp_path / "out.txt", "--from", "json", "--to", ".xml")
    assert result.exit_code == 0, result.output
    assert tables(read_model(tmp_path / "out.txt", form="xml")) == tables(small_factory())


def test_convert_reports_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "bad.fsm").write_text("1\na 1\n")
    for source, target, says in (
        (tmp_path / "bad.fsm", "out.json", f"{tmp_path / 'bad.fsm'}:2:1: a state has 2 words"),
        (FACTORY, "out.foo", "'.foo' is no ending of a model file; known: .json, .wmod"),
        (FACTORY, "no/where/out.json", "No such file or directory"),
    ):
        result = run(source, tmp_path / target)
        assert result.exit_code == 2
        assert says in result.stderr
        assert result.stderr.count("\n") == 1
        assert "Traceback" not in result.output
    assert [file.name for file in tmp_path.iterdir()] == ["bad.fsm"]


def test_convert_help_lists_the_formats() -> None:
    text = run("--help").output
    assert all(f"{ending}  " in text and form.about in text for ending, form in FORMATS.items())

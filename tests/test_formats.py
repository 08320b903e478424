"""Supremal's documents: what is read, and what every kind of slip is told."""

import io
import json
from pathlib import Path

import numpy as np
import pytest

from supremal import AlphabetError, AutomatonError, FormatError, ModelError, RuleError
from supremal.formats import Model, documents, read_automaton, read_model, read_reward_machine

LIGHT = {
    "name": "light",
    "events": {"on": {"controllable": True}, "off": {"controllable": False}},
    "states": ["dark", "lit"],
    "initial": "dark",
    "marked": ["dark"],
    "transitions": [["dark", "on", "lit"], ["lit", "off", "dark"]],
}
FACTORY = {
    "name": "factory",
    "title": "Machine and buffer",
    "source": "made up",
    "description": "",
    "params": {},
    "supervisor": {"states": 4, "transitions": 4},
    "events": {
        "start": {"controllable": True},
        "end": {"controllable": False},
        "take": {"controllable": True},
    },
    "plants": [
        {
            "name": "MACH",
            "events": ["end", "start"],
            "states": ["I", "W"],
            "initial": "I",
            "marked": ["I"],
            "transitions": [["I", "start", "W"], ["W", "end", "I"]],
        }
    ],
    "specs": [
        {
            "name": "BUF",
            "events": ["end", "take"],
            "states": ["0", "1"],
            "initial": "0",
            "marked": ["0"],
            "transitions": [["0", "end", "1"], ["1", "take", "0"]],
        }
    ],
}
COFFEE = {
    "name": "coffee",
    "propositions": ["c", "o"],
    "initial": "start",
    "edges": [["start", "c", "carrying", 0], ["carrying", "o & !c", "done", 1.5]],
}


@pytest.fixture
def write(tmp_path):
    """Write a document, or raw text or bytes, to a file and return its path."""

    def to_file(document, name="model.json"):
        path = tmp_path / name
        if not isinstance(document, str | bytes):
            document = json.dumps(document)
        path.write_bytes(document if isinstance(document, bytes) else document.encode())
        return path

    return to_file


def test_automaton(write):
    light = read_automaton(write(LIGHT))
    assert light.name == "light"
    assert light.alphabet.names == ("on", "off")
    assert light.alphabet.uncontrollable == {"off"}
    assert light.state_names == ("dark", "lit")
    assert light.delta.tolist() == [[1, -1], [-1, 0]]
    assert light.marked.tolist() == [True, False]


def test_initial_state_comes_first_and_may_stand_anywhere(write):
    light = read_automaton(write(LIGHT | {"initial": "lit"}))
    assert light.state_names == ("lit", "dark")
    assert light.accepts(["off"])


def test_unobservable_event(write):
    events = {"on": {"controllable": True, "observable": False}, "off": {"controllable": False}}
    assert read_automaton(write(LIGHT | {"events": events})).alphabet.unobservable == {"on"}


def test_empty_automaton(write):
    nothing = LIGHT | {"states": [], "initial": None, "marked": [], "transitions": []}
    assert read_automaton(write(nothing)).n_states == 0


def test_path_may_be_a_string_and_the_file_may_begin_with_a_byte_order_mark(write):
    path = write(b"\xef\xbb\xbf" + json.dumps(LIGHT).encode())
    assert read_automaton(str(path)).n_states == 2


def test_automaton_inside_a_package(write):
    class Inside:  # a file in a zipped package has no path, it only opens
        def open(self, mode):
            assert mode == "rb"
            return io.BytesIO(json.dumps(LIGHT).encode())

    assert read_automaton(Inside()).n_states == 2


def test_remarks_are_allowed(write):
    remarks = dict.fromkeys(("title", "source", "description", "params", "supervisor", "note"), "said")
    assert read_automaton(write(LIGHT | remarks)).n_states == 2


def test_model(write):
    model = read_model(write(FACTORY))
    assert isinstance(model, Model)
    (machine,), (buffer,) = model
    assert machine.name == "MACH"
    assert machine.alphabet.names == ("end", "start")
    assert machine.alphabet.uncontrollable == {"end"}
    assert buffer.alphabet.names == ("end", "take")
    assert buffer.delta.tolist() == [[1, -1], [-1, 0]]


def test_model_without_specs(write):
    plants_only = {key: FACTORY[key] for key in ("events", "plants")}
    assert read_model(write(plants_only)).specs == ()


def test_reward_machine(write):
    coffee = read_reward_machine(write(COFFEE))
    assert coffee.name == "coffee"
    assert coffee.states == ("start", "carrying", "done")
    assert coffee.step(0, {"c"}) == (1, 0.0)
    assert coffee.step(1, {"c", "o"}) == (1, 0.0)
    assert coffee.step(1, {"o"}) == (2, 1.5)


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [("", 1, 1), ('{"name": "x",}', 1, 14), ('{\n  "name": "x"\n  "states": []}', 3, 3), ("{} {}", 1, 4)],
)
def test_text_that_is_not_json_says_where(write, text, line, column):
    path = write(text)
    with pytest.raises(FormatError, match="this is not JSON") as error:
        read_automaton(path)
    assert (error.value.path, error.value.line, error.value.column) == (str(path), line, column)
    assert str(error.value).startswith(f"{path}:{line}:{column}: ")


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        (b'{"name": "\xff"}', "byte 10 is not UTF-8"),
        ('{"name": 1, "name": 2}', "key 'name' stands twice in one object"),
        ('{"name": NaN}', "NaN is no number of JSON"),
        ("[" * 100_000, "brackets are nested too deeply"),
        ("1" * 5000, "a number has too many digits"),
    ],
)
def test_text_that_no_document_can_be(write, text, fragment):
    path = write(text)
    with pytest.raises(FormatError, match=fragment) as error:
        read_automaton(path)
    assert error.value.path == str(path)


def test_large_file_is_refused(write, monkeypatch):
    monkeypatch.setattr(documents, "MAX_BYTES", 1 << 20)
    path = write(b" " * ((1 << 20) + 1))
    with pytest.raises(FormatError, match="larger than 1 MiB"):
        read_automaton(path)
    assert documents.read_automaton(write(json.dumps(LIGHT))).n_states == 2


def test_missing_file_stays_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_automaton(tmp_path / "nowhere.json")


def without(document, key):
    return {name: value for name, value in document.items() if name != key}


@pytest.mark.parametrize(
    ("document", "fragment"),
    [
        ([], "the document is []; an object with the keys name, events, states"),
        (LIGHT | {"transition": []}, "unknown key 'transition'; did you mean 'transitions'?"),
        (without(LIGHT, "marked"), "the document has no key 'marked'; name, events, states"),
        (LIGHT | {"name": 3}, "'name' of the document is 3; a string is needed"),
        (LIGHT | {"events": ["on"]}, "'events' of 'light' is [\"on\"]; an object like"),
        (LIGHT | {"events": {"on": {}}}, "event 'on' has no key 'controllable'"),
        (LIGHT | {"events": {"on": True}}, "event 'on' is true; an object with the keys controllable"),
        (LIGHT | {"events": {"on": {"controllable": 1}}}, "'controllable' of event 'on' is 1; true or false"),
        (LIGHT | {"events": {"on": {"controlable": True}}}, "did you mean 'controllable'?"),
        (LIGHT | {"states": "dark"}, "'states' of 'light' is \"dark\"; a list is needed"),
        (LIGHT | {"states": ["dark", 1]}, "an entry of 'states' of 'light' is 1; a string is needed"),
        (LIGHT | {"states": ["dark", "lit", "lit"]}, "'states' of 'light' names 'lit' twice"),
        (LIGHT | {"initial": None}, "'initial' of 'light' is null; a string is needed"),
        (LIGHT | {"states": [], "marked": []}, "but it has no states; null is needed"),
        (LIGHT | {"transitions": {}}, "'transitions' of 'light' is {}; a list is needed"),
        (
            LIGHT | {"transitions": [["dark", "on", "lit"], ["dark", "off"]]},
            'transition 2 of \'light\' is ["dark", "off"]; [from, event, to] is needed',
        ),
        (LIGHT | {"transitions": [["dark", 1, "lit"]]}, '["dark", 1, "lit"]; [from, event, to] is needed'),
        (LIGHT | {"transitions": [["dark", "on", "lid"]]}, "unknown state 'lid'; did you mean 'lit'?"),
        (LIGHT | {"transitions": [["dark", "onn", "lit"]]}, "unknown event 'onn'; did you mean 'on'?"),
        (LIGHT | {"transitions": [["x" * 100]]}, "xxx...; [from, event, to] is needed"),
    ],
)
def test_wrong_automaton(write, document, fragment):
    path = write(document)
    with pytest.raises(FormatError) as error:
        read_automaton(path)
    assert fragment in str(error.value)
    assert str(error.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("change", "kind", "fragment"),
    [
        (
            {"initial": "dork"},
            AutomatonError,
            "the initial state is 'dork', which is unknown; did you mean 'dark'?",
        ),
        (
            {"marked": ["lift"]},
            AutomatonError,
            "a marked state is 'lift', which is unknown; did you mean 'lit'?",
        ),
        (
            {"transitions": [["dark", "on", "lit"], ["dark", "on", "dark"]]},
            AutomatonError,
            "event 'on' leads from state 'dark' to both",
        ),
        (
            {"events": {"o n": {"controllable": True}}, "transitions": []},
            AlphabetError,
            "event 'o n' is no name",
        ),
    ],
)
def test_automaton_that_does_not_hold_together(write, change, kind, fragment):
    path = write(LIGHT | change)
    with pytest.raises(kind) as error:
        read_automaton(path)
    assert isinstance(error.value, ModelError)
    assert str(error.value).startswith(f"{path}: ")
    assert fragment in str(error.value)


PART = FACTORY["plants"][0]


@pytest.mark.parametrize(
    ("document", "fragment"),
    [
        (FACTORY | {"spec": []}, "the document has the unknown key 'spec'; did you mean 'specs'?"),
        (without(FACTORY, "plants"), "the document has no key 'plants'"),
        (FACTORY | {"name": []}, "'name' is []; a string is needed"),
        (FACTORY | {"plants": PART}, "'plants' is {"),
        (FACTORY | {"plants": [PART, 1]}, "automaton 2 of 'plants' is 1; an object with the keys"),
        (
            FACTORY | {"specs": [PART | {"events": ["start", "emd"]}]},
            "'events' of 'MACH' names the unknown event 'emd'; did you mean 'end'?",
        ),
        (FACTORY | {"specs": [PART | {"events": ["end", "end"]}]}, "'events' of 'MACH' names 'end' twice"),
        (
            FACTORY | {"specs": [PART | {"events": ["end"]}]},
            "transition 1 of 'MACH' has the unknown event 'start'; known: end",
        ),
    ],
)
def test_wrong_model(write, document, fragment):
    path = write(document)
    with pytest.raises(FormatError) as error:
        read_model(path)
    assert fragment in str(error.value)
    assert str(error.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("change", "fragment"),
    [
        ({"edges": [["a", "c", "b"]]}, 'edge 1 of \'coffee\' is ["a", "c", "b"]; [from, guard, to, reward]'),
        ({"edges": [["a", "c", "b", "1"]]}, "with a finite number as reward is needed"),
        ({"edges": [["a", "c", "b", True]]}, "with a finite number as reward is needed"),
        ({"edges": [["a", "c", "b", 10**400]]}, "with a finite number as reward is needed"),
        ({"edges": [["a", 1, "b", 1]]}, "[from, guard, to, reward]"),
        ({"propositions": ["c", "c"]}, "'propositions' of 'coffee' names 'c' twice"),
        ({"initial": 0}, "'initial' of 'coffee' is 0; a string is needed"),
        ({"edges": [["start", "c &", "done", 1]]}, "guard of start → done:1:4: a proposition is missing"),
        ({"edges": [["start", "x", "done", 1]]}, "unknown proposition 'x'"),
        ({"edge": []}, "unknown key 'edge'; did you mean 'edges'?"),
    ],
)
def test_wrong_reward_machine(write, change, fragment):
    path = write(COFFEE | change)
    with pytest.raises(FormatError) as error:
        read_reward_machine(path)
    assert fragment in str(error.value)
    assert error.value.path == str(path)


def test_reward_beyond_all_numbers(write):
    path = write(json.dumps(COFFEE).replace("1.5", "1e999"))
    with pytest.raises(FormatError, match="with a finite number as reward"):
        read_reward_machine(path)


def test_reward_machine_that_contradicts_itself(write):
    path = write(COFFEE | {"edges": [["start", "c", "a", 0], ["start", "o", "b", 1]]})
    with pytest.raises(RuleError) as error:
        read_reward_machine(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "make them exclude each other" in str(error.value)


def test_arrays_of_what_was_read_are_read_only(write):
    assert not read_automaton(write(LIGHT)).delta.flags.writeable
    assert read_automaton(write(LIGHT)).delta.dtype == np.int32


def test_text_of_a_document_is_never_run(write, tmp_path):
    trap = tmp_path / "ran"
    guard = f"__import__('pathlib').Path({str(trap)!r}).touch()"
    with pytest.raises(FormatError, match="unexpected"):
        read_reward_machine(write(COFFEE | {"edges": [["start", guard, "done", 1]]}))
    assert not Path(trap).exists()

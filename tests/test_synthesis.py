"""What can be enforced: against the definitions, against every other choice, and against known answers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import book
from strategies import automata, languages, models, plants, specifications, trie
from supremal import (
    Alphabet,
    AlphabetError,
    Automaton,
    AutomatonError,
    Monitor,
    Supervisor,
    coreachable,
    find_blocking,
    find_uncontrollable,
    from_text,
    from_transitions,
    is_controllable,
    is_included,
    is_nonblocking,
    is_same_language,
    mark_all,
    prefix_closure,
    reachable,
    sync,
    synthesize,
    trim,
    universal,
)
from supremal._jit import COMPILED

pytestmark = pytest.mark.engine

LENGTH = 4
ABU = Alphabet(("a", "b", "u"), frozenset({"u"}))
RECOVERY = """
    name recovery
    uncontrollable d_u
    w0 -d_u-> w1
    w1 -d2-> w2
    w2 -d3-> w3
    w3 -p1-> w4
    w4 -p2-> w5
    w5 -p3-> w0
"""


def pairs(supervisor: Supervisor) -> book.Machine:
    """The supervised behaviour, its states named by those of plant and specification."""
    machine = book.read(supervisor.automaton)
    name = [tuple(row) for row in supervisor.automaton.origin.tolist()]
    return book.Machine(
        machine.events,
        machine.uncontrollable,
        frozenset(name),
        {(name[s], e): name[t] for (s, e), t in machine.moves.items()},
        None if machine.initial is None else name[0],
        frozenset(name[s] for s in machine.marked),
    )


# --- known answers ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", book.named(book.table("supervisors")))
def test_textbook_cases(case: dict[str, Any]) -> None:
    plant, spec = (sync(*map(from_text, case[key])) for key in ("plants", "specs"))
    supervisor = synthesize(plant, spec, nonblocking=not case.get("closed", False))
    found = supervisor.automaton
    assert (found.n_states, found.n_transitions) == (case["states"], case["transitions"])
    assert supervisor.is_empty == (case["states"] == 0)
    violation = find_uncontrollable(plant, spec)
    assert (violation is None) == ("witness" not in case)
    if violation is not None:
        assert violation.word == tuple(case["witness"])
        assert violation.event == case["event"]
    blocking = find_blocking(sync(plant, spec))
    assert blocking == (tuple(case["blocking"]) if "blocking" in case else None)


def load(path: Path) -> dict[str, Any]:
    """One of the models of known size, its automata built."""
    model: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    uncontrollable = {event for event, is_ in model["events"].items() if not is_["controllable"]}
    for key in ("plants", "specs"):
        model[key] = sync(
            *(
                from_transitions(
                    Alphabet(tuple(part["events"]), uncontrollable & set(part["events"])),
                    part["transitions"],
                    initial=part["initial"],
                    marked=part["marked"],
                    states=part["states"],
                    name=part["name"],
                )
                for part in model[key]
            )
        )
    return model


MODELS = sorted((book.CASES / "models").glob("*.json"))
LARGE = {"tline_7_1", "tline_9_1", "tl_3_2", "cmt_5_1"}  # thousands of product states: compiled only


@pytest.mark.parametrize("path", [pytest.param(path, id=path.stem) for path in MODELS])
def test_models_of_known_size(path: Path) -> None:
    if not COMPILED and path.stem in LARGE:
        pytest.skip("too many states for kernels that are not compiled")
    model = load(path)
    assert model["source"]
    found = synthesize(model["plants"], model["specs"]).automaton
    assert {"states": found.n_states, "transitions": found.n_transitions} == model["supervisor"]
    assert is_nonblocking(found)
    assert is_controllable(model["plants"], found)


# --- the definitions --------------------------------------------------------------------------------------


@given(models())
def test_supervisors_by_the_naive_fixpoint(model: tuple[Automaton, Automaton]) -> None:
    plant, spec = model
    for nonblocking in (True, False):
        for must_act in (False, True):
            asked = {"nonblocking": nonblocking, "must_act": must_act}
            found = synthesize(plant, spec, **asked)
            assert pairs(found) == book.supcon(book.read(plant), book.read(spec), **asked)


@given(
    st.lists(plants(3) | automata(max_states=3), max_size=3),
    st.lists(specifications(3) | automata(max_states=2), max_size=2),
)
def test_parts_are_composed_on_the_fly(parts: list[Automaton], specs: list[Automaton]) -> None:
    plant, spec = sync(*parts), sync(*specs)
    for asked in ({}, {"nonblocking": False}, {"must_act": True}):
        whole, found = synthesize(plant, spec, **asked), synthesize(parts, specs, **asked)
        assert whole.automaton.alphabet == found.automaton.alphabet
        assert whole.automaton.delta.tolist() == found.automaton.delta.tolist()
        assert whole.automaton.marked.tolist() == found.automaton.marked.tolist()
        assert whole.enabled.tolist() == found.enabled.tolist()
        assert plant.origin[whole.plant_state[:, 0]].tolist() == found.plant_state.tolist()
    one, many = find_uncontrollable(plant, spec), find_uncontrollable(parts, specs)
    assert (one and (one.word, one.event)) == (many and (many.word, many.event))
    if many is not None:
        names = book.after(
            book.sync(*map(book.read, parts)), book.project(many.word, frozenset(plant.alphabet))
        )
        assert many.plant_state == ", ".join(map(str, names or ()))


@given(models())
def test_what_a_supervisor_promises(model: tuple[Automaton, Automaton]) -> None:
    plant, spec = model
    supervisor = synthesize(plant, spec)
    behaviour, alphabet = supervisor.automaton, supervisor.automaton.alphabet
    assert is_included(behaviour, sync(plant, spec))
    assert is_nonblocking(behaviour)
    assert is_controllable(plant, behaviour)
    assert supervisor.plant_state.tolist() == behaviour.origin[:, :1].tolist()
    assert supervisor.is_empty == (not behaviour.marked.any())
    assert supervisor.enabled.shape == behaviour.delta.shape
    for s, (plant_state,) in enumerate(supervisor.plant_state.tolist()):
        for e, event in enumerate(alphabet):
            possible = (
                event not in plant.alphabet or plant.delta[plant_state, plant.alphabet.index(event)] >= 0
            )
            if event in alphabet.uncontrollable:
                assert supervisor.enabled[s, e]
                assert (behaviour.delta[s, e] >= 0) == possible
            else:
                assert supervisor.enabled[s, e] == (behaviour.delta[s, e] >= 0)


@settings(max_examples=50)
@given(models())
def test_a_second_synthesis_changes_nothing(model: tuple[Automaton, Automaton]) -> None:
    plant, spec = model
    once = synthesize(plant, spec).automaton
    again = synthesize(plant, once).automaton
    assert is_same_language(once, again)
    assert is_same_language(mark_all(once), mark_all(again))


@settings(max_examples=50)
@given(plants(), specifications(), specifications())
def test_a_wider_specification_gives_a_wider_supervisor(
    plant: Automaton, spec: Automaton, other: Automaton
) -> None:
    narrow, wide = synthesize(plant, sync(spec, other)), synthesize(plant, spec)
    assert is_included(narrow.automaton, sync(wide.automaton, universal(narrow.automaton.alphabet)))
    closed = synthesize(plant, spec, nonblocking=False)
    assert is_included(wide.automaton, closed.automaton)


@settings(max_examples=50)
@given(models())
def test_a_controllable_specification_is_kept_whole(model: tuple[Automaton, Automaton]) -> None:
    plant, spec = model
    both = sync(plant, spec)
    whole = is_same_language(synthesize(plant, spec).automaton, both)
    assert whole == is_controllable(plant, both)
    closed = synthesize(plant, spec, nonblocking=False).automaton
    assert is_same_language(mark_all(closed), mark_all(both)) == is_controllable(plant, mark_all(both))


@given(plants(3), specifications(3))
def test_controllability_word_for_word(plant: Automaton, spec: Automaton) -> None:
    violations = book.uncontrollable_words(book.read(plant), book.read(spec), LENGTH)
    found = find_uncontrollable(plant, spec)
    assert is_controllable(plant, spec) == (found is None)
    assert (min((len(word) for word, _ in violations), default=None)) == (
        len(found.word) if found is not None and len(found.word) <= LENGTH else None
    )
    if found is not None and len(found.word) <= LENGTH:
        assert (found.word, found.event) in violations


@given(models())
def test_controllability_state_by_state(model: tuple[Automaton, Automaton]) -> None:
    plant, spec = model
    machine, closure = book.read(plant), book.trim(book.read(spec))
    both = book.sync(machine, closure)
    found = find_uncontrollable(plant, spec)
    assert (None if found is None else len(found.word)) == book.distance(both, book.escapes(machine, both))
    if found is not None:
        plant_state, spec_state = book.after(both, found.word) or ()
        assert (found.plant_state, found.spec_state) == (str(plant_state), str(spec_state))
        assert found.event in both.uncontrollable
        assert book.can(machine, plant_state, found.event)
        assert not book.can(closure, spec_state, found.event)


@given(automata(max_states=6))
def test_find_blocking_is_a_shortest_witness(automaton: Automaton) -> None:
    machine = book.read(automaton)
    blocked = machine.states - book.coaccessible(machine)
    found = find_blocking(automaton)
    assert (None if found is None else len(found)) == book.distance(machine, blocked)
    assert found is None or book.after(machine, found) in blocked
    assert (
        is_nonblocking(automaton)
        == (found is None)
        == (not (reachable(automaton) & ~coreachable(automaton)).any())
    )
    assert is_nonblocking(automaton) == is_same_language(prefix_closure(automaton), mark_all(automaton))
    assert is_nonblocking(trim(automaton))


# --- supremality, by trying everything else ---------------------------------------------------------------


@settings(max_examples=50)
@given(plants(3), specifications(2))
def test_no_other_subautomaton_is_better(plant: Automaton, spec: Automaton) -> None:
    machine = book.read(plant)
    whole = book.sync(machine, book.read(spec))
    assume(len(whole.moves) <= 8)
    greatest, closed = pairs(synthesize(plant, spec)), pairs(synthesize(plant, spec, nonblocking=False))
    rivals = [rival for rival in book.subautomata(whole) if not book.escapes(machine, rival)]
    assert closed.initial is None or closed in rivals
    assert greatest.initial is None or greatest in rivals
    for rival in rivals:
        assert rival.states <= closed.states
        assert rival.moves.items() <= closed.moves.items()
        if rival.states <= book.coaccessible(rival):
            assert rival.states <= greatest.states
            assert rival.moves.items() <= greatest.moves.items()


@given(languages("abu", 6, 3), languages("abu", 2, 3), languages("abu", 3, 3))
def test_the_union_of_all_controllable_sublanguages(
    allowed: frozenset[book.Word], more: frozenset[book.Word], unmarked: frozenset[book.Word]
) -> None:
    """K↑ = ∪ {Kᵢ ⊆ K : Kᵢ is controllable}, as the paper has it, with every Kᵢ of a finite K tried."""
    possible = book.prefixes(allowed | more)
    found = synthesize(trie(ABU, possible, unmarked=unmarked), trie(ABU, allowed))
    expected = book.supremal_language(allowed - unmarked, possible, {"u"})
    behaviour = book.read(found.automaton)
    assert book.apart(book.marked_words(behaviour, LENGTH), expected) is None
    assert book.apart(book.generated(behaviour, LENGTH), book.prefixes(expected)) is None


@settings(max_examples=50)
@given(languages("abu", 3, 3), languages("abu", 2, 3))
def test_the_union_of_all_controllable_closed_sublanguages(
    allowed: frozenset[book.Word], more: frozenset[book.Word]
) -> None:
    """A controllable sublanguage of a closed language has a controllable closure: trying them all will do."""
    closed, possible = book.prefixes(allowed), book.prefixes(allowed | more)
    found = synthesize(trie(ABU, possible), trie(ABU, allowed), nonblocking=False)
    expected = book.supremal_language(closed, possible, {"u"})
    assert book.apart(book.generated(book.read(found.automaton), LENGTH), expected) is None


# --- the paper's rule -------------------------------------------------------------------------------------


def test_recovery_cannot_be_kept_where_nothing_is_known() -> None:
    recovery = from_text(RECOVERY)
    violation = find_uncontrollable(universal(recovery.alphabet), recovery)
    assert violation is not None
    assert (violation.word, violation.event) == (("d_u",), "d_u")
    assert (violation.plant_state, violation.spec_state) == ("0", "w1")
    assert str(violation) == (
        "after d_u, d_u can happen (plant in state 0), which nobody controls and the specification "
        "forbids in its state w1"
    )
    assert synthesize(universal(recovery.alphabet), recovery).is_empty


def test_a_violation_without_a_word_happens_at_once() -> None:
    violation = find_uncontrollable(
        from_text("uncontrollable u \n on -u-> on"), from_text("uncontrollable u \n initial x")
    )
    assert str(violation).startswith("at once, u can happen (plant in state on)")


# --- monitors ---------------------------------------------------------------------------------------------


def recovery_monitor() -> Monitor:
    plant = from_text("""
        uncontrollable d_u
        all -f-> all
        all -d_u-> down
        down -f, d2, d3, p1, p2-> down
        down -p3-> all
    """)
    return synthesize(plant, from_text(RECOVERY)).monitor()


def test_a_monitor_follows() -> None:
    monitor = recovery_monitor()
    assert monitor.enabled == ("f", "d_u")
    assert monitor.observe(["f", "f"])
    assert monitor.observe(["d_u"])
    assert monitor.enabled == ("f", "d2")
    assert monitor.observe([])
    for event in ("d2", "d3", "p1", "p2", "p3"):
        assert event in monitor.enabled
        assert monitor.observe([event])
    assert monitor.enabled == ("f", "d_u")
    assert monitor.lost_at is None


def test_a_monitor_gets_lost_and_starts_again() -> None:
    monitor = recovery_monitor()
    assert not monitor.observe(["d_u", "d3", "d2"])
    assert monitor.lost_at == "d3"
    assert monitor.enabled == ()
    assert not monitor.observe(["d2"])
    assert not monitor.observe([])
    assert monitor.lost_at == "d3"
    monitor.reset()
    assert monitor.lost_at is None
    assert monitor.enabled == ("f", "d_u")
    assert monitor.observe(["d_u", "d2"])


def test_a_monitor_ignores_foreign_events() -> None:
    monitor = recovery_monitor()
    assert monitor.observe(["sunrise", "d_u", "sunset"])
    assert monitor.enabled == ("f", "d2")


def test_monitors_of_one_supervisor_do_not_share_their_state() -> None:
    first = recovery_monitor()
    second = first.supervisor.monitor()
    first.observe(["d_u"])
    assert second.enabled == ("f", "d_u")


def test_the_monitor_of_the_empty_supervisor_enables_nothing() -> None:
    monitor = synthesize(
        universal(Alphabet(("u",), frozenset({"u"}))), from_text("uncontrollable u \n initial x")
    ).monitor()
    assert monitor.supervisor.is_empty
    assert monitor.enabled == ()
    assert not monitor.observe(["u"])
    assert monitor.lost_at is None


@given(models())
def test_a_monitor_enables_what_its_supervisor_does(model: tuple[Automaton, Automaton]) -> None:
    plant, spec = model
    supervisor = synthesize(plant, spec)
    machine = book.read(supervisor.automaton)
    for word in book.generated(machine, 3):
        monitor = supervisor.monitor()
        assert monitor.observe(word)
        state = book.after(machine, word)
        assert set(monitor.enabled) == {event for (source, event) in machine.moves if source == state}


# --- bad input --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("verb", [synthesize, find_uncontrollable, is_controllable])
def test_controllable_in_one_and_not_in_the_other(verb: Any) -> None:
    plant, spec = from_text("uncontrollable fault \n 0 -fault-> 0"), from_text("0 -fault-> 0")
    with pytest.raises(
        AlphabetError, match="event 'fault' is uncontrollable in one automaton and controllable in"
    ):
        verb(plant, spec)


def test_the_bound_on_states() -> None:
    plant, spec = (
        from_text("name ring \n 0 -a-> 1 \n 1 -a-> 0"),
        from_text("name limit \n 0 -b-> 1 \n 1 -b-> 0"),
    )
    assert synthesize(plant, spec, max_states=4).automaton.n_states == 4
    with pytest.raises(
        AutomatonError, match=r"the product of ring \(2\), limit \(2\) states has more than 3; raise"
    ):
        synthesize(plant, spec, max_states=3)


def test_a_supervisor_that_does_not_fit_together() -> None:
    loop = from_text("0 -a-> 0")
    with pytest.raises(AutomatonError, match=r"enabled has shape \(1, 2\) .* the automaton needs \(1, 1\)"):
        Supervisor(loop, np.zeros((1, 1), np.int32), np.ones((1, 2), np.bool_))
    with pytest.raises(
        AutomatonError, match=r"plant_state has 2 rows; the automaton needs \(1, 1\) and 1 rows"
    ):
        Supervisor(loop, np.zeros((2, 1), np.int32), np.ones((1, 1), np.bool_))


def test_the_arrays_of_a_supervisor_are_its_own() -> None:
    enabled, plant_state = np.ones((1, 1), np.bool_), np.zeros((1, 1), np.int32)
    supervisor = Supervisor(from_text("0 -a-> 0"), plant_state, enabled)
    enabled[:], plant_state[:] = False, 5
    assert supervisor.enabled.all()
    assert supervisor.plant_state.tolist() == [[0]]
    assert not supervisor.enabled.flags.writeable
    assert not supervisor.plant_state.flags.writeable

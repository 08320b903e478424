"""Why: every reason is checked against the definitions, every witness against all words."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import book
from game import Game, beside
from strategies import automata
from supremal import (
    Automaton,
    AutomatonError,
    ModelError,
    Supervisor,
    find_blocking,
    find_uncontrollable,
    from_text,
    sync,
    synthesize,
    universal,
)
from supremal._graph import reverse
from supremal._jit import COMPILED
from supremal.formats import Model, read_model
from supremal.synthesis import _why
from supremal.synthesis.causes import Break, find_causes, supervisor_of
from supremal.synthesis.explain import Disabled, explain_disabled, explain_empty
from supremal.synthesis.given_up import GivenUp, Guilty, find_guilty, given_up
from supremal.synthesis.witnesses import explain_blocking, explain_deadlock, explain_violation

pytestmark = pytest.mark.engine

LENGTH = 4
CELL = book.CASES / "manufacturing_cell.json"
Systems = tuple[list[Automaton], list[Automaton]]
How = dict[str, bool]


HOWS = st.fixed_dictionaries({"nonblocking": st.booleans(), "must_act": st.booleans()})


@st.composite
def systems(draw: st.DrawFn, *, min_states: int = 0) -> Systems:
    """Up to two plants and up to three rules, over shared and private events."""

    def parts(most: int, least: int) -> list[Automaton]:
        one = automata(max_states=3, min_states=min_states, max_events=2)
        found = draw(st.lists(one, min_size=least, max_size=most))
        return [replace(part, name=f"{'PR'[least == 0]}{k}") for k, part in enumerate(found)]

    return parts(2, 1), parts(3, 0)


# --- disabled events --------------------------------------------------------------------------------------


@given(systems(), HOWS)
def test_every_reason_by_definition(parts: Systems, how: How) -> None:
    plants, specs = parts
    supervisor = synthesize(plants, specs, **how)
    disabled = explain_disabled(plants, specs, supervisor, **how)
    game = Game(plants, specs, nonblocking=how["nonblocking"])
    left = game.supremal(must_act=how["must_act"])
    behaviour = book.read(supervisor.automaton)
    seen = set()
    for reason in disabled:
        game.check_reason(reason, must_act=how["must_act"], left=left)
        state = book.after(behaviour, reason.word)
        assert len(reason.word) == book.distance(behaviour, frozenset({state}))
        seen.add((state, reason.event))
        assert str(reason).startswith(
            f"after {' '.join(reason.word)}, {reason.event} is disabled: " if reason.word else reason.event
        )
    assert seen == {
        (s, event)
        for s, state in beside(behaviour, game.whole).items()
        for event in game.choices(state)
        if (s, event) not in behaviour.moves
    }
    assert len(disabled) == len(seen)
    counts = disabled.counts()
    assert sum(off for off, _ in counts.values()) == len(seen)
    for event, (off, on) in counts.items():
        assert off == sum(name == event for _, name in seen)
        assert on == sum(name == event for _, name in behaviour.moves)


@given(systems(), HOWS)
def test_chains_are_shortest_for_the_plant_and_longest_for_the_agent(parts: Systems, how: How) -> None:
    how = how | {"nonblocking": False}
    game = Game(*parts, nonblocking=False)
    for reason in explain_disabled(*parts, **how):
        state = book.after(game.whole, (*reason.word, reason.event))
        assert state is None or len(reason.steps) == game.rank(state, must_act=how["must_act"])


@given(systems(), HOWS)
def test_what_is_left_is_the_supervisor(parts: Systems, how: How) -> None:
    want, causes = synthesize(*parts, **how), find_causes(*parts, **how)
    got, state = supervisor_of(causes)
    assert got.automaton.alphabet == want.automaton.alphabet
    for field in ("delta", "marked", "origin"):
        assert np.array_equal(getattr(got.automaton, field), getattr(want.automaton, field)), field
    assert np.array_equal(got.enabled, want.enabled)
    assert np.array_equal(got.plant_state, want.plant_state)
    assert len(state) == got.automaton.n_states
    whole = Game(*parts, nonblocking=how["nonblocking"]).whole.states
    assert causes.enforceable == (bool(whole) and got.automaton.n_states == len(whole))


@given(systems(min_states=1), HOWS)
def test_why_nothing_can_be_enforced(parts: Systems, how: How) -> None:
    reason = explain_empty(find_causes(*parts, **how))
    assert (reason is not None) == synthesize(*parts, **how).is_empty
    if reason is not None and reason.end != "nothing":
        game = Game(*parts, nonblocking=how["nonblocking"])
        game.check_reason(reason, must_act=how["must_act"], left=game.supremal(must_act=how["must_act"]))
        assert str(reason).startswith("nothing can be enforced: ")


def factory() -> tuple[list[Automaton], list[Automaton]]:
    plants = [
        from_text(
            f"name M{i} \n marked idle \n uncontrollable f{i} \n idle -s{i}-> busy \n busy -f{i}-> idle"
        )
        for i in (1, 2)
    ]
    return plants, [
        from_text("name B \n marked empty \n uncontrollable f1 \n empty -f1-> full \n full -s2-> empty")
    ]


def test_reasons_in_words() -> None:
    assert [str(reason) for reason in explain_disabled(*factory())][:3] == [
        "s2 is disabled: it breaks B in its state empty",
        "after s1, s2 is disabled: it breaks B in its state empty",
        (
            "after s1 f1, s1 is disabled: after it f1 can happen, which nobody controls: "
            "it breaks B in its state full"
        ),
    ]


@pytest.mark.parametrize("first", ["u, v", "v, u"])
def test_the_shortest_of_two_chains(first: str) -> None:
    plant = from_text(f"""
        events go, {first}
        uncontrollable u, v, f
        s -go-> t
        t -u-> x
        x -u-> y
        y -f-> s
        t -v-> z
        z -f-> s
    """)
    calm = from_text("name calm \n uncontrollable f \n events f \n initial ok")
    (reason,) = explain_disabled(plant, calm)
    assert reason.chain == ("v",)
    assert str(reason) == (
        "go is disabled: it can be followed by v; nobody controls v; then f can happen, which nobody "
        "controls: it breaks calm in its state ok"
    )


def test_where_things_go_on_for_ever_or_come_to_an_end() -> None:
    plant = from_text("""
        marked home
        home -circle-> around
        around -on-> around
        home -stray-> lost
        lost -on-> further
        further -on-> end
    """)
    reasons = {reason.event: reason for reason in explain_disabled(plant, ())}
    assert (reasons["circle"].end, reasons["circle"].chain) == ("trapped", ())
    assert (reasons["stray"].end, reasons["stray"].chain) == ("dead", ("on", "on"))
    assert str(reasons["circle"]) == "circle is disabled: after it no marked state can be reached any more"
    assert str(reasons["stray"]) == (
        "stray is disabled: it can be followed by on on; other ways than on lead to no marked state either; "
        "then nothing is possible any more, short of a marked state"
    )


def test_a_rule_that_could_never_be_completed() -> None:
    rule = from_text(
        "name once \n marked ready, done \n ready -a-> done \n done -a-> spoilt \n spoilt -a-> spoilt"
    )
    (reason,) = explain_disabled(from_text("0 -a-> 0"), rule)
    assert reason.breaks == (Break("a", "once", "done", at_once=False),)
    assert str(reason) == (
        "after a, a is disabled: after it, once could never be completed from its state done"
    )


def test_a_blocked_way_in_words() -> None:
    users = [
        from_text("name one \n marked idle \n idle -a1-> a \n a -b1-> both \n both -free1-> idle"),
        from_text("name two \n marked idle \n idle -b2-> b \n b -a2-> both \n both -free2-> idle"),
    ]
    resources = [
        from_text("name A \n marked free \n free -a1, a2-> taken \n taken -free1, free2-> free"),
        from_text("name B \n marked free \n free -b1, b2-> taken \n taken -free1, free2-> free"),
    ]
    reasons = [reason for reason in explain_disabled(users, resources) if reason.kind == "blocking"]
    assert [str(reason) for reason in reasons] == [
        (
            "after a1, b2 is disabled: after it nothing is possible any more, short of a marked state: "
            "b1 breaks B in its state taken, a2 breaks A in its state taken"
        ),
        (
            "after b2, a1 is disabled: after it nothing is possible any more, short of a marked state: "
            "b1 breaks B in its state taken, a2 breaks A in its state taken"
        ),
    ]


def test_only_what_is_disabled_has_a_reason() -> None:
    disabled = explain_disabled(*factory())
    with pytest.raises(ModelError, match="'s1' is enabled in state 0 of the supervisor"):
        disabled.why(0, "s1")
    with pytest.raises(ModelError, match="'s1' is not possible in the plants in state 1"):
        disabled.why(1, "s1")
    with pytest.raises(ModelError, match="unknown event 'fault'"):
        disabled.why(0, "fault")


def test_a_supervisor_whose_states_have_other_numbers() -> None:
    supervisor = synthesize(*factory())
    automaton = supervisor.automaton
    order = np.array([0, *range(automaton.n_states - 1, 0, -1)])
    number = np.append(np.argsort(order), -1)
    other = Supervisor(
        Automaton(
            automaton.alphabet,
            number[automaton.delta[order]],
            automaton.marked[order],
            automaton.origin[order],
        ),
        supervisor.plant_state[order],
        supervisor.enabled[order],
    )
    assert sorted(map(str, explain_disabled(*factory(), other))) == sorted(
        map(str, explain_disabled(*factory(), supervisor))
    )


def test_a_supervisor_of_something_else() -> None:
    plants, specs = factory()
    other = synthesize(plants, [])
    with pytest.raises(ModelError, match="is not the one of these plants and specifications, which has 6"):
        explain_disabled(plants, specs, other)
    with pytest.raises(ModelError, match="is not the one of these plants and specifications"):
        given_up(plants[:1], specs, other)


# --- witnesses --------------------------------------------------------------------------------------------


@given(systems(), HOWS)
def test_violations_by_definition(parts: Systems, how: How) -> None:
    plants, specs = parts
    found = explain_violation(plants, specs, nonblocking=how["nonblocking"])
    game = Game(plants, specs, nonblocking=how["nonblocking"])
    assert (None if found is None else len(found.word)) == book.distance(game.whole, game.escapes())
    if found is not None:
        state = book.after(game.whole, found.word)
        assert found.event in game.possible(state) & game.whole.uncontrollable
        game.check_breaks(found.breaks, state, {found.event})


@given(automata(max_states=3), automata(max_states=4))
def test_the_violation_of_one_rule_is_the_one_that_verify_finds(plant: Automaton, spec: Automaton) -> None:
    short, told = find_uncontrollable(plant, spec), explain_violation(plant, spec)
    assert (short is None) == (told is None)
    if short is not None and told is not None:
        assert len(short.word) == len(told.word)
        assert told.breaks


@given(systems())
def test_blocking_by_definition(parts: Systems) -> None:
    plants, specs = parts
    found = explain_blocking(plants, specs)
    game = Game(plants, specs, nonblocking=True)
    blocked = game.whole.states - book.coaccessible(game.whole)
    assert (None if found is None else len(found.word)) == book.distance(game.whole, blocked)
    if found is not None:
        state = book.after(game.whole, found.word)
        assert state in blocked
        marks = [
            (part.name, str(q))
            for part, machine, q in zip(
                [*plants, *specs], [*game.plants, *game.closures], [*state[0], *state[1]], strict=True
            )
            if q not in machine.marked
        ]
        assert found.waiting == tuple(marks)


def test_blocking_of_plants_alone() -> None:
    plants, _ = factory()
    stop = from_text("name stop \n marked on \n on -off-> out")
    assert find_blocking(sync(*plants, stop)) == ("off",)
    assert str(explain_blocking([*plants, stop])) == (
        "after off, no marked state can be reached any more; not marked: stop in out"
    )
    nothing = from_text("name nothing \n marked y \n x -b-> x \n y -a-> y")
    assert str(explain_blocking(nothing)).startswith("from the start, no marked state")


@given(systems())
def test_deadlocks_by_definition(parts: Systems) -> None:
    found = explain_deadlock(*parts)
    game = Game(*parts, nonblocking=False)
    inside = book.restrict(game.whole, game.whole.states - game.escapes())
    stuck = game.stuck(game.whole.states) - game.escapes()
    assert (None if found is None else len(found.word)) == book.distance(inside, stuck)
    if found is not None:
        state = book.after(game.whole, found.word)
        assert state in stuck
        game.check_breaks(found.breaks, state, game.possible(state))


def test_a_violation_at_once_and_one_that_another_plant_rules_out() -> None:
    calm = from_text("name calm \n uncontrollable fault \n events fault \n initial ok")
    plant = from_text("name P \n uncontrollable fault \n on -fault-> on")
    guard = from_text("name guard \n uncontrollable fault \n events fault \n initial safe")
    assert str(explain_violation(plant, calm)) == (
        "at once, fault can happen, which nobody controls: it breaks calm in its state ok"
    )
    assert explain_violation([plant, guard], calm) is None
    late = from_text("name late \n uncontrollable fault \n 0 -go-> 1 \n 1 -fault-> 1")
    found = explain_violation([plant, late], calm)
    assert found is not None
    assert found.word == ("go",)


def test_all_plants_are_taken_where_some_have_the_larger_product() -> None:
    plant = from_text("name P \n uncontrollable fault \n on -fault, tick-> on")
    once = from_text("name once \n 0 -tick-> 1")
    arrows = [f"{k} -tick-> {k + 1} \n {k} -fault-> {k}" for k in range(9)]
    patient = from_text("name patient \n uncontrollable fault \n " + " \n ".join(arrows))
    assert str(explain_violation(plant, patient)).endswith("it breaks patient in its state 9")
    assert explain_violation([plant, once], patient) is None
    assert explain_violation([plant, once], patient, max_states=2) is None
    twelve = from_text("name twelve \n " + " \n ".join(f"{k} -tick-> {k + 1}" for k in range(12)))
    assert explain_violation([plant, twelve, once], patient) is None
    assert explain_violation([plant, twelve], patient) == explain_violation(plant, patient)
    with pytest.raises(AutomatonError, match="has more than 1; raise max_states"):
        explain_violation([plant, once], patient, max_states=1)


def test_parts_without_a_name_are_called_by_their_place() -> None:
    plant = from_text("uncontrollable u \n on -u-> on")
    rule = from_text("uncontrollable u \n events u \n initial x")
    assert str(explain_violation(plant, [plant, rule])).endswith("it breaks rule 2 in its state x")


# --- what is given up -------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(systems(), HOWS, st.integers(0, 6))
def test_given_up_against_all_words(parts: Systems, how: How, n: int) -> None:
    supervisor = synthesize(*parts, **how)
    found = given_up(*parts, supervisor, n, nonblocking=how["nonblocking"])
    whole, kept = book.sync(*(book.read(p) for p in (*parts[0], *parts[1]))), book.read(supervisor.automaton)
    language = book.marked_words if how["nonblocking"] else book.generated
    lost = language(whole, LENGTH) - language(kept, LENGTH)
    lengths = [len(lost_word.word) for lost_word in found]
    assert lengths == sorted(lengths)
    assert len({lost_word.word for lost_word in found}) == len(found) <= n
    assert sorted(map(len, lost))[:n] == [length for length in lengths if length <= LENGTH]
    for lost_word in found:
        state = book.after(whole, lost_word.word)
        assert state in whole.marked or (not how["nonblocking"] and state is not None)
        if lost_word.kept is None:
            assert supervisor.is_empty
        else:
            assert book.after(kept, lost_word.word[: lost_word.kept]) is not None
            assert book.after(kept, lost_word.word[: lost_word.kept + 1]) is None
        assert len(lost_word.word) > LENGTH or lost_word.word in lost


@given(st.integers(0, 2**32 - 1), st.integers(1, 7))
def test_distances_by_relaxation(seed: int, states: int) -> None:
    rng = np.random.default_rng(seed)
    edges = np.argwhere(rng.random((states, states)) < 0.4).tolist()
    ready, kept = rng.integers(-1, 3, states, dtype=np.int32), rng.random(states) < 0.7
    start = np.searchsorted([s for s, _ in edges], np.arange(states + 1)).astype(np.int64)
    target = np.array([t for _, t in edges], np.int32)
    into, source = reverse(start, target)
    seeds = np.array(sorted(np.flatnonzero(ready >= 0), key=lambda s: ready[s]), np.int64)
    far = {s: int(r) for s, r in enumerate(ready) if r >= 0}
    for _ in range(states):
        for s, t in edges:
            if t in far and kept[s]:
                far[s] = min(far.get(s, far[t] + 1), far[t] + 1)
    assert _why.distances(into, source, ready, seeds, kept).tolist() == [
        far.get(s, -1) for s in range(states)
    ]
    leaving = {
        s: [int(ready[t]) + 1 for r, t in edges if r == s and not kept[t] and ready[t] >= 0]
        for s in range(states)
    }
    assert _why.leaving(start, target, kept, ready).tolist() == [
        min(leaving[s], default=-1) if kept[s] else -1 for s in range(states)
    ]


def test_words_given_up_in_words() -> None:
    assert str(GivenUp(("a", "b"), 1)) == "a b: b is disabled after a"
    assert str(GivenUp(("a", "b"), 0)) == "a b: a is disabled at the start"
    assert str(GivenUp((), None)) == "the empty word"
    plants, specs = factory()
    (first, *_) = given_up(plants, specs, synthesize(plants, specs))
    assert str(first) == "s1 f1 s1 s2 f1 f2 s2 f2: s1 is disabled after s1 f1"


# --- who is to blame --------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(systems(), HOWS)
def test_the_guilty_are_a_minimal_set(parts: Systems, how: How) -> None:
    plants, specs = parts

    def hopeless(chosen: Sequence[int]) -> bool:
        these = [spec if k in chosen else universal(spec.alphabet) for k, spec in enumerate(specs)]
        return synthesize(plants, these, **how).is_empty

    found = find_guilty(plants, specs, **how)
    assert (found is not None) == hopeless(range(len(specs)))
    if found is not None:
        assert hopeless(found.number)
        assert found.rules == tuple(specs[k].name for k in found.number)
        for size in range(len(found.number)):
            assert not any(map(hopeless, combinations(found.number, size)))
        if not how["must_act"]:
            chosen = [specs[k] for k in found.number]
            assert synthesize(plants, chosen, nonblocking=how["nonblocking"]).is_empty


def test_the_guilty_in_words() -> None:
    assert str(Guilty((), ())) == "the plants alone are to blame: nothing can be enforced even without a rule"
    assert (
        str(Guilty(("a", "b", "c"), (0, 1, 2))) == "a, b and c cannot be kept together; any fewer of them can"
    )
    plant = from_text("name P \n marked x \n y -a-> y \n x -a-> x")
    assert find_guilty(plant, [universal(plant.alphabet)]) == Guilty((), ())
    assert find_guilty(*factory()) is None
    turn = from_text("name T \n marked end \n start -a-> end \n start -b-> end")
    rules = [from_text(f"name no_{e} \n events {e} \n initial x") for e in "ab"]
    assert str(find_guilty(turn, [universal(turn.alphabet), *rules])) == (
        "no_a and no_b cannot be kept together; any fewer of them can"
    )


# --- the manufacturing cell -------------------------------------------------------------------------------

cell_only_compiled = pytest.mark.skipif(not COMPILED, reason="thousands of states")


@pytest.fixture(scope="module")
def cell() -> Model:
    return read_model(CELL)


def by_name(model: Model) -> dict[str, int]:
    return {part.name: k for k, part in enumerate((*model.plants, *model.specs))}


def enabled_where(model: Model, supervisor: Supervisor, event: str) -> set[str]:
    """The states of the buffer in which the supervisor enables an event."""
    automaton, buffer = supervisor.automaton, by_name(model)["buffer"]
    on = automaton.delta[:, automaton.alphabet.index(event)] >= 0
    return {model.specs[0].state_name(q) for q in automaton.origin[on, buffer]}


def test_the_cell_is_that_of_the_paper(cell: Model) -> None:
    document = json.loads(CELL.read_text(encoding="utf-8"))
    steps = {"e": (1, 0), "n": (0, 1), "w": (-1, 0), "s": (0, -1)}
    places = {"R1": (0, (2, 1), (0, 2), (2, 1)), "R2": (4, (4, 1), (4, 1), (6, 2))}
    for robot, (left, start, pick, deliver) in places.items():
        part = cell.plants[by_name(cell)[robot]]
        moves = {
            (s, e): t for s, e, t in next(p for p in document["plants"] if p["name"] == robot)["transitions"]
        }
        assert part.state_name(0) == f"({start[0]},{start[1]})"
        want = {}
        for x, y in ((x, y) for x in range(left, left + 3) for y in range(3)):
            for load in ("", " loaded"):
                here = f"({x},{y}){load}"
                for step, (dx, dy) in steps.items():
                    if left <= x + dx < left + 3 and 0 <= y + dy < 3:
                        want[here, step + robot[1]] = f"({x + dx},{y + dy}){load}"
                if (x, y) == pick and not load:
                    want[here, f"p{robot[1]}"] = f"{here} loaded"
                if (x, y) == deliver and load:
                    want[here, f"d{robot[1]}"] = f"({x},{y})"
        assert moves == want
    assert {e for e, says in document["events"].items() if not says["controllable"]} == {
        "quiet",
        "item",
        "phi",
        "rho",
    }
    deadline = cell.specs[by_name(cell)["deadline_R1"] - len(cell.plants)]
    assert deadline.run(["w1", "p1", *["e1"] * 5, "d1"]) == 0
    assert deadline.run(["p1", *["e1"] * 6]) < 0


@cell_only_compiled
@pytest.mark.parametrize(
    "how",
    [
        {"nonblocking": True, "must_act": True},
        {"nonblocking": True, "must_act": False},
        {"nonblocking": False, "must_act": True},
    ],
    ids=str,
)
def test_that_r1_waits_for_the_buffer_comes_out_of_the_synthesis(cell: Model, how: How) -> None:
    supervisor = synthesize(*cell, **how)
    assert {
        "states": supervisor.automaton.n_states,
        "transitions": supervisor.automaton.n_transitions,
    } == json.loads(CELL.read_text(encoding="utf-8"))["supervisor"]
    assert enabled_where(cell, supervisor, "p1") == {"empty"}
    disabled = explain_disabled(*cell, supervisor, **how)
    p1 = supervisor.automaton.alphabet.index("p1")
    buffer = supervisor.automaton.origin[:, by_name(cell)["buffer"]]
    off = disabled.pairs[disabled.pairs[:, 1] == p1, 0]
    assert {cell.specs[0].state_name(q) for q in buffer[off]} == {"full"}
    assert len(off) == 47


@cell_only_compiled
def test_that_r1_waits_for_the_buffer_is_not_put_in(cell: Model) -> None:
    resting = synthesize(*cell, nonblocking=False)
    assert enabled_where(cell, resting, "p1") == {"empty", "full"}


@cell_only_compiled
def test_why_r1_may_not_pick_while_the_buffer_is_full(cell: Model) -> None:
    disabled = explain_disabled(*cell, must_act=True)
    turns = by_name(cell)["turns"]
    reasons = [
        (reason, cell.plants[turns].state_name(disabled.supervisor.automaton.origin[s, turns]))
        for (s, _), reason in zip(disabled.pairs.tolist(), disabled, strict=True)
        if reason.event == "p1"
    ]
    assert {turn for _, turn in reasons} == {"R1 acts, R2 works", "R1 acts, R2 is down"}
    for reason, turn in reasons:
        assert reason.kind == "no choice"
        assert "deadline_R1" in {b.rule for b in reason.breaks}
        assert ("phi" in reason.chain) == (turn == "R1 acts, R2 works")
        assert "phi" in (*reason.word, *reason.chain)
        assert len([step for step in reason.steps if step.how == "choice"]) == 5
    text = next(str(reason) for reason, turn in reasons if turn == "R1 acts, R2 works")
    assert re.search(
        r"p1 is disabled: it can be followed by phi .*; nobody controls phi, .*; no choice holds out longer "
        r"than .*; then no choice is left: .* breaks deadline_R1 in its state 5 actions$",
        text,
    )


@cell_only_compiled
def test_reasons_come_quickly_where_there_are_many(cell: Model) -> None:
    disabled: Disabled = explain_disabled(*cell, must_act=True)
    kinds: dict[Any, int] = {}
    for reason in disabled:
        kinds[reason.kind] = kinds.get(reason.kind, 0) + 1
    assert kinds == {"breaks a rule": 462, "no choice": 1553}

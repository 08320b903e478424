"""Small supervisors and local ones: the same behaviour, by the definitions, and as small as TCT's."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from random import Random
from typing import Any

import faudes
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import book
from strategies import automata, models, plants, specifications
from supremal import (
    Alphabet,
    Automaton,
    AutomatonError,
    Supervisor,
    from_text,
    from_transitions,
    is_same_language,
    mark_all,
    sync,
    synthesize,
    universal,
)
from supremal._jit import COMPILED
from supremal.automata.compose import extend
from supremal.synthesis.modular import synthesize_modular
from supremal.synthesis.normal import synthesize_normal
from supremal.synthesis.reduction import (
    DISABLED,
    ENABLED,
    _indicators,
    _merge_all,
    localise,
    reduce_supervisor,
)
from supremal.synthesis.timed import synthesize_timed
from test_faudes import from_faudes, random_pairs, to_faudes
from test_observation import hide

pytestmark = pytest.mark.engine


def assert_control_equivalent(
    parts: Sequence[Automaton], small: Sequence[Automaton], supervisor: Supervisor
) -> None:
    """The plants under the small supervisors do what they do under the supervisor."""
    run, whole = sync(*parts, *small), supervisor.automaton
    wide = extend(run, whole.alphabet, stand_still=True)
    assert is_same_language(wide, whole)
    assert is_same_language(mark_all(wide), mark_all(whole))


# --- the definitions --------------------------------------------------------------------------------------


def indicators(plant: book.Machine, behaviour: book.Machine) -> dict[tuple[book.State, str], set[str]]:
    """E and D of all states, event by event; T and M as those of an event called ``marking``."""
    found: dict[tuple[book.State, str], set[str]] = {}
    for q, x in book.sync(plant, behaviour).states:
        for event in behaviour.events:
            if book.can(plant, q, event):
                does = "enabled" if (x, event) in behaviour.moves else "disabled"
                found.setdefault((x, event), set()).add(does)
        if q in plant.marked:
            does = "enabled" if x in behaviour.marked else "disabled"
            found.setdefault((x, "marking"), set()).add(does)
    return found


def is_congruence(
    cells: Sequence[frozenset[book.State]],
    behaviour: book.Machine,
    need: dict[tuple[book.State, str], set[str]],
) -> bool:
    """Members of a cell are pairwise consistent, and an event leads from all of them into one cell."""
    for cell in cells:
        for event in (*behaviour.events, "marking"):
            if len(set().union(*(need.get((x, event), set()) for x in cell))) > 1:
                return False
            reached = {behaviour.moves[x, event] for x in cell if (x, event) in behaviour.moves}
            if not any(reached <= other for other in cells):
                return False
    return True


def partitions(states: list[book.State]) -> Iterator[list[frozenset[book.State]]]:
    """All partitions of a set."""
    if not states:
        yield []
        return
    for smaller in partitions(states[1:]):
        yield [frozenset({states[0]}), *smaller]
        for k, cell in enumerate(smaller):
            yield [*smaller[:k], cell | {states[0]}, *smaller[k + 1 :]]


@settings(max_examples=50)
@given(models(), st.booleans(), st.randoms(use_true_random=False))
def test_congruences_are_maximal(
    model: tuple[Automaton, Automaton],
    column: bool,  # noqa: FBT001 - drawn
    random: Random,
) -> None:
    plant, spec = model
    behaviour = synthesize(plant, spec, nonblocking=False).automaton
    machine = book.read(behaviour)
    need = indicators(book.read(plant), machine)
    bits = _indicators([plant], behaviour)
    for x in machine.states:
        for e, event in enumerate((*behaviour.alphabet, "marking")):
            does = need.get((x, event), set())
            assert bool(bits[x, e] & ENABLED) == ("enabled" in does)
            assert bool(bits[x, e] & DISABLED) == ("disabled" in does)
    order = np.array(random.sample(range(len(machine.states)), len(machine.states)), np.int64)
    nothing_hidden = np.zeros(len(behaviour.alphabet), np.bool_)
    member = _merge_all(order, behaviour.delta, bits, nothing_hidden, column)
    cells = [frozenset(np.flatnonzero(member == m).tolist()) for m in set(member.tolist())]
    assert is_congruence(cells, machine, need)
    if len(cells) <= 6:
        for merged in partitions(list(range(len(cells)))):
            wider = [frozenset().union(*(cells[k] for k in group)) for group in merged]
            assert len(wider) == len(cells) or not is_congruence(wider, machine, need)


def test_small_supervisors_are_nearly_always_the_least() -> None:
    """Among those of at most 7 states, all partitions tried."""
    rng, least = np.random.default_rng(0), []
    while len(least) < (40 if COMPILED else 10):
        plant, spec = random_pair(rng)
        supervisor = synthesize(plant, spec)
        if not 3 <= supervisor.automaton.n_states <= 7:
            continue
        machine = book.read(supervisor.automaton)
        need = indicators(book.read(plant), machine)
        fewest = min(len(p) for p in partitions(sorted(machine.states)) if is_congruence(p, machine, need))
        found = reduce_supervisor(plant, supervisor).n_states
        assert found >= fewest
        least.append(found == fewest)
    assert np.mean(least) >= 0.9


def random_pair(rng: np.random.Generator) -> tuple[Automaton, Automaton]:
    """A small plant, and a specification that can often be kept in part."""
    parts = []
    for missing, lost in ((0.4, 0.6), (0.3, 0.1)):
        states = int(rng.integers(2, 5))
        share = [missing, missing, missing, lost]
        targets = rng.integers(0, states, (states, 4))
        delta = np.where(rng.random((states, 4)) < share, -1, targets)
        parts.append(Automaton(Alphabet(tuple("abcu"), frozenset({"u"})), delta, rng.random(states) < 0.6))
    return parts[0], parts[1]


@settings(max_examples=50)
@given(models(), st.booleans())
def test_reduced_supervisors_are_control_equivalent(
    model: tuple[Automaton, Automaton],
    nonblocking: bool,  # noqa: FBT001 - drawn
) -> None:
    plant, spec = model
    supervisor = synthesize(plant, spec, nonblocking=nonblocking)
    small = reduce_supervisor(plant, supervisor)
    assert small.n_states <= max(supervisor.automaton.n_states, 1)
    assert set(small.alphabet) <= set(supervisor.automaton.alphabet)
    assert_control_equivalent([plant], [small], supervisor)


@settings(max_examples=50)
@given(models(), st.frozensets(st.sampled_from("abcuv")))
def test_what_is_not_seen_is_not_listened_to(
    model: tuple[Automaton, Automaton], hidden: frozenset[str]
) -> None:
    plant, spec = (hide(part, hidden) for part in model)
    supervisor = synthesize_normal(plant, mark_all(spec))
    small = reduce_supervisor(plant, supervisor)
    assert_control_equivalent([plant], [small], supervisor)
    for e, event in enumerate(small.alphabet):
        if event in hidden and small.n_states:  # the specification alone knows it
            assert event not in plant.alphabet
            assert small.delta[:, e].tolist() == list(range(small.n_states))


@settings(max_examples=50)
@given(st.lists(plants(3), min_size=1, max_size=3), specifications(3) | automata(max_states=3))
def test_several_plants(parts: list[Automaton], spec: Automaton) -> None:
    supervisor = synthesize(parts, spec)
    several, single = reduce_supervisor(parts, supervisor), reduce_supervisor(sync(*parts), supervisor)
    assert_control_equivalent(parts, [several], supervisor)
    assert several.delta.tolist() == single.delta.tolist()


@settings(max_examples=50)
@given(st.lists(plants(3), min_size=1, max_size=3), specifications(3))
def test_local_controllers_are_control_equivalent(agents: list[Automaton], spec: Automaton) -> None:
    spec = sync(spec, universal(spec.alphabet))
    supervisor = synthesize([*agents, universal(spec.alphabet)], spec)
    owner = universal(Alphabet(tuple("abc")))  # of events that the specification alone knows
    local = localise([*agents, owner], supervisor)
    assert len(local) == len(agents) + 1
    assert_control_equivalent(agents, local, supervisor)
    for agent, controller in zip([*agents, owner], local, strict=True):
        for e, event in enumerate(controller.alphabet):
            if event not in agent.alphabet or event in agent.alphabet.uncontrollable:
                assert supervisor.is_empty or (controller.delta[:, e] >= 0).all()


# --- models of known size ---------------------------------------------------------------------------------

SIZES = {
    "cat_mouse": (2, [2, 2]),
    "cmt_1_1": (2, [2, 1, 1, 1, 2, 1, 1, 2, 1, 2]),
    "endangered_pedestrian": (3, [3, 3]),
    "philosophers_4": (7, [6, 6, 6, 6, 7, 7, 7, 7]),
    "philosophers_5": (9, [8, 8, 8, 8, 8, 9, 9, 9, 9, 9]),
    "radial_cluster_2": (20, [8, 5, 7, 5]),
    "radial_cluster_3": (137, [27, 15, 39, 15, 16, 13]),
    "small_factory": (3, [3, 2]),
    "tl_2_1": (6, [4, 4, 4, 4, 4]),
    "tl_2_2": (45, [20, 24, 14, 24, 14]),
    "tl_3_2": (338, [70, 28, 28, 16, 28, 28, 16]),
    "tline_5_1": (40, [16, 10, 8, 8, 9]),
    "tline_7_1": (330, [96, 30, 14, 14, 14, 14, 15]),
    "transfer_line": (8, [4, 7, 7]),
}
"""States of supreduce and localize in TCT (Wonham's own program), run as pitct 1.0.8."""

LARGE = {"philosophers_4", "philosophers_5", "radial_cluster_3", "tl_2_2", "tl_3_2", "tline_5_1", "tline_7_1"}


def load(name: str) -> tuple[list[Automaton], list[Automaton]]:
    """The plants and the specifications of a model."""
    model = json.loads((book.CASES / "models" / f"{name}.json").read_text(encoding="utf-8"))
    uncontrollable = {event for event, is_ in model["events"].items() if not is_["controllable"]}

    def read(part: dict[str, Any]) -> Automaton:
        sigma = Alphabet(tuple(part["events"]), frozenset(uncontrollable & set(part["events"])))
        shape = {key: part[key] for key in ("initial", "marked", "states")}
        return from_transitions(sigma, part["transitions"], **shape)

    return [read(part) for part in model["plants"]], [read(part) for part in model["specs"]]


@pytest.mark.parametrize("name", SIZES)
def test_as_small_as_tct(name: str) -> None:
    if not COMPILED and name in LARGE:
        pytest.skip("too many states for kernels that are not compiled")
    agents, specs = load(name)
    supervisor = synthesize(agents, specs)
    states, local_states = SIZES[name]
    small, local = reduce_supervisor(agents, supervisor), localise(agents, supervisor)
    assert small.n_states <= states
    assert sum(controller.n_states for controller in local) <= sum(local_states)
    assert_control_equivalent(agents, [small], supervisor)
    assert_control_equivalent(agents, local, supervisor)


def test_a_small_factory() -> None:
    """Wonham, Cai, chapter 3: it has to know whether the buffer is full, and whether machine 2 is down."""
    agents, specs = load("small_factory")
    small = reduce_supervisor(agents, synthesize(agents, specs))
    assert small.n_states == 3
    assert not small.accepts(["11", "10", "11"])
    assert not small.accepts(["21"])
    assert not small.accepts(["22", "13"])
    assert small.accepts(["22", "23", "13"])


# --- libFAUDES --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("batch", range(3))
def test_reduction_by_faudes(batch: int) -> None:
    ours = theirs = 0
    for plant, spec in random_pairs(batch)[: 20 if COMPILED else 3]:
        both = sync(plant, spec).alphabet
        wide = extend(plant, both, stand_still=True)
        supervisor = synthesize(wide, spec)
        if not 2 <= supervisor.automaton.n_states <= 60:
            continue
        small = reduce_supervisor(wide, supervisor)
        assert_control_equivalent([wide], [small], supervisor)
        other = from_faudes(faudes.SupReduce(to_faudes(wide), to_faudes(supervisor.automaton)), both)
        ours += small.n_states
        theirs += other.n_states
    assert ours <= theirs


# --- what is special --------------------------------------------------------------------------------------


def test_nothing_can_be_enforced() -> None:
    plant, spec = from_text("uncontrollable u \n 0 -u, a-> 0"), from_text("uncontrollable u \n initial 0")
    supervisor = synthesize(plant, spec)
    assert supervisor.is_empty
    assert reduce_supervisor(plant, supervisor).n_states == 0
    assert [local.n_states for local in localise([plant], supervisor)] == [0]


def test_nothing_has_to_be_enforced() -> None:
    plant = from_text("marked 0 \n 0 -a-> 1 \n 1 -b-> 0")
    small = reduce_supervisor(plant, synthesize(plant, universal(plant.alphabet)))
    assert (small.n_states, small.alphabet.names) == (1, ())


def test_events_that_the_specification_alone_knows_are_kept() -> None:
    plant, spec = from_text("0 -a-> 0"), from_text("0 -b-> 1 \n 1 -a-> 0")
    supervisor = synthesize(plant, spec)
    small = reduce_supervisor(plant, supervisor)
    assert set(small.alphabet) == {"a", "b"}
    assert_control_equivalent([plant], [small], supervisor)
    with pytest.raises(AutomatonError, match="disables event 'b', which none of the 1 agents controls"):
        localise([plant], supervisor)


def test_a_pre_empted_tick_is_not_the_agents_own() -> None:
    plant = from_text("uncontrollable tick \n 0 -tick-> 1 \n 1 -tick-> 2 \n 1 -go-> 3 \n 3 -tick-> 3")
    spec = from_text("uncontrollable tick \n 0 -tick-> 1 \n 1 -go-> 2 \n 2 -tick-> 2")
    supervisor = synthesize_timed(plant, spec, forcible=["go"])
    small = reduce_supervisor(plant, supervisor)
    assert small.n_states == 3
    assert_control_equivalent([plant], [small], supervisor)
    with pytest.raises(AutomatonError, match="disables event 'tick', which none"):
        localise([plant], supervisor)


def test_modular_supervisors_reduce_before_all_plants() -> None:
    machine = "marked idle \n uncontrollable end{0} \n idle -start{0}-> busy \n busy -end{0}-> idle"
    buffer = "marked empty \n uncontrollable end{0} \n empty -end{0}-> full \n full -start{1}-> empty"
    machines = [from_text(machine.format(k)) for k in range(4)]
    buffers = [from_text(buffer.format(k, k + 1)) for k in range(3)]
    found = synthesize_modular(machines, buffers)
    small = [reduce_supervisor(machines, supervisor) for supervisor in found.supervisors]
    assert [part.n_states for part in small] == [2, 2, 2]
    assert_control_equivalent(machines, small, synthesize(machines, buffers))

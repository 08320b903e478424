"""Partial observation: against the definitions, on finite languages and on states, and against libFAUDES."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from itertools import combinations

import faudes
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import book
from strategies import UNCONTROLLABLE, automata, languages, models, plants, specifications, trie
from supremal import (
    Alphabet,
    AlphabetError,
    Automaton,
    AutomatonError,
    from_text,
    from_transitions,
    is_controllable,
    is_included,
    is_nonblocking,
    is_same_language,
    mark_all,
    prefix_closure,
    sync,
    synthesize,
    trim,
)
from supremal._arrays import NONE
from supremal._jit import COMPILED
from supremal.automata.compose import components, extend
from supremal.synthesis.normal import synthesize_normal
from supremal.synthesis.observation import (
    Confusion,
    find_abnormal,
    find_unobservable,
    is_normal,
    is_observable,
    observer,
)
from test_faudes import from_faudes, lifted, random_automaton

pytestmark = pytest.mark.engine

SIGMA = ("a", "b", "u")
BATCHES = range(4)
BATCH = 15 if COMPILED else 2


def hide(automaton: Automaton, hidden: Iterable[str]) -> Automaton:
    """The same automaton, of which the ``hidden`` events are not seen."""
    sigma = automaton.alphabet
    return replace(
        automaton, alphabet=Alphabet(sigma.names, sigma.uncontrollable, frozenset(hidden) & set(sigma.names))
    )


def hidden_events(events: str = "abcuv") -> st.SearchStrategy[frozenset[str]]:
    """Events that are not seen: none up to all."""
    return st.frozensets(st.sampled_from(events))


def seen(word: book.Word, hidden: frozenset[str]) -> book.Word:
    """P(word)."""
    return tuple(event for event in word if event not in hidden)


def finite(language: Iterable[book.Word], hidden: Iterable[str]) -> Automaton:
    """The tree of a finite language over ``SIGMA``; only the words of the language are marked."""
    return hide(trie(Alphabet(SIGMA, UNCONTROLLABLE & set(SIGMA)), language), hidden)


# --- observers --------------------------------------------------------------------------------------------


def reach(
    machine: book.Machine, states: frozenset[book.State], hidden: frozenset[str]
) -> frozenset[book.State]:
    """The unobservable reach: what hidden events lead to from ``states``."""
    while True:
        wider = states | {t for (s, e), t in machine.moves.items() if s in states and e in hidden}
        if wider == states:
            return states
        states = wider


@given(automata(), hidden_events())
def test_observers_estimate_by_estimate(automaton: Automaton, hidden: frozenset[str]) -> None:
    named = replace(automaton, state_names=tuple(str(s) for s in range(automaton.n_states)))
    machine, found = book.read(automaton), observer(hide(named, hidden))
    assert found.alphabet.names == seen(automaton.alphabet.names, hidden)
    for word in book.all_words(found.alphabet.names, 3):
        states = frozenset() if machine.initial is None else frozenset({machine.initial})
        states = reach(machine, states, hidden)
        for event in word:
            moved = {t for (s, e), t in machine.moves.items() if s in states and e == event}
            states = reach(machine, frozenset(moved), hidden)
        state = found.run(word)
        assert (state == NONE) == (not states)
        if states:
            assert found.state_names[state] == f"{{{', '.join(map(str, sorted(states)))}}}"
            assert found.marked[state] == bool(states & machine.marked)


@given(automata(), hidden_events())
def test_observers_of_what_is_seen_anyway(automaton: Automaton, hidden: frozenset[str]) -> None:
    once = observer(hide(automaton, hidden))
    assert not once.alphabet.unobservable
    again = observer(once)
    assert again.delta.tolist() == once.delta.tolist()
    assert again.marked.tolist() == once.marked.tolist()


def test_the_bound_on_estimates() -> None:
    ring = hide(from_text("name ring \n 0 -a-> 1 \n 1 -a-> 2 \n 2 -a-> 3 \n 3 -b-> 0"), ["b"])
    assert observer(ring, max_states=4).n_states == 4
    with pytest.raises(
        AutomatonError, match=r"the subset automaton of ring \(4 states\) has more than 3 sets"
    ):
        observer(ring, max_states=3)


# --- observability and normality, word for word -----------------------------------------------------------


def pairs_alike(
    inner: frozenset[book.Word], outer: Iterable[book.Word], hidden: frozenset[str]
) -> list[tuple[book.Word, book.Word]]:
    return [(s, t) for s in inner for t in outer if seen(s, hidden) == seen(t, hidden)]


def unobservable(
    closure: frozenset[book.Word], plant: frozenset[book.Word], hidden: frozenset[str]
) -> set[tuple[book.Word, book.Word, str]]:
    """All violations of observability among finite languages, by its definition."""
    return {
        (s, t, event)
        for s, t in pairs_alike(closure, closure, hidden)
        for event in set(SIGMA) - UNCONTROLLABLE
        if (*s, event) in closure and (*t, event) in plant - closure
    }


def abnormal(
    closure: frozenset[book.Word], plant: frozenset[book.Word], hidden: frozenset[str]
) -> set[tuple[book.Word, book.Word]]:
    """All (s, t) with s ∈ K̄ and t ∈ L(G) \\ K̄ that look alike: K̄ ≠ P⁻¹(P(K̄)) ∩ L(G)."""
    return set(pairs_alike(closure, plant - closure, hidden))


@given(languages(max_size=6), languages(max_size=6), hidden_events("abu"))
def test_violations_word_for_word(
    paths: frozenset[book.Word], allowed: frozenset[book.Word], hidden: frozenset[str]
) -> None:
    plant, closure = book.prefixes(paths), book.prefixes(paths) & book.prefixes(allowed)
    parts = finite(paths, hidden), finite(allowed, hidden)

    wrong = unobservable(closure, plant, hidden)
    found = find_unobservable(*parts)
    assert is_observable(*parts) == (not wrong) == (found is None)
    if found is not None:
        assert (found.word, found.other, found.event) in wrong
        assert len(found.word) + len(found.other) == min(len(s) + len(t) for s, t, _ in wrong)

    odd = abnormal(closure, plant, hidden)
    pair = find_abnormal(*parts)
    assert is_normal(*parts) == (not odd) == (pair is None)
    if pair is not None:
        assert pair in odd
        assert sum(map(len, pair)) == min(len(s) + len(t) for s, t in odd)


@given(automata(), automata(), hidden_events())
def test_violations_on_cycles(plant: Automaton, spec: Automaton, hidden: frozenset[str]) -> None:
    plant, spec = hide(plant, hidden), hide(spec, hidden)
    machine, closure = book.read(plant), book.trim(book.read(spec))

    def can(word: book.Word) -> bool:
        return book.after(machine, book.project(word, machine.events)) is not None

    def allowed(word: book.Word) -> bool:
        return can(word) and book.after(closure, book.project(word, closure.events)) is not None

    found, pair = find_unobservable(plant, spec), find_abnormal(plant, spec)
    if found is not None:
        assert seen(found.word, hidden) == seen(found.other, hidden)
        assert found.event not in UNCONTROLLABLE
        assert allowed((*found.word, found.event))
        assert allowed(found.other)
        assert can((*found.other, found.event))
        assert not allowed((*found.other, found.event))
        assert pair is not None
    if pair is not None:
        inside, outside = pair
        assert seen(inside, hidden) == seen(outside, hidden)
        assert allowed(inside)
        assert can(outside)
        assert not allowed(outside)
    if is_controllable(plant, spec) and hidden <= UNCONTROLLABLE:
        assert (found is None) == (pair is None)


def test_a_confusion_in_words() -> None:
    assert str(Confusion((), ("u",), "a")) == "a is allowed after nothing and not after u, which look alike"


def test_seen_in_one_and_not_in_the_other() -> None:
    plant = from_text("0 -a-> 0")
    with pytest.raises(
        AlphabetError, match="event 'a' is observable in one automaton|'a' is unobservable in one"
    ):
        find_unobservable(plant, hide(plant, "a"))


# --- synthesis --------------------------------------------------------------------------------------------


def supremal_normal(
    words: frozenset[book.Word], plant: frozenset[book.Word], hidden: frozenset[str]
) -> frozenset[book.Word]:
    """The union of all controllable and normal sublanguages of a finite language, all 2^|K| tried."""
    found: frozenset[book.Word] = frozenset()
    for n in range(len(words) + 1):
        for chosen in combinations(sorted(words), n):
            closure = book.prefixes(chosen)
            if book.is_controllable_language(closure, plant, {"u"}) and not abnormal(closure, plant, hidden):
                found |= frozenset(chosen)
    return found


@given(languages(), languages(max_size=6), languages(max_size=5), hidden_events("abu"))
def test_the_union_of_all_controllable_normal_sublanguages(
    paths: frozenset[book.Word],
    ends: frozenset[book.Word],
    allowed: frozenset[book.Word],
    hidden: frozenset[str],
) -> None:
    possible = book.prefixes(paths | ends)
    plant = finite(possible, hidden)
    marked = [name in {"".join(word) or "ε" for word in ends} for name in plant.state_names]
    found = synthesize_normal(replace(plant, marked=np.array(marked, np.bool_)), finite(allowed, hidden))
    expected = supremal_normal(ends & allowed, possible, hidden)
    assert book.marked_words(book.read(found.automaton), 3) == expected
    assert book.generated(book.read(found.automaton), 3) == book.prefixes(expected)


@given(languages(max_size=6), languages(max_size=3, max_length=2), hidden_events("abu"))
def test_the_union_of_all_closed_ones(
    paths: frozenset[book.Word], allowed: frozenset[book.Word], hidden: frozenset[str]
) -> None:
    found = synthesize_normal(finite(paths, hidden), finite(allowed, hidden), nonblocking=False)
    both = book.prefixes(paths) & book.prefixes(allowed)
    expected = supremal_normal(both, book.prefixes(paths), hidden)
    assert book.generated(book.read(found.automaton), 3) == expected


@pytest.mark.parametrize("nonblocking", [True, False])
@settings(max_examples=50)
@given(model=models(), hidden=hidden_events())
def test_what_a_supervisor_that_sees_little_promises(
    model: tuple[Automaton, Automaton], hidden: frozenset[str], *, nonblocking: bool
) -> None:
    plant, spec = (hide(part, hidden) for part in model)
    supervisor = synthesize_normal(plant, spec, nonblocking=nonblocking)
    behaviour = supervisor.automaton
    words = behaviour if nonblocking else mark_all(behaviour)
    assert is_included(behaviour, synthesize(plant, spec, nonblocking=nonblocking).automaton)
    assert is_controllable(plant, words)
    assert is_normal(plant, words)
    assert is_observable(plant, words)
    assert not nonblocking or is_nonblocking(behaviour)
    assert behaviour.origin.shape == (behaviour.n_states, 2)
    assert supervisor.plant_state.tolist() == behaviour.origin[:, :1].tolist()
    for q, x in components(plant, behaviour)[1]:
        assert supervisor.plant_state[x] == [q]
    # Its observer is a supervisor that sees only what is seen, and keeps the very same behaviour.
    run = sync(extend(plant, behaviour.alphabet, stand_still=True), observer(behaviour))
    assert is_same_language(mark_all(run), mark_all(behaviour))


@settings(max_examples=50)
@given(models(), hidden_events())
def test_control_depends_on_what_is_seen(model: tuple[Automaton, Automaton], hidden: frozenset[str]) -> None:
    supervisor = synthesize_normal(*(hide(part, hidden) for part in model), nonblocking=False)
    behaviour = supervisor.automaton
    pattern: dict[book.Word, list[bool]] = {}
    machine = book.read(behaviour)
    for word in book.generated(machine, 3):
        enabled = supervisor.enabled[behaviour.run(word)]
        assert (enabled | (behaviour.delta[behaviour.run(word)] == NONE)).all()
        assert pattern.setdefault(seen(word, hidden), enabled.tolist()) == enabled.tolist()
        for e, event in enumerate(behaviour.alphabet):
            assert enabled[e] or event not in UNCONTROLLABLE | hidden


@pytest.mark.parametrize("nonblocking", [True, False])
@settings(max_examples=50)
@given(model=models())
def test_nothing_hidden_is_ordinary_synthesis(
    model: tuple[Automaton, Automaton], *, nonblocking: bool
) -> None:
    ours = synthesize_normal(*model, nonblocking=nonblocking)
    plain = synthesize(*model, nonblocking=nonblocking)
    assert is_same_language(ours.automaton, plain.automaton)
    assert is_same_language(mark_all(ours.automaton), mark_all(plain.automaton))
    patterns = [
        {tuple(pair): row for pair, row in zip(s.automaton.origin.tolist(), s.enabled.tolist(), strict=True)}
        for s in (ours, plain)
    ]
    assert patterns[0] == patterns[1]


@settings(max_examples=50)
@given(plants(3), automata(max_states=3), specifications(3), hidden_events())
def test_several_parts(one: Automaton, two: Automaton, spec: Automaton, hidden: frozenset[str]) -> None:
    parts = [hide(part, hidden) for part in (one, two, spec)]
    several, single = synthesize_normal(parts[:2], parts[2:]), synthesize_normal(sync(*parts[:2]), parts[2])
    assert is_same_language(several.automaton, single.automaton)
    assert is_normal(parts[:2], parts[2:]) == is_normal(sync(*parts[:2]), parts[2])
    assert is_observable(parts[:2], parts[2:]) == is_observable(sync(*parts[:2]), parts[2])
    assert several.plant_state.shape == (several.automaton.n_states, 2)


def test_an_alarm_that_nobody_hears() -> None:
    """The supervisor cannot tell whether the tank leaks, so it does not fill it a second time."""
    sigma = Alphabet(("fill", "leak", "drain"), frozenset({"leak"}), frozenset({"leak"}))
    tank = from_transitions(
        sigma,
        [
            ("empty", "fill", "full"),
            ("full", "leak", "low"),
            ("full", "drain", "empty"),
            ("low", "drain", "empty"),
            ("low", "fill", "full"),
            ("full", "fill", "spilt"),
        ],
        marked=["empty"],
    )
    dry = from_transitions(
        sigma, [("ok", "fill", "up"), ("up", "leak", "ok2"), ("up", "drain", "ok"), ("ok2", "drain", "ok"),
                ("ok2", "fill", "up")], marked=["ok"],
    )  # fmt: skip
    assert synthesize(tank, dry).automaton.n_transitions == 5
    found = synthesize_normal(tank, dry)
    assert (found.automaton.n_states, found.automaton.n_transitions) == (3, 4)
    assert find_unobservable(tank, dry) == Confusion(("fill", "leak"), ("fill",), "fill")
    assert observer(found.automaton).n_states == 2
    assert synthesize_normal(hide(tank, ()), hide(dry, ())).automaton.n_transitions == 5


# --- libFAUDES --------------------------------------------------------------------------------------------


def random_task(rng: np.random.Generator) -> tuple[Automaton, Automaton]:
    """A plant and a specification, of at most 9 states, of which up to two events are not seen."""
    hidden = rng.permutation(["a", "b", "c", "u", "v"])[: rng.integers(0, 3)].tolist()
    while True:
        plant, spec = random_automaton(rng, 0.6, 0.3), random_automaton(rng, 0.85, 0.97)
        if max(plant.n_states, spec.n_states) <= 9:
            return hide(plant, hidden), hide(spec, hidden)


def blind(automaton: Automaton, alphabet: Alphabet) -> faudes.System:
    """Hand an automaton over, lifted to ``alphabet``, with what is not seen."""
    system = lifted(automaton, alphabet)
    for name in alphabet:
        (system.ClrObservable if name in alphabet.unobservable else system.SetObservable)(name)
    return system


@pytest.mark.parametrize("batch", BATCHES)
def test_normal_by_faudes(batch: int) -> None:
    rng, kinds = np.random.default_rng(batch), Counter[str]()
    for _ in range(BATCH):
        plant, spec = random_task(rng)
        both = sync(plant, spec)
        system, generator = blind(plant, both.alphabet), blind(spec, both.alphabet)
        closed = synthesize_normal(plant, spec, nonblocking=False).automaton
        theirs = from_faudes(faudes.SupConNormClosed(system, generator), both.alphabet)
        assert is_same_language(mark_all(closed), mark_all(theirs))
        found = synthesize_normal(plant, spec).automaton
        theirs = from_faudes(faudes.SupConNorm(system, generator), both.alphabet)
        assert is_included(found, theirs)
        # Theirs goes round once; where that is not enough it is not yet controllable or not yet normal.
        done = is_controllable(plant, theirs) and is_normal(plant, theirs)
        assert is_same_language(found, theirs) == done
        kinds["whole" if done and found.n_states else "empty" if done else "unfinished"] += 1

        closure = prefix_closure(both)
        whole = blind(mark_all(plant), both.alphabet)
        assert is_normal(plant, closure) == faudes.IsNormal(whole, blind(closure, both.alphabet))
        shown = faudes.Project(blind(trim(both), both.alphabet), whole.ObservableEvents())
        assert is_same_language(observer(both), from_faudes(shown, observer(both).alphabet))
    assert not COMPILED or kinds["whole"] >= BATCH // 4, kinds

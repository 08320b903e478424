"""What can happen: alphabets, automata, products and languages, against the definitions of the book."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import FrozenInstanceError
from itertools import product
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

import book
import supremal
from strategies import alphabets, automata, words
from supremal import (
    Alphabet,
    AlphabetError,
    Automaton,
    AutomatonError,
    FormatError,
    complement,
    coreachable,
    find_difference,
    find_not_included,
    from_table,
    from_text,
    from_transitions,
    is_included,
    is_same_language,
    mark_all,
    prefix_closure,
    reachable,
    sync,
    trim,
    universal,
)
from supremal.automata import explore
from supremal.automata.alphabet import union
from supremal.automata.build import empty
from supremal.automata.compose import components, extend
from supremal.automata.reduce import complete, determinise, keep

pytestmark = pytest.mark.engine

LENGTH = 4
AB = Alphabet(("a", "b"))


def assert_same(product_: Automaton, machine: book.Machine) -> None:
    """The product is the book's, state by state: ``origin`` tells which is which."""
    name = [tuple(row) for row in product_.origin.tolist()]
    ours = book.read(product_)
    assert {(name[s], e): name[t] for (s, e), t in ours.moves.items()} == machine.moves
    assert frozenset(name) == machine.states
    assert len(name) == len(machine.states)
    assert frozenset(name[s] for s in ours.marked) == machine.marked
    assert (ours.initial is None) == (machine.initial is None)
    assert not name or name[0] == machine.initial


def assert_equal(one: Automaton, two: Automaton) -> None:
    """All that two automata hold is equal."""
    assert one.alphabet == two.alphabet
    assert one.delta.tolist() == two.delta.tolist()
    assert one.marked.tolist() == two.marked.tolist()
    assert one.origin.tolist() == two.origin.tolist()


# --- alphabets --------------------------------------------------------------------------------------------


def test_an_alphabet_is_a_value() -> None:
    sigma = Alphabet(("a", "u"), uncontrollable=frozenset({"u"}))
    assert sigma == Alphabet(("a", "u"), frozenset({"u"}))
    assert hash(sigma) == hash(Alphabet(("a", "u"), frozenset({"u"})))
    assert sigma != Alphabet(("u", "a"), frozenset({"u"}))
    assert sigma != Alphabet(("a", "u"))
    assert (len(sigma), list(sigma), "a" in sigma, "b" in sigma) == (2, ["a", "u"], True, False)
    assert sigma.spell([1, 0, 1]) == ("u", "a", "u")
    with pytest.raises(FrozenInstanceError):
        sigma.names = ("b",)


@settings(max_examples=50)
@given(alphabets(), alphabets(), alphabets())
def test_union_keeps_the_order_of_first_appearance(a: Alphabet, b: Alphabet, c: Alphabet) -> None:
    merged = union(a, b, c)
    assert merged.names == tuple(dict.fromkeys([*a, *b, *c]))
    assert merged.uncontrollable == a.uncontrollable | b.uncontrollable | c.uncontrollable
    assert union(union(a, b), c) == merged == union(merged, a)


@pytest.mark.parametrize(
    ("names", "uncontrollable", "says"),
    [
        pytest.param(("go", ""), (), "event '' is no name", id="empty"),
        pytest.param(
            ("go on",), (), "event 'go on' is no name: a non-empty string without", id="white space"
        ),
        pytest.param((1,), (), "event 1 is no name", id="number"),
        pytest.param(("a", "b", "a"), (), "event 'a' stands twice", id="twice"),
        pytest.param(
            ("start", "stop"), ("strat",), "unknown event 'strat'; did you mean 'start'?", id="unknown"
        ),
    ],
)
def test_bad_alphabets(names: tuple[Any, ...], uncontrollable: tuple[str, ...], says: str) -> None:
    with pytest.raises(AlphabetError) as error:
        Alphabet(names, frozenset(uncontrollable))
    assert says in str(error.value)


@pytest.mark.parametrize("verb", [sync, find_not_included, find_difference])
def test_an_event_is_controllable_everywhere_or_nowhere(
    verb: Callable[[Automaton, Automaton], object],
) -> None:
    here, there = from_text("0 -drop-> 0"), from_text("uncontrollable drop \n 0 -drop-> 0")
    with pytest.raises(
        AlphabetError, match="event 'drop' is uncontrollable in one automaton and controllable in"
    ):
        verb(here, there)


# --- automata as values -----------------------------------------------------------------------------------


def test_later_writes_to_the_arrays_do_not_show() -> None:
    delta, marked, origin = np.array([[0, -1]], np.int32), np.array([True]), np.array([[7]], np.int32)
    automaton = Automaton(AB, delta, marked, origin)
    delta[:], marked[:], origin[:] = -1, False, 8
    assert automaton.delta.tolist() == [[0, -1]]
    assert automaton.marked.tolist() == [True]
    assert automaton.origin.tolist() == [[7]]


def test_later_writes_through_a_view_do_not_show() -> None:
    base = np.zeros((2, 2), np.int32)
    window = base[:1]
    window.flags.writeable = False
    automaton = Automaton(AB, window, [True])
    base[:] = -1
    assert automaton.delta.tolist() == [[0, 0]]


def test_the_arrays_of_an_automaton_are_read_only() -> None:
    automaton = Automaton(AB, np.zeros((1, 2), np.int32), np.ones(1, np.bool_))
    for array in (automaton.delta, automaton.marked, automaton.origin):
        assert array.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(FrozenInstanceError):
        automaton.marked = np.zeros(1, np.bool_)


def test_two_automata_are_equal_only_when_they_are_one() -> None:
    assert universal(AB) != universal(AB)
    assert is_same_language(universal(AB), universal(AB))


@given(automata(), st.data())
def test_run_is_the_transition_function_of_words(automaton: Automaton, data: st.DataObject) -> None:
    assume(len(automaton.alphabet))
    word = tuple(data.draw(words("".join(automaton.alphabet.names))))
    reached = book.after(book.read(automaton), word)
    assert automaton.run(word) == (-1 if reached is None else reached)
    assert automaton.accepts(word) == (reached in book.read(automaton).marked)


@pytest.mark.parametrize("word", [["a", "lft"], ["b", "lft"]])
def test_a_word_with_an_unknown_event_is_an_error(word: list[str]) -> None:
    with pytest.raises(AlphabetError, match="unknown event 'lft'; did you mean 'left'"):
        from_text("events b \n 0 -a, left-> 0").run(word)


@pytest.mark.parametrize(
    ("delta", "marked", "names", "says"),
    [
        pytest.param([[0]], [True], (), "delta has shape (1, 1), (1, 2) is needed", id="events"),
        pytest.param([[0, 0]], [True, True], (), "marked has shape (2,), (1,) is needed", id="marked"),
        pytest.param([[0, 0]], [True], ("x", "y"), "state_names has shape (2,), (1,) is needed", id="names"),
        pytest.param([0, 0], [True], (), "an array of 2 dimension(s) is needed", id="dimensions"),
        pytest.param(
            [[0, 1]], [True], (), "event 'b' leads from state 0 to 1; a state from 0 to 0", id="outside"
        ),
        pytest.param(
            [[-2, 0]], [True], (), "event 'a' leads from state 0 to -2; a state from 0", id="negative"
        ),
    ],
)
def test_bad_arrays(delta: list[Any], marked: list[bool], names: tuple[str, ...], says: str) -> None:
    with pytest.raises(AutomatonError) as error:
        Automaton(AB, delta, marked, state_names=names, name="lift")
    assert says in str(error.value)
    assert "'lift'" in str(error.value)


# --- writing automata down --------------------------------------------------------------------------------


def test_three_ways_to_write_one_automaton() -> None:
    sigma = Alphabet(("start", "finish"), frozenset({"finish"}))
    arrows = from_transitions(
        sigma, [("I", "start", "W"), ("W", "finish", "I")], marked=["I"], name="machine"
    )
    table = from_table(sigma, {"I": {"start": "W"}, "W": {"finish": "I"}}, marked=["I"], name="machine")
    text = from_text("""
        name machine            # a comment
        uncontrollable finish
        marked I

        I -start-> W
        W - finish -> I
    """)
    for automaton in (arrows, table, text):
        assert automaton.alphabet == sigma
        assert automaton.state_names == ("I", "W")
        assert automaton.name == "machine"
        assert automaton.delta.tolist() == [[1, -1], [-1, 0]]
        assert automaton.marked.tolist() == [True, False]


def test_a_text_settles_initial_state_events_and_order() -> None:
    automaton = from_text("events c, b \n initial 1 \n uncontrollable u \n 0 -a, b-> 1 \n 1 -a c-> 0")
    assert automaton.alphabet == Alphabet(("c", "b", "a", "u"), frozenset({"u"}))
    assert automaton.state_names == ("1", "0")
    assert automaton.marked.all()
    given_outside = from_text("0 -a-> 1", alphabet=AB)
    assert given_outside.alphabet is AB


def test_a_text_without_arrows() -> None:
    assert from_text("events a, b").n_states == 0
    alone = from_text("initial idle \n events a")
    assert (alone.n_states, alone.n_transitions, alone.state_names) == (1, 0, ("idle",))


@pytest.mark.parametrize("case", book.named(book.table("bad_texts")))
def test_bad_texts(case: dict[str, Any]) -> None:
    with pytest.raises(getattr(supremal, case["error"])) as error:
        from_text(case["text"], path="lift.txt")
    assert str(error.value).startswith("lift.txt")
    assert all(part in str(error.value) for part in case["says"])
    if isinstance(error.value, FormatError):
        assert error.value.path == "lift.txt"
        assert (error.value.line, error.value.column) == (case.get("line", 0), case.get("column", 0))


@pytest.mark.parametrize(
    ("build", "error", "says"),
    [
        pytest.param(
            lambda: from_table(AB, {"0": {"a": ["1", "2"]}}, name="lift"),
            AutomatonError,
            "'lift' is not deterministic: event 'a' leads from state '0' to both '1' and '2'; keep one",
            id="table not deterministic",
        ),
        pytest.param(
            lambda: from_table(AB, {"idle": {"a": "idle"}}, initial="idel", name="lift"),
            AutomatonError,
            "'lift': the initial state is 'idel', which is unknown; did you mean 'idle'?",
            id="initial state unknown",
        ),
        pytest.param(
            lambda: from_transitions(AB, [("0", "a", "1")], marked=["2"]),
            AutomatonError,
            "a marked state is '2', which is unknown; known: 0, 1",
            id="marked state unknown",
        ),
        pytest.param(
            lambda: from_transitions(AB, [("0", "c", "1")]),
            AlphabetError,
            "unknown event 'c'; known: a, b",
            id="event",
        ),
        pytest.param(
            lambda: from_text("0 -c-> 1", alphabet=AB, path="lift.txt"),
            AlphabetError,
            "lift.txt: unknown event 'c'; known: a, b",
            id="event in a text",
        ),
    ],
)
def test_bad_transitions(build: Callable[[], Automaton], error: type[Exception], says: str) -> None:
    with pytest.raises(error) as caught:
        build()
    assert says in str(caught.value)


def test_a_transition_may_stand_twice() -> None:
    assert from_transitions(AB, [("0", "a", "1"), ("0", "a", "1")]).n_transitions == 1


# --- products ---------------------------------------------------------------------------------------------


@given(automata(), automata())
def test_sync_of_languages(a: Automaton, b: Automaton) -> None:
    both = book.read(sync(a, b))
    one, two = book.read(a), book.read(b)
    for language in (book.generated, book.marked_words):
        in_one, in_two = language(one, LENGTH), language(two, LENGTH)
        expected = {
            word
            for word in book.all_words(one.events | two.events, LENGTH)
            if book.project(word, one.events) in in_one and book.project(word, two.events) in in_two
        }
        assert book.apart(language(both, LENGTH), expected) is None


@given(st.lists(automata(max_states=3), min_size=1, max_size=3))
def test_sync_state_by_state(parts: list[Automaton]) -> None:
    assert_same(sync(*parts), book.sync(*map(book.read, parts)))


@given(st.lists(automata(max_states=3), min_size=2, max_size=3))
def test_sync_numbers_its_states_breadth_first(parts: list[Automaton]) -> None:
    both = sync(*parts)
    assert list(dict.fromkeys([0] * bool(both.n_states) + both.delta[both.delta >= 0].tolist())) == list(
        range(both.n_states)
    )


@settings(max_examples=50)
@given(automata(max_states=3), automata(max_states=3), automata(max_states=3))
def test_sync_does_not_mind_brackets(a: Automaton, b: Automaton, c: Automaton) -> None:
    assert_equal(sync(sync(a, b), c), sync(a, b, c))
    assert_equal(sync(a, sync(b, c)), sync(a, b, c))
    assert is_same_language(sync(a, b), sync(b, a))
    assert_equal(sync(sync(), a), sync(a))


def test_sync_of_none_is_neutral() -> None:
    none = sync()
    assert (none.n_states, len(none.alphabet), none.accepts([])) == (1, 0, True)
    assert none.origin.shape == (1, 0)


@settings(max_examples=50)
@given(automata(), automata())
def test_sync_with_itself_and_with_everything(a: Automaton, b: Automaton) -> None:
    assert is_same_language(sync(a, a), a)
    assert is_same_language(sync(a, universal(a.alphabet)), a)
    assert is_same_language(sync(a, universal(b.alphabet)), extend(a, b.alphabet, stand_still=True))
    assert sync(a, empty(b.alphabet)).n_states == 0


@given(st.lists(automata(max_states=3), min_size=1, max_size=3))
def test_hashed_product_is_the_direct_one(parts: list[Automaton]) -> None:
    direct = sync(*parts)
    with patch.object(explore, "_DIRECT", 0):
        assert_equal(sync(*parts), direct)


@settings(max_examples=50)
@given(st.lists(automata(min_states=1, max_states=3), min_size=3, max_size=4))
def test_wide_product_is_the_direct_one(parts: list[Automaton]) -> None:
    direct = sync(*parts)
    with patch.object(explore, "_DIRECT", 0), patch.object(explore, "_BITS", 3):  # a key of several integers
        assert_equal(sync(*parts), direct)


def test_more_parts_than_an_integer_has_bits() -> None:
    """70 switches that turn at once, two of which turn alone too: 2^70 combinations, of which few occur."""
    together = [from_text(f"{k} -turn-> x{k} \n x{k} -turn-> {k}") for k in range(68)]
    alone = [from_text(f"0 -turn, {name}-> 1 \n 1 -turn, {name}-> 0") for name in ("first", "last")]
    both = sync(alone[0], *together, alone[1])
    assert both.n_states == 8
    assert {tuple(row) for row in both.origin.tolist()} == {
        (first, *[common] * 68, last) for first, common, last in product(range(2), repeat=3)
    }
    assert both.delta.tolist() == sync(alone[0], together[0], alone[1]).delta.tolist()


@pytest.mark.parametrize("events", [61, 62, 63, 124, 125, 200])
def test_more_events_than_an_integer_has_bits(events: int) -> None:
    """A key with many buttons and a lock that knows every third one, in another order."""
    buttons = Alphabet(tuple(f"e{k}" for k in range(events)))
    third = Alphabet(tuple(f"e{k}" for k in reversed(range(0, events, 3))))
    key = Automaton(
        buttons, [[k % 2 for k in range(events)], [-1 if k % 5 else 0 for k in range(events)]], [True] * 2
    )
    lock = Automaton(third, [[(k % 4) - 1 for k in range(len(third))] for _ in range(3)], [True] * 3)
    assert_same(sync(key, lock), book.sync(book.read(key), book.read(lock)))


@pytest.mark.parametrize("table", ["direct", "hashed", "wide"])
def test_a_large_product(table: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A torus: two rings side by side, large enough for every table to grow."""
    monkeypatch.setattr(explore, "_ROOM", 1)
    if table != "direct":
        monkeypatch.setattr(explore, "_DIRECT", 0)
    if table == "wide":
        monkeypatch.setattr(explore, "_BITS", 7)  # an integer for each ring
    size = 91
    rings = [
        Automaton(Alphabet((event,)), [[(n + 1) % size] for n in range(size)], [n == 0 for n in range(size)])
        for event in ("a", "b")
    ]
    torus = sync(*rings)
    assert {tuple(row) for row in torus.origin.tolist()} == set(product(range(size), repeat=2))
    for e, step in enumerate([(1, 0), (0, 1)]):
        assert (torus.origin[torus.delta[:, e]] == (torus.origin + step) % size).all()
    assert np.flatnonzero(torus.marked).tolist() == [0]
    assert find_not_included(torus, universal(torus.alphabet)) is None


@pytest.mark.parametrize("table", ["direct", "hashed"])
def test_the_bound_on_states(table: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if table == "hashed":
        monkeypatch.setattr(explore, "_DIRECT", 0)
    ring = from_text("name ring \n 0 -a-> 1 \n 1 -a-> 2 \n 2 -a-> 0")
    switch = from_text("0 -b-> 1 \n 1 -b-> 0")
    assert sync(ring, switch, max_states=6).n_states == 6
    for bound in (5, 1):
        with pytest.raises(AutomatonError) as error:
            sync(ring, switch, max_states=bound)
        assert f"the product of ring (3), part 1 (2) states has more than {bound}" in str(error.value)
        assert "raise max_states" in str(error.value)


@pytest.mark.parametrize("stand_still", [True, False])
@given(automaton=automata(), alphabet=alphabets())
def test_extend(automaton: Automaton, alphabet: Alphabet, *, stand_still: bool) -> None:
    wide, narrow = book.read(extend(automaton, alphabet, stand_still=stand_still)), book.read(automaton)
    known = book.generated(narrow, LENGTH)
    assert wide.events == narrow.events | set(alphabet)
    expected = {
        word
        for word in book.all_words(wide.events, LENGTH)
        if (book.project(word, narrow.events) if stand_still else word) in known
    }
    assert book.apart(book.generated(wide, LENGTH), expected) is None


# --- parts of an automaton --------------------------------------------------------------------------------


@given(automata(max_states=6))
def test_reachable_and_coreachable(automaton: Automaton) -> None:
    machine = book.read(automaton)
    assert frozenset(np.flatnonzero(reachable(automaton)).tolist()) == book.accessible(machine)
    assert frozenset(np.flatnonzero(coreachable(automaton)).tolist()) == book.coaccessible(machine)


@given(automata(max_states=6))
def test_trim(automaton: Automaton) -> None:
    assert_same(trim(automaton), _with_tuples(book.trim(book.read(automaton))))
    before, after = (book.marked_words(book.read(each), LENGTH) for each in (automaton, trim(automaton)))
    assert book.apart(before, after) is None


@given(automata(max_states=6), st.data())
def test_keep(automaton: Automaton, data: st.DataObject) -> None:
    mask = data.draw(st.lists(st.booleans(), min_size=automaton.n_states, max_size=automaton.n_states))
    states = frozenset(s for s, kept in enumerate(mask) if kept)
    kept = keep(automaton, np.array(mask, np.bool_))
    assert_same(kept, _with_tuples(book.restrict(book.read(automaton), states)))


def _with_tuples(machine: book.Machine) -> book.Machine:
    """Write state s as (s,), as ``origin`` does."""
    return book.Machine(
        machine.events,
        machine.uncontrollable,
        frozenset((s,) for s in machine.states),
        {((s,), e): (to,) for (s, e), to in machine.moves.items()},
        None if machine.initial is None else (machine.initial,),
        frozenset((s,) for s in machine.marked),
    )


def test_what_is_kept_keeps_names_and_origin() -> None:
    both = sync(from_text("0 -a-> 1 \n 1 -b-> 0"), from_text("0 -a-> 1 \n 1 -c-> 1"))
    assert trim(both).origin.tolist() == both.origin.tolist()
    assert keep(both, np.zeros(both.n_states, np.bool_)).origin.shape == (0, 2)
    named = keep(from_text("idle -a-> busy \n busy -b-> down"), np.array([True, True, False]))
    assert named.state_names == ("idle", "busy")


@given(automata(max_events=2))
def test_prefix_closure(automaton: Automaton) -> None:
    # With four states a marked one is at most three events away, or none can be reached.
    closed = book.prefixes(book.marked_words(book.read(automaton), LENGTH + 3))
    ours = book.read(prefix_closure(automaton))
    marked = book.marked_words(ours, LENGTH)
    assert book.apart(marked, {word for word in closed if len(word) <= LENGTH}) is None
    assert book.apart(marked, book.generated(ours, LENGTH)) is None


@given(automata())
def test_complement_and_completion(automaton: Automaton) -> None:
    machine, everything = book.read(automaton), set(book.all_words(automaton.alphabet, LENGTH))
    marked, generated = book.marked_words(machine, LENGTH), book.generated(machine, LENGTH)
    for changed, expected in (
        (complement(automaton), everything - marked),
        (complete(automaton), marked),
        (complete(automaton, marked=True), marked | (everything - generated)),
        (mark_all(automaton), generated),
    ):
        assert book.apart(book.marked_words(book.read(changed), LENGTH), expected) is None
    total = complete(automaton)
    assert total.n_states == automaton.n_states + 1
    assert (total.delta >= 0).all()


def test_the_trap_has_a_name_of_its_own() -> None:
    assert complete(from_text("0 -a-> trap \n 0 -b-> trap'")).state_names == ("0", "trap", "trap'", "trap''")


NUMBERS = st.integers(0, 3)


@given(
    moves=st.lists(st.tuples(NUMBERS, st.integers(-1, 1), NUMBERS), max_size=10),
    initial=st.frozensets(NUMBERS, max_size=2),
    marked=st.frozensets(NUMBERS),
)
@example(
    moves=[(0, -1, 1), (1, -1, 2), (2, -1, 0), (2, 0, 3), (3, -1, 1)],
    initial=frozenset({0}),
    marked=frozenset({2}),
)
def test_determinise(
    moves: list[tuple[int, int, int]], initial: frozenset[int], marked: frozenset[int]
) -> None:
    found = determinise(AB, moves, initial, marked)

    def silently(reached: frozenset[int]) -> frozenset[int]:
        for _ in range(4):
            reached |= {t for s, e, t in moves if e == -1 and s in reached}
        return reached

    for word in book.all_words(AB, LENGTH):
        reached = silently(initial)
        for name in word:
            reached = silently(frozenset(t for s, e, t in moves if e == AB.index(name) and s in reached))
        assert found.accepts(word) == bool(reached & marked)
        assert not reached or found.run(word) != -1


@pytest.mark.parametrize("n", [1, 2, 5])
def test_determinise_can_need_all_subsets(n: int) -> None:
    """The n-th event from the end is an a: 2^n states (Hopcroft, Motwani, Ullman, section 2.3.6)."""
    guess = [(0, 0, 0), (0, 1, 0), (0, 0, 1)]
    moves = guess + [(s, e, s + 1) for s in range(1, n) for e in (0, 1)]
    assert determinise(AB, moves, [0], [n]).n_states == 2**n


# --- comparing --------------------------------------------------------------------------------------------


@given(automata(max_states=3), automata(max_states=3))
def test_find_not_included_is_a_shortest_witness(inner: Automaton, outer: Automaton) -> None:
    one, two = book.read(inner), book.read(outer)
    events = one.events | two.events
    pairs = book.sync(book.completed(one, events), book.completed(two, events))
    wrong = frozenset(pair for pair in pairs.states if pair[0] in one.marked and pair[1] not in two.marked)
    witness = find_not_included(inner, outer)
    assert (None if witness is None else len(witness)) == book.distance(pairs, wrong)
    assert is_included(inner, outer) == (witness is None)
    if witness is not None:
        assert book.after(one, witness) in one.marked
        assert book.after(two, witness) not in two.marked


@given(automata(max_states=3, max_events=2), automata(max_states=3, max_events=2))
def test_comparison_word_for_word(a: Automaton, b: Automaton) -> None:
    one, two = book.marked_words(book.read(a), LENGTH), book.marked_words(book.read(b), LENGTH)
    missing = {word for word in one if word not in two}
    witness = find_not_included(a, b)
    assert min(map(len, missing), default=None) == (len(witness) if witness in missing else None)
    difference = find_difference(a, b)
    apart = one ^ two
    assert min(map(len, apart), default=None) == (len(difference) if difference in apart else None)
    assert is_same_language(a, b) == (difference is None)


@settings(max_examples=50)
@given(automata(max_states=3), automata(max_states=3))
def test_laws_of_inclusion(a: Automaton, b: Automaton) -> None:
    assert is_included(sync(a, b), extend(a, b.alphabet, stand_still=True))
    assert is_included(a, prefix_closure(a))
    assert is_included(prefix_closure(a), mark_all(a))
    assert is_same_language(complement(complement(a)), a)
    wide = extend(a, b.alphabet, stand_still=False)
    assert is_included(a, b) == (
        not trim(sync(wide, complement(extend(b, a.alphabet, stand_still=False)))).n_states
    )


def test_components_of_parts_that_are_products() -> None:
    left = sync(from_text("0 -a-> 1"), from_text("0 -a-> 1 \n 1 -b-> 0"))
    both, states = components(left, from_text("0 -b-> 1"))
    assert states.shape == (both.n_states, 2)
    assert sync(left, from_text("0 -b-> 1")).origin.shape == (both.n_states, 3)

"""Hypothesis strategies that the test modules share: alphabets, automata, words, languages, formulas.

Events ``a b c`` are controllable, ``u v`` are not, everywhere; so any two automata drawn here fit together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np
from hypothesis import strategies as st

from supremal import Alphabet, Automaton, from_transitions

UNCONTROLLABLE = frozenset("uv")
SEEDS = st.integers(0, 2**32 - 1)


def alphabets(*, events: str = "abuv", min_size: int = 0, max_size: int = 3) -> st.SearchStrategy[Alphabet]:
    """Some of ``events``, in any order."""
    orders = [names for size in range(min_size, max_size + 1) for names in permutations(events, size)]
    return st.sampled_from([Alphabet(names, UNCONTROLLABLE & set(names)) for names in orders])


@st.composite
def automata(
    draw: st.DrawFn,
    *,
    events: str = "abuv",
    min_events: int = 0,
    max_events: int = 3,
    min_states: int = 0,
    max_states: int = 4,
    missing: float = 0.3,
    missing_uncontrollable: float = 0.3,
    marked: float = 0.5,
) -> Automaton:
    """Any automaton: partial, with unreachable and blocking states, any states marked; even the empty one.

    ``missing`` is the share of transitions that are not there, ``marked`` that of marked states.  Automata
    come from a seed: where Hypothesis draws their parts one by one, it favours zeros, and the product of two
    nearly always has one state or none.
    """
    rng = np.random.default_rng(draw(SEEDS))
    size = int(rng.choice([max_events, rng.integers(min_events, max_events + 1)]))
    names = rng.permutation(list(events))[:size].tolist()
    size = len(names)
    states = int(rng.choice([max_states] * 3 + [rng.integers(min_states, max_states + 1)]))
    alphabet = Alphabet(tuple(names), UNCONTROLLABLE & set(names))
    share = np.where(alphabet.controllable, missing, missing_uncontrollable)
    targets = rng.integers(0, max(states, 1), (states, size))
    delta = np.where(rng.random((states, size)) < share, -1, targets)
    return Automaton(alphabet, delta, rng.random(states) < marked)


def plants(max_states: int = 5) -> st.SearchStrategy[Automaton]:
    """Automata that go with `specifications`: with one in five, a part and not all can be enforced."""
    return automata(
        events="abcu",
        min_events=2,
        max_events=4,
        max_states=max_states,
        missing=0.4,
        missing_uncontrollable=0.6,
    )


def specifications(max_states: int = 4) -> st.SearchStrategy[Automaton]:
    """Automata that rarely forbid what cannot be controlled, so that something can be enforced."""
    return automata(
        events="abcu",
        min_events=2,
        max_events=4,
        max_states=max_states,
        missing=0.2,
        missing_uncontrollable=0.15,
    )


def models() -> st.SearchStrategy[tuple[Automaton, Automaton]]:
    """Plants and specifications: some that fit each other, some of any kind."""
    return st.tuples(plants(), specifications()) | st.tuples(automata(), automata())


@st.composite
def unsafe_sequences(draw: st.DrawFn) -> Automaton:
    """An automaton that marks unsafe sequences: not the empty one."""
    found = draw(automata(min_events=1))
    marked = found.marked.copy()
    marked[:1] = False
    return replace(found, marked=marked)


def trie(
    alphabet: Alphabet, language: Iterable[Iterable[str]], *, unmarked: Iterable[str] = (), name: str = ""
) -> Automaton:
    """The tree of a finite language: a state for every prefix; those of ``unmarked`` words are not marked."""
    listed = {tuple(word) for word in language}
    path = {word[:n]: "".join(word[:n]) or "ε" for word in listed for n in range(len(word) + 1)}
    arrows = [(path[word[:-1]], word[-1], path[word]) for word in sorted(path) if word]
    states = [path[word] for word in sorted(path)]
    marked = [path[word] for word in sorted(listed - {tuple(word) for word in unmarked})]
    return from_transitions(alphabet, arrows, states=states, marked=marked, name=name)


def words(events: str = "abuv", max_size: int = 6) -> st.SearchStrategy[list[str]]:
    """Words over ``events``."""
    return st.lists(st.sampled_from(events), max_size=max_size)


@st.composite
def languages(
    draw: st.DrawFn, events: str = "abu", max_size: int = 4, max_length: int = 3
) -> frozenset[tuple[str, ...]]:
    """Finite languages, from a seed as `automata` are."""
    rng = np.random.default_rng(draw(SEEDS))
    everything = [word for n in range(max_length + 1) for word in product(events, repeat=n)]
    chosen = rng.choice(len(everything), rng.integers(max_size + 1), replace=False)
    return frozenset(everything[k] for k in chosen)


# --- formulas ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Formula:
    """A guard that was built as a tree: its text, how tightly it binds, and its truth as a function."""

    text: str
    binds: int
    holds: Callable[[set[str]], bool]

    def within(self, binds: int) -> str:
        """The text, in brackets where it binds looser than ``binds``."""
        return self.text if self.binds >= binds else f"({self.text})"


OR, AND, ATOM = range(3)


def formulas(propositions: list[str]) -> st.SearchStrategy[Formula]:
    """Formulas over ``propositions`` with signs and words mixed and no more brackets than some."""
    atoms = [Formula("true", ATOM, lambda _: True), Formula("false", ATOM, lambda _: False)]
    atoms += [Formula(name, ATOM, lambda true, name=name: name in true) for name in propositions]

    def negated(part: Formula, sign: str) -> Formula:
        return Formula(sign + part.within(ATOM), ATOM, lambda true: not part.holds(true))

    def both(left: Formula, right: Formula, sign: str) -> Formula:
        text = f"{left.within(AND)}{sign}{right.within(AND)}"
        return Formula(text, AND, lambda true: left.holds(true) and right.holds(true))

    def either(left: Formula, right: Formula, sign: str) -> Formula:
        text = f"{left.within(OR)}{sign}{right.within(OR)}"
        return Formula(text, OR, lambda true: left.holds(true) or right.holds(true))

    def grow(part: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
        return st.one_of(
            st.builds(negated, part, st.sampled_from(["!", "! ", "not ", "¬"])),
            st.builds(both, part, part, st.sampled_from(["&", " & ", " and ", "∧"])),
            st.builds(either, part, part, st.sampled_from(["|", " | ", " or ", " ∨ "])),
            st.builds(lambda p: Formula(f"( {p.text} )", ATOM, p.holds), part),
        )

    return st.recursive(st.sampled_from(atoms), grow, max_leaves=8)

"""Hypothesis strategies that the test modules share: alphabets, automata, words, languages, formulas.

Events ``a b c`` are controllable, ``u v`` are not, everywhere; so any two automata drawn here fit together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from hypothesis import strategies as st

from supremal import Alphabet, Automaton, from_transitions

UNCONTROLLABLE = frozenset("uv")


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
) -> Automaton:
    """Any automaton: partial, with unreachable and blocking states, any states marked; even the empty one."""
    alphabet = draw(alphabets(events=events, min_size=min_events, max_size=max_events))
    states = draw(st.integers(min_states, max_states))
    size = states * len(alphabet)
    drawn = draw(st.binary(min_size=size + states, max_size=size + states))  # one draw is faster than many
    numbers = np.frombuffer(drawn, np.uint8).astype(np.int32)
    return Automaton(
        alphabet, (numbers[:size] % (states + 1) - 1).reshape(states, len(alphabet)), numbers[size:] % 2 == 1
    )


@st.composite
def unsafe_sequences(draw: st.DrawFn) -> Automaton:
    """An automaton that marks unsafe sequences: not the empty one."""
    found = draw(automata(min_events=1))
    marked = found.marked.copy()
    marked[:1] = False
    return replace(found, marked=marked)


def trie(alphabet: Alphabet, language: Iterable[Iterable[str]], *, name: str = "") -> Automaton:
    """The tree of a finite language: a state for every prefix."""
    listed = [tuple(word) for word in language]
    path = {word[:n]: "".join(word[:n]) or "ε" for word in listed for n in range(len(word) + 1)}
    arrows = [(path[word[:-1]], word[-1], path[word]) for word in sorted(path) if word]
    states = [path[word] for word in sorted(path)]
    return from_transitions(
        alphabet, arrows, states=states, marked=[path[word] for word in listed], name=name
    )


def words(events: str = "abuv", max_size: int = 6) -> st.SearchStrategy[list[str]]:
    """Words over ``events``."""
    return st.lists(st.sampled_from(events), max_size=max_size)


def languages(
    events: str = "abu", max_size: int = 4, max_length: int = 3
) -> st.SearchStrategy[frozenset[tuple[str, ...]]]:
    """Finite languages."""
    word = st.lists(st.sampled_from(events), max_size=max_length).map(tuple)
    return st.frozensets(word, max_size=max_size)


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

"""Maps between alphabets: hiding events, adding events, renaming events.

The natural projection P: Σ* → Σ'* for Σ' ⊆ Σ erases from a word the events outside Σ': it is what an observer
sees who sees Σ' only.  P(L) is the language of what is seen, and P⁻¹(L') = {s ∈ Σ* : P(s) ∈ L'} that of all
that may have happened.  L ⊆ P⁻¹(P(L)), and L₁ ∥ L₂ = P₁⁻¹(L₁) ∩ P₂⁻¹(L₂).

Source: Cassandras, Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., sections 2.2 and 2.3;
Wonham, Cai, *Supervisory Control of Discrete-Event Systems* (2019), chapter 3.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.compose import extend
from supremal.automata.subsets import subset_automaton
from supremal.errors import AlphabetError


def project(automaton: Automaton, events: Iterable[str], *, max_states: int | None = None) -> Automaton:
    r"""Return the natural projection of both languages onto ``events``.

    Parameters
    ----------
    automaton
        Over Σ.
    events
        Those of Σ that stay, in any order; the result has them in the order of Σ.
    max_states
        The most states that the result may have; left out: what fits the machine.

    Raises
    ------
    AlphabetError
        If an event is not in the alphabet.
    AutomatonError
        If the result has more than ``max_states`` states, or its sets do not fit the machine.

    Notes
    -----
    A state of the result is the set of states that a word may have led to; marked if one of them is.  There
    are up to 2^S, though often fewer than S; time is linear in the transitions out of the members of all
    these sets.  `minimise` the result for the least such automaton.  See `supremal.automata.subsets`.

    Examples
    --------
    >>> from supremal import from_text, project
    >>> machine = from_text("idle -start-> busy \n busy -finish-> idle \n busy -fault-> down")
    >>> seen = project(machine, ["start", "finish"])
    >>> seen.delta.tolist(), seen.run(["start", "start"])
    ([[1, -1], [-1, 0]], -1)
    """
    sigma = automaton.alphabet
    kept = {sigma.names[sigma.index(name)] for name in events}
    visible = np.array([name in kept for name in sigma], np.bool_)
    names = tuple(name for name in sigma if name in kept)
    moves = automaton.delta[:, visible].reshape(-1)
    hidden = automaton.delta[:, ~visible]
    silent = hidden != NONE  # kept sparse: a closure walks through it again and again
    initial = np.zeros(automaton.n_states, np.bool_)
    initial[:1] = True
    return subset_automaton(
        Alphabet(names, sigma.uncontrollable & kept, sigma.unobservable & kept),
        (np.arange(moves.size + 1), moves),
        (np.append(0, np.cumsum(silent.sum(axis=1))), hidden[silent]),
        initial,
        automaton.marked,
        max_states=max_states,
        name=automaton.name,
    )


def inverse_project(automaton: Automaton, alphabet: Alphabet) -> Automaton:
    """Return the inverse projection of both languages: the new events of ``alphabet`` loop on every state.

    Parameters
    ----------
    automaton
        Over Σ'.
    alphabet
        Σ ⊇ Σ', the alphabet of the result.

    Raises
    ------
    AlphabetError
        If ``alphabet`` lacks an event of the automaton, or one is controllable (observable) in one of the two
        and not in the other.

    Notes
    -----
    Linear in the table of the result.

    Examples
    --------
    >>> from supremal import Alphabet, from_text, inverse_project
    >>> inverse_project(from_text("0 -a-> 1"), Alphabet(("b", "a"))).run(["b", "a", "b", "b"])
    1
    """
    for name in automaton.alphabet:
        if name not in alphabet:
            message = (
                f"the alphabet of an inverse projection must hold the events of the automaton; {name!r} is "
                f"missing in {', '.join(alphabet) or 'the empty one'}"
            )
            raise AlphabetError(message)
    wide = extend(automaton, alphabet, stand_still=True)
    columns = [wide.alphabet.index(name) for name in alphabet]
    return replace(wide, alphabet=alphabet, delta=wide.delta[:, columns])


def relabel(automaton: Automaton, names: Mapping[str, str]) -> Automaton:
    """Return ``automaton`` with events renamed: ``names`` maps old to new, and leaves out those that stay.

    An event keeps its place and its properties; names may be exchanged.

    Raises
    ------
    AlphabetError
        If an old name is unknown, a new one is no name, or two events would bear the same.

    Examples
    --------
    >>> from supremal import from_text, relabel
    >>> relabel(from_text("idle -start-> busy"), {"start": "start_1"}).alphabet.names
    ('start_1',)
    """
    sigma = automaton.alphabet
    for old in names:
        sigma.index(old)
    old_of: dict[str, str] = {}
    for old in sigma:
        new = names.get(old, old)
        if old_of.setdefault(new, old) != old:
            message = (
                f"events {old_of[new]!r} and {old!r} would both be called {new!r}; "
                "give each event a name of its own"
            )
            raise AlphabetError(message)
    renamed = Alphabet(
        tuple(old_of),
        frozenset(new for new, old in old_of.items() if old in sigma.uncontrollable),
        frozenset(new for new, old in old_of.items() if old in sigma.unobservable),
    )
    return replace(automaton, alphabet=renamed)

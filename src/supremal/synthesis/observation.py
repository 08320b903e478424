"""Events that nobody sees: observers, and whether a specification can be kept without seeing everything.

Σ = Σo ∪ Σuo.  A supervisor sees P(s), the observable events of what happened, and has to do the same after
all words that look alike.  For a plant G and a specification K, with K̄ the closure of K in L(G):

- K is *observable* iff for s, s' ∈ K̄ with P(s) = P(s') and a controllable event σ: sσ ∈ K̄ and s'σ ∈ L(G)
  imply s'σ ∈ K̄.  A supervisor that sees P(s) can keep K̄ iff K is controllable and observable.
- K is *normal* iff K̄ = P⁻¹(P(K̄)) ∩ L(G): whether a word is in K̄ can be told from what it looks like.

Normality implies observability; for a controllable K the two are the same where all controllable events are
observable.  After the observable events of a word the system may be in any state that some word with these
leads to: that set is the *estimate*, and the estimates are the states of the observer.

Source: Lin, Wonham, "On observability of discrete-event systems", Information Sciences 44 (1988); Cassandras,
Lafortune, *Introduction to Discrete Event Systems*, 2nd ed., sections 2.5.2 and 3.7.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal._graph import first_seed, path_to, search
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.compose import components, sync
from supremal.automata.explore import as_parts, explore
from supremal.automata.reduce import trim
from supremal.automata.subsets import subset_automaton
from supremal.synthesis._plants import possible, with_outside


def observer(automaton: Automaton, *, max_states: int | None = None) -> Automaton:
    """Return the observer of ``automaton``: what can be known of its state from the events that are seen.

    It generates P(L) and marks P(Lm).  A state is an estimate, named by the states in it where these have
    names.

    Parameters
    ----------
    automaton
        Any automaton; the alphabet says which events are not observable.
    max_states
        The most estimates that there may be; left out: what fits the machine.

    Raises
    ------
    AutomatonError
        If there are more than ``max_states`` estimates, or they do not fit the machine.

    Notes
    -----
    The subset construction: S E for each estimate, of which there can be 2^S.

    Examples
    --------
    >>> from supremal import Alphabet, from_transitions
    >>> from supremal.synthesis.observation import observer
    >>> sigma = Alphabet(("start", "fail", "stop"), unobservable=frozenset({"fail"}))
    >>> moves = [("idle", "start", "busy"), ("busy", "fail", "down"), ("busy", "stop", "idle")]
    >>> observer(from_transitions(sigma, moves)).state_names
    ('{idle}', '{busy, down}')
    """
    sigma = automaton.alphabet
    seen = [e for e, name in enumerate(sigma) if name not in sigma.unobservable]
    hidden = [e for e, name in enumerate(sigma) if name in sigma.unobservable]
    names = tuple(sigma.names[e] for e in seen)
    states = automaton.n_states
    found = subset_automaton(
        Alphabet(names, sigma.uncontrollable & frozenset(names)),
        (np.arange(states * len(seen) + 1), automaton.delta[:, seen].reshape(-1)),
        (np.arange(states + 1) * len(hidden), automaton.delta[:, hidden].reshape(-1)),
        first_seed(states),
        automaton.marked,
        max_states=max_states,
        name=automaton.name,
    )
    if not automaton.state_names:
        return found
    members: list[list[int]] = [[] for _ in range(found.n_states)]
    for state, estimate in sorted(components(automaton, found)[1].tolist()):
        members[estimate].append(state)
    estimates = (", ".join(map(automaton.state_name, inside)) for inside in members)
    return replace(found, state_names=tuple(f"{{{estimate}}}" for estimate in estimates))


# --- what looks alike -------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Confusion:
    """The shortest proof that a specification is not observable.

    ``word`` and ``other`` are allowed and look alike.  The controllable ``event`` can follow both; after
    ``word`` it is allowed, after ``other`` it is not.
    """

    word: tuple[str, ...]
    other: tuple[str, ...]
    event: str

    def __str__(self) -> str:
        one, two = (" ".join(word) or "nothing" for word in (self.word, self.other))
        return f"{self.event} is allowed after {one} and not after {two}, which look alike"


def find_unobservable(
    plant: Automaton | Sequence[Automaton], spec: Automaton | Sequence[Automaton]
) -> Confusion | None:
    r"""Return the shortest violation of observability, None if ``spec`` is observable.

    Parameters
    ----------
    plant
        What can happen: one automaton, or several that run side by side.
    spec
        What may happen: one automaton, or several that all have to hold.

    Returns
    -------
    Confusion or None
        Its two words together are as short as can be.

    Raises
    ------
    AlphabetError
        If an event is controllable (observable) in one part and not in another.

    Notes
    -----
    Goes through the pairs of states of the product that words which look alike lead to: S² E.  Source:
    Tsitsiklis, "On the control of discrete-event dynamical systems", Math. Control Signals Systems 2 (1989).

    Examples
    --------
    >>> from supremal import Alphabet, from_text
    >>> from supremal.synthesis.observation import find_unobservable
    >>> sigma = Alphabet(("a", "leak", "b"), {"leak"}, unobservable=frozenset({"leak"}))
    >>> plant = from_text("0 -a-> 1 \n 0 -leak-> 2 \n 1 -b-> 3 \n 2 -a-> 4 \n 4 -b-> 3", alphabet=sigma)
    >>> spec = from_text("0 -a-> 1 \n 0 -leak-> 2 \n 1 -b-> 3 \n 2 -a-> 4", alphabet=sigma)
    >>> print(find_unobservable(plant, spec))
    b is allowed after a and not after leak a, which look alike
    """
    closure, breaks = _closure(plant, spec)
    breaks &= closure.alphabet.controllable
    allowed = closure.delta != NONE

    def confused(pairs: Ints) -> Bools:
        both: Bools = allowed[pairs[:, 0]] & breaks[pairs[:, 1]]
        return both

    found = _find_alike(closure, closure, lambda pairs: np.any(confused(pairs), axis=1))
    if found is None:
        return None
    states = np.array([[closure.run(word) for word in found]])
    event = int(np.argmax(confused(states)[0]))
    return Confusion(*found, closure.alphabet.names[event])


def is_observable(plant: Automaton | Sequence[Automaton], spec: Automaton | Sequence[Automaton]) -> bool:
    """Tell whether ``spec`` is observable with respect to ``plant``; see `find_unobservable`."""
    return find_unobservable(plant, spec) is None


def find_abnormal(
    plant: Automaton | Sequence[Automaton], spec: Automaton | Sequence[Automaton]
) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
    r"""Return the shortest violation of normality, None if ``spec`` is normal.

    Returns
    -------
    (inside, outside) or None
        Two words that look alike, together as short as can be: one is allowed, the other can happen and is
        not.

    Notes
    -----
    Parameters, errors and complexity are those of `find_unobservable`.

    Examples
    --------
    >>> from supremal import Alphabet, from_text
    >>> from supremal.synthesis.observation import find_abnormal
    >>> sigma = Alphabet(("a", "leak"), unobservable=frozenset({"leak"}))
    >>> plant = from_text("0 -a-> 1 \n 1 -leak-> 2", alphabet=sigma)
    >>> find_abnormal(plant, from_text("0 -a-> 1", alphabet=sigma))
    (('a',), ('a', 'leak'))
    """
    closure, breaks = _closure(plant, spec)
    outside = closure.n_states
    wider = with_outside(closure, breaks)
    return _find_alike(closure, wider, lambda pairs: pairs[:, 1] == outside)


def is_normal(plant: Automaton | Sequence[Automaton], spec: Automaton | Sequence[Automaton]) -> bool:
    """Tell whether ``spec`` is normal with respect to ``plant``; see `find_abnormal`."""
    return find_abnormal(plant, spec) is None


def _closure(
    plant: Automaton | Sequence[Automaton], spec: Automaton | Sequence[Automaton]
) -> tuple[Automaton, Bools]:
    """Return K̄ in L(G), and where an event (``bool [S, E]``) is possible in the plant and leads out of K̄."""
    plants = as_parts(plant)
    closure, states = components(*plants, trim(sync(*as_parts(spec))))
    return closure, possible(plants, states, closure.alphabet) & (closure.delta == NONE)


def _find_alike(
    one: Automaton, two: Automaton, wrong: Callable[[Ints], Bools]
) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
    """Return words of ``one`` and ``two`` that look alike and lead to a ``wrong`` pair of states, if any do.

    Both have the same alphabet; ``wrong`` takes pairs, ``[N, 2]``.  What is seen moves both, and counts twice
    (through a node between), so that the words found are together the shortest.
    """
    if not one.n_states:
        return None
    names, hidden = one.alphabet.names, one.alphabet.unobservable
    sides = [
        Automaton(
            Alphabet(tuple(f"{side if name in hidden else '='}{name}" for name in names)), a.delta, a.marked
        )
        for side, a in (("<", one), (">", two))
    ]
    graph = explore(sides)
    pairs, edges = len(graph.states), len(graph.target)
    twice = np.flatnonzero(np.array([name[0] == "=" for name in graph.alphabet], np.bool_)[graph.event])
    target = np.append(graph.target, graph.target[twice])
    target[twice] = pairs + np.arange(twice.size)
    start = np.append(graph.start, edges + 1 + np.arange(twice.size))
    order, via = search(start, target, first_seed(start.size - 1), np.ones(start.size - 1, np.bool_))
    order = order[order < pairs]
    found = order[wrong(graph.states[order])]
    if not found.size:
        return None
    word = [graph.alphabet.names[graph.event[k]] for k in path_to(int(found[0]), via, start) if k < edges]
    return tuple(n[1:] for n in word if n[0] != ">"), tuple(n[1:] for n in word if n[0] != "<")

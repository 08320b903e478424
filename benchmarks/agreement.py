"""Ten thousand random plants and specifications: supremal and libFAUDES have to agree on every one.

Sizes up to 200 states, mixed alphabets, uncontrollable events, marking.  Compared as languages, generated and
marked: the composition, the supremal supervisor with and without nonblocking, the projection, and the minimal
automaton; besides, inclusion.  ``AGREEMENT_CASES`` in the environment sets another number of cases.
"""

from __future__ import annotations

import os
from collections import Counter
from time import perf_counter
from typing import Any

import faudes
import numpy as np

from benchmarks.synthesis import to_faudes
from supremal import (
    Alphabet,
    Automaton,
    from_transitions,
    is_included,
    is_same_language,
    mark_all,
    minimise,
    project,
    sync,
    synthesize,
    universal,
)
from supremal.automata.compose import extend

CASES = int(os.environ.get("AGREEMENT_CASES", "10000"))
UNCONTROLLABLE = frozenset("uv")


def random_automaton(rng: np.random.Generator, controllable: float, uncontrollable: float) -> Automaton:
    """Return 2 to 200 states over 3 to 5 of five events."""
    names = rng.permutation(["a", "b", "c", "u", "v"])[: rng.integers(3, 6)].tolist()
    states = int(np.exp(rng.uniform(np.log(2), np.log(200))))
    chance = [uncontrollable if name in UNCONTROLLABLE else controllable for name in names]
    shape = (states, len(names))
    delta = np.where(rng.random(shape) < chance, rng.integers(0, states, shape), -1)
    return Automaton(Alphabet(tuple(names), UNCONTROLLABLE & set(names)), delta, rng.random(states) < 0.5)


def from_faudes(generator: Any, alphabet: Alphabet) -> Automaton:  # noqa: ANN401 - an extension type
    """Take an automaton back, without what nothing leads to."""
    copy = faudes.Generator(generator)
    copy.Accessible()
    states, _, arrows, initial, marked = faudes.Generator.ToLists(copy)
    return from_transitions(
        alphabet, arrows, states=states, initial=initial[0] if initial else None, marked=marked
    )


def lifted(automaton: Automaton, alphabet: Alphabet) -> Any:  # noqa: ANN401
    """Return ``automaton`` for libFAUDES, standing still on the events that it does not know."""
    system = to_faudes(automaton)
    faudes.InvProject(system, to_faudes(universal(alphabet)).Alphabet())
    for name in alphabet:
        if name not in alphabet.uncontrollable:
            system.SetControllable(name)
    return system


def same(ours: Automaton, theirs: Any) -> bool:  # noqa: ANN401
    """Tell whether both languages are the same."""
    other = from_faudes(theirs, ours.alphabet)
    return is_same_language(ours, other) and is_same_language(mark_all(ours), mark_all(other))


def questions(plant: Automaton, spec: Automaton) -> dict[str, bool]:
    """Return for each operation whether the two agree on it."""
    both = sync(plant, spec)
    g, k = lifted(plant, both.alphabet), lifted(spec, both.alphabet)
    events = both.alphabet.names[::2]
    kept, shadow = faudes.EventSet(), faudes.Generator()
    for name in events:
        kept.Insert(name)
    faudes.Project(to_faudes(spec), kept, shadow)
    small = faudes.Generator()
    accessible = faudes.Generator(to_faudes(spec))
    accessible.Accessible()
    faudes.StateMin(accessible, small)
    wide = [extend(part, both.alphabet, stand_still=True) for part in (plant, spec)]
    closed = synthesize(plant, spec, nonblocking=False)
    own = [name for name in events if name in spec.alphabet]
    return {
        "sync": same(both, faudes.Parallel(to_faudes(plant), to_faudes(spec))),
        "synthesize": same(synthesize(plant, spec).automaton, faudes.SupCon(g, k)),
        "synthesize, closed": same(closed.automaton, faudes.SupConClosed(g, k)),
        "project": same(project(spec, own), shadow),
        "minimise": same(minimise(spec), small),
        "inclusion": is_included(*wide) == faudes.LanguageInclusion(*map(to_faudes, wide)),
    }


def run() -> dict[str, Any]:
    """Print how often they agree; return the record."""
    began, agreed, kinds = perf_counter(), Counter[str](), Counter[str]()
    for case in range(CASES):
        rng = np.random.default_rng(case)
        plant, spec = random_automaton(rng, 0.6, 0.2), random_automaton(rng, 0.7, 0.97)
        for name, answer in questions(plant, spec).items():
            agreed[name] += answer
            if not answer:
                print(f"case {case}: {name} differs")
        size, whole = synthesize(plant, spec).automaton.n_states, sync(plant, spec).n_states
        kinds["empty" if not size else "whole" if size == whole else "part"] += 1
    for name, count in agreed.items():
        print(f"{name:20} {count:>7,} of {CASES:,} agree")
    print(f"supervisors: {dict(kinds)}; {perf_counter() - began:.0f} s")
    return {"cases": CASES, "agree": dict(agreed), "supervisors": dict(kinds)}

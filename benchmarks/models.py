"""Models of any size for benchmarks: a transfer line, and random automata."""

from __future__ import annotations

import numpy as np

from supremal import Alphabet, Automaton, from_transitions


def transfer_line(machines: int, capacity: int) -> tuple[list[Automaton], list[Automaton]]:
    """Return machines that can break down, and buffers between them that must neither over- nor underflow.

    Machine i starts (``s``), finishes (``f``) or breaks down (``b``), and is repaired (``r``); finishing and
    breaking down are uncontrollable.  Source: Wonham, Cai, *Supervisory Control of Discrete-Event Systems*,
    chapter 4 (a line of small factories).
    """

    def events(i: int, kinds: str) -> list[str]:
        return [f"{kind}{i}" for kind in kinds]

    def alphabet(names: list[str]) -> Alphabet:
        return Alphabet(tuple(names), frozenset(name for name in names if name[0] in "fb"))

    plants, specs = [], []
    for i in range(machines):
        s, f, b, r = events(i, "sfbr")
        moves = [("idle", s, "busy"), ("busy", f, "idle"), ("busy", b, "down"), ("down", r, "idle")]
        plants.append(from_transitions(alphabet([s, f, b, r]), moves, marked=["idle"], name=f"M{i}"))
    for i in range(machines - 1):
        up, down = f"f{i}", f"s{i + 1}"
        moves = [(str(k), up, str(k + 1)) for k in range(capacity)]
        moves += [(str(k + 1), down, str(k)) for k in range(capacity)]
        specs.append(from_transitions(alphabet([up, down]), moves, initial="0", marked=["0"], name=f"B{i}"))
    return plants, specs


def random_pair(states: int, events: int, seed: int) -> tuple[Automaton, Automaton]:
    """Return a random plant, and the specification that some of its transitions do not happen.

    Two events in five are uncontrollable, and rare (else one bad state would be the end of all); the
    specification forbids three controllable transitions in ten and one uncontrollable one in a hundred; one
    state in ten is marked.
    """
    rng = np.random.default_rng(seed)
    names = tuple(f"e{e}" for e in range(events))
    alphabet = Alphabet(names, frozenset(names[: events * 2 // 5]))
    shape = (states, events)
    density = np.where(alphabet.controllable, 0.3, 0.05)
    delta = np.where(rng.random(shape) < density, rng.integers(0, states, shape), -1).astype(np.int32)
    chance = np.where(alphabet.controllable, 0.3, 0.01)
    kept = np.where(rng.random(shape) < chance, -1, delta).astype(np.int32)
    kept[0] = delta[0]
    marked = rng.random(states) < 0.1
    return Automaton(alphabet, delta, marked, name="plant"), Automaton(alphabet, kept, marked, name="spec")

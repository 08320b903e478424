"""The product of plants and rules as a game, by the book: what has to go, and what a reason claims.

Everything here is on the sets and dicts of `book`, and shares no code with the library.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import book
from supremal import Automaton
from supremal.synthesis.causes import Break
from supremal.synthesis.reasons import Reason


class Game:
    """The product by the book: a state is that of the plants and that of the rules' closures."""

    def __init__(self, plants: list[Automaton], specs: list[Automaton], *, nonblocking: bool) -> None:
        self.plants = [book.read(part) for part in plants]
        self.names = [spec.name for spec in specs]
        self.closures = [book.read(spec) for spec in specs]
        if nonblocking:
            self.closures = [book.trim(machine) for machine in self.closures]
        self.plant, self.rule = book.sync(*self.plants), book.sync(*self.closures)
        self.whole = book.sync(self.plant, self.rule)
        if not nonblocking:
            self.whole = replace(self.whole, marked=self.whole.states)

    def possible(self, state: book.State) -> set[str]:
        """The events that the plants can follow."""
        return {event for event in self.whole.events if book.can(self.plant, state[0], event)}

    def broken(self, state: book.State, event: str) -> set[tuple[str, str]]:
        """The rules that forbid an event, and their states."""
        return {
            (name, str(q))
            for name, closure, q in zip(self.names, self.closures, state[1], strict=True)
            if not book.can(closure, q, event)
        }

    def escapes(self) -> frozenset[book.State]:
        return book.escapes(self.plant, self.whole)

    def choices(self, state: book.State) -> set[str]:
        return self.possible(state) - self.whole.uncontrollable

    def stuck(self, left: frozenset[book.State]) -> frozenset[book.State]:
        """Where something could be chosen, and nothing that can be leads to what is ``left``."""
        return frozenset(
            s
            for s in self.whole.states
            if self.choices(s) and not any(self.whole.moves.get((s, e)) in left for e in self.choices(s))
        )

    def supremal(self, *, must_act: bool) -> frozenset[book.State]:
        """The states that are left by taking out bad ones until there are none."""
        left = self.whole.states
        while True:
            inside = book.restrict(self.whole, left)
            bad = self.rank_one(inside.states, must_act=must_act) & inside.states
            bad |= inside.states - book.coaccessible(inside)
            if not bad:
                return inside.states
            left = inside.states - bad

    def rank_one(self, left: frozenset[book.State], *, must_act: bool) -> frozenset[book.State]:
        """What has to go because something uncontrollable leads out of ``left``, or no choice stays in it."""
        out = {
            s
            for (s, event), to in self.whole.moves.items()
            if event in self.whole.uncontrollable and to not in left
        }
        return self.escapes() | frozenset(out) | (self.stuck(left) if must_act else frozenset())

    def rank(self, state: book.State, *, must_act: bool) -> int:
        """In how many rounds a state goes, of taking out all at once; nothing is marked."""
        left, rounds = self.whole.states, 0
        while True:
            gone = self.rank_one(left, must_act=must_act)
            if state in gone:
                return rounds
            left, rounds = left - gone, rounds + 1

    def shortest_escape(self, state: book.State) -> int | None:
        """How many uncontrollable events lead from a state to an escape."""
        moves = {(s, e): to for (s, e), to in self.whole.moves.items() if e in self.whole.uncontrollable}
        return book.distance(replace(self.whole, moves=moves, initial=state), self.escapes())

    def check_reason(self, reason: Reason, *, must_act: bool, left: frozenset[book.State]) -> None:
        """Check every word of a reason."""
        state = book.after(self.whole, reason.word)
        assert state in left or not reason.event
        if reason.event:
            assert reason.event in self.choices(state)
            if (state, reason.event) not in self.whole.moves:
                assert (reason.kind, reason.end, reason.steps) == ("breaks a rule", "break", ())
                self.check_breaks(reason.breaks, state, {reason.event})
                return
            state = self.whole.moves[state, reason.event]
        first, assumed = state, set()
        for step in reason.steps:
            assert state not in left
            assumed.add(step.how)
            assert (step.event in self.whole.uncontrollable) == (step.how == "uncontrollable") or (
                step.how == "way"
            )
            assert set(step.choices) == (self.choices(state) if step.how == "choice" else set())
            assert step.how != "choice" or step.event in step.choices
            state = self.whole.moves[state, step.event]
        assert state not in left
        assert must_act or ("choice" not in assumed and reason.end != "stuck")
        self.check_end(reason, state)
        escape = self.shortest_escape(first)
        if not must_act:
            assert (reason.kind == "uncontrollable") == (escape is not None)
            assert escape is None or len(reason.steps) == escape

    def check_end(self, reason: Reason, state: book.State) -> None:
        if reason.end == "break":
            (event,) = {b.event for b in reason.breaks}
            assert event in self.possible(state) & self.whole.uncontrollable
            self.check_breaks(reason.breaks, state, {event})
        elif reason.end == "trapped":
            around = book.restrict(replace(self.whole, initial=state), self.whole.states)
            assert not around.states & (around.marked | self.escapes())
            assert {source for source, _ in around.moves} == around.states
            assert reason.breaks == ()
        else:
            events = self.possible(state)
            assert (
                state in self.stuck(self.whole.states)
                if reason.end == "stuck"
                else (
                    state not in self.whole.marked
                    and not any(source == state for source, _ in self.whole.moves)
                )
            )
            self.check_breaks(reason.breaks, state, events)

    def check_breaks(self, breaks: Sequence[Break], state: book.State, events: set[str]) -> None:
        said = {(b.event, b.rule, b.state) for b in breaks}
        assert len(said) == len(breaks)
        assert said == {(event, *where) for event in events for where in self.broken(state, event)}


def beside(behaviour: book.Machine, whole: book.Machine) -> dict[book.State, book.State]:
    """The state of ``whole`` that the words to each state of ``behaviour`` lead to."""
    found = {} if behaviour.initial is None else {behaviour.initial: whole.initial}
    queue = list(found)
    for state in queue:  # grows while it is walked through
        for (source, event), to in behaviour.moves.items():
            if source == state and to not in found:
                found[to] = whole.moves[found[state], event]
                queue.append(to)
    return found

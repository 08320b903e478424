"""Judging what has happened by the rules of a task, and what its supervisor would have done about it.

A rule *breaks* at the first event after which no continuation can satisfy it; it is *pending* where the trace
ends in a state that is not marked: what it owes may still come.  Where plants are known, a second question is
what the supervisor would have disabled, and where: often before a rule breaks, since it looks ahead.  It
answers for the first such event only, for after that it has no say any more.

Source: a rule as a monitor with three answers is that of Bauer, Leucker, Schallhart, "Runtime verification
for LTL and TLTL", ACM TOSEM 20 (2011); here on finite words, whose end is known.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from supremal._arrays import NONE
from supremal.automata.automaton import Automaton
from supremal.automata.reduce import trim
from supremal.automata.words import Word
from supremal.synthesis.explain import Disabled, disabled_in
from supremal.synthesis.reasons import Reason
from supremal.task.experiment import rules_of
from supremal.task.findings import plants_of, study
from supremal.task.task import Task

Verdict = Literal["kept", "broken", "pending"]


@dataclass(frozen=True, slots=True)
class Broken:
    """A rule, and the event that broke it: its name and where it stands, from 1; 0 if nothing can keep it."""

    rule: str
    position: int
    event: str


@dataclass(frozen=True, slots=True)
class Refused:
    """The first event that a supervisor would have disabled, where it stands, and why (without the word)."""

    position: int
    event: str
    reason: Reason


@dataclass(frozen=True, slots=True)
class Unforeseen:
    """The first event that a plant cannot do: the plant's name, the event, and where it stands."""

    plant: str
    position: int
    event: str


@dataclass(frozen=True, slots=True)
class Judgement:
    """What there is to say about a trace.

    Parameters
    ----------
    broken
        The rules that broke, each at its first break.
    pending
        The names of those that are not satisfied at the end.
    refused
        What the supervisor would have disabled; None: nothing, or there is no supervisor to ask.
    unforeseen
        What the plants cannot do; None: nothing.
    """

    broken: tuple[Broken, ...]
    pending: tuple[str, ...]
    refused: Refused | None
    unforeseen: Unforeseen | None

    @property
    def verdict(self) -> Verdict:
        """The answer in a word."""
        return "broken" if self.broken else "pending" if self.pending else "kept"


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """What traces are judged by.

    Parameters
    ----------
    rules
        The rules, without the states from which nothing can satisfy them.
    plants
        What can happen; () where it cannot be followed by events alone.
    disabled
        The supervisor, and why it disables what it does; None where there is none to ask.
    """

    rules: tuple[Automaton, ...]
    plants: tuple[Automaton, ...]
    disabled: Disabled | None


def bench_of(task: Task) -> Bench:
    """Return what the traces of ``task`` are judged by.

    The states of an environment are not in a trace: there, only the rules judge.  Takes a synthesis.
    """
    rules = tuple(
        replace(trim(rule), name=said.name) for rule, said in zip(rules_of(task), task.rules, strict=True)
    )
    if task.model == "environment":
        return Bench(rules, (), None)
    plants = plants_of(task)
    findings = study(plants, tuple(rule.automaton for rule in task.rules), task.options, lost=False)
    if findings.supervisor.is_empty:
        return Bench(rules, plants, None)
    return Bench(rules, plants, disabled_in(findings.causes, findings.supervisor, findings.state))


def judge(bench: Bench, word: Word) -> Judgement:
    """Judge ``word``, in time linear in its length.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> from supremal.rules.patterns import response
    >>> from supremal.rules.rule import Rule
    >>> from supremal.task.task import Task
    >>> sigma = Alphabet(("ask", "answer"))
    >>> task = Task("talk", sigma, rules=(Rule("answers", response("ask", "answer", alphabet=sigma)),))
    >>> judge(bench_of(task), ("ask", "answer", "ask"))
    Judgement(broken=(), pending=('answers',), refused=None, unforeseen=None)
    """
    broken, pending = [], []
    for rule in bench.rules:
        state, position = _follow(rule, word)
        if state == NONE:
            broken.append(Broken(rule.name, position, word[position - 1] if position else ""))
        elif not rule.marked[state]:
            pending.append(rule.name)
    unforeseen = min(_surprises(bench.plants, word), key=lambda found: found.position, default=None)
    possible = word if unforeseen is None else word[: unforeseen.position - 1]
    return Judgement(tuple(broken), tuple(pending), _refused(bench.disabled, possible), unforeseen)


def _follow(automaton: Automaton, word: Word) -> tuple[int, int]:
    """Return the state after ``word``, or `NONE` and the position of the event that is not possible."""
    state = automaton.run(())
    for position, event in enumerate(word, 1):
        if state == NONE:
            return NONE, 0
        if event in automaton.alphabet:
            state = automaton.run([event], state)
            if state == NONE:
                return NONE, position
    return state, 0


def _surprises(plants: tuple[Automaton, ...], word: Word) -> Iterator[Unforeseen]:
    """Yield for each plant the first event that it cannot do."""
    for plant in plants:
        state, position = _follow(plant, word)
        if state == NONE and word:
            position = max(position, 1)  # a plant without states can do nothing from the start
            yield Unforeseen(plant.name, position, word[position - 1])


def _refused(disabled: Disabled | None, word: Word) -> Refused | None:
    """Return the first event of ``word``, which the plants can do, that the supervisor disables."""
    if disabled is None:
        return None
    monitor = disabled.supervisor.monitor()
    for position, event in enumerate(word, 1):
        state = monitor.state
        if not monitor.observe([event]):
            return Refused(position, event, replace(disabled.why(state, event), word=()))
    return None

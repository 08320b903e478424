"""Whether rules can be kept, what that gives up, and why; and the document that says it.

The product is explored once, and everything is read off it.  Three questions need products of their own: each
rule alone, what is given up (the product with nothing left out), and who is to blame.  Where such a product
would be much larger than the one that synthesis needs, the question is left open, and answered with None.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from time import perf_counter
from typing import Any, Final, Literal, TypeVar

from supremal._arrays import Ints
from supremal.automata.automaton import Automaton
from supremal.automata.build import universal
from supremal.decisions.plant import observed_plant
from supremal.errors import AutomatonError
from supremal.synthesis.causes import Causes, Product, find_causes, supervisor_of, whole_product_of
from supremal.synthesis.explain import explain_empty
from supremal.synthesis.given_up import GivenUp, Guilty, find_guilty, given_up_in
from supremal.synthesis.reasons import Reason
from supremal.synthesis.supervisor import Supervisor
from supremal.synthesis.witnesses import (
    Blocking,
    Breach,
    Deadlock,
    blocking_in,
    breach_in,
    deadlock_in,
    explain_blocking,
    explain_violation,
)
from supremal.task.task import Options, Task

SHOWN: Final = 10
"""How many words that are given up, and disabled events, are shown if nothing else is said."""

_RULE_STATES: Final = 10_000
_WHOLE_STATES: Final = 1_000_000

Verdict = Literal["enforceable", "enforceable_in_part", "not_enforceable"]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Question:
    """A question that was answered with a witness (no), with none (yes), or left open (not ``asked``)."""

    asked: bool
    witness: Breach | Blocking | Deadlock | None = None

    @property
    def holds(self) -> bool | None:
        """The answer, None where the question is open."""
        return self.witness is None if self.asked else None


OPEN: Final = Question(asked=False)


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """Everything that the two commands say.

    ``state`` is the state of the product in each of the supervisor's; ``each`` answers for each rule alone
    whether it is controllable, and nonblocking with the plants.
    """

    plants: tuple[Automaton, ...]
    rules: tuple[Automaton, ...]
    options: Options
    causes: Causes
    supervisor: Supervisor
    state: Ints
    each: tuple[tuple[Question, Question], ...]
    controllable: Question
    nonblocking: Question
    can_act: Question
    given_up: tuple[GivenUp, ...] | None
    guilty: Guilty | None
    reason: Reason | None
    seconds: float

    @property
    def verdict(self) -> Verdict:
        """Whether the rules can be kept as they stand, in part, or not at all."""
        if self.causes.enforceable:
            return "enforceable"
        return "not_enforceable" if self.supervisor.is_empty else "enforceable_in_part"


def plants_of(task: Task) -> tuple[Automaton, ...]:
    """Return what can happen in a task: its plants, its environment as one that sees states, or anything."""
    if task.plants:
        return task.plants
    if task.environment is not None:
        return (observed_plant(task.environment, name="environment"),)
    return (replace(universal(task.alphabet), name="anything"),)


def study(
    plants: tuple[Automaton, ...], rules: tuple[Automaton, ...], options: Options, *, lost: bool = True
) -> Findings:
    """Find out everything; what is ``lost`` only if asked."""
    begin = perf_counter()
    closed, must_act, limit = not options.nonblocking, options.must_act, options.max_states
    causes = find_causes(plants, rules, nonblocking=not closed, must_act=must_act, max_states=limit)
    supervisor, state = supervisor_of(causes)
    breach = breach_in(causes.product)
    whole = causes.product if breach is None else _whole(causes, limit, wanted=lost or not closed)
    return Findings(
        plants=plants,
        rules=rules,
        options=options,
        causes=causes,
        supervisor=supervisor,
        state=state,
        each=_each(plants, rules, causes, closed=closed),
        controllable=Question(asked=True, witness=breach),
        nonblocking=_nonblocking(causes, whole, closed=closed),
        can_act=Question(asked=True, witness=deadlock_in(causes)) if must_act else OPEN,
        given_up=_lost(causes, whole, supervisor, closed=closed) if lost else None,
        guilty=_guilty(plants, rules, options) if supervisor.is_empty else None,
        reason=explain_empty(causes),
        seconds=perf_counter() - begin,
    )


def _within(verb: Callable[[], T]) -> T | None:
    """Return what ``verb`` does, None where that takes a product with too many states."""
    try:
        return verb()
    except AutomatonError:
        return None


def _whole(causes: Causes, limit: int | None, *, wanted: bool) -> Product | None:
    """Return the product with nothing left out, None where it is too large or not ``wanted``."""
    product, room = causes.product, _WHOLE_STATES if limit is None else limit
    if not wanted or len(causes.cause) >= room:  # it has more states than the one that leaves something out
        return None
    return _within(lambda: whole_product_of(product.plants, product.rules, max_states=room))


def _each(
    plants: tuple[Automaton, ...], rules: tuple[Automaton, ...], causes: Causes, *, closed: bool
) -> tuple[tuple[Question, Question], ...]:
    """Ask of each rule alone whether it is controllable, and nonblocking with the plants."""
    room = max(_RULE_STATES, len(causes.cause) // (2 * max(len(rules), 1)))
    answers = []
    for rule in rules:
        controllable = nonblocking = OPEN
        with suppress(AutomatonError):
            breach = explain_violation(plants, rule, nonblocking=not closed, max_states=room)
            controllable = Question(asked=True, witness=breach)
        with suppress(AutomatonError):
            if not closed:
                blocking = explain_blocking(plants, rule, max_states=room)
                nonblocking = Question(asked=True, witness=blocking)
        answers.append((controllable, nonblocking))
    return tuple(answers)


def _nonblocking(causes: Causes, whole: Product | None, *, closed: bool) -> Question:
    if closed or whole is None:
        return OPEN
    return Question(asked=True, witness=None if causes.enforceable else blocking_in(whole))


def _lost(
    causes: Causes, whole: Product | None, supervisor: Supervisor, *, closed: bool
) -> tuple[GivenUp, ...] | None:
    if causes.enforceable or whole is None:
        return () if causes.enforceable else None
    return given_up_in(whole, supervisor, SHOWN, nonblocking=not closed)


def _guilty(plants: tuple[Automaton, ...], rules: tuple[Automaton, ...], options: Options) -> Guilty | None:
    return _within(lambda: find_guilty(plants, rules, **asdict(options)))


# --- the document -----------------------------------------------------------------------------------------


def document(findings: Findings) -> dict[str, Any]:
    """Return the findings as ``docs/cli.md`` describes them."""
    automaton, guilty = findings.supervisor.automaton, findings.guilty
    return {
        "verdict": findings.verdict,
        "closed": not findings.options.nonblocking,
        "must_act": findings.options.must_act,
        "supervisor": {"states": automaton.n_states, "transitions": automaton.n_transitions},
        "seconds": findings.seconds,
        "plants": [{"name": plant.name, "states": plant.n_states} for plant in findings.plants],
        "rules": [
            {"name": rule.name, "states": rule.n_states} | _answers(controllable, nonblocking)
            for rule, (controllable, nonblocking) in zip(findings.rules, findings.each, strict=True)
        ],
        "together": _answers(findings.controllable, findings.nonblocking)
        | {"can_act": findings.can_act.holds, "deadlock": _shown(findings.can_act.witness)},
        "given_up": None if findings.given_up is None else [_shown(lost) for lost in findings.given_up],
        "guilty": list(guilty.rules) if guilty else None if automaton.n_states == 0 else [],
        "reason": None if findings.reason is None else reason_document(findings.reason),
    }


def _answers(controllable: Question, nonblocking: Question) -> dict[str, Any]:
    return {
        "controllable": controllable.holds,
        "witness": _shown(controllable.witness),
        "nonblocking": nonblocking.holds,
        "blocking": _shown(nonblocking.witness),
    }


def _shown(found: Breach | Blocking | Deadlock | GivenUp | None) -> dict[str, Any] | None:
    """Return the fields of a finding, and what it says."""
    return None if found is None else asdict(found) | {"text": str(found)}


def reason_document(reason: Reason) -> dict[str, Any]:
    """Return a reason as ``docs/cli.md`` describes it."""
    return {
        "word": list(reason.word),
        "event": reason.event,
        "kind": reason.kind,
        "chain": [{"event": step.event, "how": step.how} for step in reason.steps],
        "end": reason.end,
        "breaks": [asdict(b) for b in reason.breaks],
        "text": str(reason),
    }

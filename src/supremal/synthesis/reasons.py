"""A reason in words: what can follow what is disabled, who controls it, and how it ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

from supremal.synthesis.causes import Break

How = Literal["uncontrollable", "choice", "way"]
End = Literal["break", "stuck", "dead", "trapped", "nothing"]
Kind = Literal["breaks a rule", "uncontrollable", "no choice", "blocking"]


class Step(NamedTuple):
    """One event on the way from what is disabled to what goes wrong.

    ``how`` it comes about: nobody controls it, or it is the choice that holds out longest (``choices`` are
    all that there are), or the next event on a shortest way out of the states that are blocked.
    """

    event: str
    how: How
    choices: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Reason:
    """Why an event is disabled, or why nothing can be enforced.

    Parameters
    ----------
    word
        A shortest word after which the event is disabled.
    event
        The event; "" where it is the empty word that has to go.
    steps
        What can follow it.
    end
        How that ends: a rule *breaks*; the agent is *stuck*; nothing is possible any more in a *dead* state
        that is not marked; one is *trapped* where things go on, but never to a marked state; or *nothing*:
        some part allows no word at all.
    breaks
        The rules that break at the end, each with the event that breaks it.
    """

    word: tuple[str, ...]
    event: str
    steps: tuple[Step, ...]
    end: End
    breaks: tuple[Break, ...]

    @property
    def kind(self) -> Kind:
        """What kind of reason it is."""
        how = {step.how for step in self.steps}
        if self.end in ("dead", "trapped", "nothing") or "way" in how:
            return "blocking"
        if self.end == "stuck" or "choice" in how:
            return "no choice"
        direct = not self.steps and self.breaks[0].event == self.event
        return "breaks a rule" if direct else "uncontrollable"

    @property
    def chain(self) -> tuple[str, ...]:
        """The events of ``steps``."""
        return tuple(step.event for step in self.steps)

    @property
    def because(self) -> str:
        """What speaks against the event, without saying again which it is."""
        return listed(self.breaks, "it") if self.kind == "breaks a rule" else _told(self)

    def __str__(self) -> str:
        what = f"{self.event} is disabled" if self.event else "nothing can be enforced"
        return f"{_after(self.word)}{what}: {self.because}"


def _after(word: tuple[str, ...]) -> str:
    return f"after {' '.join(word)}, " if word else ""


def listed(breaks: tuple[Break, ...], event: str = "") -> str:
    """Say which rules break, those that break in one way together; ``event`` stands for all events."""
    groups: dict[tuple[str, str, bool], list[str]] = {}
    for b in breaks:
        groups.setdefault((b.rule, b.state, b.at_once), []).append(b.event)
    return ", ".join(str(Break(event or " or ".join(events), *how)) for how, events in groups.items())


def _told(reason: Reason) -> str:
    """Say what can follow, who controls it, and how it ends."""
    by = {
        how: ", ".join(dict.fromkeys(s.event for s in reason.steps if s.how == how)) for how in get_args(How)
    }
    clauses = [f"{'it' if reason.event else 'the start'} can be followed by {' '.join(reason.chain)}"]
    if by["uncontrollable"]:
        clauses.append(f"nobody controls {by['uncontrollable']}")
    if by["choice"]:
        clauses.append(f"no choice holds out longer than {by['choice']}")
    if by["way"]:
        clauses.append(f"other ways than {by['way']} lead to no marked state either")
    broken = listed(reason.breaks, "it" if reason.end == "break" else "")
    end = {
        "break": f"{reason.breaks[0].event if reason.breaks else ''} can happen, which nobody controls",
        "stuck": "no choice is left",
        "dead": "nothing is possible any more, short of a marked state",
        "trapped": "no marked state can be reached any more",
        "nothing": f"{', '.join(b.rule for b in reason.breaks)} allows no word at all",
    }[reason.end]
    if broken and reason.end != "nothing":
        end += f": {broken}"
    if reason.steps:
        return "; ".join([*clauses, f"then {end}"])
    return f"after it {end}" if reason.event else end

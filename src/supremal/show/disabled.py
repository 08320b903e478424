"""What a supervisor disables, and why, in few words.

There can be a million pairs of a state and a disabled event, but only some tens of reasons: which rule would
break, and through which events that nobody controls.  So pairs with the same reason are one row, with the
events that are disabled for it, in how many states each, and the shortest words that lead to some of them.

The explanations themselves are those of `supremal.synthesis.explain`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from itertools import islice
from typing import Final

from supremal._arrays import NONE
from supremal.synthesis.explain import Disabled
from supremal.synthesis.reasons import Reason

EXPLAINED: Final = 20_000
"""The most pairs that are explained, those after the shortest words."""
_EXAMPLES: Final = 3
"""The examples of a row."""
_ROWS: Final = 200
"""The most rows of a table."""


@dataclass(slots=True)
class Row:
    """A reason for which events are disabled.

    Parameters
    ----------
    why
        The reason in few words.
    events
        The events, and in how many states each is disabled for this reason.
    examples
        Some of them: a shortest word after which an event is disabled, and the event.
    """

    why: str
    events: Counter[str] = field(default_factory=Counter)
    examples: list[tuple[tuple[str, ...], str]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class DisabledTable:
    """What is disabled, by reason and event.

    Parameters
    ----------
    rows
        The most frequent first.
    left_out
        The rows that are left out for being too many.
    pairs, explained
        How many pairs of a state and an event there are, and how many of them the rows count.
    counts
        For each event that is disabled somewhere: in how many states, and in how many it is enabled.
    idle
        Whether something could be chosen, and nothing that can is enabled anywhere.
    """

    rows: tuple[Row, ...]
    left_out: int
    pairs: int
    explained: int
    counts: dict[str, tuple[int, int]]
    idle: bool = False


def disabled_table(
    disabled: Disabled, known: Collection[str], *, explained: int = EXPLAINED, rows: int = _ROWS
) -> DisabledTable:
    r"""Return what is ``disabled``, grouped by reason.

    Parameters
    ----------
    disabled
        What a supervisor disables.
    known
        The events that a reader knows; others (the sights of an observed plant) are not told.
    explained
        The most pairs to explain.
    rows
        The most rows.

    Notes
    -----
    Linear in the length of the reasons and words that are looked at.

    Examples
    --------
    >>> from supremal import explain_disabled, from_text
    >>> plant = from_text("uncontrollable fault \n idle -start-> busy \n busy -fault, stop-> idle")
    >>> spec = from_text("name calm \n uncontrollable fault \n ready -start-> going \n going -stop-> ready")
    >>> table = disabled_table(explain_disabled(plant, spec), ("start", "stop", "fault"))
    >>> [(dict(row.events), row.why) for row in table.rows]
    [({'start': 1}, 'fault can follow, which nobody controls and breaks calm')]
    """
    found: dict[str, Row] = {}
    for reason in islice(disabled, explained):
        event, why = plain_event(reason.event), brief(reason, known)
        row = found.setdefault(why, Row(why))
        row.events[event] += 1
        if len(row.examples) < _EXAMPLES:
            row.examples.append((tuple(event for event in reason.word if event in known), event))
    ordered = sorted(found.values(), key=lambda row: -row.events.total())
    automaton = disabled.supervisor.automaton
    choices = automaton.delta[:, automaton.alphabet.controllable]
    return DisabledTable(
        tuple(ordered[:rows]),
        max(0, len(ordered) - rows),
        len(disabled),
        min(len(disabled), explained),
        {plain_event(event): both for event, both in disabled.counts().items()},
        len(disabled) > 0 and bool((choices == NONE).all()),
    )


def brief(reason: Reason, known: Collection[str]) -> str:
    """Say in few words why an event is disabled: which rule breaks, through what that nobody controls."""
    through = {step.event for step in reason.steps if step.how == "uncontrollable"}
    surprises = listed(event for event in known if event in through)
    last = reason.breaks[0].event if reason.end == "break" and reason.kind != "breaks a rule" else ""
    first = f"{surprises} can follow, which nobody controls, and then " if surprises else ""
    after, rules = first or "after it ", listed(_rules(reason))
    match reason.kind:
        case "blocking":
            return f"{after}what has to be completed never can be"
        case "no choice" if last in known:
            return f"{after}every choice can lead to {last}, which nobody controls and breaks {rules}"
        case "no choice":
            return f"{after}every choice leads to breaking {rules or 'a rule'}"
        case "uncontrollable":
            can = "can happen" if first else "can follow"
            return f"{first}{last} {can}, which nobody controls and breaks {rules}"
    if not all(b.at_once for b in reason.breaks):
        return f"after it {rules} could never be completed"
    return f"it breaks {rules}"


def listed(names: Iterable[str]) -> str:
    """Return names as a list in words.

    Examples
    --------
    >>> listed("ab"), listed("abc")
    ('a and b', 'a, b and c')
    """
    *most, last = [*names] or [""]
    return f"{', '.join(most)} and {last}" if most else last


def plain_event(event: str) -> str:
    """Return what is chosen by an event of an observed plant, "?a" of one that does not show."""
    return event.removeprefix("?")


def _rules(reason: Reason) -> tuple[str, ...]:
    return tuple(dict.fromkeys(b.rule for b in reason.breaks))

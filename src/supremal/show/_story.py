"""The shortest counterexample, told as a story: what happens, who decides it, and how it ends."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from supremal.show.disabled import listed

_SIGHT: Final = re.compile(r"@(\d+)$")
Who = Literal["agent", "nobody", "seen"]


@dataclass(frozen=True, slots=True)
class Story:
    """A word, event by event with who decides it, and the sentence with which it ends.

    ``last`` is the event that breaks a rule and that nobody controls, "" where it ends in another way.
    """

    steps: tuple[tuple[str, Who], ...]
    last: str
    end: str


def story(check: Mapping[str, Any], free: Collection[str]) -> Story | None:
    """Return the story of a check's shortest counterexample, None where there is none.

    Parameters
    ----------
    check
        What a result says of it.
    free
        The events that nobody controls.

    Examples
    --------
    >>> breach = {"word": ["start"], "event": "fault", "breaks": [{"event": "fault", "rule": "calm"}]}
    >>> told = story({"together": {"witness": breach}}, {"fault"})
    >>> told.steps, told.last, told.end
    ((('start', 'agent'),), 'fault', 'fault can happen now. Nobody controls it, and it breaks calm.')
    """
    together, reason = check.get("together") or {}, check.get("reason") or {}
    breach, deadlock, blocking = (together.get(key) for key in ("witness", "deadlock", "blocking"))
    if breach:
        rules = _rules(breach)
        end = f"{breach['event']} can happen now. Nobody controls it, and it breaks {rules or 'the rule'}."
        return Story(_steps(breach, free), breach["event"], end)
    if deadlock:
        tried = listed(dict.fromkeys(b["event"].removeprefix("?") for b in deadlock.get("breaks") or ()))
        broken = f": {tried} would break {_rules(deadlock)}" if tried else ""
        return Story(_steps(deadlock, free), "", f"The agent has to act now, and has no choice left{broken}.")
    if blocking:
        waiting = listed(f"{name} in {state}" for name, state in blocking.get("waiting") or ())
        end = "From here on, what has to be completed never can be."
        return Story(_steps(blocking, free), "", f"{end} Not complete: {waiting}." if waiting else end)
    if reason.get("text"):
        text = str(reason["text"])
        chain = [step["event"] for step in reason.get("chain") or ()]
        return Story(told_word(chain, free), "", f"{text[:1].upper()}{text[1:]}.")
    return None


def _rules(found: Mapping[str, Any]) -> str:
    return listed(dict.fromkeys(b["rule"] for b in found.get("breaks") or ()))


def _steps(found: Mapping[str, Any], free: Collection[str]) -> tuple[tuple[str, Who], ...]:
    return told_word(found.get("word") or (), free)


def told_word(word: Iterable[str], free: Collection[str]) -> tuple[tuple[str, Who], ...]:
    """Return the events of a word with who decides them; what an observed plant adds is told plainly."""
    steps: list[tuple[str, Who]] = []
    for event in word:
        sight = _SIGHT.match(event)
        if sight and event not in free:
            steps.append((f"state {sight[1]}", "seen"))
        elif event.startswith("?"):
            steps.append((event[1:], "agent"))
        elif not event.startswith("!"):
            steps.append((event, "nobody" if event in free else "agent"))
    return tuple(steps)

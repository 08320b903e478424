"""A rule's text and its automaton, compared on all words at once.

What the text means is followed beside the automaton: forwards, or from the end of a word beside the set of
states from which the rest is accepted.  All pairs that there are get visited, and in each of them both accept
or neither does.  That is enough, since the automaton has to be trim: what is reached leads to a marked state.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import Any, Final

from .expressions import expression_meaning
from .formulas import formula_meaning
from .patterns import pattern_meaning
from .texts import NONE, Budget, Meaning, TextError, TooLargeError

TEXTS: Final = {"pattern": pattern_meaning, "regex": expression_meaning, "ltlf": formula_meaning}
"""The forms of a rule that have a text."""

DRAWN: Final = ("automaton", "safe", "unsafe")
"""The forms in which the automaton is all that is said."""


def find_difference(rule: Mapping[str, Any]) -> str | None:
    """Return what is wrong with the automaton of a rule by its text, None where they agree.

    Parameters
    ----------
    rule
        An entry of the certificate's ``rules``.

    Raises
    ------
    TooLargeError
        If the text takes too many steps to work out.

    Examples
    --------
    >>> once = {"form": "regex", "text": "b* (a b*)?", "events": ["a", "b"], "delta": [[1, 0], [-1, 1]]}
    >>> find_difference(once | {"marked": [0, 1]})
    >>> find_difference(once | {"marked": [1]})
    'its text allows the empty word, its automaton does not accept it'
    """
    form, text, events = rule["form"], rule["text"], rule["events"]
    if form in DRAWN:
        return (
            f"the automaton is all that is said, and {text!r} says more; no text is needed" if text else None
        )
    if form not in TEXTS:
        return f"{form!r} is no form of a rule; one of {', '.join((*TEXTS, *DRAWN))} is needed"
    marked = frozenset(rule["marked"])
    stuck = _stuck(rule["delta"], marked)
    if stuck != NONE:
        return f"state {stuck} of its automaton leads to no marked state; what leads to it is to be left out"
    nothing = [NONE] * len(events)  # the last row, that of NONE
    rows = [dict(zip(events, row, strict=True)) for row in (*rule["delta"], nothing)]
    budget = Budget()
    try:
        word = _find_word(TEXTS[form](text, frozenset(events), budget), events, rows, marked, budget)
    except (TextError, KeyError, TypeError, ValueError) as error:
        return f"its text {text[:80]!r} cannot be read: {error}"
    except RecursionError:
        message = "too large to check: its text is nested too deeply"
        raise TooLargeError(message) from None
    if word is None:
        return None
    state = 0
    for event in word:
        state = rows[state][event]
    said = " ".join(word) or "the empty word"
    if state in marked:
        return f"its automaton accepts {said}, its text does not allow it"
    return f"its text allows {said}, its automaton does not accept it"


def _stuck(delta: list[list[int]], marked: frozenset[int]) -> int:
    """Return a state that can be reached and leads to no marked one, `NONE` where there is none."""
    into: dict[int, list[int]] = {}
    for state, row in enumerate(delta):
        for target in row:
            into.setdefault(target, []).append(state)
    reached = _spread([0][: len(delta)], lambda state: [q for q in delta[state] if q != NONE])
    live = _spread(marked, lambda state: into.get(state, []))
    return min(reached - live, default=NONE)


def _spread(start: Iterable[int], steps: Callable[[int], Iterable[int]]) -> set[int]:
    found = {*start}
    queue = [*found]
    for state in queue:  # grows while it is walked through
        fresh = {*steps(state)} - found
        found |= fresh
        queue += fresh
    return found


def _find_word(
    meaning: Meaning,
    events: Sequence[str],
    rows: Sequence[Mapping[str, int]],
    marked: frozenset[int],
    budget: Budget,
) -> list[str] | None:
    """Return a shortest word on which a text and an automaton do not agree."""

    def before(accepting: frozenset[int], event: str) -> frozenset[int]:
        budget.spend(len(rows))
        return frozenset(q for q, row in enumerate(rows) if row[event] in accepting)

    start: Any
    follow: Callable[[Any, str], Any]
    accepts: Callable[[Any], bool]
    if meaning.backwards:
        start, follow, accepts = marked, before, lambda accepting: 0 in accepting
    else:
        start, follow, accepts = 0, lambda q, event: rows[q][event], marked.__contains__
    alike: dict[Hashable, str] = {}  # one event of each sort that neither can tell apart
    sets = set(meaning.sets)
    for event in events:
        alike.setdefault((*(event in one for one in sets), *(row[event] for row in rows)), event)
    first = meaning.start, start
    found = {first}
    queue: list[tuple[Any, Any]] = [(first, ())]  # with the word, linked from its last letter on
    for (said, q), word in queue:  # grows while it is walked through
        if meaning.accepts(said) != accepts(q):
            letters: list[str] = []
            while word:
                event, word = word  # noqa: PLW2901 - letter by letter
                letters.append(event)
            return letters if meaning.backwards else letters[::-1]
        for event in alike.values():
            after = meaning.step(said, event), follow(q, event)
            if after not in found:
                found.add(after)
                queue.append((after, (event, word)))
    return None

"""What a formula says, in plain English.

A phrase is said about *now*, the moment that the operators around it have led to.  Where an event is known to
happen now, another one cannot, so "now or" is left out of "b happens now or within the next 5 events".
"""

from __future__ import annotations

from typing import Final

from supremal.rules._ltlf_parser import AHEAD, Tree

MAX_SIZE: Final = 25
"""The most nodes of a tree that is easier to read in words."""

_LINKS: Final = {"&": " and ", "|": " or ", "<->": " exactly when "}
_NOW_TO_NEXT: Final = {
    ("X", "event"): "{} comes next",
    ("N", "event"): "{} comes next, if anything does",
    ("Y", "event"): "{} came just before",
    ("Z", "event"): "{} came just before, if anything did",
    ("X", "!event"): "something other than {} comes next",
    ("N", "!event"): "{} does not come next",
    ("Y", "!event"): "something other than {} came just before",
    ("Z", "!event"): "{} did not come just before",
    ("X", "true"): "something follows",
    ("N", "false"): "nothing follows",
    ("Y", "true"): "something came before",
    ("Z", "false"): "nothing came before",
    "X": "another event follows, and at it {}",
    "N": "at the next event, if there is one, {}",
    "Y": "another event came before, and at it {}",
    "Z": "at the event before, if there was one, {}",
}
_FROM_NOW_ON: Final = {
    ("F", "event"): "{} happens sooner or later",
    ("O", "event"): "{} has happened {now or }before",
    "F": "sooner or later {}",
    "G": "from now on {}",
    "O": "at some moment so far {}",
    "H": "at every moment so far {}",
}
_NEARBY: Final = {
    ("F", "event"): "{} happens {now or }within {reach}",
    ("O", "event"): "{} has happened {now or }within {reach}",
    "F": "{now or }at one of {reach} {}",
    "O": "{now or }at one of {reach} {}",
    "G": "{now and }for {reach} {}",
    "H": "{now and }for {reach} {}",
}
_TWO: Final = {
    "U": "{} until {}, and that has to come",
    "W": "{} until {}, or to the end",
    "R": "{1} until and when {0}, or to the end",
    "M": "{1} until and when {0}, and that has to come",
    "S": "{} ever since {}",
    "B": "{} ever since {}, or from the start",
    "T": "{1} when and ever since {0}, or from the start",
}


def sentence(tree: Tree) -> str:
    """Return what ``tree`` says of a word, with a full stop.

    Examples
    --------
    >>> from supremal.rules._ltlf_parser import parse
    >>> sentence(parse("G (a -> X b) & F !c"))
    'At every moment: if a happens, then b comes next. At some moment: c does not happen.'
    """
    op, parts = tree.op, tree.parts
    if op == "&":
        return " ".join(map(sentence, parts))
    if op not in ("F", "G"):
        return f"{'From' if op in 'UWRM' else 'At'} the start: {_say(tree)}."
    if tree.bound is not None:
        some = "one" if op == "F" else "each"
        return f"At {some} of the first {tree.bound + 1:,} events: {_say(parts[0])}."
    if op == "G" and parts[0].op == "!":
        return f"At no moment: {_say(parts[0].parts[0])}."
    return f"At {'some' if op == 'F' else 'every'} moment: {_say(parts[0])}."


def _say(tree: Tree, now: frozenset[str] = frozenset()) -> str:
    """Return what ``tree`` says; ``now`` are events of which one is known to happen."""
    op, parts = tree.op, tree.parts
    if op in ("true", "false"):
        return "anything goes" if op == "true" else "nothing will do"
    if op == "event":
        return f"{_listed(tree.events)} happens"
    if op == "!":
        return _denied(parts[0], now)
    if op == "->":
        known = frozenset(parts[0].events) if parts[0].op == "event" else now
        return f"if {_part(parts[0])}, then {_part(parts[1], known)}"
    if op in _LINKS:
        return _LINKS[op].join(_part(part, now) for part in parts)
    if len(parts) == 1:
        return _of_one(op, parts[0], tree.bound, now)
    text = _TWO[op].format(*map(_part, parts))
    return text if tree.bound is None else f"{text}, within {_reach(op, tree.bound)}"


def _part(tree: Tree, now: frozenset[str] = frozenset()) -> str:
    """Return what ``tree`` says, in brackets where it has several parts."""
    text = _say(tree, now)
    return f"({text})" if len(tree.parts) > 1 else text


def _of_one(op: str, part: Tree, bound: int | None, now: frozenset[str]) -> str:
    """Return what an operator with one part says."""
    if bound == 0:
        return _part(part, now)
    table = _NOW_TO_NEXT if op in "XNYZ" else _FROM_NOW_ON if bound is None else _NEARBY
    inner = part.parts[0] if part.op == "!" else part
    kind = part.op.replace("!", "!event") if inner.op == "event" else part.op
    template = table.get((op, kind))
    text = _listed(inner.events) if template and inner.events else _part(part)
    template = template or table[op]
    # Now it is decided: another event happens, which settles that none of these does.
    decided = now and now.isdisjoint(inner.events) and kind == ("!event" if op in "GH" else "event")
    for words in ("now or ", "now and "):
        template = template.replace(f"{{{words}}}", "" if decided else words)
    return template.format(text, reach=_reach(op, bound or 0))


def _reach(op: str, bound: int) -> str:
    side = "next" if op in AHEAD else "last"
    return f"the {side} event" if bound == 1 else f"the {side} {bound:,} events"


def _denied(tree: Tree, now: frozenset[str]) -> str:
    if tree.op != "event":
        return f"it is not so that {_part(tree, now)}"
    if len(tree.events) == 1:
        return f"{tree.events[0]} does not happen"
    return f"none of {_listed(tree.events, ' and ')} happens"


def _listed(events: tuple[str, ...], last: str = " or ") -> str:
    return last.join(filter(None, (", ".join(events[:-1]), events[-1])))

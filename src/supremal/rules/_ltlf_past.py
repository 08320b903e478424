"""The past as a few numbers that each event brings up to date.

Whether Y φ or φ S[<=k] ψ holds now depends on the present, and on one number about the moment before: for Y,
whether φ held then; for S, for how many more moments its ψ would still be near enough.  -1 says no, also
where there was no moment before.

Source: Havelund, Roşu, "Synthesizing monitors for safety properties", TACAS 2002.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

from supremal.rules._ltlf_formulas import LOOKING_BACK, UNBOUNDED, Formulas

Memory: TypeAlias = tuple[int, ...]

_NO = -1


class Past:
    """The truth of ``nodes`` that look back, from event to event.

    Examples
    --------
    >>> from supremal.rules._ltlf_parser import parse
    >>> core = Formulas()
    >>> past = Past(core, [core.of_tree(parse("O[<=1] a")) >> 1])
    >>> memory, truths = past.step(past.start, "a")
    >>> for event in "bb":
    ...     memory, truths = past.step(memory, event)
    ...     print(memory, truths)
    (0,) (True,)
    (-1,) (False,)
    """

    def __init__(self, core: Formulas, nodes: Iterable[int]) -> None:
        self.core, self.roots = core, sorted(nodes)
        inside = set(self.roots)
        for number in range(max(inside, default=0), -1, -1):  # wholes before parts
            if number in inside:
                inside.update(part >> 1 for part in core.nodes[number].parts)
        self._order = sorted(inside)
        self.start: Memory = tuple(_NO for number in self._order if core.nodes[number].op in LOOKING_BACK)

    def step(self, memory: Memory, event: str) -> tuple[Memory, tuple[bool, ...]]:
        """Return what to remember after ``event``, and which of the nodes hold at it."""
        before = iter(memory)
        after: list[int] = []
        truth: dict[int, bool] = {}

        def holds(formula: int) -> bool:
            return truth[formula >> 1] ^ bool(formula & 1)

        for number in self._order:
            op, parts, events, bound = self.core.nodes[number]
            match op:
                case "event":
                    truth[number] = event in events
                case "previous":
                    truth[number] = next(before) != _NO
                    after.append(0 if holds(parts[0]) else _NO)
                case "since":
                    left = next(before)
                    if holds(parts[1]):
                        left = bound
                    elif left != _NO and holds(parts[0]):
                        left -= bound != UNBOUNDED
                    else:
                        left = _NO
                    truth[number] = left != _NO
                    after.append(left)
                case _:
                    truth[number] = all(map(holds, parts))
        return tuple(after), tuple(truth[number] for number in self.roots)

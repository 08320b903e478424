"""Models as tables: where each edge leads, and what there is of everything."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Final, NamedTuple

import numpy as np

from supremal._arrays import NONE
from supremal.automata.automaton import Automaton
from supremal.decisions.reward_machine import RewardMachine
from supremal.show._text import escape, shorten

_LONG: Final = 60  # letters of a name


class Row(NamedTuple):
    """One line of a table of transitions: ``what`` leads from one state to another."""

    source: str
    what: str
    target: str


def rows_of(model: Automaton | RewardMachine, states: Iterable[int] | None = None) -> list[Row]:
    r"""Return the edges of a model, those of ``states`` only if they are given, in the order of their states.

    The name of the initial state has an arrow before it, that of a marked state (where not all are marked) an
    asterisk behind it, and an event that nobody controls an exclamation mark.

    Examples
    --------
    >>> from supremal import from_text
    >>> lamp = from_text("marked dark \n uncontrollable burn \n dark -on-> lit \n lit -burn, off-> dark")
    >>> for row in rows_of(lamp):
    ...     print(*row, sep=" | ")
    → dark * | on | lit
    lit | burn!, off | → dark *
    """
    if isinstance(model, RewardMachine):
        kept = set(range(len(model.states)) if states is None else states)
        names = [f"→ {name}" if u == 0 else name for u, name in enumerate(map(_short, model.states))]
        called = dict(zip(model.states, names, strict=True))
        inside = [edge for edge in model.edges if model.states.index(edge.source) in kept]
        return [Row(called[e.source], f"{_short(e.guard)}, {e.reward:g}", called[e.target]) for e in inside]
    sigma, some = model.alphabet, bool((~model.marked).any())

    def name(s: int) -> str:
        mark = " *" if some and model.marked[s] else ""
        return f"{'' if s else '→ '}{_short(model.state_name(s))}{mark}"

    found = []
    for s in range(model.n_states) if states is None else states:
        ways: dict[int, list[str]] = {}
        for e in np.flatnonzero(model.delta[s] != NONE).tolist():
            event = sigma.names[e]
            said = f"{_short(event)}{'!' if event in sigma.uncontrollable else ''}"
            ways.setdefault(int(model.delta[s, e]), []).append(said)
        found += [Row(name(s), ", ".join(events), name(t)) for t, events in ways.items()]
    return found


def facts_of(model: Automaton | RewardMachine) -> dict[str, str]:
    r"""Return how much there is of what in a model.

    Examples
    --------
    >>> from supremal import from_text
    >>> facts_of(from_text("uncontrollable b \n 0 -a-> 1 \n 1 -b-> 0"))
    {'states': '2', 'transitions': '2', 'events': '2, of which nobody controls b'}
    """
    if isinstance(model, RewardMachine):
        return {
            "states": f"{len(model.states):,}",
            "edges": f"{len(model.edges):,}",
            "propositions": _listed(model.propositions) or "none",
        }
    sigma, marked = model.alphabet, int(np.count_nonzero(model.marked))
    some = f", {marked:,} of them marked" if marked < model.n_states else ""
    free = [name for name in sigma if name in sigma.uncontrollable]
    nobody = f", of which nobody controls {_listed(free)}" if free else ""
    return {
        "states": f"{model.n_states:,}{some}",
        "transitions": f"{model.n_transitions:,}",
        "events": f"{len(sigma):,}{nobody}",
    }


def html_table(
    head: Sequence[str], rows: Iterable[Sequence[object]], *, most: int = 20, caption: str = ""
) -> str:
    """Return an HTML table of at most so many rows, with everything in it escaped.

    Examples
    --------
    >>> html_table(["a"], [["<b>"]])
    '<table><thead><tr><th>a</th></tr></thead><tbody><tr><td>&lt;b&gt;</td></tr></tbody></table>'
    """
    lines = list(rows)
    body = "".join(_line("td", row) for row in islice(lines, most))
    if len(lines) > most:
        body += f'<tr><td colspan="{len(head) or 2}">and {len(lines) - most:,} more</td></tr>'
    above = f"<caption>{escape(caption)}</caption>" if caption else ""
    top = f"<thead>{_line('th', head)}</thead>" if head else ""
    return f"<table>{above}{top}<tbody>{body}</tbody></table>"


def _line(tag: str, cells: Sequence[object]) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(shorten(str(cell), 400))}</{tag}>" for cell in cells) + "</tr>"


def _short(name: str) -> str:
    return shorten(name, _LONG)


def _listed(names: Sequence[str], most: int = 12) -> str:
    tail = f", … ({len(names):,} in all)" if len(names) > most else ""
    return ", ".join(map(_short, names[:most])) + tail

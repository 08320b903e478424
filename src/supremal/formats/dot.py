r"""Graphviz's DOT, ``.dot``: a picture, which is written and not read.

An arrow from nowhere leads to the initial state, marked states have two circles, and an edge of
uncontrollable events is dashed.  Of a model with several automata each is a cluster.

Source: *The DOT Language*, https://graphviz.org/doc/info/lang.html.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import groupby
from typing import Final

import numpy as np

from supremal._arrays import NONE
from supremal.automata.automaton import Automaton
from supremal.decisions.reward_machine import RewardMachine
from supremal.formats._names import part_names, state_names
from supremal.formats.model import Model

_SPECIAL: Final = re.compile(r'[\\"]')


def write(model: Model) -> str:
    r"""Return ``model`` as a directed graph.

    Examples
    --------
    >>> from supremal import from_text
    >>> light = from_text("name light\ndark -on-> lit\nlit -off-> dark\nmarked dark")
    >>> print(write(Model((light,), ())))
    digraph "light" {
      rankdir=LR;
      node [shape=circle];
      "start0" [shape=point, style=invis];
      "0.0" [label="dark", shape=doublecircle];
      "0.1" [label="lit"];
      "start0" -> "0.0";
      "0.0" -> "0.1" [label="on"];
      "0.1" -> "0.0" [label="off"];
    }
    <BLANKLINE>
    """
    return "\n".join(_lines(model)) + "\n"


def write_machine(machine: RewardMachine) -> str:
    r"""Return a reward machine as a directed graph; an edge says its guard and its reward.

    Examples
    --------
    >>> from supremal import reward_machine
    >>> print(write_machine(reward_machine(["c"], [("u", "c", "v", 1.0)], name="coffee")))
    digraph "coffee" {
      rankdir=LR;
      node [shape=circle];
      "start" [shape=point, style=invis];
      "0" [label="u"];
      "1" [label="v"];
      "start" -> "0";
      "0" -> "1" [label="c, 1"];
    }
    <BLANKLINE>
    """
    number = {name: u for u, name in enumerate(machine.states)}
    lines = [f"digraph {_quoted(machine.name or 'rewards')} {{", "  rankdir=LR;", "  node [shape=circle];"]
    lines.append('  "start" [shape=point, style=invis];')
    lines += [f'  "{u}" [label={_quoted(name)}];' for name, u in number.items()]
    lines.append('  "start" -> "0";')
    for edge in machine.edges:
        said = _quoted(f"{edge.guard}, {edge.reward:g}")
        lines.append(f'  "{number[edge.source]}" -> "{number[edge.target]}" [label={said}];')
    return "\n".join([*lines, "}"]) + "\n"


def lacks(model: Model) -> list[str]:  # noqa: ARG001 - every format is asked the same
    """Say what of ``model`` the format cannot hold."""
    return ["anything that could be read back"]


def _quoted(text: str) -> str:
    escaped = _SPECIAL.sub(r"\\\g<0>", text).replace("\n", "\\n")
    return f'"{escaped}"'


def _lines(model: Model) -> Iterator[str]:
    parts = (*model.plants, *model.specs)
    names = [*part_names(model.plants, "plant"), *part_names(model.specs, "spec")]
    yield f"digraph {_quoted(names[0] if len(parts) == 1 else 'model')} {{"
    yield from ["  rankdir=LR;", "  node [shape=circle];"]
    for k, part in enumerate(parts):
        if len(parts) == 1:
            yield from (f"  {line}" for line in _graph(part, k))
            continue
        yield f"  subgraph {_quoted(f'cluster{k}')} {{"
        yield f"    label={_quoted(names[k])};"
        yield from (f"    {line}" for line in _graph(part, k))
        yield "  }"
    yield "}"


def _graph(part: Automaton, k: int) -> Iterator[str]:
    sigma = part.alphabet
    if part.n_states:
        yield f'"start{k}" [shape=point, style=invis];'
    for s, name in enumerate(state_names(part)):
        yield f'"{k}.{s}" [label={_quoted(name)}{", shape=doublecircle" if part.marked[s] else ""}];'
    if part.n_states:
        yield f'"start{k}" -> "{k}.0";'
    ends = [(s, int(part.delta[s, e]), e) for s, e in np.argwhere(part.delta != NONE).tolist()]
    for (source, target), edges in groupby(sorted(ends), key=lambda edge: edge[:2]):
        events = [sigma.names[e] for *_, e in edges]
        dashed = ", style=dashed" if sigma.uncontrollable.issuperset(events) else ""
        yield f'"{k}.{source}" -> "{k}.{target}" [label={_quoted(", ".join(events))}{dashed}];'

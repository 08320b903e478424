r"""Models of Storm, ``.drn``: text, direct encoding.

::

    // supremal: labels init goal terminal deadlock broken
    @type: MDP
    @value_type: double
    @parameters

    @reward_models
    reward
    @nr_states
    2
    @nr_choices
    2
    @model
    state 0 init
     action go [-1.0]
      0 : 0.5
      1 : 0.5
    state 1 goal terminal
     action stay [0.0]
      1 : 1.0

The reward of a choice is its expected one, which is all that expected totals depend on; branches of a choice
to the same state are one.  Numbers have all digits that a double needs.  Words of events have no place.
A label that no state has is unknown to Storm; a comment names them all.

Read are MDPs and Markov chains with at most one reward, of states, of choices or of both.

Source: the Storm model checker, documentation of the DRN format.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from supremal._arrays import Longs
from supremal.formats._explicit import REWARD, Explicit, merged
from supremal.formats._explicit_text import MAX_STATE, Gathered, probability, real
from supremal.formats._names import EMPTY, escape, unescape
from supremal.formats._page import Page, Word, decode, shown
from supremal.formats.model import MAX_BYTES, read_bytes

_BAD: Final = re.compile(r'[\s"\[\]\x00-\x1f\x7f]')
_UNLABELLED: Final = "__NOLABEL__"
_CHUNK: Final = 1 << 15

_LABEL: Final = re.compile(r'"([^"]+)"|([^\s"]+)')
_STATE: Final = re.compile(r'state ([0-9]{1,8})(?: +\[([^\]]*)\])?((?: +(?:"[^"]+"|[^\s"\[][^\s"]*))*)\s*')
_ACTION: Final = re.compile(r"\s*action (\S+)(?: +\[([^\]]*)\])?\s*")
_BRANCH: Final = re.compile(r"\s*([0-9]{1,8}) : (\S+)\s*")
_HEADER: Final = re.compile(
    r"@(type|value_type): (\S+)\s*|@(parameters|reward_models|nr_states|nr_choices|model)\s*"
)
_SAID: Final = "// supremal: labels"
_NEEDED: Final = ("type", "nr_states")
_TYPES: Final = {"MDP": False, "DTMC": True}


def write(model: Explicit) -> dict[str, Iterator[str]]:
    """Return the text of the file, in pieces."""
    return {".drn": _text(merged(model))}


def _text(model: Explicit) -> Iterator[str]:
    yield "\n".join(
        [
            " ".join([_SAID, *map(_name, model.labels)]),
            f"@type: {'DTMC' if model.chain else 'MDP'}",
            *("@value_type: double", "@parameters", ""),
            *("@reward_models", REWARD),
            *("@nr_states", str(model.n_states)),
            *("@nr_choices", str(len(model.action))),
            *("@model", ""),
        ]
    )
    labels = np.full(model.n_states, "", object)
    for name, held in model.labels.items():
        labels[held] += f" {_name(name)}"
    actions = ["0"] if model.chain else [_name(name) for name in model.actions]
    tails = [f"{actions[a]} [{r!r}]" for a, r in zip(model.action.tolist(), model.gain.tolist(), strict=True)]
    for first in range(0, model.n_states, _CHUNK):
        states = np.arange(first, min(first + _CHUNK, model.n_states))
        choices = np.arange(model.choice[states[0]], model.choice[states[-1] + 1])
        branches = slice(model.branch[choices[0]], model.branch[choices[-1] + 1])
        ends = zip(model.target[branches].tolist(), model.prob[branches].tolist(), strict=True)
        lines = _interleaved(
            [f"state {s}{held}" for s, held in zip(states.tolist(), labels[states], strict=True)],
            [f"\taction {tail}" for tail in tails[choices[0] : choices[-1] + 1]],
            [f"\t\t{t} : {p!r}" for t, p in ends],
            np.diff(model.choice[states[0] : states[-1] + 2]),
            np.diff(model.branch[choices[0] : choices[-1] + 2]),
        )
        yield "\n".join(lines) + "\n"


def _interleaved(
    states: list[str], choices: list[str], branches: list[str], fan: Longs, width: Longs
) -> list[str]:
    """Return the lines in order, where states have ``fan`` choices each, and choices ``width`` branches.

    A line stands behind as many others as there are states, choices and branches that begin before it.
    """
    lines = np.empty(len(states) + len(choices) + len(branches), object)
    state_of, number = np.repeat(np.arange(len(states)), fan), np.arange(len(choices))
    begin = np.cumsum(width) - width
    heads = state_of + 1 + number + begin
    lines[heads] = choices
    lines[heads[np.cumsum(fan) - fan] - 1] = states
    lines[np.repeat(heads + 1 - begin, width) + np.arange(len(branches))] = branches
    found: list[str] = lines.tolist()
    return found


def _name(name: str) -> str:
    return escape(name, _BAD) or EMPTY


def read(path: Path) -> Explicit:
    """Return the model in a file."""
    page = decode(read_bytes(path, MAX_BYTES), str(path))
    lines = page.lines()
    header = _header(page, lines)
    kind, rewards = header["type"], header.get("reward_models", Word("", 0))
    if kind.text not in _TYPES:
        page.fail(f"the model is of type {shown(kind.text)}; {' and '.join(_TYPES)} are read", kind.where)
    if len(rewards.text.split()) > 1:
        page.fail("the file has several rewards, and one is read; leave out the others", rewards.where)
    count = page.number(header["nr_states"], "the number of states", MAX_STATE)
    model = Gathered(chain=_TYPES[kind.text])
    model.labels = {unescape(name): [] for name in header.get("labels", Word("", 0)).text.split()}
    _body(page, lines, model, count)
    said = header.get("nr_choices")
    if said is not None and said.text.strip() != str(len(model.state)):
        page.fail(f"@nr_choices is {shown(said.text)}, and there are {len(model.state)} actions", said.where)
    return model.explicit(count)


def _header(page: Page, lines: Iterator[Word]) -> dict[str, Word]:
    """Return what the lines up to ``@model`` say."""
    header: dict[str, Word] = {}
    for line in lines:
        if line.text.startswith(_SAID):
            header["labels"] = Word(line.text.removeprefix(_SAID), line.where)
        if not line.text.strip() or line.text.startswith("//"):
            continue
        found = _HEADER.fullmatch(line.text)
        if found is None:
            page.fail(f"{shown(line.text)} is no line of the header of a DRN file", line.where)
        name = found[1] or found[3]
        if name == "model":
            break
        if name in header:
            page.fail(f"@{name} stands twice; keep one of the two", line.where)
        value = next(lines, Word("", line.where)) if found[3] else Word(found[2], line.where + found.start(2))
        header[name] = Word(value.text.strip(), value.where)
    else:
        page.fail("the file has no line '@model'")
    for name in _NEEDED:
        if name not in header:
            page.fail(f"the header has no @{name}")
    if header.get("parameters", Word("", 0)).text:
        page.fail(
            "the model has parameters, and numbers are needed in their place", header["parameters"].where
        )
    return header


def _body(page: Page, lines: Iterator[Word], model: Gathered, count: int) -> None:
    """Read states, each with its actions, each with its branches."""
    state, of_state, reward, due = -1, 0.0, 0.0, "a state"
    for line in lines:
        if branch := _BRANCH.fullmatch(line.text):
            if due not in ("a branch", ""):
                page.fail(f"a branch stands where {due} is due", line.where)
            target = int(branch[1])
            if target >= count:
                page.fail(f"state {target} is none of the {count} states", line.where + branch.start(1))
            model.branch(target, probability(page, branch[2], line.where + branch.start(2)), reward)
            due = ""
        elif not line.text.strip() or line.text.startswith("//"):
            continue
        elif action := _ACTION.fullmatch(line.text):
            if due not in ("an action", ""):
                page.fail(f"an action stands where {due} is due", line.where)
            unnamed = model.chain or action[1] == _UNLABELLED
            model.open(state, "" if unnamed else unescape(action[1]))
            reward = of_state + _reward(page, action[2], line.where + action.start(2))
            due = "a branch"
        elif named := _STATE.fullmatch(line.text):
            state += 1
            if due not in ("a state", "") or named[1] != str(state) or state >= count:
                what = due or (f"state {state}" if state < count else f"the end, after {count} states,")
                page.fail(f"state {named[1]} stands where {what} is due", line.where)
            of_state = _reward(page, named[2], line.where + named.start(2))
            for label in _LABEL.finditer(named[3]):
                model.labels.setdefault(unescape(label[1] or label[2]), []).append(state)
            due = "an action"
        else:
            page.fail(f"{shown(line.text.strip())} is no state, action or branch", line.where)
    if due or state < count - 1:
        page.fail(f"the file ends where {due or f'state {state + 1}'} is due")


def _reward(page: Page, text: str | None, where: int) -> float:
    return 0.0 if text is None else real(page, text.strip(), where, "a reward")

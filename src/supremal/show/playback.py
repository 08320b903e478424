"""What a page needs to play episodes: the parts that stay, and what each step changes.

A `Step` is a moment of an episode: the states of the rules, what may be chosen and what may not, each with
its reason, and what led there.  `playback_document` writes all of it as one JSON value in which names
and texts stand once and steps count in them; ``templates/stage.js`` draws a step of it, and
``templates/player.js`` moves through episodes.

The document::

    {"names": [...], "free": [...],             events and actions; those that nobody controls
     "parts": [{"name", "states", "kind"}],     rules, then the reward machine: kind "rule" or "machine"
     "facts": [...],                            what the lines below the board are called
     "texts": [...],
     "reels": [{"title", "note", "episodes": [{"title", "steps": [STEP]}]}]}

and a STEP::

    {"at": [...],                     the state of each part, -1 where it is broken
     "can": [...], "may": [...],      names: enabled; nobody controls it, and it can happen
     "not": [[name, text], ...],      disabled, and why
     "next": name,                    what is chosen here; left out at the end
     "did": name,                     what was chosen before; left out where nothing was
     "word": [...], "reward": r,      what happened then; left out at the start
     "tokens": [[x, y, angle, size, look], null, ...],
     "facts": [text, ...], "text": text}   left out where there are none
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Literal

from supremal.show.board import Board, Place


@dataclass(frozen=True, slots=True)
class Part:
    """An automaton that follows: a rule or the reward machine, with the names of its states."""

    name: str
    states: tuple[str, ...]
    kind: Literal["rule", "machine"] = "rule"


@dataclass(frozen=True, slots=True)
class Look:
    """What an environment looks like at a moment.

    ``tokens`` are where those of the board are, ``facts`` what is to be said of it, and ``text`` its own
    drawing, where it has no board.
    """

    tokens: tuple[Place | None, ...] = ()
    facts: tuple[str, ...] = ()
    text: str = ""


@dataclass(frozen=True, slots=True)
class Step:
    """A moment of an episode.

    Parameters
    ----------
    at
        The state of each part, `NONE` where it is broken.
    can, may
        What is enabled; and what can happen that nobody controls.
    cannot
        What is possible and disabled, each with its reason.
    look
        What the environment looks like.
    chosen
        What is chosen here; "" at the end.
    action, word, reward
        What led here: what was chosen ("" where nobody chose), what happened (None at the start), and what
        that earned (None where nothing is earned).
    """

    at: tuple[int, ...]
    can: tuple[str, ...]
    may: tuple[str, ...]
    cannot: tuple[tuple[str, str], ...]
    look: Look
    chosen: str = ""
    action: str = ""
    word: tuple[str, ...] | None = None
    reward: float | None = None


@dataclass(frozen=True, slots=True)
class Episode:
    """An episode, with what it is called."""

    title: str
    steps: tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class Reel:
    """Episodes of one kind, with what it is called and a note that says what is played."""

    title: str
    note: str
    episodes: tuple[Episode, ...]


@dataclass(frozen=True, slots=True)
class Playback:
    """All that can be played.

    Parameters
    ----------
    parts
        The automata that follow.
    reels
        What is played.
    free
        The events that nobody controls.
    board
        The map that tokens move on, None where there is none.
    facts
        What the lines below the board are called.
    """

    parts: tuple[Part, ...]
    reels: tuple[Reel, ...]
    free: frozenset[str] = frozenset()
    board: Board | None = None
    facts: tuple[str, ...] = ()


@dataclass(slots=True)
class _Numbers:
    """Texts in the order in which they first came up."""

    of: dict[str, int] = field(default_factory=dict)

    def __call__(self, text: str) -> int:
        return self.of.setdefault(text, len(self.of))

    def all(self, texts: Iterable[str]) -> list[int]:
        return [self(text) for text in texts]


def playback_document(playback: Playback) -> dict[str, Any]:
    """Return ``playback`` as a JSON value; see the module for its layout.

    Examples
    --------
    >>> start = Step((0,), ("go",), (), (("stop", "it breaks r"),), Look(), chosen="go")
    >>> end = Step((1,), (), (), (), Look(), action="go", word=("go",), reward=1.0)
    >>> reel = Reel("Sample", "", (Episode("1", (start, end)),))
    >>> document = playback_document(Playback((Part("r", ("a", "b")),), (reel,)))
    >>> document["names"], document["reels"][0]["episodes"][0]["steps"][1]
    (['go', 'stop'], {'at': [1], 'can': [], 'may': [], 'not': [], 'did': 0, 'word': [0], 'reward': 1})
    """
    names, texts = _Numbers(), _Numbers()
    reels = [
        {
            "title": reel.title,
            "note": reel.note,
            "episodes": [
                {"title": episode.title, "steps": [_step(step, names, texts) for step in episode.steps]}
                for episode in reel.episodes
            ],
        }
        for reel in playback.reels
    ]
    return {
        "names": list(names.of),
        "free": [number for name, number in names.of.items() if name in playback.free],
        "parts": [{"name": p.name, "states": list(p.states), "kind": p.kind} for p in playback.parts],
        "facts": list(playback.facts),
        "texts": list(texts.of),
        "reels": reels,
    }


def _step(step: Step, names: _Numbers, texts: _Numbers) -> dict[str, Any]:
    found: dict[str, Any] = {
        "at": list(step.at),
        "can": names.all(step.can),
        "may": names.all(step.may),
        "not": [[names(name), texts(reason)] for name, reason in step.cannot],
    }
    if step.chosen:
        found["next"] = names(step.chosen)
    if step.action:
        found["did"] = names(step.action)
    if step.word is not None:
        found["word"] = names.all(step.word)
    if step.reward is not None:
        found["reward"] = _number(step.reward)
    if step.look.tokens:
        found["tokens"] = [None if place is None else _place(place) for place in step.look.tokens]
    if step.look.facts:
        found["facts"] = texts.all(step.look.facts)
    if step.look.text:
        found["text"] = texts(step.look.text)
    return found


def _place(place: Place) -> list[float | str]:
    """Return a place without what is as usual at its end."""
    values: list[float | str] = [*map(_number, place[:4]), place.look]
    usual = [None, None, 0, 1, ""]
    while values[-1] == usual[len(values) - 1]:
        values.pop()
    return values


def _number(value: float) -> float:
    """Return ``value`` as short as it can be written."""
    short = round(float(value), 6)
    return int(short) if short.is_integer() else short


def as_island(document: object) -> str:
    r"""Return a JSON value as the text of a ``<script type="application/json">``: no ``<`` ends it early.

    Examples
    --------
    >>> as_island(["</script>"])
    '["\\u003c/script>"]'
    """
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")

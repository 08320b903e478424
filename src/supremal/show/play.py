"""A page on which somebody plays: chooses the next event, and sees what the supervisor allows.

The stage is that of the report's playback, and a moment is one of its steps with the options that there are.
`moment_document` writes it as one JSON value, for which ``templates/play.js`` asks again at each move::

    {"names": [...], "free": [...], "texts": [...], "step": STEP,   see `supremal.show.playback`
     "asked": name,                  the action whose outcome is asked for; "" where the next choice is
     "options": [{"word": [name, ...], "share": "50 %", "tells": text}, ...],
     "chance": k,                    the option that chance takes; -1 where there is none
     "history": [[name, ...], ...],  what has happened, a word at a time
     "score": r}                     what that has earned; null where nothing is earned
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from supremal._arrays import NONE
from supremal.show import _words
from supremal.show._templates import templates, trusted
from supremal.show.board import Place, board_svg
from supremal.show.legend import SIGNS, signs_of
from supremal.show.playback import Episode, Look, Playback, Reel, Step, as_island, playback_document
from supremal.show.report import RuleView

_SCRIPT: Final = re.compile(r"<script>(.*?)</script>", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Option:
    """What can be chosen: an action, an event, or the word of an outcome.

    Parameters
    ----------
    word
        The events, () where nothing happens.
    probability
        Of an outcome; None for what somebody decides.
    tells
        What tells it from others with the same word; "" where nothing has to.
    """

    word: tuple[str, ...]
    probability: float | None = None
    tells: str = ""

    def __str__(self) -> str:
        share = "" if self.probability is None else f", {_words.percent(self.probability)}"
        return f"{' '.join(self.word) or 'nothing'}{share}{self.tells and f': {self.tells}'}"


@dataclass(frozen=True, slots=True)
class Moment:
    """A moment of a game.

    Parameters
    ----------
    step
        What there is to see.
    options
        What can be chosen: first what is enabled, then what nobody controls, or the outcomes of an action.
    asked
        The action whose outcome is chosen here; "" where it is the next event.
    chance
        The option that chance takes, `NONE` where there is none.
    history
        What has happened so far, a word at a time.
    score
        What that has earned; None where nothing is earned.
    """

    step: Step
    options: tuple[Option, ...]
    asked: str = ""
    chance: int = NONE
    history: tuple[tuple[str, ...], ...] = ()
    score: float | None = None


def moment_document(moment: Moment, free: Collection[str]) -> dict[str, Any]:
    """Return a moment as a JSON value; see the module for its layout.

    Examples
    --------
    >>> step = Step((0,), ("go",), ("stop",), (), Look())
    >>> document = moment_document(Moment(step, (Option(("go",)), Option(("stop",)))), {"stop"})
    >>> document["names"], document["free"], document["options"][0]
    (['go', 'stop'], [1], {'word': ['go'], 'share': '', 'tells': ''})
    """
    reel = Reel("", "", (Episode("", (moment.step,)),))
    document = playback_document(Playback((), (reel,), frozenset(free)))
    return {key: document[key] for key in ("names", "free", "texts")} | {
        "step": document["reels"][0]["episodes"][0]["steps"][0],
        "asked": moment.asked,
        "options": [_option(option) for option in moment.options],
        "chance": moment.chance,
        "history": [list(word) for word in moment.history],
        "score": None if moment.score is None else round(moment.score, 6),
    }


def _option(option: Option) -> dict[str, Any]:
    share = "" if option.probability is None else _words.percent(option.probability)
    return {"word": list(option.word), "share": share, "tells": option.tells}


def play_html(result: Mapping[str, Any], scene: Playback, rules: Sequence[RuleView] = ()) -> str:
    """Return the page as text.

    Parameters
    ----------
    result
        What a result says of a task that nothing was learned of.
    scene
        The parts, the board and what the facts are called; nothing is played in it.
    rules
        Pictures and words of the rules, in the order of the scene's parts.

    Notes
    -----
    The page asks ``moment`` beside its own address for what to show; see the module.
    """
    document = playback_document(scene)
    island = {key: document[key] for key in ("parts", "facts")} | {"uncontrollable": sorted(scene.free)}
    return (
        templates()
        .get_template("play.html.j2")
        .render(
            result=result,
            verdict=_words.headline(result),
            views={rule.name: rule for rule in rules},
            places={rule.name: k for k, rule in enumerate(rules)},
            signs={sign: SIGNS[sign] for sign in signs_of(*(rule.svg for rule in rules))},
            board=trusted(board_svg(scene.board)) if scene.board else "",
            island=trusted(as_island(island)),
            free=scene.free,
        )
    )


def content_policy(page: str) -> str:
    r"""Return the Content-Security-Policy under which ``page`` runs its own script, and nothing else.

    Source: W3C, *Content Security Policy Level 3*: a script is allowed by the SHA-256 of its text.

    Examples
    --------
    >>> "script-src 'sha256-" in content_policy("<script>let a = 1</script>")
    True
    """
    hashes = [
        f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
        for script in _SCRIPT.findall(page)
    ]
    return (
        f"default-src 'none'; script-src {' '.join(hashes)}; style-src 'unsafe-inline'; img-src data:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


# --- what tells outcomes apart ----------------------------------------------------------------------------


def tell_apart(
    before: Look, looks: Sequence[Look], *, facts: Sequence[str] = (), tokens: Sequence[str] = ()
) -> list[str]:
    """Return for each of several looks, all after the same one, what only some of them have.

    Parameters
    ----------
    before
        What the world looks like now.
    looks
        What it can look like next.
    facts, tokens
        What facts and tokens are called.

    Examples
    --------
    >>> here, there = Look((Place(0.5, 0.5),)), Look((Place(1.5, 0.5),))
    >>> tell_apart(here, [here, there], tokens=["the agent"])
    ['the agent stays', 'the agent moves right']
    >>> tell_apart(Look(), [Look(facts=("a",)), Look(facts=("b",))], facts=["door"])
    ['door a', 'door b']
    """
    said: list[list[str]] = [[] for _ in looks]
    for k, name in enumerate(tokens):
        places = [look.tokens[k] for look in looks]
        if len(set(places)) > 1:
            for words, place in zip(said, places, strict=True):
                words.append(f"{name} {_moved(before.tokens[k], place)}")
    for k, name in enumerate(facts):
        values = [look.facts[k] for look in looks]
        if len(set(values)) > 1:
            for words, value in zip(said, values, strict=True):
                words.append(f"{name} {value}")
    told = [", ".join(words) for words in said]
    twice = Counter(told)
    return [f"{text} ({k + 1})".lstrip() if twice[text] > 1 else text for k, text in enumerate(told)]


def _moved(before: Place | None, after: Place | None) -> str:
    """Say how a token moves from one place to another."""
    if after is None or before is None:
        return "stays" if after is before else "is gone" if after is None else "appears"
    across, down = round(after.x - before.x), round(after.y - before.y)
    ways = [(across, "right"), (-across, "left"), (-down, "up"), (down, "down")]
    steps = [f"{way} by {far}" if far > 1 else way for far, way in ways if far > 0]
    if steps:
        return f"moves {' and '.join(steps)}"
    return "stays" if after.angle == before.angle else "turns"

"""The report of a run: one HTML page that needs nothing else.

No network and no library: style and script stand inside the page, the pictures are inline SVG, and what is
played is one island of JSON (`supremal.show.playback`).  It reads in light and dark mode, on a phone, on
paper and without JavaScript, where only the playback and the search are missing.  The frame is
``templates/report.html.j2``, and each of its parts is a file of its own; what a run did not reach is missing
there, or shows as "–".
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from supremal.show import _words
from supremal.show._story import story
from supremal.show._templates import templates, trusted
from supremal.show.board import board_svg
from supremal.show.disabled import DisabledTable
from supremal.show.legend import SIGNS, signs_of
from supremal.show.playback import Playback, as_island, playback_document


@dataclass(frozen=True, slots=True)
class Diagram:
    """A picture of the report.

    Parameters
    ----------
    title
        What stands above it.
    svg
        One ``<svg>`` element, as `automaton_svg` and `reward_machine_svg` return it.  It is put into the page
        as it stands, so it must come from a trusted place.
    caption
        A sentence or two that tell what to see.
    """

    title: str
    svg: str
    caption: str = ""


@dataclass(frozen=True, slots=True)
class RuleView:
    """What is shown of a rule beside what a result says of it.

    Parameters
    ----------
    name
        That of the rule.
    svg
        A picture of its automaton, trusted as a `Diagram`'s; "" where it is too large.
    accepted, rejected
        Words that it allows, and words that it forbids; () is that nothing has happened yet.
    """

    name: str
    svg: str = ""
    accepted: tuple[tuple[str, ...], ...] = ()
    rejected: tuple[tuple[str, ...], ...] = ()

    @property
    def wide(self) -> bool:
        """Whether the picture needs a line of its own to be read."""
        size = re.search(r'<svg[^>]* width="(\d+)"', self.svg)
        return size is not None and int(size[1]) > _BESIDE


_BESIDE: Final = 420
"""How wide a picture is that still stands beside what is said of its rule."""


def report_html(
    result: Mapping[str, Any],
    *,
    rules: Sequence[RuleView] = (),
    diagrams: Sequence[Diagram] = (),
    charts: Sequence[str] = (),
    disabled: DisabledTable | None = None,
    playback: Playback | None = None,
    free: Collection[str] = frozenset(),
) -> str:
    """Return the report of ``result`` as the text of one HTML page.

    Parameters
    ----------
    result
        What ``result.json`` holds.  Parts may be missing.
    rules
        Pictures and words of the rules, in the order of the playback's parts.
    diagrams
        Other pictures: the reward machine.
    charts
        The learning curves, each one ``<svg>`` element, as `curves_svg` returns it; trusted, as a diagram's.
    disabled
        What the supervisor disables, and why.
    playback
        Episodes to move through.
    free
        The events that nobody controls.

    Notes
    -----
    All names and texts of ``result`` are escaped.  The same arguments give the same page.

    Examples
    --------
    >>> page = report_html({"supremal": "0.1.0", "check": {"verdict": "enforceable", "rules": []}})
    >>> "The rules can be kept." in page
    True
    """
    idle = disabled is not None and disabled.idle
    page = templates().get_template("report.html.j2")
    return page.render(
        result=result,
        headline=_words.headline(result, idle=idle),
        lede=_words.lede(result),
        gap=_words.gap(result),
        bound=_words.bounds(result),
        told=story(result.get("check") or {}, free),
        views={rule.name: rule for rule in rules},
        places={rule.name: k for k, rule in enumerate(rules)},
        diagrams=diagrams,
        signs={sign: SIGNS[sign] for sign in signs_of(*(rule.svg for rule in rules))},
        charts=[trusted(chart) for chart in charts],
        disabled=disabled,
        playback=playback,
        board=trusted(_start_of(playback)),
        island=trusted(as_island(playback_document(playback))) if playback else "",
        free=frozenset(free),
    )


def _start_of(playback: Playback | None) -> str:
    """Return the map of a playback at its start, "" where there is none."""
    if playback is None or playback.board is None:
        return ""
    return board_svg(playback.board, playback.reels[0].episodes[0].steps[0].look.tokens)

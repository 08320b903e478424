"""The report of a run: one HTML page that needs nothing else.

No network, no script: the style stands inside the page, the pictures are inline SVG.  It reads in light and
dark mode, on a phone and on paper.  Each section is a Jinja block of ``templates/report.html.j2`` and takes
its numbers from the result alone; what a run did not reach is missing there and shows as "–".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from jinja2 import ChainableUndefined, Environment, PackageLoader
from markupsafe import Markup

from supremal.show import _words


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
    wide
        Whether it takes the width of the page.
    """

    title: str
    svg: str
    caption: str = ""
    wide: bool = False


def _trusted(markup: str) -> Markup:
    return Markup(markup)  # noqa: S704 - our own, with all names in it escaped


def _typeset(text: object) -> Markup:
    return _trusted(_words.typeset(str(text)))


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("supremal.show", "templates"),
        autoescape=True,
        undefined=ChainableUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "integer": _words.integer,
        "decimal": _words.decimal,
        "percent": _words.percent,
        "count": _words.count,
        "witness": _words.witness_sentence,
        "signs": _words.signs,
        "sentence": _words.sentence,
        "typeset": _typeset,
    }
    environment.tests["number"] = _words.is_number
    return environment


def report_html(
    result: Mapping[str, Any], *, diagrams: Sequence[Diagram] = (), charts: Sequence[str] = ()
) -> str:
    """Return the report of ``result`` as the text of one HTML page.

    Parameters
    ----------
    result
        What ``result.json`` holds.  Parts may be missing.
    diagrams
        The automata and the reward machine.
    charts
        The learning curves, each one ``<svg>`` element, as `curves_svg` returns it; trusted, as a diagram's.

    Notes
    -----
    All names and texts of ``result`` are escaped.  The same arguments give the same page.

    Examples
    --------
    >>> page = report_html({"supremal": "0.1.0", "check": {"verdict": "enforceable", "rules": []}})
    >>> "The rules can be kept." in page
    True
    """
    shown = [
        {"title": d.title, "svg": _trusted(d.svg), "caption": d.caption, "wide": d.wide} for d in diagrams
    ]
    page = _environment().get_template("report.html.j2")
    return page.render(
        result=result,
        headline=_words.headline(result),
        lede=_words.lede(result),
        gap=_words.gap(result),
        diagrams=shown,
        charts=[_trusted(chart) for chart in charts],
    )

"""The templates of the pages, and the filters that they use."""

from __future__ import annotations

from functools import cache

from jinja2 import ChainableUndefined, Environment, PackageLoader
from markupsafe import Markup

from supremal.show import _words
from supremal.show._story import told_word


def trusted(markup: str) -> Markup:
    """Return markup of our own, in which all names are escaped, as what a template need not escape again."""
    return Markup(markup)  # noqa: S704 - our own, with all names in it escaped


def _typeset(text: object) -> Markup:
    return trusted(_words.typeset(str(text)))


@cache
def templates() -> Environment:
    """Return the environment that all pages are rendered in."""
    environment = Environment(
        loader=PackageLoader("supremal.show", "templates"),
        autoescape=True,
        undefined=ChainableUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "below": _words.below,
        "integer": _words.integer,
        "decimal": _words.decimal,
        "percent": _words.percent,
        "count": _words.count,
        "folded": _words.folded,
        "setting": _words.setting,
        "witness": _words.witness_sentence,
        "signs": _words.signs,
        "sentence": _words.sentence,
        "trusted": trusted,
        "told": told_word,
        "typeset": _typeset,
    }
    environment.tests["number"] = _words.is_number
    return environment

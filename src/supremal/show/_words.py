"""Numbers and findings in words, for the report.

A number that a run did not reach is None (or missing), and is shown as "–".  Nothing here rounds in favour of
the run: a completion of 0.99996 is not called 100 %.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from itertools import chain, groupby
from math import floor, isfinite
from typing import Any, Final, TypeGuard

from supremal.show._story import told_word
from supremal.show._text import escape

MISSING: Final = "\u2013"
_SYMBOL: Final = re.compile(r"(?<![\w-])([^\W\d_])(?:_(\w{1,2})|(\d{1,2}))(?![\w'-])")
_KEPT: Final = {
    "enforceable": "The rules can be kept",
    "enforceable_in_part": "The rules can be kept by forbidding more than they do",
}
_UP: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def is_number(value: object) -> TypeGuard[float]:
    """Tell whether ``value`` is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def integer(value: object) -> str:
    """Return ``value`` with commas: 27,612,345."""
    return f"{value:,.0f}".replace("-", "\u2212") if is_number(value) else MISSING


def decimal(value: object, digits: int = 2) -> str:
    r"""Return ``value`` with ``digits`` decimals; what only they would hide is told with a power of ten.

    Examples
    --------
    >>> decimal(1234.5), decimal(2e-9, 4), decimal(None)
    ('1,234.50', '2\xa0×\xa010⁻⁹', '–')
    """
    if not is_number(value):
        return MISSING
    if value == 0:
        return "0"
    if abs(value) < 0.5 * 10.0**-digits:
        mantissa, power = f"{value:.1e}".split("e")
        text = f"{mantissa.removesuffix('.0')}\u00a0\u00d7\u00a010{str(int(power)).translate(_UP)}"
    else:
        text = f"{value:,.{digits}f}"
    return text.replace("-", "\u2212")


def percent(value: object) -> str:
    """Return a fraction as a percentage; only all is 100 % and only nothing is 0 %.

    Examples
    --------
    >>> percent(1.0), percent(0.9461), percent(0.99999), percent(1e-9)
    ('100\u00a0%', '94.61\u00a0%', '99.99\u00a0%', '<\u00a00.01\u00a0%')
    """
    if not is_number(value):
        return MISSING
    share = 100 * float(value)
    if 0 < share < 0.005:
        return "<\u00a00.01\u00a0%"
    if 99.99 < share < 100:
        share = floor(100 * share) / 100
    return f"{share:.2f}".rstrip("0").rstrip(".") + "\u00a0%"


def setting(value: object) -> object:
    """Return a setting as it is read: a schedule (see `supremal.learning.schedules`) in few words.

    Examples
    --------
    >>> setting({"kind": "exponential", "start": 0.25, "factor": 0.95, "episodes": 10_000})
    '0.25, × 0.95 every 10,000'
    >>> setting({"kind": "visits", "power": 0.55}), setting(0.1), setting(None)
    ('1 / (1 + visits)^0.55', 0.1, '–')
    """
    if value is None:
        return MISSING
    if not isinstance(value, Mapping):
        return value
    start, over = value.get("start"), integer(value.get("episodes"))
    match value.get("kind"):
        case "exponential":
            return f"{start}, \u00d7 {value.get('factor')} every {over}"
        case "linear":
            return f"{start} to {value.get('end')} over {over}"
        case "harmonic":
            return f"{start}, halved after {over}"
        case "visits":
            return f"1 / (1 + visits)^{value.get('power')}"
        case _:
            return setting(start)


def count(value: object, one: str, many: str = "") -> str:
    """Return a number of things: "no violation", "1 violation", "2 violations".

    Examples
    --------
    >>> count(1, "state"), count(0, "state"), count(3, "box", "boxes")
    ('1 state', 'no state', '3 boxes')
    """
    if not is_number(value):
        return f"{MISSING} {many or one + 's'}"
    return f"no {one}" if value == 0 else f"{integer(value)} {one if value == 1 else many or one + 's'}"


def folded(words: Iterable[Iterable[str] | None]) -> str:
    r"""Return words one after the other, an event that comes several times in a row once; None is no word.

    Examples
    --------
    >>> folded([None, ["up"], ["up", "fault"], [], ["up"]])
    'up\xa0×2 fault up'
    """
    runs = ((event, len(list(run))) for event, run in groupby(chain.from_iterable(filter(None, words))))
    return " ".join(event if times == 1 else f"{event}\u00a0×{times}" for event, times in runs)


def witness_sentence(witness: Mapping[str, Any], free: Collection[str] = ()) -> str:
    """Say in words what the shortest witness shows; ``free`` are the events that nobody controls.

    Examples
    --------
    >>> witness_sentence({"word": ["d_u"], "event": "d_u"})
    'after d_u, d_u can happen again, which nobody controls and the rule forbids'
    >>> witness_sentence({"word": ["left", "@8"], "event": "hole"})
    'after left (state 8), hole can happen, which nobody controls and the rule forbids'
    """
    steps, event = told_word(witness.get("word") or (), free), witness.get("event", "an event")
    word = " ".join(f"({name})" if who == "seen" else name for name, who in steps)
    after = f"after {word}" if word else "at once"
    again = " again" if event in (name for name, _ in steps) else ""
    return f"{after}, {event} can happen{again}, which nobody controls and the rule forbids"


def typeset(text: str) -> str:
    """Return ``text`` as HTML in which symbols look as in the diagrams, and all else is escaped.

    Examples
    --------
    >>> typeset("after d_u & <b>")
    'after <i>d</i><sub>u</sub> &amp; &lt;b&gt;'
    """
    return _SYMBOL.sub(lambda at: f"<i>{at[1]}</i><sub>{at[2] or at[3]}</sub>", escape(text))


def signs(text: object) -> str:
    """Return ``text`` with a true minus before numbers.

    Examples
    --------
    >>> signs("-979.3 at 1-10")
    '−979.3 at 1-10'
    """
    return re.sub(r"(?<![\w.)])-(?=[\d.])", "\u2212", str(text))


def sentence(text: str) -> str:
    """Return ``text`` with a full stop, and with a capital unless it starts with a symbol."""
    start = text if _SYMBOL.match(text) else text[:1].upper() + text[1:]
    return start if start[-1:] in (".", "!", "?", "") else start + "."


def headline(result: Mapping[str, Any], *, idle: bool = False) -> str:
    """Return the verdict of the whole run in one sentence; ``idle``: nothing to choose is ever enabled."""
    check, training = result.get("check") or {}, result.get("training") or {}
    if check.get("verdict") not in _KEPT:
        return "These rules cannot be kept." if check else "A run without a check."
    can = "The rules can be kept only by never doing anything" if idle else _KEPT[check["verdict"]]
    broken, steps = training.get("violations"), training.get("steps")
    if not is_number(broken) or not is_number(steps) or not steps:
        return f"{can}."
    kept = f"but were broken {_times(broken)}" if broken else "and were: no\u00a0violation"
    return f"{can}, {kept} in {integer(steps)} steps of training."


def lede(result: Mapping[str, Any]) -> list[str]:
    """Return the sentences below the headline: what was learned, and what it would be without the rules."""
    greedy, optimal = result.get("greedy") or {}, result.get("optimal") or {}
    baseline = result.get("baseline") or {}
    said = []
    if is_number(greedy.get("value")):
        said.append(_learned(greedy, optimal))
    broken = baseline.get("violations")
    if is_number(broken) and broken:
        said.append(f"Without the rules, the same learner broke them {_times(broken)}.")
    return said


def gap(result: Mapping[str, Any]) -> str:
    """Return how far the learned policy is below the best; what the error bounds cannot tell from 0 is 0.

    Examples
    --------
    >>> gap({"greedy": {"gap": -4e-13, "bound": 1e-12}}), gap({"greedy": {"gap": 0.25}})
    ('0', '0.2500')
    """
    greedy, optimal = result.get("greedy") or {}, result.get("optimal") or {}
    return below(greedy.get("gap"), _bounds(greedy, optimal))


def below(value: object, bound: float = 0.0) -> str:
    """Return a difference, "0" where ``bound`` cannot tell it from none."""
    return "0" if is_number(value) and abs(value) <= bound else decimal(value, 4)


def bounds(result: Mapping[str, Any]) -> float:
    """Return how far the difference of the learned and the best value may be off."""
    return _bounds(result.get("greedy") or {}, result.get("optimal") or {})


def _bounds(*parts: Mapping[str, Any]) -> float:
    return sum(part.get("bound") or 0.0 for part in parts) + 1e-12


def _is_best(greedy: Mapping[str, Any], optimal: Mapping[str, Any]) -> bool:
    return bool(abs(greedy["gap"]) <= _bounds(greedy, optimal))


def _learned(greedy: Mapping[str, Any], optimal: Mapping[str, Any]) -> str:
    text = f"The learned policy is worth {decimal(greedy['value'], 4)}"
    if is_number(greedy.get("gap")):
        below = "" if _is_best(greedy, optimal) else f"{decimal(greedy['gap'], 4)} below "
        text += f", {below}the best that the rules allow"
    if is_number(greedy.get("completion")):
        text += f", and completes the task in {percent(greedy['completion'])} of its episodes"
    return text + "."


def _times(number: float) -> str:
    return {1: "once", 2: "twice"}.get(int(number), f"{integer(number)} times")

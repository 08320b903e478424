"""What the signs of a diagram look like: one table, for SVG and for PNG.

A line of the table says which mark in which group it is about, and then what CSS says of it.  Four colours
have names: ``own`` (that of the group), ``paper``, ``stop`` and ``free``.  In a page they are the page's, by
way of CSS variables; a file stands alone, and has colours of its own that any program understands.
"""

from __future__ import annotations

from typing import Final, TypeAlias

Style: TypeAlias = dict[str, str]

_SERIF: Final = '"STIX Two Text",Cambria,Georgia,"Times New Roman",serif'
_MONO: Final = 'ui-monospace,"SF Mono","DejaVu Sans Mono",monospace'

RULES: Final[tuple[tuple[str, str, Style], ...]] = (
    ("", "node", {"fill": "own", "fill-opacity": ".05", "stroke": "own", "stroke-width": "1.4"}),
    ("", "ring", {"fill": "none", "stroke": "own", "stroke-width": "1.1"}),
    ("", "line", {"fill": "none", "stroke": "own", "stroke-width": "1.4", "stroke-linecap": "round"}),
    ("", "head", {"fill": "own"}),
    ("", "ground", {"fill": "paper"}),
    ("", "plate", {"fill": "paper", "fill-opacity": ".9"}),
    ("", "hatch", {"fill": "none", "stroke": "own", "stroke-width": ".9", "stroke-opacity": ".35"}),
    ("", "cross", {"fill": "none", "stroke": "own", "stroke-width": "2", "stroke-linecap": "round"}),
    ("edge free", "line", {"stroke-dasharray": "5.5 4.5"}),
    ("edge mixed", "line", {"stroke-dasharray": "9 4 1.5 4"}),
    ("edge stop", "line", {"stroke-width": "1.1"}),
    ("edge gone", "line", {"stroke-opacity": ".4", "stroke-width": "1.1"}),
    ("edge gone", "head", {"fill-opacity": ".4"}),
    ("state removed", "node", {"fill": "paper", "fill-opacity": "1", "stroke-width": "1"}),
    ("state open", "node", {"stroke-dasharray": "1.6 3.2"}),
    ("state focus", "node", {"stroke-width": "3.4"}),
    ("state current", "node", {"fill": "own", "fill-opacity": "1"}),
    ("state current", "ring", {"stroke": "paper"}),
    ("", "name", {"fill": "own", "font": f"italic 14px {_SERIF}"}),
    ("state current", "name", {"fill": "paper"}),
    ("", "label", {"fill": "own", "font": f"italic 14px {_SERIF}"}),
    ("gone", "label", {"fill-opacity": ".65"}),
    ("", "key", {"fill": "own", "font": "13px system-ui,sans-serif", "text-anchor": "start"}),
    ("", "notice", {"fill": "own", "font": "15px system-ui,sans-serif"}),
)  # fmt: skip
"""The classes of a group ("" is any), the class of a mark, and its style; later lines come before earlier."""

RUNS: Final[dict[str, Style]] = {
    "sub": {"font-size": "10px"},
    "set": {"font-style": "normal"},
    "free": {"fill": "free", "font-weight": "600"},
    "guard": {"font": f"11.2px {_MONO}", "fill-opacity": ".78"},
    "reward": {"font": f"700 11.2px {_MONO}"},
}
"""The styles of a run within a text."""

STOPPING: Final = ("trap", "stop")
"""Groups whose own colour is that of "stop"."""

PAGE: Final[Style] = {
    "ink": "var(--diagram-ink,currentColor)",
    "own": "currentColor",
    "paper": "var(--diagram-paper,var(--jp-layout-color0,var(--vscode-editor-background,Canvas)))",
    "stop": "var(--diagram-stop,#c9561d)",
    "free": "var(--diagram-free,#1f82b5)",
}
"""The colours in a page: its own, if it says what they are."""

FILE: Final[Style] = {
    "ink": "#1b232d",
    "own": "currentColor",
    "paper": "#ffffff",
    "stop": "#b3470f",
    "free": "#0e659b",
}
"""The colours of a file, which stands on white."""


def style_sheet(colours: Style) -> str:
    """Return the table as CSS, for a drawing of the class ``sm-diagram``."""
    rules = [f".sm-diagram{{color:{colours['ink']}}}"]
    rules += [f".sm-diagram .{group}{{color:{colours['stop']}}}" for group in STOPPING]
    rules.append(
        ".sm-diagram text{text-anchor:middle}.sm-diagram path,.sm-diagram circle{stroke-linejoin:round}"
    )
    for group, mark, style in RULES:
        within = "".join(f".{name}" for name in group.split())
        rules.append(f".sm-diagram {within} .{mark}{{{_declared(style, colours)}}}".replace("  ", " "))
    rules += [f".sm-diagram tspan.{run}{{{_declared(style, colours)}}}" for run, style in RUNS.items()]
    return "".join(rules)


def _declared(style: Style, colours: Style) -> str:
    return ";".join(f"{name}:{colours.get(value, value)}" for name, value in style.items())


def style_of(group: str, mark: str) -> Style:
    """Return the style of a mark in a group, as CSS would find it."""
    within, style = set(group.split()), dict[str, str]()
    for classes, name, rule in RULES:
        if name == mark and within.issuperset(classes.split()):
            style |= rule
    return style

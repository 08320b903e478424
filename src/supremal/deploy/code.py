r"""A controller as a program: Python, C, or structured text, each one file that needs nothing else.

The frames are in ``templates/``; here is what goes into them.  Names come from outside and may hold anything:
in a string each is escaped as its language wants it, in a comment what is odd becomes ``\u{...}``.  What the
language has to understand is made of letters, digits and single underscores, and is unique.

Source: ISO/IEC 9899:1999, 5.2.1.1 (trigraphs) and 6.4.4.4 (escapes); IEC 61131-3:2013, 6.1 (identifiers do
not know upper from lower case, nor two underscores in a row).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import cache
from itertools import pairwise
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined

from supremal.deploy.controller import Controller
from supremal.deploy.document import controller_text
from supremal.deploy.tables import Tables, run_of, tables_of, wrapped
from supremal.formats._names import escape, unique

_ODD: Final = re.compile(r"[^ -~]|[*/?$\\]")
"""What could end a comment, or begin something in it."""
_C_TYPES: Final = ((1 << 8, "uint8_t"), (1 << 16, "uint16_t"), (1 << 32, "uint32_t"))
_IEC_TYPES: Final = ((1 << 15, "INT"), (1 << 31, "DINT"))


def python_text(controller: Controller) -> str:
    r"""Return ``controller`` as a file for Python 3.8 and later, that imports ``json`` and ``sys`` only.

    Examples
    --------
    >>> from supremal import from_text
    >>> from supremal.deploy.build import make_controller
    >>> text = python_text(make_controller([from_text("shut -open-> ajar \n ajar -close-> shut")], []))
    >>> space = {"__name__": "door"}
    >>> exec(text, space)
    >>> door = space["Supervisor"]()
    >>> door.enabled(), door.step("open"), door.enabled()
    (['open'], True, ['close'])
    """
    tables, run = tables_of(controller), run_of(controller)
    events, moves = len(controller.alphabet), zip(tables.event, tables.target, strict=True)
    row = [dict(next(moves) for _ in range(end - begin)) for begin, end in _pairs(tables.row)]
    tests = [
        (event, ok, marked, run.enabled[begin:end])
        for event, ok, marked, (begin, end) in zip(
            run.event, run.ok, run.marked, _pairs(run.row), strict=True
        )
    ]
    knows = [
        [e for e in range(events) if tables.knows[c * events + e]] for c in range(len(controller.components))
    ]
    return _render(
        "controller.py.j2",
        controller,
        tables,
        moves=row,
        disabled=_disabled(controller),
        knows=knows,
        tests=tests,
    )


def _disabled(controller: Controller) -> list[dict[int, int | None]]:
    """Return which events are disabled in each state of all components, with the number of the reason."""
    found: list[dict[int, int | None]] = []
    for component in controller.components:
        automaton = component.supervisor.automaton
        begin = len(found)
        found += [{} for _ in range(automaton.n_states)]
        for s, e, why in component.disabled.tolist():
            event = controller.alphabet.index(automaton.alphabet.names[e])
            found[begin + s][event] = None if why < 0 else why
    return found


def c_text(controller: Controller) -> str:
    """Return ``controller`` as a header of C99 with nothing but constant tables and functions over them.

    Numbers have the smallest type that holds them; nothing is allocated.
    """
    tables, run = tables_of(controller), run_of(controller)
    prefix = identifiers([controller.name])[0].lower()
    smallest = _type(_C_TYPES)
    return _render(
        "controller.h.j2",
        controller,
        tables,
        run=run,
        prefix=prefix,
        PREFIX=prefix.upper(),
        identifiers=identifiers(controller.alphabet),
        type=smallest,
        state_type=smallest([len(tables.marked)]),
    )


def st_text(controller: Controller) -> str:
    """Return ``controller`` as a function block of structured text, with another that tests it.

    All its numbers are of one type, which even compilers take that convert nothing by themselves.
    """
    tables, run = tables_of(controller), run_of(controller)
    most = max(map(max, (numbers for numbers in (*tables, *run) if numbers)))
    return _render(
        "controller.st.j2",
        controller,
        tables,
        run=run,
        block=f"FB_{identifiers([controller.name])[0]}",
        type=_type(_IEC_TYPES)([most, len(tables.knows)]),
    )


LANGUAGES: Final[dict[str, Callable[[Controller], str]]] = {
    "json": controller_text,
    "python": python_text,
    "c": c_text,
    "st": st_text,
}
"""What writes a controller in each language."""


def identifiers(names: Iterable[str]) -> list[str]:
    """Return a name for each of ``names`` that any language takes, no two the same.

    Examples
    --------
    >>> identifiers(["start", "START", "1st", "d_u*/", "é"])
    ['START', 'START_2', 'X1ST', 'D_U', 'X']
    """
    return unique(map(_identifier, names))


def _identifier(name: str) -> str:
    plain = re.sub(r"[^A-Z0-9]+", "_", name.upper()).strip("_")
    return plain if plain[:1].isalpha() else f"X{plain}"


def quoted_c(text: str) -> str:
    r"""Return ``text`` in UTF-8 as a string of C, safe from trigraphs.

    Examples
    --------
    >>> print(quoted_c('say "é"?'))
    "say \042\303\251\042\077"
    """
    plain = (chr(b) if 32 <= b < 127 and chr(b) not in '"\\?' else f"\\{b:03o}" for b in _utf8(text))
    return f'"{"".join(plain)}"'


def _utf8(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")


def _pairs(row: list[int]) -> Iterable[tuple[int, int]]:
    return pairwise(row)


def _type(types: tuple[tuple[int, str], ...]) -> Callable[[list[int]], str]:
    """Return what finds the smallest of ``types`` that holds all of some numbers."""

    def smallest(numbers: list[int]) -> str:
        most = max(numbers, default=0)
        return next(name for above, name in types if most < above)

    return smallest


def _render(template: str, controller: Controller, tables: Tables, **more: Any) -> str:  # noqa: ANN401
    return (
        _templates()
        .get_template(template)
        .render(controller=controller, tables=tables, events=controller.alphabet.names, **more)
    )


@cache
def _templates() -> Environment:
    environment = Environment(  # noqa: S701 - programs, not pages: each string is escaped by its own filter
        loader=PackageLoader("supremal.deploy", "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "comment": lambda name: escape(name, _ODD),
        "python": ascii,
        "c": quoted_c,
        "lines": lambda numbers: wrapped(numbers or [0]),
    }
    return environment

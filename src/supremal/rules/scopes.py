"""Where something is forbidden: in a part of what happens, which events open and close.

The scopes, for ``forbidden`` P, ``opening`` Q and ``closing`` R:

- *before* R: up to the first R, if it comes;
- *after* Q: from the first Q on;
- *between* Q and R: from each Q to the next R, if it comes;
- after Q *until* R: from each Q to the next R, and to the end if it does not come.

"If it comes" makes a rule that does not forbid P, but R after it: a P is no fault until the scope is closed.
Where P itself has to be kept from happening, "until" is what is meant, or `precedence` instead of "before".

Source: Dwyer, Avrunin, Corbett, "Patterns in property specifications for finite-state verification", ICSE
1999: the pattern *absence* and its scopes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, TypeAlias, get_args

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.rules._arguments import Events, Parameter
from supremal.rules._pattern import pattern
from supremal.rules._table import from_rows

_Choice = Literal["before", "after", "between", "until"]
Scope: TypeAlias = Annotated[_Choice, Parameter("choice", get_args(_Choice))]

_SENTENCES: Final[dict[str, str]] = {
    "before": "No {forbidden} happens before the first {closing}, if that comes.",
    "after": "Once {opening} has happened, no {forbidden} happens any more.",
    "between": "No {forbidden} happens between {opening} and the next {closing}, if that comes.",
    "until": "From {opening} until the next {closing}, if any, no {forbidden} happens.",
}
_ROWS: Final[dict[str, list[list[int]]]] = {  # by another event, by P, by Q, by R
    "before": [[0, 1, 0, 2], [1, 1, 1, NONE], [2, 2, 2, 2]],
    "after": [[0, 0, 1, 0], [1, NONE, 1, 1]],
    "between": [[0, 0, 1, 0], [1, 2, 1, 0], [2, 2, 2, NONE]],
    "until": [[0, 0, 1, 0], [1, NONE, 1, 0]],
}


def _check_ends(arguments: Mapping[str, Any]) -> None:
    scope = arguments["scope"]
    for key, without in (("opening", "before"), ("closing", "after")):
        if bool(arguments[key]) == (scope == without):
            message = f"scope {scope!r} {'takes no' if arguments[key] else 'needs'} {key}"
            raise ValueError(message)


@pattern(lambda scope, **events: _SENTENCES[scope].format(**events), check=_check_ends)
def between(
    forbidden: Events,
    opening: Events = (),
    closing: Events = (),
    scope: Scope = "between",
    *,
    alphabet: Alphabet,
    name: str = "",
) -> Automaton:
    """Return the rule that ``forbidden`` does not happen in a scope.

    Parameters
    ----------
    forbidden
        What must not happen there.
    opening
        What opens the scope; left out where it is "before".
    closing
        What closes it; left out where it is "after".
    scope
        "before", "after", "between" or "until"; the module says what each of them means.
    alphabet, name
        The events, and what to call the rule.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> sigma = Alphabet(("open", "move", "close"))
    >>> rule = between("move", "open", "close", scope="until", alphabet=sigma)
    >>> rule.accepts(["move", "open", "close", "move"]), rule.run(["open", "move"])
    (True, -1)
    >>> between("move", "open", "close", alphabet=sigma).run(["open", "move", "close"])
    -1
    """
    return from_rows([forbidden, opening, closing], _ROWS[scope], alphabet=alphabet, name=name)


@pattern("Whenever {request} has happened, no {low} happens before the next {high}.")
def priority(request: Events, high: Events, low: Events, *, alphabet: Alphabet, name: str = "") -> Automaton:
    """Return the rule that ``low`` has to let ``high`` go first wherever that has been requested.

    Examples
    --------
    >>> from supremal import Alphabet
    >>> sigma = Alphabet(("call", "serve", "rest"))
    >>> rule = priority("call", "serve", "rest", alphabet=sigma)
    >>> rule.accepts(["rest", "call", "serve", "rest"]), rule.run(["call", "rest"])
    (True, -1)
    """
    return from_rows([low, request, high], _ROWS["until"], alphabet=alphabet, name=name)

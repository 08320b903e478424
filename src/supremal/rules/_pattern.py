"""A pattern: a kind of rule with blanks, a function that fills them in, and a sentence that says it.

`pattern` makes one of a function: the parameters are read off its signature, whose annotations tell what
each argument has to be, the arguments of every call are checked, and the function is listed in `REGISTRY`.
What is left to the function itself is the table of the rule.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import wraps
from inspect import signature
from types import MappingProxyType
from typing import Any, Final, NoReturn, ParamSpec, get_type_hints

from supremal.automata.automaton import Automaton
from supremal.errors import RuleError, suggest
from supremal.rules._arguments import Kind, Parameter, check_alphabet, check_apart, clean
from supremal.rules._phrases import Amount, Names, counted

P = ParamSpec("P")
Check = Callable[[Mapping[str, Any]], None]


@dataclass(frozen=True, slots=True)
class Pattern:
    """A kind of rule.

    Parameters
    ----------
    name
        That of its function.
    build
        The function: it takes ``parameters``, and ``alphabet`` and ``name`` as keywords.
    parameters
        The arguments, in their order.
    sentence
        The rule in words, from a phrase for each argument; `sentence_of` makes these.
    may_share
        Whether one event may stand in two of the arguments.
    check
        Raises a `ValueError` where arguments do not fit together; None: they always do.
    """

    name: str
    build: Callable[..., Automaton]
    parameters: Mapping[str, Parameter]
    sentence: Callable[..., str]
    may_share: bool = False
    check: Check | None = None


REGISTRY: Final[dict[str, Pattern]] = {}
"""All patterns by their names, as far as their modules have been imported."""


def pattern(
    sentence: str | Callable[..., str], *, may_share: bool = False, check: Check | None = None
) -> Callable[[Callable[P, Automaton]], Callable[P, Automaton]]:
    """Return a decorator that makes a pattern of a function.

    Parameters
    ----------
    sentence
        A template with a field for each argument, or a function of their phrases.
    may_share, check
        Those of the `Pattern`.
    """

    def register(build: Callable[P, Automaton]) -> Callable[P, Automaton]:
        hints = get_type_hints(build, include_extras=True)
        parameters = {
            key: replace(hints[key].__metadata__[0], default=argument.default)
            for key, argument in signature(build).parameters.items()
            if key not in ("alphabet", "name")
        }

        @wraps(build)
        def checked(*args: P.args, **given: P.kwargs) -> Automaton:
            if "alphabet" in given:
                check_alphabet(given["alphabet"])
            return build(**_checked(found, args, given))  # type: ignore[call-arg]

        say = sentence.format if isinstance(sentence, str) else sentence
        found = Pattern(build.__name__, checked, MappingProxyType(parameters), say, may_share, check)
        REGISTRY[found.name] = found
        return checked

    return register


def _checked(called: Pattern, args: tuple[object, ...], given: dict[str, Any]) -> dict[str, Any]:
    """Return all arguments of a call by their names, each as its kind has it."""
    rule = str(given.get("name", ""))
    try:
        bound = signature(called.build).bind(*args, **given)
    except TypeError as error:
        _refuse(called, rule, f"{error}; it takes {', '.join(called.parameters)}")
    bound.apply_defaults()
    values = bound.arguments
    for key, known in called.parameters.items():
        if values[key] is not known.default:
            try:
                values[key] = clean(known, values[key], values["alphabet"])
            except ValueError as error:
                _refuse(called, rule, f"{key} {error}")
    try:
        if not called.may_share:
            check_apart(called.parameters, values)
        if called.check:
            called.check(values)
    except ValueError as error:
        _refuse(called, rule, str(error))
    return values


def _refuse(called: Pattern, rule: str, problem: str) -> NoReturn:
    message = f"{called.name}: {problem}"
    raise RuleError(f"rule {rule!r}: {message}" if rule else message) from None


def sentence_of(pattern: str, /, **arguments: object) -> str:
    """Return what a rule says, in plain English.

    Parameters
    ----------
    pattern
        The name of its pattern.
    arguments
        Those of the pattern, without ``alphabet`` and ``name``.

    Raises
    ------
    RuleError
        If there is no such pattern, or an argument is missing, unknown or not what it has to be.

    Examples
    --------
    >>> from supremal.rules.patterns import sentence_of
    >>> sentence_of("response", trigger=["start", "restart"], reaction="stop")
    'Every start or restart is followed, sooner or later, by stop.'
    >>> sentence_of("at_most", of="start", times=1)
    'start happens at most once.'
    """
    if pattern not in REGISTRY:
        message = f"unknown pattern {pattern!r}; {suggest(pattern, REGISTRY)}"
        raise RuleError(message)
    called = REGISTRY[pattern]
    values = _checked(called, (), {**arguments, "alphabet": None})
    return called.sentence(
        **{key: _phrase(known.kind, values[key]) for key, known in called.parameters.items()}
    )


def _phrase(kind: Kind, value: Any) -> object:  # noqa: ANN401 - a value of any kind
    match kind:
        case "events":
            return Names(value)
        case "sequence":
            return " ".join(value)
        case "lists":
            return [Names(names) for names in value]
        case "number":
            return None if value is None else Amount(value)
        case "counting":
            return counted(value)
        case "choice":
            return value

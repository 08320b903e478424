"""What states look like, and conditions on that.

A state number says nothing to a reader; its *factors* do: in row 3, on tile "H", the passenger in the taxi.
A condition on states is a list of numbers, a mapping {factor: value or list of values}, all of which have to
hold, or a function of the number.  A condition on a step is the same of the state in which it ends; a
mapping may speak of the step's ``"reward"`` as well.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from operator import index
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from supremal._arrays import Bools, Floats, Longs
from supremal.errors import MDPError, suggest

Condition: TypeAlias = Iterable[int] | Mapping[str, Any] | Callable[[int], bool]

REWARD: Final = "reward"


class Factor(NamedTuple):
    """A property of states: ``code`` gives each value a number, ``of [S]`` is that of each state."""

    code: dict[Any, int]
    of: NDArray[np.integer]


def told_factors(tell: Callable[[int], Mapping[str, Any]], states: int) -> dict[str, Factor]:
    """Return the factors that a function tells of each state.

    Raises
    ------
    MDPError
        If it tells of other factors in one state than in another, or a value cannot be hashed.
    """
    rows = [dict(tell(s)) for s in range(states)]
    found = {name: Factor({}, np.zeros(states, np.int32)) for name in rows[0]} if rows else {}
    for s, row in enumerate(rows):
        if row.keys() != found.keys():
            message = f"factors tells {[*row]} of state {s}, {[*found]} of state 0; tell the same of all"
            raise MDPError(message)
        for name, value in row.items():
            if not isinstance(value, Hashable):
                message = f"factor {name!r} of state {s} is {value!r}; a number or a name is needed"
                raise MDPError(message)
            code = found[name].code
            found[name].of[s] = code.setdefault(value, len(code))
    return found


def states_where(condition: Condition, what: str, factors: Mapping[str, Factor], states: int) -> Bools:
    """Return the states in which ``condition`` holds, ``bool [S]``; ``what`` is its name in messages.

    Raises
    ------
    MDPError
        If it names a state, a factor or a value that there is not.
    """
    if callable(condition):
        return np.array([bool(condition(s)) for s in range(states)], np.bool_)
    if not isinstance(condition, Mapping):
        return _listed(condition, what, states)
    holds = np.ones(states, np.bool_)
    for name, values in condition.items():
        if name not in factors:
            known = suggest(str(name), factors) if factors else "the environment has none; give factors=..."
            message = f"{what} names the unknown factor {name!r}; {known}"
            raise MDPError(message)
        holds &= np.isin(factors[name].of, [_code(v, name, what, factors[name]) for v in _several(values)])
    return holds


def steps_where(
    condition: Condition, what: str, factors: Mapping[str, Factor], end: Longs, reward: Floats, states: int
) -> Bools:
    """Return the steps for which ``condition`` holds, given the ``end`` and the ``reward [N]`` of each."""
    holds = np.ones(len(end), np.bool_)
    if isinstance(condition, Mapping) and REWARD in condition and REWARD not in factors:
        wanted = _several(condition[REWARD])
        condition = {name: values for name, values in condition.items() if name != REWARD}
        for value in wanted:
            if not isinstance(value, int | float):
                message = f"{what}: reward {value!r} is no number"
                raise MDPError(message)
        holds = np.isin(reward, wanted)
    return holds & states_where(condition, what, factors, states)[end]


def _several(values: Any) -> Sequence[Any]:  # noqa: ANN401 - values of factors may be anything
    return [*values] if isinstance(values, list | tuple | set | frozenset | range) else [values]


def _code(value: Any, name: str, what: str, factor: Factor) -> int:  # noqa: ANN401 - as above
    try:
        return factor.code[value]
    except (KeyError, TypeError):
        message = f"{what}: {name} is never {value!r}; {suggest(str(value), map(str, factor.code))}"
        raise MDPError(message) from None


def _listed(numbers: Any, what: str, states: int) -> Bools:  # noqa: ANN401 - whatever a user gives
    holds = np.zeros(states, np.bool_)
    try:
        listed = [index(s) for s in numbers]
    except TypeError:
        message = f"{what} is {numbers!r}; state numbers, a mapping of factors or a function is needed"
        raise MDPError(message) from None
    for s in listed:
        if not 0 <= s < states:
            message = f"{what} names state {s}; 0 to {states - 1} are known"
            raise MDPError(message)
    holds[listed] = True
    return holds

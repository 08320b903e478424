"""The error tree.

::

    SupremalError
    ├── ModelError (ValueError)       a model that does not hold together
    │   ├── AlphabetError             events: unknown, twice, controllable here and not there
    │   ├── AutomatonError            states and transitions
    │   ├── MDPError                  probabilities, rewards, masks, settings of a learner
    │   └── RuleError                 rules and guards that do not make sense
    ├── FormatError (ValueError)      text that does not parse: path, line, column
    ├── ConvergenceError              an iteration that ran out; carries its last iterate
    └── MissingDependencyError (ImportError)   an extra that is not installed

Every message says which thing, what is wrong with it, and what would be right.  "No" is never an
exception: a question that can be answered with no answers with a value and a witness.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class SupremalError(Exception):
    """Root of all errors that supremal raises on purpose."""


class ModelError(SupremalError, ValueError):
    """A model that does not hold together."""


class AlphabetError(ModelError):
    """An event that is unknown, named twice, or controllable in one place and not in another."""


class AutomatonError(ModelError):
    """An automaton whose states or transitions do not fit together."""


class MDPError(ModelError):
    """A decision process, a mask, a policy or a learner's setting that is out of its range."""


class RuleError(ModelError):
    """A rule, a guard or a reward machine that does not make sense."""


class FormatError(SupremalError, ValueError):
    """Text that does not parse.

    Parameters
    ----------
    message
        What is wrong, and what was expected.
    path
        The file, or a short name of the text.
    line, column
        Where, counted from 1; 0 where it is not known.
    """

    def __init__(self, message: str, *, path: str = "<text>", line: int = 0, column: int = 0) -> None:
        self.message, self.path, self.line, self.column = message, path, line, column
        place = ":".join([path, *(str(n) for n in (line, column) if n)])
        super().__init__(f"{place}: {message}")


class ConvergenceError(SupremalError):
    """An iteration that did not reach its tolerance; ``iterate`` is where it stood."""

    def __init__(self, message: str, iterate: object) -> None:
        self.iterate = iterate
        super().__init__(message)


class MissingDependencyError(SupremalError, ImportError):
    """An optional package that is not installed.

    Examples
    --------
    >>> str(MissingDependencyError("matplotlib", extra="plot", purpose="drawing curves"))
    "drawing curves needs matplotlib: pip install 'supremal[plot]'"
    """

    def __init__(self, package: str, *, extra: str, purpose: str) -> None:
        self.package, self.extra = package, extra
        super().__init__(f"{purpose} needs {package}: pip install 'supremal[{extra}]'")


def suggest(wrong: str, known: Iterable[str], *, limit: int = 12) -> str:
    """Say what would be right in place of the name ``wrong``: first what begins with it, or has it in it.

    Examples
    --------
    >>> suggest("drop", ["d_u", "drop1"])
    "did you mean 'drop1'?"
    >>> suggest("x", ["left", "right"])
    'known: left, right'
    >>> suggest("up", ["left", "step_up", "upstairs_again"])
    'known: upstairs_again, step_up, left'
    """
    names = sorted(map(str, known), key=lambda name: (not name.startswith(wrong), wrong not in name))
    close = get_close_matches(wrong, names, n=1)
    if close:
        return f"did you mean {close[0]!r}?"
    tail = ", ..." if len(names) > limit else ""
    return f"known: {', '.join(names[:limit])}{tail}"

"""Decision processes as files that model checkers read: one table says which format an ending stands for.

======== ====================== ========================================================================
``.umb`` unified Markov binary  Storm, PRISM and Modest read it; it holds words, rewards and parts as well
``.drn`` direct encoding        Storm reads it, and so can people
``.tra`` explicit model files   PRISM reads them: ``.lab``, ``.sta`` and ``.trew`` are written beside
======== ====================== ========================================================================

States keep their numbers, so that what is computed there can be read here.  Labels are ``init``, ``goal``
(marked), ``terminal`` (an episode ends), ``deadlock`` (no action is left), ``broken`` (a rule is), and the
propositions; a proposition of such a name gets a number behind it.  Where an episode ends, or no action is
left, a choice "stay" leads back at no reward.  Where a process starts in several states a last one is added,
whose choice "start" leads to them; discounted values of that one are those of an epoch later, times γ.

Where rewards are below 0, ask Storm for exact totals (a model of rational numbers): its iterations, sound
ones too, were seen to stop early there.

What is written is written beside its place first, and moved there whole.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from os import PathLike
from pathlib import Path
from secrets import token_hex
from typing import Final, NamedTuple

import numpy as np

from supremal._arrays import Bools, Floats, Ints
from supremal.decisions.mdp import TabularMDP
from supremal.errors import FormatError, ModelError
from supremal.formats import _umb_reader, drn, prism, umb
from supremal.formats._explicit import Explicit, lay_out
from supremal.formats._explicit_process import to_process


class ProcessFormat(NamedTuple):
    """A format: what it is, how it is read, and how written: pieces of a file for each ending."""

    about: str
    read: Callable[[Path], Explicit]
    write: Callable[[Explicit], Mapping[str, Iterable[str] | Iterable[bytes]]]


PROCESS_FORMATS: Final = {
    ".umb": ProcessFormat("the unified Markov binary format", _umb_reader.read, umb.write),
    ".drn": ProcessFormat("Storm's direct encoding", drn.read, drn.write),
    ".tra": ProcessFormat("PRISM's explicit model files", prism.read, prism.write),
}
"""The formats, by the endings of their files."""


def write_process(
    path: str | PathLike[str],
    mdp: TabularMDP,
    *,
    enabled: Bools | None = None,
    policy: Ints | Floats | None = None,
    force: bool = False,
) -> None:
    r"""Write ``mdp`` to a file that a model checker reads.

    Parameters
    ----------
    path
        The file; its ending says what format to write.
    mdp
        What to write; rewards have no unit, and probabilities are written to the last digit.
    enabled
        ``bool [S, A]``: the mask of a supervisor; left out: every feasible action.
    policy
        ``int [S]``, an action for each state, or ``float [S, A]``, a distribution for each: the Markov chain
        that it makes is written.
    force
        Whether to replace files that are there.

    Raises
    ------
    FormatError
        If the ending is not known, a file is there, or a name cannot be written.
    MDPError
        If the mask is no supervisor of ``mdp`` (see `check_mask`), or the policy leaves a state that it
        reaches without an enabled action.
    OSError
        If the file cannot be written.

    Notes
    -----
    Linear in the states times the actions and the outcomes.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from supremal import Alphabet, from_outcomes
    >>> from supremal.formats.processes import read_process, write_process
    >>> toss = from_outcomes(
    ...     [(0, "toss", 0, 0.5, ("tails",), -1.0), (0, "toss", 1, 0.5, ("heads",), -1.0)],
    ...     alphabet=Alphabet(("heads", "tails"), uncontrollable=frozenset({"heads", "tails"})),
    ...     terminal=[1],
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_process(Path(folder, "toss.drn"), toss)
    ...     print(*Path(folder, "toss.drn").read_text().splitlines()[11:], sep="\n")
    ...     write_process(Path(folder, "toss.umb"), toss)
    ...     read_process(Path(folder, "toss.umb"))
    @model
    state 0 init
        action toss [-1.0]
            0 : 0.5
            1 : 0.5
    state 1 goal terminal
        action stay [0.0]
            1 : 1.0
    <TabularMDP: 2 states, 1 actions, 2 outcomes, 2 events>
    """
    target = Path(path)
    form = PROCESS_FORMATS[find_process_ending(target)]
    written = form.write(lay_out(mdp, enabled, policy))
    own = target.suffix.lower()
    places = {target if end == own else target.with_suffix(end): text for end, text in written.items()}
    for place in places:
        if place.exists() and not force:
            message = "the file exists already; choose another name, or replace it with --force (force=True)"
            raise FormatError(message, path=str(place))
    with ExitStack() as stack:
        works = []
        for place, pieces in places.items():
            work = place.with_name(f".{place.name}.{token_hex(4)}")
            stack.callback(work.unlink, missing_ok=True)
            _write(work, pieces, place)
            works.append(work)
        for work, place in zip(works, places, strict=True):
            work.replace(place)


def read_process(path: str | PathLike[str]) -> TabularMDP:
    """Return the decision process in a file of a model checker; a Markov chain has one action, "step".

    Parameters
    ----------
    path
        The file; its ending says what format it has.

    Raises
    ------
    FormatError
        If the ending is not known, or the file does not parse; gives line and column where there are any.
    MDPError
        If what the file says makes no process; the message begins with the path.
    OSError
        If the file cannot be read.

    Notes
    -----
    Linear in the file, up to sorting.  Text is read up to 64 MiB, archives up to 1 GiB.
    See `write_process` for an example.
    """
    source = Path(path)
    form = PROCESS_FORMATS[find_process_ending(source)]
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # a reward without bound is told in words
            return to_process(form.read(source), str(source))
    except ModelError as error:
        message = f"{source}: {error}"
        raise type(error)(message) from None


def find_process_ending(path: str | PathLike[str]) -> str:
    """Return the key of `PROCESS_FORMATS` for the ending of ``path``.

    Raises
    ------
    FormatError
        If there is none.

    Examples
    --------
    >>> find_process_ending("grid.UMB")
    '.umb'
    """
    ending = Path(path).suffix.lower()
    if ending in PROCESS_FORMATS:
        return ending
    what = f"{ending!r} is no ending of a file of decision processes" if ending else "the file has no ending"
    message = f"{what}; known: {', '.join(PROCESS_FORMATS)}"
    raise FormatError(message, path=str(path))


def _write(work: Path, pieces: Iterable[str] | Iterable[bytes], place: Path) -> None:
    """Write ``pieces`` to ``work``, and wait until they are on the disk."""
    with work.open("xb") as stream:
        try:
            for piece in pieces:
                stream.write(piece.encode() if isinstance(piece, str) else piece)
        except UnicodeEncodeError:
            message = "a name holds half a character, which UTF-8 has not"
            raise FormatError(message, path=str(place)) from None
        stream.flush()
        os.fsync(stream.fileno())

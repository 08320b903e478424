r"""Where the supervisor's state stands in an observation: `Layout`.

A policy over a supervised environment is a function of what it observes, and so is the mask that belongs to
it: the supervisor's state can be read off the observation, and the mask is a row of a table.  A saved policy
needs no environment for that, only the layout.

There are two.  In a *dictionary* the state stands as a number.  A *flat* observation is one array,

    the environment's own (D numbers) | one block for each plant and rule | one for the reward machine (U),

and each block is one-hot: a network sees in which state each rule is, not one of S numbers that mean nothing
to it.  All zeros is a plant that is lost, which the supervisor never is.  A plant or rule that can be in one
state only, and not get lost, has no block.

To find the supervisor's state that K blocks make, the numbers in them are mixed into one key of 64 bits, by
multiplication with fixed random numbers; the key is looked up in a sorted table, and the find is compared
with the blocks.  Time O(log S + K) an observation, all observations of a batch at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias, get_args

import numpy as np

from supremal._arrays import NONE, Ints, Longs, frozen
from supremal.envs._gymnasium import Space
from supremal.errors import MDPError, suggest

Kind: TypeAlias = Literal["dict", "flat"]

KINDS: Final = get_args(Kind)
_KEYS: Final = ("kind", "states", "machine", "width", "sizes", "parts")


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Where an observation holds the state of a supervisor with S states, and of a reward machine with U.

    Parameters
    ----------
    kind
        "dict" or "flat".
    states, machine
        S, and U; 0 where there is no reward machine.
    width
        D, how many numbers of a flat observation are the environment's own.
    sizes
        Of a flat one: the width of each of the K blocks.
    parts
        ``int32 [S, K]``: the number in each block in each state of the supervisor.
    space
        The space that such observations are of; None where a document was read.

    Raises
    ------
    MDPError
        If they do not fit together.

    Examples
    --------
    >>> layout = Layout("flat", 2, 0, 3, (2, 2), np.array([[0, 0], [1, 1]]))
    >>> layout.state_of(np.array([0.5, 7, 0, 0, 1, 0, 1])), layout.state_of(np.array([0.5, 7, 0, 0, 1, 0, 0]))
    (1, -1)
    """

    kind: Kind
    states: int
    machine: int
    width: int
    sizes: tuple[int, ...]
    parts: Ints
    space: Space[Any] | None = None
    _mixers: Longs = field(init=False, repr=False)
    _keys: Longs = field(init=False, repr=False)
    _order: Longs = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            message = f"a layout of kind {self.kind!r}; {suggest(str(self.kind), KINDS)}"
            raise MDPError(message)
        object.__setattr__(self, "sizes", tuple(self.sizes))
        object.__setattr__(self, "parts", frozen(self.parts, np.int32, 2))
        shape = (self.states if self.kind == "flat" else 0, len(self.sizes))
        fits = self.states > 0 and self.parts.shape == shape
        if not fits or (self.parts < 0).any() or (self.parts >= self.sizes).any():
            message = (
                f"the parts of a layout of {self.states} states have shape {self.parts.shape}; {shape} is "
                f"needed, each number below the size of its block, {self.sizes}"
            )
            raise MDPError(message)
        mixers, keys = _mixed(self.parts)
        order = np.argsort(keys)
        for name, value in (("_mixers", mixers), ("_keys", keys[order]), ("_order", order)):
            object.__setattr__(self, name, value)

    @property
    def starts(self) -> tuple[int, ...]:
        """Where each block of a flat observation begins, and where the last one ends."""
        return tuple(np.cumsum((self.width, *self.sizes)).tolist())

    def state_of(self, observation: Any) -> int:  # noqa: ANN401 - a dictionary or an array
        """Return the supervisor's state in one observation, `NONE` outside of it."""
        if self.kind == "dict":
            return int(self.states_of({"supervisor": _of(observation)})[0])
        return int(self.states_of(np.asarray(observation)[None])[0])

    def states_of(self, batch: Any) -> Ints:  # noqa: ANN401 - a dictionary or an array
        """Return the supervisor's state in each of N observations, ``int32 [N]``, `NONE` outside of it.

        Parameters
        ----------
        batch
            N observations as learners stack them: a dictionary of arrays, that of ``"supervisor"`` of shape
            ``[N]`` or ``[N, 1]``; or an array ``[N, D + ΣK + U]``, not normalised.

        Raises
        ------
        MDPError
            If the batch is no such thing.
        """
        if self.kind == "dict":
            states = np.asarray(_of(batch)).reshape(-1).astype(np.int32)
            return np.where((states >= 0) & (states < self.states), states, np.int32(NONE))
        array, starts = np.asarray(batch), self.starts
        needed = starts[-1] + self.machine
        if array.ndim != 2 or array.shape[1] != needed:
            message = f"a batch of observations has shape {array.shape}; (N, {needed}) is needed"
            raise MDPError(message)
        hot = (array[:, self.width : starts[-1]] > 0.5).astype(np.int32)
        blocks = np.array(starts[:-1], np.int64) - self.width
        place = np.arange(hot.shape[1]) - np.repeat(blocks, self.sizes)
        once = np.add.reduceat(hot, blocks, axis=1) == 1
        parts = np.where(once, np.add.reduceat(hot * place, blocks, axis=1), NONE)
        keys = parts @ self._mixers
        found = self._order[np.minimum(np.searchsorted(self._keys, keys), self.states - 1)]
        return np.where((self.parts[found] == parts).all(axis=1), found, NONE).astype(np.int32)

    def document(self) -> dict[str, Any]:
        """Return all but the space as plain data, which `layout_from` reads again."""
        told: dict[str, Any] = {name: getattr(self, name) for name in _KEYS}
        return {**told, "sizes": list(self.sizes), "parts": self.parts.tolist()}


def layout_from(document: Mapping[str, Any]) -> Layout:
    """Return the layout that a document tells of.

    Raises
    ------
    MDPError
        If it tells of none.

    Examples
    --------
    >>> layout = layout_from(Layout("dict", 3, 0, 0, (), np.empty((0, 0))).document())
    >>> layout.states_of({"supervisor": np.array([2, 0, 3])}).tolist()
    [2, 0, -1]
    """
    if not isinstance(document, Mapping) or set(document) != set(_KEYS):
        message = f"a layout is {document!r:.60}; a table with {', '.join(_KEYS)} is needed"
        raise MDPError(message)
    counts = {name: document[name] for name in ("states", "machine", "width")}
    sizes = document["sizes"]
    numbers = [*counts.values(), *(sizes if isinstance(sizes, list) else [None])]
    if not all(type(n) is int and n >= 0 for n in numbers):
        message = f"a layout has {counts} and sizes {sizes!r:.60}; whole numbers are needed, none below 0"
        raise MDPError(message)
    try:
        given = np.asarray(document["parts"])
        parts = frozen(given.reshape(len(given), len(sizes)), np.int32, 2)
    except (TypeError, ValueError, OverflowError):
        message = f"the parts of a layout are {document['parts']!r:.60}; rows of whole numbers are needed"
        raise MDPError(message) from None
    return Layout(document["kind"], **counts, sizes=tuple(sizes), parts=parts)


def _mixed(parts: Ints) -> tuple[Longs, Longs]:
    """Return K numbers to mix ``parts [S, K]`` by, and the S keys that come out, no two alike."""
    random = np.random.default_rng(0)
    while True:  # once, but with a chance of S² in 2⁶⁵
        mixers: Longs = np.asarray(random.integers(-(1 << 63), (1 << 63) - 1, parts.shape[1]), np.int64)
        keys = np.asarray(parts @ mixers, np.int64)
        if np.unique(keys).size == len(parts):
            return mixers, keys
        if len(np.unique(parts, axis=0)) < len(parts):
            message = "two states of a layout have the same parts; they have to differ"
            raise MDPError(message)


def _of(observation: Any) -> Any:  # noqa: ANN401 - a dictionary, if the user is right
    """Return the supervisor's part of a dictionary."""
    if not isinstance(observation, Mapping) or "supervisor" not in observation:
        message = f"an observation is {observation!r:.60}; a dictionary with 'supervisor' is needed"
        raise MDPError(message)
    return observation["supervisor"]

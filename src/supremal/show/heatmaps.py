"""Heat maps of grids: what is on each cell as a colour, and where a policy goes from there as arrows.

Many states of a product stand on one cell: the agent there with this or that in hand, and rules in this or
that state.  So a map tells of a cell what holds in the mean over its states, or in total, and an arrow
covers the share of its states, weighted the same way, from which the policy goes there: a cell with one
arrow is left one way only.  Weights of `expected_visits` ask what happens; those of one slice of the states
(``origin[:, 1] == 0``, say) what the policy does while a rule is in that state.

A *direction* is that of the action's name where it has one (left, up, north, ...), since chance may lead
elsewhere; any other action points where it leads in the mean.  An action that leads nowhere else is a ring.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal.decisions.evaluation import policy_weights
from supremal.decisions.mdp import TabularMDP
from supremal.errors import ModelError
from supremal.show.board import Board
from supremal.show.playback import Look

COMPASS: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    {
        name: way
        for names, way in (
            (("left", "west", "w"), (-1.0, 0.0)),
            (("right", "east", "e"), (1.0, 0.0)),
            (("up", "north", "n"), (0.0, -1.0)),
            (("down", "south", "s"), (0.0, 1.0)),
        )
        for name in names
    }
)
"""Where actions of these names point; x counts to the right and y down."""
_EXACT: Final = 6  # digits of a direction


class Arrow(NamedTuple):
    """That a policy leaves ``cell`` in direction (x, y), of length 1 or 0, with this share of its weight."""

    cell: int
    x: float
    y: float
    share: float


def cells_of(
    board: Board, mdp: TabularMDP, look: Callable[[tuple[int, ...]], Look], *, token: int = 0
) -> Ints:
    """Return on which of the cells of ``board`` each state stands, ``int32 [S]``; `NONE` where on none.

    Parameters
    ----------
    board
        The map.
    mdp
        An environment, or its product; ``origin[:, 0]`` is the environment's state.
    look
        What the environment looks like in that state, ``(number,)``, such as that of a task's view.
    token
        The number of the token that is meant: the agent is usually the first.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> from supremal.show.board import Place
    >>> walk = from_outcomes([(0, "go", 1, 1.0, ("go",))], alphabet=Alphabet(("go",)), terminal=[1])
    >>> lane = Board(((0, 0), (1, 0)), ())
    >>> cells_of(lane, walk, lambda state: Look((Place(1.5 - state[0], 0.5),))).tolist()
    [1, 0]
    """
    number = {cell: k for k, cell in enumerate(board.cells)}
    worlds, index = np.unique(mdp.origin[:, 0], return_inverse=True)
    found = np.full(worlds.size, NONE, np.int32)
    for k, world in enumerate(worlds.tolist()):
        place = look((world,)).tokens[token] if world != NONE else None  # `NONE` is where a rule is broken
        if place is not None:
            found[k] = number.get((int(place.x // 1), int(place.y // 1)), NONE)
    return found[index.reshape(-1)]


def total_on_cells(board: Board, where: Ints, values: Floats) -> Floats:
    """Return the sum of ``values [S]``, such as visits, over the states of each cell, ``float64 [N]``.

    It is nan where all of them are 0, or there are none.

    Raises
    ------
    ModelError
        If ``where`` and ``values`` do not fit.

    Examples
    --------
    >>> lane = Board(((0, 0), (1, 0), (2, 0)), ())
    >>> total_on_cells(lane, np.array([0, 0, 1, -1]), np.array([1.0, 2.0, 4.0, 8.0])).tolist()
    [3.0, 4.0, nan]
    """
    states = _standing(board, where, values)
    chosen = np.asarray(values)[states]
    some = np.bincount(where[states], chosen != 0, len(board.cells)) > 0
    return np.where(some, np.bincount(where[states], chosen, len(board.cells)), np.nan)


def mean_on_cells(board: Board, where: Ints, values: Floats, weights: Floats | Bools | None = None) -> Floats:
    """Return the mean of ``values [S]`` over the states of each cell, ``float64 [N]``.

    Parameters
    ----------
    board
        The map, of N cells.
    where
        ``int [S]``: the cell that each state stands on, `NONE` for none; see `cells_of`.
    values
        ``float [S]``.
    weights
        ``[S]``: how much each state counts, 0 or False for not at all; left out: all the same.

    Returns
    -------
    float64 [N]
        nan for a cell on which nothing counts.

    Raises
    ------
    ModelError
        If shapes or cells do not fit, or a weight is below 0 or not finite.

    Examples
    --------
    >>> lane = Board(((0, 0), (1, 0)), ())
    >>> where, worth = np.array([0, 0, 1]), np.array([1.0, 2.0, 4.0])
    >>> mean_on_cells(lane, where, worth, np.array([3.0, 1.0, 0.0])).tolist()
    [1.25, nan]
    """
    weights = _weights(where, weights)
    states = _standing(board, where, values)
    states = states[weights[states] > 0]
    mass = np.bincount(where[states], weights[states], len(board.cells))
    total = np.bincount(where[states], weights[states] * np.asarray(values)[states], len(board.cells))
    mean: Floats = np.divide(total, mass, out=np.full(mass.shape, np.nan), where=mass > 0)
    return mean


def policy_arrows(
    board: Board,
    where: Ints,
    mdp: TabularMDP,
    policy: Ints | Floats,
    *,
    weights: Floats | Bools | None = None,
    compass: Mapping[str, tuple[float, float]] = COMPASS,
) -> list[Arrow]:
    """Return where ``policy`` goes from each cell, as arrows, by cell.

    Parameters
    ----------
    board
        The map.
    where
        ``int [S]``: the cell that each state stands on, `NONE` for none; see `cells_of`.
    mdp
        The process; where its actions have no names in ``compass``, they point where they lead.
    policy
        ``int [S]`` or ``float [S, A]``.
    weights
        ``[S]``: how much each state counts; left out: all the same.  Terminal states never do.
    compass
        Directions by the name of an action.

    Raises
    ------
    ModelError
        If shapes or cells do not fit, or a weight is below 0 or not finite.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> walk = from_outcomes(
    ...     [(0, "right", 1, 1.0, ("right",)), (1, "wait", 1, 1.0, ())], alphabet=Alphabet(("right",))
    ... )
    >>> policy_arrows(Board(((0, 0), (1, 0)), ()), np.array([0, 1]), walk, [0, 1])
    [Arrow(cell=0, x=1.0, y=0.0, share=1.0), Arrow(cell=1, x=0.0, y=0.0, share=1.0)]
    """
    acts = policy_weights(mdp, policy) * _weights(where, weights)[:, None]
    states = _standing(board, where, acts)
    counts = acts[states] > 0
    counts[mdp.terminal[states]] = False
    at, action = np.nonzero(counts)
    state = states[at]
    ways = np.array([compass.get(name, (np.nan, np.nan)) for name in mdp.actions])[action]
    unnamed = np.isnan(ways[:, 0])
    ways[unnamed] = _leads(board, where, mdp)[state[unnamed], action[unnamed]]
    length = np.hypot(ways[:, 0], ways[:, 1])[:, None]
    ways = np.divide(ways, length, out=np.zeros_like(ways), where=length > 10.0**-_EXACT).round(_EXACT) + 0.0
    mass = acts[state, action]
    found, place = np.unique(np.column_stack([where[state], ways]), axis=0, return_inverse=True)
    shares = np.bincount(place.reshape(-1), mass, len(found))
    whole = np.bincount(where[state], mass, len(board.cells))
    return [
        Arrow(int(cell), float(x), float(y), float(share / whole[int(cell)]))
        for (cell, x, y), share in zip(found, shares, strict=True)
    ]


def save_heatmap(
    path_stem: str | PathLike[str],
    board: Board,
    heat: Floats | None = None,
    *,
    arrows: Iterable[Arrow] = (),
    title: str = "",
    unit: str = "",
) -> list[Path]:
    """Write a map to ``path_stem`` + ``.png`` and ``.svg``, and return both paths.

    The same map gives the same bytes.  Folders are made where they are missing.

    Parameters
    ----------
    path_stem
        The path without its ending.
    board
        The cells, walls and signs.
    heat
        ``float [N]``: what is on each cell, as a colour; where it is not finite, the cell is hatched.  Left
        out: there are no colours.  Without arrows, on up to 150 cells, the numbers are written too.
    arrows
        Where a policy goes.
    title, unit
        What stands above the map, and beside the scale of its colours.

    Raises
    ------
    ModelError
        If ``heat`` has no number for each cell.
    MissingDependencyError
        If matplotlib is not installed.
    """
    from supremal.show import _heat, _matplotlib  # an extra: only who saves a figure needs it

    values = None if heat is None else np.asarray(heat, np.float64)
    if values is not None and values.shape != (len(board.cells),):
        message = (
            f"the heat has shape {values.shape}; a number for each of {len(board.cells)} cells is needed"
        )
        raise ModelError(message)
    stem = Path(path_stem)
    stem.parent.mkdir(parents=True, exist_ok=True)
    with _matplotlib.house_style():
        return _matplotlib.write(_heat.draw_map(board, values, list(arrows), title=title, unit=unit), stem)


def _standing(board: Board, where: Ints, values: Floats) -> Longs:
    """Return the states that stand on a cell, after a check that all fits."""
    if where.shape != np.shape(values)[:1] or where.dtype.kind not in "iu":
        message = (
            f"where has shape {where.shape} and type {where.dtype}; a whole number for each of "
            f"{len(values)} states is needed"
        )
        raise ModelError(message)
    if where.size and not (where.min() >= NONE and where.max() < len(board.cells)):
        message = (
            f"where holds {where.min()} to {where.max()}; the cells are 0 to {len(board.cells) - 1}, or -1"
        )
        raise ModelError(message)
    return np.flatnonzero(where != NONE)


def _weights(where: Ints, weights: Floats | Bools | None) -> Floats:
    """Return how much each state counts."""
    if weights is None:
        return np.ones(where.shape)
    given = np.asarray(weights, np.float64)
    if given.shape != where.shape or not (np.isfinite(given) & (given >= 0)).all():
        message = (
            f"the weights have shape {given.shape} and are from {given.min(initial=0):g} up; "
            f"{where.size} numbers are needed, none below 0, none endless"
        )
        raise ModelError(message)
    return given


def _leads(board: Board, where: Ints, mdp: TabularMDP) -> Floats:
    """Return how far each action moves in the mean, in cells, ``float64 [S, A, 2]``."""
    slot = np.repeat(np.arange(mdp.n_states * mdp.n_actions), np.diff(mdp.row))
    start, end = where[slot // mdp.n_actions], where[mdp.next_state]
    middle = np.array(board.cells, np.float64)
    move = np.where(((start != NONE) & (end != NONE))[:, None], middle[end] - middle[start], 0.0)
    parts = [np.bincount(slot, mdp.prob * move[:, k], mdp.n_states * mdp.n_actions) for k in (0, 1)]
    leads: Floats = np.stack(parts, axis=-1).astype(np.float64).reshape(mdp.n_states, mdp.n_actions, 2)
    return leads

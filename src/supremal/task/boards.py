"""What the environment of a task looks like: a map with tokens, its own drawing, or the states of its plants.

Three kinds of worlds live on cells and have a map: supremal's grid; those of Gymnasium that tell a row and a
column; and plants whose states are named by cells, "(2,1)" or "(2,1) loaded".  Any other environment is shown
by its own text, where it has one (``render_mode="ansi"``), and else by the number of its state.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from supremal.automata.automaton import Automaton
from supremal.errors import MDPError
from supremal.formats.toml import read_toml
from supremal.show.board import Board, Place, Point, Tile, Token, spread_out
from supremal.show.playback import Look
from supremal.task.task import Task

_CELL: Final = re.compile(r"\(\s*(-?\d+)\s*,\s*(-?\d+)\s*\)\s*(.*)")
_MOST: Final = 400
"""The most cells of a map."""
_COLOUR: Final = re.compile(r"\x1b\[[0-9;]*m")
_KINDS: Final[dict[str, Literal["goal", "hole"]]] = {"G": "goal", "H": "hole", "C": "hole"}
_TURNED: Final = {"up": 0, "right": 90, "down": 180, "left": 270}


@dataclass(frozen=True, slots=True)
class View:
    """How a world is shown.

    Parameters
    ----------
    look
        What it looks like in a state: of the environment, as it counts them; of plants, one state each.
    board
        The map that tokens move on, None where there is none.
    facts
        What the facts of a look are called.
    """

    look: Callable[[tuple[int, ...]], Look]
    board: Board | None = None
    facts: tuple[str, ...] = ()


def view_of(task: Task) -> View:
    """Return how the world of ``task`` is shown."""
    if task.plants:
        return _of_plants(task.plants)
    if task.environment is None:
        return View(lambda _: Look())
    called, options = _environment(task)
    return _by_id(called, options) or View(lambda state: Look(facts=(str(state[0]),)), facts=("state",))


def _environment(task: Task) -> tuple[str, dict[str, Any]]:
    """Return the id of the task's environment, and its options."""
    try:
        said = read_toml(task.path).data["environment"]
        return str(said["id"]), dict(said.get("options", {}))
    except (OSError, KeyError, TypeError):
        return "", {}


def _by_id(called: str, options: dict[str, Any]) -> View | None:
    from supremal.envs._gymnasium import GRID_ID, made

    if called == GRID_ID:
        return _grid()
    try:
        env = made(called, options | {"render_mode": "ansi"})
    except MDPError:
        return None
    core: Any = env.unwrapped
    return _on_cells(core) or _as_text(env, core)


# --- plants -----------------------------------------------------------------------------------------------


def _of_plants(plants: tuple[Automaton, ...]) -> View:
    """Show the states of plants, and on a map those that are named by cells."""
    found = [_cells_of(plant) for plant in plants]
    walkers = [k for k, cells in enumerate(found) if cells]
    board = None
    if walkers:
        every = {cell for cells in found for cell in cells}
        top = max(y for _, y in every)
        tokens = tuple(Token(plants[k].name, "square", plants[k].name[:3]) for k in walkers)
        board = Board(tuple((x, top - y) for x, y in sorted(every)), tokens, title="Where they are")

    def look(states: tuple[int, ...]) -> Look:
        named = tuple(plant.state_name(q) for plant, q in zip(plants, states, strict=True))
        points: dict[int, Point] = {}
        for at, k in enumerate(walkers):
            x, y = found[k][states[k]]
            points[at] = x + 0.5, top - y + 0.5
        return Look(tuple(spread_out(points, len(walkers))), named)

    return View(look, board, tuple(plant.name for plant in plants))


def _cells_of(plant: Automaton) -> list[tuple[int, int]]:
    """Return the cell that each state of ``plant`` is named by; [] where one is not, or all are the same."""
    named = [_CELL.fullmatch(name) for name in plant.state_names]
    cells = [(int(match[1]), int(match[2])) for match in named if match]
    return cells if len(cells) == plant.n_states and 1 < len(set(cells)) <= _MOST else []


# --- supremal's grid --------------------------------------------------------------------------------------


def _grid() -> View:
    from supremal.envs._grid import HEIGHT, HOMES, START, WALLS, WIDTH
    from supremal.envs.pickup_delivery import decode

    cells = tuple((x, y) for y in range(HEIGHT) for x in range(WIDTH))
    walls = tuple(tuple((float(x), float(HEIGHT - y)) for x, y in corners) for corners in WALLS)
    slots = tuple((WIDTH + 0.75, HEIGHT / 2 - 1.0 + k) for k in range(len(HOMES)))
    items = tuple(Token(f"item {k + 1}", "disc", str(k + 1)) for k in range(len(HOMES)))
    board = Board(
        cells,
        (Token("the agent", "arrow"), *items),
        {(START[0], HEIGHT - 1 - START[1]): Tile("S", "goal")},
        walls,
        slots,
        "The grid, and beside it what is carried",
    )

    def look(states: tuple[int, ...]) -> Look:
        state = decode(states[0])
        agent = Place(state.x + 0.5, HEIGHT - 0.5 - state.y, _TURNED[state.heading])
        lie: dict[int, Point] = {}
        places: list[Place | None] = []
        for k, where in enumerate(state.items):
            if where != "carried":
                x, y = HOMES[k] if where == "home" or state.drop is None else state.drop
                lie[k] = x + 0.5, HEIGHT - 0.5 - y
        for k, place in enumerate(spread_out(lie, len(items))):
            if place is None:
                places.append(Place(*slots[k]))
                continue
            if lie[k] == (agent.x, agent.y):  # at the edge of the agent's cell, so that both are seen
                place = place._replace(x=agent.x + (k - 1) * 0.32, y=agent.y + 0.32, size=0.5)  # noqa: PLW2901
            places.append(place._replace(look="hollow") if state.items[k] == "dropped" else place)
        return Look((agent, *places))

    return View(look, board)


# --- Gymnasium's ------------------------------------------------------------------------------------------


def _on_cells(core: Any) -> View | None:  # noqa: ANN401 - somebody's environment
    """Show an environment that tells row and column; None for another."""
    from supremal.envs._tabular_factors import known_look

    states = int(getattr(getattr(core, "observation_space", None), "n", 0))
    factors = known_look(core, states).factors
    if not {"row", "column"} <= factors.keys():
        return None
    row, column = factors["row"].of, factors["column"].of
    height, width = int(row.max()) + 1, int(column.max()) + 1
    if height * width > _MOST:
        return None
    cells = tuple((x, y) for y in range(height) for x in range(width))
    tiles, walls = _ground(core, factors, height, width)
    told = tuple(name for name in factors if name not in ("row", "column", "tile"))
    values = {name: {k: str(v) for v, k in reversed(factors[name].code.items())} for name in told}
    edge = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height), (0.0, 0.0))
    board = Board(cells, (Token("the agent", "square"),), tiles, (edge, *walls))

    def look(state: tuple[int, ...]) -> Look:
        s = state[0]
        facts = tuple(values[name][int(factors[name].of[s])] for name in told)
        return Look((Place(int(column[s]) + 0.5, int(row[s]) + 0.5),), facts)

    return View(look, board, told)


def _ground(
    core: Any,  # noqa: ANN401 - somebody's environment
    factors: Any,  # noqa: ANN401 - of conditions of any value
    height: int,
    width: int,
) -> tuple[dict[tuple[int, int], Tile], tuple[tuple[Point, ...], ...]]:
    """Return what is written on cells, and the walls between them."""
    if "tile" in factors:
        letter = {k: str(v) for v, k in factors["tile"].code.items()}
        signs = [letter[int(k)] for k in factors["tile"].of]
        return {
            (k % width, k // width): Tile(sign, _KINDS.get(sign, ""))
            for k, sign in enumerate(signs)
            if sign != "F"
        }, ()
    plan = np.asarray(core.desc, np.str_)  # the taxi's: a letter for each cell, and what is between two
    inside = plan[1 : 1 + height]
    stands = {(x, y): str(inside[y, 2 * x + 1]) for y in range(height) for x in range(width)}
    walls = tuple(
        ((x + 1.0, float(y)), (x + 1.0, y + 1.0))
        for y in range(height)
        for x in range(width - 1)
        if inside[y, 2 * x + 2] == "|"
    )
    return {cell: Tile(sign) for cell, sign in stands.items() if sign.strip()}, walls


def _as_text(env: Any, core: Any) -> View | None:  # noqa: ANN401 - somebody's environment
    """Show an environment by its own text in each state that is put into it; None where it has none."""
    if "ansi" not in getattr(core, "metadata", {}).get("render_modes", ()) or not hasattr(core, "s"):
        return None

    def look(state: tuple[int, ...]) -> Look:
        core.s = state[0]
        return Look(facts=(str(state[0]),), text=_COLOUR.sub("", str(core.render())))

    env.reset(seed=0)
    return View(look, facts=("state",))

"""The pick-up and delivery grid of the paper: the agent collects items 1, 2, 3 and returns to S.

At each epoch the agent moves (l, r, f, b), picks up an item that lies on its cell (p_i), or puts one down
beside what was dropped (d_i).  While it carries all three, the uncontrollable d_u pre-empts the chosen action
with probability ``drop_probability``: item 1 falls on the agent's cell, and nothing else happens.  Only the
first epoch after the three were last collected is free from it.  An episode ends at S with all three.

``preset="published"`` is the program that the paper's authors published.  It has the moves only: an item is
picked up by itself on arrival, carrying a set that is not {}, {1}, {1, 2} or {1, 2, 3} ends the episode, and
after d_u the environment itself does d2, d3, p1, p2, p3, one an epoch, whatever the agent chooses.

A state is one number, ``load * 252 + pose``; `decode` says in words what it stands for.  Taking one step
(`PickupDelivery.outcomes`) and the table of all states (`PickupDelivery.model`) read the same small tables.

Source: section IV of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Final, NamedTuple, get_args

import numpy as np

from supremal._arrays import NONE, Bools, Ints
from supremal.automata.alphabet import Alphabet
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.reward_machine import RewardMachine
from supremal.envs import _dynamics
from supremal.envs._dynamics import Preset
from supremal.envs._grid import HEADINGS, HEADS, HEIGHT, POSES, START, WIDTH, cell_at, pose_at
from supremal.envs._loads import ITEMS, LOADS, NUMBER, Load
from supremal.envs._tables import intended_table, tabulate
from supremal.errors import MDPError, suggest
from supremal.formats.documents import read_reward_machine

PLACES: Final = ("home", "carried", "dropped")
"""Where an item can be, in the order in which observations count."""


class GridState(NamedTuple):
    """A state of the grid in words.

    Parameters
    ----------
    x, y
        The agent's cell, counted from the bottom left.
    heading
        One of "up", "right", "down", "left".
    items
        Where items 1, 2, 3 are: each "home", "carried" or "dropped".
    drop
        The cell on which the dropped ones lie, None where none is dropped.
    fresh
        Whether all three were just collected, so that nothing can fall at the next epoch.
    """

    x: int
    y: int
    heading: str
    items: tuple[str, str, str] = ("home", "home", "home")
    drop: tuple[int, int] | None = None
    fresh: bool = False


class Answer(NamedTuple):
    """What the environment may answer to an action: the next state, how likely it is, and the word."""

    state: int
    prob: float
    word: tuple[str, ...]


def encode(state: GridState) -> int:
    """Return the number of ``state``.

    Raises
    ------
    MDPError
        If there is no such state: the agent is outside, or a drop while not all others are carried.

    Examples
    --------
    >>> encode(GridState(6, 0, "up"))
    24
    """
    x, y, heading, items, drop, fresh = state
    inside = all(0 <= u < WIDTH and 0 <= v < HEIGHT for u, v in ((x, y), drop or (0, 0)))
    if inside and heading in HEADINGS and len(items) == len(ITEMS) and set(items) <= set(PLACES):
        one, two, three = (PLACES.index(place) for place in items)
        lies = NONE if drop is None else cell_at(*drop)
        load = NUMBER.get(Load((one, two, three), lies, fresh))
        if load is not None:
            return load * POSES + pose_at(x, y, HEADINGS.index(heading))
    message = (
        f"the grid has no state {state}: agent and drop are on cells of {WIDTH}×{HEIGHT}, the heading "
        f"is one of {', '.join(HEADINGS)}, items are {', '.join(PLACES)}, and one is dropped only where all "
        "others are carried; it is fresh only where all three are"
    )
    raise MDPError(message)


def decode(code: int) -> GridState:
    """Return the state with number ``code``.

    Examples
    --------
    >>> decode(24)
    GridState(x=6, y=0, heading='up', items=('home', 'home', 'home'), drop=None, fresh=False)
    """
    load, pose = divmod(_checked(code), POSES)
    cell, heading = divmod(pose, HEADS)
    items, lies, fresh = LOADS[load]
    one, two, three = (PLACES[place] for place in items)
    drop = None if lies == NONE else (lies % WIDTH, lies // WIDTH)
    return GridState(cell % WIDTH, cell // WIDTH, HEADINGS[heading], (one, two, three), drop, fresh)


def describe(code: int) -> str:
    """Say what state number ``code`` is.

    Examples
    --------
    >>> describe(24)
    'at (6, 0) facing up; carries nothing'
    >>> describe(encode(GridState(2, 5, "left", ("dropped", "carried", "carried"), (2, 4))))
    'at (2, 5) facing left; carries 2, 3; dropped 1 at (2, 4)'
    """
    state = decode(code)
    carried = ", ".join(str(k) for k, place in enumerate(state.items, 1) if place == "carried")
    dropped = ", ".join(str(k) for k, place in enumerate(state.items, 1) if place == "dropped")
    text = f"at ({state.x}, {state.y}) facing {state.heading}; carries {carried or 'nothing'}"
    if dropped:
        text += f"; dropped {dropped} at {state.drop}"
    return f"{text}, just collected" if state.fresh else text


def state_numbers(mdp: TabularMDP) -> Ints:
    """Return which state of ``mdp``, a `PickupDelivery.model`, has each code: ``int32 [113400]``.

    `NONE` stands where a state is not reachable; the way back is ``mdp.origin[:, 0]``.
    """
    numbers = np.full(_dynamics.STATES, NONE, np.int32)
    numbers[mdp.origin[:, 0]] = np.arange(mdp.n_states)
    return numbers


def data_file(name: str) -> Traversable:
    """Return one of the paper's automata or reward machines that come with supremal.

    There are ``no_u_turn.json`` (H_1), ``recovery.json`` (G_s'), ``reward_machine.json`` and
    ``reward_machine_published.json``.

    Examples
    --------
    >>> from supremal.formats import read_automaton
    >>> read_automaton(data_file("recovery.json"))
    <Automaton 'recovery': 6 states, 16 transitions, 11 events>
    """
    return files("supremal.envs").joinpath("data", name)


def _checked(code: int) -> int:
    if not 0 <= code < _dynamics.STATES:
        message = f"the grid has no state {code}; 0 to {_dynamics.STATES - 1} are known"
        raise MDPError(message)
    return code


@dataclass(frozen=True, slots=True)
class PickupDelivery:
    """The pick-up and delivery grid.

    Parameters
    ----------
    drop_probability
        How likely d_u is, at each epoch at which it can happen.
    preset
        "default" for the paper's text, "published" for its authors' program.

    Raises
    ------
    MDPError
        If the probability is not within 0 and 1, or the preset is unknown.

    Examples
    --------
    >>> grid = PickupDelivery()
    >>> [(describe(state), prob, word) for state, prob, word in grid.outcomes(grid.start, 0)]
    [('at (5, 0) facing left; carries nothing', 1.0, ('l',))]
    >>> grid.model()
    <TabularMDP: 102772 states, 10 actions, 318256 outcomes, 11 events>
    """

    drop_probability: float = 0.5
    preset: Preset = "default"

    def __post_init__(self) -> None:
        if self.preset not in get_args(Preset):
            message = f"unknown preset {self.preset!r}; {suggest(str(self.preset), get_args(Preset))}"
            raise MDPError(message)
        if not 0 <= self.drop_probability <= 1:
            message = f"drop_probability is {self.drop_probability}; a number from 0 to 1 is needed"
            raise MDPError(message)

    @property
    def actions(self) -> tuple[str, ...]:
        """What the agent can choose."""
        return _dynamics.ACTIONS[self.preset]

    @property
    def alphabet(self) -> Alphabet:
        """The eleven events; only d_u is uncontrollable, in both presets."""
        return _dynamics.ALPHABET

    @property
    def propositions(self) -> tuple[str, ...]:
        """What labels are made of: i1, i2, i3 (the item is carried) and S (the agent is there)."""
        return _dynamics.PROPOSITIONS

    @property
    def start(self) -> int:
        """The state in which episodes start: at S facing up, all items at home."""
        return pose_at(*START, 0)

    @property
    def feasible(self) -> Bools:
        """Which actions are feasible in each state, ``bool [113400, A]``; none in a terminal one."""
        meant, _ = intended_table(self.preset)
        feasible: Bools = meant != NONE
        return feasible

    def is_terminal(self, state: int) -> bool:
        """Tell whether an episode ends in ``state``."""
        return _dynamics.is_over(self.preset, state)

    def is_marked(self, state: int) -> bool:
        """Tell whether ``state`` counts as completion: at S with all three items."""
        return _dynamics.is_complete(state)

    def label(self, state: int) -> int:
        """Return the propositions true in ``state``, as bits."""
        return _dynamics.label_of(state)

    def outcomes(self, state: int, action: int) -> tuple[Answer, ...]:
        """Return what the environment may answer to ``action`` in ``state``; () if that is not feasible.

        Raises
        ------
        MDPError
            If there is no such state or action.
        """
        if not 0 <= action < len(_dynamics.ACTIONS[self.preset]):
            message = f"the grid has no action {action}; 0 to {len(self.actions) - 1} are known"
            raise MDPError(message)
        meant = _dynamics.intended(self.preset, _checked(state), action)
        if meant is None:
            return ()
        risk = self.drop_probability
        fallen = _dynamics.fall(state) if risk else None
        if fallen is None:
            return (_answer(meant, 1.0),)
        if risk == 1:
            return (_answer(fallen, 1.0),)
        return (_answer(meant, 1 - risk), _answer(fallen, risk))

    def reward_machine(self) -> RewardMachine:
        """Return the reward machine of the paper's figure, or of the published program."""
        suffix = "" if self.preset == "default" else f"_{self.preset}"
        return read_reward_machine(data_file(f"reward_machine{suffix}.json"))

    def model(self) -> TabularMDP:
        """Return the grid as a table: the states that are reachable, nearest first; the start is state 0.

        Rewards are 0: a reward machine gives them.  ``origin[:, 0]`` is each state's number here.
        """
        return tabulate(self.preset, self.drop_probability, self.start)


def _answer(outcome: tuple[int, int], prob: float) -> Answer:
    state, word = outcome
    return Answer(state, prob, _dynamics.SPELLED[word])

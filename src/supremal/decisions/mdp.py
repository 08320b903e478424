"""Finite Markov decision processes whose outcomes are words of events.

At each epoch the agent chooses an action a that is feasible in state s; the environment answers with an
outcome: the next state, a reward, and the *word* of events that really occurred, in order.  Usually the word
is the action's own event, but an uncontrollable event can pre-empt it or follow it.  This is the paper's
MDP as a language generator (section II), with words where the paper has one label an action.

Outcomes are stored once, in one sparse form: those of (s, a) are the entries ``row[s * A + a]`` to
``row[s * A + a + 1]`` of ``next_state``, ``prob``, ``reward`` and ``word``; an infeasible action has none.

Source: Puterman, *Markov Decision Processes*, chapter 2.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from supremal._arrays import Bools, Floats, Ints, Longs, frozen
from supremal.automata.alphabet import Alphabet
from supremal.errors import MDPError

_SUM_TOLERANCE: Final = 1e-9
_MAX_PROPOSITIONS: Final = 63


_DTYPES: Final[dict[str, type]] = {
    "row": np.int64,
    "next_state": np.int32,
    "prob": np.float64,
    "reward": np.float64,
    "word": np.int32,
    "terminal": np.bool_,
    "marked": np.bool_,
    "label": np.int64,
    "initial": np.float64,
}


def _field(name: str, values: ArrayLike, dtype: DTypeLike, ndim: int = 1) -> NDArray[Any]:
    try:
        return frozen(values, dtype, ndim)
    except ValueError as error:
        message = f"{name}: {error}"
        raise MDPError(message) from None


def _itself() -> Ints:
    return np.empty((0, 0), np.int32)


@dataclass(frozen=True, slots=True, eq=False)
class TabularMDP:
    """A finite decision process with S states, A actions and O outcomes.

    Parameters
    ----------
    actions
        The A names of what the agent can choose.
    alphabet
        The events that words are made of.
    propositions
        The names of the propositions, at most 63; bit i of a label is proposition i.
    words
        The distinct words, each a tuple of event numbers; () is the silent one.
    row
        ``int64 [S * A + 1]``: where the outcomes of each state and action begin.
    next_state, prob, reward, word
        ``int32``, ``float64``, ``float64`` and ``int32 [O]``; ``word`` counts in ``words``.
    terminal
        ``bool [S]``: where an episode ends.
    marked
        ``bool [S]``: the states that count as completion.
    label
        ``int64 [S]``: the propositions true in each state, as bits.
    initial
        ``float64 [S]``: the initial distribution.
    origin
        ``int32 [S, K]``: the state of each of the K parts that this process was composed from; left out:
        it is its own only part.

    Raises
    ------
    MDPError
        If shapes do not fit, a number is out of its range, or probabilities do not sum to 1.

    Notes
    -----
    Takes 24 bytes an outcome, 8 a state and action, and 22 + 4 K a state.
    """

    actions: tuple[str, ...]
    alphabet: Alphabet
    propositions: tuple[str, ...]
    words: tuple[tuple[int, ...], ...]
    row: Longs
    next_state: Ints
    prob: Floats
    reward: Floats
    word: Ints
    terminal: Bools
    marked: Bools
    label: Longs
    initial: Floats
    origin: Ints = field(default_factory=_itself)

    def __post_init__(self) -> None:
        states, outcomes = len(self.terminal), len(self.next_state)
        own = np.shape(self.origin) == (0, 0)
        origin = np.arange(states)[:, None] if own else self.origin
        arrays = {name: _field(name, getattr(self, name), dtype) for name, dtype in _DTYPES.items()}
        arrays["origin"] = _field("origin", origin, np.int32, 2)
        sizes = dict.fromkeys(arrays, states) | {"row": states * len(self.actions) + 1}
        sizes |= dict.fromkeys(("next_state", "prob", "reward", "word"), outcomes)
        for name, array in arrays.items():
            if len(array) != sizes[name]:
                message = f"{name} has {len(array)} entries, {sizes[name]} are needed"
                raise MDPError(message)
            object.__setattr__(self, name, array)
        _check_numbers(self)

    @property
    def n_states(self) -> int:
        """The number of states, S."""
        return len(self.terminal)

    @property
    def n_actions(self) -> int:
        """The number of actions, A."""
        return len(self.actions)

    @property
    def feasible(self) -> Bools:
        """Which actions are feasible, ``bool [S, A]``: those with an outcome."""
        return (np.diff(self.row) > 0).reshape(self.n_states, self.n_actions)

    def outcomes(self, state: int, action: int) -> slice:
        """Return where the outcomes of ``action`` in ``state`` stand."""
        k = state * self.n_actions + action
        return slice(int(self.row[k]), int(self.row[k + 1]))

    def spell(self, word: int) -> tuple[str, ...]:
        """Return the event names of word number ``word``."""
        return self.alphabet.spell(self.words[word])

    def __repr__(self) -> str:
        return (
            f"<TabularMDP: {self.n_states} states, {self.n_actions} actions, "
            f"{len(self.next_state)} outcomes, {len(self.alphabet)} events>"
        )


def restrict(mdp: TabularMDP, enabled: Bools) -> TabularMDP:
    """Return ``mdp`` with the actions of a mask ``bool [S, A]`` only; states keep their numbers."""
    counts = np.where(enabled.reshape(-1), np.diff(mdp.row), 0)
    kept = np.repeat(enabled.reshape(-1), np.diff(mdp.row))
    return replace(
        mdp,
        row=np.append(0, np.cumsum(counts)),
        next_state=mdp.next_state[kept],
        prob=mdp.prob[kept],
        reward=mdp.reward[kept],
        word=mdp.word[kept],
    )


def _check_numbers(mdp: TabularMDP) -> None:
    """Raise an `MDPError` for the first number that is out of its range."""
    states, outcomes = mdp.n_states, len(mdp.next_state)
    for what, names in (("action", mdp.actions), ("proposition", mdp.propositions)):
        if len(set(names)) < len(names):
            message = f"{what}s: a name stands twice in {', '.join(names)}; name each once"
            raise MDPError(message)
    if len(mdp.propositions) > _MAX_PROPOSITIONS:
        message = f"{len(mdp.propositions)} propositions; at most {_MAX_PROPOSITIONS} fit a label"
        raise MDPError(message)
    if not (mdp.row[0] == 0 and mdp.row[-1] == outcomes and (np.diff(mdp.row) >= 0).all()):
        message = f"row has to rise from 0 to the number of outcomes, {outcomes}"
        raise MDPError(message)
    for name, values, bound in (
        ("next_state", mdp.next_state, states),
        ("word", mdp.word, len(mdp.words)),
    ):
        if outcomes and not (values.min() >= 0 and values.max() < bound):
            message = f"{name} holds {values.min()} to {values.max()}; 0 to {bound - 1} are known"
            raise MDPError(message)
    events = [event for word in mdp.words for event in word]
    if events and not (min(events) >= 0 and max(events) < len(mdp.alphabet)):
        message = f"words hold events {min(events)} to {max(events)}; 0 to {len(mdp.alphabet) - 1} are known"
        raise MDPError(message)
    if states and not (mdp.label.min() >= 0 and mdp.label.max() >> len(mdp.propositions) == 0):
        message = (
            f"a label has bits beyond the {len(mdp.propositions)} proposition(s); bit i is proposition i"
        )
        raise MDPError(message)
    if not np.isfinite(mdp.reward).all():
        message = "a reward is not finite; every reward has to be a number"
        raise MDPError(message)
    filled = np.flatnonzero(np.diff(mdp.row))
    total = np.add.reduceat(mdp.prob, mdp.row[filled]) if filled.size else mdp.prob[:0]
    wrong = np.flatnonzero(~(np.abs(total - 1) <= _SUM_TOLERANCE))
    if wrong.size:
        state, action = divmod(int(filled[wrong[0]]), mdp.n_actions)
        message = (
            f"the probabilities of action {mdp.actions[action]!r} in state {state} sum to "
            f"{total[wrong[0]]:.12g}; they have to sum to 1"
        )
        raise MDPError(message)
    if outcomes and not mdp.prob.min() > 0:
        message = f"an outcome has probability {mdp.prob.min():.12g}; leave out what cannot happen"
        raise MDPError(message)
    if not (abs(mdp.initial.sum() - 1) <= _SUM_TOLERANCE and mdp.initial.min(initial=0) >= 0):
        message = f"the initial distribution sums to {mdp.initial.sum():.12g}; it has to sum to 1"
        raise MDPError(message)


class Outcome(NamedTuple):
    """One line of `from_outcomes`: what ``action`` in ``state`` can lead to."""

    state: int
    action: str
    next_state: int
    prob: float
    word: tuple[str, ...]
    reward: float = 0.0


def from_outcomes(
    outcomes: Iterable[Outcome | tuple[int, str, int, float, tuple[str, ...]]],
    *,
    alphabet: Alphabet,
    actions: Sequence[str] | None = None,
    terminal: Iterable[int] = (),
    marked: Iterable[int] | None = None,
    labels: dict[int, Iterable[str]] | None = None,
    propositions: Sequence[str] | None = None,
    initial: int = 0,
) -> TabularMDP:
    """Return the decision process that a list of outcomes describes.

    Parameters
    ----------
    outcomes
        Tuples (state, action, next state, probability, word, reward); the reward may be left out.
    alphabet
        The events that words are made of.
    actions
        Their order; left out: the alphabet's controllable events, then the others named.
    terminal, marked
        Where episodes end, and which states count as completion (left out: the terminal ones).
    labels, propositions
        What is true in which state.
    initial
        The state in which episodes start.

    Raises
    ------
    AlphabetError
        If a word has an unknown event.
    MDPError
        If a name is unknown or probabilities do not sum to 1.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> coin = from_outcomes(
    ...     [(0, "toss", 0, 0.5, ("tails",)), (0, "toss", 1, 0.5, ("heads",))],
    ...     alphabet=Alphabet(("heads", "tails"), uncontrollable=frozenset({"heads", "tails"})),
    ...     terminal=[1],
    ... )
    >>> coin
    <TabularMDP: 2 states, 1 actions, 2 outcomes, 2 events>
    """
    lines = [Outcome(*line) for line in outcomes]
    if actions is None:
        own = [name for name in alphabet if name not in alphabet.uncontrollable]
        used = dict.fromkeys(line.action for line in lines)
        actions = [*(name for name in own if name in used), *(name for name in used if name not in own)]
    end, goal = list(terminal), None if marked is None else list(marked)
    truths = {s: list(names) for s, names in (labels or {}).items()}
    if propositions is None:
        propositions = list(dict.fromkeys(name for names in truths.values() for name in names))
    number = {name: a for a, name in enumerate(actions)}
    bit = {name: 1 << i for i, name in enumerate(propositions)}
    _check_names("action", (line.action for line in lines), number)
    _check_names("proposition", (name for names in truths.values() for name in names), bit)
    words = {word: w for w, word in enumerate(dict.fromkeys(tuple(line.word) for line in lines))}
    named = [initial, *end, *(goal or ()), *truths, *(s for li in lines for s in (li.state, li.next_state))]
    if min(named) < 0:
        message = f"state {min(named)} is below 0; states are counted from 0"
        raise MDPError(message)
    states = 1 + max(named)

    lines.sort(key=lambda line: (line.state, number[line.action]))
    slots = np.array([line.state * len(actions) + number[line.action] for line in lines], np.int64)
    at = np.arange(states)
    label = np.zeros(states, np.int64)
    for s, names in truths.items():
        label[s] = sum(bit[name] for name in set(names))
    return TabularMDP(
        actions=tuple(actions),
        alphabet=alphabet,
        propositions=tuple(propositions),
        words=tuple(tuple(alphabet.index(name) for name in word) for word in words),
        row=np.searchsorted(slots, np.arange(states * len(actions) + 1)),
        next_state=np.array([line.next_state for line in lines], np.int32),
        prob=np.array([line.prob for line in lines], np.float64),
        reward=np.array([line.reward for line in lines], np.float64),
        word=np.array([words[tuple(line.word)] for line in lines], np.int32),
        terminal=np.isin(at, end),
        marked=np.isin(at, end if goal is None else goal),
        label=label,
        initial=(at == initial).astype(np.float64),
    )


def _check_names(what: str, names: Iterable[str], known: dict[str, int]) -> None:
    for name in names:
        if name not in known:
            message = f"unknown {what} {name!r}; known: {', '.join(known)}"
            raise MDPError(message)

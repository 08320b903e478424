"""A plant as a decision process, and a process without its disturbances.

An automaton says what can happen, not how likely.  With a chance for each uncontrollable event it is a
decision process of one event an epoch:

* Where controllable events are possible the agent chooses one.  Each uncontrollable event that is possible
  too pre-empts it with its chance; otherwise what was chosen happens.
* Where only uncontrollable ones are, the agent *waits*: one of them happens, with odds as their chances are.
* Where nothing is possible and the state is marked, the episode ends.  Where it is not marked nothing was
  completed, and the agent waits for ever.

The process can do what the plant can, and a supervisor of one is a supervisor of the other: `observed_plant`
leads back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Longs
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.reduce import keep
from supremal.decisions.mdp import TabularMDP
from supremal.errors import MDPError, suggest

_TOLERANCE: Final = 1e-9


def process_of(plant: Automaton, chances: Mapping[str, float]) -> TabularMDP:
    r"""Return ``plant`` as a decision process in which uncontrollable events happen by chance.

    Parameters
    ----------
    plant
        What can happen; only what is reachable of it counts.
    chances
        How likely each uncontrollable event is, at an epoch at which it can happen: above 0, at most 1.
        Those of one state may not sum to more than 1 where something can be chosen too; if they sum to 1,
        what is chosen never happens there.

    Returns
    -------
    TabularMDP
        Its actions are the controllable events and, where that is needed, waiting: "wait", or "wait'" if an
        event has that name.  Rewards are 0.  ``origin [S, 1]`` is the state of ``plant``; state 0 starts,
        and marked is what is marked there.

    Raises
    ------
    MDPError
        If the plant is empty, an uncontrollable event that can happen has no chance, another event has one,
        or chances are out of their range.

    Notes
    -----
    Linear in the plant's table and in the outcomes: one for each controllable transition, and one more for
    each uncontrollable one beside it.

    Examples
    --------
    >>> from supremal import from_text
    >>> machine = from_text('''
    ...     uncontrollable break
    ...     marked idle
    ...     idle -start-> busy
    ...     busy -finish-> idle
    ...     busy -break-> down
    ...     down -repair-> idle
    ... ''')
    >>> process = process_of(machine, {"break": 0.1})
    >>> [(process.spell(w), p) for w, p in zip(process.word, process.prob.tolist())]
    [(('start',), 1.0), (('finish',), 0.9), (('break',), 0.1), (('repair',), 1.0)]
    """
    if not plant.n_states:
        message = f"plant {plant.name!r} is empty; a process needs a state to begin in"
        raise MDPError(message)
    numbers = np.arange(plant.n_states, dtype=np.int32)
    part = keep(replace(plant, origin=numbers[:, None]), np.ones(plant.n_states, np.bool_))
    alphabet, possible = part.alphabet, part.delta != NONE
    chance = _chances(part, chances)
    total, free = possible @ chance, np.flatnonzero(alphabet.controllable)
    acts, ends = possible[:, free].any(axis=1), ~possible.any(axis=1) & part.marked
    _check_sums(part, acts, total, chance)
    rest = np.where(acts, 1 - total, total == 0)  # for what is chosen, or for ever for nothing
    happens = rest > _TOLERANCE

    waits = ~acts & ~ends
    silent, waiting = len(alphabet), (_waiting(alphabet),) if waits.any() or not free.size else ()
    state, action = np.nonzero(np.hstack([possible[:, free], waits[:, None]]))
    slot, event = _outcomes(state, np.append(free, silent)[action], happens, possible & (chance > 0))
    at, odds = state[slot], np.append(chance, 0.0)[event]
    actions = alphabet.spell(free) + waiting
    counts = np.bincount(at * len(actions) + action[slot], minlength=part.n_states * len(actions))
    return TabularMDP(
        actions=actions,
        alphabet=alphabet,
        propositions=(),
        words=(*((e,) for e in range(silent)), ()),
        row=np.append(0, np.cumsum(counts)),
        next_state=np.hstack([part.delta, numbers[: part.n_states, None]])[at, event],
        prob=np.where(odds > 0, odds / np.where(happens, 1.0, total)[at], rest[at]),
        reward=np.zeros(slot.size),
        word=event.astype(np.int32),
        terminal=ends,
        marked=part.marked,
        label=np.zeros(part.n_states, np.int64),
        initial=np.eye(1, part.n_states)[0],
        origin=part.origin,
    )


def _outcomes(state: Longs, own: Longs, happens: Bools, surprises: Bools) -> tuple[Longs, Longs]:
    """Return the choice and the event of each outcome, in order of choices.

    A choice is made in ``state`` and has its ``own`` event, which comes first if something chosen ``happens``
    there (``bool [S]``); all ``surprises`` of that state (``bool [S, E]``) come after it.
    """
    source, event = np.nonzero(surprises)
    start = np.searchsorted(source, np.arange(len(surprises) + 1))
    ways = np.diff(start)[state]
    pre_empted = np.repeat(np.arange(state.size), ways)
    k = np.arange(pre_empted.size) + np.repeat(start[state] - (np.cumsum(ways) - ways), ways)
    chosen = np.flatnonzero(happens[state])
    slot = np.append(chosen, pre_empted)
    order = np.argsort(slot, kind="stable")
    return slot[order], np.append(own[chosen], event[k])[order]


def _chances(plant: Automaton, chances: Mapping[str, float]) -> Floats:
    """Return the chance of each event, ``float64 [E]``, 0 for a controllable one."""
    alphabet = plant.alphabet
    called = f"plant {plant.name!r}: " if plant.name else ""
    chance = np.zeros(len(alphabet))
    for name, value in chances.items():
        if name not in alphabet.uncontrollable:
            known = [event for event in alphabet if event in alphabet.uncontrollable]
            why = "is controllable, and happens when it is chosen" if name in alphabet else "is unknown"
            message = f"{called}event {name!r} has a chance, but {why}; {suggest(name, known)}"
            raise MDPError(message)
        if not 0 < value <= 1:
            message = (
                f"{called}the chance of {name!r} is {value}; a number above 0, at most 1, is needed: what "
                "never happens is to be left out of the plant"
            )
            raise MDPError(message)
        chance[alphabet.index(name)] = value
    missing = ~alphabet.controllable & (chance == 0) & (plant.delta != NONE).any(axis=0)
    if missing.any():
        message = (
            f"{called}uncontrollable event {alphabet.names[missing.argmax()]!r} can happen, but has no "
            "chance; give it one, or leave it out of the plant"
        )
        raise MDPError(message)
    return chance


def _check_sums(plant: Automaton, acts: Bools, total: Floats, chance: Floats) -> None:
    """Raise an `MDPError` for the first state in which more can pre-empt a choice than always."""
    over = np.flatnonzero(acts & (total > 1 + _TOLERANCE))
    if over.size:
        state = int(over[0])
        named = plant.state_names[state] if plant.state_names else str(plant.origin[state, 0])
        events = plant.alphabet.spell(np.flatnonzero((plant.delta[state] != NONE) & (chance > 0)).tolist())
        message = (
            f"in state {named!r} of plant {plant.name!r} something can be chosen, and the chances of "
            f"{', '.join(events)} sum to {total[state]:.6g}; at most 1 is possible there"
        )
        raise MDPError(message)


def _waiting(alphabet: Alphabet) -> str:
    """Return a name for waiting that is not one of an event."""
    name = "wait"
    while name in alphabet:
        name += "'"
    return name


def undisturbed(mdp: TabularMDP) -> TabularMDP:
    """Return ``mdp`` as it is while nothing uncontrollable happens.

    Outcomes whose word has an uncontrollable event are left out, and the other ones of that action are so
    much the likelier.  An action that has no other ones stays as it was: nothing else can come of it.

    Notes
    -----
    Linear in the outcomes.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> walk = from_outcomes(
    ...     [(0, "go", 1, 0.8, ("go",)), (0, "go", 0, 0.2, ("slip",))],
    ...     alphabet=Alphabet(("go", "slip"), uncontrollable=frozenset({"slip"})),
    ... )
    >>> undisturbed(walk).prob.tolist()
    [1.0]
    """
    free = mdp.alphabet.controllable
    calm = np.array([all(free[event] for event in word) for word in mdp.words], np.bool_)[mdp.word]
    counts = np.diff(mdp.row)
    slot = np.repeat(np.arange(counts.size), counts)
    left = np.bincount(slot[calm], mdp.prob[calm], counts.size)
    kept = calm | (left == 0)[slot]
    share = np.where(left > 0, left, 1.0)[slot]
    return replace(
        mdp,
        row=np.append(0, np.cumsum(np.bincount(slot[kept], minlength=counts.size))),
        next_state=mdp.next_state[kept],
        prob=(mdp.prob / share)[kept],
        reward=mdp.reward[kept],
        word=mdp.word[kept],
    )

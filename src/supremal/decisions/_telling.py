"""Words that tell all: what was chosen, what happened, and where it led.

An agent that sees the state knows all of this, a reader of words only what stands in them.  So events are put
into the words, but only where something is missing:

* In each state the choice has to show before chance does anything.  It does where the words of each action
  begin with its own controllable event, but for words that begin with an uncontrollable one and are the same
  whatever is chosen, which *pre-empt* the choice.  It need not where nothing depends on it.  In all other
  states a choice event comes first.
* The words that are then possible are a tree.  Where chance decides which of several controllable events is
  next, each is announced, for else a supervisor could take them for choices of its own.
* Where a word ends the state is seen, unless the word tells it: none goes on from here, and none leads to
  another state.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal.automata.alphabet import Alphabet
from supremal.decisions.mdp import TabularMDP
from supremal.errors import MDPError

_OWN: Final = 0
_CHOICE: Final = 1
_ANNOUNCEMENT: Final = 2
_SIGHT: Final = 3
_SIGNS: Final = ("", "?", "!", "@")


def tell(mdp: TabularMDP) -> TabularMDP:
    """Return ``mdp`` with words that tell all; out of one state no two are the same.

    None is silent but where that changes nothing: where it leads back to the state that it came from.  If
    there are several initial states, one more is added, in which chance decides between them.  Terminal
    states must have no outcomes.

    Raises
    ------
    AlphabetError
        If an action that has to show has a name that would not do for an event.
    MDPError
        If an event already has the name of one that is needed.
    """
    mdp, numbers = _with_one_start(mdp), _state_numbers(mdp)
    slot = np.repeat(np.arange(mdp.row.size - 1), np.diff(mdp.row))
    state, action = np.divmod(slot, mdp.n_actions)
    shows, hidden = _where_choices_show(mdp, slot)
    root = np.where(hidden[state], mdp.n_states + slot, state)
    unclear, announced = _what_is_unclear(mdp, root, shows)

    choice, seen = np.where(hidden[state], action, NONE), np.where(unclear, mdp.next_state, NONE)
    spared = announced & shows[state]  # the first event is no matter of chance
    key = [part + 1 for part in (choice, mdp.word, announced, spared, seen)]  # NONE is -1
    sizes = (mdp.n_actions + 1, len(mdp.words) + 1, 3, 3, mdp.n_states + 1)
    code, inverse = np.unique(np.ravel_multi_index(key, sizes), return_inverse=True)
    rows = np.stack(np.unravel_index(code, sizes), axis=1) - 1
    letters = [_letters(mdp, *row) for row in rows.tolist()]

    added = sorted({letter for word in letters for letter in word if letter[0] != _OWN})
    what = {_CHOICE: mdp.actions, _ANNOUNCEMENT: mdp.alphabet.names, _SIGHT: numbers.tolist()}
    alphabet = _wider(mdp.alphabet, [f"{_SIGNS[kind]}{what[kind][k]}" for kind, k in added])
    event = {letter: e for e, letter in enumerate([*((_OWN, e) for e in range(len(mdp.alphabet))), *added])}
    words: dict[tuple[int, ...], int] = {}
    which = [words.setdefault(tuple(event[letter] for letter in word), len(words)) for word in letters]
    return replace(mdp, alphabet=alphabet, words=tuple(words), word=np.array(which, np.int32)[inverse])


def _letters(
    mdp: TabularMDP, choice: int, word: int, announced: int, spared: int, seen: int
) -> list[tuple[int, int]]:
    """Spell a word that tells all; a letter is what it is, and the number of its action, event or state."""
    free = mdp.alphabet.controllable
    letters = [(_CHOICE, choice)] if choice != NONE else []
    for place, event in enumerate(mdp.words[word]):
        if announced and free[event] and place >= spared:
            letters.append((_ANNOUNCEMENT, event))
        letters.append((_OWN, event))
    return [*letters, (_SIGHT, seen)] if seen != NONE else letters


def _state_numbers(mdp: TabularMDP) -> Ints:
    """Return what each state is called: as in the environment, if that is unique."""
    numbers = mdp.origin[:, :1].reshape(-1)
    return numbers if np.unique(numbers).size == mdp.n_states else np.arange(mdp.n_states, dtype=np.int32)


def _wider(alphabet: Alphabet, names: list[str]) -> Alphabet:
    """Add events, of which those that begin with a question mark are controllable."""
    for name in names:
        if name in alphabet:
            message = f"event {name!r} has the name of one that the observed plant needs; give it another"
            raise MDPError(message)
    uncontrollable = alphabet.uncontrollable.union(name for name in names if name[0] != "?")
    return Alphabet((*alphabet.names, *names), uncontrollable, alphabet.unobservable)


def _with_one_start(mdp: TabularMDP) -> TabularMDP:
    """Add a state from which one silent action leads to the initial ones, if there are several."""
    starts = np.flatnonzero(mdp.initial)
    if starts.size == 1:
        return mdp
    return replace(
        mdp,
        words=(*mdp.words, ()),
        row=np.append(mdp.row, np.full(mdp.n_actions, mdp.row[-1] + starts.size)),
        next_state=np.append(mdp.next_state, starts),
        prob=np.append(mdp.prob, mdp.initial[starts]),
        reward=np.append(mdp.reward, np.zeros(starts.size)),
        word=np.append(mdp.word, np.full(starts.size, len(mdp.words))),
        terminal=np.append(mdp.terminal, False),
        marked=np.append(mdp.marked, False),
        label=np.append(mdp.label, 0),
        initial=np.append(np.zeros(mdp.n_states), 1.0),
        origin=np.append(mdp.origin, np.full((1, mdp.origin.shape[1]), NONE), axis=0),
    )


def _where_choices_show(mdp: TabularMDP, slot: Longs) -> tuple[Bools, Bools]:
    """Return where first events show what was chosen, and where a choice event is needed; ``bool [S]``."""
    states = mdp.n_states
    outcome, pair = np.unique(mdp.word.astype(np.int64) * states + mdp.next_state, return_inverse=True)
    made = _distinct(slot * outcome.size + pair)  # what each choice can lead to, each once
    slot, pair = np.divmod(made, outcome.size)
    state, action = np.divmod(slot, mdp.n_actions)
    _, same, sharing = np.unique(state * outcome.size + pair, return_inverse=True, return_counts=True)
    choices = mdp.feasible.sum(axis=1)
    common = sharing[same] == choices[state]

    begins = np.array([word[0] if word else NONE for word in mdp.words], np.int32)[outcome // states][pair]
    free = np.append(mdp.alphabet.controllable, False)[begins]  # the last entry is that of a silent word
    event = [mdp.alphabet.index(name) if name in mdp.alphabet else NONE for name in mdp.actions]
    own = free & (begins == np.array(event, np.int32)[action])
    stray = np.bincount(state[~own & (free | ~common)], minlength=states)
    shown = np.bincount(_distinct(slot[own]) // mdp.n_actions, minlength=states)
    shows = (stray == 0) & (shown == choices)
    moot = np.bincount(state[~common], minlength=states) == 0
    return shows, ~shows & ~moot


def _what_is_unclear(mdp: TabularMDP, root: Longs, shows: Bools) -> tuple[Bools, Bools]:
    """Return where the state has to be seen, and where events have to be announced; ``bool [O]``.

    ``root [O]`` is where the tree of an outcome's word begins: in a state, or beyond them after a choice.
    """
    prefix, parent, last = _prefixes(mdp.words)
    size = parent.size
    whole = prefix[np.arange(len(mdp.words)), [len(word) for word in mdp.words]]
    passed = prefix[mdp.word]
    tree = _distinct((root[:, None] * size + passed)[passed != NONE])
    at, of = np.divmod(tree[tree % size > 0], size)
    above = at * size + parent[of]

    ends, end = np.unique(root * size + whole[mdp.word], return_inverse=True)
    goals = np.bincount(_distinct(end * mdp.n_states + mdp.next_state) // mdp.n_states)
    silent = (ends % size == 0) & (ends // size < mdp.n_states)
    unclear = ((goals > 1) | np.isin(ends, above) | silent)[end]
    unclear &= (whole[mdp.word] > 0) | (mdp.next_state != root)  # nothing has changed

    is_choice = (parent[of] == 0) & np.append(shows, False)[np.minimum(at, mdp.n_states)]
    by_chance = mdp.alphabet.controllable[last[of]] & ~is_choice
    forks, ways = np.unique(above[by_chance], return_counts=True)
    return unclear, np.isin(root, forks[ways > 1] // size)


def _prefixes(words: tuple[tuple[int, ...], ...]) -> tuple[Ints, Ints, Ints]:
    """Give a number to each prefix of a word; 0 is the empty one.

    Returns the number of the first n events of word w, ``[W, L + 1]``, `NONE` beyond its end; and for each
    prefix the number of what it prolongs, and its last event.
    """
    number = {(NONE, NONE): 0}
    prefix = np.full((len(words), 1 + max(map(len, words), default=0)), NONE, np.int32)
    for w, word in enumerate(words):
        at = prefix[w, 0] = 0
        for place, event in enumerate(word, 1):
            at = prefix[w, place] = number.setdefault((at, event), len(number))
    parent, last = np.array(list(number), np.int32).T
    return prefix, parent, last


def _distinct(numbers: Longs) -> Longs:
    """Return the distinct ``numbers`` in order; NumPy's own verb hashes, and takes ten times as long."""
    ascending = np.sort(numbers)
    distinct: Longs = ascending[np.append(True, ascending[1:] != ascending[:-1])[: ascending.size]]
    return distinct

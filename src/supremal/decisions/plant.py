"""A decision process as a language generator: the plant that Theorem 1 speaks of.

The paper reads the MDP as (S, A, Σ, L, r, p, γ) and lets δ(σ, s) = s' where an action labelled σ leads from s
to s' with positive probability.  Outcomes here are words, so that a word of several events passes through
states in between, and a silent outcome is a silent move.  Probabilities and rewards play no part.

What is enforced against a plant depends on what its supervisor sees.  One that sees the *events* has
`plant_automaton`: where an event can lead to two states it is their subset automaton.  One that sees the
*state*, as an agent does, has `observed_plant`, in which observations stand beside the events; this is state
feedback, written so that every verb on automata can read it.

Source: section II of the paper; Ramadge, Wonham, "Modular feedback logic for discrete event systems", SIAM J.
Control Optim. 25 (1987), for state feedback.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from supremal._arrays import NONE, Ints
from supremal.automata.automaton import Automaton
from supremal.automata.build import empty
from supremal.automata.explore import default_max_states
from supremal.automata.reduce import determinise
from supremal.decisions._telling import tell
from supremal.decisions.mdp import TabularMDP, restrict
from supremal.decisions.product import broken_states
from supremal.decisions.safety import reachable_states, safe_actions
from supremal.errors import MDPError


def plant_automaton(mdp: TabularMDP, *, name: str = "plant") -> Automaton:
    """Return the automaton of the words of events that ``mdp`` can produce.

    Its marked states are those of ``mdp``.  Linear in the outcomes where the generator is deterministic,
    exponential in the states at worst where it is not.

    Raises
    ------
    MDPError
        If its table of states and events does not fit the machine.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes, plant_automaton
    >>> lamp = from_outcomes(
    ...     [(0, "on", 1, 0.9, ("on",)), (0, "on", 0, 0.1, ("on", "fuse"))],
    ...     alphabet=Alphabet(("on", "fuse"), uncontrollable=frozenset({"fuse"})),
    ... )
    >>> plant_automaton(lamp).accepts(["on", "fuse", "on"])
    False
    """
    moves, states = _moves(mdp)
    start = np.flatnonzero(mdp.initial)
    source, event, target = moves
    marked = np.append(mdp.marked, np.zeros(states - mdp.n_states, np.bool_))
    same = (source[1:] == source[:-1]) & (event[1:] == event[:-1])
    if same.any() or (event == NONE).any() or start.size > 1:
        triples = zip(*moves.tolist(), strict=True)
        return determinise(mdp.alphabet, triples, start.tolist(), np.flatnonzero(marked).tolist(), name=name)
    if states > default_max_states(len(mdp.alphabet)):
        message = (
            f"a plant of {states:,} states and {len(mdp.alphabet):,} events is too large for this machine; "
            "make the process smaller"
        )
        raise MDPError(message)
    number = np.arange(states)  # the initial state becomes state 0
    number[[0, start[0]]] = number[[start[0], 0]]
    delta = np.full((states, len(mdp.alphabet)), NONE, np.int32)
    delta[number[source], event] = number[target]
    return Automaton(mdp.alphabet, delta, marked[number], name=name)


def observed_plant(mdp: TabularMDP, *, name: str = "plant") -> Automaton:
    """Return the plant of a supervisor that sees the state of ``mdp``; it is deterministic.

    Parameters
    ----------
    mdp
        The process, without its rules.
    name
        What to call the automaton.

    Returns
    -------
    Automaton
        Its words are those of ``mdp``, with events besides where something does not show in them:

        * ``@n``, uncontrollable, after a word that does not tell which outcome happened, or where it led:
          state n is seen.  States count as in ``mdp.origin[:, 0]`` if that is unique.
        * ``?a``, controllable, before the words of a state in which they do not show what is chosen: it is a.
        * ``!e``, uncontrollable, where chance decides which of several controllable events is next: e is.

        Marked are the states that ``mdp`` marks, and terminal ones that are no sinks: an episode may end
        there.  ``origin [S, 1]`` is the state of ``mdp``, `NONE` in the middle of a word.

    Raises
    ------
    AlphabetError
        If ``?a`` would not do as the name of an event.
    MDPError
        If an event of ``mdp`` has one of these names, or the table of states and events does not fit the
        machine.

    Notes
    -----
    ``synthesize(observed_plant(mdp), rules, must_act=True)`` enables the same as `safe_actions` does on
    ``product(mdp, rules)``.  With ``nonblocking=False`` marked states play no part in synthesis, so there the
    product is that with `mark_all` of each rule.

    An agent that has to act can never take an action that may lead to where an episode neither ends nor goes
    on, whatever the rules; such actions are left out.  If that leaves no way to begin, the plant is empty.

    Takes the time to sort the events of all outcomes.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> lamp = from_outcomes(
    ...     [(0, "on", 1, 0.9, ("on",)), (0, "on", 0, 0.1, ("on",))], alphabet=Alphabet(("on",)), terminal=[1]
    ... )
    >>> observed_plant(lamp).alphabet.names
    ('on', '@0', '@1')
    """
    enabled = safe_actions(mdp, nonblocking=False)
    ends = mdp.terminal & ~broken_states(mdp)
    if not (ends | enabled.any(axis=1))[mdp.initial > 0].all():
        return empty(mdp.alphabet, name=name)
    enabled &= reachable_states(mdp, enabled)[:, None]
    told = tell(replace(restrict(mdp, enabled), marked=mdp.marked | ends))
    found = plant_automaton(told, name=name)
    start = int(told.initial.argmax())
    origin = np.full((found.n_states, 1), NONE, np.int32)
    origin[: mdp.n_states, 0] = np.arange(mdp.n_states)
    origin[[0, start]] = origin[[start, 0]]
    return replace(found, origin=origin)


def _moves(mdp: TabularMDP) -> tuple[Ints, int]:
    """Return the distinct moves in order, as rows (from, event or `NONE`, to), and the number of states.

    The states after those of ``mdp`` are the places in the middle of a word, one for each state and prefix.
    """
    node = np.repeat(np.arange(mdp.n_states), np.diff(mdp.row[:: mdp.n_actions]))
    live = np.flatnonzero(~mdp.terminal[node])
    node, word, to = node[live], mdp.word[live], mdp.next_state[live]
    length = np.array([len(w) for w in mdp.words], np.int64)
    letters = np.full((len(mdp.words), length.max(initial=0)), NONE)
    for w, events in enumerate(mdp.words):
        letters[w, : len(events)] = events
    states = mdp.n_states
    silent = (length[word] == 0) & (node != to)  # a silent loop is no move
    moves = [np.stack([node[silent], np.full(silent.sum(), NONE), to[silent]])]
    for place in range(letters.shape[1]):
        event, last = letters[word, place], length[word] == place + 1
        moves.append(np.stack([node[last], event[last], to[last]]))
        longer = length[word] > place + 1
        passed, after = np.unique(node[longer] * len(mdp.alphabet) + event[longer], return_inverse=True)
        between = states + np.arange(passed.size)
        moves.append(np.stack([passed // len(mdp.alphabet), passed % len(mdp.alphabet), between]))
        node, word, to = between[after], word[longer], to[longer]
        states += passed.size
    rows = np.concatenate(moves, axis=1)
    rows = rows[:, np.lexsort(rows[::-1])]
    fresh = np.append(True, (rows[:, 1:] != rows[:, :-1]).any(axis=0))[: rows.shape[1]]
    return rows[:, fresh].astype(np.int32), states

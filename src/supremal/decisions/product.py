"""The product of a decision process, rules and a reward machine.

Rules listen to the words that occur, a reward machine to the label of the state that is reached, so that the
product is again a decision process: its state is (s, q₁, …, qₙ, u), and what the paper calls non-Markovian
constraints are Markovian in it.  This is where q̃ with the indices q_s, q_h and u of Algorithm 1 lives.

A state is marked where the process and all rules are: a rule's unmarked states are those in which something
is owed.  What is owed has to be given before an episode ends, so a rule breaks on a word with an event that
it has no transition for, and on one that leads to a terminal state while the rule is not marked.  Whatever
breaks rules leads to a *sink*: a terminal, unmarked state whose ``origin`` is `NONE` in the columns of the
process and of the rules that broke.  `safe_actions` keeps an agent out of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal.automata.alphabet import union
from supremal.automata.automaton import Automaton
from supremal.decisions import _kernels
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.reward_machine import RewardMachine
from supremal.errors import MDPError, RuleError, suggest

MAX_STATES: Final = 50_000_000
"""The default bound on the states of a product."""

_MAX_RULES: Final = 30
_WIDEST: Final = 1 << 62


def product(
    mdp: TabularMDP,
    rules: Sequence[Automaton] = (),
    reward_machine: RewardMachine | None = None,
    *,
    max_states: int = MAX_STATES,
) -> TabularMDP:
    r"""Return the reachable product of ``mdp``, ``rules`` and ``reward_machine``.

    Parameters
    ----------
    mdp
        The environment.
    rules
        Each breaks on a word with an event of its alphabet that it has no transition for, and at the end of
        an episode where it is not marked.  `mark_all` of a rule breaks in the first way only.
    reward_machine
        Where given, its rewards take the place of the environment's.
    max_states
        The most states that the product may have.

    Returns
    -------
    TabularMDP
        ``origin`` has the environment's columns, one a rule, and one for the reward machine.  Labels and
        terminal states are the environment's; marked are the states in which it and all rules are.

    Raises
    ------
    AlphabetError
        If an event is controllable here and not there.
    RuleError
        If the reward machine reads a proposition that the environment does not have.
    MDPError
        If the product has more than ``max_states`` states.

    Notes
    -----
    Linear in the outcomes of the product times the number of rules.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes, from_text, mark_all, product
    >>> walk = from_outcomes(
    ...     [(0, "go", 1, 1.0, ("go",)), (1, "go", 2, 1.0, ("go",))], alphabet=Alphabet(("go",)), terminal=[2]
    ... )
    >>> once = from_text("fresh -go-> spent", alphabet=walk.alphabet)
    >>> product(walk, [once]).origin.tolist()
    [[0, 0], [1, 1], [-1, -1]]

    Who goes out owes a return, and here the episode ends before it; to `mark_all` that is no matter:

    >>> owing = from_text("marked in \n in -go-> out \n out -go-> out", alphabet=walk.alphabet)
    >>> product(walk, [owing, mark_all(owing)]).origin.tolist()
    [[0, 0, 0], [1, 1, 1], [-1, -1, 0]]
    """
    union(mdp.alphabet, *(rule.alphabet for rule in rules))
    if len(rules) > _MAX_RULES:
        message = f"{len(rules)} rules; at most {_MAX_RULES} at once, compose some of them with sync"
        raise MDPError(message)
    sizes = [rule.n_states for rule in rules]
    machine_next, machine_label = _machine_tables(mdp, reward_machine)
    sizes_named = ", ".join(
        [f"environment ({mdp.n_states})"]
        + [f"{rule.name or f'rule {k}'} ({rule.n_states})" for k, rule in enumerate(rules)]
        + ([f"reward machine ({len(reward_machine.states)})"] if reward_machine else [])
    )
    if mdp.n_states * prod(max(size, 1) for size in sizes) * len(machine_next) >= _WIDEST:
        message = f"the product of {sizes_named} states is too wide; leave out a rule or make one smaller"
        raise MDPError(message)
    tables = [word_table(rule, mdp) for rule in rules]
    keys, start, row, next_state, taken = _kernels.explore(
        mdp.row,
        mdp.next_state,
        mdp.word,
        mdp.terminal,
        np.flatnonzero(mdp.initial).astype(np.int32),
        np.concatenate([np.empty(0, np.int32), *(table.reshape(-1) for table in tables)]),
        np.cumsum([0, *(table.size for table in tables)], dtype=np.int64),
        np.array(sizes, np.int64),
        np.concatenate([np.empty(0, np.bool_), *(rule.marked for rule in rules)]),
        machine_next,
        machine_label,
        len(mdp.words),
        max_states,
    )
    if len(keys) > max_states:
        message = f"the product of {sizes_named} states has more than {max_states:,}; raise max_states"
        raise MDPError(message)
    return _assemble(mdp, rules, reward_machine, (keys, start), (row, next_state, taken))


def word_table(rule: Automaton, mdp: TabularMDP) -> Ints:
    """Return where each word of ``mdp`` leads in each state of ``rule``, `NONE` if it breaks; ``[Q, W]``."""
    table = np.empty((rule.n_states, len(mdp.words)), np.int32)
    table[:] = np.arange(rule.n_states)[:, None]
    for w, word in enumerate(mdp.words):
        for name in mdp.alphabet.spell(word):
            if name in rule.alphabet:
                step = np.append(rule.delta[:, rule.alphabet.index(name)], NONE)
                table[:, w] = step[table[:, w]]  # NONE is the last entry: broken stays broken
    return table


def broken_states(mdp: TabularMDP) -> Bools:
    """Return the sinks of a product, in which a rule is broken; ``bool [S]``."""
    broken: Bools = (mdp.origin == NONE).any(axis=1)
    return broken


def _machine_tables(mdp: TabularMDP, machine: RewardMachine | None) -> tuple[Ints, Ints]:
    """Return δu over the machine's own labels, and that label for each state of ``mdp``."""
    label = np.zeros(mdp.n_states, np.int32)
    if machine is None:
        return np.zeros((1, 1), np.int32), label
    for i, name in enumerate(machine.propositions):
        if name not in mdp.propositions:
            message = (
                f"reward machine {machine.name!r} reads proposition {name!r}, which the environment does not "
                f"have; {suggest(name, mdp.propositions)}"
            )
            raise RuleError(message)
        label |= (mdp.label >> mdp.propositions.index(name) & 1).astype(np.int32) << i
    return machine.delta, label


def _assemble(
    mdp: TabularMDP,
    rules: Sequence[Automaton],
    machine: RewardMachine | None,
    states: tuple[Longs, Ints],
    outcomes: tuple[Longs, Ints, Longs],
) -> TabularMDP:
    """Read the product's fields off its keys, where it starts, and the outcomes that were taken."""
    keys, start = states
    row, next_state, taken = outcomes
    sink = keys < 0
    radices = [*(max(rule.n_states, 1) for rule in rules), len(machine.states) if machine else 1]
    columns, rest = [], np.where(sink, 0, keys)
    for radix in reversed(radices):
        columns.append(rest % radix)
        rest = rest // radix
    state, parts = rest, np.stack(columns[::-1], axis=1).astype(np.int32)
    marked = mdp.marked[state] & ~sink
    for k, rule in enumerate(rules):
        parts[sink & ((-1 - keys) >> k & 1 == 1), k] = NONE
        marked &= np.append(rule.marked, False)[parts[:, k]]  # the last entry is that of NONE
    own = mdp.origin[state]
    own[sink] = NONE
    reward = mdp.reward[taken]
    if machine:
        before = np.repeat(parts[:, -1], np.diff(row[:: mdp.n_actions]))
        reward = machine.reward[before, _machine_tables(mdp, machine)[1][mdp.next_state[taken]]]
    return TabularMDP(
        actions=mdp.actions,
        alphabet=mdp.alphabet,
        propositions=mdp.propositions,
        words=mdp.words,
        row=row,
        next_state=next_state,
        prob=mdp.prob[taken],
        reward=reward,
        word=mdp.word[taken],
        terminal=mdp.terminal[state] | sink,
        marked=marked,
        label=np.where(sink, 0, mdp.label[state]),
        initial=np.bincount(start, mdp.initial[mdp.initial > 0], len(keys)).astype(np.float64),
        origin=np.hstack([own, parts if machine else parts[:, :-1]]),
    )

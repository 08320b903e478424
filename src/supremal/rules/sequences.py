"""Rules given as sequences of actions that are safe, or unsafe: section III of the paper.

A *rule* is a partial automaton over its own alphabet with all states marked.  It breaks on a word that has
an event of that alphabet for which it has no transition; events outside the alphabet do not touch it.

The paper completes its automata with a state s_a that flags a violation:

1. *safe* sequences, an automaton G_s': every missing transition leads to s_a (`complete_safe`);
2. *unsafe* sequences, an automaton H_1 that marks them: every missing transition leads back to the initial
   state (`complete_unsafe`).

The second construction forgets overlaps: with ``a a b`` forbidden it resets on the third ``a`` of ``a a a b``
and lets the word pass.  `complete_factors` does not: it marks Σ*·S_un, the words in which some unsafe
sequence has just ended, however they overlap.  `rule_from_unsafe` uses that one.
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE
from supremal.automata.alphabet import Alphabet
from supremal.automata.automaton import Automaton
from supremal.automata.compose import extend
from supremal.automata.reduce import complete, determinise, keep, mark_all
from supremal.errors import RuleError


def complete_safe(safe: Automaton) -> Automaton:
    r"""Return the paper's G_s for G_s' = ``safe``: a missing transition leads to s_a, the one marked state.

    Examples
    --------
    >>> from supremal import complete_safe, from_text
    >>> g_s = complete_safe(from_text("0 -a-> 1 \n 1 -b-> 0"))
    >>> g_s.state_names, g_s.marked.tolist()
    (('0', '1', 's_a'), [False, False, True])
    """
    unmarked = Automaton(
        safe.alphabet,
        safe.delta,
        np.zeros(safe.n_states, np.bool_),
        safe.origin,
        safe.state_names,
        safe.name,
    )
    return complete(unmarked, trap="s_a", marked=True)


def complete_unsafe(unsafe: Automaton, alphabet: Alphabet | None = None) -> Automaton:
    """Return the paper's H for H_1 = ``unsafe``, literally: a missing transition leads to the initial state.

    ``alphabet`` adds the events of Σ that H_1 does not have.  See the module for what this construction
    misses; `complete_factors` is the one that does not.
    """
    wide = extend(unsafe, alphabet or unsafe.alphabet, stand_still=False)
    delta = np.where(wide.delta == NONE, 0, wide.delta)
    return Automaton(wide.alphabet, delta, wide.marked, wide.origin, wide.state_names, wide.name)


def complete_factors(unsafe: Automaton, alphabet: Alphabet | None = None) -> Automaton:
    r"""Return the automaton that marks Σ*·S_un, where ``unsafe`` marks S_un.

    A word reaches a marked state exactly when some word of S_un ends with it, so no unsafe sequence is missed
    for overlapping another.  ``alphabet`` adds events that break any sequence.

    Raises
    ------
    RuleError
        If S_un holds the empty word, which every word contains.

    Examples
    --------
    >>> from supremal import complete_factors, complete_unsafe, from_text
    >>> aab = from_text("marked 3 \n 0 -a-> 1 \n 1 -a-> 2 \n 2 -b-> 3")
    >>> complete_unsafe(aab).accepts("aaab"), complete_factors(aab).accepts("aaab")
    (False, True)
    """
    wide = extend(unsafe, alphabet or unsafe.alphabet, stand_still=False)
    if wide.n_states and wide.marked[0]:
        message = (
            f"rule {unsafe.name!r} forbids the empty word, which every word contains; "
            "unmark its initial state"
        )
        raise RuleError(message)
    events = range(len(wide.alphabet))
    sources, labels = np.nonzero(wide.delta != NONE)
    moves = zip(sources.tolist(), labels.tolist(), wide.delta[sources, labels].tolist(), strict=True)
    restart = wide.n_states  # a state apart, so that an H_1 that returns to its initial state stays itself
    loops = [(restart, e, restart) for e in events]
    return determinise(
        wide.alphabet,
        [*moves, *loops, (restart, NONE, 0)],
        [restart],
        np.flatnonzero(wide.marked).tolist(),
        name=unsafe.name,
    )


def cut_marked(automaton: Automaton) -> Automaton:
    """Return the rule that ``automaton`` never enters a marked state: these states are cut off."""
    return mark_all(keep(automaton, ~automaton.marked))


def rule_from_safe(safe: Automaton) -> Automaton:
    """Return the rule "only sequences that ``safe`` can follow": every state is marked.

    The paper leaves the marked states of G_s' empty, which in supervisory control would leave no word at all.
    """
    return mark_all(safe)


def rule_from_unsafe(unsafe: Automaton, alphabet: Alphabet | None = None) -> Automaton:
    """Return the rule "no sequence that ``unsafe`` marks, anywhere".

    Examples
    --------
    >>> from supremal import from_text, rule_from_unsafe
    >>> no_u_turn = rule_from_unsafe(from_text('''
    ...     marked s_a
    ...     0 -r-> right
    ...     0 -l-> left
    ...     right -r-> s_a
    ...     left -l-> s_a
    ... '''))
    >>> no_u_turn.run(["r", "l", "r"]) >= 0, no_u_turn.run(["r", "l", "l"])
    (True, -1)
    """
    return cut_marked(complete_factors(unsafe, alphabet))

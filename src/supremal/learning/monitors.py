"""Counting violations: a monitor of each rule beside a learner that may or may not know the rules.

Each event that breaks a rule counts as one violation, and that rule starts again from its initial state.  An
episode that ends while a rule is not marked, with something owed for ever, counts as one violation of that
rule; one that is cut off does not, since it could still have been given.  The monitors of all rules are one
table over the words that a process can produce.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from supremal._arrays import NONE, Ints
from supremal.automata.automaton import Automaton
from supremal.decisions.mdp import TabularMDP
from supremal.errors import MDPError

_MAX_STATES: Final = 100_000


@dataclass(frozen=True, slots=True, eq=False)
class WordMonitor:
    """The rules' joint monitor: M states over W words.

    Parameters
    ----------
    next_state
        ``int32 [M, W]``.
    breaks
        ``int32 [M, W]``: how many violations the word is.
    owed
        ``int32 [M]``: how many rules are not marked, and violated if the episode ends here.
    """

    next_state: Ints
    breaks: Ints
    owed: Ints


def word_monitor(mdp: TabularMDP, rules: Sequence[Automaton]) -> WordMonitor:
    """Return the joint monitor of ``rules`` over the words of ``mdp``.

    Raises
    ------
    MDPError
        If it would have more than 100,000 states.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes, from_text
    >>> walk = from_outcomes([(0, "go", 0, 1.0, ("go", "go"))], alphabet=Alphabet(("go",)))
    >>> word_monitor(walk, [from_text("fresh -go-> spent", alphabet=walk.alphabet)]).breaks.tolist()
    [[1]]
    """
    order = {(0,) * len(rules): 0}
    rows: list[list[int]] = []
    breaks: list[list[int]] = []
    queue = list(order)
    spelled = [mdp.alphabet.spell(word) for word in mdp.words]
    for state in queue:  # grows while it is walked through
        ends = [_follow(rules, state, word) for word in spelled]
        for end, _ in ends:
            if end not in order:
                order[end] = len(order)
                queue.append(end)
        if len(order) > _MAX_STATES:
            message = (
                f"monitoring {len(rules)} rules at once takes more than {_MAX_STATES:,} states; monitor fewer"
            )
            raise MDPError(message)
        rows.append([order[end] for end, _ in ends])
        breaks.append([count for _, count in ends])
    shape = (len(rows), len(spelled))
    owed = [
        sum(not rule.marked[q : q + 1].any() for rule, q in zip(rules, state, strict=True)) for state in order
    ]
    return WordMonitor(
        np.array(rows, np.int32).reshape(shape),
        np.array(breaks, np.int32).reshape(shape),
        np.array(owed, np.int32),
    )


def _follow(
    rules: Sequence[Automaton], state: tuple[int, ...], word: tuple[str, ...]
) -> tuple[tuple[int, ...], int]:
    """Return the joint state after ``word`` and the number of violations on the way."""
    after, count = list(state), 0
    for name in word:
        for k, rule in enumerate(rules):
            if name in rule.alphabet:
                to = rule.run([name], after[k])
                count += to == NONE
                after[k] = max(to, 0)
    return tuple(after), count

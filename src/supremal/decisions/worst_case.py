r"""The worst case: what chance can do to a fixed policy, if it always chooses what hurts most.

Probabilities play no part here, only what is possible.  With N epochs left a state is worth

    w₀(s) = 0,    w_{n+1}(s) = min { r + w_n(s') : (s', r) a possible outcome of π(s) in s },

and 0 where an episode ends.  This is minimax control with one policy only: no episode of at most N epochs
earns less than w_N at its start, and the one that is returned earns just that.  To see the longest episode
instead of the poorest, let every step cost 1.

Source: Bertsekas, *Dynamic Programming and Optimal Control*, volume I, section 1.6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from supremal._arrays import Bools, Ints, Longs
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.safety import reachable_states
from supremal.errors import MDPError


@dataclass(frozen=True, slots=True, eq=False)
class WorstCase:
    """What `worst_case` returns.

    Parameters
    ----------
    value
        The return of the worst episode, undiscounted.
    start
        The state in which it starts.
    outcomes
        ``int64 [T]``: its outcomes, as numbers into ``next_state``, ``reward`` and ``word``; T ≤ N.
    """

    value: float
    start: int
    outcomes: Longs

    def __post_init__(self) -> None:
        self.outcomes.flags.writeable = False


def worst_case(mdp: TabularMDP, policy: Ints, steps: int) -> WorstCase:
    """Return the worst episode of ``policy`` that is cut after ``steps`` epochs.

    Parameters
    ----------
    mdp
        The process.
    policy
        ``int [S]``: an action for each state that it reaches.
    steps
        N, the most epochs.

    Returns
    -------
    WorstCase
        Of several worst episodes, the first in the order of initial states and outcomes.

    Raises
    ------
    MDPError
        If ``steps`` is below 0, or the policy takes an infeasible action in a state that it reaches.

    Notes
    -----
    N sweeps, each linear in the outcomes of the R states that the policy reaches; takes 8 N R bytes.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> toss = from_outcomes(
    ...     [(0, "toss", 0, 0.5, ("tails",), -1.0), (0, "toss", 1, 0.5, ("heads",), -1.0)],
    ...     alphabet=Alphabet(("heads", "tails"), uncontrollable=frozenset({"heads", "tails"})),
    ...     terminal=[1],
    ... )
    >>> worst = worst_case(toss, [0, 0], 3)
    >>> worst.value, [toss.spell(toss.word[o]) for o in worst.outcomes]
    (-3.0, [('tails',), ('tails',), ('tails',)])
    """
    if steps < 0:
        message = f"steps is {steps}; a whole number from 0 up is needed"
        raise MDPError(message)
    states, first, outcome = _followed(mdp, policy)
    number = np.full(mdp.n_states, states.size)  # where episodes end: the last entry of a value, which is 0
    number[states] = np.arange(states.size)
    target, reward = number[mdp.next_state[outcome]], mdp.reward[outcome]
    owner = np.repeat(np.arange(states.size), np.diff(np.append(first, outcome.size)))
    value = np.zeros(states.size + 1)
    chosen = np.empty((steps, states.size), np.int64)
    for n in range(steps):
        worth = reward + value[target]
        value[:-1] = np.minimum.reduceat(worth, first) if states.size else 0.0
        least = np.flatnonzero(worth == value[owner])
        chosen[n] = least[np.searchsorted(least, first)]

    starts = np.flatnonzero(mdp.initial > 0)
    start = int(starts[np.argmin(value[number[starts]])])
    taken, at = [], number[start]
    for n in range(steps - 1, -1, -1):
        if at == states.size:
            break
        taken.append(outcome[chosen[n, at]])
        at = target[chosen[n, at]]
    return WorstCase(float(value[number[start]]), start, np.array(taken, np.int64))


def _followed(mdp: TabularMDP, policy: Ints) -> tuple[Longs, Longs, Longs]:
    """Return the states in which the policy acts, where the outcomes of each begin, and the outcomes."""
    chosen = np.asarray(policy)
    if chosen.shape != (mdp.n_states,) or chosen.dtype.kind not in "iu":
        message = f"the policy has shape {chosen.shape}; int {(mdp.n_states,)} is needed"
        raise MDPError(message)
    acts: Bools = (chosen[:, None] == np.arange(mdp.n_actions)) & mdp.feasible & ~mdp.terminal[:, None]
    reached = np.flatnonzero(reachable_states(mdp, acts) & ~mdp.terminal)
    wrong = reached[~acts[reached].any(axis=1)]
    if wrong.size:
        message = (
            f"the policy takes action {int(chosen[wrong[0]])} in state {int(wrong[0])}, which it reaches and "
            "where that is not feasible; a feasible one is needed"
        )
        raise MDPError(message)
    slot = reached * mdp.n_actions + chosen[reached]
    count = mdp.row[slot + 1] - mdp.row[slot]
    first = np.cumsum(count) - count
    outcome = np.repeat(mdp.row[slot] - first, count) + np.arange(count.sum())
    return reached, first, outcome

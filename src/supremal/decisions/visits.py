"""How often a policy visits each state: the occupation of its chain over an episode.

From the initial distribution μ₀ a policy makes μₙ₊₁ = μₙ P, where what ends does not go on.  An episode of at
most N steps visits state s in the mean μ₀(s) + μ₁(s) + … + μ_N(s) times; an end is visited once.

Source: Puterman, *Markov Decision Processes*, section 6.9 (state-action frequencies).
"""

from __future__ import annotations

import numpy as np

from supremal._arrays import Floats, Ints
from supremal.decisions.evaluation import policy_weights
from supremal.decisions.mdp import TabularMDP
from supremal.errors import MDPError

_TOLERANCE = 1e-9


def expected_visits(mdp: TabularMDP, policy: Ints | Floats, *, horizon: int) -> Floats:
    """Return how often an episode visits each state in the mean, ``float64 [S]``.

    Parameters
    ----------
    mdp
        The process.
    policy
        ``int [S]``, an action for each state, or ``float [S, A]``, a distribution for each.  Only the states
        that it reaches need one.
    horizon
        The most steps of an episode.

    Raises
    ------
    MDPError
        If the horizon is below 0, or the policy takes an infeasible action in a state that it reaches.

    Notes
    -----
    Exact but for rounding.  Linear in ``horizon`` times the outcomes of the process.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> toss = from_outcomes(
    ...     [(0, "toss", 0, 0.5, ("tails",)), (0, "toss", 1, 0.5, ("heads",))],
    ...     alphabet=Alphabet(("heads", "tails"), uncontrollable=frozenset({"heads", "tails"})),
    ...     terminal=[1],
    ... )
    >>> expected_visits(toss, [0, 0], horizon=2).tolist()
    [1.75, 0.75]
    """
    if horizon < 0:
        message = f"the horizon is {horizon}; a whole number of steps, 0 or more, is needed"
        raise MDPError(message)
    weights = np.where(mdp.terminal[:, None], 0.0, policy_weights(mdp, policy))
    prob = mdp.prob * np.repeat(weights.reshape(-1), np.diff(mdp.row))
    taken = np.flatnonzero(prob)
    source = np.repeat(np.arange(mdp.n_states), np.diff(mdp.row[:: mdp.n_actions]))[taken]
    target, prob = mdp.next_state[taken], prob[taken]
    there = mdp.initial.astype(np.float64)
    visits, left = there.copy(), np.where(mdp.terminal, 0.0, there)
    for _ in range(horizon):
        there = np.bincount(target, prob * there[source], mdp.n_states).astype(np.float64)
        if abs(there.sum() - left.sum()) > _TOLERANCE:
            message = "the policy takes an infeasible action, or none, in a state that it reaches"
            raise MDPError(message)
        visits += there
        left = np.where(mdp.terminal, 0.0, there)
    return visits

"""Finite horizons: the best that can be done in N epochs, by backward induction.

v_0 = 0 and v_{n+1} = T v_n: what n epochs are worth, and the action with which to begin them.  The best
policy depends on how many are left.

Source: Puterman, *Markov Decision Processes*, section 4.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints
from supremal.decisions import _planning_kernels as kernels
from supremal.decisions.chains import largest, rounding
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import enabled_choices
from supremal.errors import MDPError


@dataclass(frozen=True, slots=True, eq=False)
class HorizonPlan:
    """What `finite_horizon` returns.

    Parameters
    ----------
    value
        ``float64 [N + 1, S]``: the largest expected return of the first n epochs; row 0 is 0.
    policy
        ``int32 [N, S]``: the action to begin with where n + 1 epochs are left; `NONE` where there is none.
    bound
        No value is further than this from the exact one.
    """

    value: Floats
    policy: Ints
    bound: float

    def __post_init__(self) -> None:
        self.value.flags.writeable = self.policy.flags.writeable = False


def finite_horizon(
    mdp: TabularMDP, steps: int, *, gamma: float = 1.0, enabled: Bools | None = None
) -> HorizonPlan:
    """Return the best policy for an episode that is cut after ``steps`` epochs.

    Parameters
    ----------
    mdp
        The process.
    steps
        N, the most epochs.
    gamma
        The discount factor, in [0, 1].
    enabled
        ``bool [S, A]``: the mask of a supervisor; left out: every feasible action.

    Raises
    ------
    MDPError
        If ``steps`` or γ is out of its range, or the mask leaves a reachable state without an action.

    Notes
    -----
    N sweeps, each linear in the outcomes; the result takes 12 N S bytes.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> save = from_outcomes(
    ...     [(0, "spend", 1, 1.0, ("spend",), 3.0), (0, "save", 0, 1.0, ("save",), 2.0)],
    ...     alphabet=Alphabet(("spend", "save")), terminal=[1],
    ... )
    >>> plan = finite_horizon(save, 3)
    >>> plan.value[:, 0].tolist(), [save.actions[a] for a in plan.policy[:, 0]]
    ([0.0, 3.0, 5.0, 7.0], ['spend', 'save', 'save'])
    """
    if steps < 0:
        message = f"steps is {steps}; a whole number from 0 up is needed"
        raise MDPError(message)
    if not 0 <= gamma <= 1:
        message = f"gamma is {gamma}; a number from 0 to 1 is needed"
        raise MDPError(message)
    choices = enabled_choices(mdp, enabled)
    gain, mass = kernels.expected(choices.outcome, choices.prob, choices.reward)
    flat = (choices.outcome, choices.target, choices.prob, gain, gamma)
    value = np.zeros((steps + 1, mdp.n_states))
    policy = np.full((steps, mdp.n_states), NONE, np.int32)
    best = np.full(mdp.n_states, NONE, np.int64)
    bound = 0.0
    for n in range(steps):
        kernels.bellman(choices.choice, *flat, value[n], value[n + 1], best)
        policy[n] = np.append(choices.action, np.int32(NONE))[best]
        bound = gamma * mass * bound + rounding(choices.fan, largest(choices.reward), largest(value[n]))
    return HorizonPlan(value, policy, float(bound))

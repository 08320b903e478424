"""Howard's policy iteration: evaluate a policy exactly, improve it in every state at once, and so on.

Each policy is better than the one before, so that it ends, and it ends with an optimal one: no action is
worth more than what is taken.  A policy is evaluated by a sparse linear system (see
`supremal.decisions.chains`), so that the number of iterations, usually some ten, depends neither on γ nor on
how slowly the process forgets.  That makes it the better choice for γ near 1 and for wide grids.

An action is changed only for one that is better by more than rounding could make it seem, and the bound of
the result is that of one last sweep, as in `supremal.decisions.planning`.

Source: Howard, *Dynamic Programming and Markov Processes* (1960); Puterman, *Markov Decision Processes*,
section 6.4.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from supremal._arrays import Bools
from supremal.decisions.mdp import TabularMDP
from supremal.decisions.planning import Plan, best_choices, discounted, iterate, plan_of, settle

_FIRST_ROUNDS: Final = 10


def policy_iteration(mdp: TabularMDP, *, gamma: float, enabled: Bools | None = None) -> Plan:
    """Return optimal values and an optimal policy for the discounted return, by policy iteration.

    Parameters
    ----------
    mdp
        The process.
    gamma
        The discount factor, in [0, 1).
    enabled
        ``bool [S, A]``: the mask of a supervisor; left out: every feasible action.

    Raises
    ------
    MDPError
        If γ is out of its range or the mask leaves a reachable state without an action.
    ConvergenceError
        If ten thousand policies do not suffice.

    Notes
    -----
    Each iteration is linear in the outcomes for each step of the linear solver.

    Examples
    --------
    >>> from supremal import Alphabet, from_outcomes
    >>> step = from_outcomes([(0, "go", 0, 1.0, ("go",), 1.0)], alphabet=Alphabet(("go",)))
    >>> float(policy_iteration(step, gamma=0.75).value[0])
    4.0
    """
    model = discounted(mdp, gamma, enabled)
    value = np.zeros(mdp.n_states)
    settle(model, value, tolerance=0.0, rounds=_FIRST_ROUNDS)
    return plan_of(mdp, model, iterate(model, best_choices(model, value), np.zeros(mdp.n_states))[0])

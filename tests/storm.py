"""The model checker Storm as a second opinion; needs stormpy 2.

Storm is asked for a precision of ``PRECISION`` and for sound methods, where it says that it has them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from supremal import TabularMDP

PRECISION = 1e-10


def hand_over(mdp: TabularMDP, target: np.ndarray) -> Any:
    """Return the process as a model of Storm, rewards called "r", the states of ``target`` "target".

    A state that has no action gets a loop, which earns nothing.
    """
    import stormpy
    from stormpy.datastructures import SparseMatrixBuilder
    from stormpy.models import SparseMdp, SparseModelComponents, SparseRewardModel, StateLabeling

    feasible = mdp.feasible
    stuck = ~feasible.any(axis=1)
    rows = feasible.copy()
    rows[stuck, 0] = True
    number = np.cumsum(rows.reshape(-1)) - 1
    slot = np.repeat(np.arange(feasible.size), np.diff(mdp.row))
    loops = np.flatnonzero(stuck)
    row = np.append(number[slot], number[loops * mdp.n_actions])
    column = np.append(mdp.next_state, loops)
    chance, reward = np.append(mdp.prob, np.ones(loops.size)), np.append(mdp.reward, np.zeros(loops.size))
    entries, which = np.unique(row * mdp.n_states + column, return_inverse=True)
    builder = SparseMatrixBuilder[float](has_custom_row_grouping=True)
    builder.add_next_values(
        (entries // mdp.n_states).tolist(),
        (entries % mdp.n_states).tolist(),
        np.bincount(which, chance).tolist(),
        np.append(0, np.cumsum(rows.sum(axis=1)))[:-1].tolist(),
    )
    labels = StateLabeling(mdp.n_states)
    for name, states in (("init", mdp.initial > 0), ("target", target)):
        labels.add_label(name)
        labels.set_states(
            name, stormpy.datastructures.BitVector(mdp.n_states, np.flatnonzero(states).tolist())
        )
    earned = SparseRewardModel[float](
        optional_state_action_reward_vector=np.bincount(row, chance * reward, rows.sum()).tolist()
    )
    parts = SparseModelComponents[float](
        transition_matrix=builder.build(), state_labeling=labels, reward_models={"r": earned}
    )
    return SparseMdp[float](parts)


def ask(handed: Any, formula: str, *, precision: float = PRECISION) -> np.ndarray:
    """Return what Storm says of ``formula`` in each state."""
    import stormpy

    environment = stormpy.environments.sound()
    solver = environment.solver().min_max()
    solver.precision = stormpy.Rational(precision)
    solver.relative_termination_criterion = False
    question = stormpy.parse_properties(formula)[0]
    result = stormpy.model_checking(handed, question, environment=environment)
    return np.array([float(x) for x in result.get_value_vector()])

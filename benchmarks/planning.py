"""Discounted planning beside QuantEcon, MDPSolver and Storm: one process, one precision, one thread.

Four actions with three successors each, γ = 0.99, values to within 1e-6.  *Random*: successors are drawn from
all states, which makes one strong component that forgets fast.  *Layered*: from those of the same of eight
layers, seldom from those of the next, and the last layer ends, as the product with a reward machine of
eight states looks.  Seconds are processor time of the solver; handing over to a peer is left out.
QuantEcon and MDPSolver run modified policy iteration; Storm its own choice for discounted rewards.

A million states, which takes minutes, is ``python -m benchmarks planning_large``; ``WITHOUT=Storm,MDPSolver``
leaves out peers.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from supremal import Alphabet, TabularMDP, value_iteration
from supremal.decisions.policy_iteration import policy_iteration

sys.path.append(str(Path(__file__).parents[1] / "tests"))
import storm

SIZES = (10_000, 100_000)
ACTIONS, FAN, LAYERS = 4, 3, 8
GAMMA, TOLERANCE = 0.99, 1e-6
REPEATS = 3
PATIENCE = 60.0
Solved = tuple[np.ndarray, float]


def process(states: int, *, layers: int) -> TabularMDP:
    """Return a random process; with more than one layer the last state ends."""
    rng = np.random.default_rng(0)
    pairs = states * ACTIONS
    size = states // layers
    layer = np.repeat(np.arange(states) // size, ACTIONS)[:, None]
    leap = rng.random((pairs, FAN)) < (0.01 if layers > 1 else 0.0)
    target = np.minimum((layer + leap) * size + rng.integers(0, size, (pairs, FAN)), states - 1)
    prob = rng.dirichlet(np.ones(FAN), pairs)
    ends = np.zeros(states, np.bool_)
    ends[-1] = layers > 1
    kept = pairs - ACTIONS * int(ends.sum())
    return TabularMDP(
        actions=tuple("abcd"),
        alphabet=Alphabet(("a",)),
        propositions=(),
        words=((),),
        row=np.minimum(np.arange(pairs + 1), kept) * FAN,
        next_state=target[:kept].reshape(-1),
        prob=prob[:kept].reshape(-1),
        reward=np.repeat(rng.random(kept), FAN),
        word=np.zeros(kept * FAN, np.int32),
        terminal=ends,
        marked=ends,
        label=np.zeros(states, np.int64),
        initial=(np.arange(states) == 0).astype(np.float64),
    )


def clocked(work: Callable[[], Any], repeats: int = REPEATS) -> tuple[Any, float]:
    """Return the result and the least processor time of some runs."""
    best = float("inf")
    for _ in range(repeats):
        began = process_time()
        result = work()
        best = min(best, process_time() - began)
        if best > PATIENCE / REPEATS:
            break
    return result, best


def looped(mdp: TabularMDP) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rewards, successors and probabilities ``[S, A(, K)]``; an end stays where it is, for nothing."""
    shape = (mdp.n_states, ACTIONS, FAN)
    lost = mdp.n_states * ACTIONS * FAN - len(mdp.prob)
    reward = np.append(mdp.reward, np.zeros(lost)).reshape(shape)[:, :, 0]
    target = np.append(mdp.next_state, np.full(lost, mdp.n_states - 1)).reshape(shape)
    return reward, target, np.append(mdp.prob, np.full(lost, 1 / FAN)).reshape(shape)


def by_quantecon(mdp: TabularMDP) -> Solved:
    from quantecon.markov import DiscreteDP
    from scipy.sparse import csr_matrix

    reward, target, prob = looped(mdp)
    pairs = mdp.n_states * ACTIONS
    matrix = csr_matrix(
        (prob.reshape(-1), target.reshape(-1), np.arange(pairs + 1) * FAN), shape=(pairs, mdp.n_states)
    )
    states, actions = np.divmod(np.arange(pairs), ACTIONS)
    problem = DiscreteDP(reward.reshape(-1), matrix, GAMMA, states, actions)
    problem.solve(method="modified_policy_iteration", epsilon=1.0)  # compiles
    result, seconds = clocked(lambda: problem.solve(method="modified_policy_iteration", epsilon=TOLERANCE))
    return result.v, seconds


def by_mdpsolver(mdp: TabularMDP) -> Solved:
    import mdpsolver

    reward, target, prob = looped(mdp)
    solver = mdpsolver.model()
    solver.mdp(
        discount=GAMMA, rewards=reward.tolist(), tranMatProbs=prob.tolist(), tranMatColumns=target.tolist()
    )
    _, seconds = clocked(lambda: solver.solve(algorithm="mpi", tolerance=TOLERANCE, parallel=False), 1)
    return np.array(solver.getValueVector()), seconds


def by_storm(mdp: TabularMDP) -> Solved:
    handed = storm.hand_over(mdp, mdp.terminal)
    formula = f'R{{"r"}}max=? [Cdiscount={GAMMA}]'
    return clocked(lambda: storm.ask(handed, formula, precision=TOLERANCE))


PEERS: dict[str, Callable[[TabularMDP], Solved]] = {
    "QuantEcon": by_quantecon,
    "MDPSolver": by_mdpsolver,
    "Storm": by_storm,
}


def run(sizes: tuple[int, ...] = SIZES, without: str = "") -> dict[str, Any]:
    """Print the times and their ratios; return the record.  ``without`` names peers that are not asked."""
    rows = []
    absent = os.environ.get("WITHOUT", without).split(",")
    peers = {name: solve for name, solve in PEERS.items() if name not in absent}
    for solver in (value_iteration, policy_iteration):
        solver(process(16, layers=1), gamma=GAMMA)
        solver(process(16, layers=2), gamma=GAMMA)
    for states in sizes:
        for kind, layers in (("random", 1), ("layered", LAYERS)):
            mdp = process(states, layers=layers)
            plan, ours = clocked(lambda mdp=mdp: value_iteration(mdp, gamma=GAMMA, tolerance=TOLERANCE))
            howard, exact = clocked(lambda mdp=mdp: policy_iteration(mdp, gamma=GAMMA))
            assert np.abs(plan.value - howard.value).max() <= plan.bound + howard.bound
            row: dict[str, Any] = {"kind": kind, "states": states, "seconds": ours, "bound": plan.bound}
            row |= {"policy_iteration_seconds": exact, "policy_iteration_bound": howard.bound}
            print(f"{kind:8}{states:10,} value iteration {ours:8.3f} s, within {plan.bound:.0e}", flush=True)
            print(f"{'':18} policy iteration{exact:8.3f} s, within {howard.bound:.0e}", flush=True)
            for name, solve in peers.items():
                value, seconds = solve(mdp)
                off = float(np.abs(value - howard.value).max())
                row[name] = {"seconds": seconds, "ratio": seconds / ours, "off": off}
                times = f"{seconds / ours:6.1f} times as long"
                print(f"{'':18} {name:15} {seconds:8.3f} s, {times}; off by {off:.0e}", flush=True)
            rows.append(row)
    return {"gamma": GAMMA, "tolerance": TOLERANCE, "processes": rows}

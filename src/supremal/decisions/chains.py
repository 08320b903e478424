"""Markov chains: the expected total of what is earned before a chain ends.

Let P be the part of a chain's matrix that stays among its n states, from which it ends with probability 1,
or let γ < 1.  Then v = g + γ P v has one solution, v = (I - γP)⁻¹ g.  A discounted value, an expected
number of steps and a probability of reaching are all of this form.

I - γP is an M-matrix.  Its states are put in the order in which strong components are found, sinks first, so
that what has no cycle is solved by substitution alone.  The rest falls to BiCGSTAB, preconditioned by an LU
factorisation without fill-in, which exists for an M-matrix, and of which plain iteration converges too.  A
system of a hundred states is solved as it stands.

The *bound* rests on nothing of this.  Where w ≥ 1 + γ P w, an error of δ in every equation moves v by
no more than δ w: the error e obeys ``|e| ≤ δ + γ P |e| ≤ … ≤ δ w``.  The expected number of steps is such
a w.

Source: Meijerink, van der Vorst, "An iterative solution method for linear systems of which the
coefficient matrix is a symmetric M-matrix", Math. Comp. 31 (1977); van der Vorst, "Bi-CGSTAB", SIAM J. Sci.
Stat. Comput. 13 (1992); Bertsekas, Tsitsiklis, *Parallel and Distributed Computation*, section 2.6.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from supremal._arrays import NONE, Bools, Floats, Ints, Longs
from supremal.decisions import _linear_kernels as kernels
from supremal.decisions._planning_kernels import sweep
from supremal.decisions.components import strong_components
from supremal.errors import ConvergenceError

EPS: Final = float(np.finfo(np.float64).eps)
_ROUNDS: Final = 100
_STEPS: Final = 500
_SHRINK: Final = 1e-8
_PROGRESS: Final = 0.9
_TRUSTED: Final = 0.5
_FEW: Final = 100
_LAST_BITS: Final = 4


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """A chain of n states: s leads to ``target[start[s] : start[s + 1]]`` with ``prob``, else it ends."""

    start: Longs
    target: Ints
    prob: Floats

    @property
    def source(self) -> Longs:
        """The state that each edge leaves."""
        return np.repeat(np.arange(len(self.start) - 1), np.diff(self.start))


def within(chain: Chain, states: Bools) -> Chain:
    """Return ``chain`` cut down to some states, numbered anew; it ends where it leaves them."""
    number = np.where(states, np.cumsum(states) - 1, NONE).astype(np.int32)
    source, target = number[chain.source], number[chain.target]
    kept = (source != NONE) & (target != NONE)
    start = np.searchsorted(source[kept], np.arange(states.sum() + 1))
    return Chain(start.astype(np.int64), target[kept], chain.prob[kept])


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """I - γP with its states in ``order``, as rows of sorted columns; and its factors without fill-in."""

    order: Longs
    ptr: Longs
    col: Ints
    val: Floats
    lu: Floats
    diagonal: Longs

    def residual(self, right: Floats, x: Floats) -> Floats:
        """Return ``right`` - A x."""
        product = np.empty(x.size)
        kernels.multiply(self.ptr, self.col, self.val, x, product)
        return right - product

    def krylov(self, right: Floats) -> Floats:
        """Solve A x = ``right`` roughly, fast where all goes well."""
        parts = (self.ptr, self.col, self.val, self.lu, self.diagonal)
        return kernels.bicgstab(*parts, right, _SHRINK, _STEPS)

    def substitute(self, right: Floats) -> Floats:
        """Solve A x = ``right`` roughly, by steps that are sure to converge if there are enough of them."""
        x, step, residual = np.zeros(right.size), np.empty(right.size), right
        for _ in range(_STEPS):
            kernels.substitute(self.ptr, self.col, self.lu, self.diagonal, residual, step)
            x += step
            residual = self.residual(right, x)
        return x

    def eliminate(self, right: Floats) -> Floats:
        """Solve A x = ``right`` by Gaussian elimination."""
        matrix = np.zeros((right.size, right.size))
        matrix[np.repeat(np.arange(right.size), np.diff(self.ptr)), self.col] = self.val
        try:
            x: Floats = np.linalg.solve(matrix, right).astype(np.float64)
        except np.linalg.LinAlgError:  # as good as singular; the residual tells
            x = self.substitute(right)
        return x


def system(chain: Chain, gamma: float = 1.0) -> System:
    """Lay out I - γP for a ``chain`` that ends with probability 1, or γ < 1."""
    states = len(chain.start) - 1
    order = sinks_first(strong_components(chain.start, chain.target))
    rank = np.empty(states, np.int64)
    rank[order] = np.arange(states)
    entries = np.append(rank[chain.source] * states + rank[chain.target], np.arange(states) * (states + 1))
    places, which = np.unique(entries, return_inverse=True)
    weights = np.append(-gamma * chain.prob, np.ones(states))
    val = np.bincount(which, weights, len(places)).astype(np.float64)
    ptr = np.searchsorted(places, np.arange(states + 1) * states)
    col = (places % max(states, 1)).astype(np.int32)
    return System(order, ptr, col, val, *kernels.factorise(ptr, col, val))


def solve(a: System, gain: Floats) -> Floats:
    """Return (I - γP)⁻¹ g, as exactly as doubles allow."""
    x, residual = np.zeros(gain.size), gain[a.order]
    right, size = residual, largest(residual)
    for _ in range(_ROUNDS):
        if size <= _LAST_BITS * EPS * largest(x):
            break
        for step in (a.eliminate,) if x.size <= _FEW else (a.krylov, a.substitute):
            tried = x + step(residual)
            left = a.residual(right, tried)
            if largest(left) < _PROGRESS * size:
                x, residual, size = tried, left, largest(left)
                break
        else:
            break
    value = np.empty(x.size)
    value[a.order] = x
    return value


@dataclass(frozen=True, slots=True, eq=False)
class Resolvent:
    """What it takes to compute expected totals of one chain: `resolvent` makes it.

    ``weight`` is the w ≥ 1 + γ P w of the module's text.
    """

    chain: Chain
    gamma: float
    system: System
    weight: Floats


def resolvent(chain: Chain, gamma: float = 1.0) -> Resolvent:
    """Prepare the expected totals of a ``chain`` that ends with probability 1, or of one with γ < 1.

    Raises
    ------
    ConvergenceError
        If it takes so many steps that doubles cannot tell whether it ends.
    """
    a = system(chain, gamma)
    one = np.ones(a.order.size)
    weight = solve(a, one)
    missing = mistake(chain, one, gamma, weight)
    if not missing < _TRUSTED:
        message = f"an expected total is beyond double precision: about {largest(weight):.3g} steps"
        raise ConvergenceError(message, weight)
    return Resolvent(chain, gamma, a, weight / (1 - missing))


def expected_total(r: Resolvent, gain: Floats, *, scale: float = 0.0) -> tuple[Floats, Floats]:
    """Return v = g + γ P v and how far it may be from it, both ``float64 [n]``.

    ``scale`` is the largest of the numbers that ``gain`` was summed up from, if larger.
    """
    value = solve(r.system, gain)
    return value, mistake(r.chain, gain, r.gamma, value, scale) * r.weight


def mistake(chain: Chain, gain: Floats, gamma: float, value: Floats, scale: float = 0.0) -> float:
    """Return the most that g + γ P v can differ from v."""
    fan = int(np.diff(chain.start).max(initial=0))
    slack = rounding(fan, max(scale, largest(gain)), largest(value))
    return largest(change_of(chain, gain, gamma, value)) + slack


def change_of(chain: Chain, gain: Floats, gamma: float, value: Floats) -> Floats:
    """Return g + γ P v - v."""
    after = np.empty(value.size)
    sweep(chain.start, chain.target, chain.prob, gain, gamma, value, after)
    return after - value


def rounding(fan: int, reward: float, value: float) -> float:
    """Return what rounding can add to p (r + γ v) summed over ``fan`` outcomes, r and v at most these."""
    return (fan + 4) * EPS * (reward + value)


def largest(x: Floats) -> float:
    """Return ‖x‖ in the maximum norm."""
    return float(np.abs(x).max(initial=0.0))


def sinks_first(component: Ints) -> Longs:
    """Return the states by component, sinks first, and within one from the last to the first."""
    order: Longs = component.size - 1 - np.argsort(component[::-1], kind="stable")
    return order

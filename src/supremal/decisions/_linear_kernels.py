"""Kernels for sparse linear systems with an M-matrix, such as I - γP.

A matrix is rows of sorted columns: those of row i are ``col[ptr[i] : ptr[i + 1]]`` with the values ``val``.

Source: Saad, *Iterative Methods for Sparse Linear Systems*, algorithms 10.4 (ILU(0)) and 7.7 (BiCGSTAB).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from supremal._arrays import NONE, Floats, Ints, Longs
from supremal._jit import kernel

_EPS: Final = float(np.finfo(np.float64).eps)


@kernel
def factorise(ptr: Longs, col: Ints, val: Floats) -> tuple[Floats, Longs]:
    """Return LU ≈ A without fill-in, L below the unit diagonal and U from it on, and where U begins."""
    rows = ptr.shape[0] - 1
    lu, diagonal = val.copy(), np.empty(rows, np.int64)
    place = np.full(rows, NONE, np.int64)
    for i in range(rows):
        for k in range(ptr[i], ptr[i + 1]):
            place[col[k]] = k
        for k in range(ptr[i], place[i]):
            j = col[k]
            lu[k] /= lu[diagonal[j]]
            for m in range(diagonal[j] + 1, ptr[j + 1]):
                if place[col[m]] != NONE:
                    lu[place[col[m]]] -= lu[k] * lu[m]
        diagonal[i] = place[i]
        lu[place[i]] = max(lu[place[i]], _EPS)  # it is above 0 but for rounding
        for k in range(ptr[i], ptr[i + 1]):
            place[col[k]] = NONE
    return lu, diagonal


@kernel
def substitute(ptr: Longs, col: Ints, lu: Floats, diagonal: Longs, right: Floats, x: Floats) -> None:
    """Solve LU x = ``right``."""
    rows = ptr.shape[0] - 1
    for i in range(rows):
        total = right[i]
        for k in range(ptr[i], diagonal[i]):
            total -= lu[k] * x[col[k]]
        x[i] = total
    for i in range(rows - 1, -1, -1):
        total = x[i]
        for k in range(diagonal[i] + 1, ptr[i + 1]):
            total -= lu[k] * x[col[k]]
        x[i] = total / lu[diagonal[i]]


@kernel
def multiply(ptr: Longs, col: Ints, val: Floats, x: Floats, y: Floats) -> None:
    """Write A x to ``y``."""
    for i in range(y.shape[0]):
        total = 0.0
        for k in range(ptr[i], ptr[i + 1]):
            total += val[k] * x[col[k]]
        y[i] = total


@kernel
def dot(x: Floats, y: Floats) -> float:
    """Return Σ x y, always summed in the same order."""
    total = 0.0
    for i in range(x.shape[0]):
        total += x[i] * y[i]
    return total


@kernel
def bicgstab(
    ptr: Longs, col: Ints, val: Floats, lu: Floats, diagonal: Longs, right: Floats, shrink: float, limit: int
) -> Floats:
    """Solve A x = ``right`` until the residual is smaller by ``shrink``, if all goes well.

    BiCGSTAB, preconditioned from the right by LU; it ends early where it breaks down.
    """
    rows = right.shape[0]
    x, residual = np.zeros(rows), right.copy()
    direction, along, towards = right.copy(), np.empty(rows), np.empty(rows)
    smooth, after = np.empty(rows), np.empty(rows)
    goal = dot(right, right) * shrink * shrink
    rho = dot(right, residual)
    for _ in range(limit):
        substitute(ptr, col, lu, diagonal, direction, towards)
        multiply(ptr, col, val, towards, along)
        slope = dot(right, along)
        if slope == 0.0 or rho == 0.0:
            break
        alpha = rho / slope
        for i in range(rows):
            x[i] += alpha * towards[i]
            residual[i] -= alpha * along[i]
        if dot(residual, residual) <= goal:
            break
        substitute(ptr, col, lu, diagonal, residual, smooth)
        multiply(ptr, col, val, smooth, after)
        size = dot(after, after)
        if size == 0.0:
            break
        omega = dot(after, residual) / size
        for i in range(rows):
            x[i] += omega * smooth[i]
            residual[i] -= omega * after[i]
        if dot(residual, residual) <= goal or omega == 0.0:
            break
        before, rho = rho, dot(right, residual)
        beta = rho / before * alpha / omega
        for i in range(rows):
            direction[i] = residual[i] + beta * (direction[i] - omega * along[i])
    return x

"""What can be said of a learner after a few seeds.

A mean over few runs is moved by one that failed, a median ignores half of them.  The *interquartile mean* is
the mean of the middle half.  How far it may be off is told by the *stratified bootstrap*: the statistic of
many samples, in each of which the runs of every task are drawn anew, with replacement, from that task's own.

*Regret* is what a learner has earned less, in all its episodes so far, than the best policy would have.

Source: Agarwal, Schwarzer, Castro, Courville, Bellemare, "Deep reinforcement learning at the edge of the
statistical precipice", NeurIPS 2021; Lattimore, Szepesvári, *Bandit Algorithms*, section 4.4 (regret).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from supremal._arrays import Floats
from supremal.errors import MDPError


def interquartile_mean(scores: ArrayLike) -> float:
    """Return the mean of ``scores`` without the lowest and the highest quarter.

    Parameters
    ----------
    scores
        ``float`` of any shape; all count together.  A quarter of their number is rounded down.

    Raises
    ------
    MDPError
        If there are none.

    Examples
    --------
    >>> interquartile_mean([1.0, 2.0, 3.0, 1000.0])
    2.5
    """
    ordered = np.sort(np.asarray(scores, np.float64), axis=None)
    if not ordered.size:
        message = "there is no score to take a mean of; give at least one"
        raise MDPError(message)
    cut = ordered.size // 4
    return float(ordered[cut : ordered.size - cut].mean())


def bootstrap_interval(
    scores: ArrayLike,
    statistic: Callable[[Floats], float] = interquartile_mean,
    *,
    confidence: float = 0.95,
    resamples: int = 2000,
    seed: int = 0,
) -> tuple[float, float]:
    """Return a confidence interval for a statistic of a learner's scores, by the stratified bootstrap.

    Parameters
    ----------
    scores
        ``float [R]``, of R runs, or ``float [R, T]``, of R runs on each of T tasks, which are the strata.
    statistic
        Takes scores of the same shape.
    confidence
        The share of such intervals that hold the true value, in (0, 1).
    resamples
        How many samples are drawn; time grows with them, memory does not.
    seed
        Same seed, same interval.

    Raises
    ------
    MDPError
        If there is no score, or a number is out of its range.

    Examples
    --------
    >>> low, high = bootstrap_interval([0.9, 0.8, 1.0, 0.7, 0.95, 0.85])
    >>> 0.7 <= low <= interquartile_mean([0.9, 0.8, 1.0, 0.7, 0.95, 0.85]) <= high <= 1.0
    True
    """
    given = np.asarray(scores, np.float64)
    if given.ndim not in (1, 2) or not given.size:
        message = f"scores have shape {given.shape}; (runs,) or (runs, tasks), and at least one, are needed"
        raise MDPError(message)
    for name, value, holds, right in (
        ("confidence", confidence, 0 < confidence < 1, "a number above 0, below 1,"),
        ("resamples", resamples, resamples >= 1, "a whole number from 1"),
    ):
        if not holds:
            message = f"{name} is {value}; {right} is needed"
            raise MDPError(message)
    rng = np.random.default_rng(seed)
    found = [
        statistic(np.take_along_axis(given, rng.integers(given.shape[0], size=given.shape), axis=0))
        for _ in range(resamples)
    ]
    low, high = np.quantile(found, [(1 - confidence) / 2, (1 + confidence) / 2])
    return float(low), float(high)


def regret(returns: ArrayLike, best: float, *, interval: int = 1) -> Floats:
    """Return the regret at the end of each interval of episodes.

    Parameters
    ----------
    returns
        ``float [N]``: what each episode earned.
    best
        What an episode of the best policy earns in the mean: without a discount and within n steps
        ``finite_horizon(mdp, n, enabled=mask).value[-1] @ mdp.initial``.
    interval
        How many episodes make an interval; the last may be shorter.

    Returns
    -------
    float64 [⌈N / interval⌉]
        Chance can make it fall for a while, or begin below 0.

    Raises
    ------
    MDPError
        If ``interval`` is below 1.

    Examples
    --------
    >>> regret([-9.0, -5.0, -4.0], -4.0, interval=2).tolist()
    [6.0, 6.0]
    """
    if interval < 1:
        message = f"interval is {interval}; a whole number from 1 is needed"
        raise MDPError(message)
    lost = np.cumsum(best - np.asarray(returns, np.float64))
    ends = np.minimum(np.arange(interval, lost.size + interval, interval), lost.size)
    so_far: Floats = lost[ends - 1]
    return so_far

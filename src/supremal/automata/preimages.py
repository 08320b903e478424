"""δ turned round: from which states an event leads to a state."""

from __future__ import annotations

import numpy as np

from supremal._arrays import NONE, Ints, Longs
from supremal._jit import kernel


@kernel
def preimages(delta: Ints) -> tuple[Longs, Ints]:
    """Return ``start [S * E + 1]`` and ``source``: event e leads to t from which states.

    They are ``source[start[t * E + e] : start[t * E + e + 1]]``, ascending.  Linear in the table.
    """
    states, events = delta.shape
    start = np.zeros(states * events + 1, np.int64)
    for s in range(states):
        for e in range(events):
            if delta[s, e] != NONE:
                start[delta[s, e] * events + e + 1] += 1
    for k in range(states * events):
        start[k + 1] += start[k]
    source = np.empty(start[states * events], np.int32)
    # Filling from the back moves each start down to where it belongs, so that no second array is needed.
    for s in range(states - 1, -1, -1):
        for e in range(events):
            if delta[s, e] != NONE:
                k = delta[s, e] * events + e + 1
                start[k] -= 1
                source[start[k]] = s
    for k in range(states * events):
        start[k] = start[k + 1]
    start[states * events] = source.shape[0]
    return start, source

"""N runs of a supervised environment at once.

As long as only happens what the supervisor allows, they are N numbers, and an event is a gather from one
table; its row for those outside of the supervisor leads nowhere, its column for no event leads back.  A run
that leaves the supervisor gets a `Run` of its own until it is back, and what may pass there is what its
`Gate` says.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from supremal._arrays import NONE, Bools, Ints, Longs
from supremal.envs._supervised_gate import Gate
from supremal.envs._supervised_model import Masks
from supremal.envs._supervised_run import Run
from supremal.envs._supervised_setup import Setup, environment
from supremal.envs._supervised_words import Objects
from supremal.errors import MDPError


class Runs:
    """N runs of one model.

    Parameters
    ----------
    setup
        What they share.
    n
        How many.

    Notes
    -----
    ``state`` is ``int32 [N]``, the supervisor's, `NONE` outside of it, where ``lost`` has the run; ``broken``
    is ``bool [N]``: where something happened in this episode that the plant said could not.
    """

    def __init__(self, setup: Setup, n: int) -> None:
        model = setup.model
        self._setup, self._events = setup, model.events
        self._pattern = Run(model)
        self._gate = Gate(self._pattern, setup)
        delta = model.supervisor.automaton.delta
        self._out, self._width = np.int32(len(delta)), delta.shape[1] + 1
        inside = np.column_stack([delta, np.arange(self._out, dtype=np.int32)])
        inside[inside == NONE] = self._out
        self._delta: Ints = np.vstack([inside, np.full(self._width, self._out)]).reshape(-1)
        self._masks: Masks = np.vstack([model.masks, np.ones_like(model.masks[:1])])
        self._nothing: Bools = ~np.asarray(self._masks.any(axis=1))
        rules = model.supervisor.automaton.origin[:, len(model.plants) :].T
        self._owed = np.zeros(self._out + 1, np.int64)
        for rule, states in zip(model.rules, rules, strict=True):
            self._owed[:-1] += ~rule.marked[states]
        self._at = np.zeros(n, np.int32)
        self._left: dict[int, Run] = {}  # those that have been outside in this episode
        self.broken = np.zeros(n, np.bool_)

    @property
    def state(self) -> Ints:
        """The supervisor's state in each run, `NONE` outside of it; ``int32 [N]``."""
        return np.where(self._at == self._out, np.int32(NONE), self._at)

    @property
    def lost(self) -> dict[int, Run]:
        """The runs that are outside of the supervisor."""
        return {i: run for i, run in self._left.items() if run.state == NONE}

    def run(self, i: int) -> Run:
        """Return run number ``i`` on its own."""
        if self._at[i] == self._out:
            return self._left[i]
        run = self._pattern.another()
        run.state = int(self._at[i])
        return run

    def reset(self, which: Bools) -> None:
        """Let the runs ``which [N]`` start again."""
        if not which.any():
            return
        self._at = np.where(which, np.int32(0), self._at)
        self.broken = self.broken & ~which
        self._left = {i: run for i, run in self._left.items() if not which[i]}

    def follow(self, rows: Ints, words: Objects, places: Longs) -> Longs:
        """Follow a word in each run; return how many rules each broke, ``int64 [N]``.

        Parameters
        ----------
        rows
            ``int32 [N, L]``: the numbers of the events, padded by their count.
        words
            ``[N]``: the same as names.
        places
            ``[N]``: the actions that the agent chose.
        """
        before = at = self._at
        for column in rows.T:
            at = self._delta.take(at * self._width + column)
        broken = np.zeros(len(at), np.int64)
        gone = at == self._out
        if not gone.any():
            self._at = at
            return broken
        at, self.broken = at.copy(), self.broken.copy()
        for i in np.flatnonzero(gone).tolist():
            if i not in self._left:
                self._left[i] = self._pattern.another()
            run = self._left[i]
            if before[i] != self._out:
                run.state = int(before[i])
            with environment(i):
                broken[i] = run.observe(words[i], self._events[places[i]])
            at[i] = self._out if run.state == NONE else run.state
            self.broken[i] = run.surprise is not None
        self._at = at
        return broken

    def owed(self) -> Longs:
        """Return how many rules are not satisfied in each run, ``int64 [N]``."""
        owed: Longs = self._owed[self._at]
        for i, run in self.lost.items():
            owed[i] = run.owed
        return owed

    def settle(self, infos: dict[str, Any], over: Bools) -> tuple[Masks, Masks]:
        """Return what is enabled and what passes, each ``int8 [N, A]``; all ones where a run is ``over [N]``.

        Raises
        ------
        MDPError
            If in some run nothing would pass.
        """
        enabled = self._masks.take(self._at, axis=0)
        passing = self._setup.mode == "monitor"
        mask = np.ones_like(enabled) if passing else enabled.copy()
        stuck: Bools = np.zeros(len(over), np.bool_) if passing else self._nothing.take(self._at)
        own = _own_masks(infos, mask.shape) if self._setup.own else None
        if own is not None:
            enabled, mask = enabled & own, mask & own
            stuck = np.asarray((mask == 0).all(axis=1))
        one_by_one = {*self.lost, *np.flatnonzero(stuck).tolist()}
        for i in sorted(i for i in one_by_one if not over[i]):
            gate = self._gate.beside(self.run(i))
            with environment(i):
                gate.settle({} if own is None else {"action_mask": own[i]}, terminated=False)
            enabled[i], mask[i] = gate.enabled, gate.mask
        if over.any():
            enabled[over] = mask[over] = 1
        return enabled, mask

    def instead(self, i: int, place: int, enabled: Masks, random: np.random.Generator) -> int:
        """Return what run ``i`` does in place of an action that is not enabled; see `Gate.instead`."""
        gate = self._gate.beside(self.run(i))
        gate.enabled = enabled
        with environment(i):
            return gate.instead(place, random)


def _own_masks(infos: dict[str, Any], shape: tuple[int, ...]) -> Masks:
    """Return the environments' own masks."""
    own = np.asarray(infos.get("action_mask"))
    if own.shape != shape:
        got = f"it has shape {own.shape}" if "action_mask" in infos else "there is none"
        message = f"own_mask needs infos['action_mask'] of shape {shape} from the environments; {got}"
        raise MDPError(message)
    return own.astype(np.int8)

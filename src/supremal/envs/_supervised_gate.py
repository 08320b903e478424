"""Which actions may pass next: those that the supervisor enables, in safe mode those that a rule allows.

An empty mask is never passed on.  Synthesis sees to it that the supervisor keeps an action wherever the plant
offers one; what synthesis cannot know is an error that says which of the parts leaves nothing.
"""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from supremal._arrays import NONE
from supremal.envs._supervised_model import Masks
from supremal.envs._supervised_run import Run
from supremal.envs._supervised_setup import Setup
from supremal.errors import MDPError


class Gate:
    """The mask beside a run.

    Parameters
    ----------
    run
        Which it follows.
    setup
        What may pass.

    Notes
    -----
    ``enabled`` and ``mask``, both ``int8 [A]``, differ where everything passes.
    """

    def __init__(self, run: Run, setup: Setup) -> None:
        self._run, self._setup = run, setup
        self._passing, self._own, self._safe = setup.mode == "monitor", setup.own, setup.safe
        self._all = np.ones(len(run.model.events), np.int8)
        self._some: list[bool] = run.model.masks.any(axis=1).tolist()  # type: ignore[assignment] # of bools
        self.enabled = self.mask = self._all

    def beside(self, run: Run) -> Gate:
        """Return the same for another run of the model."""
        other = copy(self)
        other._run = run  # noqa: SLF001 - one of its own kind
        return other

    def settle(self, info: dict[str, Any], *, terminated: bool) -> None:
        """Settle what is enabled and what passes, after a step with this ``info``.

        Raises
        ------
        MDPError
            If nothing would pass.
        """
        if terminated:
            self.enabled = self.mask = self._all
            return
        state = self._run.state
        if state == NONE:
            enabled = self._run.look_ahead() if self._safe is None else self._safe
            some = bool(enabled.any())
        else:
            enabled, some = self._run.model.masks[state], self._some[state]
        mask = self._all if self._passing else enabled
        if self._own:
            own = _own_mask(info, len(mask))
            enabled, mask = enabled & own, mask & own
            if (self._passing or some) and not mask.any():
                message = (
                    f"no action can pass ({self._where()}): the environment's own mask enables "
                    f"{'nothing' if not own.any() else 'none of those that the supervisor does'}"
                )
                raise MDPError(message)
        if not some and not self._passing:
            raise MDPError(self._why_nothing())
        self.enabled, self.mask = enabled, mask

    def instead(self, place: int, random: np.random.Generator) -> int:
        """Return what is carried out in place of an action that is not enabled.

        Raises
        ------
        MDPError
            If the mode is strict.
        """
        if self._passing:
            return place
        enabled = np.flatnonzero(self.enabled)
        if self._setup.mode == "correct":
            return int(enabled[0 if self._setup.replace == "first" else int(random.random() * len(enabled))])
        events = self._run.model.events
        names = ", ".join(events[a] for a in enabled)
        message = (
            f"action {self._setup.first + place} ({events[place]!r}) is disabled ({self._where()}): "
            f"{self._why(place)}; enabled: {names}"
        )
        raise MDPError(message)

    def _why(self, place: int) -> str:
        """Say why action number ``place`` is not enabled."""
        run = self._run
        if run.state != NONE and not run.model.masks[run.state, place]:
            return run.model.why(run.state, place)
        if run.state == NONE and self._safe is not None and not self._safe[place]:
            return "it is not one of safe_actions"
        if run.state == NONE and self._safe is None and not run.look_ahead()[place]:
            return "it breaks a rule at once"
        return "the environment's own mask does not enable it"

    def _where(self) -> str:
        return self._run.model.describe(self._run.parts)

    def _why_nothing(self) -> str:
        """Say why the supervisor, or what there is outside of it, enables nothing."""
        if self._run.state == NONE:
            return (
                f"no action can pass ({self._where()}): this is outside of the supervisor, and every action "
                "breaks a rule at once; give safe_actions"
            )
        return (
            f"no action can pass ({self._where()}): the plant says that none is possible here; an agent "
            "has to choose, so give the plant an action, like waiting, in that state"
        )


def replacements(seed: int | None) -> np.random.Generator:
    """Return what replacements are drawn by: a stream that has nothing to do with the environment's own."""
    return np.random.default_rng(None if seed is None else np.random.SeedSequence(seed, spawn_key=(0,)))


def _own_mask(info: dict[str, Any], actions: int) -> Masks:
    """Return the environment's own mask."""
    own = np.asarray(info.get("action_mask"))
    if own.shape != (actions,):
        got = f"it has shape {own.shape}" if "action_mask" in info else "there is none"
        message = f"own_mask needs info['action_mask'] with {actions} entries from the environment; {got}"
        raise MDPError(message)
    return own.astype(np.int8)

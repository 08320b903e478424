"""Where the steps of N environments ended, whatever comes after.

An environment that resets itself *in the same step* shows the first observation of the next episode, and puts
what belongs to the step that ended the last one into ``infos["final_obs"]`` and ``infos["final_info"]``.

Source: Gymnasium's documentation, *Vector autoreset modes*.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from supremal._arrays import Bools
from supremal.envs._gymnasium import AutoresetMode, Dict, Space, Tuple, VectorEnv
from supremal.errors import MDPError


def autoreset_mode(env: VectorEnv[Any, Any, Any]) -> AutoresetMode:
    """Return when environments start again; left open, in the next step."""
    told = env.metadata.get("autoreset_mode", AutoresetMode.NEXT_STEP)
    try:
        return AutoresetMode(told)
    except ValueError:
        known = ", ".join(f"AutoresetMode.{mode.name}" for mode in AutoresetMode)
        message = f"metadata['autoreset_mode'] is {told!r}; one of {known} is needed"
        raise MDPError(message) from None


def arrival(
    space: Space[Any],
    observations: Any,  # noqa: ANN401 - the environments'
    infos: dict[str, Any],
    done: Bools,
) -> tuple[Any, dict[str, Any]]:
    """Return the observations and infos that belong to the steps, not to what came after.

    Parameters
    ----------
    space
        That of one observation.
    observations, infos
        What the environments gave.
    done
        ``bool [N]``: which of them ended an episode, and started again.

    Raises
    ------
    MDPError
        If they do not say how it ended.
    """
    missing = [key for key in ("final_obs", "final_info") if key not in infos]
    if missing:
        message = (
            f"the environments start again in the same step and give no infos[{missing[0]!r}], without which "
            "nobody knows what ended the episode"
        )
        raise MDPError(message)
    arrived = _copied(space, observations)
    for i in np.flatnonzero(done).tolist():
        arrived = _put(space, arrived, i, row(infos["final_obs"], i))
    outer = {key: value for key, value in infos.items() if key.lstrip("_") not in {"final_obs", "final_info"}}
    return arrived, _overlaid(outer, infos["final_info"], done)


def row(batch: Any, i: int) -> Any:  # noqa: ANN401 - as nested as an observation
    """Return number ``i`` of a batch of observations."""
    if isinstance(batch, Mapping):
        return {key: row(part, i) for key, part in batch.items()}
    if isinstance(batch, tuple):
        return tuple(row(part, i) for part in batch)
    return batch[i]


def _copied(space: Space[Any], batch: Any) -> Any:  # noqa: ANN401 - as nested as an observation
    if isinstance(space, Dict):
        return {key: _copied(part, batch[key]) for key, part in space.spaces.items()}
    if isinstance(space, Tuple):
        return tuple(_copied(part, batch[k]) for k, part in enumerate(space.spaces))
    return np.copy(batch) if isinstance(batch, np.ndarray) else tuple(batch)


def _put(space: Space[Any], batch: Any, i: int, one: Any) -> Any:  # noqa: ANN401 - as nested as an observation
    """Return ``batch`` with ``one`` as number ``i``; arrays are written to."""
    if isinstance(space, Dict):
        return {key: _put(part, batch[key], i, one[key]) for key, part in space.spaces.items()}
    if isinstance(space, Tuple):
        return tuple(_put(part, batch[k], i, one[k]) for k, part in enumerate(space.spaces))
    if isinstance(batch, np.ndarray):
        batch[i] = one
        return batch
    return (*batch[:i], one, *batch[i + 1 :])


def _overlaid(infos: dict[str, Any], final: dict[str, Any], done: Bools) -> dict[str, Any]:
    """Return ``infos`` with what ``final`` has in their place where an episode is ``done``."""
    told: dict[str, Any] = {}
    nobody = np.zeros(len(done), np.bool_)
    for key in dict.fromkeys(key for key in (*infos, *final) if not key.startswith("_")):
        before, after = infos.get(key), final.get(key)
        if isinstance(before, dict) or isinstance(after, dict):
            told[key] = _overlaid(before or {}, after or {}, done)
        elif before is None or after is None:
            told[key] = before if after is None else after
        else:
            shaped = done.reshape(-1, *[1] * (np.ndim(before) - 1))
            told[key] = np.where(shaped, after, before)
        told[f"_{key}"] = np.where(done, _present(final, key, nobody), _present(infos, key, nobody))
    return told


def _present(infos: dict[str, Any], key: str, nobody: Bools) -> Bools:
    """Return which environments told ``key``: by Gymnasium's custom ``_key`` says so."""
    return infos.get(f"_{key}", ~nobody) if key in infos else nobody

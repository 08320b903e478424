"""An episode as a film: GIF or MP4, through Gymnasium's own recorder.

The recorder takes a picture after the reset and after each step, so an episode of N steps has N + 1.  What
is chosen may depend on what is observed and on ``info``, where the mask is: a policy under a supervisor is
filmed as it acts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from supremal.envs._gymnasium import Env, RecordVideo
from supremal.errors import FormatError, MDPError

ENDINGS: Final = (".gif", ".mp4")
"""The endings of the files that `record_episode` writes."""
_FPS: Final = 4


def record_episode(
    path: str | PathLike[str],
    env: Env[Any, Any],
    choose: Callable[[Any, Mapping[str, Any]], Any],
    *,
    seed: int | None = None,
    max_steps: int = 1000,
    fps: int | None = None,
) -> Path:
    """Play one episode, and write it to a ``.gif`` or ``.mp4`` file; one that is there is replaced.

    Parameters
    ----------
    path
        Where to.  Folders are made where they are missing.
    env
        The environment, made with ``render_mode="rgb_array"``; it stays open.
    choose
        The action, of the observation and ``info``; that of a `SupervisedEnv` has the ``action_mask``.
    seed
        That of the episode.
    max_steps
        After so many steps the film ends.
    fps
        Pictures a second; left out: ``render_fps`` of the environment, or 4.

    Returns
    -------
    Path
        The path.

    Raises
    ------
    FormatError
        If the path has another ending.
    MDPError
        If the environment draws no pictures, or ``max_steps`` or ``fps`` is not above 0.
    MissingDependencyError
        If MoviePy is not installed.
    OSError
        If the file cannot be written.

    Examples
    --------
    With MoviePy installed, this films the first action that is possible, again and again::

        env = PickupDeliveryEnv(render_mode="rgb_array")
        record_episode("film.gif", env, lambda _, info: np.argmax(info["action_mask"]), seed=0, max_steps=20)

    >>> from supremal.envs import PickupDeliveryEnv
    >>> record_episode("film.avi", PickupDeliveryEnv(render_mode="rgb_array"), lambda *_: 0)
    Traceback (most recent call last):
    supremal.errors.FormatError: film.avi: films end in .gif or .mp4, not in '.avi'
    """
    target = Path(path)
    ending = target.suffix.lower()
    if ending not in ENDINGS:
        message = f"films end in {' or '.join(ENDINGS)}, not in {ending!r}"
        raise FormatError(message, path=str(path))
    _check(env, max_steps, fps)
    from supremal.envs import _moviepy  # an extra: only who records needs it

    target.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=target.parent, prefix=".film-") as beside:
        speed = fps or env.metadata.get("render_fps", _FPS)
        reel = Path(beside) / "reel"
        recorder = RecordVideo(env, str(reel), episode_trigger=lambda _: True, fps=speed, gc_trigger=None)
        _play(recorder, choose, seed, max_steps)
        if ending == ".gif":
            made = reel / "film.gif"
            _moviepy.write_gif(made, recorder.recorded_frames, speed)
            recorder.recorded_frames = []  # or it would warn that they are lost
        else:
            recorder.stop_recording()  # type: ignore[no-untyped-call]
            (made,) = reel.glob("*.mp4")
        made.replace(target)
    return target


def _check(env: Env[Any, Any], max_steps: int, fps: int | None) -> None:
    """Raise an `MDPError` if nothing could come of it."""
    if env.render_mode != "rgb_array":
        message = f"the environment has render_mode {env.render_mode!r}; 'rgb_array' is needed for a film"
        raise MDPError(message)
    if max_steps < 1:
        message = f"max_steps is {max_steps}; a whole number above 0 is needed"
        raise MDPError(message)
    if fps is not None and fps < 1:
        message = f"fps is {fps}; a whole number of pictures a second above 0 is needed"
        raise MDPError(message)


def _play(
    recorder: RecordVideo[Any, Any],
    choose: Callable[[Any, Mapping[str, Any]], Any],
    seed: int | None,
    max_steps: int,
) -> None:
    """Play an episode before the recorder; what it has filmed is thrown away if that fails."""
    try:
        observation, info = recorder.reset(seed=seed)
        for _ in range(max_steps):
            observation, _, terminated, truncated, info = recorder.step(choose(observation, info))
            if terminated or truncated:
                break
    except BaseException:
        recorder.recorded_frames = []  # or the recorder would warn, long after, that they are lost
        raise

"""The one module that imports MoviePy, with which Gymnasium's recorder writes its videos."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from supremal.errors import MissingDependencyError

try:
    from moviepy.video.io.ImageSequenceClip import ImageSequenceClip
except ImportError:
    package = "moviepy"
    raise MissingDependencyError(package, extra="video", purpose="recording an episode") from None


def write_gif(path: Path, frames: Sequence[Any], fps: int) -> None:
    """Write ``frames``, arrays ``uint8 [H, W, 3]``, to a GIF that starts again at its end."""
    ImageSequenceClip(list(frames), fps=fps).write_gif(str(path), logger=None)

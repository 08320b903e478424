"""The one module that imports tensorboard: its writer of event files, which needs nothing of TensorFlow."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from time import time

from supremal.errors import MissingDependencyError

try:
    from tensorboard.compat.proto.event_pb2 import Event
    from tensorboard.compat.proto.summary_pb2 import Summary
    from tensorboard.summary.writer.event_file_writer import EventFileWriter
except ImportError:
    package = "tensorboard"
    raise MissingDependencyError(package, extra="tensorboard", purpose="writing event files") from None

__all__ = ["EventFileWriter", "open_events", "write_scalars"]


def open_events(folder: Path) -> EventFileWriter:
    """Return a writer of a new event file in ``folder``, which is made if need be."""
    return EventFileWriter(str(folder))


def write_scalars(writer: EventFileWriter, step: int, scalars: Mapping[str, float]) -> None:
    """Write one event that holds all ``scalars`` of ``step``."""
    values = [Summary.Value(tag=tag, simple_value=value) for tag, value in scalars.items()]
    writer.add_event(Event(wall_time=time(), step=step, summary=Summary(value=values)))

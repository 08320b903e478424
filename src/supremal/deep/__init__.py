"""Deep learners under a supervisor, and what they learned in one file with it.

`load` and the `Bundle` that it returns need numpy only; all else needs the extra: ``pip install
'supremal[deep]'``.
"""

from typing import TYPE_CHECKING, Any

from supremal.deep.archive import load, save
from supremal.deep.bundle import Bundle

if TYPE_CHECKING:
    from supremal.deep.masked_dqn import MaskedDQN

__all__ = ["Bundle", "MaskedDQN", "load", "save"]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever has that name
    """Import torch for the learner only."""
    if name == "MaskedDQN":
        from supremal.deep.masked_dqn import MaskedDQN

        return MaskedDQN
    message = f"module {__name__!r} has no attribute {name!r}"
    raise AttributeError(message)

"""The one module that imports PettingZoo: what environments of several agents are made of."""

from __future__ import annotations

from supremal.errors import MissingDependencyError

try:
    from pettingzoo import AECEnv
except ImportError:
    package = "pettingzoo"
    raise MissingDependencyError(package, extra="multi", purpose="an environment of several agents") from None

__all__ = ["AECEnv"]

"""Running a study on a cluster, by Ray Tune.

Ray is asked for here by its environment variables, which it reads when it is imported; `_ray` imports it.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Final

from supremal.errors import SupremalError
from supremal.studies.results import Results
from supremal.studies.trial import Row

AUTO: Final = "auto"
LOCAL: Final = "local"

_QUIET: Final = {
    "RAY_USAGE_STATS_ENABLED": "0",  # nothing is sent to anybody
    "RAY_AIR_NEW_OUTPUT": "0",  # the new one tells of every trial, whatever is asked
    "TUNE_DISABLE_AUTO_CALLBACK_LOGGERS": "1",  # the rows are all that is wanted
    "TUNE_DISABLE_SIGINT_HANDLER": "1",  # Ctrl-C is ours
    "TUNE_RESULT_BUFFER_LENGTH": "1",  # a row that is finished is sent
}
_ALONE: Final = {
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",  # as there, so here: no port but on the loopback interface
}


class ClusterError(SupremalError):
    """A cluster that is not there, or a study that could not be finished on it."""


def run_on_cluster(
    results: Results,
    address: str = LOCAL,
    *,
    halving: bool = False,
    on_row: Callable[[Row], object] = lambda _: None,
) -> bool:
    """Run what is missing of a study on a Ray cluster, and write each row as it comes.

    Parameters
    ----------
    results
        Where the rows go.
    address
        "local" for a cluster of this machine alone, which ends with the study; "auto" for the one that this
        machine is part of; or host:port of its head.
    halving
        Whether settings whose metric is poor are given fewer seeds.
    on_row
        Told of each row that was written.

    Returns
    -------
    bool
        False where Ctrl-C stopped it; what was finished is written then.

    Raises
    ------
    ClusterError
        If there is no such cluster, or machines were lost again and again.
    MDPError
        If a setting cannot be learned with.
    ResultsError
        If the file cannot be written.
    MissingDependencyError
        If Ray is not installed.
    """
    for name, value in (_QUIET | (_ALONE if address == LOCAL else {})).items():
        os.environ.setdefault(name, value)
    from supremal.studies._ray import run_on_ray

    return run_on_ray(results, address, halving=halving, on_row=on_row)

"""Running a study in one process.

The kernels run without Python's lock, so threads take the cells to as many cores as there are; the models are
in memory once.  `supremal.studies.cluster` runs the same cells on several machines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Event

from supremal.studies.results import Results
from supremal.studies.trial import Row, Worlds, learn_cell


def run_study(results: Results, *, jobs: int = 1, on_row: Callable[[Row], object] = lambda _: None) -> bool:
    """Run what is missing of a study, and write the rows as they come.

    Parameters
    ----------
    results
        Where the rows go.
    jobs
        How many cells are run at a time.
    on_row
        Told of each row that was written.

    Returns
    -------
    bool
        False where Ctrl-C stopped it; what was finished is written then.

    Raises
    ------
    MDPError
        If a setting cannot be learned with.
    ResultsError
        If the file cannot be written.
    """
    study, stopped = results.study, Event()
    worlds, ended = Worlds(study.models.__getitem__), SimpleQueue[Future[Row | None]]()

    def collect() -> int:
        """Write what has ended since the last time, all at once; return how many that were."""
        futures = [ended.get(), *_taken(ended)]
        rows = [row for future in futures if not future.cancelled() and (row := future.result()) is not None]
        if rows:
            results.add(rows)
        for row in rows:
            on_row(row)
        return len(futures)

    with ThreadPoolExecutor(jobs) as pool:
        left = len(results.missing)
        for cell in results.missing:
            pool.submit(learn_cell, study, worlds, cell, stopped.is_set).add_done_callback(ended.put)
        try:
            while left:
                left -= collect()
        except BaseException as error:
            stopped.set()
            pool.shutdown(cancel_futures=True)
            if not isinstance(error, KeyboardInterrupt):
                raise
            if not ended.empty():
                collect()
    return not stopped.is_set()


def _taken(queue: SimpleQueue[Future[Row | None]]) -> Iterator[Future[Row | None]]:
    """Take what there is, without waiting."""
    with suppress(Empty):
        while True:
            yield queue.get_nowait()

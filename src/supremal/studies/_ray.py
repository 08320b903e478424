"""The one module that imports Ray: the cells of a study as trials of Ray Tune, on one machine or many.

A trial costs seconds before it learns anything, so many cells go into one, and the actors that run trials
are used again.  Tasks lie in Ray's object store, where every machine fetches those that it needs.  A trial
reports each row as it is finished and the driver writes it down at once; a trial whose machine is lost starts
again elsewhere.

*Halving* is Tune's asynchronous successive halving over seeds: a setting whose metric is worse than that of
most others after as many seeds is given no more.

Source: Liaw et al., "Tune: a research platform for distributed model selection and training", 2018; Li et
al., "A system for massively parallel hyperparameter tuning", MLSys 2020.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from math import ceil, inf
from socket import create_connection
from tempfile import TemporaryDirectory
from typing import Any, Final, cast

from supremal.errors import MDPError, MissingDependencyError, SupremalError
from supremal.studies.cluster import AUTO, LOCAL, ClusterError
from supremal.studies.ranking import mean_score
from supremal.studies.results import Results
from supremal.studies.study import Cell, Study
from supremal.studies.trial import Row, Worlds, learn_cell

try:
    import ray
    from ray import tune
    from ray.tune.schedulers import ASHAScheduler
except ImportError:
    package = "ray"
    raise MissingDependencyError(package, extra="ray", purpose="running a study on a cluster") from None

_TRIALS_A_CORE: Final = 8
"""Enough that all cores end at about the same time."""

_RETRIES: Final = 5
"""How often a trial may lose its machine."""

_PATIENCE: Final = 10.0
"""Seconds until a machine that does not answer is not there."""

_LEVEL: Final = "CRITICAL"
"""What Ray may tell; a trial that failed and is started again is no error here."""

_SCORE: Final = "score"
"""What a trial reports of a setting: the interquartile mean of its metric so far, lower is better."""


class _Trial(tune.Trainable):  # type: ignore[misc] # Ray's classes have no types
    """Runs its cells, one a step, and reports the row of each."""

    def setup(
        self,
        config: Mapping[str, Any],
        study: Study,
        models: Sequence[Any],
        known: Mapping[Cell, Row],
    ) -> None:
        self._study, self._known = study, known
        self._worlds = Worlds(lambda number: ray.get(models[number]))
        self.reset_config(config)

    def reset_config(self, config: Mapping[str, Any]) -> bool:
        self._cells: list[Cell] = [(number, seed) for number, seed in config["cells"]]
        self._rows: list[Row] = []
        return True

    def step(self) -> dict[str, Any]:
        cell = self._cells[len(self._rows)]
        try:
            row = self._known.get(cell) or cast("Row", learn_cell(self._study, self._worlds, cell))
        except SupremalError as error:
            return {"slip": str(error), _SCORE: inf, "done": True}
        self._rows.append(row)
        score = mean_score(self._study.metric, [one for one in self._rows if one.setting == row.setting])
        return {"row": asdict(row), _SCORE: score, "done": len(self._rows) == len(self._cells)}


class _Collector(tune.Callback, tune.Stopper):  # type: ignore[misc] # as above
    """Takes the rows that trials report, in the driver; after a slip it stops them all."""

    def __init__(self, results: Results, on_row: Callable[[Row], object]) -> None:
        self.results, self.on_row = results, on_row
        self.slip: SupremalError | None = None
        self._rows: list[Row] = []

    def __reduce__(self) -> tuple[type, tuple[()]]:
        return tune.Callback, ()  # Tune keeps a copy of what it was told, which is not wanted here

    def on_trial_result(self, *, result: Mapping[str, Any], **_: object) -> None:
        if "slip" in result:
            self.slip = MDPError(result["slip"])
        else:
            self._rows.append(Row(**result["row"]))

    def on_step_end(self, **_: object) -> None:
        """Write what has come in this turn of Tune's loop; a trial that was started again repeats itself."""
        rows = [row for row in self._rows if (row.setting, row.seed) not in self.results.rows]
        self._rows.clear()
        try:
            if rows:
                self.results.add(rows)
        except SupremalError as error:
            self.slip = error
        else:
            for row in rows:
                self.on_row(row)

    def __call__(self, *_: object) -> bool:
        return self.stop_all()

    def stop_all(self) -> bool:
        return self.slip is not None


def run_on_ray(results: Results, address: str, *, halving: bool, on_row: Callable[[Row], object]) -> bool:
    """Do what `run_on_cluster` says."""
    cells, collector = results.missing, _Collector(results, on_row)
    if not cells:
        return True
    with _cluster(address), TemporaryDirectory() as folder:
        tuner = tune.Tuner(
            tune.with_parameters(
                tune.with_resources(_Trial, {"cpu": 1}),
                study=replace(results.study, models=()),
                models=[ray.put(model) for model in results.study.models],
                known=dict(results.rows),
            ),
            param_space={"cells": tune.grid_search(_trials(results.study, cells, halving=halving))},
            tune_config=tune.TuneConfig(
                reuse_actors=True,
                metric=_SCORE,
                mode="min",
                scheduler=_scheduler(results.study) if halving else None,
            ),
            run_config=tune.RunConfig(
                name="study",
                storage_path=folder,
                callbacks=[collector],
                stop=collector,
                verbose=0,
                checkpoint_config=tune.CheckpointConfig(checkpoint_at_end=False),
                failure_config=tune.FailureConfig(max_failures=_RETRIES),
            ),
        )
        try:
            ended = tuner.fit()
        except KeyboardInterrupt:
            return False
    if collector.slip is not None:
        raise collector.slip
    if results.missing and ended.num_errors:
        reason = str(ended.errors[-1]).strip().splitlines()[-1]
        message = (
            f"{len(results.missing)} of {len(results.study.cells)} results are missing, after {_RETRIES} new "
            f"attempts: {reason}; the same command goes on with them"
        )
        raise ClusterError(message)
    return True


@contextmanager
def _cluster(address: str) -> Iterator[None]:
    """Give a cluster, unless the program is on one already."""
    if ray.is_initialized():
        yield
        return
    try:
        if address == LOCAL:
            ray.init(LOCAL, include_dashboard=False, log_to_driver=False, logging_level=_LEVEL)
        else:
            _check_answers(address)
            ray.init(address, log_to_driver=False, logging_level=_LEVEL)
    except (OSError, ValueError, RuntimeError) as error:
        message = (
            f"there is no Ray cluster at {address!r} ({str(error).splitlines()[0]}); start one with ray "
            f"start, or use --ray {LOCAL}"
        )
        raise ClusterError(message) from None
    try:
        yield
    finally:
        ray.shutdown()


def _check_answers(address: str) -> None:
    """Check that something listens at host:port; Ray itself would go on asking for minutes."""
    if address != AUTO:
        host, _, port = address.rpartition(":")
        if not host or not port.isdecimal():
            message = f"{AUTO}, {LOCAL} or host:port is needed"
            raise ValueError(message)
        create_connection((host, int(port)), timeout=_PATIENCE).close()


def _trials(study: Study, cells: Sequence[Cell], *, halving: bool) -> list[list[Cell]]:
    """Share cells out among trials: with halving, all those of a setting to one."""
    if halving:
        of: dict[int, list[Cell]] = {number: [] for number, _ in cells}
        for cell in study.cells:
            if cell[0] in of:  # also what is known already, for the scheduler to see
                of[cell[0]].append(cell)
        return list(of.values())
    cores = int(ray.cluster_resources().get("CPU", 0))
    size = ceil(len(cells) / max(cores * _TRIALS_A_CORE, 1))
    return [list(cells[at : at + size]) for at in range(0, len(cells), size)]


def _scheduler(study: Study) -> ASHAScheduler:
    return ASHAScheduler(max_t=len(study.seeds), grace_period=1, reduction_factor=3)

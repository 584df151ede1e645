"""config → grid → model → kernel → executor → store → plots."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweep import dataset, executor
from sweep.config import Config, ConfigError, Fault, load_config
from sweep.grid import Array, Grid
from sweep.jit import fingerprint
from sweep.kernels import methods
from sweep.kernels.lanes import RUNNING, SETTLED
from sweep.models import MODELS, TIERS
from sweep.models.model import Model
from sweep.plan import Plan, plan
from sweep.prediction import predict as predict_grid
from sweep.store import Identity, RunFiles
from sweep.verification import verify

# Beside the numeric sources: they fill the images, and turn them into results.
_DECISIVE = tuple(
    str(Path(__file__).parent / name) for name in ("plan.py", "prediction.py", "grid.py", "dataset.py", "run.py")
)


@dataclass(frozen=True)
class Progress:
    cells: int
    done: int
    failed: int
    done_before: int
    """Of `done`, those that an earlier run left."""
    seconds: float


class Reporter:
    """What a run tells while it goes on; this one keeps silent."""

    def compiling(self) -> None:
        """The kernel has to be compiled first."""

    def chunk(self, progress: Progress) -> None:
        """Another chunk is done."""

    def note(self, message: str) -> None:
        """Something worth a line."""


def run(
    config: Config | str | Path,
    output: str | Path | None = None,
    *,
    fresh: bool = False,
    reporter: Reporter | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Run a sweep.

    Parameters
    ----------
    config : a configuration or the path of one
    output : folder for the dataset, its maps and, until they are finished, a checkpoint from which
        the same call goes on; by default nothing is written
    fresh : discard what an earlier run left in `output`
    overrides : values that replace the file's, such as ``mu=60`` or ``t_end=1000``

    Returns
    -------
    Dataset over the axes of the configuration; every variable carries its meaning as `long_name`.

    Raises
    ------
    ConfigError, StoreError
        where the configuration, or what `output` holds, cannot be used.
    """
    config = as_config(config, overrides)
    reporter = reporter or Reporter()
    files = RunFiles(Path(output), config.name) if output is not None else None
    if files:
        files.folder.mkdir(parents=True, exist_ok=True)
        if fresh:
            files.discard()
        if finished := files.load_dataset(identify(config)):
            reporter.note(f"{files.dataset}: already complete, nothing to compute")
            draw(finished, files, reporter)
            return finished

    if config.model in MODELS:
        job = plan(config, reporter.compiling)
        seconds = simulate(job, files, reporter)
        result = collect(job, seconds)
        if config.verify:
            result = dataset.beside(result, *verify(job))
    else:
        result = evaluate(config)
    if files:
        files.save_dataset(result)
        draw(result, files, reporter)
    return result


def draw(result: xr.Dataset, files: RunFiles, reporter: Reporter) -> None:
    """The maps of a run, beside its dataset, unless they are there."""
    from sweep import plots  # matplotlib: a third of the time that `import sweep` would take

    if files.picture.exists():
        return
    try:
        figure = plots.draw(result)
    except ValueError as error:
        reporter.note(f"no picture: {error}")
        return
    files.save_picture(figure)


def predict(config: Config | str | Path, **overrides: Any) -> xr.Dataset:
    """The predictions alone, of the paper and of the linear theory, on the grid of `config`."""
    config = as_config(config, overrides)
    grid = Grid.of(config)
    return dataset.label(config, grid, dataset.predicted(predict_grid(TIERS[config.model], grid)), {})


def as_config(config: Config | str | Path, overrides: dict[str, Any]) -> Config:
    if isinstance(config, Config):
        if overrides:
            raise TypeError("overrides go with a path: a Config is final")
        return config
    return load_config(config, overrides)


def simulated(config: Config) -> Model:
    """The model of `config`; `ConfigError` where its tier is a formula."""
    if config.model not in MODELS:
        message = f"the {config.model} model is not simulated; allowed: {', '.join(MODELS)}"
        raise ConfigError([Fault("config", None, None, ("model",), message)])
    return MODELS[config.model]


def with_dopri5(config: Config) -> Config:
    """`config` with the plain method: what stops between the steps needs one without a history.

    A step fixed for another method would be no step for this one.
    """
    if config.integrator.method == "dopri5":
        return config
    return replace(config, integrator=config.integrator.model_copy(update={"method": "dopri5", "step": "auto"}))


def identify(config: Config) -> Identity:
    return Identity(config.to_yaml(), config.fingerprint(), fingerprint(*_DECISIVE))


def evaluate(config: Config) -> xr.Dataset:
    """The dataset of a tier that is a formula."""
    grid = Grid.of(config)
    arrays = dataset.predicted(predict_grid(TIERS[config.model], grid))
    arrays["status"] = np.full(grid.size, SETTLED)
    if "reversals" in config.measure:
        arrays["reversals"] = arrays["reversals_predicted"]
    return dataset.label(config, grid, arrays, provenance(config, 0.0, grid.size))


def provenance(config: Config, seconds: float, cells: int) -> dict[str, Any]:
    """Where the numbers of a dataset come from, as its attributes."""
    return {"source_hash": identify(config).source_hash, **dataset.provenance(config, seconds, cells)}


def simulate(job: Plan, files: RunFiles | None, reporter: Reporter) -> float:
    """Carry the images of `job` to their ends; returns the seconds it took, earlier runs included."""
    identity, before = identify(job.config), 0.0
    tables = {part.method: part.images for part in job.parts}
    if files and (left := files.load_checkpoint(identity, tables)) is not None:
        before = left
        reporter.note(f"{files.checkpoint}: going on from there")
    for part in job.parts:
        part.kernel.compile()
    began, done_before = time.perf_counter(), int((job.status() != RUNNING).sum())

    def save() -> None:
        if files:
            files.save_checkpoint(tables, identity, before + time.perf_counter() - began)

    def after_chunk() -> None:
        status, seconds = job.status(), time.perf_counter() - began
        done, failed = int((status != RUNNING).sum()), int(np.isin(status, executor.FAILURES).sum())
        reporter.chunk(Progress(job.grid.size, done, failed, done_before, seconds))
        save()

    try:
        for part in job.parts:
            executor.execute(
                part.kernel,
                part.images,
                stop_when_settled=job.config.integrator.stop_when_settled,
                after_chunk=after_chunk,
            )
    except KeyboardInterrupt:
        save()
        raise
    return before + time.perf_counter() - began


def collect(job: Plan, seconds: float) -> xr.Dataset:
    """The labelled dataset of a finished job."""
    arrays: dict[str, Array] = {}
    for part in job.parts:
        found = dataset.measured(part.kernel, part.images, job.config.integrator.t_end)
        found["step_rule"] = part.step_rule
        if job.config.integrator.method == "auto":
            found["method"] = np.full(len(part.cells), methods.METHODS.index(part.method))
        for name, values in found.items():
            arrays.setdefault(name, np.empty(job.grid.size))[part.cells] = values
    arrays |= dataset.predicted(job.prediction)
    return dataset.label(job.config, job.grid, arrays, provenance(job.config, seconds, job.grid.size))

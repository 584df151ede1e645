"""Reuse the results of an earlier run from its dataset, and simulate the rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.config.document import parse_value
from sweep.engine.plan import choose
from sweep.engine.whole import Whole
from sweep.grid import CASE, Array, Grid
from sweep.kernels.kernel import steps_to
from sweep.kernels.measures import MEASURES
from sweep.kernels.status import TIME_LIMIT
from sweep.models.model import Model
from sweep.parameters import Parameter, sections
from sweep.results import dataset, netcdf
from sweep.results.dataset import ROWS
from sweep.results.netcdf import open_dataset
from sweep.results.provenance import Identity
from sweep.results.store import Store

# Settings that may differ between a run and the one that it enlarges.
_FREE = {"name", "max_failed_fraction", "picture", "measure", "samples", "seed", "integrator.t_end"}


@dataclass(frozen=True)
class Earlier:
    """The dataset of an earlier run, and the cells of this run that it contains."""

    dataset: xr.Dataset
    cells: Array
    """For each cell of this run its index in the earlier one, or -1 if it has to be simulated, shape (cells,)."""

    @property
    def words(self) -> str:
        """Say how many cells are reused, and from which run."""
        taken, created = int((self.cells >= 0).sum()), self.dataset.attrs.get("created", "an unknown date")
        if not taken:
            return f"no cell of the run of {created} can be reused; all are simulated"
        return f"{taken} of {len(self.cells)} cells are reused from the run of {created}"

    def taken(self) -> tuple[Array, dict[str, Array]]:
        """Return the reused cells of this run, and the earlier variables of these, by name."""
        cells, arrays = np.flatnonzero(self.cells >= 0), dict[str, Array]()
        if not len(cells):
            return cells, arrays
        grid = _grid(self.dataset)
        at, (_, body) = self.cells[cells], grid.bodies()
        for name, (_, spec) in dataset.layout(grid, set(map(str, self.dataset.data_vars))).items():
            tail = [self.dataset.sizes[dim] for dim in spec.along]
            arrays[name] = self.dataset[name].values.reshape(-1, *tail)[body[at] if spec.per_body else at]
        return cells, arrays


def reason_against(config: Config, found: Identity, wanted: Identity, there: xr.Dataset) -> str:
    """Say why a run of `config` may not replace the dataset `there`, of the run `found`; return "" if it may.

    It may if no result is lost: the same run with more cells, to a later time, or with more measurements.
    """
    if (found.source_hash, found.versions) != (wanted.source_hash, wanted.versions):
        return found.difference(wanted)
    edited = "a run, but has been edited since"
    if _is_edited(config, there):
        return edited
    old, new = (_settings(parse_value(each.config, "dataset"), config.table) for each in (found, wanted))
    if config.origin and there.attrs.get("model_sha256") != config.origin.digest:
        return f"another text of {config.origin.place}"
    # The text identifies a user-defined model, which `model` only names.
    free = _FREE | ({"model"} if config.origin else set())
    changed = {key for key in {**old, **new} if old.get(key) != new.get(key)} - free
    less = [each for each in old["measure"] if each not in new["measure"]]
    sooner = new["integrator.t_end"] < old["integrator.t_end"]
    kept = (_match(config.grid, _grid(there)) >= 0).sum()
    if changed or less or sooner or kept < there["status"].size:
        return found.difference(wanted) or edited
    return ""


def _is_edited(config: Config, there: xr.Dataset) -> bool:
    """Return whether a dataset lacks a variable that a run writes, or has it in another type or order."""
    try:
        grid = _grid(there)
    except KeyError:  # no status, or an empty dimension
        return True
    measured = {spec.partition("=")[0] for spec in str(there.attrs.get("measured", "")).split()}
    kinds = [MEASURES[each] for each in measured & MEASURES.keys()]
    needed = {"spin_final", "t_stop", "step", *(name for kind in kinds for name in kind.variables)}
    lacking = config.simulated and not needed <= set(there.data_vars)
    if lacking or "measured" not in there.attrs:
        return True
    written = dataset.layout(grid, set(map(str, there.data_vars)))
    return any(
        there[name].dims != (*over.dims, *spec.along) or there[name].dtype != np.dtype(spec.dtype)
        for name, (over, spec) in written.items()
    )


def is_whole(config: Config, path: Path) -> bool:
    """Return whether the dataset of the run of `config` is complete: it may have been cut since."""
    with open_dataset(path, load=False) as there:
        sizes = dict(there["status"].sizes) if "status" in there else {"": 0}
    return sizes == dict(zip(config.grid.dims, config.grid.shape, strict=True))


def taken_over(config: Config, there: xr.Dataset) -> Earlier:
    """Find the cells of `config` whose results, bit for bit, are in the dataset `there`."""
    cells = _match(config.grid, _grid(there))
    old = parse_value(str(there.attrs["config"]), "dataset")
    if old["measure"] != config.document()["measure"] or not isinstance(config.tier, Model):
        return Earlier(there, np.full(len(cells), -1))
    if old["integrator"]["t_end"] != config.integrator.t_end:
        taken = np.flatnonzero(cells >= 0)
        depends = _depends_on_limit(config, config.grid.take(taken), there, cells[taken], old["integrator"]["t_end"])
        cells[taken[depends]] = -1
    return Earlier(there, cells)


def _settings(document: Mapping[str, Any], known: Mapping[str, Parameter]) -> dict[str, Any]:
    """Return everything in a configuration except the values of `known` parameters, by which cells are matched."""
    found = {key: value for key, value in document.items() if key not in (*sections(known), *known, "cases")}
    for section in (*sections(known), "integrator"):
        found |= {f"{section}.{key}": v for key, v in document.get(section, {}).items() if key not in known}
    return {key: value for key, value in found.items() if key != "integrator"}


def _depends_on_limit(config: Config, grid: Grid, there: xr.Dataset, cells: Array, t_end: float) -> Array:
    """Return which cells of `grid`, with the indices `cells` in the earlier dataset, could now end differently.

    These are cells that had not ended at the earlier limit `t_end`, cells that ended so late that the method had taken
    the limit into account, and cells whose steps change.
    """

    def before(name: str) -> Array:
        return np.asarray(there[name].values.ravel()[cells])

    depends: Array = before("status") == TIME_LIMIT
    for choice in choose(config, grid):
        at = choice.cells
        left = (t_end - before("t_stop")[at]) / before("step")[at]
        step = config.integrator.t_end / steps_to(config.integrator.t_end, choice.step)
        depends[at] |= (left <= choice.kernel.stepper.horizon) | (step != before("step")[at])
        if "method" in there:
            depends[at] |= before("method")[at] != choice.kernel.stepper.code
    return depends


def _grid(there: xr.Dataset) -> Grid:
    """Return the grid of a dataset."""
    values = {str(name): coordinate.values for name, coordinate in there.coords.items()}
    constants = {name: float(value) for name, value in values.items() if value.ndim == 0}
    axes = {str(dim): values[str(dim)] for dim in there["status"].dims if dim not in ROWS}
    rows = [str(dim) for dim in there["status"].dims if dim in ROWS]
    table = {name: each for name, each in values.items() if rows and [*there[name].dims] == rows and name not in rows}
    return Grid(axes, constants, table, rows[0] if rows else CASE)


def _match(grid: Grid, there: Grid) -> Array:
    """Return for each cell of `grid` its index in the grid `there`, or -1, shape (cells,)."""
    columns, old = grid.given(), there.given()
    if set(columns) != set(old):
        return np.full(grid.size, -1)
    known, rows = (np.stack([some[name] + 0.0 for name in sorted(columns)], axis=1) for some in (old, columns))
    both = np.concatenate([known, rows]).view(f"V{8 * len(columns)}").ravel()
    _, which = np.unique(both, return_inverse=True)
    at: Array = np.full(len(both), -1)
    at[which[: len(known)]] = np.arange(len(known))
    return np.asarray(at[which[len(known) :]])


class Enlarged(Whole):
    """The cells that an earlier run lacks, as a table of cases, and the dataset that combines both."""

    def __init__(self, config: Config, store: Store, earlier: Earlier) -> None:
        super().__init__(config, store)
        self.earlier = earlier
        self.cells = np.flatnonzero(earlier.cells < 0)
        """Indices of the simulated cells, in the order of the table."""

    def grow(self) -> bool:
        """Add the tiles to simulate: all of them, once. Return False if there are no more."""
        return not self.tiles and self._cut(len(self.cells))

    def simulated(self) -> Config:
        """Return the configuration whose cases are the simulated cells, which `tiles` cover."""
        table = self.grid.take(self.cells)
        constants = {name: self.config.parameters[name] for name in table.constants}
        cases = {name: tuple(values.tolist()) for name, values in table.table.items()}
        return replace(self.config, parameters=constants, cases=cases, samples=None)

    def save(self, path: Path) -> None:
        """Write the labelled dataset, which has to fit into memory."""
        netcdf.write(path, self.dataset())

    def dataset(self) -> xr.Dataset:
        """Return the labelled dataset over all cells, in memory."""
        arrays = dict[str, Array]()
        self._place(*self.earlier.taken(), arrays)
        self._place(self.cells, self._gather(), arrays)
        words = self._attributes(len(self.cells))
        if (self.earlier.cells >= 0).any():
            words["taken_over"] = self.earlier.words
        return dataset.label(self.config, self.grid, arrays, words)

    def _place(self, cells: Array, found: Mapping[str, Array], arrays: dict[str, Array]) -> None:
        """Write `found` for `cells`, as cases, into `arrays` over all cells or bodies, undefined elsewhere."""
        _, body = self.grid.bodies()
        for name, (over, spec) in dataset.layout(self.grid, found).items():
            if name not in arrays:
                nothing = np.nan if spec.dtype.startswith("float") else 0
                arrays[name] = np.full((over.size, *found[name].shape[1:]), nothing, spec.dtype)
            arrays[name][body[cells] if spec.per_body else cells] = found[name]

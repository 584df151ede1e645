"""Defines the kinds of dataset: what each contains, and how to recognise it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from sweep.parameters import PARAMETERS
from sweep.results.dataset import VARIABLES
from sweep.results.netcdf import open_dataset
from sweep.results.store import StoreError

ATTRIBUTE = "sweep_kind"
"""The attribute of a dataset that names its kind."""

OWN_BODY = "a model"
"""What `model_brings` says of the model of a user that need not be of a rattleback."""


@dataclass(frozen=True)
class Kind:
    """A kind of dataset."""

    name: str
    """The command that makes it."""
    words: str
    """What it is of."""
    marks: frozenset[str]
    """Variables and dimensions by which a dataset that does not name its kind is known."""
    explored: bool = False
    """Whether the explorer shows it."""


TRAJECTORY = Kind("trajectory", "single trajectories", frozenset({"trajectory"}))
CRITICAL = Kind("critical", "critical spins", frozenset({"critical_reason"}), explored=True)
BOUNDARIES = Kind("boundaries", "boundaries", frozenset({"level", "curve", "end_more"}))
FIT = Kind("fit", "a fit", frozenset({"seen", "fitted"}))
INDICES = Kind("indices", "Sobol indices", frozenset({"first_order", "total_order"}))
RUN = Kind("run", "a run", frozenset(), explored=True)
"""Its variables depend on what was measured.  Predictions count as a run, and so does a part of one."""

_KINDS = {kind.name: kind for kind in (TRAJECTORY, CRITICAL, BOUNDARIES, FIT, INDICES, RUN)}


def kind(dataset: xr.Dataset) -> Kind | None:
    """Return the kind that a dataset names, or else that of its variables; None if another program wrote it."""
    if named := _KINDS.get(str(dataset.attrs.get(ATTRIBUTE))):
        return named
    there = {*dataset.variables, *dataset.dims}
    if found := [each for each in _KINDS.values() if each.marks and each.marks <= there]:
        return found[0]
    return RUN if set(VARIABLES) & set(dataset.data_vars) else None


def opened(path: Path, *, load: bool = True) -> xr.Dataset:
    """Open a dataset as `open_dataset` does; `StoreError` also if it is of no kind."""
    dataset = open_dataset(path, load=load)
    if kind(dataset) is None:
        dataset.close()
        raise StoreError(f"{path}: not a dataset of sweep: no variable of it, such as status")
    return dataset


def is_of_own_body(dataset: xr.Dataset) -> bool:
    """Tell whether a user's model made it, which may be of anything."""
    return dataset.attrs.get("model_brings") == OWN_BODY


def parameters(dataset: xr.Dataset) -> list[str]:
    """Return the names of the physical parameters that a dataset contains."""
    return [name for name in str(dataset.attrs.get("model_parameters", "")).split() or PARAMETERS if name in dataset]

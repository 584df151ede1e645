"""Defines the kinds of dataset and what each contains."""

from __future__ import annotations

import json
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from sweep.faults import FileError, counted
from sweep.grid import Array
from sweep.models.general.solids import Assembly
from sweep.parameters import PARAMETERS
from sweep.results.margins import POINTS
from sweep.results.netcdf import open_dataset
from sweep.results.probabilities import PROBABILITIES

ATTRIBUTE = "sweep_kind"
"""The attribute of a dataset that names its kind."""

OWN_BODY = "a model"
"""Value of `model_brings` for a user-defined model that need not describe a rattleback."""


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of dataset."""

    name: str
    """The command or function that creates it."""
    words: str
    """What it contains."""
    explored: bool = False
    """Whether the explorer shows it."""
    needs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Variables that are needed to show it, each with the dimensions that it must have."""
    attributes: tuple[str, ...] = ()
    """Attributes that are needed to show it."""


def _over(dims: tuple[str, ...], *names: str) -> dict[str, tuple[str, ...]]:
    return dict.fromkeys(names, dims)


SPINS = {"n_c1": "n_c1_linear", "n_c2": "n_c2_simulated"}
"""The critical spins, each with the variable that holds the model's own value."""

_FITTED = ("value", *(f"{end}_{share}" for share in (68, 95) for end in ("lower", "upper")))

TRAJECTORY = Kind(
    "trajectory", "single trajectories",
    needs=_over((), "status") | _over(("time",), "time", "spin"),
)  # fmt: skip
CRITICAL = Kind(
    "critical", "critical spins", explored=True,
    needs=_over((), "n_c_reason", *SPINS.values()) | _over(("sign",), "sign"),
)  # fmt: skip
BOUNDARIES = Kind(
    "boundaries", "boundaries",
    needs=_over(("point",), *POINTS), attributes=("x", "trajectories"),
)  # fmt: skip
FIT = Kind(
    "fit", "a fit",
    needs=_over(("parameter",), *_FITTED) | _over(("time",), "time", "seen", "fitted"),
    attributes=("title", "undetermined"),
)  # fmt: skip
RUN = Kind("run", "a run", explored=True)
"""Kinds whose variables depend on what was measured. Predictions and a part of a run count as a run."""

_MAY_BE_EMPTY, _MAY_COME = {"point"}, {"law"}
"""Dimensions that may be empty where nothing was found, and that may be missing."""

_CODES = ("status", "level", "curve", "outcome")
"""Variables that become meaningless once averaged."""

_KINDS = {kind.name: kind for kind in (TRAJECTORY, CRITICAL, BOUNDARIES, FIT, RUN)}


def kind(dataset: xr.Dataset) -> Kind | None:
    """Return the recorded kind of a dataset; None if none of ours is recorded."""
    return _KINDS.get(str(dataset.attrs.get(ATTRIBUTE)))


def opened(path: Path, *, load: bool = True) -> xr.Dataset:
    """Open a dataset as `open_dataset`; raise a `FileError` also if its kind is unknown or it is incomplete."""
    dataset = open_dataset(path, load=load)
    try:
        return require_whole(dataset, str(path))
    except FileError:
        dataset.close()
        raise


def require_whole(dataset: xr.Dataset, name: str = "the dataset") -> xr.Dataset:
    """Return a dataset if its kind is known and complete; raise a `FileError` otherwise."""
    if found := fault(dataset):
        raise FileError(f"{name}: {found}")
    return dataset


def fault(dataset: xr.Dataset) -> str:
    """Say why a dataset cannot be shown, for example because it was averaged or cut; return "" if it can."""
    if (found := kind(dataset)) is None:
        return f"not a dataset of sweep, or {ATTRIBUTE} was dropped; keep it with xarray.set_options(keep_attrs=True)"
    if odd := odd_axis(dataset, (dim for dim in dataset.sizes if dim not in _MAY_BE_EMPTY)):
        return odd
    needs, there = _needs(dataset, found), {name: {*variable.dims} for name, variable in dataset.variables.items()}
    lacks = [f"the variable {name}" for name in needs if name not in there]
    lacks += [f"the attribute {name}" for name in found.attributes if name not in dataset.attrs]
    known = {name: {*dims} for name, dims in needs.items() if name in there}
    lacks += [f"the axis {dim} of {name}" for name, dims in known.items() for dim in sorted(dims - there[name])]
    if lacks:
        more = f" and {counted(len(lacks) - 1, 'other thing')}" if len(lacks) > 1 else ""
        return f"lacks {lacks[0]}{more}; it was cut or averaged: use the dataset that sweep wrote"
    further = [str(dim) for name, dims in known.items() if dims for dim in there[name] - dims - _MAY_COME]
    averaged = [name for name in known if name in _CODES and dataset[name].dtype.kind not in "iu"]
    words = [*(f"the further axis {dim}; select one of its values" for dim in further),
             *(f"no whole numbers in {name}: it was averaged" for name in averaged)]  # fmt: skip
    return f"has {words[0]}" if words else ""


def odd_axis(dataset: xr.Dataset, dims: Iterable[Hashable]) -> str:
    """Say which of these dimensions is empty or stacked; return "" if none is."""
    for dim in dims:
        if not dataset.sizes[dim]:
            return f"the axis {dim} has no values; select at least one"
        if dim in dataset.indexes and dataset.indexes[dim].nlevels > 1:
            return f"the axis {dim} is stacked; unstack it"
    return ""


def _needs(dataset: xr.Dataset, found: Kind) -> Mapping[str, tuple[str, ...]]:
    """Return what a dataset of this kind must have, given its other contents."""
    needs = {**found.needs}
    if found == BOUNDARIES:
        needs |= _over((), *(dataset.attrs[name] for name in ("x", "y") if name in dataset.attrs))
    if found == TRAJECTORY:
        cells = dataset["status"].dims if "status" in dataset else ()
        needs |= _over(cells, "t_stop") | _over((*cells, "time"), "spin")  # type: ignore[arg-type]
        needs |= _over((), "a", "b", "c") if not is_of_own_body(dataset) and "body" not in dataset.attrs else {}
    return needs | _over((), *PROBABILITIES, "count") if found == RUN and "probability" in dataset else needs


def is_of_own_body(dataset: xr.Dataset) -> bool:
    """Return whether the dataset comes from a user-defined model, which may describe anything."""
    return dataset.attrs.get("model_brings") == OWN_BODY


def parameters(dataset: xr.Dataset) -> list[str]:
    """Return the names of the physical parameters that a dataset contains."""
    return [name for name in str(dataset.attrs.get("model_parameters", "")).split() or PARAMETERS if name in dataset]


def body(one: xr.Dataset) -> dict[str, Array]:
    """Return the parameters of a single trajectory, with those that follow from sizes, each of shape (1,)."""
    given = {name: np.atleast_1d(one[name].values) for name in parameters(one)}
    return Assembly.of(json.loads(one.attrs.get("body", "{}"))).body(given)

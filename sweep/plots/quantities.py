"""List the quantities of a dataset that can be drawn: its variables, quantities derived from them, and its subject.

Pictures and the explorer share these.  This needs the dataset alone, and no plotting library.
"""

from __future__ import annotations

from collections.abc import Hashable

import xarray as xr

from sweep.config import Config
from sweep.faults import either, fault_of, refusal, suggestion
from sweep.kernels.measures import MEASURES
from sweep.kernels.measures.estimate import Estimate
from sweep.kernels.measures.reversals import Reversals
from sweep.plots import labels
from sweep.plots.pictures import PICTURES, of
from sweep.results.dataset import VARIABLES
from sweep.results.probabilities import PROBABILITIES

DERIVED = {name: picture.derive for name, picture in PICTURES.items() if picture.derive}
"""Functions that derive a quantity from the variables of a dataset, by its name."""


def derivable(dataset: xr.Dataset) -> list[str]:
    """The quantities that can be derived from the variables of a dataset, whose status must still be a code."""
    coded = "status" in dataset and labels.is_code(dataset["status"])
    there = {str(name) for name in (*dataset.data_vars, *dataset.dims) if name != "status" or coded}
    return [name for name in DERIVED if there.issuperset(of(name).requires)]


def field(dataset: xr.Dataset, name: str) -> xr.DataArray:
    """Return a variable, or one of the quantities `DERIVED`.

    Raises
    ------
    InputError
        if the dataset has no such variable, nor those from which it is derived, or if the derived one has other values
        of an axis of the dataset.
    """
    if name in dataset.data_vars:
        return dataset[name]
    if name in (possible := derivable(dataset)):
        return _derive(dataset, name)
    if not (choices := [*map(str, dataset.data_vars), *possible]):
        raise fault_of("the dataset has no variable to draw")
    words = f"there is no variable {name}" if name else "name the variable to draw"
    raise fault_of(f"{words}{suggestion(name, choices)}; choose {either(choices)}", "variable")


def _derive(dataset: xr.Dataset, name: str) -> xr.DataArray:
    """Derive a quantity; refuse an axis that xarray would cut or fill up, without a message, to fit the dataset."""
    found = DERIVED[name](dataset)
    if other := [d for d in found.dims if not _same_axis(found, dataset, d)]:
        words = f"{name} has other values of {other[0]} than the dataset; in its derive, give this axis another name"
        raise fault_of(words, "variable")
    return found


def _same_axis(found: xr.DataArray, dataset: xr.Dataset, dim: Hashable) -> bool:
    """Return whether an axis has the values that the dataset has of this name, or their number if one has no values."""
    if dim in found.coords and dim in dataset.variables:
        return found[dim].reset_coords(drop=True).equals(dataset[dim].reset_coords(drop=True))
    return dataset.sizes.get(dim, found.sizes[dim]) == found.sizes[dim]


def with_derived(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with all quantities that can be derived from its variables."""
    return dataset.assign({name: field(dataset, name) for name in derivable(dataset)})


def pictured(dataset: xr.Dataset) -> list[str]:
    """The variables that the configuration of a dataset names for its pictures."""
    return str(dataset.attrs.get("pictured", "")).split()


def check_pictures(config: Config) -> None:
    """Raise an `InputError` if a configuration names a picture of a variable that its run does not have."""
    comes_with = {variable: name for name, kind in MEASURES.items() for variable in kind.variables}
    if config.tier.counts in Estimate.variables:  # the reversals of this tier are estimated
        comes_with |= dict.fromkeys(Estimate.variables, Reversals.name)
    measured = {spec.partition("=")[0] for spec in config.measure}
    known = {*VARIABLES, *PROBABILITIES, *DERIVED}
    for i, name in enumerate(config.picture):
        lacking = sorted({comes_with[each] for each in of(name).requires if each in comes_with} - measured)
        words = f"{name} is not measured; add {', '.join(lacking)} to measure" if lacking else ""
        if name not in known:
            words = refusal(name, f"a variable, such as {either(sorted(DERIVED))}", known)
        if words:
            raise config.error(("picture", i), words)


def subject(dataset: xr.Dataset) -> str:
    """The subject of a dataset: the first picture that its configuration names, or else that of the highest rank.

    Empty if it has none of these.
    """
    there = {*map(str, dataset.data_vars), *derivable(dataset)}
    named = pictured(dataset)[:1]
    ranked = sorted((picture for picture in PICTURES.values() if picture.rank), key=lambda picture: -picture.rank)
    return next((name for name in (*named, *(picture.name for picture in ranked)) if name in there), "")


def first_picture(dataset: xr.Dataset) -> str:
    """Return the variable of a dataset to draw by default: its `subject`, compared with a prediction if there is one.

    A picture named in the configuration is drawn without a comparison.
    """
    about = subject(dataset)
    compared = (name for name in derivable(dataset) if of(name).compares[:1] == (about,))
    return about if about in pictured(dataset) else next(compared, about)

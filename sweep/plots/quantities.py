"""List the quantities of a dataset that can be drawn: its variables, quantities derived from them, and its subject.

Pictures and the explorer share these.  This needs the dataset alone, and no plotting library.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import xarray as xr

from sweep.config import Config
from sweep.faults import either, fault_of, refusal, suggestion
from sweep.kernels.measures import MEASURES
from sweep.kernels.measures.estimate import Estimate
from sweep.kernels.measures.reversals import Reversals
from sweep.plots import labels
from sweep.results.dataset import VARIABLES
from sweep.results.probabilities import PROBABILITIES


@dataclass(frozen=True)
class Derived:
    """A quantity computed from the variables of a dataset."""

    needs: tuple[str, ...]
    """The variables and dimensions from which it is derived."""
    derive: Callable[[xr.Dataset], xr.DataArray]


def _difference(dataset: xr.Dataset) -> xr.DataArray:
    simulated = dataset["reversals"]  # whose integers are too short for a difference
    found = (simulated.astype("int32") if simulated.dtype.kind == "i" else simulated) - dataset["reversals_predicted"]
    return found.rename("difference").assign_attrs(long_name=f"{labels.origin(dataset, 'reversals')} − predicted")


def _first(dataset: xr.Dataset) -> xr.DataArray:
    times = dataset["reversal_times"]
    found = times.isel(reversal=0, drop=True).where(times["reversal"].values[0] == 1)
    return found.rename("t_first_reversal").assign_attrs(long_name="time of the first reversal")


def _ratio(dataset: xr.Dataset) -> xr.DataArray:
    found = _first(dataset) / dataset["t_first_reversal_predicted"]
    return found.rename("ratio").assign_attrs(long_name="first reversal, simulated / predicted", units="1")


DERIVED = {
    "difference": Derived(("reversals", "reversals_predicted"), _difference),
    "t_first_reversal": Derived(("reversal_times", "reversal"), _first),
    "ratio": Derived(("reversal_times", "reversal", "t_first_reversal_predicted"), _ratio),
}
"""`difference`: simulated minus predicted reversals; `t_first_reversal`: the first of `reversal_times`; `ratio`: that
time divided by the predicted one."""

COMPARISONS = {
    "difference": ("reversals", "reversals_predicted"),
    "ratio": ("t_first_reversal", "t_first_reversal_predicted"),
}
"""The simulated variable and the prediction that each compares, which their figures show as well."""

_SUBJECTS = (
    "probability", "reversals", "reversals_predicted", "t_first_reversal", "spin_final",
)  # fmt: skip
"""Possible subjects of a dataset, in order of preference."""


def derivable(dataset: xr.Dataset) -> list[str]:
    """The quantities that can be derived from the variables of a dataset, whose status must still be a code."""
    coded = "status" in dataset and labels.is_code(dataset["status"])
    there = {str(name) for name in (*dataset.data_vars, *dataset.dims) if name != "status" or coded}
    return [name for name, derived in DERIVED.items() if set(derived.needs) <= there]


def field(dataset: xr.Dataset, name: str) -> xr.DataArray:
    """A variable, or one of the quantities `DERIVED`.

    Raises
    ------
    InputError
        if the dataset has no such variable, nor those from which it is derived.
    """
    if name in (possible := derivable(dataset)):
        return DERIVED[name].derive(dataset)
    if name not in dataset.data_vars:
        if not (choices := [*map(str, dataset.data_vars), *possible]):
            raise fault_of("the dataset has no variable to draw")
        words = f"there is no variable {name}" if name else "name the variable to draw"
        raise fault_of(f"{words}{suggestion(name, choices)}; choose {either(choices)}", "variable")
    return dataset[name]


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
        needs = DERIVED[name].needs if name in DERIVED else (name,)
        lacking = sorted({comes_with[each] for each in needs if each in comes_with} - measured)
        words = f"{name} is not measured; add {', '.join(lacking)} to measure" if lacking else ""
        if name not in known:
            words = refusal(name, f"a variable, such as {either(sorted(DERIVED))}", known)
        if words:
            raise config.error(("picture", i), words)


def subject(dataset: xr.Dataset) -> str:
    """The subject of a dataset: the first picture that its configuration names, or else of `_SUBJECTS`.

    Empty if it has none of these.
    """
    there = {*map(str, dataset.data_vars), *derivable(dataset)}
    return next((name for name in (*pictured(dataset)[:1], *_SUBJECTS) if name in there), "")


def first_picture(dataset: xr.Dataset) -> str:
    """Return the variable of a dataset to draw by default: its `subject`, compared with a prediction if there is one.

    A picture named in the configuration is drawn without a comparison.
    """
    about = subject(dataset)
    compared = (name for name in COMPARISONS if name in derivable(dataset) and about == COMPARISONS[name][0])
    return about if about in pictured(dataset) else next(compared, about)

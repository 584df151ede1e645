"""Names, units and meanings in plain words, for the axes, legends and titles of figures."""

from __future__ import annotations

import re

import xarray as xr

from sweep.kernels import status
from sweep.models.surfaces import PARABOLOID
from sweep.parameters import PARAMETERS
from sweep.results.dataset import VARIABLES
from sweep.results.kind import is_of_own_body

SYMBOLS = {"mu": "μ", "delta": "δ", "n0": "n₀", "x0": "x₀", "y0": "y₀"}

STATUS_WORDS = {
    0: "not run",
    status.SETTLED: "settled",
    status.TIME_LIMIT: "ended at the time limit",
    status.LIFT_OFF: "lifted off the table",
    status.DIVERGED: "diverged",
    status.PARADOX: "met Painlevé's paradox",
    status.TOPPLED: "toppled",
    status.IMPOSSIBLE: "no such body, or none that stands",
}
"""How a trajectory ended, by the values of `status`."""

_PARAMETER_WORDS = {
    "mu": "friction μ",
    "b": "short semi-axis b",
    "a": "long semi-axis a",
    "c": "height c of the center over the table",
    "delta": "angle δ of the axes of inertia",
    "n0": "start spin n₀",
    "x0": "start contact point x₀",
    "y0": "start contact point y₀",
    "case": "case",
    "trajectory": "trajectory",
}

_PARABOLOID_WORDS = {
    "a": "coefficient a of the paraboloid",
    "b": "coefficient b of the paraboloid",
    "c": "height c of the paraboloid's origin over the table",
}

_VARIABLE_WORDS = {
    "reversals": "spin reversals, simulated",
    "reversals_predicted": "spin reversals, predicted (Takano 2011)",
    "difference": "simulated − predicted",
    "ratio": "first reversal, simulated / predicted",
    "regime": "regime of motion",
    "lyapunov": "largest Lyapunov exponent",
    "cycle_variation": "variation of the cycles",
    "status": "how the trajectory ended",
    "inferred": "how the count was found",
    "spin_final": "final spin n",
    "spin_mean": "final spin n, without ripple",
    "t_stop": "time of the end",
    "t_last_reversal": "time of the last reversal",
    "t_first_reversal": "time of the first reversal",
    "t_first_reversal_predicted": "time of the first reversal, predicted (Garcia and Hubbard 1988)",
    "reversal_time_reason": "is the first reversal predicted?",
    "noise_limited": "are late times limited by round-off?",
    "window_dependent": "does the count depend on the windows?",
    "sensitive": "does the count depend on the start's 10th digit?",
    "energy_error": "largest error of the energy, relative",
    "form_factor": "form factor L(f)",
    "spin": "spin n",
    "time": "time t",
}

_FLAG_WORDS = {"noise_limited": {0: "no", 1: "yes"}, "window_dependent": {0: "no", 1: "yes"}, "status": STATUS_WORDS}
_FLAG_WORDS["sensitive"] = _FLAG_WORDS["window_dependent"]

# The scale of a dimensionless quantity at the end of its `long_name`, made of g, c and m: ", in 1/sqrt(g c)".
_SCALE = re.compile(r", in ((?:1/)?(?:sqrt\([gc/ ]+\)|[gcm](?: [gcm])*))(?=;|$)")


def symbol(name: str) -> str:
    """A parameter's symbol, such as n₀."""
    return SYMBOLS.get(name, name)


def unit(dataset: xr.Dataset, name: str) -> str:
    """The unit of a variable or coordinate as figures print it, such as √(g/c); empty for a plain number.

    A dimensionless quantity tells its scale at the end of its `long_name`: "…, in sqrt(g/c)".
    """
    units = str(dataset[name].attrs.get("units", "1"))
    if units != "1":
        return {"radian": "rad"}.get(units, units)
    scale = _SCALE.search(_long_name(dataset, name))
    return scale[1].replace("sqrt", "√") if scale else ""


def words(dataset: xr.Dataset, name: str) -> str:
    """What a variable or coordinate is, without its unit."""
    of_surface = _PARABOLOID_WORDS if dataset.attrs.get("surface") == PARABOLOID.name else {}
    of_parameters = {} if is_of_own_body(dataset) else _PARAMETER_WORDS
    short = {**of_parameters, **_VARIABLE_WORDS, **of_surface}.get(name)
    return short or _SCALE.sub("", _long_name(dataset, name)) or name.replace("_", " ")


def label(dataset: xr.Dataset, name: str) -> str:
    """The label of an axis: what it shows, and the unit."""
    return f"{words(dataset, name)} ({found})" if (found := unit(dataset, name)) else words(dataset, name)


def flag_words(dataset: xr.Dataset, name: str) -> dict[int, str]:
    """The meaning of each value of a variable with flags, in words; empty for another variable."""
    attributes = dataset[name].attrs
    if "flag_values" not in attributes:
        return {}
    values = [int(value) for value in attributes["flag_values"]]
    meanings = dict(zip(values, str(attributes.get("flag_meanings", "")).split(), strict=False))
    known = _FLAG_WORDS.get(name, {})
    return {value: known.get(value, meanings.get(value, str(value)).replace("_", " ")) for value in values}


def value(name: str, at: float) -> str:
    """A parameter with its value, such as "μ = 60"."""
    return f"{symbol(name)} = {at:g}"


def constants(dataset: xr.Dataset) -> str:
    """The parameters that are the same in the whole dataset, with their values."""
    found = {str(name): float(v) for name, v in dataset.coords.items() if v.ndim == 0 and v.dtype.kind in "fi"}
    return ", ".join(value(name, at) for name, at in found.items())


def _long_name(dataset: xr.Dataset, name: str) -> str:
    given = dataset[name].attrs.get("long_name")
    if given is None and name in PARAMETERS:
        given = PARAMETERS[name].long_name
    if given is None and name in VARIABLES:
        given = VARIABLES[name].long_name
    return str(given or "")

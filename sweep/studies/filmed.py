"""Shows a film and the trajectory that fits it as two bodies side by side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.integrate import cumulative_trapezoid

from sweep.engine.reporter import Reporter
from sweep.faults import local_path
from sweep.results.configuration import configuration
from sweep.results.kind import FIT, kind, opened
from sweep.studies.trajectory import trajectory

_AT_REST = ("roll_angle", "pitch_angle", "table_x", "table_y")
"""Series that a film does not have."""


def shown(source: xr.Dataset | str | Path, reporter: Reporter | None = None) -> xr.Dataset:
    """Return the trajectories of a dataset; for a fit, the film, as a body that stays upright, and the fitted body.

    Raises
    ------
    FileError
        if the file is not a dataset.
    InputError
        if the fit cannot be followed, or used a user-defined model.
    """
    found = source if isinstance(source, xr.Dataset) else opened(local_path(source))
    return _beside(found, reporter) if kind(found) is FIT else found


def _beside(found: xr.Dataset, reporter: Reporter | None) -> xr.Dataset:
    """Return the film, as far as it differs from the fit, and the fit, which begins earlier by the delay.

    Outliers are not shown.
    """
    config, time = configuration(found), found["time"].values
    best = found.isel(law=int(np.argmax(found["weight"].values))) if "law" in found.dims else found
    delay = best["value"].sel(parameter="film_delay").item() if "film_delay" in best["parameter"] else 0.0
    integrator = config.integrator.model_copy(update={"t_end": float(time[-1]) + delay})
    fit = trajectory(replace(config, integrator=integrator), reporter=reporter)
    if "heading" not in fit:
        return fit
    kept = ~best["outlier"].values if "outlier" in best else np.ones(len(time), bool)
    off, late = (best["seen"] - best["fitted"]).values[kept], time[kept] + delay
    of_angles = found["seen"].attrs.get("units") == "radian"
    turned, spun = (off, np.gradient(off, late)) if of_angles else (cumulative_trapezoid(off, late, initial=0), off)
    # What a gyroscope shows of a tilted body is not its spin, so that only their differences are those of the film.
    shown = {
        name: fit[name] + np.interp(fit["time"], late, values) for name, values in (("heading", turned), ("spin", spun))
    }
    shown |= {name: xr.zeros_like(fit[name]) for name in _AT_REST}
    return xr.concat([fit.assign(shown), fit], xr.Variable("trajectory", ["film", "fit"]), combine_attrs="override")

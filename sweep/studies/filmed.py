"""Shows a film and the trajectory that fits it as two bodies side by side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.integrate import cumulative_trapezoid

from sweep.engine.reporter import Reporter
from sweep.results.configuration import configuration
from sweep.results.kind import FIT, kind, opened
from sweep.studies.trajectory import trajectory

_AT_REST = ("roll_angle", "pitch_angle", "table_x", "table_y")
"""Series that a film does not have."""


def shown(source: xr.Dataset | str | Path, reporter: Reporter | None = None) -> xr.Dataset:
    """Return the trajectories of a dataset; for a fit, the film, as a body that stays upright, and the fitted body.

    Raises
    ------
    StoreError
        if the file is not a dataset.
    ConfigError
        if the fit cannot be followed, or used a user-defined model.
    """
    found = source if isinstance(source, xr.Dataset) else opened(Path(source))
    return _beside(found, reporter) if kind(found) is FIT else found


def _beside(found: xr.Dataset, reporter: Reporter | None) -> xr.Dataset:
    """Return the film and the fit; the fitted trajectory begins earlier by the delay."""
    config, time = configuration(found), found["time"].values
    parameters = found["parameter"].values.tolist() if "law" not in found.dims else []
    delay = found["value"].sel(parameter="film_delay").item() if "film_delay" in parameters else 0.0
    integrator = config.integrator.model_copy(update={"t_end": float(time[-1]) + delay})
    fit = trajectory(replace(config, integrator=integrator), reporter=reporter)
    if "heading" not in fit:
        return fit
    seen = found["seen"].values
    of_angles = found["seen"].attrs.get("units") == "radian"
    turned, spin = (seen, np.gradient(seen, time)) if of_angles else (cumulative_trapezoid(seen, time, initial=0), seen)
    series = {"heading": turned, "spin": spin, **{name: np.zeros(len(time)) for name in _AT_REST}}
    shown = {
        name: (fit[name].dims, np.interp(fit["time"].values, time + delay, values).reshape(1, -1))
        for name, values in series.items()
    }
    return xr.concat([fit.assign(shown), fit], xr.Variable("trajectory", ["film", "fit"]), combine_attrs="override")

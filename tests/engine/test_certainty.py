"""Counts that are not certain, and where settled trajectories come to rest."""

import numpy as np
import xarray as xr
from support import ROOT
from support.figures import entries
from support.kernels import default_measures

import sweep
from sweep.kernels.status import SETTLED
from sweep.plots import picture


def run(**settings: object) -> xr.Dataset:
    return sweep.run(ROOT / "configs" / "quick.yaml", **{"x0": 0.01, "y0": 0.01, **settings})


def test_maps_mark_counts_that_are_not_certain() -> None:
    found = run(b=np.linspace(2, 6, 6).tolist(), mu=np.linspace(40, 90, 6).tolist(), n0=0.05, t_end=100)
    assert "count not certain" not in " ".join(entries(picture.plot(found)))
    said = " ".join(entries(picture.plot(found.assign(sensitive=(found.b == 2.0) & (found.mu == 40)))))
    assert "count not certain" in said
    assert "(1 of 36)" in said


def test_settled_trajectories_stay_where_they_are_said_to() -> None:
    settings: dict[str, object] = {"b": [2.0, 3.0], "mu": [40, 70], "n0": 0.05, "t_end": 30_000, "method": "adams"}
    settings["measure"] = list(default_measures("slip"))
    left, later = run(**settings), run(**settings, stop_when_settled=False)
    settled = (left.status == SETTLED).values
    rest, end = left.spin_rest.values, later.spin_final.values
    # Beyond n_c1 a rattle grows, and turns the spin back, before it decays.
    n_c1 = xr.where(left.spin_final > 0, left.n_c1_plus_linear, left.n_c1_minus_linear)
    grows = (left.spin_final / n_c1 > 1).values
    assert min((settled & grows).sum(), (settled & ~grows).sum()) >= 2
    assert (np.abs(rest / end - 1) < np.where(grows, 4e-3, 1e-3))[settled].all()
    assert np.abs(left.spin_final.values / end - 1)[settled].max() > 0.01
    assert np.isnan(rest[~settled]).all()

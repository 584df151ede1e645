"""Maps of a dataset: drawn beside it, with gaps where a cell has no result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support.cli import invoke

import sweep
from sweep.plots import picture

Write = Callable[..., Path]


def test_a_missing_picture_is_drawn_again(write: Write, tmp_path: Path) -> None:
    sweep.run(write(), tmp_path / "out", mu=40.0)
    (tmp_path / "out" / "small.png").unlink()
    sweep.run(write(), tmp_path / "out", mu=40.0)
    assert (tmp_path / "out" / "small.png").exists()


def test_a_sweep_of_too_many_panels_is_not_drawn(write: Write, tmp_path: Path) -> None:
    many = ("b=[2,2.1,2.2,2.3,2.4]", "mu=[40,41,42,43,44]", "n0=[0.01,0.02,0.03]", "delta=[0.01,0.02,0.03]", "t_end=5")
    settings = [part for setting in many for part in ("--set", setting)]
    result = invoke("run", write(), "--output", tmp_path / "out", *settings)
    assert result.exit_code == 0
    assert "no picture: 9 panels" in result.stderr
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["small.nc"]


def test_cells_without_a_result_are_left_blank(small: xr.Dataset) -> None:
    failed = small.isel(n0=0).copy(deep=True)
    failed["status"][:] = 4
    stretched = failed.interp(b=np.linspace(2, 5, 6), mu=np.linspace(40, 60, 5), method="nearest")
    stretched = stretched.astype({name: failed[name].dtype for name in failed.data_vars})
    for name in stretched.data_vars:
        stretched[name].attrs = failed[name].attrs
    figure = picture.draw(stretched)
    mesh = figure.axes[0].collections[0]
    assert mesh.get_array().mask.all()
    assert not figure.axes[1].collections[0].get_array().mask.any()  # the prediction is there all the same


@pytest.mark.parametrize("selection", [{"mu": 0}, {"mu": 0, "n0": 0}, {"mu": 0, "b": 0, "n0": 0}])
def test_draws_any_number_of_axes(small: xr.Dataset, selection: dict[str, int]) -> None:
    assert picture.draw(small.isel(selection)).axes

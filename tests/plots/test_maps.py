"""Maps of a dataset: drawn beside it, with gaps where a cell has no result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

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


@pytest.mark.parametrize("selection", [{"mu": 0}, {"mu": 0, "n0": 0}, {"mu": 0, "b": 0, "n0": 0}])
def test_draws_any_number_of_axes(small: xr.Dataset, selection: dict[str, int]) -> None:
    assert picture.plot(small.isel(selection)).axes

"""Where counts change between the cells of a map."""

import numpy as np
import pytest
import xarray as xr

from sweep.axis import Axis
from sweep.kernels.status import DIVERGED, SETTLED
from sweep.plots.description import boundaries
from sweep.plots.theory import Points


def counted(counts: list[list[float]], widths: list[list[float]]) -> xr.Dataset:
    """Cells near the middle of their counts; where there is no width, no count is known."""
    width, count = np.array(widths), np.array(counts)
    values = {"reversals": count, "margin_more": 0.48 * width, "margin_fewer": 0.52 * width}
    values["status"] = np.where(np.isnan(width), DIVERGED, SETTLED)
    coordinates = {"b": np.arange(float(count.shape[0])), "mu": np.arange(1.0, count.shape[1] + 1)}
    return xr.Dataset({name: (("b", "mu"), v) for name, v in values.items()}, coordinates)


def drawn(dataset: xr.Dataset) -> dict[str, list[Points]]:
    x, y = (Axis(name, dataset[name].values) for name in ("mu", "b"))
    return {line.symbol: line.parts for line in boundaries(dataset, x, y)}


def test_lines_between_distant_counts_are_evenly_apart_whatever_the_widths_of_the_cells() -> None:
    found = drawn(counted([[1, 5], [1, 5]], [[0.001, 0.1], [0.001, 0.1]]))
    at = [found[level][0][0][0] for level in "2345"]
    assert np.diff(at) == pytest.approx(at[1] - at[0], rel=1e-6)
    assert 0.2 < at[1] - at[0] < 0.4


def test_a_cell_without_a_count_breaks_no_line_between_the_others() -> None:
    nowhere = float("nan")
    found = drawn(counted([[0, 1, 1], [0, 1, 1], [0, 0, 1]], [[1, 1, 1], [1, 1, 1], [nowhere, 1, 1]]))
    assert len(found["1"]) == 1
    (x, y), *_ = found["1"]
    assert [x.max(), y.min(), y.max()] == pytest.approx([2.48, 0, 2])

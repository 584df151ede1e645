"""What must hold of a dataset by itself, and of the same cells wherever they are run and however they are shown."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from sweep.config import Config
from sweep.grid import Array
from sweep.kernels.status import FAILURES, IMPOSSIBLE, SETTLED, TIME_LIMIT
from sweep.models.general.laws import LAWS
from sweep.models.general.surfaces import SURFACES
from sweep.parameters import PARAMETERS
from sweep.plots.quantities import field
from sweep.results.dataset import STATUSES
from sweep.results.probabilities import PROBABILITIES
from sweep.units import NUMBER, Unit

MIRRORED = ("delta", "n0", "y0", "Ixy", "Iyz", "roll", "omega1", "omega3", "slip2")
TURNED = ("x0", "y0", "Ixz", "Iyz", "roll", "pitch", "omega1", "omega2", "slip1", "slip2")
"""Parameters that change sign where y does, and where a body is turned by half a turn about z."""

LENGTH, TIME, MASS = 2.0**-4, 2.0**-3, 2.0**-5
"""In m, s and kg, what a real body has for the paper's units: powers of two, so that products of them are exact."""

Rows = dict[str, Array]
"""Values over cells, in a row, by name."""


def rows(dataset: xr.Dataset, cells: Any = slice(None)) -> Rows:
    """All variables and coordinates that a run has for each cell, or for some, in C order of its dimensions."""
    dims = dataset["status"].dims
    found = {}
    for name in dataset.variables:
        variable = dataset[name]
        if name not in PROBABILITIES and "count" not in variable.dims and name not in ("case", "sample"):
            along = [dim for dim in variable.dims if dim not in dims]
            whole = variable.broadcast_like(dataset["status"]).transpose(*dims, *along)
            shape = (dataset["status"].size, *(dataset.sizes[dim] for dim in along))
            found[str(name)] = whole.values.reshape(shape)[cells]
    return found


def sound(config: Config, dataset: xr.Dataset) -> None:
    """Its cells are those of the configuration, counts have the parity of the spins, and what is defined is finite."""
    found, columns = rows(dataset), config.grid.columns()
    status = found["status"]
    for name, column in config.grid.given().items():
        if name in found:
            np.testing.assert_array_equal(found[name], column, name)
    assert set(status.tolist()) <= set(STATUSES) - {0}
    ran = np.isin(status, (SETTLED, TIME_LIMIT))
    if config.simulated:
        # An end is the end of a step.
        assert (found["t_stop"][ran] <= config.integrator.t_end + found["step"][ran]).all(), "a run ends after t_end"
        assert np.isfinite(found["spin_final"][ran]).all()
        assert not (found["spin_error"][ran] < 0).any() if "spin_error" in found else True
    if "certain" in found and config.of_rattlebacks:
        model = config.equations
        of_ran = {name: column[ran] for name, column in columns.items()}  # impossible bodies have no constants
        start = np.zeros(len(status))
        start[ran], *_ = model.energy(model.start(of_ran), model.constants.of(of_ran))
        known = (found["certain"] == 1) & (start != 0)
        odd = np.sign(start) * np.sign(found["spin_final"]) != (-1.0) ** found["reversals"]
        assert not (odd & known).any(), f"parity of {_first(found, odd & known)}"
    if "reversals" in found:
        assert (found["reversals"][ran] >= 0).all()
    if "probability" in dataset:
        valid, count = dataset["status"].isin((SETTLED, TIME_LIMIT)), dataset["count"]
        share = (dataset["reversals"].where(valid, 0) >= count).where(valid).mean("sample")
        np.testing.assert_allclose(dataset["probability"], share.transpose(*dataset["probability"].dims))
    if "t_last_reversal" in found and "reversals" in found:
        some = ran & (found["reversals"] > 0)
        assert (found["t_last_reversal"][some] <= found["t_stop"][some]).all()


def same(one: Rows, other: Rows) -> None:
    """The same numbers of the same cells, of all variables that both have."""
    for name in one:
        if name in other:
            np.testing.assert_array_equal(one[name], other[name], name)


def alike(one: Rows, other: Rows, spin: float = 1.0) -> None:
    """The same ends, counts and spins times `spin`, where both are certain: their numbers differ by rounding."""
    certain = np.ones(len(one["status"]), bool)
    for found in (one, other):
        if "certain" in found:
            certain &= found["certain"] == 1
        else:
            certain &= np.isin(found["status"], (*FAILURES, IMPOSSIBLE))
    for name in ("status", "reversals"):
        if name in one and name in other:
            np.testing.assert_array_equal(one[name][certain], other[name][certain], name)
    ran = certain & (one["status"] == TIME_LIMIT)
    if "spin_error" in one and "spin_error" in other and ran.any():
        near = 100 * (spin * one["spin_error"] + other["spin_error"]) + 1e-3 * abs(other["spin_final"])
        off = abs(spin * one["spin_final"]) - abs(other["spin_final"])
        assert (abs(off) <= near)[ran].all(), f"spin_final {one['spin_final'][ran]}, {other['spin_final'][ran]}"


def scales(config: Config) -> dict[str, float]:
    """What one of the paper's units is in SI, by parameter, for a body of the size above."""
    pure = LAWS[config.law].pure
    meanings = SURFACES[config.surface].meanings
    units: dict[str, Any] = {name: p.units for name, p in PARAMETERS.items()}
    units |= {name: meaning["units"] for name, meaning in meanings.items() if "units" in meaning}
    units |= dict.fromkeys(pure, NUMBER)
    return {
        name: LENGTH**unit.length * TIME**unit.time * MASS**unit.mass
        for name, unit in units.items() if isinstance(unit, Unit)
    }  # fmt: skip


def content(figure: Figure) -> list[Any]:
    """What a figure draws, wherever: the numbers of each panel with its title, without the headings of columns."""
    found = []
    for axes in figure.axes:
        maps = [np.ma.filled(np.ma.asarray(mesh.get_array(), float), np.nan).tobytes() for mesh in _meshes(axes)]
        curves = sorted(np.asarray(line.get_xydata(), float).tobytes() for line in axes.lines)
        found.append((axes.get_title().rpartition("\n")[2], maps, curves))
    return sorted(found)


def shown(dataset: xr.Dataset, figure: Figure) -> None:
    """Each map of a figure has the values that a dataset has there."""
    for axes in figure.axes:
        for mesh in _meshes(axes):
            values, drawn = field(dataset, mesh.get_gid()), np.ma.masked_invalid(np.ma.asarray(mesh.get_array(), float))
            assert any(_is_panel(values, drawn, *dims) for dims in permutations(values.dims, 2)), mesh.get_gid()


def _is_panel(values: xr.DataArray, drawn: Any, up: Any, across: Any) -> bool:
    """Whether a map has the values over two dimensions, for some indices along the others; blank cells aside."""
    if drawn.shape != (values.sizes[up], values.sizes[across]):
        return False
    ordered = values.sortby([dim for dim in (up, across) if dim in values.coords]).transpose(up, across, ...)
    panels = ordered.values.reshape(*drawn.shape, -1).astype(float)
    return any((panels[..., k] == drawn).filled(True).all() for k in range(panels.shape[-1]))


def _meshes(axes: Any) -> list[QuadMesh]:
    return [each for each in axes.collections if isinstance(each, QuadMesh) and each.get_gid()]


def _first(found: Rows, which: Array) -> str:
    cell = int(np.flatnonzero(which)[0])
    return ", ".join(f"{name}={values[cell]}" for name, values in found.items() if values.ndim == 1)

"""Sweeps in which some bodies cannot be: their cells have a status, cost nothing and harm no neighbour."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support import Write
from support.runs import Heard, Stop, limited, same_numbers

import sweep
from sweep import InputError
from sweep.config import load_config
from sweep.engine.estimate import estimate
from sweep.kernels.status import FAILURES, IMPOSSIBLE
from sweep.plots.marks import BLANK, legend, marks
from sweep.results.dataset import Reason
from sweep.results.summary import accuracy, describe, failed_fraction

pytestmark = pytest.mark.usefixtures("no_pictures")

TEXT = """\
name: edge
body: {b: [0.9, 3.0, 5.0], offset: [0.0, 0.3, 1.0]}
friction: {mu: 60}
start: {n0: [0.02, 0.05], x0: 0.01, y0: 0.01}
integrator: {method: dopri5, t_end: 300}
"""
"""With b = 0.9 and offset = 0 the body falls over; with offset = 1 the centre of mass lies on the surface."""

GONE = np.array([[True, False, True], [False, False, True], [False, False, True]])


def swept(*given: Any, **settings: Any) -> xr.Dataset:
    """A run, its axes in the order of `GONE`."""
    return sweep.run(*given, **settings).transpose("b", "offset", "n0", ...)


@pytest.fixture(scope="module")
def edge(kept: Write) -> xr.Dataset:
    return swept(kept(TEXT))


def test_impossible_bodies_have_a_status_and_no_numbers(edge: xr.Dataset) -> None:
    np.testing.assert_array_equal(edge.sweep.impossible.values, np.repeat(GONE[:, :, None], 2, axis=2))
    for name, values in edge.data_vars.items():
        if values.dtype.kind == "f":
            gone = np.broadcast_to(GONE.reshape(3, 3, *[1] * (values.ndim - 2)), values.shape)
            assert np.isnan(values.values[gone]).all(), name
    assert not edge["reversals"].values[GONE].any()
    assert failed_fraction(edge) == 0
    assert edge.attrs["impossible"] == (
        "6 cells, centre of mass outside the ellipsoid, the first at b=0.9, offset=1; "
        "2 cells, upright rest is not stable, the first at b=0.9, offset=0"
    )
    words = describe(edge)
    assert "8 impossible" in words
    assert "2 cells, upright rest is not stable" in words
    assert "set by stability in 10 cells" in "".join(accuracy(edge))


def test_neighbours_of_impossible_bodies_keep_their_numbers(edge: xr.Dataset, write: Write) -> None:
    alone = swept(write(TEXT), b=[3.0, 5.0], offset=[0.0, 0.3])
    same_numbers(edge.sel(b=[3.0, 5.0], offset=[0.0, 0.3]), alone)


def test_maps_leave_them_blank(edge: xr.Dataset) -> None:
    kinds = marks(edge, "reversals")
    np.testing.assert_array_equal(kinds["impossible"].values, np.any([kinds[kind] for kind in BLANK], axis=0))
    assert legend(edge, "reversals")["impossible"] == "impossible body (8)"
    assert int(marks(edge, "spin_final")["no_value"].sum()) == 0


@pytest.mark.parametrize("size", [1, 4])
def test_tiles_of_impossible_bodies_and_a_resumed_run(
    edge: xr.Dataset, write: Write, tmp_path: Path, size: int
) -> None:
    reporter = Heard()
    with limited(tile=size, batch=size):
        with pytest.raises(KeyboardInterrupt):
            sweep.run(write(TEXT), tmp_path, progress=Stop(3))
        found = swept(write(TEXT), tmp_path, progress=reporter)
    same_numbers(found, edge)
    assert (reporter.seen[-1].done, reporter.seen[-1].failed) == (18, 0)


def test_a_run_grows_by_impossible_bodies(edge: xr.Dataset, write: Write, tmp_path: Path) -> None:
    sweep.run(write(TEXT), tmp_path, offset=[0.0, 0.3])
    reporter = Heard()
    found = swept(write(TEXT), tmp_path, progress=reporter)
    same_numbers(found, edge)
    assert "12 of 18 cells are reused" in reporter.notes[0]
    assert found.attrs["impossible"] == edge.attrs["impossible"]


def test_an_estimate_of_cells_none_of_which_can_be() -> None:
    """So it seems of a large table of which the sample meets no other."""
    offsets = np.ones(10_000)
    offsets[1] = 0.0
    said = estimate(load_config({"cases": {"offset": offsets}, "body": {"delta": 0.03}, "friction": {"mu": 60}}))
    assert "cells:  10000" in said
    assert "steps:  0 if" in said


def test_critical_spins_of_the_others(write: Write) -> None:
    found = sweep.critical(write(TEXT.replace("[0.02, 0.05]", "0.05")), bracket=1e-2, b=[0.9, 3.0], offset=[0.0, 0.3])
    gone = np.array([[True, False], [False, False]])
    positive = found.sel(sign=1).transpose("b", "offset", ...)
    np.testing.assert_array_equal(positive["n_c_reason"] == Reason.IMPOSSIBLE, gone)
    np.testing.assert_array_equal(np.isnan(positive["n_c1_linear"]), gone)
    assert (positive["n_c1_linear"].sel(b=3.0) > 0).all()


def test_a_trajectory_of_such_a_body_is_refused(write: Write) -> None:
    with pytest.raises(InputError, match="upright rest is not stable"):
        sweep.trajectory(write(TEXT), b=[0.9, 3.0], offset=0.05)
    with pytest.raises(InputError, match=r"small\.yaml:2:1: body: "):
        sweep.trajectory(write(TEXT))


@pytest.mark.parametrize("body", [{"b": 1}, {"b": 0.7, "c": 0.7}, {"b": 0.9, "offset": 0.1899999999999}])
def test_a_body_that_rolls_like_a_ball_is_neutral(body: dict[str, float]) -> None:
    """Not unstable: b² = c (c - offset), apart from rounding."""
    with pytest.raises(InputError, match="upright rest is neutral"):
        sweep.load_config({"friction": {"mu": 60}, "body": body})


@pytest.mark.parametrize("change", [{"Izz": [21.0, 30.0]}, {"Ixy": [-0.3, -10.0]}])
def test_no_number_is_made_up_for_a_body_that_cannot_be(write: Write, change: dict[str, list[float]]) -> None:
    """Its moments break the triangle inequality, or its matrix is not positive definite."""
    text = "body: {Ixx: 2, Iyy: 20, Izz: 21, Ixy: -0.3}\nfriction: {mu: 60}\nstart: {n0: 0.05}\n"
    config = load_config(write(text + "integrator: {t_end: 100, step: 0.02}\n"), change)
    predicted = sweep.predict(config)["n_c1_linear"].sel(sign=1).values
    np.testing.assert_array_equal(np.isnan(predicted), [False, True])
    assert sweep.run(config)["status"].values.tolist() == [2, IMPOSSIBLE]


def test_a_body_that_fails_within_the_start_up_of_a_method_gives_no_warning() -> None:
    """Nearly a sphere, it is spun so fast that it fails."""
    cases = {"a": [1.2, 9.01], "b": [1.04, 3.0], "n0": [99.0, 0.025]}
    found = sweep.run({"friction": {"mu": 5000}, "cases": cases, "integrator": {"method": "adams", "t_end": 300}})
    assert np.isin(found.status, FAILURES).tolist() == [True, False]


def test_a_fixed_step_is_judged_by_the_bodies_that_there_are(write: Write) -> None:
    """With so small a moment the rattle would be faster."""
    text = "body: {Ixx: [2, 1.0e-3], Iyy: 20, Izz: 21, Ixy: 0}\nfriction: {mu: 60}\nintegrator: {step: 0.8}\n"
    assert load_config(write(text)).integrator.step == 0.8
    with pytest.raises(InputError, match="a quarter of the rattle's period"):
        load_config(write(text), {"Izz": 20.0})


def test_an_inertia_without_an_inverse_is_impossible() -> None:
    body = {"a": 10, "b": 3, "Ixx": 0.3, "Iyy": 0.3, "Izz": 0.03, "Ixy": [-0.3, 0.011]}
    found = sweep.run({"body": body | {"c": [1.1, 0.5]}, "friction": {"mu": 20}, "integrator": {"t_end": 50}})
    np.testing.assert_array_equal(found.sweep.impossible.transpose("Ixy", "c"), [[True, True], [False, False]])

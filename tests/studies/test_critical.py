"""Critical spins: the eigenvalues against simulation, and n_c2 against runs; of the paper's bodies and of real ones."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support import Write, wide_bodies
from support.cli import invoke
from support.kernels import kernel
from support.physics import IN_SI

import sweep
from sweep.config import InputError
from sweep.engine.executor import execute
from sweep.grid import Array
from sweep.kernels.status import TIME_LIMIT
from sweep.models import MODELS
from sweep.models.model import Columns, Model, stack
from sweep.models.theory import linear
from sweep.results.dataset import REASONS
from sweep.results.summary import describe

STANDARD = "name: standard\nfriction: {mu: 75}\nintegrator: {t_end: 12000}\n"
NAMES = ("n_c1_plus", "n_c1_minus", "n_c2_plus", "n_c2_minus")


def reasons(spins: xr.Dataset, name: str) -> list[str]:
    return [REASONS[code] for code in np.atleast_1d(spins[f"{name}_reason"].values)]


def simulated_growth(bodies: Columns, spin: Array) -> Array:
    """Growth rate of a tiny rattle: each component is disturbed by itself, which makes the propagator of a period."""
    dopri5, zero = kernel("dopri5", "slip"), np.zeros_like(spin)
    model, columns = dopri5.model, {**bodies, "n0": spin, "x0": zero, "y0": zero}
    rattle = [i for i in range(len(model.states)) if i != model.spin_state]
    values = eigenvalues(model, columns)
    period = np.minimum(model.slower_period(columns), 10 / np.abs(values.real.max(axis=-1)))
    fastest = np.abs(values).max(axis=-1)
    images = np.repeat(dopri5.images(columns, np.minimum(0.01, 2 / fastest), period), len(rattle), axis=0)
    states = dopri5.states(images)
    states[:] = np.repeat(stack(model.upright(spin)), len(rattle), axis=1)
    for i, component in enumerate(rattle):
        states[component, i :: len(rattle)] = 1e-30
    spins, energy, inertia = model.energy(*dopri5.unpack(images))
    dopri5.table(images)["energy"] = energy + 0.5 * inertia * spins**2
    execute(dopri5, images)
    assert (dopri5.table(images)["status"] == TIME_LIMIT).all()
    propagator = dopri5.states(images)[rattle].reshape(len(rattle), len(spin), len(rattle)).swapaxes(0, 1) / 1e-30
    return np.asarray(np.log(np.abs(np.linalg.eigvals(propagator)).max(axis=-1)) / period)


def eigenvalues(model: Model, columns: Columns) -> Array:
    return np.linalg.eigvals(linear.jacobian(model, model.constants.of(columns), columns["n0"]))


@pytest.mark.parametrize("number", [8, pytest.param(200, marks=pytest.mark.campaign)])
def test_a_simulated_rattle_grows_as_the_eigenvalues_say(number: int, write: Write) -> None:
    """At rest and far beyond n_c1; and it begins to grow where the critical spins of a dataset are."""
    bodies = wide_bodies(number)
    bodies = {name: bodies[name] for name in ("a", "b", "c", "delta", "mu")}
    config = sweep.load_config(write(STANDARD))
    rest = {name: values for name, values in config.parameters.items() if name not in bodies}
    predicted = sweep.predict(replace(config, parameters=rest, cases={n: tuple(v) for n, v in bodies.items()}))
    at_rest = simulated_growth(bodies, np.zeros(number))
    for name in ("n_c1_plus_linear", "n_c1_minus_linear"):
        n_c1 = predicted[name].values
        assert (simulated_growth(bodies, 0.998 * n_c1) < 0).all()
        assert (simulated_growth(bodies, 1.002 * n_c1) > 0).all()
        for share in (0, 0.5, 4):
            exact = eigenvalues(MODELS["slip"], bodies | {"n0": share * n_c1}).real.max(axis=-1)
            error = np.abs(simulated_growth(bodies, share * n_c1) - exact)
            assert (error < 2e-5 * np.maximum(np.abs(at_rest), np.abs(exact))).all()


@pytest.mark.parametrize(("parameters"), [{"mu": 160.0}, {"model": "averaged"}])
def test_n_c2_lies_beyond_n_c1(parameters: dict[str, Any], write: Write) -> None:
    spins = sweep.critical(write(STANDARD), **parameters)
    assert (reasons(spins, "n_c1_minus"), reasons(spins, "n_c2_minus")) == (["exists"], ["exists"])
    assert spins.n_c2_minus_simulated_outer < spins.n_c2_minus_simulated_inner <= spins.n_c1_minus_linear < 0


@pytest.mark.parametrize("mu", [60.0, 75.0])
def test_brackets_are_as_narrow_as_asked_and_another_method_says_the_same(mu: float, write: Write) -> None:
    spins = sweep.critical(write(STANDARD), mu=mu, bracket=1e-6)
    assert "n0" not in spins.coords
    assert spins.critical_reason == 0
    for side in ("plus", "minus"):
        ends = [float(spins[f"n_c2_{side}_simulated_{end}"]) for end in ("inner", "outer")]
        assert 0 < ends[1] / ends[0] - 1 < 1.01e-6
        assert 1.9 < spins[f"n_c2_{side}_simulated"] / spins[f"n_c1_{side}_linear"] < 2.1
        run = sweep.run(write(STANDARD), mu=mu, n0=ends, tolerance=1e-11, method="dopri5")
        assert run.reversals.values.tolist() == [0, 1]


def test_n_c2_is_the_first_boundary_along_n0(write: Write) -> None:
    """The two searches begin elsewhere, one at a multiple of n_c1 and one at the cells of a grid."""
    spins = sweep.critical(write(STANDARD), mu=[60.0, 75.0], bracket=1e-5)
    curves = sweep.boundaries(write(STANDARD), x="n0", mu=[60.0, 75.0], n0=[0.003, 0.0045, 0.006], bracket=1e-5)
    first = curves.where((curves.level == 1) & (curves.bracket == "n0"), drop=True).sortby("mu")
    np.testing.assert_allclose(first.n0, spins.n_c2_plus_simulated, rtol=2e-5)


def test_spins_that_are_not_critical_have_a_reason(write: Write) -> None:
    told = invoke("critical", write(STANDARD), "--set", "mu=0", "--dry-run")
    assert told.stdout == "bodies: 1 (one body), each with spins of both signs; none has an n_c1 from which to search\n"
    for settings, reason in (
        ({"mu": 0.0}, "no_friction"),
        ({"model": "noslip"}, "no_friction"),
        ({"model": "averaged", "delta": 0.0}, "no_coupling"),
    ):
        spins = sweep.critical(write(STANDARD), **settings)
        assert [reasons(spins, name) for name in NAMES] == [[reason]] * 4
        assert np.isnan([spins.n_c2_plus_simulated, spins.n_c2_minus_simulated]).all()
        assert f"n_c1_plus: 1 {reason.replace('_', ' ')}" in describe(spins)
        meanings = spins.critical_reason.attrs["flag_meanings"].split()
        assert dict(zip(spins.critical_reason.attrs["flag_values"], meanings, strict=True)) == REASONS


def test_friction_alone_makes_a_rattle_grow_at_a_fast_spin(write: Write) -> None:
    """Without the angle δ nothing tells right from left, and nothing reverses, but upright spin is not stable."""
    spins = sweep.critical(write(STANDARD), delta=0.0, t_end=100.0, bracket=0.01)
    assert float(spins.n_c1_plus_linear) == pytest.approx(0.0798, rel=0.01)
    assert float(spins.n_c1_minus_linear) == pytest.approx(-0.0798, rel=0.01)
    assert "exists" not in reasons(spins, "n_c2_plus")


@pytest.mark.parametrize(
    ("settings", "reason"),
    [({"x0": 1.0, "y0": 1.0}, "reverses_at_n_c1"), ({"t_end": 30.0}, "undecided"), ({"step": 0.5}, "failed")],
)
def test_n_c2_that_is_not_known_has_a_reason(settings: dict[str, float], reason: str, write: Write) -> None:
    """A large rattle turns a slow spin by itself; trajectories are too short; their steps are far too long."""
    spins = sweep.critical(write(STANDARD), **settings, bracket=0.01)
    assert reasons(spins, "n_c1_plus") == ["exists"]
    assert reasons(spins, "n_c2_plus") == [reason]
    assert np.isnan(spins.n_c2_plus_simulated)
    assert REASONS[int(spins.critical_reason)] == reason


def test_where_n_c2_is_undecided_its_upper_bound_is_told(write: Write) -> None:
    """With this t_end only trajectories from well above n_c2 have reversed in time, and the others have not settled."""
    short, long = (sweep.critical(write(STANDARD), t_end=t_end, bracket=0.01) for t_end in (2000.0, 12_000.0))
    assert (reasons(short, "n_c2_plus"), reasons(long, "n_c2_plus")) == (["undecided"], ["exists"])
    assert np.isnan(short.n_c2_plus_simulated)
    assert np.isnan(short.n_c2_plus_simulated_inner)
    assert short.n_c2_plus_simulated_outer > 1.1 * long.n_c2_plus_simulated_outer


STONE = IN_SI | {
    "friction": {"mu": 100}, "start": {"n0": 1, "x0": 1e-3, "y0": 1e-3}, "integrator": {"t_end": 100},
}  # fmt: skip


def test_a_start_by_angles_has_no_spin_to_search() -> None:
    with pytest.raises(InputError, match="give x0 and y0"):
        sweep.critical(STONE | {"start": {"roll": "1 deg"}})


def test_vectors_of_a_trajectory_are_along_the_same_axes_with_any_equations() -> None:
    """Along the axes of inertia of a body that is given by `delta`, with whatever terms its equations have."""
    body, scene = {"a": 10, "b": 3, "delta": 0.3}, {"start": {"n0": 0.2, "x0": 0.3, "y0": -0.1}}
    papers, general = (
        sweep.trajectory(scene | {"body": body | more, "friction": {"mu": 3}}, t_end=20, every=0.5)
        for more in ({}, {"offset": 1e-300})
    )
    assert float(general.contact_x[0, 0]) == pytest.approx(0.3)
    turned = ("heading", "roll_angle", "pitch_angle", "table_x", "table_y")
    for name in ("spin", "contact_x", "contact_y", "slip_1", "slip_2", *turned):
        assert np.abs(papers[name]).max() > 1e-3
        np.testing.assert_allclose(general[name], papers[name], rtol=0, atol=1e-8)


def test_a_small_body_reverses_as_a_large_one_does() -> None:
    """With lengths 400 times as small, times are 20 times as short, and spins larger than 10 rad/s."""
    body = {name: value / (400**2 if name[0] == "I" else 400) for name, value in IN_SI["body"].items()} | {"mass": 1.0}
    start, more = {"n0": 1, "x0": 2.5e-6, "y0": 2.5e-6}, {"friction": {"mu": 2000}, "integrator": {"t_end": 5}}
    small = IN_SI | {"body": body, "start": start} | more
    large, found = (sweep.critical(scene, bracket=1e-2) for scene in (STONE, small))
    assert not {"form_factor", "n_c1_plus"} & set(large)
    for side in ("plus", "minus"):
        assert large[f"n_c1_{side}_reason"] == 0
        assert np.abs(large[f"n_c2_{side}_simulated"] / large[f"n_c1_{side}_linear"]) > 1  # t_end decides
        assert large[f"n_c1_{side}_linear"].attrs["units"] == "radian s-1"
        there, here = (each[f"n_c2_{side}_simulated"] for each in (large, found))
        assert (found[f"n_c2_{side}_reason"] == large[f"n_c2_{side}_reason"]).all()
        np.testing.assert_allclose(here, 20 * there, rtol=0.01)
    assert np.abs(found["n_c2_minus_simulated"]).max() > 10

"""Critical spins: the eigenvalues against simulation, and n_c2 against runs; of the paper's bodies and of real ones."""

from collections.abc import Callable
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
from sweep.results.dataset import REASONS, Reason
from sweep.results.summary import describe
from sweep.studies.critical import Answer, Spin

Places = list[tuple[float, bool]]

STANDARD = "name: standard\nfriction: {mu: 75}\nintegrator: {t_end: 12000}\n"


def reasons(spins: xr.Dataset) -> list[str]:
    """The outcomes for positive and for negative spin of one body."""
    return [REASONS[code] for code in spins["n_c_reason"].values]


def simulated_growth(bodies: Columns, spin: Array) -> Array:
    """Growth rate of a tiny rattle: each component is disturbed by itself, which makes the propagator of a period."""
    dopri5, zero = kernel("dopri5", "slip"), np.zeros_like(spin)
    model, columns = dopri5.model, {**bodies, "n0": spin, "x0": zero, "y0": zero}
    rattle = [i for i in range(len(model.states)) if i != model.spin_state]
    values = eigenvalues(model, columns)
    period = np.minimum(model.slower_period(columns), 10 / np.abs(values.real.max(axis=-1)))
    fastest = np.abs(values).max(axis=-1)
    rows = np.repeat(dopri5.start(columns, np.minimum(0.01, 2 / fastest), period), len(rattle), axis=0)
    states = dopri5.states(rows)
    states[:] = np.repeat(stack(model.upright(spin)), len(rattle), axis=1)
    for i, component in enumerate(rattle):
        states[component, i :: len(rattle)] = 1e-30
    spins, energy, inertia = model.energy(*dopri5.unpack(rows))
    dopri5.table(rows)["energy"] = energy + 0.5 * inertia * spins**2
    execute(dopri5, rows)
    assert (dopri5.table(rows)["status"] == TIME_LIMIT).all()
    propagator = dopri5.states(rows)[rattle].reshape(len(rattle), len(spin), len(rattle)).swapaxes(0, 1) / 1e-30
    return np.asarray(np.log(np.abs(np.linalg.eigvals(propagator)).max(axis=-1)) / period)


def eigenvalues(model: Model, columns: Columns) -> Array:
    return np.linalg.eigvals(linear.jacobian(model, model.constants.of(columns), columns["n0"]))


@pytest.mark.parametrize("number", [8, pytest.param(200, marks=pytest.mark.release)])
def test_a_simulated_rattle_grows_as_the_eigenvalues_say(number: int, write: Write) -> None:
    """At rest and far beyond n_c1; and it begins to grow where the critical spins of a dataset are."""
    bodies = wide_bodies(number)
    bodies = {name: bodies[name] for name in ("a", "b", "c", "delta", "mu")}
    config = sweep.load_config(write(STANDARD))
    rest = {name: values for name, values in config.parameters.items() if name not in bodies}
    predicted = sweep.predict(replace(config, parameters=rest, cases={n: tuple(v) for n, v in bodies.items()}))
    at_rest = simulated_growth(bodies, np.zeros(number))
    for n_c1 in predicted["n_c1_linear"].transpose("sign", ...).values:
        assert (simulated_growth(bodies, 0.998 * n_c1) < 0).all()
        assert (simulated_growth(bodies, 1.002 * n_c1) > 0).all()
        for share in (0, 0.5, 4):
            exact = eigenvalues(MODELS["slip"], bodies | {"n0": share * n_c1}).real.max(axis=-1)
            error = np.abs(simulated_growth(bodies, share * n_c1) - exact)
            assert (error < 2e-5 * np.maximum(np.abs(at_rest), np.abs(exact))).all()


@pytest.mark.parametrize(("parameters"), [{"mu": 160.0}, {"model": "averaged"}])
def test_n_c2_lies_beyond_n_c1(parameters: dict[str, Any], write: Write) -> None:
    spins = sweep.critical(write(STANDARD), **parameters)
    assert reasons(spins)[1] == "exists"
    inner, outer = spins.n_c2_bracket.sel(sign=-1).values
    assert outer < inner <= spins.n_c1_linear.sel(sign=-1) < 0


@pytest.mark.parametrize("mu", [60.0, 75.0])
def test_brackets_are_as_narrow_as_asked_and_another_method_says_the_same(mu: float, write: Write) -> None:
    spins = sweep.critical(write(STANDARD), mu=mu, bracket=1e-6)
    assert "n0" not in spins.coords
    assert reasons(spins) == ["exists", "exists"]
    assert (np.abs(spins.n_c2_simulated / spins.n_c1_linear - 2) < 0.1).all()
    for sign in (1, -1):
        ends = spins.n_c2_bracket.sel(sign=sign, end=["inner", "outer"]).values.tolist()
        assert 0 < ends[1] / ends[0] - 1 < 1.01e-6
        run = sweep.run(write(STANDARD), mu=mu, n0=ends, tolerance=1e-11, method="dopri5")
        assert run.reversals.values.tolist() == [0, 1]


def test_an_end_of_a_slow_n_c2_is_as_certain_as_one_of_a_fast_one() -> None:
    """By SciPy's DOP853 to t = 10500 (relative tolerance 1e-12), the first of these spins does not reverse, and the
    others do. A tolerance that does not depend on the spin made the last one the inner end."""
    still, reversing, wrong = 0.00214682, 0.00214875, 0.00214963
    body = {"a": 12.109548, "b": 7.055028, "delta": -0.084762, "mu": 132.92054, "x0": 0.012290175, "y0": 0.002409336}
    inner, outer = sweep.critical({}, **body).n_c2_bracket.sel(sign=1).values
    assert inner < reversing < wrong
    assert still < outer < inner * 1.0011


def searched(
    distance: Callable[[float], float | None], certain: Callable[[float], bool] = lambda _: True, width: float = 1e-3
) -> tuple[Spin, Places]:
    """A search whose simulations are replaced by two functions of the spin, and the places that it asks for.

    A simulation without a distance has failed.
    """
    spin, asked = Spin(0, 1.0, width, [float(np.log(1.25**i)) for i in range(9)]), Places()
    while spin.reason is None:
        narrowing, answers = spin.root is not None, []
        for place in spin.wanted():
            found, sure = distance(np.exp(place)), not narrowing or certain(np.exp(place))
            answers.append(Answer(place, np.nan if found is None else found, False, found is None, sure))
            asked.append((place, narrowing))
        spin.learn(answers)
    return spin, asked


def beyond(n_c2: float, slower: float = -1.0) -> Callable[[float], float]:
    """Spins beyond this one reverse."""
    return lambda n: 1.0 if n > n_c2 else slower


@pytest.mark.parametrize(
    ("distance", "reason"),
    [
        (beyond(2.0), Reason.EXISTS),
        (beyond(0.5), Reason.REVERSES_AT_N_C1),
        (beyond(9.0), Reason.NOT_FOUND),
        (beyond(9.0, np.nan), Reason.NOT_SETTLED),
        (beyond(2.0, np.nan), Reason.NOT_SETTLED),
        (lambda n: -1.0 if n < 2.0 else None, Reason.FAILED),
    ],
)
def test_a_search_ends_with_a_reason(distance: Callable[[float], float | None], reason: Reason) -> None:
    """The spins below and beyond n_c2 reverse or not, have not settled, or fail."""
    assert searched(distance)[0].reason == reason


def test_uncertain_counts_leave_a_wide_bracket_around_them() -> None:
    spin, _ = searched(beyond(3.4), lambda n: not 3.3 < n < 3.5)
    assert spin.reason == Reason.EXISTS
    low, high = np.exp([spin.root.low, spin.root.high])
    assert 3.25 < low < 3.3
    assert 3.5 < high < 3.55


@pytest.mark.parametrize("certain", [True, False])
def test_ends_of_the_outward_search_are_simulated_again(certain: bool) -> None:
    """A wide bracket is the one that the outward search finds."""
    spin, asked = searched(beyond(2.0), lambda _: certain, 0.5)
    ends = [spin.root.low, spin.root.high]
    assert [place for place, narrowing in asked if narrowing] == ends
    assert spin.reason == (Reason.EXISTS if certain else Reason.NOT_SETTLED)


def test_n_c2_is_the_first_boundary_along_n0(write: Write) -> None:
    """The two searches begin elsewhere, one at a multiple of n_c1 and one at the cells of a grid."""
    spins = sweep.critical(write(STANDARD), mu=[60.0, 75.0], bracket=1e-5)
    curves = sweep.boundaries(write(STANDARD), x="n0", mu=[60.0, 75.0], n0=[0.003, 0.0045, 0.006], bracket=1e-5)
    first = curves.where((curves.level == 1) & (curves.bracket == "n0"), drop=True).sortby("mu")
    np.testing.assert_allclose(first.n0, spins.n_c2_simulated.sel(sign=1), rtol=2e-5)


def test_spins_that_are_not_critical_have_a_reason(write: Write) -> None:
    dry = invoke("critical", write(STANDARD), "--set", "mu=0", "--dry-run")
    assert dry.stdout == "bodies: 1 (one body), each with spins of both signs; none has an n_c1 from which to search\n"
    for settings, reason in (
        ({"mu": 0.0}, "no_friction"),
        ({"model": "noslip"}, "no_friction"),
        ({"model": "averaged", "delta": 0.0}, "no_coupling"),
    ):
        spins = sweep.critical(write(STANDARD), **settings)
        assert reasons(spins) == [reason] * 2
        assert np.isnan([spins.n_c1_linear, spins.n_c2_simulated]).all()
        assert f"n_c1, positive spin: 1 {reason.replace('_', ' ')}" in describe(spins)
        meanings = spins.n_c_reason.attrs["flag_meanings"].split()
        assert dict(zip(spins.n_c_reason.attrs["flag_values"], meanings, strict=True)) == REASONS


def test_friction_alone_makes_a_rattle_grow_at_a_fast_spin(write: Write) -> None:
    """Without the angle δ right and left are alike and nothing reverses, but upright spin is not stable."""
    spins = sweep.critical(write(STANDARD), delta=0.0, t_end=100.0, bracket=0.01)
    assert spins.n_c1_linear.values == pytest.approx([0.0798, -0.0798], rel=0.01)
    assert "exists" not in reasons(spins)


def test_a_search_among_failures_has_failed(write: Write) -> None:
    """Their steps are far too long."""
    spins = sweep.critical(write(STANDARD), step=0.5, bracket=0.01)
    assert np.isfinite(spins.n_c1_linear).all()
    assert reasons(spins)[0] == "failed"
    assert np.isnan(spins.n_c2_simulated.sel(sign=1))


def test_an_n_c2_that_is_not_found_in_time_has_an_upper_bound(write: Write) -> None:
    """With this t_end only trajectories from well above n_c2 have reversed in time, and the others have not settled."""
    short, long = (sweep.critical(write(STANDARD), t_end=t_end, bracket=0.01) for t_end in (2000.0, 12_000.0))
    assert (reasons(short)[0], reasons(long)[0]) == ("not_settled", "exists")
    early, late = (each.sel(sign=1) for each in (short, long))
    assert np.isnan([early.n_c2_simulated, early.n_c2_bracket.sel(end="inner")]).all()
    assert early.n_c2_bracket.sel(end="outer") > 1.1 * late.n_c2_bracket.sel(end="outer")


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
    assert float(general.contact_x[0]) == pytest.approx(0.3)
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
    assert not {"form_factor", "n_c1"} & set(large)
    assert (np.abs(large.n_c2_simulated / large.n_c1_linear) > 1).all()  # t_end decides
    assert large.n_c1_linear.attrs["units"] == "radian s-1"
    np.testing.assert_array_equal(found.n_c_reason, large.n_c_reason)
    np.testing.assert_allclose(found.n_c2_simulated, 20 * large.n_c2_simulated, rtol=0.01)
    assert np.abs(found.n_c2_simulated).max() > 10

"""The figures of single trajectories and of critical spins, and what is said of their files."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support import Write
from support.cli import invoke, refused
from support.figures import constants, entries

from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.plots import picture
from sweep.results.dataset import VARIABLES
from sweep.results.netcdf import open_dataset

SERIES = ("contact_x", "contact_y", "v0_rate_1", "slip_rate_1", "energy", "dissipated")


def made(mu: list[float], **given: Any) -> xr.Dataset:
    """Trajectories with the same spins at different frictions; their critical spins fall with the friction."""
    time = np.linspace(0, 100, 201)
    series = np.outer(np.ones(len(mu)), np.cos(time / 10))
    bodies = np.asarray(mu, float)
    values = dict.fromkeys(("spin", *SERIES), (("trajectory", "time"), series))
    constants = {"a": 10.0, "b": 3.0, "c": 1.0, "delta": 0.03, "n0": 0.05, "t_stop": 100.0} | given
    each = {name: ("trajectory", np.broadcast_to(v, len(mu))) for name, v in constants.items()}
    each |= {"mu": ("trajectory", bodies), "reversals": ("trajectory", np.full(len(mu), 3))}
    each |= {name: (("trajectory", "sign"), np.outer(n / bodies, [1, -1])) for n, name in ((1, "n_c1"), (2, "n_c2"))}
    dataset = xr.Dataset({**values, **each}, {"time": time, "sign": [1, -1]}, {"sweep_kind": "trajectory"})
    dataset["status"] = "trajectory", np.full(len(mu), SETTLED)
    dataset["time"].attrs = {"long_name": "time t", "units": "sqrt(c/g)"}
    dataset["spin"].attrs = {"long_name": "spin n", "units": "sqrt(g/c)"}
    return dataset


def test_every_curve_is_in_a_legend() -> None:
    figure = picture.plot(made([60, 100]))
    assert entries(figure)[:2] == ["μ = 60: 3 reversals", "μ = 100: 3 reversals"]
    colours = {handle.get_label(): handle.get_color() for handle in figure.legends[0].legend_handles}
    for axes in figure.axes:
        lines = [line for line in axes.lines if line.get_gid() in ("spin", *SERIES)]
        assert lines
        assert all(line.get_color() == colours[line.get_label()] for line in lines)
        # Where a panel has several series, its own legend distinguishes them by their shade.
        shades = {line.get_alpha() for line in lines}
        if len({line.get_gid() for line in lines}) > 1:
            assert {handle.get_alpha() for handle in axes.get_legend().legend_handles} == shades
            assert len(shades) == 2


@pytest.mark.parametrize(("mu", "sets"), [([60], 1), ([60, 60], 1), ([60, 100], 2)])
def test_a_set_of_critical_lines_for_each_body(mu: list[float], sets: int) -> None:
    axes = picture.plot(made(mu)).axes[0]
    lines = [line for line in axes.lines if line.get_gid() in ("n_c1", "n_c2")]
    assert sorted(line.get_ydata()[0] for line in lines) == sorted(s / m for m in set(mu) for s in (-2, -1, 1, 2))
    assert len({line.get_color() for line in lines}) == sets
    if sets == 2:
        curves = {line.get_label().split(":")[0]: line.get_color() for line in axes.lines if line.get_gid() == "spin"}
        assert {line.get_color() for line in lines} == set(curves.values())


def test_a_body_in_si_has_its_units_everywhere() -> None:
    dataset = made([60, 60], a=0.2, n0=[-1.0, 2.0])
    for name, units in (("a", "m"), ("n0", "radian s-1"), ("spin", "radian s-1"), ("energy", "m2 s-2")):
        dataset[name].attrs = {"units": units, "long_name": name}
    dataset["reversals"][:] = [1, 2]
    figure = picture.plot(dataset)
    assert constants(figure).startswith("a = 0.2 m,")
    assert entries(figure)[:2] == ["n₀ = −1 rad/s: 1 reversal", "n₀ = 2 rad/s: 2 reversals"]
    assert figure.axes[0].get_ylabel() == "spin n (rad/s)"
    assert (figure.axes[-1].get_title("left"), figure.axes[-1].get_ylabel()) == ("energy per mass", "m²/s²")


def test_one_series_is_drawn_alone() -> None:
    (axes,) = picture.plot(made([60, 100]), "energy").axes
    assert {line.get_gid() for line in axes.lines} == {"energy"}
    with pytest.raises(ValueError, match="no series reversals; choose spin, contact_x"):
        picture.plot(made([60]), "reversals")


def test_samples_are_lines_of_the_spin_alone() -> None:
    samples = made([60] * 20, n0=np.linspace(0.01, 0.08, 20)).assign_coords(sample=("trajectory", np.arange(20)))
    figure = picture.plot(samples)
    (axes,) = figure.axes
    assert sum(line.get_gid() == "spin" for line in axes.lines) == 20
    assert entries(figure)[12] == "and 8 more"


def test_the_time_axis_ends_a_while_after_the_last_event() -> None:
    turning, still = made([60, 100]), made([60])
    time = turning["time"]
    turning["ripple_free_spin"] = xr.DataArray([8.25, 17.75], dims="trajectory") - time
    turning.attrs |= {"model_brings": "a model"}
    for dataset, end in ((turning, 1.4 * 17.75), (still, 100)):
        for axes in picture.plot(dataset).axes:
            assert axes.get_xlim() == (0, pytest.approx(end))
            assert axes.get_xlabel() in ("", "time t (√(c/g))")
    turning["status"][1] = TIME_LIMIT  # its next reversal may be about to come
    assert picture.plot(turning).axes[0].get_xlim() == (0, 100)


def test_a_trajectory_backwards_in_time_is_the_same_picture() -> None:
    dataset = made([60])
    dataset["ripple_free_spin"] = dataset["spin"]
    forwards, backwards = (picture.plot(each).axes[0] for each in (dataset, dataset.isel(time=slice(None, None, -1))))
    drawn = [[line.get_xydata().tolist() for line in axes.lines] for axes in (forwards, backwards)]
    assert drawn[0] == drawn[1]
    assert 3 in map(len, drawn[0])  # the marks of three reversals


def test_a_single_instant_has_an_axis() -> None:
    """That of a body which fails at once, for example."""
    figure = picture.plot(made([60]).isel(time=[0]))
    low, high = figure.axes[0].get_xlim()
    assert low == 0 < high


def test_a_column_shows_the_spin_alone() -> None:
    figure = picture.plot(made([60, 100]), width="85mm")
    (axes,) = figure.axes
    assert {"spin"} <= {line.get_gid() for line in axes.lines}
    assert figure.get_figheight() * 25.4 < 130


def output_of(verb: str, config: Path, *options: str) -> tuple[Path, str]:
    """The file that a command writes, of which `plot` draws the same picture, and what `info` says of it."""
    file = config.with_name(f"small_{verb}.nc")
    assert invoke(verb, config, *options, "--output", config.parent).exit_code == 0
    drawn = file.with_suffix(".png").read_bytes()
    file.with_suffix(".png").unlink()
    assert invoke("plot", file).exit_code == 0
    assert file.with_suffix(".png").read_bytes() == drawn
    assert open_dataset(file).attrs["sweep_kind"] == verb
    return file, invoke("info", file).stdout


def test_plot_and_info_know_the_file_of_a_trajectory(write: Write) -> None:
    file, printed = output_of("trajectory", write(), "--at", "mu=60", "--at", "mu=75", "--set", "t_end=50")
    assert "2 trajectories" in printed
    assert "mu = 75, n0 = 0.02, x0 = 0.01, y0 = 0.01: time_limit at t = 50, 0 reversals" in printed
    refused(invoke("plot", file, "--x", "mu"), "not for a figure of single trajectories")


def test_plot_and_info_know_the_file_of_critical_spins(write: Write) -> None:
    settings = ("--set", "b=3", "--set", "mu=[0,60]", "--set", "n0=0.02", "--bracket", "0.1")
    file, printed = output_of("critical", write(), *settings)
    assert "critical spins of 2 bodies (mu 2)" in printed
    assert "n_c1, positive spin: 1 no friction, 1 found; 0.0024" in printed
    assert invoke("plot", file, "--variable", "n_c2_simulated").exit_code == 0
    figure = picture.plot(file)
    assert sum(line.get_gid() in VARIABLES for line in figure.axes[0].lines if line.get_gid()) == 8
    assert not figure.axes[0].get_legend()
    assert "simulation" in entries(figure)


@pytest.mark.parametrize("verb", ["plot", "info"])
def test_a_file_of_predictions_is_known(verb: str, small: xr.Dataset, tmp_path: Path) -> None:
    small[["reversals_predicted", "form_factor"]].to_netcdf(tmp_path / "p.nc")
    assert invoke(verb, tmp_path / "p.nc").exit_code == 0


def test_the_legend_of_a_users_model_has_a_name() -> None:
    """Also of a single trajectory, whose parameters may have any names."""
    one = made([60.0]).assign_attrs(model_brings="a model", model_parameters="mu").drop_vars(["n0"], errors="ignore")
    words = entries(picture.plot(one))
    assert words[0].startswith("spin n")
    assert all(words)

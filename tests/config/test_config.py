"""What a configuration says, how it is read, and which model runs it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas
import pytest
import xarray as xr
from hypothesis import assume, given
from hypothesis import strategies as st
from support import SMALL, Write
from support.physics import STONE, stone

import sweep
from sweep import Config, InputError, load_config
from sweep.config.document import dump
from sweep.config.values import Range


def test_axes_are_mu_b_n0_then_as_written(write: Write) -> None:
    text = (
        SMALL.replace("delta: 0.03", "delta: [0.02, 0.03]").replace("10.0", "[9, 10]").replace("x0: 0.01", "x0: [0, 1]")
    )
    assert list(load_config(write(text)).axes) == ["mu", "b", "n0", "a", "delta", "x0"]


def test_yaml_numbers_mean_what_they_look_like(write: Write) -> None:
    config = load_config(write(SMALL.replace("[40, 60]", "[1e1, 2.5E1, +3., 012]").replace("x0: 0.01", "x0: -1e-3")))
    assert config.parameters["mu"].numbers == (10.0, 25.0, 3.0, 12.0)
    assert config.parameters["x0"].numbers == (-0.001,)


def test_defaults_are_the_papers_standard_case(write: Write) -> None:
    config = load_config(write("friction: {mu: 60}\n", "plain.yaml"))
    assert config.name == "plain"
    assert {name: v.numbers for name, v in config.parameters.items()} == {
        "mu": (60.0,), "b": (3.0,), "n0": (0.05,), "a": (10.0,), "c": (1.0,), "delta": (0.03,),
        "x0": (0.01,), "y0": (0.01,),
    }  # fmt: skip
    assert (config.integrator.t_end, config.integrator.stop_early) == (1e6, 30_000)
    assert config.measure == ("reversals", "energy_error", "resting_spin", "margin")


def test_fingerprint_sees_what_decides_the_numbers(write: Write) -> None:
    first = load_config(write()).fingerprint()
    for same in ({"name": "other"}, {"max_failed_fraction": 0.5}, {"delta": 0.03}):
        assert load_config(write(), same).fingerprint() == first
    for other in ({"mu": [40, 61]}, {"t_end": 1501}, {"step": 0.01}, {"measure": ["reversals"]}, {"y0": 0.02}):
        assert load_config(write(), other).fingerprint() != first


def test_a_dataset_is_refused_as_a_configuration(small: xr.Dataset) -> None:
    with pytest.raises(InputError, match=r"^this is a dataset, not a configuration"):
        sweep.trajectory(small, at={"mu": 40})


@pytest.mark.parametrize("table", [dict, pandas.DataFrame])
def test_cases_given_by_columns(table: Callable[..., Any]) -> None:
    columns = {"mu": np.array([60.0, 130.0]), "n0": [0.05, -0.02]}
    config = load_config({"start": {"x0": 0.01}}, {"cases": table(columns)})
    assert config.cases == {"mu": (60.0, 130.0), "n0": (0.05, -0.02)}
    assert load_config(config, {"t_end": 50.0}).cases == config.cases
    other = load_config({"start": {"x0": 0.01}}, {"cases": {"mu": [60.0, 131.0], "n0": [0.05, -0.02]}})
    assert other.fingerprint() != config.fingerprint()
    assert load_config({"start": {"x0": 0.01}, "cases": columns}).fingerprint() == config.fingerprint()
    assert len(config.label()) < len(dump(config.document()))


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"muu": [1.0]}, "cases.muu: unknown parameter (did you mean mu?)"),
        ({"mu": [1.0], "n0": [1.0, 2.0]}, "cases: its columns must be lists of the same length"),
        ({"mu": [1.0], "n0": 0.05}, "cases.n0: must be a list of numbers, not 0.05"),
        ({"mu": [1.0, "two"]}, "cases.mu[1]: must be a finite number >= 0"),
    ],
)
def test_wrong_columns_of_cases_are_refused(columns: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as refusal:
        load_config({"cases": columns})
    assert said in str(refusal.value)
    assert len(refusal.value.faults) == 1


@given(
    start=st.floats(-1e6, 1e6),
    stop=st.floats(-1e6, 1e6),
    num=st.integers(2, 50),
    finer=st.integers(1, 12),
    spacing=st.sampled_from(["linear", "log"]),
)
def test_a_finer_range_has_the_values_of_a_coarser_one(
    start: float, stop: float, num: int, finer: int, spacing: str
) -> None:
    assume(spacing == "linear" or start * stop > 0)
    coarse, fine = (
        Range(start=start, stop=stop, num=n, spacing=spacing).values() for n in (num, finer * (num - 1) + 1)
    )
    assert coarse == fine[::finer]
    assert (coarse[0], coarse[-1]) == (start, stop)
    spaced = np.linspace if spacing == "linear" else np.geomspace
    np.testing.assert_allclose(coarse, spaced(start, stop, num), rtol=1e-11, atol=1e-9 if spacing == "linear" else 0)


Read = Callable[[str], Config]
BOWL = stone(("{a: 0.2, b: 0.03", "{surface: paraboloid, a: 0.01, b: 0.4"))


@pytest.fixture
def read(write: Write) -> Read:
    """Loads a configuration of this text."""
    return lambda text: load_config(write(text))


def test_a_real_body(read: Read) -> None:
    config = read(STONE)
    assert config.equations.name == "slip+coulomb+sigma+offset+gravity"
    assert set(config.parameters) == set(config.tier.parameters)
    columns = config.grid.columns()
    assert columns["roll"] == pytest.approx(np.pi / 360)
    assert config.integrator.method == "dopri5"
    assert config.described("mu") == {"long_name": "friction μ", "description": "Coefficient of friction."}
    assert config.described("speed")["units"] == "m s-1"
    assert config.described("Ixy")["units"] == "kg m2"


def test_what_the_numbers_of_a_paraboloid_mean(read: Read) -> None:
    config = read(BOWL)
    assert config.equations.name == "slip+coulomb+sigma+gravity+paraboloid"
    assert config.described("a") == {
        "long_name": "coefficient a of the paraboloid",
        "description": "The paraboloid is z = c (1 - a (x/c)^2 - b (y/c)^2).",
    }
    assert config.described("c")["units"] == config.described("offset")["units"] == "m"
    # A paraboloid has no outline: every contact point lies on it.
    text = "body: {surface: paraboloid, a: 0.1, b: 0.2, Ixx: 1, Iyy: 1, Izz: 1}\nfriction: {mu: 1}\nstart: {x0: 30}"
    assert read(text).axes == {}


GRAVITY = STONE.replace("gravity: 9.81\n", "") + "gravity: [9.8, 9.9]\n"
UNCERTAIN = "start: {x0: {uniform: [0, 0.02]}}\nbody: {c: {normal: [1, 0.01]}}\nfriction: {mu: 60}\nsamples: 4\n"
FIRST = (
    "start: {x0: {uniform: [0, 0.02]}, n0: {uniform: [0.05, 0.06]}}\nfriction: {mu: {uniform: [50, 60]}}\nsamples: 4\n"
)
ROWS = "cases: {mu: [60, 130], roll: [2 deg, 0.01]}\n"


@pytest.mark.parametrize(
    "text",
    [SMALL, STONE, BOWL, GRAVITY.replace("sigma: 1.0e-4", "sigma: [0, 1.0e-4]"), UNCERTAIN, FIRST, ROWS],
    ids=["paper", "ellipsoid", "paraboloid", "axis of gravity", "samples", "samples of first axes", "columns of cases"],
)
def test_a_configuration_survives_its_own_document(text: str, read: Read) -> None:
    config = read(text)
    again = read(dump(config.document()))
    assert again == config
    assert again.fingerprint() == config.fingerprint()
    assert again.tier == config.tier


BEYOND = {
    "": "slip",
    "body: {offset: 0.1}": "slip+viscous+offset",
    "body: {Ixx: 2, Iyy: 20, Izz: 21, Ixy: -0.3}": "slip",
    "body: {Ixx: 2, Iyy: 20, Izz: 21, Iyz: -0.3}": "slip+viscous+skew",
    "friction: {mu: 10, sigma: 0.1}": "slip+viscous+sigma",
    "start: {omega1: 0.1}": "slip",
    "friction: {law: none}": "slip+none",
    "friction: {law: coulomb, mu: 0.2, speed: 0.01}": "slip+coulomb",
    "model: noslip\nbody: {offset: 0.1}": "noslip+solid+offset",
    "friction: {mu: 6, sigma: 0.1, mu_spinning: 0.1, radius_spinning: 0.1, speed_spinning: 0.1}":
        "slip+viscous+sigma+spinning",
    "friction: {law: contensou, mu: 0.3, radius_contact: 0.01, speed: 0.01}": "slip+contensou",
    "model: noslip\nbody: {surface: paraboloid, a: 0.1, b: 0.2, Ixx: 1, Iyy: 1, Izz: 1}": "noslip+solid+paraboloid",
    "model: noslip\nfriction: {mu: 3, mu_rolling: 0.1, radius: 0.1, speed_rolling: 0.1}": "noslip+solid+rolling",
}  # fmt: skip
"""What a configuration says beyond the paper, and the model that runs it."""


@pytest.mark.parametrize("beyond", BEYOND)
def test_the_paper_s_model_runs_what_it_knows(beyond: str, read: Read) -> None:
    text = beyond if "friction" in beyond else f"{beyond}\nfriction: {{mu: 60}}"
    assert read(text).tier.name == BEYOND[beyond]


def test_the_default_time_of_bodies_in_si(read: Read) -> None:
    """The paper's 30000 sqrt(c/g), rounded up to hundreds of seconds: that of `stop_early` with viscous friction."""
    config = read(stone(("integrator: {t_end: 5}\n", ""), ("c: 0.02", "c: [0.01, 0.02]")))
    assert config.integrator.t_end == 1400
    assert 1300 < 30_000 * np.sqrt(0.02 / 9.81) < 1400
    assert read(config.label()) == config
    estimated = read("body: {offset: 0.1, c: 0.5}\nfriction: {mu: 6}").integrator
    assert (estimated.stop_early, estimated.t_end) == (30_000, 1e6)
    toy = "units: SI\nbody: {a: 0.1, b: 0.03, c: 0.02, mass: 1, Ixx: 2e-4, Iyy: 1e-3, Izz: 1e-3}\nfriction: {mu: 30}\n"
    estimated = read(toy + "start: {n0: 1, x0: 1e-3, y0: 1e-3}").integrator
    assert (estimated.stop_early, estimated.t_end) == (1400, 45_200)
    assert 45_100 < 1e6 * np.sqrt(0.02 / 9.81) < 45_200
    assert read(STONE).integrator.t_end == 5

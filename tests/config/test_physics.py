"""Bodies, friction and starts beyond the paper: the model that runs them, their units and what their numbers mean."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support import SMALL
from support.physics import STONE, stone

from sweep.config import Config, load_config

Read = Callable[[str], Config]
BOWL = stone(("{a: 0.2, b: 0.03", "{surface: paraboloid, a: 0.01, b: 0.4"))


@pytest.fixture
def read(write: Callable[..., Path]) -> Read:
    """Loads a configuration of this text."""
    return lambda text: load_config(write(text))


def test_a_real_body(read: Read) -> None:
    config = read(STONE)
    assert config.equations.name == "slip+coulomb-tanh+sigma"
    assert set(config.parameters) == set(config.tier.parameters)
    columns = config.grid.columns()
    assert columns["roll"] == pytest.approx(np.pi / 360)
    assert config.integrator.method == "dopri5"
    assert config.described("mu") == {"long_name": "friction μ", "description": "Coefficient of friction."}
    assert config.described("speed")["units"] == "m s-1"
    assert config.described("Ixy")["units"] == "kg m2"


def test_what_the_numbers_of_a_paraboloid_mean(read: Read) -> None:
    config = read(BOWL)
    assert config.equations.name == "slip+coulomb-tanh+sigma+paraboloid"
    assert config.described("a") == {
        "long_name": "coefficient a of the paraboloid",
        "description": "The paraboloid is z = c (1 - a (x/c)^2 - b (y/c)^2).",
    }
    assert config.described("c")["units"] == config.described("offset")["units"] == "m"
    # A paraboloid has no outline: every contact point lies on it.
    text = "body: {surface: paraboloid, a: 0.1, b: 0.2, Ixx: 1, Iyy: 1, Izz: 1}\nfriction: {mu: 1}\nstart: {x0: 30}"
    assert read(text).axes == {}


@pytest.mark.parametrize("text", [SMALL, STONE, BOWL], ids=["paper", "ellipsoid", "paraboloid"])
def test_it_survives_its_own_document(text: str, read: Read) -> None:
    config = read(text)
    again = read(config.to_yaml())
    assert again == config
    assert again.fingerprint() == config.fingerprint()
    assert again.tier == config.tier


BEYOND = {
    "": "slip",
    "body: {offset: 0.1}": "slip+viscous",
    "body: {Ixx: 2, Iyy: 20, Izz: 21, Ixy: -0.3}": "slip+viscous",
    "friction: {mu: 10, sigma: 0.1}": "slip+viscous+sigma",
    "start: {omega1: 0.1}": "slip+viscous",
    "friction: {law: none}": "slip+none",
    "friction: {law: coulomb, mu: 0.2, speed: 0.01}": "slip+coulomb-sqrt",
    "model: noslip\nbody: {offset: 0.1}": "noslip+solid",
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


def test_angles_in_degrees_anywhere(read: Read) -> None:
    config = read(stone(("0.5 deg, pitch: 0.5 deg", "[0.5 deg, 0.02], pitch: {start: 0, stop: 1 deg, num: 3}")))
    assert config.axes["roll"] == (pytest.approx(np.pi / 360), 0.02)
    assert config.axes["pitch"] == pytest.approx((0, np.pi / 360, np.pi / 180))
    assert load_config(config, {"roll": "2 deg"}).parameters["roll"].numbers == (pytest.approx(np.pi / 90),)


def test_the_default_time_of_bodies_in_si(read: Read) -> None:
    """It is the paper's, 30000 sqrt(c/g), rounded up to hundreds of seconds."""
    config = read(stone(("integrator: {t_end: 5}\n", ""), ("c: 0.02", "c: [0.01, 0.02]")))
    assert config.integrator.t_end == 1400
    assert 1300 < 30_000 * np.sqrt(0.02 / 9.81) < 1400
    assert read(config.to_yaml()) == config
    assert read("body: {offset: 0.1, c: 0.5}\nfriction: {mu: 6}").integrator.t_end == 30_000
    assert read(STONE).integrator.t_end == 5

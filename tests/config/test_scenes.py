"""Bodies, friction and starts beyond the paper: which of them make a scene, in what units, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.config import Config, ConfigError, load_config
from sweep.grid import Grid

STONE = """\
model: slip
units: SI
gravity: 9.81
body: {a: 0.2, b: 0.03, c: 0.02, offset: 0.01, mass: 1.0, Ixx: 2.0e-4, Iyy: 1.6e-3, Izz: 1.7e-3, Ixy: -2.0e-5}
friction: {law: coulomb, mu: 0.5, regularisation: tanh, speed: 1.0e-3, sigma: 1.0e-4}
start: {roll: 0.5 deg, pitch: 0.5 deg, omega1: 0, omega2: 0, omega3: -5, slip1: 0, slip2: 0}
integrator: {t_end: 5}
"""


def stone(*changes: tuple[str, str]) -> str:
    text = STONE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def read(tmp_path: Path, text: str) -> Config:
    file = tmp_path / "stone.yaml"
    file.write_text(text, encoding="utf-8")
    return load_config(file)


ELEMENTS = "Ixx: 2.0e-4, Iyy: 1.6e-3, Izz: 1.7e-3, Ixy: -2.0e-5"

BROKEN: dict[str, tuple[str, int, str, str]] = {
    "longest moment too large": (stone(("1.7e-3", "1.9e-3")), 4, "body", "no principal moment above the sum"),
    "a product that is too large": (stone(("Ixy: -2.0e-5", "Ixy: 6.0e-4")), 4, "body", "not positive definite"),
    "a product that breaks the triangle": (stone(("Ixy: -2.0e-5", "Ixy: 5.0e-4")), 4, "body", "no body has such"),
    "a negative moment": (stone(("Ixx: 2", "Ixx: -2")), 4, "body.Ixx", "-0.0002 is out of bounds"),
    "no mass": (stone(("mass: 1.0", "mass: 0")), 4, "body.mass", "0 is out of bounds"),
    "mass left out": (stone((" mass: 1.0,", "")), 4, "body.mass", "missing"),
    "a moment left out": (stone((" Iyy: 1.6e-3,", "")), 4, "body.Iyy", "missing"),
    "centre of mass outside": (stone(("offset: 0.01", "offset: 0.03")), 4, "body", "|offset| < c at a=0.2"),
    "centre of mass above the top": (stone(("offset: 0.01", "offset: -0.02")), 4, "body", "centre of mass outside"),
    "upright rest unstable": (
        stone(("b: 0.03", "b: 0.012"), ("offset: 0.01", "offset: 0.002")), 4, "body", "upright rest is unstable"
    ),
    "all of an axis unstable": (
        stone(("b: 0.03", "b: [0.01, 0.012]"), ("offset: 0.01", "offset: 0.002")), 4, "body",
        "offset > c - b²/c at a=0.2, b=0.01",
    ),
    "delta beside the inertia": (stone(("offset", "delta: 0.03, offset")), 4, "body.delta", "delta or the elements"),
    "neither delta nor inertia": (stone((f", {ELEMENTS}", "")), 4, "body.delta", "missing"),
    "mass in the paper's units": (
        stone(("units: SI\ngravity: 9.81\n", "")), 2, "body.mass", "with units: paper, in which it is 1"
    ),
    "gravity in the paper's units": (
        stone(("units: SI", "units: paper"), (" mass: 1.0,", "")), 3, "gravity", "with units: paper, in which it is 1"
    ),
    "no gravity": (stone(("9.81", "0")), 3, "gravity", "0 is out of bounds; allowed: a finite number > 0"),
    "other units": (stone(("SI", "cgs")), 2, "units", "'cgs'; allowed: paper, SI"),
    "an unknown law": (stone(("coulomb", "coulumb")), 5, "friction.law", "did you mean coulomb?"),
    "a speed without Coulomb's law": (
        stone(("law: coulomb, ", "law: viscous, "), ("regularisation: tanh, ", "")), 5, "friction.speed",
        "not of the law viscous",
    ),
    "a regularisation without Coulomb's law": (
        stone(("law: coulomb", "law: none"), ("speed: 1.0e-3, ", "")), 5, "friction.regularisation",
        "not of the law none",
    ),
    "a speed left out": (stone((" speed: 1.0e-3,", "")), 5, "friction.speed", "missing"),
    "no speed": (stone(("speed: 1.0e-3", "speed: 0")), 5, "friction.speed", "0 is out of bounds"),
    "half of spinning friction": (
        stone(("sigma: 1.0e-4", "mu_spinning: 0.1, radius_spinning: 1.0e-3")), 5, "friction.speed_spinning", "missing"
    ),
    "a contact without a radius": (
        stone(("law: coulomb", "law: contensou"), ("regularisation: tanh, ", "")), 5, "friction.radius_contact",
        "missing",
    ),
    "half of rolling friction": (stone(("sigma: 1.0e-4", "mu_rolling: 0.1")), 5, "friction.radius", "missing"),
    "two starts": (stone(("slip1: 0,", "n0: 1,")), 6, "start.n0", "beside omega1, omega2, omega3, pitch, roll, slip2"),
    "an angle in minutes": (stone(("roll: 0.5 deg", "roll: 30 min")), 6, "start.roll", "'30 min' is not a number"),
    "upside down": (stone(("roll: 0.5 deg", "roll: 91 deg")), 6, "start.roll", "out of bounds"),
    "another surface": (stone(("{a:", "{surface: cone, a:")), 4, "body.surface", "'cone'; allowed: ellipsoid, parab"),
    "a homogeneous paraboloid": (
        stone(("{a: 0.2", "{surface: paraboloid, delta: 0, a: 0.01"), (f", {ELEMENTS}", "")), 4, "body.delta",
        "with surface: paraboloid; allowed: the elements",
    ),
    "a paraboloid without inertia": (
        stone(("{a: 0.2", "{surface: paraboloid, a: 0.01"), (f", {ELEMENTS}", "")), 4, "body.Ixx", "missing"
    ),
    "a paraboloid of no curvature": (
        "body: {surface: paraboloid, b: 0.2, Ixx: 1, Iyy: 1, Izz: 1}\nfriction: {mu: 1}", 1, "body.a", "missing"
    ),
    "a paraboloid with the mass below it": (
        stone(("{a: 0.2", "{surface: paraboloid, a: 0.01"), ("offset: 0.01", "offset: 0.02")), 4, "body",
        "centre of mass outside the paraboloid; allowed: offset < c at a=0.01",
    ),
    "a paraboloid that is too pointed": (
        stone(("{a: 0.2", "{surface: paraboloid, a: 1.1")), 4, "body", "upright rest is unstable"
    ),
    "a paraboloid in a paper's model": (
        stone(("model: slip", "model: averaged"), ("{a:", "{surface: paraboloid, a:")), 1, "model",
        "surface: paraboloid; allowed: slip, noslip",
    ),
    "a model of the paper's body": (stone(("model: slip", "model: averaged")), 1, "model", "allowed: slip, noslip"),
    "the method of the paper's models": (
        STONE.replace("t_end: 5", "t_end: 5, method: adams"), 7, "integrator.method", "allowed: dopri5, auto"
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", BROKEN)
def test_what_cannot_be_is_refused(kind: str, tmp_path: Path) -> None:
    text, line, path, said = BROKEN[kind]
    with pytest.raises(ConfigError) as error:
        read(tmp_path, text)
    first = str(error.value).splitlines()[0]
    assert first.startswith(f"{tmp_path / 'stone.yaml'}:{line}:")
    assert f": {path}: " in first
    assert said in first


def test_a_real_body(tmp_path: Path) -> None:
    config = read(tmp_path, STONE)
    assert config.equations.name == "slip+coulomb-tanh+sigma"
    assert set(config.parameters) == set(config.tier.parameters)
    columns = Grid.of(config).columns()
    assert columns["roll"] == pytest.approx(np.pi / 360)
    assert config.integrator.method == "dopri5"
    assert config.described("mu") == {"long_name": "coefficient of friction", "units": "1"}
    assert config.described("speed")["units"] == "m s-1"
    assert config.described("Ixy")["units"] == "kg m2"


def test_what_the_numbers_of_a_paraboloid_mean(tmp_path: Path) -> None:
    config = read(tmp_path, stone(("{a: 0.2, b: 0.03", "{surface: paraboloid, a: 0.01, b: 0.4")))
    assert config.equations.name == "slip+coulomb-tanh+sigma+paraboloid"
    assert config.described("a") == {
        "long_name": "coefficient a of the paraboloid z = c (1 - a (x/c)^2 - b (y/c)^2)", "units": "1"
    }  # fmt: skip
    assert config.described("c")["units"] == config.described("offset")["units"] == "m"
    # A paraboloid has no outline: every contact point lies on it.
    text = "body: {surface: paraboloid, a: 0.1, b: 0.2, Ixx: 1, Iyy: 1, Izz: 1}\nfriction: {mu: 1}\nstart: {x0: 30}"
    assert read(tmp_path, text).axes == {}


@pytest.mark.parametrize("changes", [(), (("{a: 0.2, b: 0.03", "{surface: paraboloid, a: 0.01, b: 0.4"),)])
def test_a_scene_survives_its_own_document(changes: tuple[tuple[str, str], ...], tmp_path: Path) -> None:
    config = read(tmp_path, stone(*changes))
    again = read(tmp_path, config.to_yaml())
    assert again.to_yaml() == config.to_yaml()
    assert again.fingerprint() == config.fingerprint()
    assert again.tier == config.tier


@pytest.mark.parametrize(
    ("beyond", "name"),
    [
        ("", "slip"),
        ("body: {offset: 0.1}", "slip+viscous"),
        ("body: {Ixx: 2, Iyy: 20, Izz: 21, Ixy: -0.3}", "slip+viscous"),
        ("friction: {mu: 10, sigma: 0.1}", "slip+viscous+sigma"),
        ("start: {omega1: 0.1}", "slip+viscous"),
        ("friction: {law: none}", "slip+none"),
        ("friction: {law: coulomb, mu: 0.2, speed: 0.01}", "slip+coulomb-sqrt"),
        ("model: noslip\nbody: {offset: 0.1}", "noslip+solid"),
        (
            "friction: {mu: 6, sigma: 0.1, mu_spinning: 0.1, radius_spinning: 0.1, speed_spinning: 0.1}",
            "slip+viscous+sigma+spinning",
        ),
        ("friction: {law: contensou, mu: 0.3, radius_contact: 0.01, speed: 0.01}", "slip+contensou"),
        (
            "model: noslip\nbody: {surface: paraboloid, a: 0.1, b: 0.2, Ixx: 1, Iyy: 1, Izz: 1}\nfriction: {mu: 3}",
            "noslip+solid+paraboloid",
        ),
        ("model: noslip\nfriction: {mu: 3, mu_rolling: 0.1, radius: 0.1, speed_rolling: 0.1}", "noslip+solid+rolling"),
    ],
)
def test_the_paper_s_model_runs_what_it_knows(beyond: str, name: str, tmp_path: Path) -> None:
    text = beyond if "mu:" in beyond or "none" in beyond else f"{beyond}\nfriction: {{mu: 60}}"
    assert read(tmp_path, text).tier.name == name


def test_angles_in_degrees_anywhere(tmp_path: Path) -> None:
    config = read(
        tmp_path, stone(("0.5 deg, pitch: 0.5 deg", "[0.5 deg, 0.02], pitch: {start: 0, stop: 1 deg, num: 3}"))
    )
    assert config.axes["roll"] == (pytest.approx(np.pi / 360), 0.02)
    assert config.axes["pitch"] == pytest.approx((0, np.pi / 360, np.pi / 180))
    assert load_config(config, {"roll": "2 deg"}).parameters["roll"].numbers == (pytest.approx(np.pi / 90),)


def test_the_default_time_of_bodies_in_si(tmp_path: Path) -> None:
    """It is the paper's, 30000 sqrt(c/g), rounded up to hundreds of seconds."""
    config = read(tmp_path, stone(("integrator: {t_end: 5}\n", ""), ("c: 0.02", "c: [0.01, 0.02]")))
    assert config.integrator.t_end == 1400
    assert 1300 < 30_000 * np.sqrt(0.02 / 9.81) < 1400
    assert read(tmp_path, config.to_yaml()) == config
    assert read(tmp_path, "body: {offset: 0.1, c: 0.5}\nfriction: {mu: 6}").integrator.t_end == 30_000
    assert read(tmp_path, STONE).integrator.t_end == 5

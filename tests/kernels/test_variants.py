"""Kernels of variants: their trajectories against SciPy's, their energy, and the steps that they take."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support import newton

import sweep
from sweep.config import load_config
from sweep.models.model import Model, stack

BODY = "{a: 0.2, b: 0.03, c: 0.02, offset: 0.01, mass: 1.0, Ixx: 2.0e-4, Iyy: 1.6e-3, Izz: 1.7e-3, Ixy: -2.0e-5}"
UNIT = np.sqrt(9.81 / 0.02)
"""sqrt(g/c) in radians per second."""

SLIPPING = f"""\
units: SI
gravity: 9.81
body: {BODY}
friction: {{law: coulomb, mu: [0.2, 0.5], regularisation: tanh, speed: 0.02, sigma: 1.0e-4}}
start: {{roll: 0.5 deg, pitch: 1 deg, omega3: [-5, 5], slip1: 0.05, slip2: -0.1}}
integrator: {{t_end: 0.5, step: auto}}
"""
ROLLING = f"""\
model: noslip
units: SI
gravity: 9.81
body: {BODY}
friction: {{sigma: [0, 1.0e-4]}}
start: {{roll: 0.5 deg, pitch: 0.5 deg, omega3: [-5, 5]}}
integrator: {{t_end: 20}}
measure: [reversals, first_reversal, energy_error]
"""


def run(folder: Path, text: str, **settings: object) -> xr.Dataset:
    file = folder / "scene.yaml"
    file.write_text(text, encoding="utf-8")
    return sweep.run(load_config(file, settings))


def against_newton(
    folder: Path, result: xr.Dataset, cells: Iterable[int], law: str = "viscous", atol: float = 1e-9, **more: str
) -> tuple[Model, dict[str, np.ndarray], np.ndarray]:
    """Compare the spins of some cells with those of an independent derivation and integrator.

    Returns the model, the parameters and the start of the scene.
    """
    config = load_config(folder / "scene.yaml")
    columns, model = dict(config.grid.columns()), config.equations
    start, result = stack(model.start(columns)), result.stack(cell=result["spin_final"].dims)
    for i in cells:
        parameters = {name: float(values[i]) for name, values in columns.items()} | more
        end = newton.follow(start[:, i], parameters, law, np.array([0, float(result["t_stop"][i])]))[:, -1]
        spin = end[2:5] @ [end[0], end[1], -np.sqrt(1 - end[0] ** 2 - end[1] ** 2)]
        assert float(result["spin_final"][i]) == pytest.approx(spin, abs=atol * UNIT)
    return model, columns, start


@pytest.mark.campaign
def test_slipping_and_its_energy_against_an_independent_integrator(tmp_path: Path) -> None:
    result = run(tmp_path, SLIPPING)
    model, *_ = against_newton(tmp_path, result, (0, 3), "coulomb-tanh")
    assert model.name == "slip+coulomb-tanh+sigma"
    assert float(result["energy_error"].max()) < 1e-7


def test_kane_and_levinson_by_the_kernel(tmp_path: Path) -> None:
    """The averaged spin reverses within a period of the rattle of the published times."""
    result = run(tmp_path, ROLLING)
    published = {(0, -5): 2.855, (1e-4, -5): 2.556, (0, 5): 11.53}
    for (sigma, omega3), time in published.items():
        at = result.sel(sigma=sigma, omega3=omega3)
        assert float(at["t_first_reversal"]) == pytest.approx(time, abs=0.19)
    assert int(result["reversals"].sel(sigma=1e-4, omega3=5)) == 0
    assert result["status"].sel(sigma=0).values.tolist() == [2, 2]
    assert result["status"].sel(sigma=1e-4).values.tolist() == [1, 1]
    assert float(result["energy_error"].max()) < 1e-7


def in_units(scene: dict[str, Any], c: float, g: float, m: float) -> dict[str, Any]:
    """A scene of the paper's units in SI, for a body of this height, mass and gravity."""
    time, scales = np.sqrt(c / g), dict.fromkeys(("a", "b", "c", "offset"), c)
    scales |= dict.fromkeys(("Ixx", "Iyy", "Izz", "Ixy"), m * c**2) | {"speed": c / time, "sigma": m * c**2 / time}
    scales |= {"omega3": 1 / time, "slip1": c / time, "slip2": c / time, "t_end": time}

    def scaled(value: Any, name: str) -> Any:
        if isinstance(value, dict):
            return {key: scaled(item, key) for key, item in value.items()}
        return [scaled(item, name) for item in value] if isinstance(value, list) else value * scales.get(name, 1.0)

    sections = ("body", "friction", "start", "integrator")
    words = {"law", "regularisation", "step"}
    found = {k: v if k not in sections else {n: w if n in words else scaled(w, n) for n, w in v.items()}
             for k, v in scene.items()}  # fmt: skip
    found["body"]["mass"] = m
    return found | {"units": "SI", "gravity": g}


NATURAL = {
    "body": {"a": 10.0, "b": 1.5, "c": 1.0, "offset": 0.5, "Ixx": 0.5, "Iyy": 4.0, "Izz": 4.25, "Ixy": -0.05},
    "start": {"roll": 0.01, "pitch": 0.02, "omega3": [-0.2258, 0.2258]},
    "integrator": {"t_end": 44.3, "step": "auto"},
}
ROLLING_NATURALLY = NATURAL | {
    "model": "noslip", "friction": {"sigma": [0.0, 0.0113]}, "measure": ["reversals", "first_reversal", "energy_error"],
}  # fmt: skip
SLIPPING_NATURALLY = NATURAL | {
    "friction": {"law": "coulomb", "mu": [0.2, 0.5], "regularisation": "tanh", "speed": 0.045, "sigma": 0.0113},
    "start": NATURAL["start"] | {"slip1": 0.1, "slip2": -0.2},
}
"""Scenes of the kernels that other tests of this file run, in the paper's units."""


@pytest.mark.parametrize(
    "scene",
    [ROLLING_NATURALLY, pytest.param(SLIPPING_NATURALLY, marks=pytest.mark.campaign)],
    ids=["noslip", "slip"],
)
def test_units_make_no_difference(scene: dict[str, Any]) -> None:
    """Units that are powers of two change no bit but the exponents: no number of the code has a hidden unit.

    Other units round every parameter.  As the motion magnifies a relative change by less than one here, up to 1e-14 is
    left of that.
    """
    natural = sweep.run(scene)
    for (c, g, m), largest in (((2.0**-6, 2.0**4, 2.0**-3), 0.0), ((0.02, 9.81, 0.7), 1e-14)):
        time = np.sqrt(c / g)
        si = sweep.run(in_units(scene, c, g, m))
        np.testing.assert_allclose(si["spin_final"] * time, natural["spin_final"], rtol=0, atol=largest)
        np.testing.assert_allclose(si["step"] / time, natural["step"], rtol=largest)
        np.testing.assert_allclose(si["energy_error"], natural["energy_error"], rtol=0, atol=10 * largest)
        for name in ("reversals", "status", "step_rule"):
            np.testing.assert_array_equal(si[name], natural[name])
    assert si["spin_final"].attrs["units"] == "radian s-1"
    assert natural["spin_final"].attrs.get("units") is None


@pytest.mark.parametrize("more", ["law: viscous", "offset: 0", "units: paper"])
def test_bodies_that_need_no_variant_are_bit_for_bit_as_they_were(tmp_path: Path, more: str) -> None:
    """Naming the default of what is new changes nothing."""
    plain = "body: {b: [3, 5]}\nfriction: {mu: 60}\nintegrator: {t_end: 300, method: dopri5}\n"
    places = {"law": ("{mu", f"{{{more}, mu"), "offset": ("{b", f"{{{more}, b"), "units": ("body", f"{more}\nbody")}
    named = plain.replace(*places[more.partition(":")[0]])
    assert named != plain
    xr.testing.assert_identical(*(run(tmp_path, text).drop_attrs(deep=False) for text in (plain, named)))


@pytest.mark.campaign
def test_a_body_with_the_mass_at_the_centre_is_the_papers(tmp_path: Path) -> None:
    """The general equations give the paper's trajectories, by another kernel.

    With the same step the difference is round-off.  The automatic steps differ a little, since the bound on the decay
    of the slip is another one; then it is of the size of their errors.
    """
    plain = "body: {b: [3, 5]}\nfriction: {mu: 60}\nintegrator: {t_end: 300, method: dopri5}\n"
    general = plain.replace("[3, 5]", "[3, 5], offset: 1.0e-300")
    for step, largest in ((0.02, 1e-14), ("auto", 1e-8)):
        paper, other = (run(tmp_path, text, step=step) for text in (plain, general))
        np.testing.assert_allclose(other["spin_final"], paper["spin_final"], rtol=0, atol=largest)
        np.testing.assert_array_equal(other["reversals"], paper["reversals"])
        np.testing.assert_allclose(other["t_last_reversal"], paper["t_last_reversal"], rtol=1e-6)
        for name in ("n_c1_plus_linear", "n_c1_minus_linear"):
            np.testing.assert_allclose(other[name], paper[name], rtol=1e-9)


@pytest.mark.campaign
def test_the_stiff_method_takes_any_body_with_viscous_friction(tmp_path: Path) -> None:
    """Against SciPy where friction is weak enough for it, and against dopri5 where steps of adams are far longer."""
    text = SLIPPING.replace("law: coulomb, mu: [0.2, 0.5], regularisation: tanh, speed: 0.02", "mu: [20, 1000]")
    text = text.replace("t_end: 0.5, step: auto", "t_end: 1.5, stop_when_settled: false").replace(
        "slip1: 0.05, slip2: -0.1", "slip1: 0.01"
    )
    text += "measure: [reversals, energy_error]\n"
    stiff = run(tmp_path, text, method="adams")
    against_newton(tmp_path, stiff, [0], atol=1e-8)
    plain = run(tmp_path, text, method="dopri5")
    told, apart = stiff["spin_error"] + plain["spin_error"], abs(stiff["spin_final"] - plain["spin_final"])
    assert float(apart.max()) < 1e-8 * UNIT
    assert float(told.max()) < 3e-8 * UNIT  # one of four is told by its rattle, three times too large
    assert bool((apart < 10 * told).all())
    np.testing.assert_array_equal(stiff["reversals"], plain["reversals"])
    assert float(stiff["energy_error"].max()) < 1e-6
    assert (stiff["step"] > 3 * plain["step"]).sel(mu=1000).all()
    chosen = run(tmp_path, text)
    assert (chosen["method"].sel(mu=1000) == 1).all()


SPINNING = f"""\
units: SI
gravity: 9.81
body: {BODY}
friction: {{mu: 20, mu_spinning: 0.2, radius_spinning: 2.0e-3, speed_spinning: 0.5}}
start: {{roll: [0, 1 deg], pitch: [0, 1 deg], omega3: [-5, 5]}}
integrator: {{t_end: 1}}
"""


@pytest.mark.campaign
def test_spinning_friction_stops_the_spin(tmp_path: Path) -> None:
    """Upright, dry friction takes the same spin in every second; a body that rattles does what Newton and Euler say."""
    short, long = run(tmp_path, SPINNING), run(tmp_path, SPINNING, t_end=60.0)
    model, *_ = against_newton(tmp_path, short, (6, 7))
    assert model.name == "slip+viscous+spinning"
    fall = 0.2 * 2e-3 * 9.81 / 1.7e-3
    upright = {"roll": 0.0, "pitch": 0.0}
    assert float(short["spin_final"].sel(omega3=-5, **upright)) == pytest.approx(5 - fall, abs=1e-10)
    assert float(long["energy_error"].max()) < 1e-7
    # It creeps at the end.
    assert float(np.abs(long["spin_final"]).max()) < 0.1 * 0.5


@pytest.mark.campaign
def test_a_paraboloid_against_an_independent_integrator(tmp_path: Path) -> None:
    """It starts from contact points far up its sides, where it differs from the ellipsoid of the same curvatures."""
    text = f"""\
units: SI
gravity: 9.81
body: {BODY.replace("a: 0.2, b: 0.03", "surface: paraboloid, a: 0.005, b: 0.22")}
friction: {{mu: 20, sigma: 1.0e-4}}
start: {{n0: [-5, 5], x0: 0.04, y0: [0.004, 0.02]}}
integrator: {{t_end: 0.4, method: dopri5}}
"""
    result = run(tmp_path, text)
    model, columns, start = against_newton(tmp_path, result, (0, 3), surface="paraboloid")
    assert model.name == "slip+viscous+sigma+paraboloid"
    assert result.attrs["surface"] == "paraboloid"
    assert "paraboloid" in result["a"].attrs["long_name"]
    for i in range(4):
        parameters = {name: float(values[i]) for name, values in columns.items()} | {"surface": "paraboloid"}
        u = np.array([*start[:2, i], -np.sqrt(1 - start[0, i] ** 2 - start[1, i] ** 2)])
        assert newton.contact(u, parameters)[:2] == pytest.approx([parameters["x0"], parameters["y0"]], rel=1e-12)
    assert float(result["energy_error"].max()) < 1e-7

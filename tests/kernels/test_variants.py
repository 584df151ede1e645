"""Kernels of variants: published times, units, limits that are known, their energy, and the steps that they take."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from support.physics import IN_SI

import sweep

UNIT = np.sqrt(9.81 / 0.02)
"""sqrt(g/c) in radians per second."""


def test_kane_and_levinson_by_the_kernel() -> None:
    """The averaged spin reverses within a period of the rattle of the published times."""
    result = sweep.run(
        IN_SI, model="noslip", sigma=[0, 1e-4], roll="0.5 deg", pitch="0.5 deg", omega3=[-5, 5], t_end=20,
        measure=["reversals", {"reversal_times": 1}, "energy_error"],
    )  # fmt: skip
    published = {(0, -5): 2.855, (1e-4, -5): 2.556, (0, 5): 11.53}
    for (sigma, omega3), time in published.items():
        at = result.sel(sigma=sigma, omega3=omega3)
        assert at["reversal_times"].item() == pytest.approx(time, abs=0.19)
    assert int(result["reversals"].sel(sigma=1e-4, omega3=5)) == 0
    assert result.sweep.time_limit.all()  # also with sigma, which damps the spin faster than the rattle
    assert float(result["energy_error"].max()) < 1e-7


NATURAL = {
    "a": 10.0, "b": 1.5, "c": 1.0, "offset": 0.5, "Ixx": 0.5, "Iyy": 4.0, "Izz": 4.25, "Ixy": -0.05,
    "roll": 0.01, "pitch": 0.02, "omega3": [-0.2258, 0.2258], "t_end": 44.3,
}  # fmt: skip
ROLLING: dict[str, Any] = {"model": "noslip", "measure": ["reversals", {"reversal_times": 1}, "energy_error"]}
ROLLING_NATURALLY = NATURAL | {"sigma": [0.0, 0.0113]}
DRY: dict[str, Any] = {"friction": {"law": "coulomb"}}
SLIPPING_NATURALLY = NATURAL | {"mu": [0.2, 0.5], "speed": 0.045, "sigma": 0.0113, "slip1": 0.1, "slip2": -0.2}
"""Scenes, and their numbers in the paper's units."""


def in_units(numbers: dict[str, Any], c: float, g: float, m: float) -> dict[str, Any]:
    """Numbers of the paper's units in SI, for a body of this height, mass and gravity."""
    time, scales = np.sqrt(c / g), dict.fromkeys(("a", "b", "c", "offset"), c)
    scales |= dict.fromkeys(("Ixx", "Iyy", "Izz", "Ixy"), m * c**2) | {"speed": c / time, "sigma": m * c**2 / time}
    scales |= {"omega3": 1 / time, "slip1": c / time, "slip2": c / time, "t_end": time}
    return {name: np.multiply(value, scales.get(name, 1.0)).tolist() for name, value in numbers.items()} | {"mass": m}


@pytest.mark.parametrize(
    ("scene", "numbers"),
    [(ROLLING, ROLLING_NATURALLY), pytest.param(DRY, SLIPPING_NATURALLY, marks=pytest.mark.campaign)],
    ids=["noslip", "slip"],
)
def test_units_make_no_difference(scene: dict[str, Any], numbers: dict[str, Any]) -> None:
    """Units that are powers of two change no bit but the exponents: no number of the code has a hidden unit.

    Other units round every parameter.  As the motion magnifies a relative change by less than one here, up to 1e-14 is
    left of that.
    """
    natural = sweep.run(scene, **numbers)
    for (c, g, m), largest in (((2.0**-6, 2.0**4, 2.0**-3), 0.0), ((0.02, 9.81, 0.7), 1e-14)):
        time = np.sqrt(c / g)
        si = sweep.run(scene | {"units": "SI", "gravity": g}, **in_units(numbers, c, g, m))
        np.testing.assert_allclose(si["spin_final"] * time, natural["spin_final"], rtol=0, atol=largest)
        for name in {"step", "t_first_reversal_predicted"} & set(natural):
            np.testing.assert_allclose(si[name] / time, natural[name], rtol=largest)
        np.testing.assert_allclose(si["energy_error"], natural["energy_error"], rtol=0, atol=10 * largest)
        for name in ("reversals", "status", "step_rule"):
            np.testing.assert_array_equal(si[name], natural[name])
    assert si["spin_final"].attrs["units"] == "radian s-1"
    assert natural["spin_final"].attrs["units"] == "sqrt(g/c)"


@pytest.mark.parametrize(
    "more", [{"friction": {"mu": 60, "law": "viscous"}}, {"body": {"b": [3, 5], "offset": 0}}, {"units": "paper"}]
)
def test_bodies_that_need_no_variant_are_bit_for_bit_as_they_were(more: dict[str, Any]) -> None:
    """Naming the default of what is new changes nothing."""
    plain = {"body": {"b": [3, 5]}, "friction": {"mu": 60}, "integrator": {"t_end": 300, "method": "dopri5"}}
    xr.testing.assert_identical(*(sweep.run(each).drop_attrs(deep=False) for each in (plain, plain | more)))


@pytest.mark.campaign
def test_the_stiff_method_takes_any_body_with_viscous_friction() -> None:
    """Against dopri5, the steps of which are far shorter at strong friction."""
    scene = IN_SI | {
        "friction": {"mu": [20, 1000]},
        "start": {"roll": "0.5 deg", "pitch": "1 deg", "omega3": [-5, 5], "slip1": 0.01},
        "integrator": {"t_end": 1.5, "stop_early": False},
    }  # fmt: skip
    stiff, plain, chosen = (sweep.run(scene, **method) for method in ({"method": "adams"}, {"method": "dopri5"}, {}))
    estimated, apart = stiff["spin_error"] + plain["spin_error"], abs(stiff["spin_final"] - plain["spin_final"])
    assert float(apart.max()) < 1e-8 * UNIT
    assert float(estimated.max()) < 3e-8 * UNIT  # one of four is estimated from its rattle, three times too large
    assert bool((apart < 10 * estimated).all())
    np.testing.assert_array_equal(stiff["reversals"], plain["reversals"])
    assert float(stiff["energy_error"].max()) < 1e-6
    assert (stiff["step"] > 3 * plain["step"]).sel(mu=1000).all()
    assert (chosen["method"].sel(mu=1000) == 1).all()

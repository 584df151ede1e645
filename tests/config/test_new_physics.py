"""A new surface, law of friction or explicit method is its record alone: all that asks about it finds it there."""

import pytest
from support.processes import python

PROGRAM = """
from dataclasses import replace

import numpy as np
import pytest

from sweep.models.general.laws import LAWS
from sweep.models.general.surfaces import PARABOLOID, SURFACES

SURFACES["dish"] = replace(
    PARABOLOID, name="dish", meanings={"a": {"long_name": "hollow"}}, required=frozenset({"b"}),
    off=lambda columns, x, y: x > 3, outline="x <= 3",
)
LAWS["smear"] = replace(LAWS["coulomb"], name="smear", parameters=("mu", "speed", "mu_viscous"))

from sweep import InputError, load_config
from sweep.config.schema import PATHS, SETTINGS
from sweep.grid import Grid

INERTIA = {"Ixx": 2.0, "Iyy": 20.0, "Izz": 21.0, "Ixy": -0.3}


def config(surface, law, **more):
    body = {"surface": surface, "a": 0.05, "b": 0.3, **INERTIA}
    return load_config({"body": body, "friction": {"mu": 0.2, "speed": 0.01, **law}, "start": {"x0": 0.1} | more})


def slope(found):
    model, columns = found.equations, found.grid.columns()
    states = tuple(column + 0.01 * i for i, column in enumerate(model.start(columns)))
    return np.ravel(model.rhs(states, model.constants.of(columns))[0])


made = config("dish", {"law": "smear"})
assert made.equations.name.endswith("+dish"), made.equations.name
assert load_config(made.document()) == made
assert (slope(made) == slope(config("paraboloid", {"law": "coulomb"}))).all()
assert "smear" in SETTINGS["friction.law"].annotation.__args__
assert made.described("a")["long_name"] == "hollow"
assert "units" not in made.described("mu")
with pytest.raises(InputError, match="start point off the dish at x0=4"):
    config("dish", {"law": "smear"}, x0=4)
with pytest.raises(InputError, match="must be ellipsoid, paraboloid or dish, not 'plate'"):
    config("plate", {"law": "smear"})
with pytest.raises(InputError, match="body.b: missing"):
    load_config({"body": {"surface": "dish", **INERTIA}, "friction": {"mu": 1}})
"""


def test_a_new_surface_and_a_new_law_are_their_records_alone() -> None:
    python("-c", PROGRAM)


RK4 = """
from fractions import Fraction as F

import numpy as np

from sweep.kernels import methods
from sweep.kernels.runge_kutta import RungeKutta

methods.METHODS["rk4"] = RungeKutta(
    name="rk4", code=9, summary="the classical formula", error_order=4, step_cost=4 / 6,
    a=((F(1, 2),), (F(0), F(1, 2)), (F(0), F(0), F(1))),
    b=(F(1, 6), F(1, 3), F(1, 3), F(1, 6)), c=(F(0), F(1, 2), F(1, 2), F(1)),
    real_stability=2.7853, phase=0.3, layer_error=0.1,
)  # before anybody has read the registry

import sweep

def run(**settings):
    scene = {"model": "averaged", "friction": {"mu": 20}, "start": {"n0": 0.1}, "measure": []}
    found = sweep.run(scene, t_end=400, stop_early=False, **settings)
    return float(found.spin_final), float(found.step)

exact, _ = run(method="dopri5", step=0.02)
errors = [abs(run(method="rk4", step=step)[0] - exact) for step in (0.8, 0.4, 0.2)]
assert np.allclose(np.diff(np.log2(errors)), -4, atol=0.1), errors
assert sweep.load_config({"model": "averaged", "friction": {"mu": 20}}).integrator.method == "dopri5"  # not the new one
(loose, long), (tight, short) = (run(method="rk4", tolerance=tolerance) for tolerance in (1e-6, 1e-10))
assert abs(loose - exact) < 1e-6
assert abs(tight - exact) < 1e-10
assert abs(long / short - 10) < 0.2  # the fourth root of the ratio of the tolerances
"""


@pytest.mark.campaign
def test_an_explicit_runge_kutta_method_is_one_record() -> None:
    python("-c", RK4)

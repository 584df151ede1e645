"""An explicit method is one record: the classical Runge-Kutta formula, once registered, runs with the order it has."""

import pytest
from support.processes import python

RK4 = """
from fractions import Fraction as F

import numpy as np

from sweep.kernels import methods, runge_kutta
from sweep.kernels.tableau import Tableau

methods.METHODS["rk4"] = runge_kutta.method(Tableau(
    name="rk4", code=9, summary="the classical formula", order=4,
    a=((F(1, 2),), (F(0), F(1, 2)), (F(0), F(0), F(1))),
    b=(F(1, 6), F(1, 3), F(1, 3), F(1, 6)), c=(F(0), F(1, 2), F(1, 2), F(1)),
    real_stability=2.7853, phase=0.3, layer_error=0.1,
))  # before anybody has read the registry

import sweep

def run(**settings):
    scene = {"model": "averaged", "friction": {"mu": 20}, "start": {"n0": 0.1}, "measure": []}
    found = sweep.run(scene, t_end=400, stop_when_settled=False, **settings)
    return float(found.spin_final), float(found.step)

exact, _ = run(method="dopri5", step=0.02)
errors = [abs(run(method="rk4", step=step)[0] - exact) for step in (0.8, 0.4, 0.2)]
assert np.allclose(np.diff(np.log2(errors)), -4, atol=0.1), errors
(loose, long), (tight, short) = (run(method="rk4", tolerance=tolerance) for tolerance in (1e-6, 1e-10))
assert abs(loose - exact) < 1e-6
assert abs(tight - exact) < 1e-10
assert abs(long / short - 10) < 0.2  # the fourth root of the ratio of the tolerances
"""


@pytest.mark.campaign
def test_an_explicit_runge_kutta_method_is_one_record() -> None:
    python("-c", RK4)

"""Kane and Levinson's rattleback with damping for five seconds: `sweep` beside PyDy and SciPy.

Compared are, all from the same start (`configs/kane_levinson.yaml`, σ = 1e-4, ω3 = -5 rad/s):

* PyDy: equations derived by sympy.physics.mechanics from the description below, in Kane and Levinson's six variables,
  and turned into C by PyDy's code generator,
* SciPy: the equations written by hand in `data/benchmark/example_scipy.py`,
* `sweep.run` and `sweep.trajectory`.

The error is that of the spin at the end, against Taylor series in 80 bits (`scripts/benchmark_references.py`).  Times
are of the processor, and of the wall in parentheses.

    pip install pydy cython setuptools
    python scripts/kane_levinson_peers.py
"""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import sympy
from benchmark_references import FOLDER, KANE_LEVINSON, example
from pydy.system import System
from scipy.integrate import solve_ivp
from sympy.physics import mechanics

import sweep

CASE, T_END = "kane_levinson_left_damped", 5.0
DAMPED = KANE_LEVINSON | {"sigma": 1e-4, "omega3": -5.0}
TOLERANCES = (1e-8, 1e-10, 1e-12)


def timed(work: Callable[[], Any]) -> tuple[Any, str]:
    """What the work gives, and how long it took."""
    wall, processor = time.perf_counter(), time.process_time()
    found = work()
    return found, f"{time.process_time() - processor:.3g} s ({time.perf_counter() - wall:.3g} s)"


@cache
def exact() -> float:
    """The reference of the spin at `T_END`."""
    with (FOLDER / "references.csv").open(encoding="utf-8", newline="") as stream:
        rows = csv.DictReader(stream)
        return next(float(r["spin"]) for r in rows if r["case"] == CASE and float(r["t"]) == T_END)


def report(name: str, spent: str, spin: float) -> None:
    print(f"{name:44s}{spent:>24s}{abs(spin - exact()):10.1e}", flush=True)


# --- PyDy -------------------------------------------------------------------------------------


def described() -> System:
    """The rolling body as sympy.physics.mechanics sees it: z points down, as in the paper."""
    angles, speeds = mechanics.dynamicsymbols("q1:4"), mechanics.dynamicsymbols("w1:4")
    a, b, c, h, g, m, sigma, Ixx, Iyy, Izz, Ixy = symbols = sympy.symbols("a b c h g m sigma Ixx Iyy Izz Ixy")
    table, body = mechanics.ReferenceFrame("T"), mechanics.ReferenceFrame("B")
    body.orient_body_fixed(table, angles, "XYZ")
    turning = body.ang_vel_in(table)
    omega = sum((w * axis for w, axis in zip(speeds, body, strict=True)), mechanics.Vector(0))
    kinematics = [(turning - omega).dot(axis) for axis in body]
    body.set_ang_vel(table, omega)

    down = [table.z.dot(axis) for axis in body]
    squares = [a**2, b**2, c**2]
    reach = sympy.sqrt(sum(square * d**2 for square, d in zip(squares, down, strict=True)))
    to_contact = [square * d / reach for square, d in zip(squares, down, strict=True)]
    from_contact = h * body.z - sum((x * axis for x, axis in zip(to_contact, body, strict=True)), mechanics.Vector(0))
    centre = mechanics.Point("G")
    centre.set_vel(table, omega.cross(from_contact))
    rattleback = mechanics.RigidBody("S", centre, body, m, (mechanics.inertia(body, Ixx, Iyy, Izz, Ixy), centre))

    method = mechanics.KanesMethod(table, angles, speeds, kd_eqs=kinematics)
    method.kanes_equations([rattleback], [(centre, m * g * table.z), (body, -sigma * omega)])
    names = ("a", "b", "c", "offset", "gravity", "mass", "sigma", "Ixx", "Iyy", "Izz", "Ixy")
    start = (DAMPED["roll"], DAMPED["pitch"], 0.0, 0.0, 0.0, DAMPED["omega3"])
    return System(
        method,
        ode_solver=solve,
        constants=dict(zip(symbols, (DAMPED[name] for name in names), strict=True)),
        initial_conditions=dict(zip([*angles, *speeds], start, strict=True)),
        times=np.array([0.0, T_END]),
    )


def solve(slopes: Any, start: Any, times: Any, args: Any = (), **settings: Any) -> Any:
    """SciPy's solver, called as PyDy calls its own."""
    return solve_ivp(lambda t, y: slopes(y, t, *args), times[[0, -1]], start, t_eval=times, **settings).y.T


def run_pydy() -> None:
    system, spent = timed(described)
    print(f"PyDy: equations derived in {spent}")
    _, spent = timed(lambda: system.generate_ode_function(generator="cython", linear_sys_solver="numpy"))
    print(f"PyDy: C generated and compiled in {spent}")
    for tolerance in TOLERANCES:
        found, spent = timed(lambda: system.integrate(method="DOP853", rtol=tolerance, atol=tolerance))  # noqa: B023
        q1, q2, q3, *omega = found[-1]
        down = (
            math.sin(q1) * math.sin(q3) - math.cos(q1) * math.sin(q2) * math.cos(q3),
            math.sin(q1) * math.cos(q3) + math.cos(q1) * math.sin(q2) * math.sin(q3),
            math.cos(q1) * math.cos(q2),
        )
        report(f"PyDy, DOP853, {tolerance:g}", spent, -example.dot(down, omega))


# --- SciPy and sweep --------------------------------------------------------------------------


def run_scipy() -> None:
    case = DAMPED | {"model": "roll", "times": [T_END]}
    for tolerance in TOLERANCES:
        found, spent = timed(lambda: example.solve(case, "DOP853", tolerance))  # noqa: B023
        report(f"SciPy by hand, DOP853, {tolerance:g}", spent, found[-1])


def run_sweep() -> None:
    chosen = {"sigma": DAMPED["sigma"], "omega3": DAMPED["omega3"], "t_end": T_END, "estimate_errors": False}
    for tolerance in TOLERANCES:
        for name, run in (("run", sweep.run), ("trajectory", sweep.trajectory)):
            run("configs/kane_levinson.yaml", tolerance=tolerance, **chosen)  # compiles
            found, spent = timed(lambda: run("configs/kane_levinson.yaml", tolerance=tolerance, **chosen))  # noqa: B023
            report(f"sweep.{name}, dopri5, {tolerance:g}", spent, float(found.spin_final.values.ravel()[0]))


if __name__ == "__main__":
    run_sweep()
    run_scipy()
    run_pydy()

"""An example of a solver for this benchmark: the equations of README.md, SciPy, and nothing else.

    python example_scipy.py ANSWERS.csv [CASE ...] [--rtol 1e-10] [--method LSODA]

The equations take numbers of any kind: `numbers` is the module with their square root, cosine and sine.
"""

import argparse
import csv
import math
import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

HERE = Path(__file__).parent
RTOL_TO_ATOL = 1e-5
"""The rattle's states may be small beside the spin."""


def read_cases():
    """The rows of cases.csv by name, with numbers as numbers; what a case does not have is left out."""
    with (HERE / "cases.csv").open(encoding="utf-8", newline="") as stream:
        return {row["case"]: parsed(row) for row in csv.DictReader(stream)}


def parsed(row):
    """A row of cases.csv with its numbers."""
    case = {"model": row["model"], "times": [float(t) for t in row["times"].split()]}
    words = ("case", "model", "times", "why")
    return case | {name: float(text) for name, text in row.items() if name not in words and text}


# --- vectors ----------------------------------------------------------------------------------


def cross(a, b):
    """a × b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def scaled(factor, a):
    """A number times a vector."""
    return [factor * x for x in a]


def add(*vectors):
    """The sum of vectors."""
    return [sum(parts[1:], parts[0]) for parts in zip(*vectors, strict=True)]


def apply(matrix, a):
    """A symmetric matrix with the elements 11, 22, 33 and 12, times a vector."""
    m11, m22, m33, m12 = matrix
    return [m11 * a[0] + m12 * a[1], m12 * a[0] + m22 * a[1], m33 * a[2]]


# --- bodies -----------------------------------------------------------------------------------


def slipping_body(case, numbers=math):
    """A, the moments of inertia and μ of a body of model `slip`."""
    a2, b2, c2 = case["a"] ** 2, case["b"] ** 2, case["c"] ** 2
    c, s = numbers.cos(case["delta"]), numbers.sin(case["delta"])
    shape = (a2 * c * c + b2 * s * s, a2 * s * s + b2 * c * c, c2, (b2 - a2) * s * c)
    return shape, ((b2 + c2) / 5, (a2 + c2) / 5, (a2 + b2) / 5), case["mu"]


def rolling_body(case, _numbers=math):
    """A, the inertia, σ (both divided by the mass), the offset and gravity of a body of model `roll`."""
    shape = (case["a"] ** 2, case["b"] ** 2, case["c"] ** 2, 0.0)
    inertia = [case[name] / case["mass"] for name in ("Ixx", "Iyy", "Izz", "Ixy")]
    return shape, inertia, case["sigma"] / case["mass"], case["offset"], case["gravity"]


def contact(u, omega, shape, numbers):
    """u', and the contact point seen from the centre of the ellipsoid, with its derivative."""
    A_u = apply(shape, u)
    r = numbers.sqrt(dot(u, A_u))
    du = cross(u, omega)
    dr = dot(du, A_u) / r
    return du, scaled(-1 / r, A_u), add(scaled(-1 / r, apply(shape, du)), scaled(dr / (r * r), A_u))


# --- model slip: u, ω and v_g, nine states ----------------------------------------------------


def slipping_start(case, body, numbers=math):
    """The contact point is at (x0, y0), ω = n0 u, and nothing slips."""
    (A11, A22, A33, A12), *_ = body
    x, y = case["x0"], case["y0"]
    determinant = A11 * A22 - A12 * A12
    w1, w2 = (A22 * x - A12 * y) / determinant, (A11 * y - A12 * x) / determinant
    z = numbers.sqrt(A33 * (1 - (x * w1 + y * w2)))
    length = numbers.sqrt(w1 * w1 + w2 * w2 + z * z / (A33 * A33))
    u = [-w1 / length, -w2 / length, -z / (A33 * length)]
    omega = scaled(case["n0"], u)
    return [*u, *omega, *cross([x, y, z], omega)]


def slipping(state, body, numbers=math):
    """The derivatives of u, ω and v_g."""
    return pressed(state, body, numbers)[0]


def pressed(state, body, numbers=math):
    """The derivatives of u, ω and v_g; and the numerator and the denominator of the normal force R."""
    u, omega, v_g = state[0:3], state[3:6], state[6:9]
    shape, inertia, mu = body
    du, x_p, dx_p = contact(u, omega, shape, numbers)
    v_p = add(v_g, scaled(-1, cross(x_p, omega)))
    force = add(u, scaled(-mu, v_p))
    turning = quotient(cross(moment_of(omega, inertia), omega), inertia)
    pushed = quotient(cross(x_p, force), inertia)
    falling = scaled(-1, add(u, cross(omega, v_g)))
    # (v_p · u)' = 0 with ω' = turning + R pushed, v_g' = falling + R force
    without = add(falling, scaled(-1, cross(dx_p, omega)), scaled(-1, cross(x_p, turning)))
    by_force = add(force, scaled(-1, cross(x_p, pushed)))
    numerator, denominator = -(dot(without, u) + dot(v_p, du)), dot(by_force, u)
    R = numerator / denominator
    return [*du, *add(turning, scaled(R, pushed)), *add(falling, scaled(R, force))], numerator, denominator


def moment_of(omega, inertia):
    """I ω of principal moments I."""
    return [moment * w for moment, w in zip(inertia, omega, strict=True)]


def quotient(torque, inertia):
    """I⁻¹ times a torque, of principal moments I."""
    return [component / moment for component, moment in zip(torque, inertia, strict=True)]


# --- model roll: u and ω, six states ----------------------------------------------------------


def rolling_start(case, _body, numbers=math):
    """Tilted by roll and pitch, and ω3 alone."""
    roll, pitch = case["roll"], case["pitch"]
    u = [numbers.cos(roll) * numbers.sin(pitch), -numbers.sin(roll), -numbers.cos(roll) * numbers.cos(pitch)]
    return [*u, 0.0, 0.0, case["omega3"]]


def rolling(state, body, numbers=math):
    """The derivatives of u and ω."""
    u, omega = state[0:3], state[3:6]
    shape, inertia, sigma, offset, gravity = body
    du, x_p, dx_p = contact(u, omega, shape, numbers)
    x_p = add(x_p, [0.0, 0.0, -offset])
    v_g = cross(x_p, omega)
    force = add(scaled(gravity, u), cross(dx_p, omega), cross(omega, v_g))
    torque = add(cross(x_p, force), scaled(-1, cross(omega, apply(inertia, omega))), scaled(-sigma, omega))
    # (J + |x_p|² - x_p x_pᵀ) ω' = torque, by Cramer's rule
    square = dot(x_p, x_p)
    columns = []
    for i in range(3):
        axis = [1.0 if i == j else 0.0 for j in range(3)]
        columns.append(add(apply(inertia, axis), scaled(square, axis), scaled(-1 * x_p[i], x_p)))
    rows = [cross(columns[1], columns[2]), cross(columns[2], columns[0]), cross(columns[0], columns[1])]
    determinant = dot(columns[0], rows[0])
    return [*du, *(dot(row, torque) / determinant for row in rows)]


MODELS = {"slip": (slipping_body, slipping_start, slipping), "roll": (rolling_body, rolling_start, rolling)}


# --- answers ----------------------------------------------------------------------------------


def solve(case, method="LSODA", rtol=1e-10):
    """The spins n = u · ω at the case's times."""
    body_of, start_of, slopes = MODELS[case["model"]]
    body = body_of(case)
    start = start_of(case, body)
    found = solve_ivp(
        lambda _t, y: slopes(y.tolist(), body), (0.0, case["times"][-1]), start, method,
        t_eval=case["times"], rtol=rtol, atol=rtol * RTOL_TO_ATOL,
    )  # fmt: skip
    if not found.success:
        raise RuntimeError(found.message)
    return np.sum(found.y[0:3] * found.y[3:6], axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("answers", type=Path)
    parser.add_argument("cases", nargs="*", help="names of cases; all of them if none is named")
    parser.add_argument("--rtol", type=float, default=1e-10)
    parser.add_argument("--method", default="LSODA", help="of scipy.integrate.solve_ivp")
    options = parser.parse_args()
    cases = read_cases()
    if unknown := set(options.cases) - set(cases):
        parser.error(f"no such case: {', '.join(sorted(unknown))}")
    with options.answers.open("w", encoding="utf-8", newline="") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow(["case", "t", "spin", "seconds"])
        for name in options.cases or cases:
            began = time.perf_counter()
            spins = solve(cases[name], options.method, options.rtol)
            seconds = time.perf_counter() - began
            for t, spin in zip(cases[name]["times"], spins, strict=True):
                rows.writerow([name, f"{t:g}", repr(float(spin)), f"{seconds:.4g}"])
            stream.flush()


if __name__ == "__main__":
    main()

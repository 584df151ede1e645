"""Reference spins of 300 cells from a domain much wider than the paper's, and how each motion ends.

Two derivations of the equations, both integrated as Taylor series by heyoka.py:

* nine body components of the upward normal u, the angular velocity ω and the velocity v_g of the centre of mass, with
  the normal force R from v_p · u = 0 (`slopes_and_force`).  With u3 as a state they are smooth at u3 = 0, where the
  body topples.  They give the spins of the table, and the events that end a motion;
* the package's own seven equations, traced.  The difference of the two is the uncertainty of the spins.

    python scripts/reference_wide.py data/reference_wide.csv [SEED]
"""

from __future__ import annotations

import csv
import sys
import time
from pathlib import Path
from typing import Any

import heyoka
import numpy as np
from numpy.typing import NDArray
from tracing import taylor_system

from sweep.models.ladder import slip

Array = NDArray[np.float64]
Cell = dict[str, float]

SEED, CELLS = 20251101, 300
TIMES = np.array([50.0, 100.0, 200.0, 400.0])

TOLERANCE, OTHER_TOLERANCE = 1e-16, 1e-15
SAMPLES = 64
"""Samples of the normal force in a period of the fastest rocking."""

UNIT = 2.0**-100
"""All states that vanish in upright spin are integrated in these units.  heyoka's tolerance is relative to the largest
state, and so it is relative to the rattle, however small that gets."""

U3, OMEGA3 = 2, 5
SCALE = np.array([1.0 if i in (U3, OMEGA3) else UNIT for i in range(9)])
OTHER_SCALE = np.array([1.0 if i == slip.MODEL.spin_state else UNIT for i in range(7)])

ENDS = ("lift_off", "paradox", "toppled")
"""The events that end a motion, in the order in which `own_system` lists them."""

SAME_END = 1e-6
"""Largest difference allowed between the two runs' times of the end."""


def draw(seed: int) -> list[Cell]:
    """The cells, in units in which g = 1 and the mass is one; every parameter is rounded to six digits first."""
    random = np.random.default_rng(seed)

    def log_uniform(low: float, high: float) -> float:
        return float(low * (high / low) ** random.random())

    cells: list[Cell] = []
    while len(cells) < CELLS:
        a, c = log_uniform(1.5, 50), random.uniform(0.5, 2)
        if a < 1.5 * c:
            continue
        b = log_uniform(1.01 * c, a)
        cell = {
            "a": a,
            "b": b,
            "c": c,
            "delta": random.uniform(-0.5, 0.5),
            "mu": log_uniform(0.1, 5000),
            "n0": float(random.choice([-1, 1])) * log_uniform(0.005, 0.2),
            "x0": random.uniform(-a / 10, a / 10),
            "y0": random.uniform(-b / 10, b / 10),
        }
        cell = {name: float(f"{value:.6g}") for name, value in cell.items()}
        if height_squared(cell) > 0:
            cells.append(cell)
    return cells


# --- nine equations ---------------------------------------------------------------------------


def body(cell: Cell) -> tuple[Array, Array]:
    """The matrix A of the squared semi-axes in the axes of inertia, and the principal moments."""
    a2, b2, c2 = cell["a"] ** 2, cell["b"] ** 2, cell["c"] ** 2
    cos, sin = np.cos(cell["delta"]), np.sin(cell["delta"])
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return turn.T @ np.diag([a2, b2, c2]) @ turn, np.array([b2 + c2, a2 + c2, a2 + b2]) / 5


def height_squared(cell: Cell) -> float:
    """(z/c)² of the contact point at the start; negative if (x0, y0) lies outside the body."""
    A, _ = body(cell)
    flat = np.array([cell["x0"], cell["y0"]])
    return float(1 - flat @ np.linalg.inv(A)[:2, :2] @ flat)


def constants(cell: Cell) -> list[float]:
    """A11, A12, A22, A33, I1, I2, I3, μ."""
    A, inertia = body(cell)
    return [A[0, 0], A[0, 1], A[1, 1], A[2, 2], *inertia, cell["mu"]]


def start(cell: Cell) -> Array:
    """Contact at (x0, y0), ω = n0 u, no slip velocity."""
    A, _ = body(cell)
    x_p = np.array([cell["x0"], cell["y0"], cell["c"] * np.sqrt(height_squared(cell))])
    u = -np.linalg.inv(A) @ x_p
    u /= np.linalg.norm(u)
    return np.concatenate([u, cell["n0"] * u, np.cross(x_p, cell["n0"] * u)])


def fastest_period(cell: Cell) -> float:
    """Period of the faster rocking about upright rest without slip."""
    A, inertia = body(cell)
    c = cell["c"]
    # A tilt φ about the x and y axes raises the centre of mass by φᵀ stiffness φ / 2; the inertia is I + c².
    stiffness = (np.array([[A[1, 1], -A[0, 1]], [-A[0, 1], A[0, 0]]]) - c**2 * np.eye(2)) / c
    squares = np.linalg.eigvals(stiffness / (inertia[:2, None] + c**2))
    return float(2 * np.pi / np.sqrt(squares.real.max()))


def cross(a: Any, b: Any) -> list[Any]:
    """a × b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a: Any, b: Any) -> Any:
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def slopes_and_force(state: Any, p: Any, sqrt: Any) -> tuple[list[Any], Any, Any]:
    """Derivatives of (u, ω, v_g), and numerator and Painlevé denominator of R; of numbers, arrays or symbols.

    With the force R g, g = u - μ v_p, Newton's and Euler's equations are v_g' = R g - u - ω × v_g and
    ω' = R β + α.  They enter (v_p · u)' = 0 with v_p = v_g - x_p × ω, which is linear in R.
    """
    u, omega, v_g = state[0:3], state[3:6], state[6:9]
    A11, A12, A22, A33, *inertia, mu = p

    def shape(w: Any) -> list[Any]:
        return [A11 * w[0] + A12 * w[1], A12 * w[0] + A22 * w[1], A33 * w[2]]

    of_u = shape(u)
    height = sqrt(dot(u, of_u))
    x_p = [-component / height for component in of_u]
    du = cross(u, omega)
    along = dot(x_p, du)
    dx_p = [(x * along - s) / height for x, s in zip(x_p, shape(du), strict=True)]
    v_p = [v - w for v, w in zip(v_g, cross(x_p, omega), strict=True)]

    g = [n - mu * v for n, v in zip(u, v_p, strict=True)]
    spin = [moment * w for moment, w in zip(inertia, omega, strict=True)]
    alpha = [torque / moment for torque, moment in zip(cross(spin, omega), inertia, strict=True)]
    beta = [torque / moment for torque, moment in zip(cross(x_p, g), inertia, strict=True)]
    drift = [-n - w for n, w in zip(u, cross(omega, v_g), strict=True)]
    lever = cross(u, x_p)
    numerator = dot(cross(dx_p, omega), u) - dot(v_p, du) - dot(drift, u) + dot(lever, alpha)
    denominator = dot(g, u) - dot(lever, beta)
    R = numerator / denominator
    d_omega = [al + R * be for al, be in zip(alpha, beta, strict=True)]
    dv_g = [R * push + d for push, d in zip(g, drift, strict=True)]
    return [*du, *d_omega, *dv_g], numerator, denominator


def own_integrator(tolerance: float) -> Any:
    """Integrator of the nine equations in multiples of `SCALE`; R = 0, its pole and u3 = 0 stop it."""
    symbols = heyoka.make_vars("u1", "u2", "u3", "w1", "w2", "w3", "v1", "v2", "v3")
    states = [symbol * unit for symbol, unit in zip(symbols, SCALE, strict=True)]
    slopes, numerator, denominator = slopes_and_force(states, [heyoka.par[i] for i in range(8)], heyoka.sqrt)
    return heyoka.taylor_adaptive(
        [(symbol, slope * (1 / unit)) for symbol, slope, unit in zip(symbols, slopes, SCALE, strict=True)],
        state=np.zeros(9),
        pars=np.ones(8),
        tol=tolerance,
        t_events=[heyoka.t_event(expression) for expression in (numerator, denominator, symbols[U3])],
    )


def sample_times(cell: Cell) -> Array:
    """Times at which R is seen: equal steps from zero to the last of `TIMES`, and the onset of slip before them."""
    times = np.arange(0, TIMES[-1], fastest_period(cell) / SAMPLES)
    onset = np.geomspace(1e-3 / (1 + cell["mu"]), times[1], 40)[:-1]
    return np.unique(np.concatenate([times, onset, TIMES]))


def own_run(cell: Cell, integrator: Any) -> tuple[Array, float, str, float]:
    """Spins at `TIMES` (NaN after the end), the least normal force seen, the end and its time."""
    times, p = sample_times(cell), constants(cell)
    integrator.time = 0.0
    integrator.reset_cooldowns()
    integrator.state[:], integrator.pars[:] = start(cell) / SCALE, p
    outcome, *_, states = integrator.propagate_grid(times)
    states = (states * SCALE).T
    _, numerator, denominator = slopes_and_force(states, p, np.sqrt)
    at = np.searchsorted(times, TIMES)
    spins = np.full(len(TIMES), np.nan)
    reached = at < states.shape[1]
    spins[reached] = dot(states[:3], states[3:6])[at[reached]]
    ends = dict(enumerate(ENDS)) | {-int(heyoka.taylor_outcome.time_limit.value) - 1: "time_limit"}
    # Where R has a pole just ahead, its states may become infinite before the event is found.
    end = ends.get(-int(outcome.value) - 1, "singular")
    force = 0.0 if end == "lift_off" else least(times[: states.shape[1]], numerator / denominator)
    return spins, force, end, float(integrator.time)


def least(times: Array, values: Array) -> float:
    """The least value of a smooth function: the vertex of the parabola through the least sample and its neighbours."""
    k = int(np.argmin(values))
    if k in (0, len(values) - 1):
        return float(values[k])
    at = times[k - 1 : k + 2] - times[k]
    second, first, _ = np.polyfit(at, values[k - 1 : k + 2], 2)
    return float(values[k] - first**2 / (4 * second)) if second > 0 else float(values[k])


# --- the package's equations ------------------------------------------------------------------


def traced_integrator(tolerance: float) -> Any:
    """Integrator of the package's slip model in multiples of `OTHER_SCALE`."""
    return heyoka.taylor_adaptive(
        taylor_system(slip.MODEL, OTHER_SCALE)[0],
        state=np.zeros(7),
        pars=np.ones(len(slip.Constants._fields)),
        tol=tolerance,
    )


def traced_spins(cell: Cell, integrator: Any, end: float) -> Array:
    """Spins at those of `TIMES` that come before the end; NaN after it."""
    columns = {name: np.array([value]) for name, value in cell.items()}
    p = slip.Constants(*(float(value[0]) for value in slip.Constants.of(columns)))
    integrator.time = 0.0
    integrator.state[:] = np.array([value[0] for value in slip.start(columns)]) / OTHER_SCALE
    integrator.pars[:] = p
    spins = np.full(len(TIMES), np.nan)
    for k, t in enumerate(TIMES[end >= TIMES]):
        integrator.propagate_until(t)
        spins[k] = slip.energy(integrator.state * OTHER_SCALE, p)[0]
    return spins


# --- the table --------------------------------------------------------------------------------


def main(output: Path, seed: int) -> None:
    """Write the table to `output`, and a line for each cell to the terminal."""
    own, other, traced = own_integrator(TOLERANCE), own_integrator(OTHER_TOLERANCE), traced_integrator(OTHER_TOLERANCE)
    cells = draw(seed)
    labels = [f"{t:g}" for t in TIMES]
    header = [*cells[0], *(f"spin_{t}" for t in labels), *(f"uncertainty_{t}" for t in labels)]
    with output.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*header, "least_force", "end", "t_end"])
        for k, cell in enumerate(cells):
            began = time.process_time()
            spins, force, end, t_end = own_run(cell, own)
            uncertainty = np.abs(spins - traced_spins(cell, traced, t_end))
            if end != "time_limit":
                _, _, again, t_again = own_run(cell, other)
                assert again == end
                assert abs(t_again - t_end) < SAME_END
            numbers = [*map(repr, spins.tolist()), *(f"{value:.1e}" for value in uncertainty)]
            writer.writerow([*cell.values(), *numbers, f"{force:.6g}", end, f"{t_end:.9g}"])
            stream.flush()
            seconds = time.process_time() - began
            print(f"{k} {cell} {end} {t_end:.6f} {force:.3f} {uncertainty[-1]:.1e} {seconds:.1f} s", flush=True)
    print(f"{time.process_time():.0f} s of CPU time")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if sys.argv[2:] else SEED)

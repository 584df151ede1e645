"""Reference reversal counts of 500 random cells of the slip model, each marked as firm or not.

The cells are a fixed random sample of the parameters that a sweep covers.  None is left out, so shares of right counts
are meaningful.  The equations are the package's own, traced into heyoka.py's Taylor series;
`data/reference_counts.csv` holds counts from another derivation.

All states but ω3 are in multiples of `UNIT`: heyoka's tolerance is relative to the largest state, which in these
units belongs to the rattle, however small it gets.  The integral of the ripple-free spin n* (`reversals.py`) is an
eighth state.  Each cell is integrated in double precision, then from a start 1e-9 away at another tolerance.  If the
two disagree on the time of the last reversal, it grew out of round-off, and 80-bit arithmetic takes over.  That delays
the reversal, and may not be enough: `noise_limited`.

    python scripts/reference_counts_500.py data/reference_counts_500.csv
"""

from __future__ import annotations

import csv
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import heyoka
import numpy as np
from benchmark_references import UNIT, Case, ripple_free_of, window_of
from reversals import T_END, Means
from tracing import taylor_system

from sweep.models.ladder import slip
from sweep.models.model import Array, stack
from sweep.models.theory import linear
from sweep.parameters import PAPER_PARAMETERS

SEED, CELLS = 20250500, 500

TOLERANCE, OTHER_TOLERANCE, EXTENDED_TOLERANCE = 1e-16, 1e-15, 1.1e-19
NUDGE = 1 + 1e-9

WINDOWS, SAMPLES = 32, 16
"""Windows between two checks of a cell, and samples in a window, at which the normal force is seen."""

MARGIN = 2.0
"""A cell has settled if even this many times the rattle's `reach` would change nothing."""

LINEAR = 1e-6
"""Reach below which a rattle is taken as linear: it shifts the spin by LINEAR² / 2d, 1e-9 at a usual d = 5e-4."""

SAME_TIME, ROUGHLY_SAME_TIME = 1e-5, 1e-2
"""Times that do not depend on round-off agree to 1e-7.  Two that do may agree by chance: one pair agreed to 1e-3 where
80 bits delay the reversal by 10 %."""
LEAST_FORCE = 0.1
"""Between two samples the normal force may be somewhat lower: below this, lift-off cannot be excluded."""

SPIN = slip.MODEL.spin_state
CONSTANTS = len(slip.MODEL.constants._fields)
RATTLE = [i for i in range(len(slip.MODEL.states)) if i != SPIN]
SCALE = np.array([1.0 if i == SPIN else UNIT for i in range(len(slip.MODEL.states))])


def draw() -> list[Case]:
    """The sample, in units of c and sqrt(c/g); written with six digits."""
    random = np.random.default_rng(SEED)
    drawn = {
        "b": random.uniform(1.2, 9.8, CELLS),
        "mu": 20 * 10 ** random.random(CELLS),
        "n0": 0.01 * 10 ** random.random(CELLS),
    }
    fixed = {"a": 10.0, "c": 1.0, "delta": 0.03, "x0": 0.01, "y0": 0.01}
    cells = [fixed | {name: float(f"{column[i]:.6g}") for name, column in drawn.items()} for i in range(CELLS)]
    return [{name: cell[name] for name in PAPER_PARAMETERS} for cell in cells]


# --- integration ------------------------------------------------------------------------------


def system() -> list[tuple[Any, Any]]:
    """Equations of the slip model in multiples of `SCALE`, and of the integral of n*."""
    equations, _ = taylor_system(slip.MODEL, SCALE)
    unscaled = tuple(state * k for (state, _), k in zip(equations, SCALE, strict=True))
    *constants, K11, K12, K21, K22 = (heyoka.par[i] for i in range(CONSTANTS + 4))
    p, K = slip.MODEL.constants(*constants), np.array([[K11, K12], [K21, K22]])
    steady = ripple_free_of(unscaled, (p.A11, p.A22, p.A33, p.A12), (p.J11, p.J22, p.J33), K, heyoka)
    return [*equations, (heyoka.make_vars("integral"), steady)]


def make_integrator(real: Any, tolerance: float) -> Any:
    """Taylor series in the arithmetic of the type `real`."""
    return heyoka.taylor_adaptive(
        system(), state=[real(0)] * 8, pars=[real(1)] * (CONSTANTS + 4), fp_type=real, tol=real(tolerance)
    )


@dataclass
class Run(Means):
    """One cell integrated to its end."""

    least_force: float = np.inf
    status: str = "running"

    def time(self) -> float:
        return min(self.window / 2 * (len(self.integrals) - 1), T_END)


def follow(cell: Case, integrator: Any, real: Any) -> Run:
    """Integrate a cell to its end."""
    columns = {name: np.array([real(value)]) for name, value in cell.items()}
    window, K = window_of(cell)
    constants = stack(slip.MODEL.constants.of(columns))[:, 0]
    states = np.append(stack(slip.MODEL.start(columns))[:, 0] / SCALE, real(0))
    run, steps = Run(window), np.arange(WINDOWS * SAMPLES + 1) / real(SAMPLES) * window
    while run.status == "running":
        integrator.time = real(0)
        integrator.state[:], integrator.pars[:] = states, [*constants, *K.ravel()]
        path = np.asarray(integrator.propagate_grid(steps)[-1])
        look(run, path, constants)
        states = np.append(path[-1, :-1], real(0))
        if run.status == "running" and reach(states[:-1] * SCALE, constants) < LINEAR:
            leap(run, states, constants)
    return run


def look(run: Run, path: Array, constants: Array) -> None:
    """Record a stretch of the path, shape (samples, 8), and end the run if it is done."""
    states = path[:, :-1].T * SCALE[:, None]
    _, (_, _, force, _) = slip.MODEL.rhs(tuple(states), slip.MODEL.constants(*constants))
    base = run.integrals[-1]
    run.integrals += [base + part for part in path[SAMPLES // 2 :: SAMPLES // 2, -1]]
    run.least_force = min(run.least_force, float(force.min()))
    last = states[:, -1].astype(float)
    if run.least_force <= 0:
        run.status = "lift_off"
    elif run.time() >= T_END:
        run.status = "time_limit"
    elif last[SPIN] * run.averages()[-1] < 0 and has_settled(last, constants.astype(float)):
        run.status = "settled"


def reach(states: Array, constants: Array) -> float:
    """sqrt(2E/I3): the rattle moves the spin by no more while it decays.

    The averaged equations (ndotab, abdot) integrate to Δn = sqrt(d² + 2E/I3) - d for a mode of energy E
    at distance d from its critical spin.
    """
    _, rattle, inertia = slip.MODEL.energy(states.astype(float), slip.MODEL.constants(*constants.astype(float)))
    return float(np.sqrt(np.maximum(2 * rattle / inertia, 0)))


def has_settled(states: Array, constants: Array) -> bool:
    """Whether the rattle decays at all spins within reach and a margin, and these have one sign."""
    p = slip.MODEL.constants(*constants)
    spin, *_ = slip.MODEL.energy(states, p)
    within = MARGIN * reach(states, constants)
    near = spin + np.linspace(-1, 1, 5) * within
    each = slip.MODEL.constants(*(np.full(len(near), value) for value in p))
    return bool(within < abs(spin) and (linear.growth_rate(slip.MODEL, each, near) < 0).all())


# --- while the rattle is tiny -----------------------------------------------------------------


def leap(run: Run, states: Array, constants: Array) -> None:
    """Advance each mode by its own exponential, at constant spin, until the rattle matters; in place.

    So small a rattle moves n* no more than n: both are taken as constant.
    """
    values, modes = eigenpairs(jacobian(constants, -states[SPIN]))
    amplitudes = solve(modes, states[RATTLE][:, None].astype(np.clongdouble))[:, 0]
    halves = np.arange(1, 2 * WINDOWS + 1) / 2
    factors = np.exp(values * np.longdouble(WINDOWS * run.window))
    while run.time() < T_END and reach(states[:-1] * SCALE, constants) < LINEAR:
        amplitudes *= factors
        states[RATTLE] = (modes @ amplitudes).real
        base = run.integrals[-1]
        run.integrals += [base - states[SPIN] * run.window * half for half in halves]
    if run.time() >= T_END:
        run.status = "time_limit"


def jacobian(constants: Array, spin: Any) -> Array:
    """Jacobian of the rattle at upright spin, in 80-bit arithmetic by complex steps, shape (6, 6)."""
    step, columns, p = np.longdouble(1e-30), [], slip.MODEL.constants(*constants.astype(np.longdouble))
    for i in RATTLE:
        states = np.array(slip.MODEL.upright(spin)).astype(np.clongdouble)
        states[i] += 1j * step
        columns.append(np.array(slip.MODEL.rhs(states, p)[0])[RATTLE].imag / step)
    return np.array(columns).T


def eigenpairs(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues and -vectors in 80-bit arithmetic: Newton steps from those in double precision."""
    _, vectors = np.linalg.eig(matrix.astype(float))
    vectors = vectors.astype(np.clongdouble)
    for _ in range(3):
        image = solve(vectors, matrix @ vectors)
        values = np.diag(image)
        distance = values[None, :] - values[:, None] + np.eye(len(matrix))
        vectors = vectors + vectors @ ((image - np.diag(values)) / distance)
    return values.copy(), vectors


def solve(matrix: Array, right: Array) -> Array:
    """matrix⁻¹ right in 80-bit arithmetic, by refinement of double precision's."""
    inverse = np.linalg.inv(matrix.astype(complex))
    # Products in 80 bits, so that columns of very different sizes all keep their precision.
    result = inverse @ right
    for _ in range(3):
        result = result + inverse @ (right - matrix @ result)
    return np.asarray(result)


# --- the table --------------------------------------------------------------------------------


def differ(one: Run, other: Run, tolerance: float) -> bool:
    """Whether two runs differ in count, end or the time of the last reversal."""
    if (one.reversals(), one.status) != (other.reversals(), other.status):
        return True
    return abs(one.last_reversal() - other.last_reversal()) > tolerance * other.last_reversal()


def row(cell: Case, runs: list[Run]) -> dict[str, Any]:
    """The table's row for a cell.  The last of its runs is taken as the best."""
    best, limited = runs[-1], any(differ(run, runs[-1], ROUGHLY_SAME_TIME) for run in runs[:-1])
    counts = {run.reversals(shift) for run in runs for shift in (0, 1)}
    ends = {run.status for run in runs}
    firm = len(counts) == len(ends) == 1 and all(run.least_force > LEAST_FORCE for run in runs)
    return {
        **{name: f"{value:g}" for name, value in cell.items()},
        "reversals": best.reversals(),
        "t_last_reversal": f"{best.last_reversal():.4f}",
        "status": best.status,
        "settled": int(best.status == "settled"),
        "t_stop": f"{best.time():.2f}",
        "firm": int(firm),
        "noise_limited": int(limited),
        "bits": 80 if len(runs) == 3 else 64,
    }


def main(output: Path) -> None:
    """Write the table, and a line for each cell to the terminal.

    A cell is followed in double precision from a nudged and from the true start, and in 80 bits if these differ.
    """
    nudged, true = make_integrator(float, OTHER_TOLERANCE), make_integrator(float, TOLERANCE)
    extended = make_integrator(np.longdouble, EXTENDED_TOLERANCE)
    rows = []
    for cell in draw():
        runs = [follow(cell | {"x0": cell["x0"] * NUDGE}, nudged, float), follow(cell, true, float)]
        if differ(*runs, SAME_TIME):
            runs.append(follow(cell, extended, np.longdouble))
        rows.append(row(cell, runs))
        print(f"{rows[-1]} {time.process_time():.0f} s", flush=True)
    with output.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main(Path(sys.argv[1]))

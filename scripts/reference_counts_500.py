"""Reference reversal counts of 500 random cells of the slip model, each marked as firm or not.

The cells are a fixed random sample of the parameters that a sweep covers.  None is left out, so shares of right counts
are meaningful.  The equations are the package's own, traced into heyoka.py's Taylor series;
`scripts/reference_counts.py` looks for errors in their derivation.

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
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import heyoka
import numpy as np
from reversals import last_reversal, sign_changes, window_and_ripple
from tracing import taylor_system

from sweep.models import ellipsoid
from sweep.models.ladder import slip
from sweep.models.model import Array, stack
from sweep.models.theory import linear

SEED, CELLS = 20250500, 500
T_END = 30_000.0
LANES = 8
UNIT = 2.0**-100

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
CONSTANTS = len(slip.Constants._fields)
RATTLE = [i for i in range(len(slip.MODEL.states)) if i != SPIN]
SCALE = np.array([1.0 if i == SPIN else UNIT for i in range(len(slip.MODEL.states))])


def draw() -> dict[str, Array]:
    """Parameters of the sample, shape (cells,), in units of c and sqrt(c/g); written with six digits."""
    random = np.random.default_rng(SEED)
    columns = {
        "a": np.full(CELLS, 10.0),
        "b": random.uniform(1.2, 9.8, CELLS),
        "c": np.ones(CELLS),
        "delta": np.full(CELLS, 0.03),
        "mu": 20 * 10 ** random.random(CELLS),
        "n0": 0.01 * 10 ** random.random(CELLS),
        "x0": np.full(CELLS, 0.01),
        "y0": np.full(CELLS, 0.01),
    }
    return {name: np.array([float(f"{value:.6g}") for value in column]) for name, column in columns.items()}


# --- integration ------------------------------------------------------------------------------


def system() -> list[tuple[Any, Any]]:
    """Equations of the slip model in multiples of `SCALE`, and of the integral of n*."""
    equations, (spin, *_) = taylor_system(slip.MODEL, SCALE)
    unscaled = tuple(state * k for (state, _), k in zip(equations, SCALE, strict=True))
    *constants, K11, K12, K21, K22 = (heyoka.par[i] for i in range(CONSTANTS + 4))
    M1, M2 = momentum(unscaled, slip.Constants(*constants))
    ripple = unscaled[0] * (K11 * M1 + K12 * M2) + unscaled[1] * (K21 * M1 + K22 * M2)
    return [*equations, (heyoka.make_vars("integral"), spin - ripple)]


def momentum(states: tuple[Any, ...], p: slip.Constants) -> tuple[Any, Any]:
    """M1 and M2 of M = I ω - x_p × v_g with v_g = v_p + x_p × ω, as symbols."""
    u1, u2, w1, w2, w3, v1, v2 = states
    u3 = -heyoka.sqrt(1.0 - (u1 * u1 + u2 * u2))
    of_u = p.A11 * u1 + p.A12 * u2, p.A12 * u1 + p.A22 * u2, p.A33 * u3
    height = heyoka.sqrt(u1 * of_u[0] + u2 * of_u[1] + u3 * of_u[2])
    x, y, z = (-component / height for component in of_u)
    v3 = -(u1 * v1 + u2 * v2) / u3
    g1, g2, g3 = v1 + y * w3 - z * w2, v2 + z * w1 - x * w3, v3 + x * w2 - y * w1
    return w1 / p.inv_I1 - (y * g3 - z * g2), w2 / p.inv_I2 - (z * g1 - x * g3)


Advance = Callable[[Array, Array, Array], Array]
"""(states at grid[0], constants and K, times) of shapes (8, lanes), (k + 4, lanes), (samples, lanes) -> states at
these times, shape (samples, 8, lanes)."""


def double_precision(tolerance: float) -> Advance:
    integrator = heyoka.taylor_adaptive_batch(
        system(), state=np.zeros((8, LANES)), pars=np.ones((CONSTANTS + 4, LANES)), tol=tolerance
    )

    def advance(states: Array, parameters: Array, times: Array) -> Array:
        integrator.set_time(0.0)
        integrator.state[:], integrator.pars[:] = states, parameters
        return np.asarray(integrator.propagate_grid(times)[1])

    return advance


def extended_precision() -> Advance:
    real = np.longdouble
    integrator = heyoka.taylor_adaptive(
        system(), state=[real(0)] * 8, pars=[real(1)] * (CONSTANTS + 4), fp_type=real, tol=real(EXTENDED_TOLERANCE)
    )

    def advance(states: Array, parameters: Array, times: Array) -> Array:
        integrator.time = real(0)
        integrator.state[:], integrator.pars[:] = states[:, 0], parameters[:, 0]
        return np.asarray(integrator.propagate_grid(times[:, 0])[-1])[:, :, None]

    return advance


@dataclass
class Run:
    """One cell integrated to its end."""

    window: float
    integrals: list[Any] = field(default_factory=lambda: [0.0])
    """Integral of n*, after each half window."""
    least_force: float = np.inf
    status: str = "running"

    def time(self) -> float:
        return min(self.window / 2 * (len(self.integrals) - 1), T_END)

    def averages(self, shift: int) -> Array:
        """Averages of n* over windows that begin `shift` half windows after the start."""
        last = int(2 * T_END / self.window)
        return np.asarray(np.diff(np.array(self.integrals[: last + 1])[shift::2]) / self.window)

    def reversals(self, shift: int = 0) -> int:
        return len(sign_changes(self.averages(shift)))

    def last_reversal(self) -> float:
        return last_reversal(self.averages(0), self.window)


def windows_and_ripples(columns: dict[str, Array]) -> tuple[Array, Array]:
    """Windows, shape (cells,), and K11, K12, K21, K22, shape (4, cells), of all bodies."""
    A11, A12, A22, A33 = (column.astype(float) for column in ellipsoid.shape(columns))
    zero = np.zeros_like(A11)
    shapes = np.moveaxis(np.array([[A11, A12, zero], [A12, A22, zero], [zero, zero, A33]]), -1, 0)
    inertias = np.array(ellipsoid.inertia(columns)).astype(float).T
    pairs = [window_and_ripple(shape, inertia) for shape, inertia in zip(shapes, inertias, strict=True)]
    return np.array([window for window, _ in pairs]), np.array([K.ravel() for _, K in pairs]).T


def follow(columns: dict[str, Array], advance: Advance, lanes: int, real: Any) -> list[Run]:
    """Integrate all cells, `lanes` at a time.  A lane whose cell has ended takes the next, of similar stiffness."""
    columns = {name: column.astype(real) for name, column in columns.items()}
    (window, ripple), constants = windows_and_ripples(columns), stack(slip.Constants.of(columns))
    parameters = np.vstack([constants, ripple.astype(real)])
    start = np.vstack([stack(slip.start(columns)) / SCALE[:, None], np.zeros((1, len(window)))])
    runs = [Run(float(w)) for w in window]
    waiting: Iterator[int] = iter(np.argsort(slip.fastest_decay(columns) * window))
    steps = np.arange(WINDOWS * SAMPLES + 1)[:, None] / real(SAMPLES)

    held = np.array([next(waiting) for _ in range(lanes)])
    states = start[:, held]
    while any(runs[cell].status == "running" for cell in held):
        path = advance(states, parameters[:, held], steps * window[held])
        states = path[-1].copy()
        look(runs, held, path, constants[:, held])
        states[-1] = 0
        for lane in np.flatnonzero(reach(states[:-1] * SCALE[:, None], constants[:, held]) < LINEAR):
            if runs[held[lane]].status == "running" and lane == first_lane(held, held[lane]):
                leap(runs[held[lane]], states[:, lane], constants[:, held[lane]])
        for lane in np.flatnonzero([runs[cell].status != "running" for cell in held]):
            # If no cell is left, the lane repeats another one.
            if (cell := next(waiting, None)) is not None:
                held[lane], states[:, lane] = cell, start[:, cell]
            else:
                other = next((o for o in range(lanes) if runs[held[o]].status == "running"), lane)
                held[lane], states[:, lane] = held[other], states[:, other]
    return runs


def look(runs: list[Run], held: Array, path: Array, constants: Array) -> None:
    """Record a stretch of all lanes' paths, shape (samples, 8, lanes), and end the cells that are done."""
    states = np.moveaxis(path[:, :-1] * SCALE[:, None], 1, 0)
    _, (_, _, force, _) = slip.rhs(tuple(states), slip.Constants(*constants))
    settled = have_settled(states[:, -1].astype(float), constants.astype(float))
    for cell in np.unique(held):
        lane, run = first_lane(held, cell), runs[cell]
        base = run.integrals[-1]
        run.integrals += [base + part for part in path[SAMPLES // 2 :: SAMPLES // 2, -1, lane]]
        run.least_force = min(run.least_force, float(force[:, lane].min()))
        upright = float(states[SPIN, -1, lane]) * run.averages(0)[-1] < 0
        if run.least_force <= 0:
            run.status = "lift_off"
        elif run.time() >= T_END:
            run.status = "time_limit"
        elif settled[lane] and upright:
            run.status = "settled"


def first_lane(held: Array, cell: int) -> int:
    """The lane that holds `cell`; later lanes may repeat it."""
    return int(np.argmax(held == cell))


def reach(states: Array, constants: Array) -> Array:
    """sqrt(2E/I3): the rattle moves the spin by no more while it decays.  Shape (lanes,).

    The averaged equations (ndotab, abdot) integrate to Δn = sqrt(d² + 2E/I3) - d for a mode of energy E
    at distance d from its critical spin.
    """
    _, rattle, inertia = slip.energy(states.astype(float), slip.Constants(*constants.astype(float)))
    return np.asarray(np.sqrt(np.maximum(2 * rattle / inertia, 0)))


def have_settled(states: Array, constants: Array) -> Array:
    """Whether the rattle decays at all spins within reach and a margin, and these have one sign.  Shape (lanes,)."""
    p = slip.Constants(*constants)
    spin, *_ = slip.energy(states, p)
    within = MARGIN * reach(states, constants)
    near = [spin + share * within for share in np.linspace(-1, 1, 5)]
    decays = np.all([linear.growth_rate(slip.MODEL, p, n) < 0 for n in near], axis=0)
    return np.asarray(decays & (within < np.abs(spin)))


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
    step, columns = np.longdouble(1e-30), []
    for i in RATTLE:
        states = np.array(slip.MODEL.upright(spin)).astype(np.clongdouble)
        states[i] += 1j * step
        columns.append(
            np.array(slip.rhs(states, slip.Constants(*constants.astype(np.longdouble)))[0])[RATTLE].imag / step
        )
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


def row(columns: dict[str, Array], cell: int, runs: list[Run]) -> dict[str, Any]:
    """The table's row for a cell.  The last of its runs is taken as the best."""
    best, limited = runs[-1], any(differ(run, runs[-1], ROUGHLY_SAME_TIME) for run in runs[:-1])
    counts = {run.reversals(shift) for run in runs for shift in (0, 1)}
    ends = {run.status for run in runs}
    firm = len(counts) == len(ends) == 1 and all(run.least_force > LEAST_FORCE for run in runs)
    return {
        **{name: f"{column[cell]:g}" for name, column in columns.items()},
        "reversals": best.reversals(),
        "t_last_reversal": f"{best.last_reversal():.4f}",
        "status": best.status,
        "settled": int(best.status == "settled"),
        "t_stop": f"{best.time():.2f}",
        "firm": int(firm),
        "noise_limited": int(limited),
        "bits": 80 if len(runs) == 3 else 64,
    }


def all_runs(columns: dict[str, Array]) -> list[list[Run]]:
    """Runs of each cell: in double precision from the nudged and the true start, and in 80 bits if they differ."""
    nudged = columns | {"x0": columns["x0"] * NUDGE}
    doubled = [
        follow(nudged, double_precision(OTHER_TOLERANCE), LANES, float),
        follow(columns, double_precision(TOLERANCE), LANES, float),
    ]
    print(f"in double precision: {time.process_time():.0f} s", flush=True)
    runs = [list(pair) for pair in zip(*doubled, strict=True)]
    extended = extended_precision()
    for cell, pair in enumerate(runs):
        if differ(*pair, SAME_TIME):
            alone = {name: column[[cell]] for name, column in columns.items()}
            began = time.process_time()
            pair += follow(alone, extended, 1, np.longdouble)
            print(f"cell {cell} in 80 bits: {time.process_time() - began:.0f} s", flush=True)
    return runs


def main(output: Path) -> None:
    columns = draw()
    runs = all_runs(columns)
    rows = [row(columns, cell, of_cell) for cell, of_cell in enumerate(runs)]
    with output.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    print(f"{time.process_time():.0f} s of CPU time")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

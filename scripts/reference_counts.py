"""Reference counts of spin reversals, computed without the package, for the tests to compare with.

The model is the paper's (Takano 2011, Ldot … visf), derived a second way.  The state is the upward
normal u, the angular velocity ω and the velocity v_g of the centre of mass, nine components in the body.
At each moment ω', v_g' and the normal force R solve one linear system of seven equations,

    I ω' - R x_p × (u - μ v_p) = -ω × I ω
    v_g' - R (u - μ v_p)       = -u - ω × v_g
    u · v_g' - (u × x_p) · ω'  = (x_p' × ω) · u - v_p · u'     from (v_p · u)' = 0, v_p = v_g - x_p × ω

and SciPy's DOP853 integrates it at tight tolerances, with the integral of the ripple-free spin n* (`reversals.py`) as a
tenth state.  A cell whose count a tiny change could alter (see `Trajectory.fault` and `reference`) is left out.  One
process takes half an hour.

    python scripts/reference_counts.py data/reference_counts.csv
"""

from __future__ import annotations

import csv
import sys
import time
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray
from reversals import last_reversal, sign_changes, window_and_ripple
from scipy.integrate import DOP853

Array = NDArray[np.float64]

# A matrix, the moments of inertia, μ and K: what `motion` takes beside the state.
Body = tuple[Array, Array, float, Array]

# Random cells: (seed, how many, fewest reversals by the paper's estimate).
DRAWS = [(20111221, 95, 0.0), (20111222, 24, 4.0)]
T_END = 30_000.0
# Steps allowed for a trajectory (about 25 s), and for one of the cells in `PAPER` and `LONG`.
MAX_STEPS, MAX_STEPS_LONG = 300_000, 3_000_000
# Random cells expected to take more steps are not tried.
MAX_EXPECTED_STEPS = 80_000

# u, ω, v_g and the integral of n*.  All but u3, ω3 and the integral vanish in upright spin.
ATOL = np.array([1e-18, 1e-18, 1e-14, 1e-18, 1e-18, 1e-16, 1e-18, 1e-18, 1e-18, 1e-12])

# A count is in doubt if the window averages turn back, or end, this close to zero.
GRAZING = 1e-4
# Rattle energy, in units of I3 n²/2, below which a trajectory may count as settled.
SETTLED_RATTLE = 1e-6
# Settled spin must be stable with this factor to spare; then Δn <= (rattle)/(I3 · distance) = 1e-5 n.
SETTLED_MARGIN = 1.05


@dataclass(frozen=True)
class Cell:
    """A body, its friction and its start, in units of c and sqrt(c/g)."""

    a: float
    b: float
    delta: float
    mu: float
    n0: float
    x0: float
    y0: float

    def shape(self) -> Array:
        """Matrix A of the squared semi-axes, in the axes of inertia."""
        cos, sin = np.cos(self.delta), np.sin(self.delta)
        turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        return turn.T @ np.diag([self.a**2, self.b**2, 1.0]) @ turn

    def inertia(self) -> Array:
        """Principal moments of inertia."""
        return np.array([self.b**2 + 1, self.a**2 + 1, self.a**2 + self.b**2]) / 5

    def start(self) -> Array:
        """State at t = 0: contact at (x0, y0), ω = n0 u, no slip velocity; the integral of n* is 0."""
        inverse = np.linalg.inv(self.shape())
        flat = np.array([self.x0, self.y0])
        x_p = np.array([self.x0, self.y0, np.sqrt(1 - flat @ inverse[:2, :2] @ flat)])
        u = -inverse @ x_p
        u /= np.linalg.norm(u)
        omega = self.n0 * u
        return np.concatenate([u, omega, np.cross(x_p, omega), [0.0]])


@dataclass(frozen=True)
class Trajectory:
    """The integral of n* after each half window, and how the integration ended."""

    window: float
    integrals: Array
    end: str
    steps: int

    def averages(self, shift: int = 0) -> Array:
        """Averages of n* over successive windows that begin `shift` half windows after the start."""
        return np.asarray(np.diff(self.integrals[shift::2]) / self.window)

    def reversals(self, shift: int = 0) -> int:
        return len(sign_changes(self.averages(shift)))

    def last_reversal(self) -> float:
        return last_reversal(self.averages(), self.window)

    def fault(self) -> str:
        """Why the count cannot be trusted; empty if it can."""
        if self.end != "settled":
            return self.end
        if self.reversals(1) != self.reversals():
            return "count depends on the window's start"
        averages = self.averages()
        rise = np.diff(averages)
        turns = averages[1:-1][rise[:-1] * rise[1:] <= 0]
        closest = np.abs(np.append(turns, averages[-1])).min()
        return "grazing" if closest < GRAZING else ""


@njit
def cross(a: Array, b: Array) -> Array:
    """a × b of two vectors."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@njit
def motion(state: Array, shape: Array, inertia: Array, mu: float, ripple: Array) -> tuple[Array, float]:
    """Time derivative of the state, and the normal force R; `ripple` is the matrix K in n*."""
    u, omega, v_g = state[0:3], state[3:6], state[6:9]
    height = np.sqrt(np.sum(u * (shape @ u)))
    x_p = -(shape @ u) / height
    du = cross(u, omega)
    # From x_p = -A u / height and height' = -x_p · u'.
    dx_p = (x_p * np.sum(x_p * du) - shape @ du) / height
    v_p = v_g - cross(x_p, omega)
    force = u - mu * v_p

    matrix, right = np.zeros((7, 7)), np.zeros(7)
    torque, lever = cross(x_p, force), cross(u, x_p)
    for i in range(3):
        matrix[i, i], matrix[3 + i, 3 + i] = inertia[i], 1.0
        matrix[i, 6], matrix[3 + i, 6] = -torque[i], -force[i]
        matrix[6, i], matrix[6, 3 + i] = -lever[i], u[i]
    right[0:3] = -cross(omega, inertia * omega)
    right[3:6] = -u - cross(omega, v_g)
    right[6] = np.sum(cross(dx_p, omega) * u) - np.sum(v_p * du)
    accelerations = np.linalg.solve(matrix, right)

    slope = np.empty(10)
    slope[0:3] = du
    slope[3:9] = accelerations[0:6]
    momentum = inertia * omega - cross(x_p, v_g)
    slope[9] = np.sum(u * omega) - np.sum(u[:2] * (ripple @ momentum[:2]))
    return slope, accelerations[6]


def growth_rate(n: float, body: Body) -> float:
    """Largest real part of the rattle's eigenvalues about upright spin n."""
    rattle, size = np.array([0, 1, 3, 4, 6, 7]), 1e-6
    jacobian = np.empty((6, 6))
    for column, i in enumerate(rattle):
        state = np.zeros(10)
        state[2], state[5], state[i] = -1.0, -n, size
        # The rattle's slopes are odd in the rattle: one side is a central difference.
        jacobian[:, column] = motion(state, *body)[0][rattle] / size
    return float(np.linalg.eigvals(jacobian).real.max())


def has_settled(state: Array, average: float, body: Body) -> bool:
    """Whether the spin is stable and the rattle too weak to move it, so that every mode goes on decaying."""
    shape, inertia, *_ = body
    n = float(state[0:3] @ state[3:6])
    u, omega, v_g = state[0:2], state[3:5], state[6:8]
    rattle = 0.5 * (inertia[:2] @ omega**2 + v_g @ v_g + u @ (shape[:2, :2] - np.eye(2)) @ u)
    if n * average <= 0 or rattle > SETTLED_RATTLE * 0.5 * inertia[2] * n**2:
        return False
    return all(growth_rate(spin, body) < 0 for spin in (n, SETTLED_MARGIN * n))


def simulate(cell: Cell, rtol: float, max_steps: int) -> Trajectory:
    """Integrate one cell until it settles, lifts off, or reaches the time or step limit."""
    shape, inertia = cell.shape(), cell.inertia()
    window, ripple = window_and_ripple(shape, inertia)
    body = shape, inertia, cell.mu, ripple
    solver = DOP853(lambda _t, state: motion(state, *body)[0], 0.0, cell.start(), T_END, rtol=rtol, atol=ATOL)
    integrals = [0.0]
    end, steps = "step limit", 0
    while end == "step limit" and steps < max_steps:
        solver.step()
        steps += 1
        if solver.status != "running":
            end = "time limit" if solver.status == "finished" else "solver failed"
        if motion(solver.y, *body)[1] <= 0:
            end = "lift-off"
        if solver.t >= len(integrals) * window / 2:
            dense = solver.dense_output()
            while solver.t >= (edge := len(integrals) * window / 2):
                integrals.append(float(dense(edge)[9]))
            if len(integrals) > 2 and has_settled(solver.y, (integrals[-1] - integrals[-3]) / window, body):
                end = "settled"
    return Trajectory(window, np.array(integrals), end, steps)


def reference(cell: Cell, max_steps: int) -> tuple[Trajectory, str]:
    """A trajectory and why its count is in doubt, empty if it is not: its own fault, or that of a looser run nearby."""
    first = simulate(cell, 1e-11, max_steps)
    if fault := first.fault():
        return first, fault
    second = simulate(replace(cell, x0=cell.x0 * (1 + 1e-9)), 1e-10, max_steps)
    if fault := second.fault():
        return first, f"{fault} in the repetition"
    return first, "" if second.reversals() == first.reversals() else "count differs in the repetition"


PAPER = [Cell(10.0, 3.0, 0.03, mu, 0.05, 0.01, 0.01) for mu in (20.0, 40.0, 60.0, 75.0, 100.0)]
LONG = [Cell(10.0, 5.0, 0.03, 160.0, 0.1, 0.01, 0.01), Cell(10.0, 7.2, 0.03, 188.0, 0.05, 0.01, 0.01)]
STARTS = [(0.05, 0.05), (0.05, -0.02), (-0.01, 0.03), (0.001, 0.01)]


def expected_steps(cell: Cell) -> float:
    """Steps until the rattle settles: stability bounds the step, and the friction of the slower mode sets the time."""
    step = 5.5 / (cell.mu * (1 + 5 / (cell.b**2 + 1)))
    decay = 25 / ((cell.a**2 + 6) * cell.mu)
    return float(-np.log(SETTLED_RATTLE) / decay / step)


def expected_reversals(cell: Cell) -> float:
    """The paper's estimate 2x = J2 μ |n0 sin θ cos θ| L(f)."""
    j1, j2 = (cell.b**2 + 6) / 5, (cell.a**2 + 6) / 5
    p = np.linalg.inv(cell.shape())
    double_theta = np.arctan(2 * p[0, 1] * np.sqrt(j1 * j2) / (j1 * p[1, 1] - j2 * p[0, 0]))
    f = np.sqrt(j2 / j1)
    return float(j2 * cell.mu * abs(cell.n0 * np.sin(double_theta) / 2) * (f - 1 / f) / (1 + f**2))


def random_cells(seed: int, count: int, fewest: float) -> list[Cell]:
    """Random cells of many shapes, spins and frictions that are not expected to take too long."""
    random = np.random.default_rng(seed)
    cells: list[Cell] = []
    while len(cells) < count:
        a = round(random.uniform(4, 14), 2)
        b = round(random.uniform(max(1.25, 0.15 * a), 0.94 * a), 2)
        delta = round(float(random.choice([-1, 1]) * random.uniform(0.01, 0.08)), 4)
        mu = round(10 * 20 ** random.uniform(0, 1), 1)
        n0 = round(float(random.choice([-1, 1]) * random.uniform(0.01, 0.1)), 4)
        x0, y0 = STARTS[len(cells) // 5 % len(STARTS)] if len(cells) % 5 == 0 else (0.01, 0.01)
        cell = Cell(a, b, delta, mu, n0, x0, y0)
        if expected_steps(cell) < MAX_EXPECTED_STEPS and expected_reversals(cell) >= fewest:
            cells.append(cell)
    return cells


def main(output: Path) -> None:
    """Write the cells with a firm count to `output`, and a line for every candidate to the terminal."""
    candidates = [(cell, MAX_STEPS_LONG) for cell in PAPER]
    candidates += [(cell, MAX_STEPS) for draw in DRAWS for cell in random_cells(*draw)]
    candidates += [(cell, MAX_STEPS_LONG) for cell in LONG]
    with output.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*(field.name for field in fields(Cell)), "reversals", "t_last_reversal"])
        for cell, max_steps in candidates:
            before = time.process_time()
            run, fault = reference(cell, max_steps)
            seconds, count, last = time.process_time() - before, run.reversals(), run.last_reversal()
            if not fault:
                writer.writerow([*astuple(cell), count, f"{last:.2f}"])
                stream.flush()
            print(f"{cell} {count=} {last=:.2f} {run.steps=} {seconds=:.1f} {fault or 'recorded'}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))

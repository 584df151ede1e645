"""Reference counts of spin reversals, computed without the package, for the tests to compare with.

The model is the paper's (Takano 2011, Ldot … visf), derived a second way.  The state is the upward
normal u, the angular velocity ω and the velocity v_g of the centre of mass, nine components in the body.
At each moment ω', v_g' and the normal force R solve one linear system of seven equations,

    I ω' - R x_p × (u - μ v_p) = -ω × I ω
    v_g' - R (u - μ v_p)       = -u - ω × v_g
    u · v_g' - (u × x_p) · ω'  = (x_p' × ω) · u - v_p · u'     from (v_p · u)' = 0, v_p = v_g - x_p × ω

and SciPy's DOP853 integrates it at tight tolerances, with the integral of the ripple-free spin n* (`reversals.py`) as a
tenth state.  Bodies and starts are those of `data/benchmark/example_scipy.py`.  A cell whose count a tiny change could
alter (see `Trajectory.fault` and `reference`) is left out.

    python scripts/reference_counts.py OUTPUT

computes the cells of `data/reference_counts.csv` again, which takes one process half an hour.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray
from reversals import T_END, Means, window_and_ripple
from scipy.integrate import DOP853

Array = NDArray[np.float64]

# A matrix, the moments of inertia, μ and K: what `motion` takes beside the state.
Body = tuple[Array, Array, float, Array]

DATA = Path(__file__).parents[1] / "data"
TABLE = DATA / "reference_counts.csv"
sys.path.append(str(DATA / "benchmark"))
import example_scipy as example  # noqa: E402  # from a folder of data

Cell = dict[str, float]
"""A body, its friction and its start, in units of c and sqrt(c/g)."""
NAMES = ("a", "b", "delta", "mu", "n0", "x0", "y0")

# Steps allowed for a trajectory: some minutes.
MAX_STEPS = 3_000_000

# u, ω, v_g and the integral of n*.  All but u3, ω3 and the integral vanish in upright spin.
ATOL = np.array([1e-18, 1e-18, 1e-14, 1e-18, 1e-18, 1e-16, 1e-18, 1e-18, 1e-18, 1e-12])

# A count is in doubt if the window averages turn back, or end, this close to zero.
GRAZING = 1e-4
# Rattle energy, in units of I3 n²/2, below which a trajectory may count as settled.
SETTLED_RATTLE = 1e-6
# Settled spin must be stable with this factor to spare; then Δn <= (rattle)/(I3 · distance) = 1e-5 n.
SETTLED_MARGIN = 1.05


@dataclass
class Trajectory(Means):
    """Means of n*, and how the integration ended."""

    end: str = "step limit"
    steps: int = 0

    def fault(self) -> str:
        """Why the count cannot be trusted; empty if it can."""
        if self.end != "settled":
            return self.end
        if self.reversals(1) != self.reversals():
            return "count depends on the window's start"
        return "grazing" if self.closest() < GRAZING else ""


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


def simulate(cell: Cell, rtol: float) -> Trajectory:
    """Integrate one cell until it settles, lifts off, or reaches the time or step limit."""
    given = example.slipping_body(cell | {"c": 1.0})
    (A11, A22, A33, A12), moments, mu = given
    shape, inertia = np.array([[A11, A12, 0.0], [A12, A22, 0.0], [0.0, 0.0, A33]]), np.array(moments)
    window, ripple = window_and_ripple(shape, inertia)
    body, start = (shape, inertia, mu, ripple), np.array([*example.slipping_start(cell, given), 0.0])
    solver = DOP853(lambda _t, state: motion(state, *body)[0], 0.0, start, T_END, rtol=rtol, atol=ATOL)
    found = Trajectory(window)
    while found.end == "step limit" and found.steps < MAX_STEPS:
        solver.step()
        found.steps += 1
        if solver.status != "running":
            found.end = "time limit" if solver.status == "finished" else "solver failed"
        if motion(solver.y, *body)[1] <= 0:
            found.end = "lift-off"
        if solver.t >= len(found.integrals) * window / 2:
            dense = solver.dense_output()
            while solver.t >= (edge := len(found.integrals) * window / 2):
                found.integrals.append(float(dense(edge)[9]))
            if len(found.integrals) > 2:
                average = (found.integrals[-1] - found.integrals[-3]) / window
                found.end = "settled" if has_settled(solver.y, average, body) else found.end
    return found


def reference(cell: Cell) -> tuple[Trajectory, str]:
    """A trajectory and why its count is in doubt, empty if it is not: its own fault, or that of a looser run nearby."""
    first = simulate(cell, 1e-11)
    if fault := first.fault():
        return first, fault
    second = simulate(cell | {"x0": cell["x0"] * (1 + 1e-9)}, 1e-10)
    if fault := second.fault():
        return first, f"{fault} in the repetition"
    return first, "" if second.reversals() == first.reversals() else "count differs in the repetition"


def main(output: Path) -> None:
    """Compute the cells of the table again, write those with a firm count, and print a line for each."""
    with TABLE.open(encoding="utf-8", newline="") as stream:
        cells = [{name: float(row[name]) for name in NAMES} for row in csv.DictReader(stream)]
    with output.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*NAMES, "reversals", "t_last_reversal"])
        for cell in cells:
            run, fault = reference(cell)
            count, last = run.reversals(), run.last_reversal()
            if not fault:
                writer.writerow([*cell.values(), count, f"{last:.2f}"])
                stream.flush()
            print(f"{cell} {count=} {last=:.2f} {run.steps=} {fault or 'recorded'}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))

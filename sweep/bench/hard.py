"""Runs hard cases with every method, and compares the required outcome with the result."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sweep.grid import Array
from sweep.kernels.method import TOLERANCE
from sweep.kernels.methods import METHODS, automatic_step
from sweep.kernels.status import LIFT_OFF, PARADOX, SETTLED, TIME_LIMIT
from sweep.models import MODELS
from sweep.models.ladder import slip
from sweep.models.model import Columns
from sweep.report.direct import simulate, standard
from sweep.report.rows import Row, Section, states
from sweep.results.dataset import STATUSES

LONGEST, LONG = 30_000.0, 1e6
"""Times by which all has settled, and of the longest run, in sqrt(c/g)."""

TIMES = 1e-3
"""Bound on the error of the time at which a trajectory fails."""


@dataclass(frozen=True)
class Case:
    """Trajectories of the slip model, and how closely every method must agree with a run with shorter steps."""

    names: Sequence[str]
    """One entry for each trajectory."""
    columns: Columns
    t_end: float
    end: int | Sequence[int] = TIME_LIMIT
    """How the trajectories must end."""
    near: float | Array = 1e-7
    """Bound on the error in spin. For a trajectory that must fail, its time is compared instead."""
    energy: float = 1e-4
    """Bound on `energy_error`."""
    spin: Array | None = None
    """The spin that theory requires, where it does."""
    settle: bool = False
    tolerance: float = TOLERANCE
    stiff: bool = False
    """Whether the case is only for methods without a stability limit: dopri5 would take minutes."""
    fine_end: float | None = None
    """End of the run with shorter steps, if it need not go on to `t_end`."""


def cases() -> Iterator[Case]:
    """From no friction to so much that dopri5 needs steps of 1e-5, from no rattle to one that throws the body up."""
    mu = np.array([0.0, 1e-3, 1.0, 1e2, 1e3, 1e5])
    yield Case([f"μ = {x:g}" for x in mu], standard(mu=mu), 100.0, energy=1e-6)
    # Friction so strong that hardly any energy is lost: loose tolerances must work here too.
    mu = np.array([1e3, 1e4, 1e5])
    for loose in (1e-4, 1e-6):
        names = [f"μ = {x:g}, tolerance {loose:g}" for x in mu]
        yield Case(names, standard(mu=mu), 400.0, near=loose, energy=np.inf, tolerance=loose, stiff=True)
    # Nearly round seen from above, which takes long to settle; and nearly round across, which settles before its spin
    # has stopped changing, so that spins are compared at one time.
    mu = np.array([75.0, 200.0])
    yield Case([f"b = 9.99, μ = {x:g}" for x in mu], standard(b=9.99, mu=mu), LONGEST, settle=True)
    yield Case([f"b = 1.001, μ = {x:g}" for x in mu], standard(b=1.001, mu=mu), 1000.0)
    # Without an angle between the axes nothing couples the rattle to the spin, which gains at most the rattle's energy.
    columns = standard(delta=[0.0, 1e-12])
    spin, rattle, inertia = slip.MODEL.energy(slip.MODEL.start(columns), slip.MODEL.constants.of(columns))
    yield Case(["δ = 0", "δ = 1e-12"], columns, 3000.0, near=rattle / (inertia * spin), spin=spin)
    # The rattle may set the body spinning, but only as fast as its energy allows, much of which is lost in the first
    # slip.
    yield Case(["n0 = 0"], standard(n0=0.0), LONGEST, SETTLED, energy=0.01, settle=True)
    # A body that does not rattle must not start to rattle.
    names, spin = ["at rest, no rattle", "upright spin of 0.05, no rattle"], np.array([0.0, 0.05])
    yield Case(names, standard(n0=spin, x0=0.0, y0=0.0), 1000.0, near=1e-16, energy=1e-15, spin=spin)
    # The contact point starts half an axis away.
    yield Case(["start at x0 = a/2", "start at y0 = b/2"], standard(x0=[5.0, 0.0], y0=[0.0, 1.5]), 100.0)
    # Spins at which the body leaves the plane, or the normal force has no solution (Painlevé's paradox).
    for n0, mu0, x0, end in (
        (0.5, 75.0, 0.01, TIME_LIMIT), (1.0, 75.0, 0.01, TIME_LIMIT), (2.0, 20.0, 1.0, LIFT_OFF),
        (3.0, 20.0, 1.0, LIFT_OFF), (3.0, 75.0, 0.01, LIFT_OFF), (3.0, 60.0, 0.01, PARADOX),
    ):  # fmt: skip
        # Towards a paradox R grows without bound, and the balance of the last steps is off by 1e-6 to 1e-3, whatever
        # the step: with adams 4e-4, 1e-4, 4e-6, 8e-4 and 4e-5 at 1, 0.8, 0.5, 0.4 and 0.3 of one step.
        names, energy = [f"n0 = {n0:g}, μ = {mu0:g}, x0 = {x0:g}"], np.inf if end == PARADOX else 1e-4
        yield Case(names, standard(n0=n0, mu=mu0, x0=x0), 5.0, end, energy=energy)
    # Long after everything has settled, nothing may drift.
    names = [f"μ = 20 to t = {LONG:g}, tolerance 1e-6"]
    yield Case(names, standard(mu=20.0), LONG, near=1e-6, tolerance=1e-6, fine_end=LONG / 10)


def rows(case: Case) -> Iterator[Row]:
    """Run a case, and make a row for each method and trajectory."""
    methods = [name for name, method in METHODS.items() if not case.stiff or method.real_stability == np.inf]
    by = methods[0]
    step = automatic_step(by, MODELS["slip"], case.columns, 1e-10 if case.stiff else TOLERANCE)[0] / 2
    fine = simulate(case.columns, case.fine_end or case.t_end, method=by, step=step, settle=case.settle)
    why = f"{by} with shorter steps" if case.spin is None else "theory"
    end, near = (np.broadcast_to(each, len(case.names)) for each in (case.end, case.near))
    spin = fine["spin_final"] if case.spin is None else case.spin
    for method in methods:
        ends = simulate(
            case.columns, case.t_end, method=method, tolerance=case.tolerance, settle=case.settle, decide=True
        )
        for i, name in enumerate(case.names):
            status, time, energy = int(ends["status"][i]), ends["t_stop"][i], ends["energy_error"][i]
            if end[i] in (TIME_LIMIT, SETTLED):
                off, bound, what = abs(ends["spin_final"][i] - spin[i]), near[i], f"spin {spin[i]:.6g}"
            else:
                off, bound, what = abs(time - fine["t_stop"][i]), TIMES, f"t = {fine['t_stop'][i]:.6g}"
            count, counted = ends["reversals"][i], fine["reversals"][i]
            balance = f", energy balanced to {case.energy:g}" if np.isfinite(case.energy) else ""
            expected = f"{STATUSES[end[i]]}, {what} to {bound:.1e}, {counted:g} reversals{balance}"
            found = f"{STATUSES[status]} at t = {time:.6g}, off by {off:.1e}, {count:g} reversals, energy {energy:.1e}"
            holds = status == end[i] and off <= bound and count == counted and energy <= case.energy
            finite = np.isfinite(ends.states[:, i]).all()
            yield states(name, method, expected, found, bool(holds and finite), why=why)


def hard_cases() -> Section:
    """Run all cases, and make them a section of the report."""
    return Section("Hard cases", [row for case in cases() for row in rows(case)])

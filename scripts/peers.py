"""Speed against error of whole runs, compared with other tools: from parameters in Python to spins.

The task is a small sweep, as a user of each tool would write it: distinct bodies of the slip model (b = 2 … 8) with
one friction and one start, from t = 0 to T.  Compared are

* `sweep.run` with dopri5 and with the method chosen for each cell, with all default measurements and with counts alone,
* heyoka.py: Taylor series in batches of the machine's SIMD width, shared out to two threads,
* numbalsoda: LSODA and DOP853, called from a compiled loop in two threads,
* diffrax: jitted and vmapped, adaptive, on XLA's own threads,
* SciPy: DOP853 and LSODA, in one process.

The others get the package's right-hand side, traced or compiled.  Each runs at several tolerances, whose errors and
times make a curve.  The errors are measured, whatever was asked for.

The time of a run begins with arrays of parameters and ends with the spins at T; constants, starts and steps are part
of it.  Compilation is not.  All tools run in double precision on two processors and take turns, so that other work on
the machine affects all alike.  Tools that would take too long get fewer of the bodies, evenly spread, and are compared
by the time of one trajectory.  The error is that of the spin at T, the largest over eight of the bodies or more (as
many of them as a tool runs), against the Taylor series in 80-bit arithmetic of `reference_spins.py`.

    pip install -e .[peers]
    apt-get install gfortran && pip install -e .[peers-fortran]
    python scripts/peers.py FOLDER

writes peers.csv and peers.png.  Tools that are not installed are left out.
"""

from __future__ import annotations

import copy
import csv
import math
import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple
from reference_spins import EXTENDED_TOLERANCE, TIMES, Extended, taylor_spins
from tracing import taylor_system, traced_rhs

import sweep
from sweep.jit import load_numba
from sweep.models.ladder.slip import MODEL
from sweep.models.model import Array, stack

numba = load_numba()

THREADS = 2
T_END = float(TIMES[-1])
N_STATES, N_CONSTANTS = len(MODEL.states), len(MODEL.constants._fields)

MU, BODIES, REPEATS = (60.0, 200.0, 1000.0), 1024, 5
SLOW_SECONDS, SLOW_REPEATS = 2.0, 3
"""Runs that take longer than `SLOW_SECONDS` are repeated no more than `SLOW_REPEATS` times."""

MOST_STEPS = 100_000_000
"""For numbalsoda, which needs a limit."""

COMPARED = 8
"""Bodies whose errors are computed, at least."""

OURS = (1e-4, 1e-6, 1e-8, 1e-10)
"""Tolerances of sweep's runs; the others' are such that the errors cover the same range."""
HEYOKA, DOP853, LSODA, TSIT5 = (1e-3, 1e-6, 1e-9), (1e-4, 1e-7, 1e-10), (1e-6, 1e-8, 1e-10), (1e-4, 1e-6, 1e-8)
CURVES = {
    "sweep, auto": ("C3", "-", "o", ""),
    "sweep, auto, counts alone": ("C3", "-", "o", "white"),
    "sweep, dopri5": ("C1", "-", "s", ""),
    "sweep, dopri5, counts alone": ("C1", "-", "s", "white"),
    "heyoka batch": ("C0", "-", "^", ""),
    "numbalsoda DOP853": ("C2", "-", "v", ""),
    "numbalsoda LSODA": ("C2", "--", "<", ""),
    "diffrax Tsit5": ("C4", "-", "D", ""),
    "SciPy DOP853, 1 process": ("0.4", "-", "x", ""),
    "SciPy LSODA, 1 process": ("0.4", "--", "+", ""),
}
"""The tools of the picture, with colour, dash, marker and colour of its face if that is another."""
RTOL_TO_ATOL = 1e-3
"""Absolute over relative tolerance: the rattle's states are of order 1e-3."""

FIXED = {"a": 10.0, "c": 1.0, "delta": 0.03, "n0": 0.05, "x0": 0.01, "y0": 0.01}


@dataclass(frozen=True)
class Problem:
    mu: float
    b: Array
    """Shape (bodies,)."""

    @property
    def size(self) -> int:
        return len(self.b)

    def every(self, stride: int) -> Problem:
        return Problem(self.mu, self.b[::stride])

    def start(self) -> tuple[Array, Array]:
        """States at t = 0 and constants, shapes (states, bodies) and (constants, bodies)."""
        columns = {name: np.full(self.size, value) for name, value in FIXED.items()}
        columns |= {"b": self.b, "mu": np.full(self.size, self.mu)}
        return stack(MODEL.start(columns)), stack(MODEL.constants.of(columns))


Solve = Callable[[Problem], Array]
"""Returns the spins at T, of shape (bodies,)."""
Setting = tuple[str, str, Solve]
"""The names of a tool and of a setting, and what runs it."""


def from_states(solve: Callable[[Array, Array], Array], problem: Problem) -> Array:
    """Spins at T by a tool that turns states at t = 0, shape (states, bodies), and constants into states at T."""
    states, constants = problem.start()
    return np.asarray(MODEL.rhs(solve(states, constants), MODEL.constants(*constants))[1][0])


# --- the tools --------------------------------------------------------------------------------


def our_settings() -> Iterator[Setting]:
    """Runs with all default measurements, and runs that do no more than the others: with counts alone."""
    alone = {"measure": ["reversals"], "estimate_errors": False}
    for tolerance in OURS:
        for method in ("dopri5", "auto"):
            more = {"method": method, "tolerance": tolerance, "t_end": T_END}
            yield f"sweep, {method}", f"tol={tolerance:g}", partial(our_run, more)
            yield f"sweep, {method}, counts alone", f"tol={tolerance:g}", partial(our_run, more | alone)


def our_run(more: dict[str, Any], problem: Problem) -> Array:
    found = sweep.run({}, **FIXED, b=problem.b, mu=problem.mu, stop_early=False, **more)
    return np.asarray(found["spin_final"].values)


def heyoka_settings() -> Iterator[Setting]:
    import heyoka

    size, (system, _) = heyoka.recommended_simd_size(), taylor_system(MODEL)
    for tolerance in HEYOKA:
        # compact_mode=True takes three times as long here; force_avx512 and slp_vectorize change nothing.
        original = heyoka.taylor_adaptive_batch(
            system, state=np.zeros((N_STATES, size)), pars=np.ones((N_CONSTANTS, size)), tol=tolerance, fast_math=True
        )
        integrators = [original, *(copy.copy(original) for _ in range(THREADS - 1))]
        solve = partial(heyoka_run, integrators, size)
        yield "heyoka batch", f"tol={tolerance:g} batch={size}", partial(from_states, solve)


def heyoka_run(integrators: list[Any], size: int, states: Array, constants: Array) -> Array:
    """Every second batch in each of two threads; the last batch is filled up with copies of the last body."""
    ends, bodies = np.empty_like(states), states.shape[1]
    batches = np.minimum(np.arange(bodies + -bodies % size), bodies - 1).reshape(-1, size)

    def run_share(share: int) -> None:
        integrator = integrators[share]
        for batch in batches[share::THREADS]:
            integrator.set_time(0.0)
            integrator.state[:], integrator.pars[:] = states[:, batch], constants[:, batch]
            integrator.propagate_until(T_END)
            ends[:, batch] = integrator.state

    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(run_share, range(THREADS)))  # which raises what a thread has raised
    return ends


def numbalsoda_settings() -> Iterator[Setting]:
    import numbalsoda

    for method, solver, tolerances in (
        ("DOP853", numbalsoda.dop853, DOP853), ("LSODA", numbalsoda.lsoda, LSODA),
    ):  # fmt: skip
        solve_all = numbalsoda_loop(solver)
        for rtol in tolerances:
            solve = partial(solve_all, rtol)
            yield f"numbalsoda {method}", f"rtol={rtol:g}", partial(from_states, solve)


def numbalsoda_loop(solver: Any) -> Any:
    """The solver on every body, in a compiled loop that shares them out to the threads."""
    import numbalsoda

    rhs, constants_of = MODEL.rhs, MODEL.constants

    @numba.cfunc(numbalsoda.lsoda_sig, error_model="numpy")
    def slopes(_t: float, y: Any, dy: Any, p: Any) -> None:
        states = to_fixed_tuple(numba.carray(y, (N_STATES,)), N_STATES)
        found = rhs(states, constants_of(*to_fixed_tuple(numba.carray(p, (N_CONSTANTS,)), N_CONSTANTS)))[0]
        for i in range(N_STATES):
            dy[i] = found[i]

    address = slopes.address

    @numba.njit(parallel=True)
    def solve_all(rtol: float, starts: Array, constants: Array) -> Array:
        ends = np.empty_like(starts)
        for i in numba.prange(starts.shape[1]):
            start, p = starts[:, i].copy(), constants[:, i].copy()
            found, arrived = solver(address, start, np.array([0.0, T_END]), p, rtol, rtol * RTOL_TO_ATOL, MOST_STEPS)
            ends[:, i] = found[-1] if arrived else np.nan
        return ends

    solve_all.keep = slopes  # or its code would be freed
    return solve_all


def diffrax_settings() -> Iterator[Setting]:
    for rtol in TSIT5:
        yield "diffrax Tsit5", f"rtol={rtol:g}", partial(from_states, diffrax_solver(rtol))


def diffrax_solver(rtol: float) -> Callable[[Array, Array], Array]:
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    rhs = traced_rhs(MODEL, jnp.sqrt)
    term = diffrax.ODETerm(lambda _t, y, p: jnp.stack(rhs(tuple(y), tuple(p))[0]))
    controller = diffrax.PIDController(rtol=rtol, atol=rtol * RTOL_TO_ATOL)

    def solve(y: Any, p: Any) -> Any:
        return diffrax.diffeqsolve(
            term, diffrax.Tsit5(), 0.0, T_END, 0.01, y, p,
            stepsize_controller=controller, max_steps=None, adjoint=diffrax.ForwardMode(), throw=False,
        ).ys[0]  # fmt: skip

    # In one call: two Python threads with half the trajectories each are no faster.
    solve_all = jax.jit(jax.vmap(solve, in_axes=1, out_axes=1))
    return lambda states, constants: np.asarray(solve_all(jnp.asarray(states), jnp.asarray(constants)))


def scipy_settings() -> Iterator[Setting]:
    for method, tolerances in (("DOP853", DOP853), ("LSODA", LSODA)):
        for rtol in tolerances:
            solve = partial(scipy_run, method, rtol)
            yield f"SciPy {method}, 1 process", f"rtol={rtol:g}", partial(from_states, solve)


@cache
def compiled_rhs() -> Any:
    """Compiled (t, states, constants) -> slopes, on arrays."""
    rhs, constants_of = MODEL.rhs, MODEL.constants

    @numba.njit(error_model="numpy")
    def slopes(_t: float, y: Array, p: Array) -> Array:
        return np.array(rhs(to_fixed_tuple(y, N_STATES), constants_of(*to_fixed_tuple(p, N_CONSTANTS)))[0])

    return slopes


def scipy_run(method: str, rtol: float, states: Array, constants: Array) -> Array:
    from scipy.integrate import solve_ivp

    tolerances = {"rtol": rtol, "atol": rtol * RTOL_TO_ATOL}
    ends = [
        solve_ivp(compiled_rhs(), (0, T_END), y, method, t_eval=[T_END], args=(p,), **tolerances).y[:, -1]
        for y, p in zip(states.T.copy(), constants.T.copy(), strict=True)
    ]
    return np.array(ends).T


TOOLS: dict[str, tuple[Callable[[], Iterator[Setting]], float]] = {
    "sweep": (our_settings, math.inf),
    "heyoka": (heyoka_settings, 1024),
    "numbalsoda": (numbalsoda_settings, 128),
    "diffrax": (diffrax_settings, 128),
    "scipy": (scipy_settings, 2),
}
"""The settings of a tool, by the module that it needs; and the number of bodies that it gets at μ = 60."""


# --- what is measured -------------------------------------------------------------------------


@dataclass
class Entry:
    """One setting of one tool, and what was measured."""

    tool: str
    setting: str
    solve: Solve
    problem: Problem
    error: float = math.nan
    seconds: list[float] = field(default_factory=list)

    def milliseconds(self, which: Callable[[list[float]], float] = statistics.median) -> float:
        """Time per trajectory, of the median run or another one."""
        return 1e3 * which(self.seconds) / self.problem.size


def affordable(problem: Problem, most: float) -> Problem:
    """Every n-th body: at most `most` at μ = 60, and the fewer, the more steps friction requires; at least one."""
    wanted = max(1.0, most * 60.0 / problem.mu)
    strides = (n for n in range(1, problem.size + 1) if problem.size % n == 0)
    return problem.every(next(n for n in strides if problem.size / n <= wanted))


def prepare(problem: Problem) -> list[Entry]:
    """Entries of the installed tools, compiled by an untimed run, which also gives their errors."""
    reference, entries = problem.every(max(1, problem.size // COMPARED)), list[Entry]()
    cases = [FIXED | {"b": b, "mu": problem.mu} for b in reference.b.tolist()]
    exact = np.array([float(taylor_spins(MODEL, case, Extended, EXTENDED_TOLERANCE)[-1]) for case in cases])
    for module, (settings, most) in TOOLS.items():
        if find_spec(module) is None:
            print(f"{module}: not installed")
            continue
        for tool, setting, solve in settings():
            entry = Entry(tool, setting, solve, affordable(problem, most))
            ours, theirs = np.isin(reference.b, entry.problem.b), np.isin(entry.problem.b, reference.b)
            entry.error = float(np.abs(solve(entry.problem)[theirs] - exact[ours]).max())
            if math.isfinite(entry.error):
                entries.append(entry)
            else:
                print(f"{tool} {setting}: a body did not arrive, left out")
    return entries


def measure(entries: list[Entry]) -> None:
    """Time all entries in turns, the slow ones less often, and print a line for each."""
    for _ in range(REPEATS):
        for entry in entries:
            if len(entry.seconds) < SLOW_REPEATS or statistics.median(entry.seconds) < SLOW_SECONDS:
                began = time.perf_counter()
                entry.solve(entry.problem)
                entry.seconds.append(time.perf_counter() - began)
    for entry in entries:
        print(
            f"{entry.tool:30s}{entry.setting:18s}{entry.milliseconds():9.4g} ms a trajectory, error {entry.error:.1e}"
        )


# --- table and picture ------------------------------------------------------------------------


def write(path: Path, found: dict[float, list[Entry]]) -> None:
    """Write the table of all entries, by friction."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        rows = csv.writer(stream)
        rows.writerow(["mu", "tool", "setting", "runs", "ms_per_trajectory", "ms_least", "ms_most", "largest_error"])
        for mu, entries in found.items():
            for e in entries:
                times = [f"{e.milliseconds(which):.4g}" for which in (statistics.median, min, max)]
                rows.writerow([f"{mu:g}", e.tool, e.setting, e.problem.size, *times, f"{e.error:.2g}"])


def draw(table: Path, picture: Path) -> None:
    """Draw speed against error from the table, a panel for each friction, as wide as a page of the documentation.

    The times are those of the fastest runs, which other work on the machine has slowed least.
    """
    from matplotlib.figure import Figure

    with table.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    frictions = list(dict.fromkeys(row["mu"] for row in rows))
    figure = Figure((9.0, 4.2), dpi=110, layout="constrained")
    grid = figure.subplots(1, len(frictions), sharey=True, squeeze=False).ravel()
    for axes, mu in zip(grid, frictions, strict=True):
        for tool, (colour, dash, marker, face) in CURVES.items():
            some = [(float(row["largest_error"]), float(row["ms_least"]))
                    for row in rows if (row["mu"], row["tool"]) == (mu, tool)]  # fmt: skip
            if not some:
                continue
            errors, times = zip(*sorted(some), strict=True)
            axes.loglog(errors, times, color=colour, linestyle=dash, marker=marker, markersize=4.5,
                        markerfacecolor=face or colour, linewidth=1.2, label=tool)  # fmt: skip
        axes.set(title=f"μ = {mu}", xlabel="largest error in spin", xlim=(2e-13, 1e-3))
        axes.grid(alpha=0.3)
    grid[0].set_ylabel("milliseconds per trajectory")
    handles, names = grid[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(picture)


def main(output: Path) -> None:
    """Write the table and the picture, again after each friction."""
    if hasattr(os, "sched_setaffinity"):  # XLA cannot be limited to some of the processors otherwise.
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:THREADS])
    numba.set_num_threads(THREADS)
    output.mkdir(parents=True, exist_ok=True)
    found = dict[float, list[Entry]]()
    for mu in MU:
        print(f"\nμ = {mu:g}, T = {T_END:g}, {BODIES} bodies with b = 2 … 8")
        found[mu] = prepare(Problem(mu, np.linspace(2.0, 8.0, BODIES)))
        measure(found[mu])
        write(output / "peers.csv", found)
        draw(output / "peers.csv", output / "peers.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

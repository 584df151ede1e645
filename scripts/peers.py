"""Speed against error of whole runs, beside other tools: from parameters in Python to spins, and counts if a tool can.

The task is a small sweep, as a user of each tool would write it: distinct bodies of the slip model (b = 2 … 8) with
one friction and one start, from t = 0 to T.  Compared are

* `sweep.run` with dopri5 and with the method chosen for each cell, with all default measurements and with counts alone,
* heyoka.py: Taylor series in batches of the machine's SIMD width, in its ensemble mode and shared out to two threads,
  with the equations as a user would write them; with events that count crossings of zero; and with our algebra,
* numbalsoda: LSODA and DOP853 on the compiled right-hand side, called from a compiled loop in two threads,
* diffrax: jitted and vmapped, adaptive, on XLA's own threads,
* SciPy: DOP853 and LSODA on the compiled right-hand side, in one process.

Each at several tolerances, whose errors and times make a curve.  The errors are measured, whatever was asked for.

The time of a run begins with arrays of parameters and ends with the spins at T; constants, starts and steps are part
of it.  Compilation is not.  All tools run in double precision on two processors and take turns, so that other work on
the machine affects all alike.  Tools that would take too long get fewer of the bodies, evenly spread, and are compared
by the time of one trajectory.  The error is that of the spin at T, the largest over eight of the bodies (as many of
them as a tool runs), against heyoka's Taylor series in 80-bit arithmetic, of which one is checked by SciPy's DOP853 at
its tightest tolerance.

A reversal in `sweep` is a change of sign of the ripple-free spin averaged over a period of the rattle.  heyoka's events
see the spin itself, which may cross zero several times in one reversal: the table tells how many counts agree.

    pip install -e .[peers]
    apt-get install gfortran && pip install -e .[peers-fortran]
    python scripts/peers.py [--mu 60 200 1000] [--bodies 1024] [--repeats 5] [--output FOLDER]

writes peers.csv and peers.png.
"""

from __future__ import annotations

import argparse
import copy
import csv
import math
import os
import statistics
import threading
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
from tracing import taylor_system, traced_rhs

import sweep
from sweep.jit import load_numba
from sweep.models.ladder.slip import MODEL
from sweep.models.model import Array, stack

numba = load_numba()

THREADS = 2
POOL = ThreadPoolExecutor(THREADS)
T_END = 400.0

SLOW_SECONDS, SLOW_REPEATS = 2.0, 3
"""Runs that take longer than `SLOW_SECONDS` are repeated no more than `SLOW_REPEATS` times."""

MOST_STEPS = 100_000_000
"""Of a solver that has to be told."""

COMPARED = 8
"""Bodies whose errors are computed."""

DOPRI5, AUTO, BATCH = "sweep, dopri5", "sweep, auto", "heyoka batch"

ALONE = ", counts alone"
"""Runs of ours that tell no more than the others do: without margins, and without an estimate of each cell's error."""

OURS = (1e-4, 1e-6, 1e-8, 1e-10)
"""Tolerances of sweep's runs; the others' are such that the errors cover the same range."""
HEYOKA, DOP853, LSODA, TSIT5 = (1e-3, 1e-6, 1e-9), (1e-4, 1e-7, 1e-10), (1e-6, 1e-8, 1e-10), (1e-4, 1e-6, 1e-8)
RTOL_TO_ATOL = 1e-3
"""Absolute over relative tolerance: the rattle's states are of order 1e-3."""

FIXED = {"a": 10.0, "c": 1.0, "delta": 0.03, "n0": 0.05, "x0": 0.01, "y0": 0.01}

Answer = tuple[Array, Array | None]
"""Spins at T, and counts of reversals if the tool counts them, each of shape (bodies,)."""


@dataclass(frozen=True)
class Problem:
    mu: float
    b: Array
    """Shape (bodies,)."""

    @property
    def size(self) -> int:
        return len(self.b)

    def at(self, which: Any) -> Problem:
        return Problem(self.mu, self.b[which])

    def start(self) -> tuple[Array, Array]:
        """States at t = 0 and constants, shapes (states, bodies) and (constants, bodies)."""
        columns = {name: np.full(self.size, value) for name, value in FIXED.items()}
        columns |= {"b": self.b, "mu": np.full(self.size, self.mu)}
        return stack(MODEL.start(columns)), stack(MODEL.constants.of(columns))


def spin(states: Array, constants: Array) -> Array:
    """Spins of states of shape (states, bodies)."""
    return np.asarray(MODEL.rhs(states, MODEL.constants(*constants))[1][0])


@dataclass
class Entry:
    """One setting of one tool, and what was measured."""

    tool: str
    setting: str
    solve: Callable[[Problem], Answer]
    problem: Problem
    error: float = math.nan
    counts: Array | None = None
    seconds: list[float] = field(default_factory=list)

    def run(self) -> float:
        """Seconds that a run takes."""
        began = time.perf_counter()
        self.solve(self.problem)
        return time.perf_counter() - began

    @property
    def milliseconds(self) -> float:
        """Per trajectory, of the median run."""
        return 1e3 * statistics.median(self.seconds) / self.problem.size


def count_constants() -> int:
    return len(MODEL.constants._fields)


# --- ours -------------------------------------------------------------------------------------


def our_entries() -> Iterator[tuple[str, str, Callable[[Problem], Answer]]]:
    alone = {"measure": ["reversals"], "estimate_errors": False}
    for tolerance in OURS:
        for tool, method in ((DOPRI5, "dopri5"), (AUTO, "auto")):
            more = {"method": method, "tolerance": tolerance, "t_end": T_END}
            yield tool, f"tol={tolerance:g}", partial(our_run, more)
            yield f"{tool}{ALONE}", f"tol={tolerance:g}", partial(our_run, more | alone)


def our_run(more: dict[str, Any], problem: Problem) -> Answer:
    found = sweep.run({}, **FIXED, b=problem.b, mu=problem.mu, stop_when_settled=False, **more)
    return found["spin_final"].values, found["reversals"].values


# --- heyoka.py --------------------------------------------------------------------------------


def heyoka_entries() -> Iterator[tuple[str, str, Callable[[Problem], Answer]]]:
    import heyoka

    size, written, (ours, _) = heyoka.recommended_simd_size(), textbook_system(), taylor_system(MODEL)
    for tolerance in HEYOKA:
        setting = f"tol={tolerance:g} batch={size}"
        yield BATCH, setting, Batches(written, size, tolerance).in_shares
        yield "heyoka batch, our algebra", setting, Batches(ours, size, tolerance).in_shares
    setting = f"tol={HEYOKA[1]:g} batch={size}"
    yield "heyoka ensemble of batches", setting, Batches(written, size, HEYOKA[1]).in_ensemble
    yield "heyoka batch, counting", setting, Batches(written, size, HEYOKA[1], counting=True).in_shares


def textbook_system() -> list[tuple[Any, Any]]:
    """The equations as a user would copy them from the paper, vector by vector, without our algebra."""
    import heyoka
    from benchmark_references import example

    states = heyoka.make_vars(*MODEL.states)
    u1, u2, *omega, v1, v2 = states
    A11, A12, A22, A33, *inverse, _, _, _, mu = (heyoka.par[i] for i in range(count_constants()))
    u = [u1, u2, -heyoka.sqrt(1.0 - u1 * u1 - u2 * u2)]
    v = [v1, v2, -(v1 * u1 + v2 * u2) / u[2]]

    cross, dot, scaled, total = example.cross, example.dot, example.scaled, example.add
    du, x_p, dx_p = example.contact(u, omega, (A11, A22, A33, A12), heyoka)
    spinning = [w / i for w, i in zip(omega, inverse, strict=True)]
    alpha0 = [-i * g for i, g in zip(inverse, cross(omega, spinning), strict=True)]
    force = total(u, scaled(-1.0 * mu, v))
    alpha1 = [i * g for i, g in zip(inverse, cross(x_p, force), strict=True)]
    v0 = cross(x_p, omega)
    swing = total(cross(dx_p, omega), cross(omega, v0))
    R = (1.0 + dot(total(swing, cross(x_p, alpha0)), u)) / (1.0 - dot(cross(x_p, alpha1), u))
    domega = total(alpha0, scaled(R, alpha1))
    dv0 = total(swing, cross(x_p, domega))
    rest = total(u, dv0, cross(omega, v))
    dv = [R * f - b for f, b in zip(force, rest, strict=True)]
    return list(zip(states, [du[0], du[1], *domega, dv[0], dv[1]], strict=True))


class Batches:
    """Integrators of `size` bodies at a time; the last batch is filled up with copies of the last body."""

    def __init__(self, system: list[tuple[Any, Any]], size: int, tolerance: float, counting: bool = False) -> None:
        import heyoka

        self.size, self.counting = size, counting
        _, (spin_expression, *_) = taylor_system(MODEL)
        # compact_mode=True takes three times as long here; force_avx512 and slp_vectorize change nothing.
        original = heyoka.taylor_adaptive_batch(
            system,
            state=np.zeros((len(MODEL.states), size)),
            pars=np.ones((count_constants(), size)),
            tol=tolerance,
            fast_math=True,
            nt_events=[heyoka.nt_event_batch(spin_expression, count_crossing)] if counting else [],
        )
        self.integrators = [original] + [copy.copy(original) for _ in range(THREADS - 1)]

    def in_shares(self, problem: Problem) -> Answer:
        """Every second batch in each of two threads."""
        states, constants, batches = self._batches(problem)

        def run_share(share: int) -> list[tuple[Array, Array]]:
            integrator, results = self.integrators[share], []
            for batch in batches[share::THREADS]:
                self._set(integrator, states[:, batch], constants[:, batch])
                crossings = COUNTING[id_of_thread()] = np.zeros(self.size, dtype=int)
                integrator.propagate_until(T_END)
                results.append((integrator.state.copy(), crossings))
            return results

        found: list[Any] = [None] * len(batches)
        for share, results in enumerate(POOL.map(run_share, range(THREADS))):
            found[share::THREADS] = results
        ends = np.concatenate([state for state, _ in found], axis=1)[:, : problem.size]
        counts = np.concatenate([crossings for _, crossings in found])[: problem.size]
        return spin(ends, constants), counts if self.counting else None

    def in_ensemble(self, problem: Problem) -> Answer:
        """By heyoka's own means for many runs."""
        import heyoka

        states, constants, batches = self._batches(problem)

        def generate(integrator: Any, i: int) -> Any:
            self._set(integrator, states[:, batches[i]], constants[:, batches[i]])
            return integrator

        found = heyoka.ensemble_propagate_until_batch(
            self.integrators[0], T_END, len(batches), generate, max_workers=THREADS
        )
        ends = np.concatenate([integrator.state for integrator, *_ in found], axis=1)[:, : problem.size]
        return spin(ends, constants), None

    def _batches(self, problem: Problem) -> tuple[Array, Array, Array]:
        size, states_constants = self.size, problem.start()
        batches = np.minimum(np.arange(problem.size + -problem.size % size), problem.size - 1).reshape(-1, size)
        return *states_constants, batches

    def _set(self, integrator: Any, states: Array, constants: Array) -> None:
        integrator.set_time(0.0)
        integrator.state[:], integrator.pars[:] = states, constants


COUNTING: dict[int, Array] = {}
"""The crossings of zero so far of the batch that each thread runs: events are copied with their integrator."""
id_of_thread = threading.get_ident


def count_crossing(_integrator: Any, _time: float, _sign: int, member: int) -> None:
    COUNTING[id_of_thread()][member] += 1


def taylor_reference(problem: Problem) -> Array:
    """Spins at T from Taylor series in extended precision (80 bits on x86)."""
    import heyoka

    real = np.longdouble
    states, constants = problem.start()
    integrator = heyoka.taylor_adaptive(
        taylor_system(MODEL)[0],
        state=list(states[:, 0].astype(real)),
        pars=list(constants[:, 0].astype(real)),
        fp_type=real,
        tol=real(1e-17),
        compact_mode=True,
    )
    integrators = [integrator] + [copy.copy(integrator) for _ in range(THREADS - 1)]

    def run_share(share: int) -> None:
        own = integrators[share]
        for i in range(share, problem.size, THREADS):
            own.time = real(0)
            own.state[:], own.pars[:] = states[:, i], constants[:, i]
            own.propagate_until(real(T_END))
            states[:, i] = own.state

    list(POOL.map(run_share, range(THREADS)))  # which raises what a thread has raised
    return spin(states, constants)


# --- SciPy ------------------------------------------------------------------------------------


@cache
def compiled_rhs() -> Any:
    """Compiled (t, states, constants) -> slopes, on arrays."""
    rhs, constants_of, n_states, n_constants = MODEL.rhs, MODEL.constants, len(MODEL.states), count_constants()

    @numba.njit(error_model="numpy")
    def slopes(_t: float, y: Array, p: Array) -> Array:
        return np.array(rhs(to_fixed_tuple(y, n_states), constants_of(*to_fixed_tuple(p, n_constants)))[0])

    return slopes


def scipy_run(method: str, rtol: float, atol: float, problem: Problem) -> Answer:
    from scipy.integrate import solve_ivp

    states, constants = problem.start()
    ends = [
        solve_ivp(compiled_rhs(), (0, T_END), y, method, t_eval=[T_END], args=(p,), rtol=rtol, atol=atol).y[:, -1]
        for y, p in zip(states.T.copy(), constants.T.copy(), strict=True)
    ]
    return spin(np.array(ends).T, constants), None


def scipy_entries() -> Iterator[tuple[str, str, Callable[[Problem], Answer]]]:
    for method, tolerances in (("DOP853", DOP853), ("LSODA", LSODA)):
        for rtol in tolerances:
            yield f"SciPy {method}, 1 process", f"rtol={rtol:g}", partial(scipy_run, method, rtol, rtol * RTOL_TO_ATOL)


# --- numbalsoda -------------------------------------------------------------------------------


def numbalsoda_entries() -> Iterator[tuple[str, str, Callable[[Problem], Answer]]]:
    import numbalsoda

    for method, solver, tolerances in (
        ("DOP853", numbalsoda.dop853, DOP853), ("LSODA", numbalsoda.lsoda, LSODA),
    ):  # fmt: skip
        solve_all = numbalsoda_loop(solver)
        for rtol in tolerances:
            yield f"numbalsoda {method}", f"rtol={rtol:g}", partial(numbalsoda_run, solve_all, rtol)


def numbalsoda_loop(solver: Any) -> Any:
    """The solver on every body, in a compiled loop that shares them out to the threads."""
    import numbalsoda

    rhs, constants_of, n_states, n_constants = MODEL.rhs, MODEL.constants, len(MODEL.states), count_constants()

    @numba.cfunc(numbalsoda.lsoda_sig, error_model="numpy")
    def slopes(_t: float, y: Any, dy: Any, p: Any) -> None:
        states = to_fixed_tuple(numba.carray(y, (n_states,)), n_states)
        found = rhs(states, constants_of(*to_fixed_tuple(numba.carray(p, (n_constants,)), n_constants)))[0]
        for i in range(n_states):
            dy[i] = found[i]

    address = slopes.address

    @numba.njit(parallel=True)
    def solve_all(starts: Array, constants: Array, rtol: float) -> Array:
        ends = np.empty_like(starts)
        for i in numba.prange(len(starts)):
            found, arrived = solver(
                address, starts[i], np.array([0.0, T_END]), constants[i], rtol, rtol * RTOL_TO_ATOL, MOST_STEPS
            )
            ends[i] = found[-1] if arrived else np.nan
        return ends

    solve_all.keep = slopes  # or its code would be freed
    return solve_all


def numbalsoda_run(solve_all: Any, rtol: float, problem: Problem) -> Answer:
    states, constants = problem.start()
    return spin(solve_all(states.T.copy(), constants.T.copy(), rtol).T, constants), None


# --- diffrax ----------------------------------------------------------------------------------


def diffrax_entries() -> Iterator[tuple[str, str, Callable[[Problem], Answer]]]:
    import diffrax

    for rtol in TSIT5:
        yield "diffrax Tsit5", f"rtol={rtol:g}", diffrax_run(diffrax.Tsit5(), rtol)


def diffrax_run(solver: Any, rtol: float) -> Callable[[Problem], Answer]:
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    rhs = traced_rhs(MODEL, jnp.sqrt)
    term = diffrax.ODETerm(lambda _t, y, p: jnp.stack(rhs(tuple(y), tuple(p))[0]))
    controller = diffrax.PIDController(rtol=rtol, atol=rtol * RTOL_TO_ATOL)

    def solve(y: Any, p: Any) -> Any:
        return diffrax.diffeqsolve(
            term, solver, 0.0, T_END, 0.01, y, p,
            stepsize_controller=controller, max_steps=None, adjoint=diffrax.ForwardMode(), throw=False,
        ).ys[0]  # fmt: skip

    # In one call: two Python threads with half the trajectories each are no faster.
    solve_all = jax.jit(jax.vmap(solve))

    def run(problem: Problem) -> Answer:
        states, constants = problem.start()
        ends = solve_all(jnp.asarray(states.T), jnp.asarray(constants.T))
        return spin(np.asarray(ends).T, constants), None

    return run


# --- all of them ------------------------------------------------------------------------------

Tool = Callable[[], Iterator[tuple[str, str, Callable[[Problem], Answer]]]]

TOOLS: dict[str, tuple[Tool, float]] = {
    "sweep": (our_entries, math.inf),
    "heyoka": (heyoka_entries, 1024),
    "numbalsoda": (numbalsoda_entries, 128),
    "diffrax": (diffrax_entries, 128),
    "scipy": (scipy_entries, 2),
}
"""What makes a tool's entries, by the module that it needs; and the number of bodies that it gets at μ = 60."""


def affordable(problem: Problem, most: float) -> Problem:
    """Every n-th body: at most `most` at μ = 60, and the fewer, the more steps friction requires; at least one."""
    wanted = max(1.0, most * 60.0 / problem.mu)
    strides = (n for n in range(1, problem.size + 1) if problem.size % n == 0)
    return problem.at(slice(None, None, next(n for n in strides if problem.size / n <= wanted)))


def reference_spins(problem: Problem) -> Array:
    """Spins at T; prints how well two independent methods agree on the first."""
    by_taylor = taylor_reference(problem)
    by_scipy, _ = scipy_run("DOP853", 1e-13, 1e-16, problem.at(slice(1)))
    difference = abs(by_taylor[0] - by_scipy[0])
    print(f"reference: Taylor series in extended precision; SciPy's DOP853 at rtol=1e-13 differs by {difference:.1e}")
    return by_taylor


def prepare(problem: Problem) -> list[Entry]:
    """Entries of the installed tools, compiled by an untimed run, which also gives their errors."""
    reference = problem.at(slice(None, None, problem.size // COMPARED))
    exact = reference_spins(reference)
    sound = []
    for module, (make, most) in TOOLS.items():
        if find_spec(module) is None:
            print(f"{module}: not installed")
            continue
        for tool, setting, solve in make():
            entry = Entry(tool, setting, solve, affordable(problem, most))
            spins, entry.counts = solve(entry.problem)
            ours, theirs = np.isin(reference.b, entry.problem.b), np.isin(entry.problem.b, reference.b)
            entry.error = float(np.abs(spins[theirs] - exact[ours]).max())
            if math.isfinite(entry.error):
                sound.append(entry)
            else:
                print(f"{entry.tool} {entry.setting}: a body did not arrive, left out")
    return sound


def measure(entries: list[Entry], repeats: int) -> None:
    """Time all entries in turns, the slow ones less often."""
    for _ in range(repeats):
        for entry in entries:
            if len(entry.seconds) < SLOW_REPEATS or statistics.median(entry.seconds) < SLOW_SECONDS:
                entry.seconds.append(entry.run())


def print_table(entries: list[Entry]) -> None:
    counted = next(entry for entry in entries if entry.tool == DOPRI5)
    print(
        f"{'':53s}{'seconds per run':>26s}{'ms per':>11s}{'largest':>9s}{'counts':>11s}\n"
        f"{'tool':29s}{'setting':18s}{'runs':>6s}{'median (min..max)':>26s}{'trajectory':>11s}"
        f"{'|error|':>9s}{'as dopri5':>11s}"
    )
    for entry in entries:
        spread = f"{statistics.median(entry.seconds):.4f} ({min(entry.seconds):.4f}..{max(entry.seconds):.4f})"
        print(
            f"{entry.tool:29s}{entry.setting:18s}{entry.problem.size:6d}{spread:>26s}{entry.milliseconds:11.4g}"
            f"{entry.error:9.1e}{agreement(entry, counted):>11s}"
        )


def at_error(entries: list[Entry], tool: str, error: float) -> float:
    """Milliseconds a trajectory of a tool's cheapest setting that is as exact; infinite if none is."""
    return min((e.milliseconds for e in entries if e.tool == tool and e.error <= error), default=math.inf)


def write(path: Path, found: dict[float, list[Entry]]) -> None:
    """Write the table of all entries, by friction."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        rows = csv.writer(stream)
        rows.writerow(["mu", "tool", "setting", "runs", "ms_per_trajectory", "ms_least", "ms_most", "largest_error"])
        for mu, entries in found.items():
            for e in entries:
                least, most = (1e3 * some / e.problem.size for some in (min(e.seconds), max(e.seconds)))
                times = [f"{ms:.4g}" for ms in (e.milliseconds, least, most)]
                rows.writerow([f"{mu:g}", e.tool, e.setting, e.problem.size, *times, f"{e.error:.2g}"])


STYLES: dict[str, dict[str, Any]] = {
    AUTO: {"color": "C3", "linewidth": 2.2, "marker": "o"},
    f"{AUTO}{ALONE}": {"color": "C3", "linewidth": 1, "marker": "o", "fillstyle": "none"},
    DOPRI5: {"color": "C1", "linewidth": 2.2, "marker": "s"},
    f"{DOPRI5}{ALONE}": {"color": "C1", "linewidth": 1, "marker": "s", "fillstyle": "none"},
    BATCH: {"color": "C0", "marker": "^"},
    "numbalsoda DOP853": {"color": "C2", "marker": "v"},
    "numbalsoda LSODA": {"color": "C2", "marker": "<", "linestyle": "--"},
    "diffrax Tsit5": {"color": "C4", "marker": "D"},
    "SciPy DOP853, 1 process": {"color": "0.5", "marker": "x"},
    "SciPy LSODA, 1 process": {"color": "0.5", "marker": "+", "linestyle": "--"},
}
"""The curves of the picture."""


def draw(path: Path, found: dict[float, list[Entry]]) -> None:
    """Draw speed against error, a panel for each friction."""
    from matplotlib.figure import Figure

    figure = Figure((3.6 * len(found) + 0.6, 5), dpi=110, layout="constrained")
    grid = figure.subplots(1, len(found), sharey=True, squeeze=False).ravel()
    for axes, (mu, entries) in zip(grid, found.items(), strict=True):
        for tool, style in STYLES.items():
            some = sorted((e for e in entries if e.tool == tool), key=lambda e: e.milliseconds)
            axes.loglog([e.error for e in some], [e.milliseconds for e in some], label=tool, markersize=5, **style)
        axes.set(title=f"μ = {mu:g}", xlabel="largest error in spin", xlim=(2e-13, 1e-3))
        axes.grid(alpha=0.3)
    grid[0].set_ylabel("milliseconds per trajectory")
    handles, names = grid[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    figure.savefig(path)


def agreement(entry: Entry, counted: Entry) -> str:
    """How many counts agree with those of `counted`."""
    if entry.counts is None or counted.counts is None:
        return "—"
    same = entry.counts == counted.counts[np.searchsorted(counted.problem.b, entry.problem.b)]
    return f"{np.count_nonzero(same)}/{len(same)}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--mu", type=float, nargs="+", default=[60.0, 200.0, 1000.0])
    parser.add_argument("--bodies", type=int, default=1024, help=f"a multiple of {COMPARED}")
    parser.add_argument("--repeats", type=int, default=5, help="timed runs of each quick entry")
    parser.add_argument("--output", type=Path, default=Path("runs/peers"), help="folder for peers.csv and peers.png")
    options = parser.parse_args()
    if find_spec("heyoka") is None or find_spec("scipy") is None:
        parser.error("the reference needs heyoka and scipy: pip install -e .[peers]")
    if options.bodies < COMPARED or options.bodies % COMPARED:
        parser.error(f"--bodies must be a multiple of {COMPARED}, not {options.bodies}")

    if hasattr(os, "sched_setaffinity"):  # XLA cannot be limited to some of the processors otherwise.
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:THREADS])
    numba.set_num_threads(THREADS)
    options.output.mkdir(parents=True, exist_ok=True)
    found = dict[float, list[Entry]]()
    for mu in options.mu:
        print(f"\nμ = {mu:g}, T = {T_END:g}, {options.bodies} bodies with b = 2 … 8")
        found[mu] = prepare(Problem(mu, np.linspace(2.0, 8.0, options.bodies)))
        measure(found[mu], options.repeats)
        print_table(found[mu])
        for error in (1e-4, 1e-6, 1e-8):
            times = {tool: at_error(found[mu], tool, error) for tool in STYLES}
            ratios = ", ".join(f"{tool} {ms / times[AUTO]:.3g}" for tool, ms in times.items() if math.isfinite(ms))
            print(f"at an error of {error:g}, times as long as {AUTO}: {ratios}")
        write(options.output / "peers.csv", found)
        draw(options.output / "peers.png", found)


if __name__ == "__main__":
    main()

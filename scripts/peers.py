"""Speed against error of the kernel beside other tools.

The task is a small sweep: trajectories of the slip model from t = 0 to T with slightly different n0, which share
nothing.  Compared are

* the kernel itself with dopri5 and adams, with and without measurements,
* heyoka.py: Taylor series in batches of the machine's SIMD width, half of them in each of two threads,
* numbalsoda: compiled LSODA and DOP853 on the compiled right-hand side, in two threads,
* diffrax: jitted and vmapped, adaptive and with constant steps, on XLA's own threads,
* SciPy: DOP853 and LSODA on the compiled right-hand side, in one process, on a few trajectories.

All tools integrate the same right-hand side, that of `sweep.models.slip`, in double precision and on two processors.
Compilation is not timed, and the tools' runs take turns, so that other work on the machine affects all alike.  The
error is that of the spin at T, the largest over the trajectories, against heyoka's Taylor series in 80-bit arithmetic,
which is checked by SciPy's DOP853 at its tightest tolerance.  A setting's speed is given relative to heyoka's at one
fixed tolerance, and to the fastest of heyoka's settings that are at least as accurate.

    pip install -e .[peers]
    pip install numbalsoda        # optional: from source, needs cmake, a C++ and a Fortran compiler
    python scripts/peers.py [--output peers.png] [--quick]
"""

from __future__ import annotations

import argparse
import copy
import math
import os
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple
from tracing import traced_rhs

from sweep.engine.executor import execute
from sweep.jit import load_numba
from sweep.kernels.kernel import Kernel
from sweep.kernels.methods import make_kernel
from sweep.kernels.status import TIME_LIMIT
from sweep.models.model import Array, stack
from sweep.models.slip import MODEL

numba = load_numba()

THREADS = 2
T_END = 400.0

ADAMS_STEPS = (0.125, 0.1, 0.08, 0.0667, 0.05)

SLOW_SECONDS, SLOW_REPEATS = 3.0, 3
"""Runs that take longer than `SLOW_SECONDS` are repeated no more than `SLOW_REPEATS` times."""

HEYOKA = "heyoka batch"
BASE_TOLERANCE = 1e-5
HEYOKA_TOLERANCES = (1e-2, 1e-3, 1e-4, BASE_TOLERANCE, 1e-6, 1e-8, 1e-10)
STEPS = (0.04, 0.0333, 0.0286, 0.025, 0.02)
"""For mu = 60; stronger friction shortens them, as the stability of an explicit method requires."""

DOP853_TOLERANCES, LSODA_TOLERANCES = (1e-3, 1e-5, 1e-7), (1e-7, 1e-9, 1e-11)
SCIPY_TRAJECTORIES = 2
RTOL_TO_ATOL = 1e-3
"""Absolute over relative tolerance: the rattle's states are of order 1e-3."""


@dataclass(frozen=True)
class Problem:
    columns: dict[str, Array]
    states: Array
    """At t = 0, shape (states, trajectories)."""
    constants: Array

    @classmethod
    def of(cls, mu: float, trajectories: int) -> Problem:
        fixed = {"a": 10.0, "b": 3.0, "c": 1.0, "delta": 0.03, "mu": mu, "x0": 0.01, "y0": 0.01}
        columns = {name: np.full(trajectories, value) for name, value in fixed.items()}
        columns["n0"] = 0.05 * (1 + 1e-3 * np.arange(trajectories) / trajectories)
        return cls(columns, stack(MODEL.start(columns)), stack(MODEL.constants.of(columns)))

    @property
    def size(self) -> int:
        return self.states.shape[1]

    def step(self, nominal: float) -> float:
        return float(nominal * min(1.0, 60.0 / self.columns["mu"][0]))

    def part(self, which: Any) -> Problem:
        columns = {name: column[which] for name, column in self.columns.items()}
        return Problem(columns, self.states[:, which], self.constants[:, which])

    def spin(self, states: Array) -> Array:
        """The spins of states of shape (states, trajectories)."""
        return np.asarray(MODEL.rhs(states, MODEL.constants(*self.constants))[1][0])


@dataclass
class Entry:
    """One setting of one tool, and what was measured."""

    tool: str
    setting: str
    solve: Callable[[], Array]
    """Runs all trajectories and returns their states at T, shape (states, trajectories)."""
    problem: Problem
    error: float = math.nan
    seconds: list[float] = field(default_factory=list)

    def run(self) -> tuple[Array, float]:
        began = time.perf_counter()
        states = self.solve()
        return states, time.perf_counter() - began

    @property
    def milliseconds(self) -> float:
        """Per trajectory, of the median run."""
        return 1e3 * statistics.median(self.seconds) / self.problem.size


def count_constants() -> int:
    return len(MODEL.constants._fields)


def in_threads(run: Callable[[Any], Array], items: Iterable[Any]) -> list[Array]:
    return list(thread_pool().map(run, items))


@cache
def thread_pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(THREADS)


# --- ours -------------------------------------------------------------------------------------


def our_entries(problem: Problem, quick: bool) -> Iterator[Entry]:
    for measure in ((), ("reversals", "energy_error")):
        kernel = make_kernel("dopri5", MODEL, measure)
        tool = "sweep, measuring" if measure else "sweep"
        for step in map(problem.step, STEPS[1::2] if quick else STEPS):
            yield Entry(tool, f"dopri5 h={step:g}", our_run(problem, kernel, step), problem)
        stiff = make_kernel("adams", MODEL, measure)
        for step in ADAMS_STEPS[1::2] if quick else ADAMS_STEPS:
            yield Entry(f"{tool} (adams)", f"adams h={step:g}", our_run(problem, stiff, step), problem)


def our_run(problem: Problem, kernel: Kernel, step: float) -> Callable[[], Array]:
    """Whole runs, including the preparation of the images, where adams has its start-up."""
    steps = np.full(problem.size, step)

    def run() -> Array:
        images = kernel.images(problem.columns, steps, T_END)
        execute(kernel, images, stop_when_settled=False)
        finished = images[:, kernel.row("status")] == TIME_LIMIT
        return np.where(finished, kernel.model_states(images), np.nan)

    return run


# --- heyoka.py --------------------------------------------------------------------------------


def heyoka_entries(problem: Problem, quick: bool) -> Iterator[Entry]:
    import heyoka

    recommended = heyoka.recommended_simd_size()
    for size in sorted({min(size, problem.size) for size in (8, recommended)}):
        tool = HEYOKA if size == min(recommended, problem.size) else f"{HEYOKA} of {size}"
        for tolerance in HEYOKA_TOLERANCES[::3] if quick else HEYOKA_TOLERANCES:
            work = heyoka_run(problem, heyoka_system(), tolerance, size)
            yield Entry(tool, f"tol={tolerance:g} batch={size}", work, problem)
    for compact in (False, True):
        work = heyoka_run(problem, textbook_system(), BASE_TOLERANCE, recommended, compact)
        setting = f"tol={BASE_TOLERANCE:g}{' compact' if compact else ''}"
        yield Entry("heyoka, equations as written", setting, work, problem)


def heyoka_system() -> list[tuple[Any, Any]]:
    import heyoka

    states = heyoka.make_vars(*MODEL.states)
    parameters = tuple(heyoka.par[i] for i in range(count_constants()))
    slopes, _ = traced_rhs(MODEL, heyoka.sqrt)(tuple(states), parameters)
    return list(zip(states, slopes, strict=True))


def textbook_system() -> list[tuple[Any, Any]]:
    """The equations as a user would copy them from the paper, vector by vector, without our algebra."""
    import heyoka

    def cross(a: Any, b: Any) -> list[Any]:
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    def dot(a: Any, b: Any) -> Any:
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

    def total(*vectors: Any) -> list[Any]:
        return [sum(parts[1:], parts[0]) for parts in zip(*vectors, strict=True)]

    def scaled(factor: Any, v: Any) -> list[Any]:
        return [factor * x for x in v]

    states = heyoka.make_vars(*MODEL.states)
    u1, u2, *omega, v1, v2 = states
    A11, A12, A22, A33, *inverse, _, _, _, mu = (heyoka.par[i] for i in range(count_constants()))
    u = [u1, u2, -heyoka.sqrt(1.0 - u1 * u1 - u2 * u2)]
    v = [v1, v2, -(v1 * u1 + v2 * u2) / u[2]]

    def shape(w: Any) -> list[Any]:
        return [A11 * w[0] + A12 * w[1], A12 * w[0] + A22 * w[1], A33 * w[2]]

    r = heyoka.sqrt(dot(u, shape(u)))
    x_p = scaled(-1.0 / r, shape(u))
    du = cross(u, omega)
    dx_p = total(scaled(-1.0 / r, shape(du)), scaled(dot(du, shape(u)) / r**3, shape(u)))
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


def heyoka_run(
    problem: Problem, system: list[tuple[Any, Any]], tolerance: float, size: int, compact: bool = False
) -> Callable[[], Array]:
    """Batches of `size` trajectories; the last batch is filled up with copies of the last trajectory."""
    import heyoka

    batches = np.minimum(np.arange(problem.size + -problem.size % size), problem.size - 1).reshape(-1, size)
    # compact_mode=True takes three times as long here; force_avx512 and slp_vectorize change nothing.
    original = heyoka.taylor_adaptive_batch(
        system,
        state=problem.states[:, batches[0]],
        pars=problem.constants[:, batches[0]],
        tol=tolerance,
        compact_mode=compact,
        fast_math=True,
    )
    integrators = [original] + [copy.copy(original) for _ in range(THREADS - 1)]

    def run_share(share: int) -> Array:
        integrator, results = integrators[share], []
        for batch in batches[share::THREADS]:
            integrator.set_time(0.0)
            integrator.state[:] = problem.states[:, batch]
            integrator.pars[:] = problem.constants[:, batch]
            integrator.propagate_until(T_END)
            results.append(integrator.state.copy())
        return np.array(results).reshape(-1, len(MODEL.states), size)

    def run() -> Array:
        states = np.empty((len(batches), len(MODEL.states), size))
        for share, result in enumerate(in_threads(run_share, range(THREADS))):
            states[share::THREADS] = result
        return np.concatenate(states, axis=1)[:, : problem.size]

    return run


def taylor_reference(problem: Problem) -> Array:
    """States at T from Taylor series in extended precision (80 bits on x86)."""
    import heyoka

    real = np.longdouble
    states = np.empty_like(problem.states)
    integrator = heyoka.taylor_adaptive(
        heyoka_system(),
        state=list(problem.states[:, 0].astype(real)),
        pars=list(problem.constants[:, 0].astype(real)),
        fp_type=real,
        tol=np.finfo(real).eps,
        compact_mode=True,
    )
    for i in range(problem.size):
        integrator.time = real(0)
        integrator.state[:] = problem.states[:, i]
        integrator.pars[:] = problem.constants[:, i]
        integrator.propagate_until(real(T_END))
        states[:, i] = integrator.state
    return states


# --- SciPy ------------------------------------------------------------------------------------


@cache
def compiled_rhs() -> Any:
    """Compiled (t, states, constants) -> slopes, on arrays."""
    rhs, constants_of, n_states, n_constants = MODEL.rhs, MODEL.constants, len(MODEL.states), count_constants()

    @numba.njit(error_model="numpy")
    def slopes(_t: float, y: Array, p: Array) -> Array:
        return np.array(rhs(to_fixed_tuple(y, n_states), constants_of(*to_fixed_tuple(p, n_constants)))[0])

    return slopes


def scipy_states(problem: Problem, method: str, rtol: float, atol: float) -> Array:
    from scipy.integrate import solve_ivp

    ends = [
        solve_ivp(compiled_rhs(), (0, T_END), y, method, t_eval=[T_END], args=(p,), rtol=rtol, atol=atol).y[:, -1]
        for y, p in zip(problem.states.T.copy(), problem.constants.T.copy(), strict=True)
    ]
    return np.array(ends).T


def scipy_entries(problem: Problem, quick: bool) -> Iterator[Entry]:
    few = problem.part(np.unique(np.linspace(0, problem.size - 1, SCIPY_TRAJECTORIES, dtype=int)))
    for method, tolerances in (("DOP853", DOP853_TOLERANCES), ("LSODA", LSODA_TOLERANCES)):
        for rtol in tolerances[1:2] if quick else tolerances:
            run = partial(scipy_states, few, method, rtol, rtol * RTOL_TO_ATOL)
            yield Entry("SciPy, 1 process", f"{method} rtol={rtol:g}", run, few)


# --- numbalsoda -------------------------------------------------------------------------------


def numbalsoda_entries(problem: Problem, quick: bool) -> Iterator[Entry]:
    import numbalsoda

    address = numbalsoda_rhs().address
    for method, tolerances in ((numbalsoda.dop853, DOP853_TOLERANCES), (numbalsoda.lsoda, LSODA_TOLERANCES)):
        for rtol in tolerances[1:2] if quick else tolerances:
            run = numbalsoda_run(problem, method, address, rtol)
            yield Entry(f"numbalsoda {method.__name__}", f"rtol={rtol:g}", run, problem)


@cache
def numbalsoda_rhs() -> Any:
    import numbalsoda

    rhs, constants_of, n_states, n_constants = MODEL.rhs, MODEL.constants, len(MODEL.states), count_constants()

    @numba.cfunc(numbalsoda.lsoda_sig, error_model="numpy")
    def callback(_t: float, y: Any, dy: Any, p: Any) -> None:
        states, constants = numba.carray(y, (n_states,)), numba.carray(p, (n_constants,))
        slopes, _ = rhs(to_fixed_tuple(states, n_states), constants_of(*to_fixed_tuple(constants, n_constants)))
        for i in range(n_states):
            dy[i] = slopes[i]

    return callback


def numbalsoda_run(problem: Problem, method: Any, address: int, rtol: float) -> Callable[[], Array]:
    times, states, constants = np.array([0.0, T_END]), problem.states.T.copy(), problem.constants.T.copy()

    @numba.njit(nogil=True)
    def solve(y: Array, p: Array) -> Array:
        result, success = method(address, y, times, p, rtol, rtol * RTOL_TO_ATOL, 10**8)
        return result[-1] if success else np.full_like(y, np.nan)

    solve(states[0], constants[0])  # Compiled before threads ask for it.
    return lambda: np.array(in_threads(lambda i: solve(states[i], constants[i]), range(problem.size))).T


# --- diffrax ----------------------------------------------------------------------------------


def diffrax_entries(problem: Problem, quick: bool) -> Iterator[Entry]:
    import diffrax

    for solver in (diffrax.Dopri5(), diffrax.Tsit5()):
        name = type(solver).__name__
        for rtol in (1e-6,) if quick else (1e-4, 1e-6, 1e-8):
            controller = diffrax.PIDController(rtol=rtol, atol=rtol * RTOL_TO_ATOL)
            run = diffrax_run(problem, solver, controller, 0.01)
            yield Entry(f"diffrax {name}", f"adaptive rtol={rtol:g}", run, problem)
        for step in map(problem.step, STEPS[3:4] if quick else (STEPS[1], *STEPS[3:])):
            run = diffrax_run(problem, solver, diffrax.ConstantStepSize(), step)
            yield Entry(f"diffrax {name}, constant", f"h={step:g}", run, problem)


def diffrax_run(problem: Problem, solver: Any, controller: Any, first_step: float) -> Callable[[], Array]:
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    rhs = traced_rhs(MODEL, jnp.sqrt)
    term = diffrax.ODETerm(lambda _t, y, p: jnp.stack(rhs(tuple(y), tuple(p))[0]))

    def solve(y: Any, p: Any) -> Any:
        return diffrax.diffeqsolve(
            term, solver, 0.0, T_END, first_step, y, p,
            stepsize_controller=controller, max_steps=None, adjoint=diffrax.ForwardMode(), throw=False,
        ).ys[0]  # fmt: skip

    # In one call: two Python threads with half the trajectories each are no faster.
    solve_all = jax.jit(jax.vmap(solve))
    states, constants = jnp.asarray(problem.states.T), jnp.asarray(problem.constants.T)
    return lambda: np.asarray(solve_all(states, constants)).T


# --- all of them ------------------------------------------------------------------------------

TOOLS: dict[str, Callable[[Problem, bool], Iterator[Entry]]] = {
    "sweep": our_entries,
    "heyoka": heyoka_entries,
    "numbalsoda": numbalsoda_entries,
    "diffrax": diffrax_entries,
    "scipy": scipy_entries,
}
"""Functions that make the entries, by the module that each needs."""


def reference_spins(problem: Problem) -> Array:
    """Spins at T; prints how well two independent methods agree on them."""
    few = problem.part(slice(0, SCIPY_TRAJECTORIES))
    by_taylor = problem.spin(taylor_reference(problem))
    by_scipy = few.spin(scipy_states(few, "DOP853", 1e-13, 1e-16))
    difference = np.abs(by_taylor[: few.size] - by_scipy).max()
    print(f"reference: Taylor series in extended precision; SciPy's DOP853 at rtol=1e-13 differs by {difference:.1e}")
    return by_taylor


def prepare(problem: Problem, quick: bool, reference: Array) -> list[Entry]:
    """Entries of the installed tools, compiled by an untimed run, which also gives their errors."""
    sound = []
    for module, make in TOOLS.items():
        if find_spec(module) is None:
            print(f"{module}: not installed")
            continue
        for entry in make(problem, quick):
            states, _ = entry.run()
            spins = entry.problem.spin(states)
            exact = reference[np.searchsorted(problem.columns["n0"], entry.problem.columns["n0"])]
            entry.error = float(np.abs(spins - exact).max())
            if math.isfinite(entry.error):
                sound.append(entry)
            else:
                print(f"{entry.tool} {entry.setting}: diverged, left out")
    return sound


def measure(entries: list[Entry], repeats: int) -> None:
    """Time all entries in turns, the slow ones less often."""
    for _ in range(repeats):
        for entry in entries:
            if len(entry.seconds) < SLOW_REPEATS or statistics.median(entry.seconds) < SLOW_SECONDS:
                entry.seconds.append(entry.run()[1])


def print_table(entries: list[Entry]) -> None:
    peers = [entry for entry in entries if entry.tool == HEYOKA]
    base = next((e.milliseconds for e in peers if e.setting.startswith(f"tol={BASE_TOLERANCE:g} ")), math.nan)
    print(
        f"\n{'':46s}{'seconds per run':>26s}{'ms per':>11s}{'trajectories':>14s}{'largest':>10s}"
        f"{'speed over heyoka':>21s}\n"
        f"{'tool':25s}{'setting':21s}{'median (min..max)':>26s}{'trajectory':>11s}{'per second':>14s}{'|error|':>10s}"
        f"{f'tol={BASE_TOLERANCE:g}':>11s}{'as exact':>10s}"
    )
    for entry in entries:
        spread = f"{statistics.median(entry.seconds):.4f} ({min(entry.seconds):.4f}..{max(entry.seconds):.4f})"
        as_exact = min((e.milliseconds for e in peers if e.error <= entry.error), default=math.nan)
        print(
            f"{entry.tool:25s}{entry.setting:21s}{spread:>26s}{entry.milliseconds:11.3f}"
            f"{1e3 / entry.milliseconds:14.1f}{entry.error:10.1e}"
            f"{base / entry.milliseconds:11.3f}{as_exact / entry.milliseconds:10.3f}"
        )
    print("as exact: over the fastest setting of heyoka with no larger error; nan where there is none")


def draw(entries: list[Entry], mu: float, output: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.add_subplot()
    for marker, tool in enumerate(dict.fromkeys(entry.tool for entry in entries)):
        points = sorted((entry.error, entry.milliseconds) for entry in entries if entry.tool == tool)
        axes.loglog(*zip(*points, strict=True), marker="osD^v<>Ph*"[marker % 10], label=tool)
    axes.set(
        xlabel=f"largest error of the spin at t = {T_END:g}",
        ylabel=f"milliseconds per trajectory ({THREADS} threads)",
        title=f"Slip model, a = 10, b = 3, δ = 0.03, μ = {mu:g}, n₀ ≈ 0.05",
    )
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(fontsize="small")
    figure.savefig(output, dpi=150)


def keep_stdout() -> None:
    """Keep standard output for Python: numbalsoda's Fortran prints there whenever it detects stiffness."""
    own = os.dup(sys.stdout.fileno())
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())
    sys.stdout = os.fdopen(own, "w", buffering=1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--mu", type=float, default=60.0)
    parser.add_argument("--trajectories", type=int, default=64)
    parser.add_argument("--repeats", type=int, default=7, help="timed runs of each quick entry")
    parser.add_argument("--output", type=Path, help="draw speed against error into this file")
    parser.add_argument("--quick", action="store_true", help="fewer settings of each tool")
    options = parser.parse_args()
    if find_spec("heyoka") is None or find_spec("scipy") is None:
        parser.error("the reference needs heyoka and scipy: pip install -e .[peers]")

    if hasattr(os, "sched_setaffinity"):  # XLA cannot be limited to some of the processors otherwise.
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:THREADS])
    numba.set_num_threads(THREADS)
    keep_stdout()
    problem = Problem.of(options.mu, options.trajectories)
    entries = prepare(problem, options.quick, reference_spins(problem))
    measure(entries, options.repeats)
    print_table(entries)
    if options.output:
        draw(entries, options.mu, options.output)


if __name__ == "__main__":
    main()

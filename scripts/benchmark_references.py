"""The cases of `data/benchmark` and their references: spins and reversals by two methods that share nothing.

* Taylor series (heyoka.py) of the equations of `data/benchmark/example_scipy.py`: u, ω and v_g, or u and ω of a body
  that rolls.  They give the numbers of the tables;
* nine-stage Radau IIA collocation (`reference_spins.py`) of the package's equations: u1, u2, ω and two components of
  v_p, or u1, u2 and ω.  The difference of the two is the error bound.

Both are in 80-bit arithmetic.  Parameters are the double-precision numbers nearest to the decimals of cases.csv;
everything else is computed from them in 80 bits.  Reversals are those of `data/README.md`.

    python scripts/benchmark_references.py FOLDER [CASE ...]

With names, only these cases are computed.
"""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import heyoka
import numpy as np
from reference_spins import STANDARD, Case, Extended, Rhs, first_times, problem, radau_path
from reversals import Means, window_and_ripple

from sweep.models import find
from sweep.models.model import Array

FOLDER = Path(__file__).parents[1] / "data" / "benchmark"
sys.path.append(str(FOLDER))
import example_scipy as example  # noqa: E402  # from a folder of data

SHORT, LONG, STIFF, SECONDS = (50, 100, 200, 400), (100, 400, 1000, 2000, 3000), (25, 50), (1, 2, 3, 5, 8, 12)

BODIES = (2.0, 3.0, 4.0, 6.0, 8.0)
KANE_LEVINSON = {
    "a": 0.2, "b": 0.03, "c": 0.02, "gravity": 9.81, "offset": 0.01, "mass": 1.0,
    "Ixx": 2.0e-4, "Iyy": 1.6e-3, "Izz": 1.7e-3, "Ixy": -2.0e-5, "roll": 0.5 * np.pi / 180, "pitch": 0.5 * np.pi / 180,
}  # fmt: skip
"""In SI units; the angles are half a degree."""

WIDE = {
    0: "large δ, slips little",
    10: "a needle: 49 times as long as it is high",
    23: "a needle that presses the plane with a quarter of its weight at least",
    28: "small and fast, slips little",
    35: "nearly round",
    41: "nearly round and small",
    43: "strong rattle, the most sensitive one",
    45: "a plate",
}
"""Rows of `data/reference_wide.csv`."""

STEPS_A_PERIOD = {"slip": (10, 30), "roll": (60,)}
"""Steps of Radau in a period of the fastest rocking: more, where the methods differ by more than `ENOUGH`."""
ENOUGH = 1e-13
TOLERANCE = 1.1e-19
UNIT = 2.0**-100
"""What vanishes in upright spin is integrated in these units.  heyoka's tolerance is relative to the largest state, and
so it is relative to the rattle, however small that gets."""

LARGEST_BOUND = 1e-11
"""Of the spins; beyond it a time is left out."""
LEAST_SPIN, LEAST_TIME = 1e-18, 5e-7
"""Bounds of what the tables print: of the spins' last digits, and of reversals' times to six decimals."""
LEAST_FORCE = 0.1
"""In units of the weight: below it, lift-off between two steps cannot be excluded."""
GRAZING = 1e-6
"""A count is firm if no mean turns back this close to zero, relative to the largest."""

PARAMETERS = ("a", "b", "c", "delta", "mu", "n0", "x0", "y0", "gravity", "offset", "mass", "Ixx", "Iyy", "Izz", "Ixy",
              "sigma", "roll", "pitch", "omega3")  # fmt: skip
RIPPLE = ("window", "K11", "K12", "K21", "K22")


# --- cases ------------------------------------------------------------------------------------


def all_cases() -> dict[str, tuple[Case, tuple[int, ...], str]]:
    """Parameters, times and what is special, by name."""
    cases = {}
    for mu in (60.0, 200.0, 1000.0):
        for b in BODIES:
            cases[f"mu{mu:g}_b{b:g}"] = STANDARD | {"mu": mu, "b": b}, SHORT, "friction and width"
    for name, change, why in (
        ("mu1", {"mu": 1.0}, "slips most of the time"),
        ("thin", {"mu": 100.0, "b": 1.5}, "thin"),
        ("round", {"mu": 100.0, "b": 9.0}, "nearly round"),
        ("fast", {"mu": 100.0, "n0": 0.1}, "twice as fast"),
        ("backward", {"mu": 100.0, "n0": -0.05}, "the other sense of spin"),
        ("rattle", {"mu": 100.0, "x0": 2.0}, "a large rattle"),
        ("skew", {"mu": 100.0, "delta": 0.2}, "large δ: errors grow a million times"),
    ):
        cases[name] = STANDARD | change, SHORT, why
    with (FOLDER.parent / "reference_wide.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    for row, why in WIDE.items():
        cases[f"wide{row}"] = {name: float(rows[row][name]) for name in PARAMETERS[:8]}, SHORT, why
    for sigma in (0.0, 1e-4):
        for omega3 in (-5.0, 5.0):
            name = f"kane_levinson_{'left' if omega3 < 0 else 'right'}{'_damped' if sigma else ''}"
            why = "Kane and Levinson 1982, in SI units"
            cases[name] = KANE_LEVINSON | {"sigma": sigma, "omega3": omega3}, SECONDS, why
    for mu, b, times in ((60.0, 3.0, LONG), (100.0, 5.0, LONG), (200.0, 3.0, LONG), (1000.0, 3.0, LONG[:3])):
        cases[f"long_mu{mu:g}_b{b:g}"] = STANDARD | {"mu": mu, "b": b}, times, "long"
    for b in BODIES:
        cases[f"mu10000_b{b:g}"] = STANDARD | {"mu": 1e4, "b": b}, STIFF, "stiff"
    cases["mu100000"] = STANDARD | {"mu": 1e5}, STIFF[:1], "very stiff"
    return cases


def rolls(case: Case) -> bool:
    return "sigma" in case


def model_of(case: Case) -> str:
    return "roll" if rolls(case) else "slip"


def window_of(case: Case) -> tuple[float, Array]:
    """The window and K (2 × 2)."""
    (A11, A22, A33, A12), inertia, _ = example.slipping_body(case)
    return window_and_ripple(np.array([[A11, A12, 0], [A12, A22, 0], [0, 0, A33]]), np.array(inertia))


def half_windows(case: Case, end: float) -> Array:
    """Times of all halves of the window up to the end; none for a body that rolls."""
    if rolls(case):
        return np.empty(0)
    half = window_of(case)[0] / 2
    return half * np.arange(1, np.floor(end / half) + 1)


def ripple_free_of(y: Any, A: Any, inertia: Any, K: Any, numbers: Any) -> Any:
    """n* of the package's states u1, u2, ω, v1 and v2."""
    u1, u2, *omega, v1, v2 = y
    u = [u1, u2, -numbers.sqrt(1.0 - (u1 * u1 + u2 * u2))]
    v_p = [v1, v2, -(v1 * u1 + v2 * u2) / u[2]]
    _, x_p, _ = example.contact(u, omega, A, numbers)
    return ripple_free(u, omega, example.add(v_p, example.cross(x_p, omega)), x_p, inertia, K)


def ripple_free(u: Any, omega: Any, v_g: Any, x_p: Any, inertia: Any, K: Any) -> Any:
    """n* of `data/README.md`."""
    M = example.add(example.moment_of(omega, inertia), example.scaled(-1, example.cross(x_p, v_g)))
    ripple = sum(K[i, j] * u[i] * M[j] for i in range(2) for j in range(2))
    return example.dot(u, omega) - ripple


# --- Taylor series ----------------------------------------------------------------------------


ZEROS: list[float] = []
"""Times at which the spin itself is zero, of the latest run: what an integrator refers to is copied with it."""


def note_zero(_integrator: Any, when: Any, _sign: int) -> None:
    ZEROS.append(float(when))


class Taylor:
    """An integrator of the equations of a model of the benchmark; the first of nine states of `slip` are u, ω and v_g,
    the tenth is the integral of n*."""

    def __init__(self, model: str) -> None:
        self.model = model
        names = ["u1", "u2", "u3", "w1", "w2", "w3", *(["v1", "v2", "v3", "integral"] if model == "slip" else [])]
        symbols, par = heyoka.make_vars(*names), heyoka.par
        self.scale = np.array([1.0 if name in ("u3", "w3", "integral") else UNIT for name in names])
        states = [symbol * unit for symbol, unit in zip(symbols, self.scale, strict=True)]
        if model == "slip":
            body = tuple(par[i] for i in range(4)), tuple(par[i] for i in range(4, 7)), par[7]
            K = np.array([par[i] for i in range(8, 12)], dtype=object).reshape(2, 2)
            _, x_p, _ = example.contact(states[0:3], states[3:6], body[0], heyoka)
            n_star = ripple_free(states[0:3], states[3:6], states[6:9], x_p, body[1], K)
            slopes = [*example.slipping(states, body, heyoka), n_star]
        else:
            body = tuple(par[i] for i in range(4)), tuple(par[i] for i in range(4, 8)), par[8], par[9], par[10]
            slopes = example.rolling(states, body, heyoka)
        self.integrator = heyoka.taylor_adaptive(
            [(symbol, slope * (1 / unit)) for symbol, slope, unit in zip(symbols, slopes, self.scale, strict=True)],
            state=np.zeros(len(names), Extended),
            pars=np.ones(12 if model == "slip" else 11, Extended),
            fp_type=Extended,
            tol=Extended(TOLERANCE),
            compact_mode=True,
            nt_events=[heyoka.nt_event(example.dot(states[0:3], states[3:6]), note_zero, fp_type=Extended)],
        )

    def run(self, case: Case, times: Array, edges: Array) -> tuple[Array, Array]:
        """Spins at the times, and integrals of n* at the edges."""
        exact = {name: Extended(value) for name, value in case.items()}
        body_of, start_of, _ = example.MODELS[self.model]
        body = body_of(exact, np)
        start = start_of(exact, body, np)
        numbers = [x for part in body for x in (part if isinstance(part, (tuple, list)) else [part])]
        if self.model == "slip":
            start, numbers = [*start, 0.0], [*numbers, *window_of(case)[1].ravel()]
        self.integrator.time = Extended(0)
        self.integrator.state[:] = np.array(start, Extended) / self.scale
        self.integrator.pars[: len(numbers)] = numbers
        ZEROS.clear()
        spins, integrals = {}, {}
        for t in np.union1d(times, edges):
            self.integrator.propagate_until(Extended(t))
            state = self.integrator.state * self.scale
            spins[t], integrals[t] = example.dot(state[0:3], state[3:6]), state[-1]
        return np.array([spins[t] for t in times]), np.array([integrals[t] for t in edges])


# --- Radau ------------------------------------------------------------------------------------


def package_equations(case: Case) -> tuple[Array, Rhs, Callable[[Array], tuple[Any, Any]]]:
    """States at t = 0 of the package's model, right-hand side, and (states) -> spin and normal force by weight.

    A last state of a body that slips is the integral of n*.
    """
    model = find("noslip+solid+sigma+offset+gravity" if rolls(case) else "slip")
    states, numbers = problem(model, {"omega1": 0.0, "omega2": 0.0} | case, Extended)
    constants, weight = model.constants(*numbers), case.get("gravity", 1.0)

    def seen(y: Array) -> tuple[Any, Any]:
        _, (spin, _, R, _) = model.rhs(tuple(y[: len(model.states)]), constants)
        return spin, R / weight

    if rolls(case):
        return np.array(states), lambda y: model.rhs(tuple(y), constants)[0], seen
    _, inertia, _ = example.slipping_body({name: Extended(value) for name, value in case.items()}, np)
    A, K = (constants.A11, constants.A22, constants.A33, constants.A12), window_of(case)[1].astype(Extended)

    def rhs(y: Array) -> Any:
        return [*model.rhs(tuple(y[:7]), constants)[0], ripple_free_of(y[:7], A, inertia, K, np)]

    return np.array([*states, 0]), rhs, seen


def fastest_period(case: Case) -> float:
    """Period of the faster rocking about upright rest without slip."""
    body_of, _, _ = example.MODELS[model_of(case)]
    (A11, A22, A33, A12), inertia, *_ = body_of(case)
    c, g = np.sqrt(A33), case.get("gravity", 1.0)
    height = c - case.get("offset", 0.0)
    I12 = inertia[3] if rolls(case) else 0.0
    # A tilt φ about the x and y axes raises the centre of mass by φᵀ stiffness φ / 2.
    stiffness = g * (np.array([[A22, -A12], [-A12, A11]]) / c - height * np.eye(2))
    moments = np.array([[inertia[0], I12], [I12, inertia[1]]]) + height**2 * np.eye(2)
    return float(2 * np.pi / np.sqrt(np.linalg.eigvals(np.linalg.solve(moments, stiffness)).real.max()))


def radau_run(case: Case, times: Array, edges: Array, steps: int) -> tuple[Array, Array, float]:
    """As `Taylor.run`, with `steps` steps a period, and the least normal force by weight, seen at all of them."""
    states, rhs, seen = package_equations(case)
    longest, stops = fastest_period(case) / steps, np.union1d(times, edges)
    passed = [Extended(0)] if rolls(case) else [t for t in first_times(case, longest) if t < stops[0]]
    spins, integrals, least = {}, {}, np.inf
    for stop, reached in radau_path(rhs, states, passed, stops, longest):
        spin, force = seen(reached)
        least = min(least, float(force))
        spins[stop], integrals[stop] = spin, reached[-1]
    return np.array([spins[t] for t in times]), np.array([integrals[t] for t in edges]), least


# --- reversals --------------------------------------------------------------------------------


def firm_reversals(ours: Array, others: Array, window: float) -> tuple[Array, float] | None:
    """Times of the reversals and the largest difference of the two methods; None if the count is not firm."""
    means, again = (Means(window, [0, *integrals]) for integrals in (ours, others))
    if not means.reversals() == again.reversals() == means.reversals(1):
        return None
    if any(means.closest(shift) <= GRAZING * np.abs(means.averages(shift)).max() for shift in (0, 1)):
        return None
    times = means.times().astype(float)
    return times, float(np.abs(times - again.times()).max(initial=0.0))


# --- the tables -------------------------------------------------------------------------------


HEADERS = {
    "cases.csv": ["case", "model", "times", *PARAMETERS, *RIPPLE, "why"],
    "references.csv": ["case", "t", "spin", "error_bound"],
    "reversals.csv": ["case", "kind", "until", "reversals", "times", "error_bound"],
}


def compute(name: str, case: Case, times: Array, taylor: Taylor) -> SimpleNamespace:
    """All that the tables tell of a case."""
    edges = half_windows(case, times[-1])
    spins, integrals = taylor.run(case, times, edges)
    zeros = list(ZEROS)
    for steps in STEPS_A_PERIOD[model_of(case)]:
        others, again, least = radau_run(case, times, edges, steps)
        bounds = np.abs(spins - others).astype(float)
        if bounds.max() < ENOUGH:
            break
    assert least > LEAST_FORCE, f"{name}: the body nearly lifts off, {least}"
    last_zero = np.array(zeros[-1:]), None
    found = last_zero if rolls(case) else firm_reversals(integrals, again, 2 * edges[0])
    return SimpleNamespace(spins=spins, bounds=bounds, reversals=found, least=least)


def rows_of(name: str, case: Case, times: Array, why: str, found: SimpleNamespace) -> list[list[list[str]]]:
    """What the three tables say of a case."""
    ripple = [""] * len(RIPPLE)
    if not rolls(case):
        window, K = window_of(case)
        ripple = [f"{value:.12g}" for value in (window, *K.ravel())]
    sound = found.bounds <= LARGEST_BOUND
    kept = times[sound]
    numbers = [repr(float(case[parameter])) if parameter in case else "" for parameter in PARAMETERS]
    cases = [[name, model_of(case), " ".join(f"{t:g}" for t in kept), *numbers, *ripple, why]]
    references = [
        [name, f"{t:g}", np.format_float_scientific(spin, 18), f"{max(bound, LEAST_SPIN):.1e}"]
        for t, spin, bound in zip(kept, found.spins[sound], found.bounds[sound], strict=True)
    ]
    reversals = []
    if found.reversals is not None:
        when, bound = found.reversals
        kind = "last zero" if rolls(case) else "window means"
        said = "" if bound is None else f"{max(bound, LEAST_TIME):.1e}"
        reversals.append([name, kind, f"{times[-1]:g}", str(len(when)), " ".join(f"{t:.6f}" for t in when), said])
    return [cases, references, reversals]


def main(folder: Path, chosen: list[str]) -> None:
    """Write the tables of the chosen cases, by default of all, and a line for each case to the terminal."""
    cases = all_cases()
    integrators = {"slip": Taylor("slip"), "roll": Taylor("roll")}
    tables = {name: [header] for name, header in HEADERS.items()}
    for name in chosen or cases:
        case, ends, why = cases[name]
        times, began = np.array(ends, float), time.process_time()
        found = compute(name, case, times, integrators[model_of(case)])
        for table, rows in zip(tables.values(), rows_of(name, case, times, why, found), strict=True):
            table += rows
        seconds = time.process_time() - began
        print(f"{name} {found.bounds} {found.reversals} R > {found.least:.3f}, {seconds:.0f} s", flush=True)
    for name, table in tables.items():
        with (folder / name).open("w", encoding="utf-8", newline="") as stream:
            csv.writer(stream, lineterminator="\n").writerows(table)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])

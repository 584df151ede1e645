"""Reference spins n(t) in extended precision, to measure the errors of kernels and methods against.

The equations are the package's own right-hand sides, traced into other arithmetic: the table checks
integration, not derivation.  Two methods share nothing but the equations:

* Taylor series (heyoka.py) in 128-bit arithmetic, and in 80-bit arithmetic for comparison;
* nine-stage Radau IIA collocation in 80-bit arithmetic on the slip model.  It gives the spins of the table where
  friction makes the steps of the 128-bit series too short (`STIFF`), and serves for comparison elsewhere.

Parameters are the double-precision numbers nearest to the decimals in the table.  Everything computed from them
(constants, starts) is computed in the arithmetic of the integration.

    python scripts/reference_spins.py sweep/bench/data/reference_spins.csv
"""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import heyoka
import numpy as np
from numpy.polynomial import legendre
from tracing import taylor_system

from sweep.models import MODELS
from sweep.models.ladder import slip
from sweep.models.model import Array, Model

Case = dict[str, float]
Rhs = Callable[[Array], Any]
"""From states, shape (states,) or (states, points), to their derivatives."""

Extended, Quadruple = np.longdouble, heyoka.real128

TIMES = np.arange(25, 401, 25)
PARAMETERS = ("a", "b", "c", "delta", "mu", "n0", "x0", "y0")
STANDARD = {"a": 10.0, "b": 3.0, "c": 1.0, "delta": 0.03, "n0": 0.05, "x0": 0.01, "y0": 0.01}

SLIP = [STANDARD | {"mu": mu} for mu in (1.0, 20.0, 60.0, 200.0, 1000.0)]
SLIP += [
    STANDARD | {"mu": 100.0} | change
    for change in ({"b": 1.5}, {"b": 9.0}, {"n0": 0.1}, {"n0": -0.05}, {"x0": 2.0}, {"delta": 0.2})
]
STIFF = [STANDARD | {"mu": mu} for mu in (1e4, 1e5)]
BODIES = [
    STANDARD,
    STANDARD | {"b": 6.0, "n0": 0.1},
    STANDARD | {"b": 2.0, "n0": -0.05},
    {"a": 5.0, "b": 2.0, "c": 0.7, "delta": -0.05, "n0": 0.03, "x0": 0.02, "y0": -0.01},
]
SLIPPING_BODIES = [body | {"mu": mu} for body in BODIES for mu in (20.0, 100.0)]
CASES = {"slip": SLIP + STIFF, "noslip": BODIES, "effective": SLIPPING_BODIES, "averaged": SLIPPING_BODIES}

EXTENDED_TOLERANCE, QUADRUPLE_TOLERANCES = 1.1e-19, (1e-24, 1e-27)
"""Tolerances of the Taylor series: the ε of 80-bit arithmetic, and far beyond the digits written."""

STAGES, RADAU_STEPS = 9, (0.1, 0.125)

LARGEST_DIFFERENCE = 1e-16
"""Allowed between the two tolerances, or steps, of the method whose spins are written."""


def typed(x: Array) -> Array:
    """`x` with the type of its elements: numpy makes object arrays when 128-bit numbers meet its own."""
    return np.array(list(x))


def arctan(x: Array) -> Array:
    """The arctangent to the last digit, in any arithmetic that has a sine: one Newton step from double precision."""
    x = typed(x)
    guess = np.array([x.dtype.type(np.arctan(float(value))) for value in x])
    sin, cos = np.sin(guess), np.cos(guess)
    # As objects, these can be multiplied by Python's numbers.
    return np.asarray(guess + (x * cos - sin) / (cos + x * sin)).astype(object)


def problem(model: Model, case: Case, real: Any) -> tuple[list[Any], list[Any]]:
    """States at t = 0 and constants, as numbers of the type `real`; arrays of 128-bit numbers are of objects."""
    kind = object if real is Quadruple else real
    columns = {name: np.array([real(value)], dtype=kind) for name, value in case.items()}
    functions = {"arctan": arctan} | {each.__name__: of_objects(each) for each in (np.cos, np.sin, np.sqrt)}
    numbers = SimpleNamespace(**{**vars(np), **functions})
    with ExitStack() as patches:
        for name, module in sys.modules.copy().items() if real is Quadruple else ():
            if name.startswith("sweep.models.") and vars(module).get("np") is np:
                patches.enter_context(mock.patch.object(module, "np", numbers))
        return [real(s[0]) for s in model.start(columns)], [real(p[0]) for p in model.constants.of(columns)]


def of_objects(function: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """`function` of arrays of objects, which can be multiplied by Python's numbers."""
    return lambda x: function(typed(x)).astype(object)


def check_contact(model: Model, states: Any, constants: Any) -> Any:
    """The spin, after checking that the body touches the plane."""
    _, (spin, _, R, denominator) = model.rhs(tuple(states), model.constants(*constants))
    assert R > 0
    assert denominator > 0
    return spin


# --- Taylor series ----------------------------------------------------------------------------


def taylor_spins(model: Model, case: Case, real: Any, tolerance: float) -> list[Any]:
    """Spins at `TIMES`."""
    states, constants = problem(model, case, real)
    integrator = heyoka.taylor_adaptive(
        taylor_system(model)[0],
        state=states,
        pars=constants,
        fp_type=real,
        tol=real(tolerance),
        compact_mode=True,
    )
    spins = []
    for t in TIMES:
        integrator.propagate_until(real(float(t)))
        spins.append(check_contact(model, integrator.state, constants))
    return spins


# --- Radau IIA --------------------------------------------------------------------------------


def legendre_values(x: Array, count: int) -> Array:
    """P_0 … P_(count-1) at x, shape (count, len(x))."""
    values = [np.ones_like(x), x]
    for k in range(1, count - 1):
        values.append(((2 * k + 1) * x * values[k] - k * values[k - 1]) / (k + 1))
    return np.array(values)


def radau(stages: int) -> Array:
    """Coefficients A of Radau IIA in 80-bit arithmetic; the last row holds the weights.

    The nodes on [-1, 1] are the zeros of P_s - P_(s-1).  The quadrature is exact to degree 2s - 2, so it projects on
    Legendre polynomials, whose integrals are known.
    """
    difference = np.zeros(stages + 1)
    difference[-2:] = -1, 1
    x = np.sort(legendre.legroots(difference)).astype(Extended)
    x[-1] = 1
    inner = x[:-1]
    for _ in range(3):
        P = legendre_values(inner, stages + 1)
        slopes = [n * (inner * P[n] - P[n - 1]) / (inner**2 - 1) for n in (stages, stages - 1)]
        inner = inner - (P[stages] - P[stages - 1]) / (slopes[0] - slopes[1])
    x[:-1] = inner
    P = legendre_values(x, stages + 1)
    weights = (1 + x) / (stages * P[stages - 1]) ** 2 / 2
    # ∫ P_k from -1 to x, times 2k + 1
    integrals = np.vstack([x + 1, P[2:] - P[: stages - 1]]) / 2
    return np.asarray(np.einsum("ki,kj,j->ij", integrals, P[:stages], weights))


def full_jacobian(rhs: Rhs, states: Array) -> Array:
    """∂y'/∂y in double precision, by complex steps."""
    columns = []
    for i in range(len(states)):
        shifted = states.astype(complex)
        shifted[i] += 1e-30j
        columns.append(np.array(rhs(shifted)).imag / 1e-30)
    return np.array(columns, dtype=float).T


def radau_step(A: Array, rhs: Rhs, states: Array, step: Any) -> Array:
    """One step.  Newton's matrix is in double precision, the residual in 80 bits."""
    s, n = len(A), len(states)
    inverse = np.linalg.inv(np.eye(s * n) - np.kron(float(step) * A.astype(float), full_jacobian(rhs, states)))
    increments, size, before = np.zeros((s, n), Extended), 1e300, np.inf
    # Each iteration gains four digits or so, down to round-off, which is at 1e-22 where slopes are at most one.
    while size > 1e-20 and (size > 1e-15 or size < before / 4):
        slopes = np.array(rhs((states + increments).T)).T
        change = (inverse @ (step * (A @ slopes) - increments).ravel().astype(float)).reshape(s, n)
        increments += change
        size, before = np.abs(change).max(), size
    return np.asarray(states + increments[-1])


def first_times(case: Case, longest: float) -> list[Any]:
    """Ends of steps that resolve the onset of slip, growing from a fifth of its decay time to `longest`."""
    step = Extended(0.2 / slip.MODEL.fastest_decay({name: np.array([value]) for name, value in case.items()})[0])
    times = [Extended(0)]
    while step < longest:
        times.append(times[-1] + step)
        step *= Extended(1.2)
    return times


def radau_path(rhs: Rhs, states: Array, passed: list[Any], stops: Array, longest: float) -> Iterator[tuple[Any, Array]]:
    """After each step, the next stop and the states.  Steps end first at the times `passed`, and are then `longest`."""
    A = radau(STAGES)
    for stop in stops:
        steps = int(np.ceil((stop - passed[-1]) / longest))
        for before, now in pairwise([*passed, *np.linspace(passed[-1], Extended(stop), steps + 1)[1:]]):
            states = radau_step(A, rhs, states, now - before)
            yield stop, states
        passed = [Extended(stop)]


def radau_spins(case: Case, longest: float) -> list[Any]:
    """Spins of the slip model at `TIMES`."""
    states, constants = (np.array(numbers) for numbers in problem(slip.MODEL, case, Extended))

    def rhs(y: Array) -> Any:
        return slip.MODEL.rhs(y, slip.MODEL.constants(*constants))[0]

    spins = {}
    for stop, reached in radau_path(rhs, states, first_times(case, longest), TIMES, longest):
        spins[stop] = check_contact(slip.MODEL, reached, constants)
    return list(spins.values())


# --- the table --------------------------------------------------------------------------------


def reference(model: Model, case: Case) -> tuple[list[Any], dict[str, float]]:
    """Spins at `TIMES`, and their largest differences: from the same method `again`, and from the other methods."""
    if case in STIFF:
        best, again = (radau_spins(case, step) for step in RADAU_STEPS)
    else:
        best, again = (taylor_spins(model, case, Quadruple, tolerance) for tolerance in QUADRUPLE_TOLERANCES)
    ways = {"again": again, "80 bits": taylor_spins(model, case, Extended, EXTENDED_TOLERANCE)}
    if model is slip.MODEL and case not in STIFF:
        ways["Radau"] = radau_spins(case, RADAU_STEPS[0])
    numbers = np.array([as_decimals(spins) for spins in (best, *ways.values())])
    return best, dict(zip(ways, np.abs(numbers[1:] - numbers[0]).max(axis=1), strict=True))


def as_decimals(spins: list[Any]) -> list[Decimal]:
    """The spins as decimals, in which 80 and 128 bits can be compared."""
    return [Decimal(str(spin)) for spin in spins]


def main(output: Path) -> None:
    """Write all cases to `output` and a line for each to the terminal."""
    with output.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, ("model", *PARAMETERS, "t", "spin"), lineterminator="\n")
        writer.writeheader()
        for name, cases in CASES.items():
            for case in cases:
                before = time.process_time()
                spins, differences = reference(MODELS[name], case)
                for t, spin in zip(TIMES, as_decimals(spins), strict=True):
                    writer.writerow({"model": name, **case, "t": t, "spin": f"{spin:.18g}"})
                stream.flush()
                found = ", ".join(f"{other} {difference:.1e}" for other, difference in differences.items())
                print(f"{name} {case}: {found}; {time.process_time() - before:.0f} s", flush=True)
                assert differences["again"] < LARGEST_DIFFERENCE


if __name__ == "__main__":
    main(Path(sys.argv[1]))

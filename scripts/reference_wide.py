"""Reference spins of 300 cells from a domain much wider than the paper's, and how each motion ends.

Two derivations of the equations, both integrated as Taylor series by heyoka.py:

* that of `data/benchmark/example_scipy.py`: nine body components of the upward normal u, the angular velocity ω and the
  velocity v_g of the centre of mass, with the normal force R from v_p · u = 0.  With u3 as a state they are smooth at
  u3 = 0, where the body topples.  They give the spins of the table, and the events that end a motion;
* the package's own seven equations, traced.  The difference of the two is the uncertainty of the spins.

    python scripts/reference_wide.py data/reference_wide.csv [SEED]
"""

from __future__ import annotations

import csv
import sys
import time
from pathlib import Path
from typing import Any

import heyoka
import numpy as np
from benchmark_references import UNIT, Case, example, fastest_period
from numpy.typing import NDArray
from tracing import taylor_system

from sweep.models.ladder import slip

Array = NDArray[np.float64]

SEED, CELLS = 20251101, 300
TIMES = np.array([50.0, 100.0, 200.0, 400.0])

TOLERANCE, OTHER_TOLERANCE = 1e-16, 1e-15
SAMPLES = 64
"""Samples of the normal force in a period of the fastest rocking."""

U3, OMEGA3 = 2, 5
SCALE = np.array([1.0 if i in (U3, OMEGA3) else UNIT for i in range(9)])
OTHER_SCALE = np.array([1.0 if i == slip.MODEL.spin_state else UNIT for i in range(7)])

ENDS = ("lift_off", "paradox", "toppled")
"""The events that end a motion, in the order in which `own_integrator` lists them."""

SAME_END = 1e-6
"""Largest difference allowed between the two runs' times of the end."""


def draw(seed: int) -> list[Case]:
    """The cells, in units in which g = 1 and the mass is one; every parameter is rounded to six digits first."""
    random = np.random.default_rng(seed)

    def log_uniform(low: float, high: float) -> float:
        return float(low * (high / low) ** random.random())

    cells: list[Case] = []
    while len(cells) < CELLS:
        a, c = log_uniform(1.5, 50), random.uniform(0.5, 2)
        if a < 1.5 * c:
            continue
        b = log_uniform(1.01 * c, a)
        cell = {
            "a": a, "b": b, "c": c, "delta": random.uniform(-0.5, 0.5), "mu": log_uniform(0.1, 5000),
            "n0": float(random.choice([-1, 1])) * log_uniform(0.005, 0.2),
            "x0": random.uniform(-a / 10, a / 10), "y0": random.uniform(-b / 10, b / 10),
        }  # fmt: skip
        cell = {name: float(f"{value:.6g}") for name, value in cell.items()}
        if height_squared(cell) > 0:
            cells.append(cell)
    return cells


# --- nine equations ---------------------------------------------------------------------------


def height_squared(cell: Case) -> float:
    """(z/c)² of the contact point at the start; negative if (x0, y0) lies outside the body."""
    (A11, A22, _, A12), *_ = example.slipping_body(cell)
    x, y = cell["x0"], cell["y0"]
    return float(1 - (A22 * x * x - 2 * A12 * x * y + A11 * y * y) / (A11 * A22 - A12 * A12))


def own_integrator(tolerance: float) -> Any:
    """Integrator of the nine equations in multiples of `SCALE`; R = 0, its pole and u3 = 0 stop it."""
    symbols = heyoka.make_vars("u1", "u2", "u3", "w1", "w2", "w3", "v1", "v2", "v3")
    states = [symbol * unit for symbol, unit in zip(symbols, SCALE, strict=True)]
    par = heyoka.par
    body = [par[i] for i in range(4)], [par[i] for i in range(4, 7)], par[7]
    slopes, numerator, denominator = example.pressed(states, body, heyoka)
    return heyoka.taylor_adaptive(
        [(symbol, slope * (1 / unit)) for symbol, slope, unit in zip(symbols, slopes, SCALE, strict=True)],
        state=np.zeros(9),
        pars=np.ones(8),
        tol=tolerance,
        t_events=[heyoka.t_event(expression) for expression in (numerator, denominator, symbols[U3])],
    )


def sample_times(cell: Case) -> Array:
    """Times at which R is seen: equal steps from zero to the last of `TIMES`, and the onset of slip before them."""
    times = np.arange(0, TIMES[-1], fastest_period(cell) / SAMPLES)
    onset = np.geomspace(1e-3 / (1 + cell["mu"]), times[1], 40)[:-1]
    return np.unique(np.concatenate([times, onset, TIMES]))


def own_run(cell: Case, integrator: Any) -> tuple[Array, float, str, float]:
    """Spins at `TIMES` (NaN after the end), the least normal force seen, the end and its time."""
    times, body = sample_times(cell), example.slipping_body(cell)
    shape, inertia, mu = body
    integrator.time = 0.0
    integrator.reset_cooldowns()
    integrator.state[:] = np.array(example.slipping_start(cell, body)) / SCALE
    integrator.pars[:] = [*shape, *inertia, mu]
    outcome, *_, states = integrator.propagate_grid(times)
    states = (states * SCALE).T
    _, numerator, denominator = example.pressed(states, body, np)
    at = np.searchsorted(times, TIMES)
    spins = np.full(len(TIMES), np.nan)
    reached = at < states.shape[1]
    spins[reached] = example.dot(states[:3], states[3:6])[at[reached]]
    ends = dict(enumerate(ENDS)) | {-int(heyoka.taylor_outcome.time_limit.value) - 1: "time_limit"}
    # Where R has a pole just ahead, its states may become infinite before the event is found.
    end = ends.get(-int(outcome.value) - 1, "singular")
    force = 0.0 if end == "lift_off" else least(times[: states.shape[1]], numerator / denominator)
    return spins, force, end, float(integrator.time)


def least(times: Array, values: Array) -> float:
    """The least value of a smooth function: the vertex of the parabola through the least sample and its neighbours."""
    k = int(np.argmin(values))
    if k in (0, len(values) - 1):
        return float(values[k])
    at = times[k - 1 : k + 2] - times[k]
    second, first, _ = np.polyfit(at, values[k - 1 : k + 2], 2)
    return float(values[k] - first**2 / (4 * second)) if second > 0 else float(values[k])


# --- the package's equations ------------------------------------------------------------------


def traced_integrator(tolerance: float) -> Any:
    """Integrator of the package's slip model in multiples of `OTHER_SCALE`."""
    return heyoka.taylor_adaptive(
        taylor_system(slip.MODEL, OTHER_SCALE)[0],
        state=np.zeros(7),
        pars=np.ones(len(slip.MODEL.constants._fields)),
        tol=tolerance,
    )


def traced_spins(cell: Case, integrator: Any, end: float) -> Array:
    """Spins at those of `TIMES` that come before the end; NaN after it."""
    columns = {name: np.array([value]) for name, value in cell.items()}
    p = slip.MODEL.constants(*(float(value[0]) for value in slip.MODEL.constants.of(columns)))
    integrator.time = 0.0
    integrator.state[:] = np.array([value[0] for value in slip.MODEL.start(columns)]) / OTHER_SCALE
    integrator.pars[:] = p
    spins = np.full(len(TIMES), np.nan)
    for k, t in enumerate(TIMES[end >= TIMES]):
        integrator.propagate_until(t)
        spins[k] = slip.MODEL.energy(integrator.state * OTHER_SCALE, p)[0]
    return spins


# --- the table --------------------------------------------------------------------------------


def main(output: Path, seed: int) -> None:
    """Write the table to `output`, and a line for each cell to the terminal."""
    own, other, traced = own_integrator(TOLERANCE), own_integrator(OTHER_TOLERANCE), traced_integrator(OTHER_TOLERANCE)
    cells = draw(seed)
    labels = [f"{t:g}" for t in TIMES]
    header = [*cells[0], *(f"spin_{t}" for t in labels), *(f"uncertainty_{t}" for t in labels)]
    with output.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*header, "least_force", "end", "t_end"])
        for k, cell in enumerate(cells):
            began = time.process_time()
            spins, force, end, t_end = own_run(cell, own)
            uncertainty = np.abs(spins - traced_spins(cell, traced, t_end))
            if end != "time_limit":
                _, _, again, t_again = own_run(cell, other)
                assert again == end
                assert abs(t_again - t_end) < SAME_END
            numbers = [*map(repr, spins.tolist()), *(f"{value:.1e}" for value in uncertainty)]
            writer.writerow([*cell.values(), *numbers, f"{force:.6g}", end, f"{t_end:.9g}"])
            stream.flush()
            seconds = time.process_time() - began
            print(f"{k} {cell} {end} {t_end:.6f} {force:.3f} {uncertainty[-1]:.1e} {seconds:.1f} s", flush=True)
    print(f"{time.process_time():.0f} s of CPU time")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if sys.argv[2:] else SEED)

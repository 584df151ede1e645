"""Compares the estimated errors of spins with those that much shorter steps of dopri5 tell.

    python scripts/short_steps.py bodies [LAW …]     40 random real bodies with each law of friction, over 20 s
    python scripts/short_steps.py CONFIG CELLS       as many random cells of a map of the paper's model, to its t_end

Each cell is run as a user would run it, and again in fixed steps a fifth as long as its own, to the time at which it
ended.  That error is below 1/3000 of its own; where half of these steps differ from it by a tenth of the tolerance, the
cell is not compared, nor where round-off decides in dopri5 (`noise_limited`).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

import comparison
import numpy as np
import xarray as xr

import sweep
from sweep.config import Config
from sweep.engine import executor
from sweep.engine.plan import kernel_of
from sweep.kernels.method import TOLERANCE
from sweep.kernels.methods import PLAIN
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.results.dataset import measured

SHORTER = (5.0, 10.0)

DRY = {"mu": 0.3, "speed": 5e-3}
LAWS: dict[str, dict[str, Any]] = {
    "viscous": {"mu": 30.0},
    "coulomb sqrt": {"law": "coulomb", "regularisation": "sqrt", **DRY},
    "coulomb tanh": {"law": "coulomb", "regularisation": "tanh", **DRY},
    "coulomb cubic": {"law": "coulomb", "regularisation": "cubic", **DRY},
    "stribeck": {"law": "stribeck", **DRY, "mu_static": 0.4, "speed_stick": 0.01, "mu_viscous": 0.1},
    "contensou": {"law": "contensou", **DRY, "radius_contact": 5e-4},
    "no friction": {"law": "none"},
    "viscous, sigma": {"mu": 30.0, "sigma": 1e-4},
    "viscous, rolling": {"mu": 30.0, "mu_rolling": 0.01, "radius": 0.01, "speed_rolling": 0.5},
    "viscous, spinning": {"mu": 30.0, "mu_spinning": 0.2, "radius_spinning": 1e-3, "speed_spinning": 0.5},
}
TAPPED = {"tapped, viscous": LAWS["viscous"], "tapped, coulomb": LAWS["coulomb tanh"]}
"""Laws with starts by a hard tap: |ω1| up to 12 rad/s and |ω2| up to 8."""

BODIES = 40


def bodies(seed: int, *, tapped: bool) -> Iterator[dict[str, Any]]:
    """Solid bodies of 5 to 20 cm, turned against their surface, with the spins and tilts of an experiment."""
    random = np.random.default_rng(seed)
    for _ in range(BODIES):
        a, b, c = random.uniform(0.05, 0.2), random.uniform(0.02, 0.045), random.uniform(0.01, 0.018)
        delta, mass = random.uniform(0.01, 0.2) * random.choice([-1, 1]), random.uniform(0.05, 1.0)
        first, second, third = (mass / 5 * (p**2 + q**2) for p, q in ((b, c), (a, c), (a, b)))
        cos, sin = np.cos(delta), np.sin(delta)
        yield {
            "a": a, "b": b, "c": c, "mass": mass, "Ixx": first * cos**2 + second * sin**2, "Izz": third,
            "Iyy": first * sin**2 + second * cos**2, "Ixy": (first - second) * sin * cos,
            "omega3": random.uniform(1, 8) * random.choice([-1, 1]), "roll": random.uniform(0.001, 0.03),
            "pitch": random.uniform(0.001, 0.03),
            **({"omega1": random.uniform(-12, 12), "omega2": random.uniform(-8, 8)} if tapped else {}),
        }  # fmt: skip


def with_law(name: str, seed: int = 7) -> xr.Dataset:
    """The datasets of all bodies, one after another."""
    runs, friction = [], {**LAWS, **TAPPED}[name]
    for each in bodies(seed, tapped=name in TAPPED):
        start = {name: value for name, value in each.items() if name in ("omega1", "omega2", "omega3", "roll", "pitch")}
        body = {name: value for name, value in each.items() if name not in start}
        config = {"units": "SI", "body": body, "friction": friction, "start": start, "integrator": {"t_end": 20}}
        runs.append(compared(sweep.load_config(config)))
    return xr.concat([run.drop_attrs().reset_coords(drop=True).squeeze(drop=True) for run in runs], "case")


def compared(config: Config, cells: int = 0) -> xr.Dataset:
    """The dataset of a configuration, or of some cells of it, with the errors that shorter steps tell."""
    grid = config.grid
    rows = np.sort(np.random.default_rng(0).permutation(grid.size)[: cells or None])
    columns = grid.take(rows).columns()
    if cells:
        rows_of = [dict(zip(columns, row, strict=True)) for row in np.stack([*columns.values()], axis=1).tolist()]
        config = sweep.load_config(comparison.table(rows_of), {"t_end": config.integrator.t_end})
    found = sweep.run(config)
    flat = {name: found[name].values.ravel() for name in ("step", "t_stop", "spin_final", "spin_error", "status")}
    sound = np.isin(flat["status"], (SETTLED, TIME_LIMIT))
    kernel, unit = kernel_of(PLAIN, config), config.equations.spin_unit(columns)
    columns = {name: values[sound] for name, values in columns.items()}
    ends = [np.full(len(rows), np.nan) for _ in SHORTER]
    for end, shorter in zip(ends, SHORTER, strict=True):
        images = kernel.images(columns, flat["step"][sound] / shorter, flat["t_stop"][sound])
        executor.execute(kernel, images, stop_when_settled=False)
        again = measured(kernel, images, flat["t_stop"][sound])
        # dopri5 does not lift modes: where they decay into round-off, it comes too early to a late reversal.
        end[sound] = np.where(again.get("noise_limited", 0), np.nan, again["spin_final"])
    told = {"error": np.abs(flat["spin_final"] - ends[1]), "unsure": np.abs(ends[0] - ends[1]), "unit": unit}
    told |= {name: flat[name] for name in ("spin_error", "t_stop", "status")}
    return xr.Dataset({name: ("case", values) for name, values in told.items()})


def report(label: str, found: xr.Dataset, tolerance: float) -> str:
    """How many cells keep the tolerance, and how near the estimates are."""
    longer = np.maximum(found.t_stop * found.unit / 400, 1)
    allowed = (tolerance * longer * found.unit).values
    sharp = found.unsure.values < allowed / 10
    return f"{label}: {comparison.words(found.error.values, found.spin_error.values, allowed, sharp)}"


if __name__ == "__main__":
    if sys.argv[1] == "bodies":
        for law in sys.argv[2:] or [*LAWS, *TAPPED]:
            print(report(law, with_law(law), TOLERANCE), flush=True)
    else:
        chosen = sweep.load_config(sys.argv[1])
        cells = compared(chosen, int(sys.argv[2]))
        print(report(sys.argv[1], cells, chosen.integrator.tolerance), flush=True)

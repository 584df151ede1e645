"""The answers of `sweep` to the benchmark in `data/benchmark`.

    python scripts/benchmark_sweep.py ANSWERS.csv [CASE ...] [--tolerance 1e-10] [--method auto]
    python data/benchmark/score.py ANSWERS.csv

Each case is run once for each of its times, and told are the seconds of the run to the last of them: from parameters to
dataset, on one thread, when what it needs is compiled.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path
from typing import Any

import xarray as xr

import sweep
from sweep.jit import load_numba

CASES = Path(__file__).parents[1] / "data" / "benchmark" / "cases.csv"

SECTIONS = {
    "slip": {"body": ("a", "b", "c", "delta"), "friction": ("mu",), "start": ("n0", "x0", "y0")},
    "roll": {
        "body": ("a", "b", "c", "offset", "mass", "Ixx", "Iyy", "Izz", "Ixy"),
        "friction": ("sigma",),
        "start": ("roll", "pitch", "omega3"),
    },
}
"""Where a configuration has the parameters of a model."""

SETTINGS: dict[str, dict[str, Any]] = {
    "slip": {"model": "slip", "measure": ["reversals"]},
    "roll": {"model": "noslip", "units": "SI", "gravity": 9.81, "measure": ["reversals"]},
}


def configuration(row: dict[str, str], method: str, tolerance: float) -> dict[str, Any]:
    """What a configuration file would say for a row of cases.csv."""
    sections: dict[str, dict[str, float]] = {
        section: {name: float(row[name]) for name in names} for section, names in SECTIONS[row["model"]].items()
    }
    if row["model"] == "roll":
        sections["start"] |= {"omega1": 0.0, "omega2": 0.0}
    integrator = {"method": method, "tolerance": tolerance, "stop_when_settled": False, "estimate_errors": False}
    return SETTINGS[row["model"]] | sections | {"integrator": integrator}


def timed_run(config: dict[str, Any], t_end: float) -> tuple[xr.Dataset, float]:
    """The dataset of one cell, and the seconds that it took."""
    began = time.perf_counter()
    found = sweep.run(config, t_end=t_end)
    return found, time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("answers", type=Path)
    parser.add_argument("cases", nargs="*", help="names of cases; all of them if none is named")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--tolerance", type=float, default=1e-10)
    options = parser.parse_args()
    load_numba().set_num_threads(1)
    with CASES.open(encoding="utf-8", newline="") as cases, options.answers.open("w", encoding="utf-8") as stream:
        answers = csv.writer(stream, lineterminator="\n")
        answers.writerow(["case", "t", "spin", "seconds", "reversals"])
        for row in csv.DictReader(cases):
            if options.cases and row["case"] not in options.cases:
                continue
            config = configuration(row, options.method, options.tolerance)
            times = [float(t) for t in row["times"].split()]
            timed_run(config, times[0])
            runs = [timed_run(config, t) for t in times]
            last, seconds = runs[-1]
            reversals = last.reversals.item() if row["model"] == "slip" else ""
            for t, (found, _) in zip(times, runs, strict=True):
                answers.writerow([row["case"], f"{t:g}", repr(found.spin_final.item()), f"{seconds:.4g}", reversals])
            stream.flush()


if __name__ == "__main__":
    main()

"""Fits the good films of `film_verdicts.py` as lmfit and forty lines of SciPy do, beside `sweep fit`.

    pip install lmfit
    python scripts/fit_peers.py FILMS SEED

Both minimise the same residuals, from the middle of the ranges that `sweep fit` finds: they get its curves and ranges
for nothing, and have no search over starts, no steps that stay the same beside a place, and no look at outliers.
Their intervals follow from their covariances.  A line for each film and tool: seconds of the processor, whether its
misfit is no larger than that of the truth, and the truths in its intervals of 68 and 95 %.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator

import numpy as np
from film_verdicts import Case, cases, judged
from scipy.optimize import least_squares

import sweep
from sweep.studies import ranges
from sweep.studies.fit import with_optional
from sweep.studies.misfit import Problem

WIDE = {68: 1.0, 95: 1.96}

Answer = tuple[np.ndarray, np.ndarray, float]
"""Places, their standard errors and the sum of squares."""


def posed(case: Case) -> Problem:
    """The film and the ranges that `sweep fit` would search first."""
    config = with_optional(sweep.load_config(case.told), case.free)
    free = {name: ranges.of_parameter(config, case.film, name) for name in case.free}
    return Problem(config, case.film, free, np.ones(len(case.film.time), bool))


def by_scipy(residuals: Callable[[np.ndarray], np.ndarray], free: int) -> Answer:
    """Minimise by SciPy's trust region, with its own differences."""
    found = least_squares(residuals, np.full(free, 0.5), bounds=(0, 1), x_scale="jac", diff_step=1e-4)
    spread = np.linalg.pinv(found.jac.T @ found.jac) * 2 * found.cost / (len(found.fun) - free)
    return found.x, np.sqrt(np.diag(spread)), 2 * found.cost


def by_lmfit(residuals: Callable[[np.ndarray], np.ndarray], free: int) -> Answer:
    """Minimise by lmfit's Levenberg-Marquardt."""
    from lmfit import Parameters, minimize

    parameters = Parameters()
    for i in range(free):
        parameters.add(f"p{i}", 0.5, min=0, max=1)
    found = minimize(lambda p: residuals(np.array([*p.valuesdict().values()])), parameters, epsfcn=1e-8, max_nfev=2000)
    errors = [np.nan if each.stderr is None else each.stderr for each in found.params.values()]
    return np.array([*found.params.valuesdict().values()]), np.array(errors), float(found.chisqr)


def compared(case: Case) -> Iterator[dict[str, object]]:
    """A line for each tool."""
    ours = judged(case)
    yield {"tool": "sweep", "seconds": ours["seconds"], "best": ours["best"], "held": ours["held"]}
    true = np.array([case.truth[name] for name in case.free])
    for tool, by in (("scipy", by_scipy), ("lmfit", by_lmfit)):
        began, problem = time.process_time(), posed(case)
        place, errors, misfit = by(lambda at, problem=problem: problem.residuals(at[None])[0], len(true))
        away = np.abs(place - problem.place(true))
        yield {
            "tool": tool, "seconds": time.process_time() - began,
            "best": bool(misfit <= np.sum((case.exact - case.film.value) ** 2)),
            "held": {level: (away <= wide * errors).tolist() for level, wide in WIDE.items()},
        }  # fmt: skip


def main(films: int, seed: int) -> None:
    """Print a line for each film and tool, and the shares at the end."""
    lines = []
    for case in cases(films, seed, ("good",)):
        for line in compared(case):
            lines.append(line)
            print(json.dumps(line), flush=True)
    for tool in ("sweep", "scipy", "lmfit"):
        own = [each for each in lines if each["tool"] == tool]
        best, seconds = np.mean([each["best"] for each in own]), np.median([each["seconds"] for each in own])
        shares = ", ".join(f"{np.mean([each['held'][level] for each in own]):.1%} at {level} %" for level in WIDE)
        print(f"{tool}: best minimum in {best:.0%} of {len(own)}, {shares}, {seconds:.1f} s of the processor (median)")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))

"""Fits the films of `film_intervals.py` as a user would without `sweep fit`: by SciPy, and by lmfit.

    python scripts/fit_peers.py FILMS [SEED]

Both minimise the misfit of `sweep.trajectory` from the middle of the ranges, with their own differences, lmfit with the
intervals of its covariance.  It needs lmfit.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping

import lmfit
import numpy as np
from film_intervals import FREE, Case, cases, is_best
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

import sweep

Found = tuple[np.ndarray, np.ndarray | None]
"""The curve that fits, and for each free parameter whether its interval of 68 % holds the truth, if there is one."""


def curve(case: Case, values: Mapping[str, float]) -> np.ndarray:
    """The spins of a trajectory at the instants of the film."""
    one = sweep.trajectory(case.known, t_end=case.film.time[-1] + 0.1, progress=False, **values).isel(trajectory=0)
    spins = one["spin"].values
    if not np.isfinite(spins).all():
        return np.full(len(case.film.time), 10 * np.abs(case.film.value).max())
    return np.asarray(CubicSpline(one["time"].values, spins)(case.film.time))


def by_ours(case: Case) -> Found:
    """`sweep.fit`."""
    found, true = sweep.fit(case.known, case.film, FREE, progress=False, **case.sought), list(case.truth.values())
    return found["fitted"].values, ((found["lower_68"] <= true) & (true <= found["upper_68"])).values


def by_scipy(case: Case) -> Found:
    """`scipy.optimize.least_squares`."""
    low, high = np.array(list(case.sought.values())).T
    order = [list(case.sought).index(name) for name in FREE]
    low, high = low[order], high[order]

    def away(place: np.ndarray) -> np.ndarray:
        return curve(case, dict(zip(FREE, low + (high - low) * place, strict=True))) - case.film.value

    found = least_squares(away, np.full(len(FREE), 0.5), bounds=(0, 1), x_scale="jac", max_nfev=100)
    return found.fun + case.film.value, None


def by_lmfit(case: Case) -> Found:
    """`lmfit.minimize`."""
    sought = lmfit.Parameters()
    for name in FREE:
        low, high = case.sought[name]
        sought.add(name, value=(low + high) / 2, min=low, max=high)

    def away(values: lmfit.Parameters) -> np.ndarray:
        return curve(case, values.valuesdict()) - case.film.value

    found = lmfit.minimize(away, sought, method="leastsq", max_nfev=600)
    held = [
        bool(each.stderr) and abs(each.value - case.truth[name]) <= each.stderr
        for name, each in found.params.items()
    ]  # fmt: skip
    return found.residual + case.film.value, np.array(held)


def main(films: int, seed: int = 705) -> None:
    """Print a line for each film, and shares at the end."""
    ways: dict[str, Callable[[Case], Found]] = {"sweep fit": by_ours, "SciPy": by_scipy, "lmfit": by_lmfit}
    best, held, seconds = ({name: [] for name in ways} for _ in range(3))  # type: ignore[var-annotated]
    for case in cases(films, seed):
        for name, way in ways.items():
            began = time.perf_counter()
            fitted, inside = way(case)
            seconds[name].append(time.perf_counter() - began)
            best[name].append(is_best(case, fitted))
            if inside is not None:
                held[name].append(inside)
        print(", ".join(f"{name}: best {best[name][-1]}, {seconds[name][-1]:.1f} s" for name in ways), flush=True)
    for name in ways:
        within = f", truths in {np.mean(held[name]):.0%} of the 68 % intervals" if held[name] else ""
        print(f"{name}: best minimum of {np.mean(best[name]):.0%}, median {np.median(seconds[name]):.1f} s{within}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))

"""Fits synthetic films of random bodies, and counts how often the intervals hold the truth.

    python scripts/film_intervals.py FILMS [SEED]
    python scripts/film_intervals.py wooden           prints the film in `configs`

The films are made by `tests/support/newton.py`, another derivation and SciPy's integrator: solid bodies of 5 to 20 cm,
three laws of friction, 4 to 8 s at 30 to 240 images a second, noise of 1 to 5 % of the start spin.  Found are friction,
start spin and both start angles.  The best minimum is found if no misfit is larger than that of the truth.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from short_steps import bodies

import sweep
from sweep.config.film import Film

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from support import newton

DRY: dict[str, Any] = {"mu": 0.3, "speed": 0.01}
LAWS: dict[str, dict[str, Any]] = {
    "viscous": {"mu": 30.0},
    "coulomb-sqrt": {"law": "coulomb", "regularisation": "sqrt", **DRY},
    "coulomb-tanh": {"law": "coulomb", "regularisation": "tanh", **DRY},
}
FREE = ("mu", "omega3", "roll", "pitch")


def spins(config: sweep.Config, law: str, times: np.ndarray) -> np.ndarray | None:
    """The spins of the one body of `config`, or None if it lifts off or topples."""
    columns, model = config.grid.columns(), config.equations
    p = {name: float(value[0]) for name, value in columns.items()}
    start = np.array(model.start(columns))[:, 0]
    # DOP853 took three times as many evaluations for most bodies, and minutes for stiff ones.
    y = solve_ivp(lambda _, y: newton.derivative(y, p, law)[0], (0, times[-1]), start, "LSODA", times,
                  rtol=1e-9, atol=1e-12).y  # fmt: skip
    if y.shape[1] < len(times) or not all(newton.derivative(state, p, law)[1] > 0 for state in y.T[::10]):
        return None
    return newton.spin(y)


def film(config: sweep.Config, law: str, omega3: float, random: np.random.Generator) -> Film | None:
    """A film of the one body of `config`, or None if it lifts off."""
    times = np.arange(0, random.uniform(4, 8), 1 / random.choice([30, 60, 120, 240]))
    true, noise = spins(config, law, times), abs(omega3) * random.uniform(0.01, 0.05)
    return None if true is None else Film(times, true + random.normal(0, noise, len(times)))


def wooden() -> None:
    """Print the film of the wooden body."""
    body = {"n0": -6.3, "x0": 3e-3, "y0": 3e-4, "sigma": 2e-6}
    times = np.arange(0, 12, 1 / 60)
    true = spins(sweep.load_config("configs/wooden.yaml", body), "coulomb-sqrt", times)
    assert true is not None
    print("Time (s),spin (rad/s)")
    for each, spin in zip(times, true + np.random.default_rng(2).normal(0, 0.05, len(times)), strict=True):
        print(f"{each:.4f},{spin:.4f}")


class Case(NamedTuple):
    """A film, and what is known and sought of its body."""

    law: str
    known: dict[str, Any]
    film: Film
    sought: dict[str, list[float]]
    truth: dict[str, float]


def cases(films: int, seed: int) -> Iterator[Case]:
    """So many films of random bodies."""
    random, left = np.random.default_rng(seed), films
    while left:
        for body in bodies(int(random.integers(2**31)), tapped=False):
            law = random.choice(list(LAWS))
            friction = LAWS[law] | {"mu": LAWS[law]["mu"] * random.uniform(0.5, 2)}
            truth = {"mu": friction["mu"], **{name: body.pop(name) for name in FREE[1:]}}
            start = {name: truth[name] for name in FREE[1:]}
            known = {"units": "SI", "body": body, "friction": friction, "start": start}
            seen = film(sweep.load_config(known), law, truth["omega3"], random)
            if seen is None:
                continue
            sought = {
                "mu": [LAWS[law]["mu"] / 4, LAWS[law]["mu"] * 4], "roll": [5e-4, 0.04], "pitch": [5e-4, 0.04],
                "omega3": sorted([0.7 * truth["omega3"], 1.2 * truth["omega3"]]),
            }  # fmt: skip
            yield Case(law, known, seen, sought, truth)
            if not (left := left - 1):
                return


def is_best(case: Case, fitted: np.ndarray) -> bool:
    """Whether a curve misses the film by no more than that of the truth."""
    seen = case.film.value
    return bool(np.sum((fitted - seen) ** 2) <= np.sum((true_curve(case.known, case.film) - seen) ** 2))


def main(films: int, seed: int = 1) -> None:
    """Print a line for each film, and shares at the end."""
    held, best, seconds, trajectories = [], [], [], []
    for case in cases(films, seed):
        began = time.perf_counter()
        found = sweep.fit(case.known, case.film, FREE, **case.sought)
        seconds.append(time.perf_counter() - began)
        best.append(is_best(case, found["fitted"].values))
        trajectories.append(found.attrs["trajectories"])
        true = np.array([case.truth[name] for name in FREE])
        held.append([(found[f"lower_{n}"] <= true) & (true <= found[f"upper_{n}"]) for n in (68, 95)])
        print(f"{case.law}: best {best[-1]}, held {np.array(held[-1]).astype(int).tolist()}, {seconds[-1]:.1f} s, "
              f"{trajectories[-1]} trajectories; {found.attrs['undetermined']}", flush=True)  # fmt: skip
    shares = np.array(held, float).mean(axis=0)
    for i, name in enumerate(FREE):
        print(f"{name}: {shares[0, i]:.1%} within 68 %, {shares[1, i]:.1%} within 95 %")
    print(f"best minimum found in {np.mean(best):.1%} of {films} films; median {np.median(seconds):.1f} s, "
          f"{np.median(trajectories):.0f} trajectories")  # fmt: skip


def true_curve(known: dict[str, Any], seen: Film) -> np.ndarray:
    """What the true parameters give at the film's instants."""
    from sweep.studies.misfit import Problem

    problem = Problem(sweep.load_config(known), seen, {"mu": (1e-3, 1e3)})
    place = np.log(known["friction"]["mu"] / 1e-3) / np.log(1e6)
    return problem.curves(np.array([[place]]), seen.time)[0]


if __name__ == "__main__":
    wooden() if sys.argv[1] == "wooden" else main(*map(int, sys.argv[1:]))

"""Films of random bodies by another derivation and integrator, good ones and spoilt ones, and fits to them.

Solid bodies of 5 to 20 cm, three laws of friction, 4 to 8 s at 30 to 240 images a second, noise of 1 to 5 % of the
start spin, spins or what a gyroscope shows; starts within 0.4 to 10 % of the semi-axes.  Films that are spoilt have
livelier starts, from 4 % and 3 rad/s on, in the sense that turns back, and noise up to 2 %.  The configuration has
guesses, the same for all bodies, for what is free: friction, drag, start spin and start point.
"""

from collections.abc import Iterator
from itertools import cycle
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

import sweep
from support import newton
from sweep.config.film import Film
from sweep.models.model import stack

DRY: dict[str, Any] = {"mu": 0.3, "speed": 0.01}
LAWS: dict[str, dict[str, Any]] = {
    "viscous": {"mu": 30.0},
    "coulomb-sqrt": {"law": "coulomb", "regularisation": "sqrt", **DRY},
    "coulomb-tanh": {"law": "coulomb", "regularisation": "tanh", **DRY},
}
"""Laws of friction, with guesses of their parameters."""

FREE = ("mu", "sigma", "n0", "x0", "y0")

SPOILT = ("law", "body", "spin unit", "time unit", "outliers", "bias", "delay", "drag")
"""What is wrong: the law fitted is not that of the film; the inertia is not that of the body; degrees are taken for
radians; a film at 240 images a second is taken for one at 60; a tenth of the rows is off; the gyroscope has a bias; the
film begins late; the drag is held at zero."""


class Case(NamedTuple):
    """A film, and what is told and sought of its body."""

    kind: str
    told: dict[str, Any]
    """The configuration, with guesses of what is free."""
    film: Film
    free: tuple[str, ...]
    exact: np.ndarray
    """The film without noise."""


def body(random: np.random.Generator) -> dict[str, float]:
    """A solid body of 5 to 20 cm, turned against its surface."""
    a, b, c = random.uniform(0.05, 0.2), random.uniform(0.02, 0.045), random.uniform(0.01, 0.018)
    delta, mass = random.uniform(0.01, 0.2) * random.choice([-1, 1]), random.uniform(0.05, 1.0)
    first, second, third = (mass / 5 * (p**2 + q**2) for p, q in ((b, c), (a, c), (a, b)))
    cos, sin = np.cos(delta), np.sin(delta)
    return {
        "a": a, "b": b, "c": c, "mass": mass, "Ixx": first * cos**2 + second * sin**2, "Izz": third,
        "Iyy": first * sin**2 + second * cos**2, "Ixy": (first - second) * sin * cos,
    }  # fmt: skip


def motion(config: sweep.Config, law: str, times: np.ndarray) -> np.ndarray | None:
    """The states of the one body of `config` at `times`, or None if it lifts off or topples."""
    columns, model = config.grid.columns(), config.equations
    p = {name: float(value[0]) for name, value in columns.items()}
    # DOP853 took three times as many evaluations for most bodies, and minutes for stiff ones.
    y = solve_ivp(lambda _, y: newton.derivative(y, p, law)[0], (0, times[-1]), stack(model.start(columns))[:, 0],
                  "LSODA", times, rtol=1e-9, atol=1e-12).y  # fmt: skip
    sound = y.shape[1] == len(times) and all(newton.derivative(state, p, law)[1] > 0 for state in y.T[::10])
    return y if sound else None


def cases(films: int, seed: int, kinds: tuple[str, ...]) -> Iterator[Case]:
    """So many films of random bodies, of the `kinds` in turn."""
    random, of = np.random.default_rng(seed), cycle(kinds)
    kind, left = next(of), films
    while left:
        if case := _case(kind, random):
            yield case
            kind, left = next(of), left - 1


def _case(kind: str, random: np.random.Generator) -> Case | None:
    """A film of a random body, or None if that lifts off."""
    solid, law = body(random), str(random.choice(list(LAWS)))
    if kind == "law":  # dry friction, taken for a viscous one or for none
        law = "coulomb-sqrt"
    friction = LAWS[law] | {"mu": LAWS[law]["mu"] * random.uniform(0.5, 2)}
    # What is spoilt has to show: a body that hardly rattles says nothing of its law, its inertia and its drag.
    lively, least = kind in SPOILT, np.log(0.04 if kind in SPOILT else 0.004)
    lasts = np.exp(random.uniform(np.log(3), np.log(20))) if kind == "drag" else np.exp(random.uniform(np.log(5), 4))
    side = -np.sign(solid["Ixy"]) if lively else random.choice([-1, 1])  # in which the body turns back
    truth = {
        "mu": friction["mu"], "sigma": solid["Izz"] / lasts, "n0": side * random.uniform(3 if lively else 1, 8),
        "x0": solid["a"] * np.exp(random.uniform(least, np.log(0.1))),
        "y0": solid["b"] * np.exp(random.uniform(least, np.log(0.1))) * random.choice([-1, 1]),
    }  # fmt: skip
    start = {name: truth[name] for name in FREE[2:]}
    true = {"units": "SI", "body": solid, "friction": friction | {"sigma": truth["sigma"]}, "start": start}
    times, late = np.arange(0, random.uniform(4, 8), 1 / random.choice([30, 60, 120, 240])), 0.0
    if kind == "delay":
        late = random.uniform(0.2, 0.8)
    y = motion(sweep.load_config(true, {"t_end": 20}), law, times + late if not late else np.append(0, times + late))
    if y is None:
        return None
    y, what = (y[:, 1:] if late else y), str(random.choice(["spin", "gyroscope"]))
    exact = newton.spin(y) if what == "spin" else -y[4]
    noise = abs(truth["n0"]) * random.uniform(0.01, 0.02 if lively else 0.05)
    value = exact + random.normal(0, noise, len(times))
    guess = {"n0": 5.0, "x0": solid["a"] / 50, "y0": solid["b"] / 50}
    told = {"name": "film", "units": "SI", "body": dict(solid), "friction": dict(LAWS[law]), "start": guess}
    told["integrator"] = {"t_end": 100}
    free = FREE
    match kind:
        case "law":
            told["friction"], free = (
                (dict(LAWS["viscous"]), FREE) if random.random() < 0.5 else ({"law": "none"}, FREE[1:])
            )
        case "body":
            told["body"] |= {"Ixy": solid["Ixy"] * random.choice([0.4, 0.6, 1.6]), "Ixx": 1.3 * solid["Ixx"]}
        case "spin unit":
            value = np.degrees(value)
        case "time unit":
            times = times * 4
        case "outliers":
            rows = random.choice(len(times), len(times) // 10, replace=False)
            value[rows] += random.choice([-1, 1], len(rows)) * noise * random.uniform(5, 30, len(rows))
        case "bias":
            bias = truth["n0"] * random.uniform(0.15, 0.4) * random.choice([-1, 1])
            value, exact = value + bias, exact + bias
        case "drag":
            free = tuple(name for name in FREE if name != "sigma")
    return Case(kind, told, Film(times, value, what=what), free, exact)  # type: ignore[arg-type]


def judged(case: Case) -> tuple[bool, bool, float]:
    """Whether a fit is called good, whether it is the best one, and how far its curve is off in units of the noise."""
    try:
        found = sweep.fit(case.told, case.film, case.free, progress=False)
    except sweep.ConfigError:
        return False, False, np.inf
    kept, fitted = ~found["outlier"].values, found["fitted"].values
    ours, exact = (float(np.sum((curve - case.film.value)[kept] ** 2)) for curve in (fitted, case.exact))
    noise = float(np.median(np.abs(case.film.value - case.exact))) / 0.6745
    off = float(np.sqrt(np.mean((fitted - case.exact)[kept] ** 2))) / noise
    return bool(found.attrs["fits"]), ours <= exact, off

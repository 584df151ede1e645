"""Fits synthetic films of random bodies with ranges by default, and counts what the fits say rightly.

    python scripts/film_verdicts.py good FILMS SEED       films of what the configuration describes
    python scripts/film_verdicts.py spoilt FILMS SEED     films of something else, in turn of each kind of `SPOILT`
    python scripts/film_verdicts.py teacher FILMS SEED    good films with three gross outliers each
    python scripts/film_verdicts.py phone                 prints `data/phone_synthetic.csv`

The films are made by `tests/support/newton.py`, another derivation and SciPy's integrator: solid bodies of 5 to 20 cm,
three laws of friction, 4 to 8 s at 30 to 240 images a second, noise of 1 to 5 % of the start spin, spins or what a
gyroscope shows; starts within 0.4 to 10 % of the semi-axes.  Films that are spoilt have livelier starts, from 4 % and
3 rad/s on, in the sense that turns back, and noise up to 2 %.  The configuration has guesses, the same for all bodies,
for what is free: friction, drag, start spin and start point.  A line for each film, and shares at the end.

The best minimum is found if its misfit is no larger than that of the truth.  Coverage counts the intervals of
parameters that are not at an end of their range.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from itertools import cycle, islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

import sweep
from sweep.config.film import Film
from sweep.models.model import stack

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from support import newton

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


_OFF = 1 / 3
"""Root mean square between a fitted curve and that of the film without noise, in its noise: beyond, it is wrong."""


class Case(NamedTuple):
    """A film, and what is told and sought of its body."""

    kind: str
    law: str
    """That of the film."""
    told: dict[str, Any]
    """The configuration, with guesses of what is free."""
    film: Film
    free: tuple[str, ...]
    truth: dict[str, float]
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
        case "teacher":
            value[random.choice(len(times), 3, replace=False)] += random.choice([-1, 1], 3) * [60.0, 3.0, 20 * noise]
        case "bias":
            bias = truth["n0"] * random.uniform(0.15, 0.4) * random.choice([-1, 1])
            value, exact = value + bias, exact + bias
        case "drag":
            free = tuple(name for name in FREE if name != "sigma")
    return Case(kind, law, told, Film(times, value, what=what), free, truth, exact)  # type: ignore[arg-type]


def judged(case: Case) -> dict[str, Any]:
    """What a fit says of a film, with what is true."""
    began = time.process_time()
    try:
        found = sweep.fit(case.told, case.film, case.free, progress=False)
    except sweep.ConfigError as refusal:
        return {"kind": case.kind, "law": case.law, "fits": 0, "why": str(refusal)}
    seconds = time.process_time() - began
    kept = ~found["outlier"].values
    squares = [float(np.sum((curve - case.film.value)[kept] ** 2)) for curve in (found["fitted"].values, case.exact)]
    noise = float(np.median(np.abs(case.film.value - case.exact))) / 0.6745
    off = (
        float(np.sqrt(np.mean((found["fitted"].values - case.exact)[kept] ** 2))) / noise
        if case.kind != "spin unit"
        else np.nan
    )
    inside = found["edge"].values == 0
    true = np.array([case.truth[name] for name in case.free])
    # Half a turn takes the body to itself: opposite start points begin the same motion.
    opposite, width = np.where(np.isin(case.free, ("x0", "y0")), -true, true), found["upper_95"] - found["lower_95"]
    true = min((true, opposite), key=lambda each: float(np.sum(((found["value"] - each) / width) ** 2)))
    held = {n: ((found[f"lower_{n}"] <= true) & (true <= found[f"upper_{n}"])).values.tolist() for n in (68, 95)}
    return {
        "kind": case.kind, "law": case.law, "fits": int(found.attrs["fits"]), "why": found.attrs["fits_because"],
        "off": off, "best": bool(squares[0] <= squares[1]), "inside": inside.tolist(), "held": held, "seconds": seconds,
        "value": found["value"].values.tolist(), "truth": true.tolist(), "outliers": int((~kept).sum()),
        "rms": found.attrs["root_mean_square"], "trajectories": found.attrs["trajectories"],
        "free": case.free, "undetermined": found.attrs["undetermined"],
        "lower": found["lower_95"].values.tolist(), "upper": found["upper_95"].values.tolist(),
    }  # fmt: skip


def summary(lines: list[dict[str, Any]]) -> str:
    """The shares over all films."""
    words = [f"{np.mean([each['fits'] for each in lines]):.1%} of {len(lines)} are called good"]
    words += _of_fits([each for each in lines if "best" in each])
    if away := [each["fits"] for each in lines if each.get("off", 1) > _OFF]:
        words.append(
            f"{len(away) - sum(away)} of {len(away)} whose curve is off by a third of the noise are called bad"
        )
    for kind in dict.fromkeys(each["kind"] for each in lines):
        some = [each["fits"] for each in lines if each["kind"] == kind]
        words.append(f"{kind}: {len(some) - sum(some)} of {len(some)} called bad")
    return "\n".join(words)


def _of_fits(lines: list[dict[str, Any]]) -> list[str]:
    """How good the fits are that were not refused."""
    inside, words = np.concatenate([each["inside"] for each in lines]), list[str]()
    words.append(f"best minimum in {np.mean([each['best'] for each in lines]):.1%}")
    for level in (68, 95):
        held = np.concatenate([each["held"][level] for each in lines])[inside]
        words.append(f"{np.mean(held):.1%} of {inside.sum()} truths in the intervals of {level} %")
    words.append(f"{np.median([each['seconds'] for each in lines]):.1f} s of the processor a fit (median)")
    return words


PHONE = "--mass 420g --length 24cm --width 7.5cm --height 3.4cm --angle 3.0+-0.8deg"
"""The rattleback of the page on fits, a phone on it."""


def phone() -> None:
    """Print what phyphox would show of it, with noise and two blows, and a product of inertia that was misjudged."""
    from sweep.cli.configurations import MEASURED
    from sweep.config.document import parse_value
    from sweep.config.measured import measured, of_solid

    given = dict(zip(*[iter(PHONE.replace("--", "").split())] * 2, strict=True))
    text = of_solid({name: measured(name, value, MEASURED[name][0]) for name, value in given.items()}, whole=False)
    told = parse_value(text, "phone")
    told["body"]["Ixy"] = 1.15 * told["body"]["Ixy"]["normal"][0]
    told["friction"] |= {"mu": 0.22, "sigma": told["body"]["Izz"] / 25}
    told["start"] = {"n0": 5.4, "x0": 1.4e-3, "y0": -4e-4}
    times, random = np.arange(0, 8, 0.01), np.random.default_rng(44)
    y = motion(sweep.load_config(told), "coulomb-sqrt", times)
    assert y is not None
    turning = np.array([y[3], y[2], -y[4]]) + random.normal(0, 0.03, (3, len(times)))
    turning[2, [231, 566]] += [4.0, -2.5]
    print('"Time (s)","Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)","Absolute (rad/s)"')
    for row in zip(times, *turning, np.linalg.norm(turning, axis=0), strict=True):
        print(",".join(f"{value:.4f}" for value in row))


def main(which: str, films: int, seed: int, first: int = 0) -> None:
    """Print a line of JSON for each film, and the shares at the end."""
    lines = []
    for case in islice(cases(films, seed, SPOILT if which == "spoilt" else (which,)), first, None):
        lines.append(judged(case))
        print(json.dumps(lines[-1]), flush=True)
    print(summary(lines))


if __name__ == "__main__":
    phone() if sys.argv[1] == "phone" else main(sys.argv[1], *map(int, sys.argv[2:]))

"""Films of random measured bodies, made without the package: the body from its sizes, its motion by Newton and SciPy.

A hand measures with errors, and a camera sees where the long axis points, with noise, dropped frames and a gap.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from support import newton
from sweep.config.film import Film

RULER = {"length": 5e-4, "width": 5e-4, "height": 5e-4, "mass": 1e-3, "angle": np.radians(0.5)}
"""Errors of what is measured, in SI units."""

GRAVITY = 9.80665

SPEED = 5e-3
"""The slip speed of full dry friction, in m/s.  It is given: most films show no more than its ratio to the friction."""

FREE = ["mu", "sigma", "n0", "x0", "y0"]
"""What a fit finds, besides what was measured."""

LAWS = {"viscous": (8.0, 60.0), "coulomb": (0.08, 0.3)}
"""The range of the friction of each law."""


@dataclass
class Filmed:
    """A film, and what made it."""

    sizes: dict[str, float]
    """What a perfect ruler measures."""
    measured: dict[str, float]
    """What was measured."""
    weights: list[dict[str, Any]]
    """Weights on the body, which are known."""
    solid: str
    friction: dict[str, Any]
    start: dict[str, float]
    film: Film

    def scene(self, *, exact: bool = False, law: str = "") -> dict[str, Any]:
        """A configuration with what was measured, or with what a perfect ruler measures, and guesses of the rest."""
        sizes: dict[str, Any] = dict(self.sizes)
        if not exact:
            sizes = {name: {"normal": [value, RULER[name]]} for name, value in self.measured.items()}
        law, semi = law or self.friction["law"], _semi(self.solid, self.sizes)
        return {
            "name": "film", "units": "SI", "integrator": {"t_end": 100},
            "body": {"solid": self.solid, **sizes} | ({"weights": self.weights} if self.weights else {}),
            "friction": {"law": law, **({"mu": 0.3, "speed": SPEED} if law == "coulomb" else {"mu": 30.0})},
            "start": {"n0": 5.0, "x0": semi[0] / 50, "y0": semi[1] / 50},
        }  # fmt: skip


def made(random: np.random.Generator) -> Filmed | None:
    """A film of a random body; None if that lifts off or falls, cannot stand, or keeps more than half of its spin."""
    solid = str(random.choice(["half_ellipsoid", "ellipsoid"]))
    sizes = {
        "length": random.uniform(0.10, 0.25), "width": random.uniform(0.03, 0.06),
        "height": random.uniform(0.014, 0.024),
    }  # fmt: skip
    sizes["height"] *= 1 if solid == "half_ellipsoid" else 2
    semi = _semi(solid, sizes)
    sizes["mass"] = random.uniform(500, 1500) * (2 if solid == "half_ellipsoid" else 4) / 3 * np.pi * np.prod(semi)
    weighted = random.random() < 0.5
    sizes["angle"] = 0.0 if weighted else np.radians(random.uniform(1.5, 8)) * random.choice([-1, 1])
    weights = _weights(random, sizes, semi) if weighted else []
    p = body(solid, sizes, weights)
    if p["b"] ** 2 / p["c"] < 1.1 * (p["c"] - p["offset"]):
        return None
    law = str(random.choice([*LAWS]))
    friction = {"mu": float(np.exp(random.uniform(*np.log(LAWS[law]))))}
    friction |= {"speed": SPEED} if law == "coulomb" else {}
    friction["sigma"] = p["Izz"] / np.exp(random.uniform(np.log(5), 4))
    start = {"n0": random.choice([-1, 1]) * random.uniform(4, 8)}
    start["x0"] = semi[0] * np.exp(random.uniform(np.log(0.06), np.log(0.2)))
    start["y0"] = semi[1] * np.exp(random.uniform(np.log(0.06), np.log(0.2))) * random.choice([-1, 1])
    times = np.arange(0, random.uniform(3, 5), 1 / random.choice([30, 60]))
    seen = heading(p | friction, law, start, times)
    if seen is None or np.percentile(np.gradient(seen, times) / start["n0"], 10) > 0.5:
        return None
    kept = random.random(len(times)) > 0.08
    gap = random.uniform(0.3, 0.7) * times[-1]
    kept &= (times < gap) | (times > gap + 0.2)
    kept[0] = True
    noise = np.radians(random.uniform(0.5, 1.0))
    value = np.mod(seen + random.normal(0, noise, len(times)) + random.uniform(0, 6), 2 * np.pi)
    film = Film(times[kept], np.unwrap(value[kept]), None, "heading")
    measured = {name: float(size + random.normal(0, RULER[name])) for name, size in sizes.items()}
    return Filmed(sizes, measured, weights, solid, friction | {"law": law}, start, film)


def _semi(solid: str, sizes: dict[str, float]) -> np.ndarray:
    whole = solid == "ellipsoid"
    return np.array([sizes["length"] / 2, sizes["width"] / 2, sizes["height"] / (2 if whole else 1)])


def _weights(random: np.random.Generator, sizes: dict[str, float], semi: np.ndarray) -> list[dict[str, Any]]:
    mass = sizes["mass"] * random.uniform(0.05, 0.2)
    x, y, z = semi * random.uniform([0.3, 0.3, -0.2], [0.6, 0.6, 0.2]) * [1, random.choice([-1, 1]), 1]
    return [{"mass": mass, "at": [sign * x, sign * y, z]} for sign in (1, -1)]


def body(solid: str, sizes: dict[str, float], weights: list[dict[str, Any]]) -> dict[str, float]:
    """The parameters of `newton` of a homogeneous solid with point weights, z down from the ellipsoid's centre."""
    a, b, c = _semi(solid, sizes)
    mass, below = sizes["mass"], 0.0 if solid == "ellipsoid" else 3 * c / 8
    own = mass / 5 * np.diag([b**2 + c**2, a**2 + c**2, a**2 + b**2])  # about the centre of the ellipsoid
    cos, sin = np.cos(sizes["angle"]), np.sin(sizes["angle"])
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    about, total, moment = turn @ own @ turn.T, mass, np.array([0, 0, mass * below])
    for weight in weights:
        x = np.array(weight["at"])
        about = about + weight["mass"] * (x @ x * np.eye(3) - np.outer(x, x))
        total, moment = total + weight["mass"], moment + weight["mass"] * x
    centre = moment / total
    central = about - total * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    p = {"a": a, "b": b, "c": c, "offset": centre[2], "mass": total, "gravity": GRAVITY}
    p |= {"Ixx": central[0, 0], "Iyy": central[1, 1], "Izz": central[2, 2], "Ixy": central[0, 1]}
    return {name: float(value) for name, value in p.items()}


def heading(p: dict[str, float], law: str, start: dict[str, float], times: np.ndarray) -> np.ndarray | None:
    """How far the long axis has turned, seen from above; None if the body lifts off."""
    semi = np.array([p["a"], p["b"], p["c"]])
    x, y = start["x0"], start["y0"]
    low = np.array([x, y, semi[2] * np.sqrt(1 - (x / semi[0]) ** 2 - (y / semi[1]) ** 2)])
    own = low / semi**2
    u = -own / np.sqrt(own @ own)  # upwards, along the axes of a and b
    turn = newton._turn(newton.axes(p))
    first = np.concatenate([(turn.T @ u)[:2], turn.T @ (start["n0"] * u), [0, 0]])
    across = np.cross(u, [1.0, 0, 0])
    across /= np.sqrt(across @ across)
    space = np.array([np.cross(across, u), across, u]) @ turn

    def slopes(_: float, z: np.ndarray) -> np.ndarray:
        rates, _, _ = newton.derivative(z[:7], p, law)
        return np.concatenate([rates, (z[7:].reshape(3, 3) @ newton._cross(z[2:5])).ravel()])

    with np.errstate(all="ignore"):
        found = solve_ivp(slopes, (0, times[-1]), [*first, *space.ravel()], "LSODA", times, rtol=1e-8, atol=1e-10).y
        forces = np.array([newton.derivative(y[:7], p, law)[1] for y in found.T[::5] if np.isfinite(y).all()])
    if found.shape[1] < len(times) or len(forces) < len(found.T[::5]) or not (forces > 0).all():
        return None
    along = found[7:].reshape(3, 3, -1).transpose(2, 0, 1) @ turn.T[:, 0]
    return np.asarray(np.unwrap(np.arctan2(along[:, 1], along[:, 0])))

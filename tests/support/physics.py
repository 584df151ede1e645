"""Bodies of any shape and friction, as parameters and as a configuration."""

from typing import Any

import numpy as np

KANE_LEVINSON = {
    "a": 0.2, "b": 0.03, "c": 0.02, "offset": 0.01, "mass": 1.0, "gravity": 9.81,
    "Ixx": 2e-4, "Iyy": 1.6e-3, "Izz": 1.7e-3, "Ixy": -2e-5,
}  # fmt: skip
"""The body of Kane and Levinson (1982)."""

IN_SI: dict[str, Any] = {
    "units": "SI", "gravity": 9.81, "body": {name: value for name, value in KANE_LEVINSON.items() if name != "gravity"},
}  # fmt: skip
"""It as a part of a configuration."""

TURNS = "omega1: 0, omega2: 0, omega3: -5, slip1: 0, slip2: 0"
MOMENTS = ", Ixx: 2.0e-4, Iyy: 1.6e-3, Izz: 1.7e-3, Ixy: -2.0e-5"

STONE = f"""\
model: slip
units: SI
gravity: 9.81
body: {{a: 0.2, b: 0.03, c: 0.02, offset: 0.01, mass: 1.0{MOMENTS}}}
friction: {{law: coulomb, mu: 0.5, speed: 1.0e-3, sigma: 1.0e-4}}
start: {{roll: 0.5 deg, pitch: 0.5 deg, {TURNS}}}
integrator: {{t_end: 5}}
"""


def turned_inertia(first: float, second: float, third: float, angle: float) -> dict[str, float]:
    """Moments and product of inertia in axes from which the principal ones are turned by `angle` about the third."""
    cos, sin = np.cos(angle), np.sin(angle)
    product = (first - second) * sin * cos
    return {
        "Ixx": first * cos**2 + second * sin**2, "Iyy": first * sin**2 + second * cos**2, "Izz": third, "Ixy": product,
    }  # fmt: skip


def stone(*changes: tuple[str, str]) -> str:
    """The body with some of its words replaced."""
    text = STONE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text

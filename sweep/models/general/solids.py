"""The inertia of homogeneous solids: an ellipsoid, and the lower half of one, flat on top.

About the ellipsoid's centre and with the semi-axes A, B and C, both have the matrix of inertia
m diag(B² + C², A² + C², A² + B²)/5, because the halves are mirror images.  The centre of mass of the half lies 3C/8
below it (E. W. Weisstein, "Ellipsoid" and "Hemisphere", mathworld.wolfram.com).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Numbers = Mapping[str, Any]
"""Real numbers by name; complex ones where derivatives are taken."""

RADII = {"a": "radius_long", "b": "radius_short"}
"""The radius of curvature at the lowest point from which a semi-axis of the surface follows."""

SIZES = {"a": "length", "b": "width", "c": "height"}
"""The size of the solid from which a semi-axis follows."""


def body(measured: Numbers, *, whole: bool) -> dict[str, Any]:
    """Return the parameters of the section `body`, from what is measured; both in SI units.

    The solid has the sizes `length`, `width` and `height`, and its surface the semi-axes `a`, `b` and `c`, or the radii
    of curvature `radius_long` and `radius_short`.  Missing dimensions of the solid default to those of the surface, and
    vice versa.  The inertia is turned by `angle` against the surface, as by the parameter `delta`.

    Parameters
    ----------
    measured : `mass` or `density`, `angle`, and one number or more for each semi-axis
    whole : whether the solid is the whole ellipsoid, not its lower half
    """
    parts = {"length": 2, "width": 2, "height": 2 if whole else 1}
    solid = {axis: measured[name] / parts[name] for axis, name in SIZES.items() if name in measured}
    surface = solid | {axis: measured[axis] for axis in SIZES if axis in measured}
    surface |= {axis: np.sqrt(measured[name] * surface["c"]) for axis, name in RADII.items() if name in measured}
    a, b, c = ((surface | solid)[axis] for axis in SIZES)
    below = 0 if whole else 3 * c / 8
    mass = mass_of(measured, (4 if whole else 2) / 3 * np.pi * a * b * c)
    cos, sin = np.cos(measured["angle"]), np.sin(measured["angle"])
    along, across = mass * ((b**2 + c**2) / 5 - below**2), mass * ((a**2 + c**2) / 5 - below**2)
    return {
        "a": surface["a"], "b": surface["b"], "c": surface["c"], "offset": surface["c"] - (c - below), "mass": mass,
        "Ixx": along * cos**2 + across * sin**2, "Iyy": along * sin**2 + across * cos**2,
        "Izz": mass * (a**2 + b**2) / 5, "Ixy": (along - across) * sin * cos,
    }  # fmt: skip


def mass_of(measured: Numbers, volume):
    """Return the measured mass, or the one that follows from the density."""
    return measured["mass"] if "mass" in measured else measured["density"] * volume


def propagated(formula: Callable[[Numbers], Numbers], values: Numbers, errors: Numbers) -> dict[str, float]:
    """Propagate independent `errors` of `values` through `formula`, to first order.

    Derivatives are by a complex step, which does not round (W. Squire and G. Trapp, SIAM Rev. 40, 110-112, 1998).
    """
    tiny = 1e-30
    steps = {name: formula({**values, name: values[name] + 1j * tiny}) for name in errors}
    return {
        entry: float(np.sqrt(sum((np.imag(steps[name][entry]) / tiny * errors[name]) ** 2 for name in errors)))
        for entry in formula(values)
    }

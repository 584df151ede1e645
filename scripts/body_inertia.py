"""Mass, centre of mass and inertia of a rattleback of one material, from its shape: `body` of a configuration.

The body is what a flat top and an oval outline leave of an ellipsoid.  The hull is the ellipsoid's lower part, of the
given thickness at its lowest point; the outline, seen from above, is an ellipse whose long axis is turned against that
of the hull, from x towards y (clockwise seen from above, for z points down).

    python scripts/body_inertia.py --hull 120 25 25 --thickness 15 --outline 187 26 --turn -6 --density 500

Lengths are in millimetres: the hull's semi-axes a, b, c, and the outline's length and width; the density is in kg/m³.
"""

from __future__ import annotations

import argparse

import numpy as np

RADII, ANGLES = 60, 720


def properties(
    hull: tuple[float, float, float], thickness: float, outline: tuple[float, float], turn: float, density: float
) -> dict[str, float]:
    """The parameters of the section `body`, in SI units.

    Parameters
    ----------
    hull, thickness, outline : in metres
    turn : in radians
    """
    a, b, c = hull
    top = c - thickness  # of the flat, below the ellipsoid's centre
    phi = np.arange(ANGLES) * 2 * np.pi / ANGLES
    # In every direction up to the outline, or to where the hull meets the flat.
    edge = 1 / np.hypot(np.cos(phi - turn) / (outline[0] / 2), np.sin(phi - turn) / (outline[1] / 2))
    rim = np.sqrt(1 - (top / c) ** 2) / np.hypot(np.cos(phi) / a, np.sin(phi) / b)
    nodes, weights = np.polynomial.legendre.leggauss(RADII)
    t, dt = np.pi / 4 * (nodes + 1)[:, None], np.pi / 4 * weights[:, None]
    largest = np.minimum(edge, rim)
    r, dr = largest * np.sin(t), largest * np.cos(t) * dt
    x, y, area = r * np.cos(phi), r * np.sin(phi), density * r * dr * 2 * np.pi / ANGLES
    bottom = c * np.sqrt(1 - (x / a) ** 2 - (y / b) ** 2)
    height, first, second = (area * (bottom**k - top**k) / k for k in (1, 2, 3))
    mass = height.sum()
    offset = first.sum() / mass
    xx, yy, xy = ((height * product).sum() for product in (x * x, y * y, x * y))
    zz = second.sum() - mass * offset**2
    return {
        "a": a, "b": b, "c": c, "offset": offset, "mass": mass,
        "Ixx": yy + zz, "Iyy": xx + zz, "Izz": xx + yy, "Ixy": -xy,
    }  # fmt: skip


def parse(arguments: list[str] | None = None) -> dict[str, float]:
    """`properties` of a command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hull", type=float, nargs=3, required=True)
    parser.add_argument("--thickness", type=float, required=True)
    parser.add_argument("--outline", type=float, nargs=2, required=True)
    parser.add_argument("--turn", type=float, required=True, help="degrees")
    parser.add_argument("--density", type=float, required=True)
    given = parser.parse_args(arguments)
    a, b, c = (1e-3 * each for each in given.hull)
    length, width = (1e-3 * each for each in given.outline)
    return properties((a, b, c), 1e-3 * given.thickness, (length, width), np.radians(given.turn), given.density)


if __name__ == "__main__":
    print("body: {" + ", ".join(f"{name}: {value:.5g}" for name, value in parse().items()) + "}")

"""Computes the solid inside the triangles of an STL file, and the ellipsoid that fits its lowest part."""

from __future__ import annotations

import warnings
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.models.general.solids import Shape

_LARGEST = 1e9
_LOWEST = 0.1
"""The share of the height in which the surface is fitted."""
_DIGITS = 6
"""Digits, as shares of the longest size, to which corners at the same place agree."""
_NOTHING = 1e-6
"""The share of the largest moment of inertia below which a product of inertia counts as zero."""
_LINES, _OVERLAP = 400, 1e-3
"""Lines along which shells are counted, and the share of the volume in which they may overlap."""


def _trimesh() -> Any:
    """Import trimesh; raise a ValueError that says what to install if it is missing."""
    try:
        import trimesh
    except ModuleNotFoundError:
        raise ValueError("needs trimesh, which is not installed: pip install 'rattleback-sweep[mesh]'") from None
    return trimesh


def triangles(stl: bytes) -> NDArray[np.float64]:
    """Return the corners in a binary or ASCII STL file, shape (triangles, 3, 3); a ValueError if the file is not
    one."""
    load = _trimesh().load_mesh
    try:
        with warnings.catch_warnings(action="error"):  # NumPy warns of texts that are not numbers
            found = np.array(load(BytesIO(stl), "stl", process=False).triangles)
    except Exception:  # the errors that trimesh raises for other files are undocumented
        found = np.empty(0)
    if not len(found) or not (np.abs(found) < _LARGEST).all():
        raise ValueError("not an STL file")
    return found


def shape(corners: NDArray[np.float64]) -> tuple[Shape, float]:
    """Return the solid inside triangles with these corners, and how far its surface is from the ellipsoid at most.

    The corners have the shape (triangles, 3, 3), z up, and any unit of length.

    An ellipsoid that touches the plane below the centre of mass has 2 h = k1 x² + 2 k12 x y + k2 y² + h²/c at the
    height h, with the curvatures k there: its coefficients come from linear least squares.

    Raises
    ------
    ValueError
        in words if the surface is not closed, if shells overlap, or if the solid does not stand on a rounded lowest
        point.
    """
    properties = _trimesh().triangles.mass_properties
    corners = corners - corners.mean((0, 1))
    sizes = np.ptp(corners, axis=(0, 1))
    if not abs(volume := properties(corners, center_mass=np.zeros(3)).volume) > 1e-9 * sizes.prod():
        raise ValueError("the triangles hold no volume")
    _check_closed(corners / sizes.max())
    outwards = corners if volume > 0 else corners[:, ::-1]
    _check_shells(outwards)
    found = properties(outwards)
    return _standing(found.volume, found.inertia / found.volume, corners.reshape(-1, 3) - found.center_mass)


def _check_closed(corners: NDArray[np.float64]) -> None:
    """Raise a ValueError unless each edge belongs to two triangles, in opposite senses.

    Corners at the same place may differ in their last digits.  They count as the same if they round to the same
    point of a grid, or of a shifted one, since few lie where both grids separate them.
    """
    trimesh = _trimesh()
    solid = trimesh.Trimesh(**trimesh.triangles.to_kwargs(corners), process=False)
    for _ in range(3):
        solid.merge_vertices(digits_vertex=_DIGITS)
        solid.apply_translation(np.full(3, 10.0**-_DIGITS / 3))
    # Triangles with two equal corners have no area, and no edges that close anything.
    solid.update_faces((solid.faces != np.roll(solid.faces, 1, axis=1)).all(axis=1))
    _, times = np.unique(solid.edges_sorted, axis=0, return_counts=True)
    holes, more = int((times == 1).sum()), int((times > 2).sum())
    wrong = [f"leave holes: {holes} edges have one triangle"] if holes else []
    wrong += [f"meet more than in twos at {more} edges"] if more else []
    if not wrong and not solid.is_winding_consistent:
        wrong = ["do not all face the same way"]
    if wrong:
        raise ValueError(f"the triangles {', '.join(wrong)}; repair the shape in the program that drew it")


def _check_shells(corners: NDArray[np.float64]) -> None:
    """Raise a ValueError if shells overlap, or are inside out without being a hollow.

    Along upright lines all over the shape, the number of shells around a point has to be zero or one.
    """
    low, high = corners[..., :2].min((0, 1)), corners[..., :2].max((0, 1))
    least, most = corners[..., :2].min(1), corners[..., :2].max(1)
    inside = wrong = 0.0
    for line in np.random.default_rng(0).uniform(low, high, (_LINES, 2)):
        some = corners[((least < line) & (line < most)).all(1)]
        one, two, three = (some[:, i, :2] - line for i in range(3))
        areas = np.array([_cross(two, three), _cross(three, one), _cross(one, two)])
        hit = (areas > 0).all(0) | (areas < 0).all(0)
        areas, some = areas[:, hit], some[hit]
        height, way = (areas * some[:, :, 2].T).sum(0) / areas.sum(0), -np.sign(areas.sum(0))
        order = np.argsort(height)
        around, lengths = np.cumsum(way[order])[:-1], np.diff(height[order])
        inside += lengths[around == 1].sum()
        wrong += lengths[(around != 0) & (around != 1)].sum()
    if wrong > _OVERLAP * (inside + wrong):
        share = 100 * wrong / (inside + wrong)
        raise ValueError(f"shells overlap or are inside out in {share:.2g} % of the volume; unite them to one surface")


def _cross(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]


def _standing(volume: float, inertia: NDArray[np.float64], points: NDArray[np.float64]) -> tuple[Shape, float]:
    """Fit the surface to points around the centre of mass, and turn the axes."""
    bottom, height = points[:, 2].min(), np.ptp(points[:, 2])
    x, y, h = np.unique(points[points[:, 2] < bottom + _LOWEST * height], axis=0).T - [[0], [0], [bottom]]
    terms = np.array([x * x, 2 * x * y, y * y, h * h, x, y, np.ones_like(x)]).T
    (k1, k12, k2, flat, *slope, shift), _, rank, _ = np.linalg.lstsq(terms, 2 * h, rcond=None)
    curvatures, axes = np.linalg.eigh([[k1, k12], [k12, k2]])
    if rank < terms.shape[1] or curvatures[0] <= 0:
        raise ValueError("no rounded lowest point; stand the shape upright, z up, or use smaller triangles")
    if np.hypot(*np.linalg.solve([[k1, k12], [k12, k2]], slope)) > 0.02 * np.ptp(points[:, :2], axis=0).max():
        raise ValueError("centre of mass not above the lowest point; stand the shape upright, z up")
    depth = -bottom - shift / 2
    c = 1 / np.clip(flat, _LOWEST / height, 1 / depth)
    along, _ = axes.T
    turn = np.array([[*along, 0], [along[1], -along[0], 0], [0, 0, -1]])
    surface = (*np.sqrt(c / curvatures), c, c - depth)
    misfit = np.abs(terms @ [k1, k12, k2, flat, *slope, shift] - 2 * h).max() / 2
    J = turn @ inertia @ turn.T
    J[np.abs(J) < _NOTHING * J[2, 2]] = 0
    numbers = (volume, *surface, *np.diag(J), J[0, 1], J[0, 2], J[1, 2])
    return Shape(tuple(map(float, numbers))), float(misfit)

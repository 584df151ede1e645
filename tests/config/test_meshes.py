"""Solids inside triangles: against the same shapes integrated in another way, in both kinds of STL files."""

import runpy
from collections.abc import Callable
from math import pi

import numpy as np
import pytest
from support import ROOT

from sweep.config import meshes
from sweep.models.general.solids import Shape

PEBBLE = {"hull": (0.08, 0.04, 0.035), "thickness": 0.022, "outline": (0.12, 0.052), "turn": 0.09, "density": 2650.0}


def pebble(turned: float = 0.0, directions: int = 160, rings: int = 60) -> np.ndarray:
    """The triangles of what a flat top and an oval outline leave of an ellipsoid, z up, turned from x towards y."""
    (a, b, c), low = PEBBLE["hull"], PEBBLE["thickness"]
    length, width = PEBBLE["outline"]
    phi = np.arange(directions) * 2 * pi / directions
    # y points the other way than with z down.
    edge = 1 / np.hypot(np.cos(phi + PEBBLE["turn"]) / (length / 2), np.sin(phi + PEBBLE["turn"]) / (width / 2))
    rim = np.sqrt(1 - (1 - low / c) ** 2) / np.hypot(np.cos(phi) / a, np.sin(phi) / b)
    r = np.linspace(0, 1, rings + 1)[:, None] * np.minimum(edge, rim)
    x, y = r * np.cos(phi + turned), r * np.sin(phi + turned)
    bottom = -c * np.sqrt(1 - (r * np.cos(phi) / a) ** 2 - (r * np.sin(phi) / b) ** 2)
    sheets = np.array([[x, y, bottom], [x, y, np.full_like(x, low - c)]]).transpose(0, 2, 3, 1)
    grid = np.concatenate([sheets[0], sheets[1][::-1]])
    one, other = grid[:-1], grid[1:]
    beside, across = np.roll(one, -1, 1), np.roll(other, -1, 1)
    halves = ((one, other, across), (one, across, beside))
    return np.concatenate([np.stack(half, 2).reshape(-1, 3, 3) for half in halves]) + np.array([0.3, -0.2, 1.0])


def shape(corners: np.ndarray) -> Shape:
    return meshes.shape(corners)[0]


@pytest.mark.parametrize("turned", [0.0, 0.4])
def test_a_shape_has_the_numbers_of_its_integrals_in_any_pose(turned: float) -> None:
    expected = runpy.run_path(str(ROOT / "scripts" / "body_inertia.py"))["properties"](**PEBBLE)
    found = shape(pebble(turned)).body({"density": PEBBLE["density"]})
    assert {name for name, value in found.items() if value} == set(expected)
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=3e-3), name


def test_a_measured_mass_is_that_of_the_shape() -> None:
    heavy, light = (shape(pebble()).body({"mass": mass}) for mass in (0.4, 0.1))
    assert heavy["mass"] == 0.4
    assert heavy["Izz"] == pytest.approx(4 * light["Izz"])


def ascii_file(corners: np.ndarray) -> bytes:
    """Text, as most programs write it."""
    facets = ("".join("vertex {:.9e} {:.9e} {:.9e}\n".format(*corner) for corner in three) for three in corners)
    text = "".join(f"facet normal 0 0 0\nouter loop\n{facet}endloop\nendfacet\n" for facet in facets)
    return f"solid pebble\n{text}endsolid pebble\n".encode()


def binary_file(corners: np.ndarray) -> bytes:
    """Little-endian records of 50 bytes behind a header of 80 and their number."""
    facets = b"".join(bytes(12) + three.astype("<f4").tobytes() + bytes(2) for three in corners)
    return b"solid but binary".ljust(80) + len(corners).to_bytes(4, "little") + facets


@pytest.mark.parametrize("written", [ascii_file, binary_file])
def test_both_kinds_of_files_are_read(written: Callable[[np.ndarray], bytes]) -> None:
    corners = pebble(directions=8, rings=3)
    np.testing.assert_allclose(meshes.triangles(written(corners)), corners, rtol=1e-6)


def box(sizes: tuple[float, float, float], middle: tuple[float, float, float]) -> np.ndarray:
    """The triangles of a box, which face outwards."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2 * sizes + middle
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return np.array([[corners[i] for i in each] for p, q, r, s in faces for each in ((p, q, r), (p, r, s))])


OUT = pebble()[:, ::-1]
"""The pebble with triangles that face outwards; those of `pebble` all face inwards."""
CORE, MIDDLE = (0.02, 0.01, 0.005), (0.3, -0.2, 0.983)


def test_a_cavity_has_no_mass_and_triangles_that_all_face_inwards_are_turned() -> None:
    whole, other, hollow = map(shape, (OUT, pebble(), np.concatenate([OUT, box(CORE, MIDDLE)[:, ::-1]])))
    assert other.spec["volume"] == pytest.approx(whole.spec["volume"], rel=1e-12)
    assert whole.spec["volume"] - hollow.spec["volume"] == pytest.approx(1e-6, rel=1e-9)


@pytest.mark.parametrize("digits", [5, 9])
def test_corners_may_be_rounded(digits: int) -> None:
    """Also where roundings of one corner differ, as at the seam of a sheet that a program has closed."""
    corners = np.round(OUT, digits)
    noise = np.random.default_rng(0).choice([-1e-9, 0.0, 1e-9], (50, 3, 3))
    corners[:50] += noise
    assert shape(corners).spec["volume"] == pytest.approx(shape(OUT).spec["volume"], rel=1e-3)


WRONG = {
    "leave holes: 280 edges have one triangle; repair": pebble()[:-200],
    "leave holes: 3 edges": pebble()[1:],
    "meet more than in twos at 57600 edges": np.concatenate([OUT, OUT]),
    "do not all face the same way": np.concatenate([OUT[:1, ::-1], OUT[1:]]),
    "overlap or are inside out in 1.. % of the volume": np.concatenate([OUT, box(CORE, MIDDLE)]),
    "are inside out in": np.concatenate([OUT, box(CORE, (0.3, -0.2, 1.1))[:, ::-1]]),
    "hold no volume": pebble() * [1, 1, 0],
    "no rounded lowest point": np.maximum(pebble(), [-1, -1, 0.975]),
    "centre of mass not above": pebble() @ np.array([[0.995, 0, 0.0998], [0, 1, 0], [-0.0998, 0, 0.995]]),
}


@pytest.mark.parametrize("words", WRONG)
def test_a_shape_that_is_not_a_standing_solid_is_refused(words: str) -> None:
    with pytest.raises(ValueError, match=words):
        shape(WRONG[words])


NO_STL = [b"", b"hello", b"solid\nvertex 1 2 3\nendsolid"]
NO_STL += [b"solid\n%sendsolid" % (b"vertex 1 2 %s\n" % z * 3) for z in (b"nan", b"1e200", b"1,5", b"\xb5")]


@pytest.mark.parametrize("data", NO_STL)
def test_other_files_are_no_stl(data: bytes) -> None:
    with pytest.raises(ValueError, match="not an STL file"):
        meshes.triangles(data)

"""The bodies in `configs/`: their numbers are what their first lines say, and they turn the way they should."""

import re
import runpy
from math import pi
from pathlib import Path

import numpy as np
import pytest
from support import ROOT

import sweep
from sweep.config import load_config

INERTIA = runpy.run_path(str(ROOT / "scripts" / "body_inertia.py"))
COMPUTED = [path for path in sorted((ROOT / "configs").glob("*.yaml")) if "body_inertia.py" in path.read_text()]


def test_half_an_ellipsoid() -> None:
    a, b, c, density = 0.08, 0.03, 0.02, 1000.0
    found = INERTIA["properties"]((a, b, c), c, (1.0, 1.0), 0.3, density)
    mass, low = 2 / 3 * pi * a * b * c * density, 3 / 8 * c
    expected = {"mass": mass, "offset": low, "Ixx": mass * ((b**2 + c**2) / 5 - low**2), "Ixy": 0.0}
    expected |= {"Iyy": mass * ((a**2 + c**2) / 5 - low**2), "Izz": mass * (a**2 + b**2) / 5}
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-12, abs=1e-18), name


def test_a_turned_outline_turns_the_inertia() -> None:
    """A thin disc of a flat hull: the long axis of the mass goes from x towards y."""
    found = INERTIA["properties"]((9.0, 9.0, 1.0), 0.5, (0.2, 0.04), 0.1, 1000.0)
    angle = 0.5 * np.arctan2(-2 * found["Ixy"], found["Iyy"] - found["Ixx"])
    assert angle == pytest.approx(0.1, abs=1e-6)


@pytest.mark.parametrize("path", COMPUTED, ids=lambda path: path.stem)
def test_numbers_are_those_of_the_shape(path: Path) -> None:
    (command,) = re.findall(r"^# \$ python scripts/body_inertia.py (.*)$", path.read_text(), re.MULTILINE)
    given = load_config(path).parameters
    for name, value in INERTIA["parse"](command.split()).items():
        assert given[name].numbers[0] == pytest.approx(value, rel=6e-5), name


def test_the_wackelstein_has_the_inertia_that_its_head_states() -> None:
    given = load_config(ROOT / "configs" / "wackelstein.yaml").parameters
    half, more, across = 9e-4, 7e-4 * np.cos(0.2), 7e-4 * np.sin(0.2)
    for name, value in {"Ixx": half - more, "Iyy": half + more, "Izz": 1.7e-3, "Ixy": across}.items():
        assert given[name].numbers[0] == pytest.approx(value, rel=1e-14), name


@pytest.mark.parametrize(
    ("name", "fixed", "spin", "reverses"),
    [
        ("plastic_toy", {"mu": 0.3}, "n0", 4.0),
        ("pebble", {"mu": 0.3}, "n0", 4.0),
        ("wackelstein", {"t_end": 2.0}, "omega3", 8.0),
        pytest.param("wooden", {"sigma": 5e-6}, "n0", -4.0, marks=pytest.mark.campaign),
    ],
)
def test_which_way_a_body_reverses(name: str, fixed: dict[str, float], spin: str, reverses: float) -> None:
    asked = {"t_end": 6.0, spin: [reverses, -reverses]} | fixed
    found = sweep.run(ROOT / "configs" / f"{name}.yaml", **asked)
    assert (found["reversals"] > 0).values.tolist() == [True, False]

"""Bodies whose measured sizes are parameters: what follows from them varies with them, in every kind of value."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sweep
from sweep.config import load_config
from sweep.faults import InputError

SIZES = {"length": "12 cm", "width": "36 mm", "height": "16 mm", "mass": "52 g", "angle": "2 deg"}
REST = {
    "units": "SI", "friction": {"law": "coulomb", "mu": 0.3, "speed": 5e-3, "sigma": 1e-6},
    "start": {"n0": 5, "x0": 1e-3, "y0": 3e-4}, "integrator": {"t_end": 3},
}  # fmt: skip
NUMBERS = ("a", "b", "c", "offset", "mass", "Ixx", "Iyy", "Izz", "Ixy")


def toy(**sizes: object) -> dict[str, object]:
    return {"body": {"solid": "half_ellipsoid", **SIZES, **sizes}, **REST}


def half_ellipsoid(length: float, width: float, height: float, mass: float, angle: float) -> dict[str, float]:
    """The same body by the closed formulas, with the matrix of inertia turned as a matrix."""
    a, b, c = length / 2, width / 2, height
    about_top = np.diag([b * b + c * c, a * a + c * c, a * a + b * b]) / 5
    inertia = mass * (about_top - np.diag([1, 1, 0]) * (3 * c / 8) ** 2)
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    turned = turn @ inertia @ turn.T
    moments = {"Ixx": turned[0, 0], "Iyy": turned[1, 1], "Izz": turned[2, 2], "Ixy": turned[0, 1]}
    return {"a": a, "b": b, "c": c, "offset": 3 * c / 8, "mass": mass, **moments}


@settings(max_examples=50, deadline=None)
@given(
    height=st.floats(1e-4, 1.0), flat=st.floats(2.1, 20.0), long=st.floats(1.01, 20.0),
    mass=st.floats(1e-6, 1e3), angle=st.floats(-1.5, 1.5),
)  # fmt: skip
def test_the_parameters_of_a_half_ellipsoid_are_those_of_its_formulas(
    height: float, flat: float, long: float, mass: float, angle: float
) -> None:
    sizes = {"height": height, "width": height * flat, "length": height * flat * long, "mass": mass, "angle": angle}
    scene = toy(**sizes) | {"start": {"n0": 5, "x0": 0, "y0": 0}}
    columns, expected = load_config(scene).grid.columns(), half_ellipsoid(**sizes)
    scale = {name: expected["Izz"] if name[0] == "I" else expected["a"] for name in expected}
    for name, value in expected.items():
        assert columns[name] == pytest.approx([value], rel=1e-12, abs=1e-14 * scale[name]), name


def test_a_run_over_a_size_is_the_run_of_the_numbers_that_follow() -> None:
    measured = sweep.run(toy(width=["34 mm", "36 mm"]))
    columns = load_config(toy(width=["34 mm", "36 mm"])).grid.columns()
    for i in range(2):
        numbers = sweep.run({"body": {name: float(columns[name][i]) for name in NUMBERS}, **REST})
        for name in ("spin_final", "reversals", "status", "n_c1_linear", "energy_error"):
            np.testing.assert_array_equal(measured[name][i], numbers[name])


def test_all_that_follows_from_an_uncertain_size_varies_together() -> None:
    config = load_config(
        toy(width={"normal": ["36 mm", "0.5 mm"]}, mass={"uniform": ["50 g", "54 g"]}) | {"samples": 16}
    )
    columns = config.grid.columns()
    assert np.std(columns["width"]) == pytest.approx(5e-4, rel=0.3)
    for i in range(16):
        expected = half_ellipsoid(**{name: float(columns[name][i]) for name in SIZES})
        assert {name: columns[name][i] for name in expected} == pytest.approx(expected, rel=1e-12)


def test_a_table_of_cases_may_give_sizes() -> None:
    sizes = {name: value for name, value in SIZES.items() if name != "width"}
    scene = {"body": {"solid": "half_ellipsoid", **sizes}, "cases": {"width": ["36 mm", "40 mm"]}, **REST}
    assert load_config(scene).grid.columns()["b"] == pytest.approx([0.018, 0.02])


def test_the_default_time_is_that_of_the_highest_body() -> None:
    plain = {**REST, "integrator": {}}
    measured = load_config({**toy(height=["10 mm", "16 mm"]), **plain})
    numbers = {name: float(each[1]) for name, each in measured.grid.columns().items() if name in NUMBERS}
    assert measured.integrator.t_end == load_config({"body": numbers, **plain}).integrator.t_end


def test_a_configuration_and_a_dataset_are_read_back(tmp_path: Path) -> None:
    config = load_config(toy(width=["34 mm", "36 mm"], angle={"normal": ["2 deg", "0.5 deg"]}) | {"samples": 4})
    assert load_config(config.document()) == config
    found = sweep.run(config, output=tmp_path)
    again = found.isel(width=1).sweep.trajectory(at={"angle": "2 deg"}, every=0.1)
    straight = sweep.trajectory(toy(), every=0.1)
    np.testing.assert_array_equal(again["spin"], straight["spin"])


WRONG = {
    "solid: sphere": (
        "body.solid",
        "must be half_ellipsoid or ellipsoid, or the numbers that `sweep body --stl` prints",
    ),
    "solid: half_elipsoid": ("body.solid", "did you mean half_ellipsoid?"),
    "mass: -1 g": ("body.mass", "must be a finite number > 0"),
    "width: 20 mm": ("body", "upright rest is not stable"),
    "width: 36 s": ("body.width", "its unit must be m, cm, mm, in or ft"),
    "width: [36 mm, 0]": ("body.width[1]", "must be a finite number > 0"),
    "Ixx: 1e-5": ("body.Ixx", "does not belong to this solid; leave it out (it takes mass, density, length"),
    "delta: 0.03": ("body.delta", "does not belong to this solid"),
    "density: 1 g/cm3": ("body.mass", "cannot be combined with density"),
    "surface: paraboloid": ("body.surface", "cannot be combined with a solid"),
    "solid: {volume: 1e-5}": ("body.solid.a", "must be a finite number > 0"),
}


@pytest.mark.parametrize("line", WRONG)
def test_a_wrong_size_is_refused_at_its_place(line: str, tmp_path: Path) -> None:
    key = line.partition(":")[0]
    lines = [f"  {name}: {value}" for name, value in {"solid": "half_ellipsoid", **SIZES}.items() if name != key]
    file, (path, words) = tmp_path / "toy.yaml", WRONG[line]
    number = len(lines) + 3
    text = "\n".join(["units: SI", "body:", *lines, f"  {line}", "friction: {mu: 1}", "start: {n0: 5, x0: 0, y0: 0}"])
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_config(file)
    places = [f"{file}:{number}:", f"{file}:2:", f"{file}:7:"]  # of this line, the section, or the mass
    assert any(str(error.value).startswith(place) for place in places), str(error.value)
    assert f": {path}: " in str(error.value)
    assert words in str(error.value)


def test_sizes_need_a_solid_and_si() -> None:
    body = {name: value for name, value in SIZES.items() if name != "angle"}
    with pytest.raises(
        InputError, match=r"body.length: is the size of a solid; add solid: half_ellipsoid or ellipsoid"
    ):
        load_config({"body": body, **REST})
    with pytest.raises(InputError, match="units: sizes of a solid are in SI; set units: SI"):
        load_config({**toy(), "units": "paper"})

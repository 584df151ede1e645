"""Bodies whose measured sizes are parameters: what follows from them varies with them, in every kind of value."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sweep
from sweep.config import load_config
from sweep.faults import InputError
from sweep.plots import body
from sweep.plots.trajectories import reversal_times

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
    for i, width in enumerate((0.034, 0.036)):
        numbers = sweep.run({"body": {name: float(columns[name][i]) for name in NUMBERS}, **REST})
        for name in ("spin_final", "reversals", "status", "n_c1_linear", "energy_error"):
            np.testing.assert_array_equal(measured[name].sel(width=width), numbers[name])


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


def columns(given_body: dict[str, object]) -> dict[str, float]:
    """The parameters of the models for a body."""
    found = load_config({"body": given_body, **REST, "start": {"n0": 5, "x0": 0, "y0": 0}}).grid.columns()
    return {name: float(values[0]) for name, values in found.items()}


def of_points(masses: np.ndarray, at: np.ndarray) -> dict[str, float]:
    """Mass, depth and central moments of points, by their definitions; `at` has the shape (points, 3), z down."""
    centre = masses @ at / masses.sum()
    x, y, z = (at - centre).T
    sums = {"Ixx": y * y + z * z, "Iyy": x * x + z * z, "Izz": x * x + y * y}
    sums |= {"Ixy": -x * y, "Ixz": -x * z, "Iyz": -y * z}
    return {"mass": masses.sum(), "offset": centre[2], **{name: masses @ each for name, each in sums.items()}}


def points_of_half(a: float, b: float, c: float) -> tuple[np.ndarray, np.ndarray]:
    """Shares and places, z down from the flat top, of points that integrate second moments of the solid exactly."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    z, r, phi = np.meshgrid((nodes + 1) / 2, (nodes + 1) / 2, np.arange(8) * np.pi / 4, indexing="ij")
    share = weights[:, None, None] * weights[:, None] * r * (1 - z**2)
    rim = r * np.sqrt(1 - z**2)
    places = np.stack([a * rim * np.cos(phi), b * rim * np.sin(phi), c * z], axis=-1)
    return (share / share.sum()).ravel(), places.reshape(-1, 3)


PAIRS = st.lists(
    st.tuples(st.floats(1e-3, 0.1), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(-0.01, 0.01)),
    min_size=1, max_size=4,
)  # fmt: skip


@settings(max_examples=50, deadline=None)
@given(pairs=PAIRS, lower=st.floats(-0.005, 0.005))
def test_weights_add_what_their_points_add(pairs: list[tuple[float, ...]], lower: float) -> None:
    """Of each pair, one weight is `lower` than the other, so that the third axis need not be one of inertia."""
    rows = np.array([(m, s * x, s * y, z + (s < 0) * lower) for m, x, y, z in pairs for s in (1, -1)])
    weights = [{"mass": mass, "at": at} for mass, *at in rows.tolist()]
    found = columns({"solid": "half_ellipsoid", "length": 0.2, "width": 0.14, "height": 0.03, "mass": 0.5,
                     "weights": weights})  # fmt: skip
    share, places = points_of_half(0.1, 0.07, 0.03)
    expected = of_points(np.append(0.5 * share, rows[:, 0]), np.append(places, rows[:, 1:], axis=0))
    for name, value in expected.items():
        assert found.get(name, 0.0) == pytest.approx(value, rel=1e-9, abs=1e-11 * expected["Izz"]), name


def test_weights_are_added_to_a_body_of_given_inertia() -> None:
    body = {"a": 0.2, "b": 0.03, "c": 0.02, "offset": 0.01, "mass": 1.0, "Ixx": 2e-4, "Iyy": 1.6e-3, "Izz": 1.7e-3}
    found = columns({**body, "weights": [{"mass": "50 g", "at": [f"{s}5 cm", f"{s}1 cm", "1 cm"]} for s in ("", "-")]})
    expected = {"mass": 1.1, "offset": 0.01, "Ixx": 2e-4 + 1e-5, "Iyy": 1.6e-3 + 2.5e-4, "Izz": 1.7e-3 + 2.6e-4}
    assert {name: found[name] for name in expected} == pytest.approx(expected, rel=1e-12)
    assert found["Ixy"] == pytest.approx(-5e-5, rel=1e-12)


def test_the_bar_across_of_simbody_is_four_weights() -> None:
    """Half an ellipsoid of 1 kg with a bar of 2 kg at 45 degrees (Simbody 3.7, RattlebackUsingEllipsoid)."""
    a, c, length, width, thick, depth = 0.25, 1 / 12, 0.5, 0.05, 0.02, 0.02 / 2.1
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) * [length, width, thick] / np.sqrt(12)
    turn = np.array([[1, -1, 0], [1, 1, 0], [0, 0, np.sqrt(2)]]) / np.sqrt(2)
    weights = [{"mass": 0.5, "at": at} for at in (corners @ turn.T + [0, 0, depth]).tolist()]
    body = {"solid": "half_ellipsoid", "length": 2 * a, "width": 2 * c, "height": c, "mass": 1, "weights": weights}
    bar = turn @ (2 / 12 * np.diag([width**2 + thick**2, length**2 + thick**2, length**2 + width**2])) @ turn.T
    offset = (3 / 8 * c + 2 * depth) / 3
    half = np.diag([2 * c * c, a * a + c * c, a * a + c * c]) / 5 - np.diag([1, 1, 0]) * (3 / 8 * c) ** 2
    apart = ((3 / 8 * c - offset) ** 2 + 2 * (depth - offset) ** 2) * np.diag([1, 1, 0])
    inertia, found = half + bar + apart, columns(body)
    assert (found["mass"], found["offset"]) == pytest.approx((3, offset), rel=1e-12)
    for name, at in {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1)}.items():
        assert found[name] == pytest.approx(inertia[at], rel=1e-12), name


def test_weights_of_equal_depth_leave_a_body_with_all_that_upright_spin_offers() -> None:
    """Rounding makes no third product of inertia, with which there would be no linear theory."""
    pairs = [{"mass": 0.0037, "at": [s * x, s * 0.013, -0.0021]} for x in (0.041, 0.017) for s in (1, -1)]
    config = load_config({"body": {"solid": "half_ellipsoid", **SIZES, "weights": pairs}, **REST})
    assert config.equations.name == "slip+coulomb+sigma+offset+gravity"
    assert load_config(config.document()) == config


LOADED = {
    "solid": "half_ellipsoid", "length": "12 cm", "width": "40 mm", "height": "16 mm",
    "weights": [{"mass": "5 g", "at": at} for at in (["4 cm", "1 cm", "-2 mm"], ["-4 cm", "-1 cm", "-2 mm"])],
}  # fmt: skip
SLIPPING = {
    "units": "SI", "friction": {"mu": 100}, "start": {"n0": 5, "x0": "1 mm", "y0": "0.3 mm"},
    "integrator": {"t_end": 20},
}  # fmt: skip


def loaded(*masses: str) -> dict[str, object]:
    """A scene whose axis is the mass of the solid without its weights."""
    return {"body": {**LOADED, "mass": list(masses)}, **SLIPPING}


def numbers(i: int, *masses: str) -> dict[str, object]:
    """The same body without an axis, by the numbers that follow."""
    found = load_config(loaded(*masses)).grid.columns()
    return {"body": {name: float(found[name][i]) for name in NUMBERS}, **SLIPPING}


def test_searches_take_the_mass_that_is_given_and_not_the_sum() -> None:
    found = sweep.critical(loaded("52 g", "60 g"), bracket=0.1)
    for i in range(2):
        np.testing.assert_array_equal(
            found["n_c2_bracket"][i], sweep.critical(numbers(i, "52 g", "60 g"), bracket=0.1)["n_c2_bracket"]
        )


@pytest.mark.parametrize("spins", [5, [4.99, 5]], ids=["along the mass", "over mass and spin"])
def test_boundaries_lie_where_runs_with_the_given_mass_have_them(spins: float | list[float]) -> None:
    scene = loaded("66 g", "70 g") | {"integrator": {"t_end": 200}}
    found = sweep.boundaries({**scene, "start": {**SLIPPING["start"], "n0": spins}}, bracket=0.05, deviation=0.2)
    assert "mass" in found["bracket"]
    for i in range(found.sizes["point"]):
        one, axis = found.isel(point=i), str(found["bracket"].values[i])
        place = {name: float(one[name]) for name in ("mass", "n0")}
        for side in ("fewer", "more"):
            cell = sweep.run(scene, **place | {axis: float(one[f"end_{side}"])})
            assert cell["reversals"] == one[f"reversals_{side}"]


def test_cells_of_an_earlier_run_are_reused_by_the_mass_that_is_given(tmp_path: Path) -> None:
    sweep.run(loaded("52 g"), output=tmp_path)
    more = sweep.run(loaded("52 g", "60 g"), output=tmp_path)
    assert more.attrs["taken_over"].startswith("1 of 2 cells are reused")
    np.testing.assert_array_equal(more["spin_final"], sweep.run(loaded("52 g", "60 g"))["spin_final"])


def test_a_trajectory_is_drawn_with_the_body_that_follows() -> None:
    one = sweep.trajectory({**loaded("52 g"), **REST}, at={"mass": "52 g"})
    other = sweep.trajectory({**numbers(0, "52 g"), **REST})
    np.testing.assert_array_equal(reversal_times(one), reversal_times(other))
    assert len(reversal_times(one)) > 0
    for name, values in vars(body.moving(one, np.array([0.0, 1.0]))).items():
        np.testing.assert_array_equal(values, getattr(body.moving(other, np.array([0.0, 1.0])), name), name)


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
    "solid: {volume: 1e-5}": ("body.solid", "or the numbers that `sweep body --stl` prints, not {'volume': 1e-05}"),
    "weights: 5 g": ("body.weights", "must be a list of weights, each a mass and a place such as {mass: 5 g, at: [4"),
    "weights: [{mass: 5 g}]": ("body.weights[0]", "must be a mass and a place"),
    "weights: [{mass: 5 s, at: [1 cm, 0, 0]}]": ("body.weights[0].mass", "its unit must be kg"),
    "weights: [{mass: 5 g, at: [1 cm, 0]}]": ("body.weights[0].at", "must be three lengths"),
    "weights: [{mass: 5 g, at: [1 cm, 0, no]}]": ("body.weights[0].at[2]", "must be a finite number, not 'no'"),
    "weights: [{mass: 5 g, at: [1 cm, 0, 0]}]": (
        "body.weights",
        "centre of mass at 0.01 m along a and 0 m along",
    ),
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
    with pytest.raises(InputError, match="units: solids and weights are in SI; set units: SI"):
        load_config({**toy(), "units": "paper"})

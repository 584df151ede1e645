"""The commands `body` and `examples`: what they write runs as it is, and what they refuse is one line."""

import sys
from pathlib import Path

import numpy as np
import pytest
from support import ROOT
from support.cli import invoke, refused

import sweep
from sweep.parameters import PARAMETERS
from sweep.plots.quantities import check_pictures

TOY = ("--mass", "30g", "--length", "12.0±0.1cm", "--width", "3 cm", "--height", "15mm", "--angle", "2.0 +- 0.5 deg")


def printed(*arguments: str) -> str:
    result = invoke("body", *arguments)
    assert result.exit_code == 0, result.stderr
    return result.stdout


def loaded(text: str, folder: Path) -> tuple[sweep.Config, dict[str, float]]:
    """A configuration, and the body of the models that it describes, by the names of its parameters."""
    (folder / "toy.yaml").write_text(text, encoding="utf-8")
    config = sweep.load_config(folder / "toy.yaml")
    return config, {name: float(values[0]) for name, values in config.at_medians.grid.columns().items()}


def test_what_is_printed_loads_with_the_numbers_measured(tmp_path: Path) -> None:
    config, found = loaded(printed(*TOY), tmp_path)
    expected = {"a": 0.06, "b": 0.015, "c": 0.015, "offset": 0.005625, "mass": 0.03, "Izz": 0.03 * 0.003825 / 5}
    assert {name: found[name] for name in expected} == pytest.approx(expected, rel=1e-12)
    assert found["Ixy"] < 0
    known = {name: (each.first, each.second) for name, each in config.distributions.items()}
    errors = {"mass": (0.03, 5e-4), "length": (0.12, 1e-3), "width": (0.03, 5e-3), "height": (0.015, 5e-4)}
    errors["angle"] = (np.radians(2), np.radians(0.5))
    assert known.keys() == errors.keys()
    for name, numbers in errors.items():
        assert known[name] == pytest.approx(numbers, rel=1e-12), name


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("36mm", "{normal: [36 mm, 0.5 mm]}"),
        ("36.0 mm", "{normal: [36.0 mm, 0.05 mm]}"),
        ("3,60 ± 0,01 cm", "{normal: [3.60 cm, 0.01 cm]}"),
        ("3.6e-2 m", "{normal: [3.6e-2 m, 0.0005 m]}"),
        ("36+-0mm", "36 mm"),
    ],
)
def test_an_error_is_the_given_one_or_half_the_last_digit(text: str, value: str) -> None:
    assert f"  width: {value}\n" in printed("--width", text, *TOY[:4], *TOY[6:])


def test_a_measured_body_runs_and_turns_back_from_one_spin_alone(tmp_path: Path) -> None:
    config, _ = loaded(printed(*TOY), tmp_path)
    exact = {name: each.median for name, each in config.distributions.items()}
    found = sweep.run(config, t_end=10.0, n0=[-5.0, 5.0], **exact)
    assert (found["reversals"] > 0).values.tolist() == [False, True]
    assert config.parameters["n0"].numbers == (5.0,)
    assert config.parameters["sigma"].numbers[0] > 0


def half_ellipsoid(directions: int = 80, rings: int = 40, missing: int = 0, scale: float = 1.0) -> str:
    """The triangles of the lower half of an ellipsoid of 60, 15 and 15 mm as ASCII STL, z up, but the last ones."""
    phi, theta = np.arange(directions + 1) * 2 * np.pi / directions, np.linspace(0, np.pi / 2, rings + 1)[:, None]
    unit = np.broadcast_arrays(np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), -np.cos(theta))
    sheet = np.concatenate([np.stack(unit, -1) * [60, 15, 15], np.zeros((1, directions + 1, 3))])
    one, across = sheet[:-1, :-1], sheet[1:, 1:]
    halves = ((one, sheet[1:, :-1], across), (one, across, sheet[:-1, 1:]))
    corners = np.concatenate([np.stack(half, 2).reshape(-1, 3) for half in halves])[: -3 * missing or None] * scale
    vertices = "".join("vertex {:.9g} {:.9g} {:.9g}\n".format(*corner) for corner in corners)
    return f"solid\n{vertices}endsolid\n"


def test_a_shape_of_an_ellipsoid_is_the_body_of_its_sizes(tmp_path: Path) -> None:
    (tmp_path / "toy.stl").write_text(half_ellipsoid(), encoding="utf-8")
    text = printed("--stl", str(tmp_path / "toy.stl"), "--density", "1.24±0.1 g/cm3")
    config, found = loaded(text, tmp_path)
    _, sizes = loaded(printed("--density", "1240 kg/m^3", *TOY[2:8]), tmp_path)
    for name in ("a", "b", "c", "offset", "mass", "Ixx", "Iyy", "Izz", "Ixy"):
        assert found[name] == pytest.approx(sizes[name], rel=3e-3), name
    assert "toy.stl, in millimetres (120 x 30 x 15)" in text
    assert config.distributions["density"].second == pytest.approx(100)


def test_a_shape_without_trimesh_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "toy.stl").write_text(half_ellipsoid(), encoding="utf-8")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    said = "toy.stl: needs trimesh, which is not installed: pip install 'rattleback-sweep[mesh]'"
    refused(invoke("body", "--stl", tmp_path / "toy.stl", "--mass", "30g"), said)


def test_a_shape_takes_a_mass_or_a_density_alone(tmp_path: Path) -> None:
    file = tmp_path / "toy.stl"
    refused(invoke("body", "--stl", file, "--mass", "30g"), f"{file}: No such file")
    file.write_text(half_ellipsoid(missing=81), encoding="utf-8")
    refused(invoke("body", "--stl", file, "--mass", "30g"), f"--stl {file}: the triangles leave holes: 83 edges have")
    file.write_text(half_ellipsoid(scale=1e-3), encoding="utf-8")
    refused(invoke("body", "--stl", file, "--mass", "30g"), "the shape is 0.12 x 0.03 x 0.015; scale it, by 1000 if")
    file.write_text("solid", encoding="utf-8")
    refused(invoke("body", "--stl", file, "--mass", "30g"), f"--stl {file}: not an STL file")
    file.write_text(half_ellipsoid(), encoding="utf-8")
    refused(invoke("body", "--stl", file), "body: a size of the solid is missing; add mass or density")
    refused(invoke("body", "--stl", file, "--mass", "30g", "--angle", "2deg"), "body.angle: does not belong to")
    refused(invoke("body", "--stl", file, "--mass", "30g", "--whole"), "--whole: cannot be combined with --stl")


REFUSED = {
    "body --length 12cm --width 3cm --height 1cm": "body: a size of the solid is missing; add mass or density",
    "body --mass 30g --width 3cm --height 1cm": "add length, radius_long or a",
    "body --mass 30g --length 12cm --width 3cm": "body: a size of the solid is missing; add height or c",
    "body --mass 30": "--mass: must be a number with its unit (kg, g, mg, oz or lb), not '30'",
    "body --angle 100deg": "--angle: must be a finite number > -1.5708",
    "body --mass 30g --radius-long 1m --a 6cm --width 3cm --height 1cm": "body.a: cannot be combined with radius_long",
    "examples woden": "examples woden: no such example (did you mean wooden?)",
}


@pytest.mark.parametrize("words", REFUSED)
def test_what_cannot_be_a_body_or_is_no_example_is_one_line(words: str) -> None:
    result = invoke(*words.split())
    refused(result, REFUSED[words])
    assert result.stdout == ""


CONFIGS = sorted((ROOT / "configs").glob("*.yaml"))


def test_every_configuration_is_listed_with_its_first_line() -> None:
    lines = invoke("examples").stdout.splitlines()
    assert [line.split(maxsplit=1)[0] for line in lines] == [path.stem for path in CONFIGS]
    for line, path in zip(lines, CONFIGS, strict=True):
        words = line.split(maxsplit=1)[1]
        assert path.read_text(encoding="utf-8").startswith(f"# {words}\n")
        assert words[-1] in ".?", "a line of its own"


@pytest.mark.parametrize("name", [path.stem for path in CONFIGS])
def test_a_copied_example_loads_measures_what_it_draws_and_is_not_overwritten(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "new"
    assert invoke("examples", name, "--output", folder).exit_code == 0
    for copy in folder.iterdir():
        assert copy.read_bytes() == (ROOT / "configs" / copy.name).read_bytes()
    config = sweep.load_config(folder / f"{name}.yaml")
    assert (config.name, config.grid.size > 1) == (name, True)
    check_pictures(config)
    (folder / f"{name}.yaml").write_text("mine", encoding="utf-8")
    refused(invoke("examples", name, "--output", folder), f"{name}.yaml: already exists; choose another folder")
    assert (folder / f"{name}.yaml").read_text(encoding="utf-8") == "mine"


def test_parameters_are_listed_within_a_line_and_without_huge_bounds() -> None:
    said = invoke("parameters").stdout
    assert [line.split()[0] for line in said.splitlines() if line[0] != " "] == [p.path for p in PARAMETERS.values()]
    assert max(map(len, said.splitlines())) <= 100
    assert "e+" not in said

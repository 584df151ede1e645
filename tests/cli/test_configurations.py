"""The commands `body` and `examples`: what they write runs as it is, and what they refuse is one line."""

import re
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


def loaded(text: str, folder: Path) -> dict[str, float]:
    """The body of a configuration, by name."""
    (folder / "toy.yaml").write_text(text, encoding="utf-8")
    config = sweep.load_config(folder / "toy.yaml")
    assert config.units == "SI"
    return {name: config.parameters[name].numbers[0] for name in re.findall(r"^  (\w+): ", text, re.MULTILINE)}


def test_what_is_printed_loads_with_the_numbers_measured(tmp_path: Path) -> None:
    found = loaded(printed(*TOY), tmp_path)
    assert list(found) == ["a", "b", "c", "offset", "mass", "Ixx", "Iyy", "Izz", "Ixy"]
    expected = {"a": 0.06, "b": 0.015, "c": 0.015, "offset": 0.005625, "mass": 0.03, "Izz": 0.03 * 0.003825 / 5}
    assert {name: found[name] for name in expected} == pytest.approx(expected, rel=1e-5)
    assert found["Ixy"] < 0


def test_errors_stand_beside_what_they_make_uncertain() -> None:
    text = printed(*TOY)
    lines = dict(re.findall(r"^  (\w+): \S+  # (.*)$", text, re.MULTILINE))
    assert (lines["a"], lines["b"], lines["mass"]) == ("± 0.0005 m", "m", "kg")
    assert re.search(r"^  Ixy: {normal: \[-7.06284e-07, 1.8e-07\]}  # kg m2$", text, re.MULTILINE)
    exact = printed(*(re.sub(r" ?(±|\+-) ?[\d.]+", "", word) for word in TOY)).partition("body:\n")[2]
    assert "±" not in exact
    assert "normal" not in exact


def test_a_measured_body_runs_and_turns_back_from_one_spin_alone(tmp_path: Path) -> None:
    (tmp_path / "toy.yaml").write_text(printed(*TOY), encoding="utf-8")
    found = sweep.run(tmp_path / "toy.yaml", t_end=10.0, n0=[-5.0, 5.0], Ixy=-7.1e-7)
    assert (found["reversals"] > 0).values.tolist() == [False, True]
    written = sweep.load_config(tmp_path / "toy.yaml").parameters
    assert written["n0"].numbers == (5.0,)
    assert written["sigma"].numbers[0] > 0
    assert written["Ixy"].distribution is not None


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
    found = loaded(text, tmp_path)
    sizes = printed("--density", "1240 kg/m^3", "--length", "12cm", "--width", "3cm", "--height", "15mm")
    for name, value in loaded(sizes, tmp_path).items():
        assert found.get(name, 0.0) == pytest.approx(value, rel=3e-3), name
    assert "toy.stl, in millimetres (120 x 30 x 15)" in text
    assert re.search(r"mass: 0.0350?\d+  # ± 0.0028 kg", text)


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
    refused(invoke("body", "--stl", file), "body: a measurement is missing; add --mass or --density")
    refused(invoke("body", "--stl", file, "--mass", "30g", "--angle", "2deg"), "--angle: cannot be combined with --stl")
    refused(invoke("body", "--stl", file, "--mass", "30g", "--whole"), "--whole: cannot be combined with --stl")


REFUSED = {
    "body": "body: a measurement is missing; add --mass or --density",
    "body --mass 30g --width 3cm --height 1cm": "add --length, --radius-long or --a",
    "body --mass 30g --length 12cm --width 3cm": "add --height or --c",
    "body --length 1,250mm": "not '1,250mm'; write 1.250mm or 1250mm",
    "body --mass 30": "--mass: must be a number with its unit (kg, g, mg, oz or lb), not '30'",
    "body --length -12cm": "--length: must be a finite number > 0 and < 1e+06, in m, with an error >= 0, not '-12cm'",
    "body --mass 30g --density 1g/cm³ --length 1m --width 3m --height 1m": "--mass: cannot be combined with --density",
    "body --density 1g/cm2": "--density: must be a number with its unit (kg/m3 or g/cm3), not",
    "body --angle 100deg": "--angle: must be a finite number > -1.5708",
    "body --mass 30g --radius-long 1m --a 6cm --width 3cm --height 1cm": "--a: cannot be combined with --radius-long",
    "body --mass 30g --length 12cm --width 2cm --height 15mm": "body: upright rest is not stable; keep the centre",
    "body --mass 30g --length 12cm --width 3cm --height 15mm --c 1mm": "body: centre of mass outside the ellipsoid",
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

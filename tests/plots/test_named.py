"""The pictures that a configuration names, which a run draws."""

from pathlib import Path

from support import Write
from support.cli import invoke

import sweep
from sweep.config import load_config
from sweep.plots import picture

FORMULA = """\
model: analytic
body: {b: [2, 3, 4, 5, 6]}
friction: {mu: [20, 60, 100, 140, 180]}
"""


def drawn(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("*.png")}


def test_a_run_draws_the_pictures_that_are_named(tmp_path: Path, write: Write) -> None:
    file, folder = write(f"{FORMULA}picture: [status, form_factor]\n", "map.yaml"), tmp_path / "out"
    first = invoke("run", file, "--output", folder)
    assert first.stdout.splitlines()[-1] == f"wrote {folder / 'map'}.nc and .png and _form_factor.png"
    before = drawn(folder)
    for name, variable in (("map.png", None), ("map.png", "status"), ("map_form_factor.png", "form_factor")):
        picture.plot(folder / "map.nc", variable, output=tmp_path / "again.png")
        assert before[name] == (tmp_path / "again.png").read_bytes()
    assert "nothing was written" in invoke("run", file, "--output", folder).stdout

    other = invoke("run", file, "--output", folder, "--set", "picture=[form_factor]")
    assert "already complete" in other.stderr
    assert drawn(folder)["map.png"] == before["map_form_factor.png"]


def test_pictures_of_another_dataset_are_removed(tmp_path: Path, write: Write) -> None:
    """With those that a run which was killed has left half-written."""
    file = write(f"{FORMULA}picture: [status, form_factor]\n", "map.yaml")
    sweep.run(file, output=tmp_path)
    (tmp_path / ".map_form_factor.png.77.part").touch()
    sweep.run(file, output=tmp_path, progress=False)
    assert not [*tmp_path.glob(".*.part")]
    sweep.run(file, output=tmp_path, fresh=True, mu=[20, 61], picture=["status"])
    assert set(drawn(tmp_path)) == {"map.png"}


def test_pictures_are_no_part_of_what_a_run_is() -> None:
    asked = {"friction": {"mu": [20, 60]}}
    plain, named = load_config(asked), load_config(asked, {"picture": ["spin_mean"]})
    assert plain.fingerprint() == named.fingerprint()
    assert "picture: [spin_mean]" in named.to_yaml()
    assert load_config(named.document()).picture == ("spin_mean",)


def test_pictures_of_a_file_are_set_aside_where_something_else_is_measured() -> None:
    asked = load_config({"friction": {"mu": [20, 60]}, "measure": ["cycles", "reversals"], "picture": ["cycle_mean"]})
    assert load_config(asked, {"measure": ["reversals"]}).picture == ()
    assert load_config(asked, {"measure": ["reversals"], "picture": ["status"]}).picture == ("status",)
    assert load_config(asked, {"mu": [20, 70]}).picture == ("cycle_mean",)


def test_a_picture_that_cannot_be_drawn_is_told_and_the_others_are_drawn(tmp_path: Path, write: Write) -> None:
    file = write(f"{FORMULA}picture: [probability, status]\n", "map.yaml")
    result = invoke("run", file, "--output", tmp_path / "out")
    assert result.exit_code == 0
    assert "no picture of probability: variable: there is no variable probability" in result.stderr
    assert list(drawn(tmp_path / "out")) == ["map_status.png"]

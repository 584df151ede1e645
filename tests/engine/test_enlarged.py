"""A run that has grown simulates only what is missing, and ends with the dataset of a run of all cells at once."""

import re
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from support import Write
from support.physics import TURNS, stone
from support.runs import Heard, Stop, nothing_drawn, same_numbers

import sweep
from sweep import FileError
from sweep.engine.enlarged import taken_over
from sweep.kernels.status import SETTLED

pytestmark = pytest.mark.usefixtures("no_pictures")

Files = Callable[[str, Path], Path]

BODY = "name: small\nbody: {a: 10.0, b: [2.0, 3.0, 5.0], delta: 0.03}\n"
ONE = BODY + "friction: {mu: [40, 60]}\nstart: {n0: [0.02, 0.05], x0: 0.01, y0: 0.01}\n"
ONE += "integrator: {t_end: 3000, tolerance: 1e-8}\n"
MORE = ONE.replace("[2.0, 3.0, 5.0]", "[1.5, 2.0, 3.0, 5.0]").replace("[40, 60]", "[40, 50, 60]")
LATER = MORE.replace("3000", "6000")
CASES = BODY.replace("b: [2.0, 3.0, 5.0], ", "") + "cases: cases.csv\nstart: {x0: 0.01, y0: 0.01}\n"


def grown(write: Write, output: Path, *texts: str, **options: Any) -> tuple[xr.Dataset, list[str]]:
    """The dataset after runs of these configurations in one folder, and what the last of them says."""
    for text in texts:
        reporter = Heard()
        found = sweep.run(write(text), output, progress=reporter, **options)
    return found, reporter.notes


@pytest.fixture(scope="module")
def files(kept: Write, tmp_path_factory: pytest.TempPathFactory) -> Files:
    """Copies the files of a run of some configuration, which is run once, to a folder."""

    @cache
    def ran(text: str) -> Path:
        folder = tmp_path_factory.mktemp("ran")
        with nothing_drawn():
            sweep.run(kept(text), folder)
        return folder

    return lambda text, folder: Path(shutil.copytree(ran(text), folder))


SCENE = "name: small\n" + stone(
    ("mu: 0.5", "mu: 0.3"), ("speed: 1.0e-3", "speed: 0.02"), ("pitch: 0.5", "pitch: 1"), (TURNS, "omega3: [-5, 5]"),
    ("t_end: 5", "t_end: 1"),
)  # fmt: skip


def ranged(values: int) -> str:
    return ONE.replace("[2.0, 3.0, 5.0]", f"{{start: 1.2, stop: 9.7, num: {values}}}")


def by(method: str, text: str) -> str:
    return text.replace("{t_end", f"{{method: {method}, t_end")


ANY = "([3-9]|1[0-2]) of 24"
MEASURED = "measure: [reversals, {reversal_times: 3}]\n"
SINGLE = "name: small\nfriction: {mu: 60}\nintegrator: {method: dopri5, t_end: 100}\n"
GROWN = {
    "more": (ONE, MORE, "12 of 24"),
    "finer": (ranged(4), ranged(10), "16 of 40"),
    "later": (ONE, LATER, ANY),
    "more, to counts": (ONE.replace("1e-8", "auto"), MORE.replace("1e-8", "auto"), "12 of 24"),
    "more, dopri5": (by("dopri5", ONE), by("dopri5", MORE), "12 of 24"),
    "later, dopri5": (by("dopri5", ONE), by("dopri5", LATER), ANY),
    "measured": (by("dopri5", ONE) + MEASURED, by("dopri5", MORE) + MEASURED, "12 of 24"),
    "measured further": (by("dopri5", ONE) + "measure: []\n", by("dopri5", ONE) + MEASURED, "no"),
    "single": (SINGLE, SINGLE.replace("100", "300"), "no"),
    # Axes that the paper's models do not have, each from one value to several.
    "gravity": (SCENE, SCENE.replace("gravity: 9.81", "gravity: [1.62, 9.81]"), "2 of 4"),
    "speed": (SCENE, SCENE.replace("speed: 0.02", "speed: [0.01, 0.02, 0.04]"), "2 of 6"),
    "sigma": (SCENE, SCENE.replace("sigma: 1.0e-4", "sigma: {start: 0, stop: 1.0e-4, num: 3}"), "2 of 6"),
    "mass": (SCENE, SCENE.replace("mass: 1.0", "mass: [0.5, 1.0]"), "2 of 4"),
    "roll": (SCENE, SCENE.replace("roll: 0.5 deg", "roll: [0.5 deg, 1 deg]"), "2 of 4"),
}
"""A configuration, what it becomes, and how many cells are reused."""


@pytest.mark.parametrize(("first", "later", "taken"), GROWN.values(), ids=GROWN)
def test_a_grown_run_is_the_run_of_all_at_once(
    write: Write, files: Files, tmp_path: Path, first: str, later: str, taken: str
) -> None:
    found, (note,) = grown(write, files(first, tmp_path / "out"), later)
    assert re.match("no cell of the run" if taken == "no" else f"{taken} cells are reused", note)
    assert found.attrs.get("taken_over", note) in note
    same_numbers(found, sweep.run(write(later)))


def test_a_longer_table_of_cases(write: Write, tmp_path: Path) -> None:
    def run(rows: str) -> xr.Dataset:
        (tmp_path / "cases.csv").write_text("mu,b,n0\n" + rows, encoding="utf-8")
        return grown(write, tmp_path / "out", CASES)[0]

    run("40,2,0.05\n60,3,0.05\n")
    found = run("60,3,0.05\n50,2,0.05\n40,2,0.05\n60,3,0.02\n")
    assert found.attrs["taken_over"].startswith("2 of 4 cells")
    same_numbers(found, sweep.run(write(CASES)))


def test_what_is_taken_over_is_not_computed_again(write: Write, files: Files, tmp_path: Path) -> None:
    files(ONE, tmp_path / "out")
    with netCDF4.Dataset(tmp_path / "out" / "small.nc", "a") as file:
        file["reversals"][1, 2, 0] = 77
    found, _ = grown(write, tmp_path / "out", MORE)
    assert found["reversals"].sel(mu=60, b=5, n0=0.02) == 77
    assert (found["reversals"] == 77).sum() == 1


@pytest.mark.parametrize("t_end", [3037, 6000])
def test_the_time_limit_leaves_no_trace(write: Write, t_end: int) -> None:
    """Only cells that do not depend on the limit are reused; another number of steps is another run."""
    short, config = sweep.run(write(MORE)), sweep.load_config(write(MORE.replace("3000", str(t_end))))
    cells = taken_over(config, short).cells
    taken = np.flatnonzero(cells >= 0)
    assert len(taken) == 0 if t_end == 3037 else len(taken) > 5
    assert set(short["status"].values.ravel()[cells[taken]]) <= {SETTLED}
    long = sweep.run(config)
    for name in ("reversals", "t_stop", "spin_final", "spin_rest", "energy_error", "step"):
        values, longer = short[name].values.ravel(), long[name].values.ravel()
        np.testing.assert_array_equal(longer[taken], values[cells[taken]])


def test_what_adams_foresaw_is_not_taken_over(write: Write) -> None:
    """Near the limit it takes short steps where it would have skipped to a later one."""
    text = by("adams", MORE)
    short, later = sweep.run(write(text)), sweep.load_config(write(text.replace("3000", "6000")))
    assert (taken_over(later, short).cells >= 0).sum() > 5
    short["t_stop"] = 3000 - 100 * short["step"]
    assert (taken_over(later, short).cells < 0).all()


@pytest.mark.usefixtures("short_chunks")
def test_an_interrupted_enlargement_continues(write: Write, files: Files, tmp_path: Path) -> None:
    files(ONE, tmp_path / "out")
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            sweep.run(write(LATER), tmp_path / "out", progress=Stop(2))
        # The smaller dataset stays until the larger one is complete.
        assert xr.load_dataset(tmp_path / "out" / "small.nc", decode_times=False)["status"].size == 12
    (tmp_path / "out" / "small.nc").unlink()  # the run has kept it
    found, notes = grown(write, tmp_path / "out", LATER)
    assert any("resuming" in note for note in notes)
    same_numbers(found, sweep.run(write(LATER)))
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"small.nc"}


REFUSED = [
    (ONE, ("[40, 60]", "[40, 70]"), "- mu: [40.0, 60.0]"),
    (ONE, ("[40, 60]", "60"), "- mu: [40.0, 60.0]"),
    (ONE, ("3000", "1000"), "t_end: 3000.0"),
    (ONE, ("1e-8", "1e-6"), "tolerance: 1e-08"),
    (ONE, ("delta: 0.03", "delta: 0.02"), "- delta: 0.03"),
    (ONE, ("integrator", "measure: [reversals]\nintegrator"), "- measure:"),
    (SCENE, ("9.81", "1.62"), "- gravity: 9.81"),
    (SCENE, ("0.02, sigma", "0.03, sigma"), "speed: 0.02"),
    (SCENE, (", sigma: 1.0e-4", ""), "sigma: 0.0001"),
    (SCENE, ("law: coulomb", "law: contensou, radius_contact: 1.0e-3"), "law: coulomb"),
    (SCENE, ("roll: 0.5 deg, pitch: 1 deg, omega3: [-5, 5]", "n0: [-5, 5], x0: 1.0e-3, y0: 0"), "omega3: [-5.0, 5.0]"),
]
"""Runs, changes after which no cell of them may be taken over, and what is said of each."""


@pytest.mark.parametrize(("text", "change", "said"), REFUSED)
def test_no_result_is_lost_and_no_cell_is_taken_from_another_scene(
    write: Write, files: Files, tmp_path: Path, text: str, change: tuple[str, str], said: str
) -> None:
    files(text, tmp_path / "out")
    before = (tmp_path / "out" / "small.nc").read_bytes()
    with pytest.raises(FileError, match="not resumed") as caught:
        grown(write, tmp_path / "out", text.replace(*change))
    assert said in str(caught.value)
    assert (tmp_path / "out" / "small.nc").read_bytes() == before


EDITS: dict[str, Callable[[xr.Dataset], xr.Dataset]] = {
    "no status": lambda there: there.drop_vars("status"),
    "no counts": lambda there: there.drop_vars("reversals"),
    "real numbers": lambda there: there.where(there["mu"] > 50),
    "turned": lambda there: there.transpose(),
    "another axis": lambda there: there.expand_dims("run"),
    "no attributes": lambda there: there.drop_attrs(),
}
"""What may have been done to a dataset before it was saved under its old name."""


@pytest.mark.parametrize("how", EDITS)
def test_nothing_is_taken_from_an_edited_dataset(how: str, write: Write, files: Files, tmp_path: Path) -> None:
    """A count that is not there was taken for zero."""
    text = by("dopri5", ONE) + MEASURED
    there = sweep.open_dataset(files(text, tmp_path / "out") / "small.nc")
    EDITS[how](there).to_netcdf(tmp_path / "out" / "small.nc")
    with pytest.raises(FileError, match=r"edited since|another configuration"):
        grown(write, tmp_path / "out", text, n0=[0.02, 0.03, 0.05])


def test_a_part_of_a_dataset_is_not_a_complete_run(write: Write, files: Files, tmp_path: Path) -> None:
    there = sweep.open_dataset(files(by("dopri5", ONE), tmp_path / "out") / "small.nc")
    there.isel(mu=[0]).to_netcdf(tmp_path / "out" / "small.nc")
    found, notes = grown(write, tmp_path / "out", by("dopri5", ONE))
    assert notes[0].startswith("6 of 12 cells are reused")
    same_numbers(found, there)


def test_nothing_is_taken_from_other_sources(
    write: Write, files: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files(ONE, tmp_path / "out")
    monkeypatch.setattr("sweep.results.provenance.sources", lambda: ("other", "versions"))
    with pytest.raises(FileError, match="not resumed"):
        grown(write, tmp_path / "out", MORE)

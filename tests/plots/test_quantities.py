"""What can be drawn of a dataset, what it is about, and the pictures that a configuration names."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgb
from support import ROOT, Write
from support.cli import invoke
from support.figures import entries, made

import sweep
from sweep.config import load_config
from sweep.explorer import state
from sweep.explorer.slices import Source
from sweep.kernels.status import LIFT_OFF, TIME_LIMIT
from sweep.plots import picture
from sweep.plots.pictures import PICTURES, of
from sweep.plots.pictures.record import Picture
from sweep.plots.quantities import DERIVED, derivable, field, subject
from sweep.results.provenance import provenance

SIZE = (6, 7)


@pytest.fixture
def whole() -> xr.Dataset:
    """A dataset with all that a quantity is derived from: one cell has lifted off.

    The first reversal comes 1.25 times as late as predicted, in the last row 5 times, and in one cell never.
    """
    late = np.full(SIZE, 1.25)
    late[-1] = 5
    late[2, 3] = np.nan
    status = np.full(SIZE, TIME_LIMIT, "int8")
    status[0, 0] = LIFT_OFF
    values: dict[str, Any] = {
        "status": status,
        "reversals": np.full(SIZE, 30, "int16"),
        "reversals_predicted": np.full(SIZE, 28, "int16"),
        "spin_final": np.zeros(SIZE),
        "spin_error": np.ones(SIZE),
        "t_first_reversal_predicted": np.full(SIZE, 100.0),
        "energy_error": np.full(SIZE, 1e-9),
    }
    axes = {"n0": np.geomspace(0.01, 0.1, SIZE[0]), "delta": np.geomspace(0.02, 0.4, SIZE[1])}
    found = xr.Dataset({name: (tuple(axes), v) for name, v in values.items()}, axes)
    times = np.stack([100 * late, 300 * late], axis=-1)
    words = {"long_name": "time of each spin reversal"}
    return found.assign(reversal_times=((*axes, "reversal"), times, words)).assign_coords(reversal=[1, 2])


def titles(figure: Any) -> list[str]:
    """The titles of the maps, or the words at the bar of a single one."""
    found = [axes.get_title() for axes in figure.axes if axes.get_title()]
    return found or [axes.get_ylabel() for axes in figure.axes if axes.get_label() == "<colorbar>"]


COUNTS = ["simulated", "predicted (Takano 2011)", "simulated − predicted"]
TIMES = ["simulated", "predicted (Garcia–Hubbard)", "simulated / predicted"]
SHOWN = {
    "": ("reversals", COUNTS),
    "reversals": ("reversals", ["spin reversals, simulated"]),
    "difference reversals": ("difference", COUNTS),
    "t_first_reversal": ("t_first_reversal", ["time of the first reversal"]),
    "ratio": ("ratio", TIMES),
    "nothing_that_it_has": ("reversals", COUNTS),
}
"""What the configuration names for pictures: what is explored first, and the titles of what is drawn."""


@pytest.mark.parametrize("pictured", SHOWN)
def test_a_picture_depends_on_what_is_named_and_not_on_what_is_measured_first(pictured: str, whole: xr.Dataset) -> None:
    named = whole.assign_attrs({"pictured": pictured} if pictured else {})
    for measured in ("reversals reversal_times=2", "reversal_times=2 reversals"):
        assert state.first(Source(named.assign_attrs(measured=measured))).show == SHOWN[pictured][0]
    assert titles(sweep.plot(named.assign_attrs(measured=measured))) == SHOWN[pictured][1]


@pytest.mark.parametrize(
    ("lacking", "variable"),
    [(["reversals"], "t_first_reversal"), (["reversals", "reversals_predicted", "reversal_times"], "spin_final")],
)
def test_without_reversals_the_first_variable_is_drawn(lacking: list[str], variable: str, whole: xr.Dataset) -> None:
    assert subject(whole.drop_vars([*lacking, "reversals_predicted"], errors="ignore")) == variable


@pytest.mark.parametrize(
    ("name", "variable"),
    [
        ("reversal_time", "ratio"),
        ("mu_b", "reversals"),
        ("kane_levinson", "ratio"),
    ],
)
def test_the_picture_of_a_configuration_shows_what_it_is_about(name: str, variable: str, whole: xr.Dataset) -> None:
    config = load_config(ROOT / "configs" / f"{name}.yaml")
    assert subject(whole.assign_attrs(provenance(config, 1.0, 1))) == variable


FIRST = ["reversals", "reversals_predicted", "difference", "t_first_reversal", "ratio"]
"""What the explorer offers first, among pictures that are added."""


@pytest.mark.usefixtures("page")
def test_the_explorer_offers_all_that_plot_can_draw(whole: xr.Dataset) -> None:
    source = Source(whole)
    there = {*whole.data_vars, *whole.dims}
    possible = {name for name in DERIVED if there.issuperset(of(name).requires)}
    assert possible == set(derivable(whole))
    over_axes = {name for name in possible if {*field(whole, name).dims} <= {*source.axes}}
    assert {name for name in over_axes if not of(name).draw} < set(source.variables)
    assert [name for name in source.variables if name in FIRST] == FIRST
    assert {*source.variables[: source.variables.index("status")]} <= {*FIRST, *DERIVED}
    few = whole[["status", "reversals", "energy_error"]]
    assert set(DERIVED) & set(Source(few).variables) <= set(derivable(few)) <= set(DERIVED) - set(FIRST)


@pytest.mark.usefixtures("page")
def test_the_explorer_shows_the_values_that_plot_draws(whole: xr.Dataset) -> None:
    source = Source(whole)
    for name in source.variables:
        if not of(name).draw:
            picture.plot(whole, name)
        part = source.map(name, "delta", "n0", {"reversal": 1})
        chosen = whole.isel({"reversal": 1} if "reversal" in source.dims_of(name) else {})
        expected = field(chosen, name).broadcast_like(whole["status"]).transpose("n0", "delta")
        np.testing.assert_array_equal(part.values, expected.values)


def test_the_explorer_shows_what_is_derived_from_several_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    needs = ("reversals", "sample")
    mean = Picture("mean", needs, derive=lambda dataset: dataset["reversals"].mean("sample"))
    monkeypatch.setitem(PICTURES, mean.name, mean)
    monkeypatch.setitem(DERIVED, mean.name, mean.derive)
    sampled = made(n0=[0.02, 0.05]).rename(b="sample")
    sampled["reversals"] += sampled["sample"].astype("int16")
    source = Source(sampled)
    np.testing.assert_allclose(source.map("mean", "mu", "n0", {}).values, sampled["reversals"].mean("sample").T)
    assert "mean" in source.variables
    assert "mean" not in source.values_at({"mu": 1, "sample": 2})


def test_a_later_reversal_is_not_taken_for_the_first(whole: xr.Dataset) -> None:
    assert field(whole.isel(reversal=[1]), "t_first_reversal").isnull().all()
    assert "ratio" not in derivable(whole.isel(reversal=1))
    assert field(whole.isel(reversal=[1, 0]), "ratio").equals(field(whole, "ratio"))


def test_the_explorer_shows_derived_quantities_of_a_cell(whole: xr.Dataset) -> None:
    source = Source(whole)
    shown = source.values_at({"n0": 1, "delta": 1})
    assert shown["first reversal, simulated / predicted"] == "1.25"
    assert shown["simulated − predicted"] == "+2"
    assert source.map("ratio", "delta", "n0", {}).legend["failed"] == "failed: 1 lifted off the table (1)"


@pytest.mark.browser
@pytest.mark.parametrize(
    "name", ["reversals", "difference", "ratio", "t_first_reversal_predicted", "energy_error", "spin_final"]
)
def test_pictures_and_explorer_have_the_same_colours(name: str, whole: xr.Dataset) -> None:
    from sweep.explorer.figure import MapFigure  # needs Bokeh

    whole["reversals"] += xr.DataArray(np.arange(SIZE[1], dtype="int16") ** 3, dims="delta")
    shown = MapFigure(Source(whole), "delta", "n0")
    part, _ = shown.show(replace(state.first(Source(whole)), show=name, scale="map"))
    (bar,) = shown.figure.right
    mapper, values = bar.color_mapper, np.unique(part.shown)
    straight = np.log if "Log" in type(mapper).__name__ else np.asarray
    low, high, at = (straight(v) for v in (mapper.low, mapper.high, values))
    index = ((at - low) / (high - low) * len(mapper.palette)).astype(int).clip(0, len(mapper.palette) - 1)
    drawn = next(
        axes for axes in picture.plot(whole, name).axes if axes.findobj(lambda artist: artist.get_gid() == name)
    )
    expected = drawn.collections[0].to_rgba(values)[:, :3]
    np.testing.assert_allclose([to_rgb(mapper.palette[i]) for i in index], expected, atol=0.02)
    if name == "ratio":
        assert (mapper.low, mapper.high, list(bar.major_label_overrides.values())[2]) == (0.5, 2, "1")


@pytest.mark.parametrize(
    ("variable", "limits", "arrows"),
    [
        ("ratio", {}, "max"),
        ("energy_error", {}, "neither"),
        ("t_first_reversal", {"vmax": 200}, "max"),
        ("t_first_reversal", {"vmin": 100, "vmax": 200}, "max"),
        ("spin_error", {"vmin": 2, "vmax": 3}, "min"),
    ],
)
def test_a_bar_has_arrows_where_values_lie_beyond(
    variable: str, limits: dict[str, float], arrows: str, whole: xr.Dataset
) -> None:
    bars = [axes for axes in picture.plot(whole, variable, **limits).axes if hasattr(axes, "_colorbar")]
    assert bars[-1]._colorbar.extend == arrows
    assert variable != "ratio" or bars[-1].get_yticklabels()[2].get_text() == "1"


def test_a_missing_prediction_is_not_a_missing_reversal(whole: xr.Dataset) -> None:
    whole["t_first_reversal_predicted"][:, :2] = np.nan
    figure = picture.plot(whole, "ratio")
    assert "no reversal, or none predicted (12)" in entries(figure)
    grey = [sum(patch.get_gid() == "no_value" for patch in axes.patches) for axes in figure.axes if axes.get_title()]
    assert grey == [1, 1, 1]
    whole["t_first_reversal_predicted"][3:5, 3] = np.nan
    figure = picture.plot(whole.isel(delta=3), "ratio")
    (missing,) = [line for line in figure.axes[0].lines if line.get_marker() == "|"]
    assert (missing.get_label(), len(missing.get_xdata())) == ("no reversal (1)", 1)
    assert entries(picture.plot(whole.isel(delta=1), "ratio")) == ["time of the first reversal"]


FORMULA = """\
model: analytic
body: {b: [2, 3, 4, 5, 6]}
friction: {mu: [20, 60, 100, 140, 180]}
"""


def pictures(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("*.png")}


def test_a_run_draws_the_pictures_that_are_named(tmp_path: Path, write: Write) -> None:
    file, folder = write(f"{FORMULA}picture: [status, form_factor]\n", "map.yaml"), tmp_path / "out"
    first = invoke("run", file, "--output", folder)
    assert first.stdout.splitlines()[-1] == f"wrote {folder / 'map'}.nc and .png and _form_factor.png"
    before = pictures(folder)
    for name, variable in (("map.png", None), ("map.png", "status"), ("map_form_factor.png", "form_factor")):
        picture.plot(folder / "map.nc", variable, output=tmp_path / "again.png")
        assert before[name] == (tmp_path / "again.png").read_bytes()
    assert "nothing was written" in invoke("run", file, "--output", folder).stdout

    other = invoke("run", file, "--output", folder, "--set", "picture=[form_factor]")
    assert "already complete" in other.stderr
    assert pictures(folder)["map.png"] == before["map_form_factor.png"]


def test_pictures_of_another_dataset_are_removed(tmp_path: Path, write: Write) -> None:
    """With those that a run which was killed has left half-written."""
    file = write(f"{FORMULA}picture: [status, form_factor]\n", "map.yaml")
    sweep.run(file, output=tmp_path)
    (tmp_path / ".map_form_factor.png.77.part").touch()
    sweep.run(file, output=tmp_path, progress=False)
    assert not [*tmp_path.glob(".*.part")]
    sweep.run(file, output=tmp_path, fresh=True, mu=[20, 61], picture=["status"])
    assert set(pictures(tmp_path)) == {"map.png"}


def test_pictures_do_not_identify_a_run() -> None:
    asked = {"friction": {"mu": [20, 60]}}
    plain, named = load_config(asked), load_config(asked, {"picture": ["spin_mean"]})
    assert plain.fingerprint() == named.fingerprint()
    assert "picture: [spin_mean]" in named.label()
    assert load_config(named.document()).picture == ("spin_mean",)


def test_pictures_of_a_file_are_set_aside_where_something_else_is_measured() -> None:
    asked = load_config(
        {"friction": {"mu": [20, 60]}, "measure": ["energy_error", "reversals"], "picture": ["energy_error"]}
    )
    assert load_config(asked, {"measure": ["reversals"]}).picture == ()
    assert load_config(asked, {"measure": ["reversals"], "picture": ["status"]}).picture == ("status",)
    assert load_config(asked, {"mu": [20, 70]}).picture == ("energy_error",)


def test_a_picture_that_cannot_be_drawn_is_reported_and_the_others_are_drawn(tmp_path: Path, write: Write) -> None:
    file = write(f"{FORMULA}picture: [probability, status]\n", "map.yaml")
    result = invoke("run", file, "--output", tmp_path / "out")
    assert result.exit_code == 0
    assert "no picture of probability: variable: there is no variable probability" in result.stderr
    assert list(pictures(tmp_path / "out")) == ["map_status.png"]

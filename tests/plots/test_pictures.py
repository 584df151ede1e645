"""The registry of pictures, and the picture that the page on adding one makes."""

import re
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support import ROOT
from support.figures import made

from sweep.config import InputError, load_config
from sweep.grid import CASE, SAMPLE, Array
from sweep.kernels.status import LIFT_OFF
from sweep.parameters import PARAMETERS
from sweep.plots import panels, picture, pictures, quantities
from sweep.plots.marks import marks
from sweep.plots.pictures.record import Picture
from sweep.results.dataset import VARIABLES
from sweep.results.probabilities import PROBABILITIES

AXES = {*PARAMETERS, CASE, SAMPLE, *(dim for each in (VARIABLES | PROBABILITIES).values() for dim in each.along)}
"""The dimensions that datasets have."""


def test_the_pictures_of_the_page_are_drawn(page: list[Picture]) -> None:
    rest_error, shares = page
    dataset = made(n0=[0.02, 0.05])
    dataset["spin_rest"] = dataset["spin_final"] - 0.5
    dataset["spin_error"] = 0 * dataset["spin_final"] + 0.25
    axes = picture.plot(dataset, rest_error.name, at={"n0": 0.02}).axes[0]
    drawn: Any = axes.collections[0]
    np.testing.assert_allclose(drawn.get_array(), 0.25 / np.abs(dataset["spin_rest"].values[..., 0]))

    dataset["reversals"][:, :, 1] = 3
    first, second = picture.plot(dataset, shares.name).axes
    assert (first.get_title(), second.get_title()) == ("n₀ = 0.02", "n₀ = 0.05")
    for panel, counts in ((first, dataset["reversals"][..., 0]), (second, dataset["reversals"][..., 1])):
        bars: Any = panel.patches
        expected = np.bincount(counts.values.ravel(), minlength=11) / counts.size
        np.testing.assert_allclose([bar.get_height() for bar in bars], expected)


@pytest.mark.usefixtures("page")
def test_a_configuration_names_a_picture_by_its_record_alone() -> None:
    config = load_config({"friction": {"mu": [20, 60]}, "picture": ["shares"], "measure": ["reversals"]})
    quantities.check_pictures(config)


@pytest.mark.usefixtures("page")
def test_every_record_is_of_a_variable_or_derives_it(monkeypatch: pytest.MonkeyPatch) -> None:
    needs = ("reversals", "sample", "n0", "probability", "count")
    of_samples = Picture("mean", needs, derive=lambda dataset: dataset["reversals"].mean("sample"))
    monkeypatch.setitem(pictures.PICTURES, of_samples.name, of_samples)
    variables = {*VARIABLES, *PROBABILITIES}
    for name, one in pictures.PICTURES.items():
        assert (name in variables) == (one.derive is None)
        assert set(one.needs) <= variables | AXES
        assert set(one.compares) <= {*variables, *pictures.PICTURES}


def test_no_code_asks_for_the_name_of_a_picture() -> None:
    names = "|".join(pictures.PICTURES)
    for room in ("plots", "explorer"):
        for path in (ROOT / "sweep" / room).glob("*.py"):
            asked = re.findall(
                rf'^.*\b(?:if|elif|while|and|or)\b.*[!=]= \[?"(?:{names})"', path.read_text(), re.MULTILINE
            )
            assert not asked, path


def test_panels_show_what_belongs_together_in_one(page: list[Picture]) -> None:
    chosen = panels.choose(made(n0=[0.02, 0.05]), page[1].name)
    assert (chosen.across, [*chosen.each[0]], len(chosen.each)) == ([], ["n0"], 2)
    assert panels.choose(made(n0=[0.02, 0.05]), page[1].name, x="number").across == ["number"]
    with pytest.raises(InputError, match="x: shares is not drawn over one axis"):
        panels.choose(made(n0=[0.02, 0.05]), page[1].name, x="n0")


@pytest.mark.parametrize("counts", [np.arange(11), np.arange(10), np.arange(1, 10)])
def test_a_derived_axis_that_differs_from_the_datasets_is_refused(
    counts: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Xarray would drop the share of no reversal from a dataset that counts from one."""

    def derive(dataset: xr.Dataset) -> xr.DataArray:
        return dataset["reversals"] == xr.DataArray(counts, {"count": counts}, "count")

    monkeypatch.setitem(pictures.PICTURES, "shares", Picture("shares", needs=("reversals",), derive=derive))
    monkeypatch.setitem(quantities.DERIVED, "shares", derive)
    counted = made().assign_coords(count=np.arange(1, 11))
    message = "variable: shares has other values of count than the dataset; in its derive, give this axis another name"
    with pytest.raises(InputError, match=message):
        panels.choose(counted, "shares", x="count", y="mu", at={"b": 2})
    with pytest.raises(InputError, match=message):
        quantities.with_derived(counted)
    counted = made().assign_coords(count=counts)
    assert panels.choose(counted, "shares", x="count", y="mu", at={"b": 2}).across == ["mu", "count"]


def test_a_map_shows_what_a_picture_derives_from_several_cells(page: list[Picture]) -> None:
    """Where there are samples, too, whose probabilities have an axis of counts."""
    dataset = made(n0=np.linspace(0.02, 0.07, 6)).rename(b="sample").assign_coords(count=np.arange(1, 11))
    dataset["reversals"][0] = 0
    dataset["status"][:, 2, 3] = LIFT_OFF
    figure = picture.plot(dataset, page[1].name, x="number", y="n0")
    drawn: Any = figure.axes[0].collections[0]
    expected = [np.bincount(dataset["reversals"][..., 0].values.ravel(), minlength=11) / 80]
    np.testing.assert_allclose(drawn.get_array()[:1], expected)
    kinds = marks(dataset.assign(shares=page[1].derive(dataset)), page[1].name)
    assert {where.dims for where in kinds.values()} == {("n0", "number")}
    assert not any(where.any() for where in kinds.values())


def test_no_boundaries_are_drawn_over_what_is_derived_from_several_of_their_cells(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mean = Picture("mean", ("reversals",), lambda dataset: dataset["reversals"].mean("n0"), boundaries=True)
    monkeypatch.setitem(pictures.PICTURES, "mean", mean)
    monkeypatch.setitem(quantities.DERIVED, "mean", mean.derive)
    dataset = made(n0=[0.02, 0.05])
    dataset["margin_more"] = dataset["margin_fewer"] = 0.1 + 0 * dataset["spin_final"]
    drawn: Any = picture.plot(dataset, "mean").axes[0].collections[0]
    np.testing.assert_allclose(drawn.get_array(), dataset["reversals"][..., 0])

"""Histograms of the cells, and lines of equal value over maps."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch
from support.cli import invoke, refused
from support.figures import entries, made

from sweep.kernels.status import DIVERGED, TIME_LIMIT
from sweep.plots import picture
from sweep.results.netcdf import write


def shares(axes: Axes) -> list[dict[float, float]]:
    """The bars of each histogram, by the middle of the bar."""
    found = [each.get_data() for each in axes.patches if isinstance(each, StepPatch)]
    return [dict(zip((e[1:] + e[:-1]) / 2, values, strict=True)) for values, e, _ in found]


def test_bars_are_shares_of_the_cells_that_have_a_count() -> None:
    dataset = made(mu=[20.0, 40.0, 60.0, 80.0, 100.0])  # of 1 to 5 reversals
    dataset["status"][0] = DIVERGED
    dataset["status"][1, 2:4] = TIME_LIMIT
    figure = picture.plot(dataset, histogram=True)
    (axes,) = figure.axes
    simulated, bounds, predicted = shares(axes)
    assert {count: share for count, share in simulated.items() if share} == {2: 0.25, 3: 0.25, 4: 0.25, 5: 0.25}
    assert {count: share for count, share in bounds.items() if share} == {2: 2 / 32, 3: 1 / 32}
    assert {count: share for count, share in predicted.items() if share} == dict.fromkeys((3, 4, 5, 6, 7), 0.2)
    assert axes.get_xlabel() == "spin reversals"
    assert [text.split(":")[0] for text in entries(figure)] == [
        "spin reversals, simulated", "lower bound", "spin reversals, predicted (Takano 2011)", "left out",
    ]  # fmt: skip


def test_each_value_of_an_axis_that_is_not_drawn_has_its_histogram_on_one_scale() -> None:
    dataset = made(n0=[0.02, 0.05])
    dataset["reversals"][:, :, 1] = 3
    first, second = (shares(axes)[0] for axes in picture.plot(dataset, "reversals", histogram=True).axes)
    assert first.keys() == second.keys()
    assert second[3] == 1


def test_real_numbers_have_bins_and_a_scale_like_their_map() -> None:
    dataset = made()
    dataset["t_last_reversal"] = 10.0 ** (40 * dataset["spin_final"])
    for variable, scale in (("t_last_reversal", "log"), ("spin_final", "linear")):
        (axes,) = picture.plot(dataset, variable, histogram=True).axes
        assert axes.get_xscale() == scale
        assert sum(shares(axes)[0].values()) == pytest.approx(1)
        assert 2 < len(shares(axes)[0]) <= 60


@pytest.mark.parametrize("value", [5.0, -5.0, 0.0, 1e-9])
def test_one_real_number_has_a_bar_that_can_be_seen(value: float) -> None:
    dataset = made()
    dataset["spin_final"][:] = value
    (axes,) = picture.plot(dataset, "spin_final", histogram=True).axes
    ((middle, share),) = shares(axes)[0].items()
    assert (middle, share) == (pytest.approx(value), 1)
    bar, *_ = (each for each in axes.patches if isinstance(each, StepPatch))
    assert np.ptp(bar.get_data().edges) > 0.1 * np.ptp(axes.get_xlim())


def test_limits_are_the_ends_of_the_axis() -> None:
    (axes,) = picture.plot(made(), histogram=True, limits=(1, 4)).axes
    assert axes.get_xlim() == (1, 4)


def test_a_status_is_told_in_words() -> None:
    (axes,) = picture.plot(made(), "status", histogram=True).axes
    assert "settled" in {text.get_text() for text in axes.get_xticklabels()}
    assert shares(axes)[0][1] == 79 / 80


def test_many_counts_share_bars() -> None:
    dataset = made(mu=np.linspace(20, 20000, 200))
    (axes,) = picture.plot(dataset, "reversals", histogram=True).axes
    assert len(shares(axes)[0]) <= 60
    assert sum(shares(axes)[0].values()) == pytest.approx(1)


def test_contours_pass_through_their_values() -> None:
    axes = Figure().subplots()
    picture.plot(made(), "spin_final", contours=True, sel={"n0": 0.05}, ax=axes)
    (lines,) = [each for each in axes.collections if isinstance(each, ContourSet)]
    mu = np.linspace(20, 200, 10)
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        if len(path.vertices):
            np.testing.assert_allclose(
                np.interp(path.vertices[:, 1], mu, np.linspace(-0.1, 0.02, 10)), level, atol=1e-9
            )
    assert len(lines.labelTexts) > 2
    figure = picture.plot(made(), "reversals", contours=True)
    assert not [each for each in figure.axes[0].collections if isinstance(each, ContourSet)]


def test_the_command_draws_both(tmp_path: Path) -> None:
    write(tmp_path / "made.nc", made())
    for option in ("--histogram", "--contours"):
        for variable in ("reversals", "spin_final"):
            assert invoke("plot", tmp_path / "made.nc", option, "--var", variable).exit_code == 0
        page = invoke("plot", tmp_path / "made.nc", option, "--output", tmp_path / "page.html")
        refused(page, f"{option}: not for a page")

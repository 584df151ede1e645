"""Maps of several datasets side by side."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support.cli import invoke, refused
from support.figures import constants, entries, made

import sweep
from sweep.plots import picture


@pytest.fixture
def two(small: xr.Dataset) -> list[xr.Dataset]:
    """Two runs over mu and b, of which the other one has more reversals, and friction of another size."""
    one = small.isel(n0=0, drop=True)
    other = one.assign_coords(mu=one["mu"] / 100).assign_attrs(title="other: reversals of a rattleback (slip model)")
    other["reversals"] = other["reversals"] + 7
    other["status"] = xr.full_like(other["status"], 2)
    return [one, other.assign_coords(delta=0.5)]


def test_maps_side_by_side_have_symbols_if_they_are_large() -> None:
    for number, told in ((2, True), (8, False)):
        figure = sweep.plot([made()] * number, x="b", y="mu", figsize=(7, 6))
        assert any("c2" in text.get_text() for text in figure.axes[0].texts) == told


def test_one_scale_and_axes_of_their_own(two: list[xr.Dataset]) -> None:
    figure = sweep.plot(two, x="b", y="mu")
    one, other, bar = figure.axes
    assert [axes.get_title() for axes in (one, other)] == ["small", "other"]
    norms = [axes.collections[0].norm for axes in (one, other)]
    counts = np.concatenate([dataset["reversals"].values.ravel() for dataset in two])
    assert norms[0] is norms[1]
    assert norms[0](counts.min()) < norms[0](counts.max())
    assert bar.get_ylim() == (counts.min() - 0.5, counts.max() + 0.5)
    assert one.get_ylim()[1] > 10 * other.get_ylim()[1]
    assert "a = 10" in constants(figure)
    assert "delta" not in constants(figure)
    assert "δ" not in constants(figure)


def test_the_legend_explains_the_lines_of_each() -> None:
    over_b, over_n0 = made(), made(n0=[0.02, 0.03, 0.05, 0.07, 0.1]).isel(b=0)
    told = [words for words in entries(sweep.plot([over_b, over_n0])) if "c2" in words]
    assert [words.rpartition(" ")[2] for words in told] == ["smaller", "larger"]


def test_the_legend_counts_the_cells_of_each(two: list[xr.Dataset]) -> None:
    limits = [int((dataset["status"] == 2).sum()) for dataset in two]
    assert f"({limits[0]} of 6 and {limits[1]} of 6)" in entries(picture.plot(two, x="b", y="mu"))[0]


def test_flags_and_real_numbers(two: list[xr.Dataset]) -> None:
    two[0]["status"] = xr.full_like(two[0]["status"], 1)
    figure = picture.plot(two, "status", x="b", y="mu")
    assert len(figure.axes) == 2
    assert entries(figure) == [
        "settled (6 of 6 and 0 of 6)", "ended at the time limit (0 of 6 and 6 of 6)",
    ]  # fmt: skip
    colours = [axes.collections[0].to_rgba([1, 2]) for axes in figure.axes]
    np.testing.assert_array_equal(*colours)
    one, other, _ = picture.plot(two, "spin_final", x="b", y="mu").axes
    assert one.collections[0].get_clim() == other.collections[0].get_clim()


def test_what_cannot_stand_side_by_side(two: list[xr.Dataset], small: xr.Dataset) -> None:
    with pytest.raises(ValueError, match="no two axes"):
        picture.plot([two[0], two[1].isel(mu=0)], x="b")
    with pytest.raises(ValueError, match="10 maps side by side are more than 8"):
        picture.plot([small] * 5, x="b", y="mu")
    two[1]["spin_final"].attrs["units"] = "rad s-1"
    with pytest.raises(ValueError, match=r"different units, √\(g/c\) in small and rad/s in other; only"):
        picture.plot(two, "spin_final", x="b", y="mu")
    critical = xr.Dataset({"critical_reason": ("mu", [0, 0])}, {"mu": [1.0, 2.0]})
    for several in ([], [critical, critical]):
        with pytest.raises(ValueError, match="side by side only if each is of a run"):
            picture.plot(several)


def test_from_the_shell(two: list[xr.Dataset], tmp_path: Path) -> None:
    files = [tmp_path / "one.nc", tmp_path / "other.nc"]
    for file, dataset in zip(files, two, strict=True):
        dataset.to_netcdf(file)
    assert invoke("plot", *files, "--x", "b", "--y", "mu").exit_code == 0
    assert (tmp_path / "one-other.png").read_bytes().startswith(b"\x89PNG")
    refused(invoke("plot", *files, "--output", tmp_path / "x.html"), "a page shows one dataset; write")

"""What the pictures of a dataset contain, read from the artists of the figures."""

import tracemalloc
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, to_rgb
from matplotlib.figure import Figure
from support.cli import invoke
from support.figures import constants, entries, made, maps

import sweep
from sweep.config import InputError
from sweep.kernels.status import DIVERGED, SETTLED, TIME_LIMIT, Doubt
from sweep.plots import labels, panels, picture, scales, theory
from sweep.plots.hatches import outline
from sweep.results.dataset import VARIABLES, described
from sweep.results.netcdf import open_dataset, write


def mesh(axes: Axes) -> Any:
    return axes.collections[0]


def marked(axes: Axes, kind: str) -> list[Any]:
    return [patch for patch in axes.patches if patch.get_gid() == kind]


def test_simulated_predicted_and_their_difference_stand_side_by_side() -> None:
    figure = picture.plot(made())
    assert [axes.get_title().split("\n")[0] for axes in maps(figure)] == [
        "simulated", "predicted (Takano 2011)", "simulated − predicted",
    ]  # fmt: skip
    simulated, predicted, difference = map(mesh, maps(figure))
    assert simulated.norm is predicted.norm or (simulated.norm.boundaries == predicted.norm.boundaries).all()
    assert (difference.get_array() == -2).all()


@pytest.mark.parametrize("size", [{}, {"width": "180mm"}])
def test_a_variable_has_one_scale_and_one_bar_in_a_figure(size: dict[str, str]) -> None:
    dataset = made(n0=[0.02, 0.05, 0.1])
    dataset["reversals"] = dataset["reversals"] + xr.DataArray([0, 4, 9], dims="n0").astype("int16")
    figure = picture.plot(dataset, **size)
    simulated, predicted, difference = (maps(figure)[i::3] for i in range(3))
    for alike, value in (([*simulated, *predicted], 11), (difference, -2)):
        assert len({tuple(mesh(axes).norm.boundaries) for axes in alike}) == 1
        assert len({tuple(mesh(axes).cmap(mesh(axes).norm(value))) for axes in alike}) == 1
    bars = [axes.get_ylabel() for axes in figure.axes if axes.get_label() == "<colorbar>"]
    assert bars == ["spin reversals", "simulated − predicted"]


def test_the_label_of_a_bar_is_nearer_to_its_bar_than_to_any_map() -> None:
    figure = picture.plot(made())
    figure.draw_without_rendering()
    for bar in (axes for axes in figure.axes if axes.get_label() == "<colorbar>"):
        label = bar.yaxis.label.get_window_extent()
        places = {axes: axes.get_window_extent() for axes in [bar, *maps(figure)]}
        apart = {axes: max(place.x0 - label.x1, label.x0 - place.x1) for axes, place in places.items()}
        assert min(apart, key=lambda axes: apart[axes]) is bar


@pytest.mark.parametrize("width", [None, "85mm", "180mm"])
def test_a_boundary_is_drawn_with_its_number_or_not_at_all(width: str | None) -> None:
    one = made(n0=[0.02, 0.05])
    one = one.assign(margin_more=one.spin_final * 0 + 0.5, margin_fewer=one.spin_final * 0 + 0.5)
    figure = picture.plot(one, width=width)
    for axes in maps(figure):
        lines = [line for line in axes.lines if line.get_gid() == "boundary"]
        numbers = [text.get_position() for text in axes.texts if text.get_text().isdigit()]
        assert len(lines) == len(numbers)
        assert all(any((line.get_xydata() == at).all(axis=1).any() for line in lines) for at in numbers)
    assert any("boundary" in text for text in entries(figure)) == (width != "85mm")


def test_a_single_cell_is_written_not_drawn() -> None:
    (axes,) = picture.plot(made(), at={"mu": 80, "b": 3, "n0": 0.05}).axes
    assert not axes.axison
    assert not axes.lines
    (text,) = axes.texts
    assert text.get_text().split("\n") == ["spin reversals, simulated: 4", "spin reversals, predicted (Takano 2011): 6"]


def test_a_map_reads_no_more_of_a_file_than_it_shows(tmp_path: Path) -> None:
    axes = {"mu": np.arange(4000.0), "n0": np.arange(3000.0)}
    counts = np.add.outer(np.arange(4000), np.arange(3000)).astype("int16")
    names = ("reversals", "reversals_predicted")
    whole = xr.Dataset({name: (tuple(axes), counts) for name in names}, axes)
    write(tmp_path / "large.nc", whole)
    with open_dataset(tmp_path / "large.nc", load=False) as lazy:
        tracemalloc.start()
        shown = panels.choose(lazy).dataset.load()
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert most < counts.nbytes
    xr.testing.assert_equal(shown.drop_vars("difference"), whole.isel(mu=slice(None, None, 4), n0=slice(None, None, 3)))
    assert (shown.difference == 0).all()


def test_a_difference_is_coloured_evenly_about_zero() -> None:
    dataset = made()
    dataset["reversals_predicted"] += xr.where(dataset.mu > 100, -9, 3).astype("int16")
    drawn = mesh(maps(picture.plot(dataset))[2])
    assert drawn.norm.boundaries[[0, -1]].tolist() == [-5.5, 7.5]  # the bar ends where the values do
    assert drawn.norm.extend == "neither"
    whole = mpl.colormaps[scales.DIVERGING](np.linspace(0, 1, 15))  # from -7 to 7
    np.testing.assert_allclose(drawn.cmap(drawn.norm(np.arange(-5, 8))), whole[2:], atol=0.01)


def test_colours_of_different_values_differ_in_lightness() -> None:
    counts, differences = np.arange(18), np.arange(-10, 11)
    for name in (scales.SEQUENTIAL, "cividis"):
        assert (np.diff(scales.counts(counts, name=name).lightness(counts)) > 0.01).all()
    steps = np.diff(scales.differences(differences).lightness(differences))
    assert (steps * np.repeat([1, -1], 10) > 0.01).all()  # darker on both sides


@pytest.mark.parametrize("top", [1, 6, 16, 30, 33, 41, 60, 207, 3000])
def test_every_count_has_a_colour_and_high_ones_differ(top: int) -> None:
    scale = scales.counts(np.arange(top + 1))
    assert isinstance(scale.norm, BoundaryNorm)
    assert scale.norm.boundaries[0] == -0.5
    assert scale.norm.boundaries[-1] > top
    assert scale.norm.extend == "neither"
    assert scale.norm.Ncmap <= 24
    # No range is wider than four fifths of the count at which it begins, and they become wider in round steps.
    first, widths = scale.norm.boundaries[:-1] + 0.5, np.diff(scale.norm.boundaries).astype(int)
    assert (widths <= np.maximum(1, 0.8 * first)).all()
    assert (np.diff(widths) >= 0).all()
    assert (first[widths > 1] % np.gcd(widths[widths > 1], 10) == 0).all()
    for at, words in (scale.ticks or {}).items():  # where steps grow, the bar says from where to where they go
        k = np.searchsorted(scale.norm.boundaries, at) - 1
        low, high = scale.norm.boundaries[k] + 0.5, scale.norm.boundaries[k + 1] - 0.5
        assert words == (f"{low:.0f}" if low == high else f"{low:.0f}–{high:.0f}")
    assert len({tuple(c) for c in scale.rgba(first)}) == len(first)


def test_lower_bounds_are_hatched_and_explained() -> None:
    figure = picture.plot(made())
    simulated, predicted, difference = maps(figure)
    for axes in (simulated, difference):
        (patch,) = marked(axes, "time_limit")
        assert patch.get_hatch()
        np.testing.assert_allclose(patch.get_path().get_extents().extents, [4.5, 50, 5.5, 70])
    assert not marked(predicted, "time_limit")
    assert any(text.startswith("lower bound") and "(1)" in text for text in entries(figure))


@pytest.mark.parametrize(("limited", "settled"), [(4, True), (6, True), (10, False)])
def test_a_mark_that_most_cells_share_is_a_sentence_instead_of_a_hatch(limited: int, settled: bool) -> None:
    """A model that never settles has no lower bounds."""
    dataset = made()
    dataset["status"][:] = SETTLED
    dataset["status"][:limited] = TIME_LIMIT
    figure = picture.plot(dataset)
    hatched = any(marked(axes, "time_limit") for axes in maps(figure))
    words = "lower bound: time limit" if settled else "followed up to the time limit"
    number = f"{8 * limited} of 80" if settled else "all 80"
    assert hatched == (limited == 4)
    assert (f"{words} ({8 * limited})" in entries(figure)) == hatched
    assert (f"\n{words}, in {number} cells" in constants(figure)) == (not hatched)


def test_a_map_ends_where_the_semi_axes_are_equal_and_says_which_cells_it_leaves_out() -> None:
    near, past, beyond = np.linspace(2, 9.8, 8), np.linspace(2, 12, 8), np.linspace(11, 18, 8)
    for b, end in ((near, 10), (past, 10), (beyond, 18.5)):
        figure = picture.plot(made(b=b), "reversals")
        assert maps(figure)[0].get_xlim()[1] == pytest.approx(end)
        assert ("b > a" in figure.legends[0].get_title().get_text()) == (b is past)


def test_boundaries_reach_the_frame() -> None:
    one = made()
    one = one.assign(margin_more=one.spin_final * 0 + 0.5, margin_fewer=one.spin_final * 0 + 0.5)
    axes = maps(picture.plot(one, "reversals"))[0]
    lines = [line.get_xdata() for line in axes.lines if line.get_gid() == "boundary"]
    assert lines
    assert all(sorted((x[0], x[-1])) == pytest.approx(axes.get_xlim()) for x in lines)


def test_a_line_in_the_legend_has_the_dash_of_the_figure() -> None:
    for dataset in (made(n0=[0.02]), made(n0=[0.02]).isel(b=3, n0=0)):
        figure = picture.plot(dataset, "reversals")
        named = {line.get_label(): line for line in figure.legends[0].get_lines()}
        for line in (line for axes in figure.axes for line in axes.lines if line.get_gid() in ("n_c1", "n_c2", "best")):
            begin = theory.WORDS.get(line.get_gid(), "b = ")
            (entry,) = [each for words, each in named.items() if words.startswith(begin)]
            assert (entry._dash_pattern, entry.get_linewidth()) == (line._dash_pattern, line.get_linewidth())


def test_legends_are_never_over_the_data() -> None:
    figure = picture.plot(made())
    figure.draw_without_rendering()
    assert not any(axes.get_legend() for axes in figure.axes)
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert all(box.y1 <= axes.get_window_extent().y0 for axes in figure.axes)
    assert box.x0 >= 0
    assert box.x1 <= figure.bbox.x1


def test_hatches_stand_out_from_dark_and_light_cells() -> None:
    dataset = made()
    dataset["status"][2:4], dataset["status"][8:] = TIME_LIMIT, TIME_LIMIT
    axes = maps(picture.plot(dataset))[0]
    white, black = marked(axes, "time_limit")
    assert to_rgb(white.get_edgecolor()) == (1, 1, 1)
    assert to_rgb(black.get_edgecolor()) == (0, 0, 0)
    assert white.get_path().vertices[:, 1].max() <= black.get_path().vertices[:, 1].min()  # low counts are dark


def test_failed_cells_and_those_limited_by_round_off_look_different() -> None:
    dataset = made()
    dataset["status"][0] = DIVERGED
    dataset["doubts"][3] = Doubt.ROUND_OFF
    figure = picture.plot(dataset)
    axes = maps(figure)[0]
    hatches = {marked(axes, kind)[0].get_hatch() for kind in ("failed", "round_off", "time_limit")}
    assert len(hatches) == 3
    assert mesh(axes).get_array().mask[0].all()
    assert not mesh(maps(figure)[1]).get_array().mask.any()  # a prediction cannot fail
    assert not mesh(axes).get_array().mask[1:].any()
    assert [text.split(" ")[0] for text in entries(figure)[:3]] == ["failed:", "lower", "limited"]


def test_one_patch_covers_the_cells_and_nothing_else() -> None:
    where = np.random.default_rng(1).random((7, 9)) < 0.5
    path = outline(where, np.arange(8.0), np.arange(10.0))
    inside = [[path.contains_point((j + 0.5, i + 0.5)) for j in range(9)] for i in range(7)]
    np.testing.assert_array_equal(inside, where)


def test_the_critical_spins_are_contours_where_they_equal_the_start_spin() -> None:
    axes = maps(picture.plot(made(n0=[0.02])))[0]
    # n_c1 = 1/mu of the eigenvalues, not the 3/mu of the formula; n_c2 = 2/mu.
    for name, factor in (("n_c1", 1.0), ("n_c2", 2.0)):
        (line,) = [line for line in axes.lines if line.get_gid() == name]
        np.testing.assert_allclose(line.get_ydata(), factor / 0.02, rtol=0.05)
        assert np.ptp(line.get_xdata()) == 8


def test_no_contour_of_a_spin_of_the_other_sign() -> None:
    figure = picture.plot(made(n0=[-0.02]))
    assert {"n_c1", "n_c2"} <= {line.get_gid() for line in maps(figure)[0].lines}
    below = made(n0=[-0.02]).sel(sign=1)
    assert not {"n_c1", "n_c2"} & {line.get_gid() for line in maps(picture.plot(below))[0].lines}


def test_theory_is_drawn_over_reversals_alone() -> None:
    for variable, lines in (("reversals", {"best", "n_c1", "n_c2"}), ("status", set()), ("spin_final", set())):
        axes = maps(picture.plot(made(n0=[0.02]), variable))[0]
        assert {artist.get_gid() for artist in axes.lines if artist.get_gid()} == lines
    assert any("largest form factor L(f)" in text for text in entries(picture.plot(made())))


def test_a_status_is_written_in_words() -> None:
    figure = picture.plot(made(), "status")
    assert entries(figure) == ["settled (79)", "ended at the time limit (1)"]
    assert len(figure.axes) == 1  # and no bar with numbers
    several = picture.plot(made(n0=[0.02, 0.05]), "status")  # whose words alone would not say what they are about
    assert maps(several)[0].get_title() == "how the trajectory ended\nn₀ = 0.02"


@pytest.mark.parametrize("variable", [None, "status", "difference", "t_last_reversal"])
def test_a_mean_over_an_axis_has_no_marks(variable: str | None) -> None:
    """A mean of the codes of a status is no status."""
    dataset = made(n0=[0.02, 0.05])
    dataset["status"][:] = TIME_LIMIT
    dataset["t_last_reversal"] = dataset["spin_final"] ** 2
    figure = picture.plot(dataset.mean("n0"), variable)
    assert not any(axes.patches for axes in figure.axes)
    assert not [text for text in entries(figure) if "n$_" not in text and "L(f)" not in text]
    assert len(figure.axes) == (5 if variable in (None, "difference") else 2)  # with bars, also of the status


def test_a_mean_difference_keeps_its_fraction() -> None:
    dataset = made(n0=[0.02, 0.05])
    dataset["reversals"][:, :, 0] += 1
    mean = dataset.mean("n0")
    np.testing.assert_allclose(mesh(maps(picture.plot(mean, "difference"))[2]).get_array(), -1.5)


def test_signed_values_are_coloured_evenly_about_zero() -> None:
    drawn = mesh(maps(picture.plot(made(), "spin_final"))[0])
    assert (drawn.norm.vmin, drawn.norm.vmax) == (-0.1, 0.02)
    whole = mpl.colormaps[scales.DIVERGING]((1 + np.array([-1, -0.2, 0, 0.2])) / 2)  # from -0.1 to 0.1
    np.testing.assert_allclose(drawn.to_rgba([-0.1, -0.02, 0, 0.02]), whole, atol=0.02)


@pytest.mark.parametrize("starts", [1, 3, 8])
def test_a_page_fits_a_screen(starts: int) -> None:
    dataset = made(n0=np.linspace(0.02, 0.1, starts))
    for variable in (None, "reversals", "status"):
        wide, high = picture.plot(dataset, variable, x="b", y="mu").get_size_inches() * 110
        assert wide <= 1700
        assert high <= 1500
    with pytest.raises(InputError, match="9 panels"):
        picture.plot(made(n0=np.linspace(0.02, 0.1, 9)), "reversals", x="b", y="mu")


def test_the_nearest_value_is_drawn() -> None:
    dataset = made(n0=[0.02, 0.05])
    figure = picture.plot(dataset, at={"n0": 0.04})
    assert "n₀ = 0.05" in constants(figure)
    with pytest.raises(ValueError, match="no axis q; the axes are mu, b, n0"):
        picture.plot(dataset, at={"q": 1})


def test_logarithmic_and_uneven_axes_are_drawn_so() -> None:
    mu = np.geomspace(20, 200, 7)
    axes = maps(picture.plot(made(mu=mu, b=[2, 3, 5, 6, 9])))[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    axes.figure.draw_without_rendering()
    assert {text.get_text() for text in axes.get_yticklabels()} >= {"20", "50", "100", "200"}
    corners = mesh(axes).get_coordinates()
    np.testing.assert_allclose(corners[:, 0, 1], 20 * 10 ** ((np.arange(8) - 0.5) / 6))
    np.testing.assert_array_equal(corners[0, :, 0], [1.5, 2.5, 4, 5.5, 7.5, 10.5])


def test_axes_in_any_order_of_values() -> None:
    dataset = made()
    one, other = (mesh(maps(picture.plot(d))[0]).get_array() for d in (dataset, dataset.isel(mu=slice(None, None, -1))))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"x": "q"}, "x: reversals has no axis q; its axes are mu, b, n0"),
        ({"x": "b", "y": "b"}, "y: b is the other axis already"),
        ({"cmap": "q"}, "cmap: there is no colour map q; choose"),
        ({"vmin": 2, "vmax": 1}, "vmax: 1 is not above vmin, 2; give a larger number"),
        ({"vmax": np.inf}, "vmax: must be a finite number, not inf"),
        ({"vmin": 13}, r"vmin: 13 is beyond all values, 1 to 12; give vmax too"),
        ({"vmax": -1, "variable": "reversals", "at": {"mu": 60}}, "vmax: -1 is beyond all values, .*; give vmin too"),
        ({"width": "85mm", "ax": Figure().subplots()}, "width: the given axes have their own size"),
        ({"cmap": mpl.colormaps["magma"]}, "cmap: there is no colour map <matplotlib"),
        ({"at": ["n0"]}, "at: must be values by axis"),
        ({"width": 3}, "width: 3; give a length between 50 and 1000 mm"),
        ({"vmin": 0, "variable": "ratio", "ax": Figure().subplots()}, "vmin: 0; give a number above zero for a ratio"),
        ({"output": "x.jpg"}, "output: x.jpg: unknown format; write a png, pdf or svg"),
    ],
)
def test_wrong_choices_are_refused(wrong: dict[str, Any], said: str) -> None:
    whole = 1.0 * made().reversals
    times = whole.expand_dims(reversal=[1], axis=-1)
    with pytest.raises(InputError, match=f"^{said}"):
        picture.plot(made().assign(reversal_times=times, t_first_reversal_predicted=2 * whole), **wrong)


def test_a_limit_of_curves_may_be_the_end_of_all_values() -> None:
    """Without a warning.  Found by tests/machine."""
    curves = made(b=[2, 3, 4, 5], n0=[0.02]).isel(b=3, n0=0)
    lowest = picture.plot(curves, "reversals").axes[0].get_ylim()[0]
    low, high = picture.plot(curves, "reversals", vmax=lowest).axes[0].get_ylim()
    assert low < high == lowest


def test_curves_mark_lower_bounds_and_crossings() -> None:
    figure = picture.plot(made(b=[2, 3, 4, 5], n0=[0.02]).isel(b=3, n0=0))
    (axes,) = figure.axes
    at = {line.get_gid(): line.get_xdata()[0] for line in axes.lines if line.get_label().startswith("_")}
    assert at == {"n_c1": pytest.approx(50, rel=0.1), "n_c2": pytest.approx(100, rel=0.1)}
    assert any(text.startswith("lower bound") for text in entries(figure))
    (bound,) = [line for line in axes.lines if line.get_label().startswith("lower bound")]
    assert bound.get_xdata().tolist() == [60]


MAGIC = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}


@pytest.mark.parametrize("suffix", MAGIC)
def test_the_suffix_names_the_format(suffix: str, tmp_path: Path) -> None:
    write(tmp_path / "made.nc", made())
    for name in ("one", "two"):
        target = tmp_path / f"{name}.{suffix}"
        result = invoke("plot", tmp_path / "made.nc", "--variable", "reversals", "--at", "n0=0.06", "--output", target)
        assert result.exit_code == 0, result.output
        assert "n0 = 0.05, nearest to 0.06" in result.stdout
        assert target.read_bytes().startswith(MAGIC[suffix])
    assert (tmp_path / f"one.{suffix}").read_bytes() == (tmp_path / f"two.{suffix}").read_bytes()


@pytest.mark.parametrize(("name", "values"), [("a", [9, 10, 11]), ("c", [1, 1.5, 2]), ("delta", [0.01, 0.02, 0.03])])
def test_an_axis_of_any_parameter_is_drawn(name: str, values: list[float]) -> None:
    found = sweep.predict({"friction": {"mu": 60}}, **{name: values})
    for variable in ("reversals_predicted", "n_c1", "form_factor"):
        below = [axes.get_xlabel() for axes in picture.plot(found, variable).axes][-1]
        assert below == labels.label(found, name)


def test_numbers_along_a_further_dimension_get_panels() -> None:
    dataset = made()
    times = np.random.default_rng(1).random((*dataset["reversals"].shape, 2))
    spec = VARIABLES["reversal_times"]
    more = dataset.assign(reversal_times=(("mu", "b", "n0", "reversal"), times, described(spec)))
    more = more.assign_coords(reversal=[1, 2])
    assert len(maps(picture.plot(more, "reversal_times"))) == 2

"""What the pictures of a dataset contain, told by the artists of the figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, to_rgb
from matplotlib.figure import Figure
from support.cli import invoke, refused

import sweep
from sweep.kernels.status import DIVERGED, SETTLED, TIME_LIMIT
from sweep.plots import picture, scales
from sweep.plots.cells import outline
from sweep.plots.maps import arrangement
from sweep.plots.panels import edges
from sweep.results.dataset import VARIABLES, described, numbers_along
from sweep.results.netcdf import write


def made(**axes: Any) -> xr.Dataset:
    """A run over these axes: counts rise with mu, the critical spins fall with it, and one cell is a lower bound."""
    mu = np.asarray(axes.get("mu", np.linspace(20, 200, 10)), float)
    b = np.asarray(axes.get("b", np.linspace(2, 9, 8)), float)
    n0 = np.asarray(axes.get("n0", [0.05]), float)
    shape = (len(mu), len(b), len(n0))
    count = np.broadcast_to((mu // 20)[:, None, None], shape)
    status = np.full(shape, SETTLED)
    status[2, 3, 0] = TIME_LIMIT
    n_c1 = np.broadcast_to(1.0 / mu[:, None], shape[:2])
    values = {
        "reversals": count,
        "reversals_predicted": count + 2,
        "status": status,
        "spin_final": np.broadcast_to(np.linspace(-0.1, 0.02, len(mu))[:, None, None], shape),
        "noise_limited": np.zeros(shape),
        "n_c1_plus_linear": n_c1,
        "n_c1_minus_linear": -n_c1,
        "n_c1_plus": 3 * n_c1,
        "n_c2_plus": 2 * n_c1,
        "n_c2_minus": -2 * n_c1,
    }
    dims = ("mu", "b", "n0")
    variables = {
        name: xr.Variable(dims[: v.ndim], v.astype(VARIABLES[name].dtype), described(VARIABLES[name]))
        for name, v in values.items()
    }
    constants = {"a": 10.0, "c": 1.0, "delta": 0.03}
    return xr.Dataset(variables, {"mu": mu, "b": b, "n0": n0, **constants}, {"title": "made"})


def maps(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_xlabel() or axes.get_title()]


def mesh(axes: Axes) -> Any:
    return axes.collections[0]


def marked(axes: Axes, kind: str) -> list[Any]:
    return [patch for patch in axes.patches if patch.get_gid() == kind]


def entries(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def test_simulated_predicted_and_their_difference_stand_side_by_side() -> None:
    figure = picture.draw(made())
    assert [axes.get_title().split(",")[0] for axes in maps(figure)] == [
        "simulated", "predicted (Takano 2011)", "simulated − predicted",
    ]  # fmt: skip
    simulated, predicted, difference = map(mesh, maps(figure))
    assert simulated.norm is predicted.norm or (simulated.norm.boundaries == predicted.norm.boundaries).all()
    assert (difference.get_array() == -2).all()


def test_a_difference_is_coloured_evenly_about_zero() -> None:
    dataset = made()
    dataset["reversals_predicted"] += xr.where(dataset.mu > 100, -9, 3).astype("int16")
    norm = mesh(maps(picture.draw(dataset))[2]).norm
    np.testing.assert_array_equal(norm.boundaries, -norm.boundaries[::-1])
    assert norm(0) == (norm.Ncmap - 1) / 2
    assert norm.boundaries[-1] > 7


@pytest.mark.parametrize("name", [scales.SEQUENTIAL, "cividis"])
def test_counts_get_steadily_lighter(name: str) -> None:
    lightness = scales.counts(np.arange(18), name=name).lightness(np.arange(18))
    assert (np.diff(lightness) > 0.01).all()


def test_differences_get_steadily_darker_on_both_sides() -> None:
    lightness = scales.differences(np.arange(-10, 11)).lightness(np.arange(-10, 11))
    assert (np.diff(lightness[:11]) > 0.01).all()
    assert (np.diff(lightness[10:]) < -0.01).all()


@pytest.mark.parametrize("top", [1, 6, 16, 33, 41, 200, 3000])
def test_every_count_has_a_colour_and_high_ones_are_told_apart(top: int) -> None:
    scale = scales.counts(np.arange(top + 1))
    assert isinstance(scale.norm, BoundaryNorm)
    assert scale.norm.boundaries[0] == -0.5
    assert scale.norm.boundaries[-1] > top
    assert scale.norm.extend == "neither"
    assert scale.norm.Ncmap <= 24
    # No range is wider than a quarter of the counts in it.
    first = scale.norm.boundaries[:-1] + 0.5
    assert (np.diff(scale.norm.boundaries) <= np.maximum(1, 0.8 * first)).all()
    assert len({tuple(c) for c in scale.rgba(first)}) == len(first)


def test_limits_leave_arrows_for_what_is_beyond() -> None:
    norm = mesh(maps(picture.draw(made(), limits=(3, 5)))[0]).norm
    assert (norm.boundaries[0], norm.boundaries[-1], norm.extend) == (2.5, 5.5, "both")


def test_the_ticks_of_counts_are_integers() -> None:
    figure = picture.draw(made())
    bars = [axes for axes in figure.axes if axes not in maps(figure)]
    assert len(bars) == 2
    for bar in bars:
        ticks = [text.get_text().replace("−", "-") for text in bar.get_yticklabels()]
        assert len(ticks) > 2
        assert all(tick == str(int(tick)) for tick in ticks)


def test_lower_bounds_are_hatched_and_explained() -> None:
    figure = picture.draw(made())
    simulated, predicted, difference = maps(figure)
    for axes in (simulated, difference):
        (patch,) = marked(axes, "time_limit")
        assert patch.get_hatch()
        np.testing.assert_allclose(patch.get_path().get_extents().extents, [4.5, 50, 5.5, 70])
    assert not marked(predicted, "time_limit")
    assert any(text.startswith("lower bound") and "(1 of 80)" in text for text in entries(figure))


def test_legends_are_never_over_the_data() -> None:
    figure = picture.draw(made())
    figure.draw_without_rendering()
    assert not any(axes.get_legend() for axes in figure.axes)
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert all(box.y1 <= axes.get_window_extent().y0 for axes in figure.axes)
    assert box.x0 >= 0
    assert box.x1 <= figure.bbox.x1


def test_hatches_stand_out_from_dark_and_light_cells() -> None:
    dataset = made()
    dataset["status"][:] = TIME_LIMIT
    axes = maps(picture.draw(dataset))[0]
    white, black = marked(axes, "time_limit")
    assert to_rgb(white.get_edgecolor()) == (1, 1, 1)
    assert to_rgb(black.get_edgecolor()) == (0, 0, 0)
    assert white.get_path().vertices[:, 1].max() <= black.get_path().vertices[:, 1].min()  # low counts are dark


def test_failed_inferred_and_noise_limited_cells_are_told_apart() -> None:
    dataset = made()
    dataset["status"][0] = DIVERGED
    dataset["noise_limited"][3] = 1
    dataset["inferred"] = dataset["noise_limited"].copy(data=np.roll(dataset["noise_limited"], 2, axis=0))
    figure = picture.draw(dataset)
    axes = maps(figure)[0]
    hatches = {marked(axes, kind)[0].get_hatch() for kind in ("failed", "noise_limited", "inferred", "time_limit")}
    assert len(hatches) == 4
    assert mesh(axes).get_array().mask[0].all()
    assert not mesh(axes).get_array().mask[1:].any()
    assert [text.split(" ")[0] for text in entries(figure)[:4]] == ["failed:", "lower", "inferred", "limited"]


def test_one_patch_covers_the_cells_and_nothing_else() -> None:
    where = np.random.default_rng(1).random((7, 9)) < 0.5
    path = outline(where, np.arange(8.0), np.arange(10.0))
    inside = [[path.contains_point((j + 0.5, i + 0.5)) for j in range(9)] for i in range(7)]
    np.testing.assert_array_equal(inside, where)


def test_the_critical_spins_are_contours_where_they_equal_the_start_spin() -> None:
    axes = maps(picture.draw(made(n0=[0.02])))[0]
    lines = {line.get_gid(): line for line in axes.collections if line.get_gid()}
    # n_c1 = 1/mu of the eigenvalues, not the 3/mu of the formula; n_c2 = 2/mu.
    for name, factor in (("n_c1", 1.0), ("n_c2", 2.0)):
        (path,) = [p for p in lines[name].get_paths() if len(p.vertices)]
        np.testing.assert_allclose(path.vertices[:, 1], factor / 0.02, rtol=0.05)
        assert np.ptp(path.vertices[:, 0]) == 7


def test_no_contour_of_a_spin_of_the_other_sign() -> None:
    figure = picture.draw(made(n0=[-0.02]))
    lines = {line.get_gid() for line in maps(figure)[0].collections}
    assert {"n_c1", "n_c2"} <= lines
    below = made(n0=[-0.02]).drop_vars(["n_c1_minus_linear", "n_c2_minus"])
    assert not {"n_c1", "n_c2"} & {line.get_gid() for line in maps(picture.draw(below))[0].collections}


@pytest.mark.parametrize(("x", "y"), [("n0", "mu"), ("mu", "n0")])
def test_the_critical_spins_are_curves_over_start_spins(x: str, y: str) -> None:
    figure = picture.draw(made(n0=np.linspace(-0.2, 0.2, 21)), x=x, y=y, sel={"b": 3.0})
    for axes in maps(figure):
        curves = [line for line in axes.lines if line.get_gid() == "n_c2"]
        assert len(curves) == 2
        for line, sign in zip(curves, (2, -2), strict=True):
            spin, mu = line.get_data() if x == "n0" else reversed(line.get_data())
            np.testing.assert_allclose(spin, sign / np.asarray(mu))
    assert any("n$_{c1}$ (eigenvalues)" in text for text in entries(figure))
    assert any("n$_{c2}$ (formula)" in text for text in entries(figure))


def test_theory_is_drawn_over_reversals_alone() -> None:
    for variable, lines in (("reversals", {"best", "n_c1", "n_c2"}), ("status", set()), ("spin_final", set())):
        axes = maps(picture.draw(made(n0=[0.02]), variable))[0]
        assert {artist.get_gid() for artist in [*axes.lines, *axes.collections] if artist.get_gid()} == lines
    assert any("L(f) is largest" in text for text in entries(picture.draw(made())))


def test_a_status_is_told_in_words() -> None:
    figure = picture.draw(made(), "status")
    assert entries(figure) == ["settled (79 of 80)", "ended at the time limit (1 of 80)"]
    assert len(figure.axes) == 1  # and no bar with numbers


def test_signed_values_are_coloured_evenly_about_zero() -> None:
    norm = mesh(maps(picture.draw(made(), "spin_final"))[0]).norm
    assert (norm.vmin, norm.vmax) == (-0.1, 0.1)


@pytest.mark.parametrize(("panels", "names"), [(n, m) for n in range(1, 9) for m in (1, 2, 3)])
def test_a_page_is_compact(panels: int, names: int) -> None:
    rows, groups = arrangement(panels, names)
    assert rows * groups >= panels > (rows - 1) * groups


@pytest.mark.parametrize("starts", [1, 3, 4, 8])
def test_a_page_fits_a_screen(starts: int) -> None:
    dataset = made(n0=np.linspace(0.02, 0.1, starts))
    for variable in (None, "reversals", "status"):
        wide, high = picture.draw(dataset, variable, x="b", y="mu").get_size_inches() * 110
        assert wide <= 1700
        assert high <= 1500


def test_the_nearest_value_is_drawn() -> None:
    dataset = made(n0=[0.02, 0.05])
    figure = picture.draw(dataset, sel={"n0": 0.04})
    assert "n₀ = 0.05" in figure.get_suptitle()
    with pytest.raises(ValueError, match="no axis q; allowed: mu, b, n0"):
        picture.draw(dataset, sel={"q": 1})


def test_logarithmic_and_uneven_axes_are_drawn_so() -> None:
    mu = np.geomspace(20, 200, 7)
    axes = maps(picture.draw(made(mu=mu, b=[2, 3, 5, 6, 9])))[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    axes.figure.draw_without_rendering()
    assert {text.get_text() for text in axes.get_yticklabels()} >= {"20", "50", "100", "200"}
    np.testing.assert_allclose(edges(mu), np.geomspace(mu[0] ** 1.5 / mu[1] ** 0.5, mu[6] ** 1.5 / mu[5] ** 0.5, 8))
    np.testing.assert_array_equal(edges(np.array([2.0, 3, 5])), [1.5, 2.5, 4, 6])
    np.testing.assert_array_equal(mesh(axes).get_coordinates()[0, :, 0], edges(np.array([2.0, 3, 5, 6, 9])))


def test_axes_in_any_order_of_values() -> None:
    dataset = made()
    one, other = (mesh(maps(picture.draw(d))[0]).get_array() for d in (dataset, dataset.isel(mu=slice(None, None, -1))))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"x": "q"}, "x: reversals has no axis q; allowed: mu, b, n0"),
        ({"x": "b", "y": "b"}, "x and y are both b"),
        ({"cmap": "q"}, "no colour map q; allowed"),
        ({"limits": (2, 1)}, r"limits: 2..1; allowed"),
        ({"variable": "q"}, "no variable q; allowed: reversals"),
        ({"output": "x.jpg"}, r"x.jpg: unknown format; allowed: a file that ends in .png, .pdf, .svg"),
    ],
)
def test_wrong_choices_are_refused(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        picture.plot(made(), **wrong)


def test_curves_tell_lower_bounds_and_crossings() -> None:
    figure = picture.draw(made(b=[2, 3, 4, 5], n0=[0.02]).isel(b=3, n0=0))
    (axes,) = figure.axes
    at = {line.get_gid(): line.get_xdata()[0] for line in axes.lines if line.get_gid()}
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
        result = invoke("plot", tmp_path / "made.nc", "--sel", "n0=0.1", "--output", target)
        assert result.exit_code == 0, result.output
        assert "n0 = 0.05, nearest to 0.1" in result.stdout
        assert target.read_bytes().startswith(MAGIC[suffix])
    assert (tmp_path / f"one.{suffix}").read_bytes() == (tmp_path / f"two.{suffix}").read_bytes()


def test_the_command_refuses_in_one_line(tmp_path: Path) -> None:
    write(tmp_path / "made.nc", made())
    for options, said in (
        (("--output", tmp_path / "x.jpg"), "x.jpg: unknown format; write a file that ends in .png, .pdf, .svg"),
        (("--limits", "3"), "--limits 3: must be LOW..HIGH"),
        (("--limits", "3..1"), "--limits 3..1: must be LOW..HIGH"),
        (("--sel", "n0"), "--sel n0: must be NAME=NUMBER"),
        (("--x", "c"), "no axis c; allowed: mu, b, n0"),
    ):
        refused(invoke("plot", tmp_path / "made.nc", *options), said)
    assert [path.name for path in tmp_path.iterdir()] == ["made.nc"]


def test_a_large_map_is_drawn_with_all_its_marks() -> None:
    large = made(mu=np.linspace(20, 200, 300), b=np.linspace(2, 9, 300))
    large["status"][:] = np.where(np.random.default_rng(1).random(large["status"].shape) < 0.5, SETTLED, TIME_LIMIT)
    figure = picture.draw(large)
    assert mesh(maps(figure)[0]).get_array().shape == (300, 300)
    figure.draw_without_rendering()


def test_numbers_along_a_further_dimension_get_panels() -> None:
    dataset = made()
    times = np.random.default_rng(1).random((*dataset["reversals"].shape, 2))
    spec = VARIABLES["reversal_times"]
    more = dataset.assign(reversal_times=(("mu", "b", "n0", "reversal"), times, described(spec)))
    more = more.assign_coords(numbers_along({"reversal_times": times.shape}))
    assert len(maps(picture.draw(more, "reversal_times"))) == 2


def test_a_notebook_shows_a_map_before_pyplot_is_imported(small: xr.Dataset) -> None:
    shown = sweep.plot(small)._repr_png_()
    assert shown.startswith(b"\x89PNG")

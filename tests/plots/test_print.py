"""Figures for print, in a style of the user's own, and in axes of the user's own."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib import layout_engine
from matplotlib.figure import Figure
from matplotlib.text import Text
from support.cli import invoke, refused
from support.figures import entries, made

from sweep.faults import InputError
from sweep.plots import picture
from sweep.results.netcdf import open_dataset, write

KINDS: dict[str, dict[str, Any]] = {
    "maps": {},
    "a map": {"variable": "reversals", "at": {"n0": 0.05}},
    "a status": {"variable": "status"},
    "curves": {"x": "b", "at": {"mu": 60.0}},
}


def texts(figure: Figure) -> list[Text]:
    """All that is written, after the ticks are made."""
    figure.draw_without_rendering()
    return [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]


def letters(figure: Figure) -> str:
    return "".join(text.get_text() for text in texts(figure) if text.get_weight() == "bold")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("width", ["60mm", "18cm"])
def test_a_figure_for_print_is_as_wide_as_asked_and_can_be_read(kind: str, width: str) -> None:
    figure = picture.plot(made(n0=[0.02, 0.05]), **KINDS[kind], width=width)
    figure.draw_without_rendering()
    inches = {"60mm": 60, "18cm": 180}[width] / 25.4
    assert figure.get_figwidth() == pytest.approx(inches)
    assert min(text.get_fontsize() for text in texts(figure)) >= 6
    around = figure.get_tightbbox()
    assert around.x0 >= -0.01
    assert around.x1 <= inches + 0.01
    panels = [axes for axes in figure.axes if axes.get_label() == ""]
    assert letters(figure) == ("abcdefghijkl"[: len(panels)] if len(panels) > 1 else "")
    assert all(axes.get_window_extent().width > 0.3 * figure.bbox.width / 3 for axes in panels)


@pytest.mark.parametrize("starts", [1, 2, 3, 8])
@pytest.mark.parametrize("variable", [None, "difference"])
def test_a_figure_for_a_column_has_one_bar_and_is_smaller_than_a_page(starts: int, variable: str | None) -> None:
    figure = picture.plot(made(n0=np.linspace(0.02, 0.1, starts)), variable, x="b", y="mu", width="85mm")
    panels = [axes for axes in figure.axes if axes.get_label() == ""]
    assert len(panels) == starts
    assert len(figure.axes) == starts + 1
    assert len({axes.get_subplotspec().colspan.start for axes in panels}) == min(starts, 3)
    assert figure.get_figheight() * 25.4 < 130
    assert min(axes.bbox.width for axes in panels) > 14 / 25.4 * figure.dpi


@pytest.mark.parametrize("width", ["85mm", "180mm", None])
def test_a_fit_fills_its_figure(width: str | None) -> None:
    """An empty line for outliers had left hardly any room for the panels."""
    time = np.linspace(0, 12, 100)
    series = {name: ("time", np.cos(time)) for name in ("seen", "fitted")}
    names = ("value", *(f"{end}_{share}" for end in ("lower", "upper") for share in (68, 95)))
    values = {name: ("parameter", [0.3]) for name in names} | {"edge": ("parameter", [0])}
    attributes = {"sweep_kind": "fit", "title": "a fit", "verdict": "The curve fits the film.\n" * 3, "noise": 0.05,
                  "undetermined": ""}  # fmt: skip
    one = xr.Dataset(series | values, {"time": time, "parameter": ["mu"]}, attributes)
    figure = picture.plot(one, width=width)
    figure.draw_without_rendering()
    above, below = (axes.get_window_extent() for axes in figure.axes)
    assert above.y0 - below.y1 < 0.1 * figure.bbox.height
    assert above.height + below.height > 0.45 * figure.bbox.height
    assert above.width > 0.5 * figure.bbox.width


@pytest.mark.parametrize("width", [None, "85mm", "180mm"])
def test_a_figure_is_laid_out_once(width: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    layouts, lay_out = list[Figure](), layout_engine.do_constrained_layout
    monkeypatch.setattr(
        layout_engine, "do_constrained_layout", lambda figure, **how: layouts.append(figure) or lay_out(figure, **how)
    )
    figure = picture.plot(made(), width=width, output=tmp_path / "one.png")
    assert layouts == [figure]


def test_too_small_a_width_is_refused_with_one_that_suffices(tmp_path: Path) -> None:
    with mpl.rc_context({"font.size": 16}):
        with pytest.raises(InputError, match=r"^width: too narrow for this figure; give ") as refused:
            picture.plot(made(), width="50mm")
        given = str(refused.value).split("give ")[1].split(" ")[0]
        assert picture.plot(made(), width=given).get_figwidth() * 25.4 == pytest.approx(float(given.removesuffix("mm")))
    wordy = made().assign(spin_final=lambda one: one.spin_final.assign_attrs(long_name="spin at the end " * 99))
    with pytest.raises(InputError, match=r"^width: its words leave no room for the panels; give a larger width"):
        picture.plot(wordy, "spin_final", width="85mm", output=tmp_path / "wordy.png")
    assert not list(tmp_path.iterdir())


def test_fonts_can_be_edited(tmp_path: Path) -> None:
    picture.plot(made(), "reversals", output=tmp_path / "a.pdf")
    picture.plot(made(), "reversals", width="85mm").savefig(tmp_path / "b.pdf")
    for name in "ab":
        written = (tmp_path / f"{name}.pdf").read_bytes()
        assert b"/CIDFontType2" in written
        assert b"/Type3" not in written


@pytest.mark.parametrize("width", ["85", "3 kg", "-85mm", "5m"])
def test_a_width_is_a_length(width: str, small: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="give a length between 50 and 1000 mm with its unit"):
        picture.plot(small, width=width)
    write(tmp_path / "small.nc", small)
    refused(invoke("plot", tmp_path / "small.nc", "--width", width), "such as 85mm")


def test_the_command_draws_for_print_without_a_title(small: xr.Dataset, tmp_path: Path) -> None:
    write(tmp_path / "small.nc", small)
    target = tmp_path / "small.svg"
    result = invoke("plot", tmp_path / "small.nc", "--width", "3.5 in", "--title", "", "--output", target)
    assert result.exit_code == 0, result.output
    assert 'width="252pt"' in target.read_text(encoding="utf-8")
    title = str(open_dataset(tmp_path / "small.nc").attrs["title"])
    assert title in {text.get_text() for text in texts(picture.plot(small))}
    assert title not in {text.get_text() for text in texts(picture.plot(small, title=""))}


def test_settings_of_the_user_are_obeyed() -> None:
    with mpl.rc_context({"font.size": 12, "axes.titlesize": 17, "xtick.labelsize": 11, "figure.figsize": (7, 4)}):
        figure = picture.plot(made(), "reversals")
    (axes,) = [axes for axes in figure.axes if axes.get_label() == ""]
    figure.draw_without_rendering()
    assert axes.title.get_fontsize() == 17
    assert axes.xaxis.label.get_fontsize() == 12
    assert {tick.get_fontsize() for tick in axes.get_xticklabels()} == {11}
    assert figure.get_figwidth() == pytest.approx(7)
    assert mpl.rcParams["font.size"] == mpl.rcParamsDefault["font.size"]


@pytest.mark.parametrize(
    ("selection", "variable", "said"),
    [({}, None, "spin reversals, simulated"), ({}, "status", "how the trajectory ended"), ({"mu": 0}, None, "L(f)")],
)
def test_a_picture_in_given_axes(selection: dict[str, int], variable: str | None, said: str) -> None:
    figure = Figure()
    left, right = figure.subplots(1, 2)
    one = made().assign(form_factor=made().b / 10).isel(selection)
    assert picture.plot(one, variable, ax=right) is figure
    assert right.get_xlabel() == "short semi-axis b"
    assert right.get_ylabel()
    assert right.findobj(lambda artist: artist.get_gid() == (variable or "reversals"))
    assert right.has_data()
    assert not left.has_data()
    (beside,) = figure.axes[2:]
    assert beside.get_ylabel().strip() == said


def test_given_axes_take_one_panel_of_one_run(small: xr.Dataset) -> None:
    axes = Figure().subplots()
    with pytest.raises(ValueError, match="needs more than one panel; select"):
        picture.plot(small, ax=axes)
    with pytest.raises(ValueError, match="only a map or a curve of a run"):
        picture.plot(small.assign_attrs(sweep_kind="critical"), ax=axes)
    assert not axes.has_data()


def test_a_variable_is_drawn_without_its_dataset() -> None:
    assert any("time limit" in text for text in entries(picture.plot(made(), "reversals")))
    figure = picture.plot(made().reversals)
    assert len([axes for axes in figure.axes if axes.get_label() == ""]) == 1
    assert not [text for text in entries(figure) if "time limit" in text]
    with pytest.raises(ValueError, match="an array without a name is not a variable of a run; pass the dataset"):
        picture.plot(made().reversals - made().reversals_predicted)

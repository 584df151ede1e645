"""Pictures of datasets that have lost something or have one value or none, and sizes and limits at the edge."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from time import perf_counter
from typing import Any
from unittest.mock import Mock

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.text import Text
from support.figures import entries, made

import sweep
from sweep.config import InputError
from sweep.faults import FileError
from sweep.kernels.status import SETTLED, TOPPLED
from sweep.plots import picture, scales
from sweep.plots.attempt import attempt
from sweep.results.dataset import REASONS, VARIABLES, described
from sweep.results.kind import SPINS
from sweep.results.probabilities import PROBABILITIES, probabilities

FORMULAS: dict[str, Any] = {"name": "formulas", "friction": {"mu": 60}}


def sampled(n0: tuple[float, ...] = (0.02, 0.05), status: int = SETTLED) -> xr.Dataset:
    """A run of eight samples along each of these starts, of which every other one reverses."""
    shape = (len(n0), 8)
    counts = np.broadcast_to(np.arange(8) % 2, shape).astype("int16")
    run = xr.Dataset(
        {"reversals": (("n0", "sample"), counts), "status": (("n0", "sample"), np.full(shape, status, "int8"))},
        {"n0": list(n0), "sample": np.arange(8)},
    )
    found = probabilities(run)
    number = found["probability"].shape[-1]
    shares = {n: (("n0", "count"), v, described(PROBABILITIES[n])) for n, v in found.items()}
    return run.assign(shares).assign_coords(count=np.arange(1, number + 1))


def critical(spins: dict[str, list[float]], reason: list[int], dim: str = "case", **coords: Any) -> xr.Dataset:
    """A dataset of critical spins, with these values for positive spins along one axis, and the others unknown."""
    found = dict.fromkeys(SPINS.values(), [np.nan] * len(reason)) | spins | {"n_c_reason": reason}
    variables = {
        n: ((dim, "sign"), np.array(v, VARIABLES[n].dtype)[:, None], described(VARIABLES[n])) for n, v in found.items()
    }
    return xr.Dataset(variables, {"sign": [1], **coords}, {"sweep_kind": "critical"})


def words(figure: Figure) -> list[str]:
    """What is written in the panels."""
    return [text.get_text() for axes in figure.axes for text in axes.texts]


@pytest.mark.parametrize("top", [1e7, 1e9, 1e15])
def test_limits_of_counts_of_any_size_take_no_time(top: float) -> None:
    start = perf_counter()
    for make in (scales.counts, scales.differences):
        scale = make(np.arange(7), (0, top))
        assert isinstance(scale.norm, BoundaryNorm)
        assert scale.norm.Ncmap <= 24
        assert scale.norm.boundaries[-1] > top
    assert perf_counter() - start < 5
    for variable in ("reversals", "spin_final"):
        with pytest.raises(InputError, match=r"^vmax: 1e\+16; give a number from -1e\+15 to 1e\+15$"):
            picture.plot(made(), variable, vmax=1e16)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda d: d.isel(mu=slice(0)), "the axis mu has no values; select at least one"),
        (lambda d: d.assign_coords(mu=d["mu"].astype(str)), "mu are not finite numbers; xarray draws names: dataset"),
        (lambda d: d.assign_coords(mu=[f"{v:g}" for v in d.mu.values]), "the values of the axis mu are not finite"),
        (lambda d: d[["n_c1"]], "name the variable to draw; choose n_c1"),
        (lambda d: d.assign(reversals=d["reversals"].astype(str)), "variable: the values of reversals are not numbers"),
        (lambda d: d[["n_c1"]].drop_vars("n_c1").assign_attrs(sweep_kind="run"), "has no variable to draw"),
    ],
)
def test_what_cannot_be_drawn_is_refused(damage: Callable[[xr.Dataset], xr.Dataset], said: str) -> None:
    with pytest.raises(InputError, match=said):
        picture.plot(damage(made()))


def test_an_axis_without_numbers_has_no_nearest_value() -> None:
    stacked = made().stack(both=("mu", "b"))
    with pytest.raises(InputError, match="the axis both is stacked; unstack it"):
        picture.plot(stacked, at={"both": 1.0})


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (xr.Dataset(attrs={"sweep_kind": "boundaries"}), r"lacks the variable level and \d+ other things; it was cut"),
        (xr.Dataset({"mu": []}, attrs={"sweep_kind": "critical"}), "the axis mu has no values; select at least one"),
        (xr.Dataset(attrs={"sweep_kind": "critical"}), "lacks the variable n_c_reason and 3 other things"),
        (xr.Dataset({"seen": 1.0}, attrs={"sweep_kind": "fit"}), r"lacks the variable value and \d+ other things"),
    ],
)
def test_datasets_of_other_kinds_that_are_not_whole_are_refused(found: xr.Dataset, said: str) -> None:
    with pytest.raises(FileError, match=f"^the dataset: {said}"):
        picture.plot(found)


def test_boundaries_without_a_whole_number_are_not_drawn() -> None:
    curves = sweep.boundaries({"friction": {"mu": [60, 80]}}, n0=[0.02, 0.06], t_end=1000, bracket=0.1)
    with pytest.raises(FileError, match=r"^the dataset: has no whole numbers in level"):
        picture.plot(curves.where(False))


def test_samples_without_a_status_or_counts() -> None:
    """A mean of the status is none, so that nobody knows the number of samples, and a mean over counts has no sense."""
    with pytest.raises(InputError, match="probability has lost its axis count"):
        picture.plot(sampled().mean())
    for part in (sampled().mean("n0"), sampled().isel(n0=0).drop_vars("status")):
        assert entries(picture.plot(part)) == ["share of the samples"]
    with pytest.raises(InputError, match="reversals has no axis count; its axes are n0, sample"):
        picture.plot(sampled(), "reversals", y="count")


def test_probabilities_without_an_end_of_their_interval_have_no_band() -> None:
    whole, part = (
        picture.plot(each, "probability").axes[0] for each in (sampled(), sampled().drop_vars("probability_low"))
    )
    assert (whole.get_ylabel(), part.get_ylabel()) == ("probability, with its interval of 95 %", "probability")
    assert len(whole.collections) > len(part.collections) == 0
    assert len(whole.lines) == len(part.lines)


def test_samples_at_one_value_are_bars_under_its_name() -> None:
    (axes,) = picture.plot(sampled((0.05,))).axes
    bars: Any = axes.patches
    assert axes.get_title() == "n₀ = 0.05"
    assert [patch.get_height() for patch in bars] == [0.5, 0.5]


def test_a_point_between_failures_is_seen() -> None:
    dataset = sampled((0.02, 0.03, 0.04))
    dataset["probability"][[0, 2]] = np.nan
    (axes,) = picture.plot(dataset).axes
    assert axes.lines[0].get_marker() == "."


@pytest.mark.parametrize("starts", [(0.05,), (0.02, 0.05)])
def test_a_figure_of_failures_says_so(starts: tuple[float, ...]) -> None:
    figure = picture.plot(sampled(starts, TOPPLED))
    assert words(figure) == ["all samples failed"]
    assert not figure.legends


def test_critical_spins_of_rows_of_a_table_that_share_a_body() -> None:
    found = sweep.predict({**FORMULAS, "cases": {"x0": [0.01, 0.02], "n0": [0.02, 0.03]}})
    spins = {name: found[name].sel(sign=1).values.tolist() for name in ("n_c1", "n_c1_linear")}
    coords: Any = {name: found[name] for name in ("a", "b", "c", "delta", "mu")}
    rows = critical(spins, [0, 0], **coords).assign_attrs(config=found.attrs["config"])
    (axes,) = picture.plot(rows).axes
    drawn = {line.get_gid(): np.asarray(line.get_ydata(), float) for line in axes.lines if line.get_gid()}
    assert {name: values.tolist() for name, values in drawn.items() if np.isfinite(values).any()} == spins


def test_critical_spins_that_do_not_exist() -> None:
    no_coupling = {name: code for code, name in REASONS.items()}["no_coupling"]
    figure = picture.plot(critical({"n_c1": [np.nan, np.inf]}, [no_coupling] * 2))
    assert words(figure) == ["no critical spin: no coupling (2)"]
    assert not entries(figure)
    some = picture.plot(critical({"n_c1": [0.1, 0.2], "n_c2_simulated": [np.nan] * 2}, [no_coupling] * 2))
    assert len(entries(some)) == 2
    assert not [text for text in entries(some) if "simulation" in text or "c2" in text]


def test_a_figure_names_the_panels_that_it_leaves_out() -> None:
    bodies = critical({"n_c1": [0.1] * 10}, [0] * 10).expand_dims(mu=np.arange(50.0, 62.0)).transpose("case", "mu", ...)
    figure = picture.plot(bodies.isel(case=slice(9)))
    assert len(figure.axes) == 8
    assert entries(figure)[-1] == "the first 8 of 9 panels"


def test_the_critical_spins_of_one_body_are_seen() -> None:
    one = critical({"n_c1": [0.1]}, [0]).isel(case=0)
    (axes,) = picture.plot(one).axes
    (line,) = [line for line in axes.lines if line.get_gid() == "n_c1"]
    assert np.ptp(line.get_xdata()) > 0


def test_dollar_signs_in_the_texts_of_a_dataset_are_written_as_they_are(tmp_path: Path) -> None:
    r"""Matplotlib sets what stands between two as mathematics, and cannot set "\frac{"."""
    text = r"$5 \frac{ $"
    dataset = made().assign_attrs(title=text)
    for name in ("reversals", "b", "delta"):
        dataset[name].attrs.update(long_name=text, units=text)
    for shown in (dataset, dataset.isel(b=0), dataset.isel(b=0, mu=0)):
        figure = picture.plot(shown, "reversals", output=tmp_path / "dollars.png")
        read = [_seen(each) for each in figure.findobj(Text) if "frac" in each.get_text()]
        assert len(read) >= 2
        assert all(text in each for each in read)
    assert dataset.title == text


def _seen(written: Text) -> str:
    """What matplotlib draws of a text, which it sets as mathematics or not."""
    said, is_maths = written._preprocess_math(written.get_text())
    assert not is_maths
    return " ".join(said.split())


def test_what_matplotlib_cannot_draw_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))  # without LaTeX
    with mpl.rc_context({"text.usetex": True}), pytest.raises(InputError) as refused:
        picture.plot(made(), output=tmp_path / "tex.png")
    assert str(refused.value).startswith("matplotlib cannot draw this figure: RuntimeError: Failed to process string")
    assert str(refused.value).endswith("; check its settings, such as text.usetex")
    assert "\n" not in str(refused.value)
    assert not list(tmp_path.iterdir())


def test_an_error_of_our_own_in_a_drawing_is_not_hidden(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notes = list[str]()
    for error, shown in ((InputError([]), False), (TypeError("a mistake"), True)):
        monkeypatch.setattr(picture, "plot", Mock(side_effect=error))
        with pytest.raises(TypeError, match="a mistake") if shown else nullcontext():
            attempt(made(), tmp_path / "made.png", notes.append)
    assert len(notes) == 1

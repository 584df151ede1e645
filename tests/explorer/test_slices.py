"""Slices of a dataset: the same numbers as xarray's own selection, whatever the axes, and what is shown of a cell."""

from collections.abc import Callable
from dataclasses import fields, replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import sweep
from sweep.explorer import slices, state
from sweep.explorer.slices import PlacedAxis, Source, open_source
from sweep.faults import FileError
from sweep.kernels.status import LIFT_OFF, TIME_LIMIT


@pytest.mark.parametrize(("x", "y"), list(permutations(("mu", "b", "n0"), 2)))
@pytest.mark.parametrize("name", ["reversals", "difference", "spin_final", "n_c1", "status"])
def test_a_slice_is_the_selection(name: str, x: str, y: str, source: Source, opened: xr.Dataset) -> None:
    (rest,) = {"mu", "b", "n0"} - {x, y}
    whole = opened["reversals"] - opened["reversals_predicted"] if name == "difference" else opened[name]
    expected = whole.broadcast_like(opened["status"]).isel({rest: 1})
    expected = expected.sel(sign=1) if "sign" in expected.dims else expected
    part = source.map(name, x, y, {rest: 1, "sign": 1})
    np.testing.assert_array_equal(part.values, expected.transpose(y, x))


def test_descending_axes_are_turned(opened: xr.Dataset) -> None:
    turned = Source(opened.isel(mu=slice(None, None, -1)))
    straight = Source(opened)
    for each in (turned, straight):
        assert (np.diff(each.axes["mu"].values) > 0).all()
    index = {"mu": 1, "b": 2, "n0": 0}
    assert turned.values_at(index) == straight.values_at(index)


SPACINGS = {
    "linear": ([1, 2, 3], [0.5, 1.5, 2.5, 3.5]),
    "log": ([1, 100, 10000], [0.1, 10, 1000, 100000]),
    "uneven": ([1, 2, 10], [-0.5, 0.5, 1.5, 2.5]),
}


@pytest.mark.parametrize(("spacing", "values", "edges"), [(k, *v) for k, v in SPACINGS.items()], ids=SPACINGS)
def test_cells_end_half_way_between_values(spacing: str, values: list[float], edges: list[float]) -> None:
    axis = PlacedAxis("mu", np.array(values, float))
    assert axis.spacing == spacing
    np.testing.assert_allclose(axis.drawn_edges, edges)
    np.testing.assert_allclose(axis.place(axis.edges[[0, -1]]), axis.drawn_edges[[0, -1]])
    np.testing.assert_array_equal(axis.place(values), [0, 1, 2] if spacing == "uneven" else values)


def test_a_cell_is_described_in_words(source: Source, opened: xr.Dataset) -> None:
    shown = [source.values_at({"mu": k, "b": 0, "n0": 1}) for k in range(4)]
    ends = [each["how the trajectory ended"] for each in shown]
    assert ends == ["lifted off the table", "settled", "ended at the time limit", "settled"]
    assert "note" not in shown[1]
    assert "lower bound" in shown[2]["note"]
    assert "round-off" in shown[3]["note"]
    cell = opened.isel(mu=1, b=0, n0=1)
    assert shown[1]["spin reversals, simulated"] == str(int(cell["reversals"]))
    assert shown[1]["time of the end"] == f"{float(cell['t_stop']):.6g} √(c/g)"
    assert source.meanings["time of the end"] == opened["t_stop"].attrs["description"] != ""
    assert len(shown[1]) == len([n for n, v in opened.data_vars.items() if v.dims]) + 1


def test_a_large_dataset_is_read_slice_by_slice(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slices, "IN_MEMORY", 10)
    source = open_source(tiny)
    assert not source.dataset["reversals"].variable._in_memory
    part = source.map("reversals", "mu", "b", {"n0": 1})
    np.testing.assert_array_equal(part.values, open_source(tiny).map("reversals", "mu", "b", {"n0": 1}).values)
    assert not source.dataset["reversals"].variable._in_memory


def test_one_axis_is_a_row(opened: xr.Dataset) -> None:
    source = Source(opened.isel(b=0, n0=0))
    part = source.map("reversals", "mu", "", {})
    np.testing.assert_array_equal(part.values, opened["reversals"].isel(b=0, n0=0).values[None])


@pytest.mark.browser
@pytest.mark.parametrize(
    ("show", "change", "said"),
    [
        (Source, lambda _: xr.Dataset({"status": 0}), "open a dataset of run"),
        (
            Source,
            lambda _: xr.Dataset({"status": ("mu", [0, 0])}, attrs={"sweep_kind": "fit"}),
            "open a dataset of run",
        ),
        (Source, lambda whole: whole.rename(mu="show"), "the axis show has the name"),
        (sweep.explore, lambda whole: whole.isel(mu=slice(0, 0)), "the axis mu has no values"),
        (sweep.explore, lambda whole: whole.stack(both=("mu", "b")), "the axis both is stacked; unstack it"),
    ],
)
def test_what_has_no_map_is_refused(
    show: Callable[[xr.Dataset], object], change: Callable[[xr.Dataset], xr.Dataset], said: str, opened: xr.Dataset
) -> None:
    with pytest.raises(FileError, match=said):
        show(change(opened))


def test_no_axis_has_the_name_of_a_key_of_the_address() -> None:
    assert {field.name for field in fields(state.State)} - {"cells", "at", "limits", "changed"} < slices.ADDRESS


@pytest.mark.browser
def test_a_map_without_any_result_has_a_scale(opened: xr.Dataset) -> None:
    from sweep.explorer import style

    source = Source(opened.assign(status=xr.full_like(opened["status"], LIFT_OFF)))
    part = source.map("reversals", "mu", "b", {"n0": 1})
    assert not part.shown.size
    assert style.beyond(part, style.scale_of(part, state.first(source), source.extremes(part.name))) == ""


@pytest.mark.browser
@pytest.mark.parametrize("low", [0.0, -1.0])
def test_a_ratio_keeps_its_scale_where_a_limit_is_not_positive(opened: xr.Dataset, low: float) -> None:
    from sweep.explorer import style

    times = opened["b"].expand_dims(reversal=[1])
    source = Source(opened.assign(reversal_times=times, t_first_reversal_predicted=2 * opened["mu"]))
    part, first = source.map("ratio", "mu", "b", {"n0": 1}), state.first(source)
    scales = [
        style.scale_of(part, each, source.extremes("ratio")) for each in (first, replace(first, limits={"low": low}))
    ]
    assert style.mapping(scales[0]) == style.mapping(scales[1])


def test_the_ends_of_a_scale_are_those_of_all_maps_and_of_all_counts(source: Source, opened: xr.Dataset) -> None:
    """Without cells that failed, whose counts mean nothing."""
    counts = opened["reversals"].where(opened["status"] != LIFT_OFF)
    low = min(counts.min(), opened["reversals_predicted"].min())
    high = max(counts.max(), opened["reversals_predicted"].max())
    for name in ("reversals", "reversals_predicted"):
        ends = source.extremes(name)
        assert (ends.min(), ends.max()) == (low, high)
    spins = opened["spin_final"].where(opened["status"] != LIFT_OFF)
    assert source.extremes("spin_final").tolist() == [spins.min(), spins.max()]


def test_a_cell_of_a_model_that_never_settles_has_no_lower_bound(opened: xr.Dataset) -> None:
    endless = Source(opened.assign(status=xr.full_like(opened["status"], TIME_LIMIT)))
    note = endless.values_at({"mu": 2, "b": 0, "n0": 1})["note"]
    assert "followed up to the time limit" in note
    assert "lower bound" not in note

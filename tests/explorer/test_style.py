"""How the explorer draws, and what it refuses.  It imports Bokeh, which the extra `browser` brings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
import xarray as xr

import sweep
from sweep.explorer import state
from sweep.explorer.slices import Source
from sweep.kernels.status import LIFT_OFF
from sweep.results.store import StoreError

pytestmark = pytest.mark.browser


def test_a_map_without_any_result_has_a_scale(opened: xr.Dataset) -> None:
    from sweep.explorer import style

    source = Source(opened.assign(status=xr.full_like(opened["status"], LIFT_OFF)))
    part = source.map("reversals", "mu", "b", {"n0": 1})
    assert not part.shown.size
    assert style.beyond(part, style.scale_of(part, state.first(source))) == ""


@pytest.mark.parametrize("low", [0.0, -1.0])
def test_a_ratio_keeps_its_scale_where_a_limit_is_not_positive(opened: xr.Dataset, low: float) -> None:
    from sweep.explorer import style

    source = Source(opened.assign(t_first_reversal=opened["b"], t_first_reversal_predicted=2 * opened["mu"]))
    part, first = source.map("ratio", "mu", "b", {"n0": 1}), state.first(source)
    scales = [style.scale_of(part, each) for each in (first, replace(first, limits={"low": low}))]
    assert style.mapping(scales[0]) == style.mapping(scales[1])


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda whole: whole.isel(mu=slice(0, 0)), "the axis mu has no values"),
        (lambda whole: whole.stack(both=("mu", "b")), "the axis both is stacked; unstack it"),
    ],
)
def test_a_dataset_that_is_not_whole_is_refused(
    opened: xr.Dataset, damage: Callable[[xr.Dataset], xr.Dataset], said: str
) -> None:
    with pytest.raises(StoreError, match=said):
        sweep.explore(damage(opened))


@pytest.mark.parametrize("values", [1, 2])
def test_an_axis_of_one_value_has_no_slider(opened: xr.Dataset, values: int, caplog: pytest.LogCaptureFixture) -> None:
    from bokeh.document import Document
    from bokeh.models import Slider

    from sweep.explorer.view import View

    document, source = Document(), Source(opened.isel(n0=slice(values)))
    View(document, source, None, None, {"n0": ["0.02"]})
    document.validate()
    names = {model.name for model in document.select({"type": Slider})}
    assert {"mu", "b", "n0"} - names == ({"n0"} if values == 1 else set())
    assert not caplog.records

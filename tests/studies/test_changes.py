"""Which change of a body gives one reversal more: foreseen, and confirmed by the full model."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.cli import invoke

import sweep

BODY: dict[str, Any] = {"body": {"a": 10, "b": 3, "delta": 0.03}, "friction": {"mu": 60}, "start": {"n0": 0.05}}


@pytest.mark.parametrize("reversals", [1, -1])
def test_the_full_model_counts_so_on_both_sides(reversals: int) -> None:
    """By the other method, in shorter steps than it needs."""
    found = sweep.changes(BODY, reversals=reversals)
    now = found.attrs["reversals"]
    confirmed = found.where(found.change.notnull(), drop=True)
    assert {"a", "delta", "mu", "n0"} <= set(confirmed.parameter.values)
    for name in ("delta", "mu"):
        one = confirmed.sel(parameter=name)
        assert abs(one.changed_at / one.unchanged_at - 1) < 1.1e-3
        assert one.change == pytest.approx(float(one.changed_at / one.value - 1))
        values = [float(one.unchanged_at), float(one.changed_at)]
        again = sweep.run(BODY, method="dopri5", tolerance=1e-9, **{name: sorted(values)})
        np.testing.assert_array_equal(again.reversals.sel({name: values}), [now, now + reversals])
        assert one.reversals == now + reversals


def test_the_dataset_of_changes_is_described_and_not_drawn(tmp_path: Path) -> None:
    found = sweep.changes(BODY)
    found.to_netcdf(tmp_path / "changes.nc")
    said = invoke("info", tmp_path / "changes.nc").stdout
    assert "3 reversals now; the requested count begins at these values of each parameter:" in said
    assert re.search(r"mu +60 +\S+ +\([-+][\d.]+%\): 4 reversals", said)
    assert re.search(r"b +3 +none found", said)
    with pytest.raises(sweep.InputError, match="changes of a body have no figure"):
        sweep.plot(found)


def test_the_nearest_change_is_found_and_none_is_made_up() -> None:
    """A dense scan by the full model knows no nearer one, and none by b."""
    found = sweep.changes(BODY)
    scan = sweep.run(BODY, mu=np.geomspace(30, 120, 61).tolist())
    more = scan.mu.values[(scan.reversals > 3).values]
    nearest = more[np.abs(np.log(more / 60)).argmin()]
    assert found.changed_at.sel(parameter="mu") == pytest.approx(nearest, rel=0.03)
    by_b = found.sel(parameter="b")
    assert np.isnan(by_b.change)
    assert by_b.reversals == 3
    assert (sweep.run(BODY, b=np.geomspace(1.5, 6, 61).tolist()).reversals <= 3).all()


def test_no_change_is_reported_beyond_an_undecided_count() -> None:
    """Before this time some counts are not decided, and δ = 0.0436 would be called unchanged: it is not."""
    early, late = (sweep.changes(BODY, t_end=end).sel(parameter="delta") for end in (2500.0, 5000.0))
    assert late.changed_at < 0.0433
    assert np.isnan(early.changed_at)
    assert early.reversals == 3


def test_no_start_off_the_body_is_tried() -> None:
    """At twice its distance, or on a body half as long, it would lie there, and NumPy would warn of a root."""
    found = sweep.changes(BODY, x0=6.0, reversals=-1)
    assert not (found.changed_at.sel(parameter="x0") > 10).any()


def test_a_body_in_si_changes_alike() -> None:
    length, gravity = 0.02, 9.80665
    rate = np.sqrt(gravity / length)
    si = {
        "units": "SI", "body": {"a": 10 * length, "b": 3 * length, "c": length, "delta": 0.03, "mass": 0.1},
        "friction": {"mu": 60 / np.sqrt(length * gravity)},
        "start": {"n0": 0.05 * rate, "x0": 0.01 * length, "y0": 0.01 * length},
    }  # fmt: skip
    names = ["a", "delta", "mu", "n0"]
    ours, theirs = (sweep.changes(each).change.sel(parameter=names) for each in (BODY, si))
    np.testing.assert_allclose(ours, theirs, atol=2e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"mu": [60, 70]}, "mu: has several values"),
        ({"friction": {"law": "coulomb", "mu": 0.2, "speed": 0.01}}, "has no foreseen counts"),
        ({"model": "slow"}, "has no foreseen counts; choose the model slip"),
        *(({"reversals": wrong}, "reversals: must be a whole number") for wrong in (0, 1.5, np.nan, True, "1", None)),
        ({"n0": {"normal": [0.05, 0.01]}}, "is a distribution"),
        ({"t_end": 100.0}, "not decided"),
    ],
)
def test_what_is_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(sweep.InputError, match=words):
        sweep.changes(BODY, **change)

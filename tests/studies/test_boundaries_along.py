"""Boundaries along a single axis: every change of the count, and how certain it is."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support import Write
from support.cli import invoke
from support.figures import entries

import sweep
from sweep.kernels.status import SETTLED
from sweep.plots import picture
from sweep.results.margins import FOUND, WIDE
from sweep.results.store import Store
from sweep.studies.boundaries import Along
from sweep.studies.study import measuring

BODY: dict[str, Any] = {"body": {"a": 10, "b": 3, "delta": 0.03}, "start": {"n0": 0.05}}

# One reversal fewer at 0.982 of this mu. Many counts around the change are not certain.
UNCERTAIN: dict[str, Any] = {
    "a": 9.35956593441, "b": 1.70014366243, "delta": 0.138034416309, "n0": -0.0265188373337,
    "x0": 0.0921688602877, "y0": 0.000307518213228, "mu": 188.623926159,
}  # fmt: skip


@pytest.fixture(scope="module")
def config(kept: Write) -> Path:
    return kept("body: {a: 10, b: 3, delta: 0.03}\nfriction: {mu: [30, 60, 120]}\nstart: {n0: 0.05}\n", "line.yaml")


@pytest.fixture(scope="module")
def found(config: Path) -> xr.Dataset:
    """By the command, whose files lie beside the configuration."""
    said = invoke("boundaries", config, "--output", config.parent)
    assert said.exit_code == 0, said.output
    return sweep.open_dataset(config.with_name("line_boundaries.nc"))


def counted(base: dict[str, Any], name: str, values: np.ndarray) -> np.ndarray:
    """The counts at some values of a parameter, by the other method, in shorter steps than it needs."""
    cases = {"cases": {name: values.tolist()}}
    return np.asarray(sweep.run(base | cases, method="dopri5", tolerance=1e-9).reversals.values)


def test_another_method_counts_the_same_at_both_ends(found: xr.Dataset) -> None:
    assert (found.outcome == FOUND).all()
    assert float((np.abs(found.end_more - found.end_fewer) / found.mu).max()) < 1.1e-6
    for end in ("fewer", "more"):
        np.testing.assert_array_equal(counted(BODY, "mu", found[f"end_{end}"].values), found[f"reversals_{end}"])


def test_a_dense_scan_finds_no_other_change(found: xr.Dataset) -> None:
    """Between three values of the axis: the slow equations say where to simulate."""
    scan = sweep.run(BODY, mu=np.geomspace(30, 120, 61).tolist())
    mu, counts = scan.mu.values, scan.reversals.values
    changes = np.flatnonzero(np.diff(counts))
    assert len(changes) == found.sizes["point"]
    for i, at, fewer, more in zip(changes, found.mu, found.reversals_fewer, found.reversals_more, strict=True):
        assert mu[i] < at < mu[i + 1]
        assert sorted(counts[i : i + 2]) == [fewer, more]


def test_a_bracket_is_wide_where_no_count_in_it_is_certain() -> None:
    mu = UNCERTAIN["mu"]
    one = sweep.boundaries({}, **UNCERTAIN | {"mu": [0.97 * mu, 1.0006 * mu, 1.01 * mu]}).squeeze()
    assert (int(one.reversals_fewer), int(one.reversals_more), int(one.outcome)) == (9, 10, WIDE)
    assert 0.98 * mu < float(one.end_fewer) < 0.9935 * mu
    assert 0.9926 * mu < float(one.end_more) < mu
    assert float(one.end_more - one.end_fewer) > 1e-5 * mu


def along(known: Any, **axis: list[float]) -> Along:
    """A search whose simulations a formula of mu replaces: the distance from the boundary, and which are certain."""

    class Formula(Store):
        def load(self, tile: int) -> dict[str, np.ndarray]:
            mu = search.rounds[tile]["mu"]
            distance, certain = known(mu)
            more, fewer = np.where(distance > 0, 9.0, -distance), np.where(distance > 0, distance, np.nan)
            cells = {"status": np.full(len(mu), SETTLED), "reversals": (distance > 0) * 1.0, "certain": certain * 1}
            return cells | {"margin_more": more, "margin_fewer": fewer, "seconds": np.array(0.0), "cpu": np.array("x")}

    search = Along(measuring(sweep.load_config(BODY, axis)), Formula(), ("mu",), 1e-6, 0.01)
    while search.grow():
        pass
    return search


@pytest.mark.parametrize("step", [False, True])
def test_uncertain_cells_are_approached_from_both_sides(step: bool) -> None:
    def known(mu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.sign(mu - 70.3) if step else mu - 70.3, np.abs(mu - 70) > 1

    one = along(known, mu=[60.0, 80.0]).dataset().squeeze()
    assert int(one.outcome) == WIDE
    assert 68 < float(one.end_fewer) < 69
    assert 71 < float(one.end_more) < 72


def test_a_single_uncertain_cell_does_not_hide_a_change() -> None:
    """The cell is the first that is tried; the boundary is elsewhere."""

    def known(mu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        seen.extend(mu.tolist())
        return np.sign(mu - 73), ~np.isin(mu, seen[2:3])

    seen: list[float] = []
    search = along(known, mu=[60.0, 80.0])
    one = search.dataset().squeeze()
    assert 60 < seen[2] < 73
    assert int(one.outcome) == FOUND
    assert float(one.end_fewer) < 73 < float(one.end_more) < float(one.end_fewer) + 1e-4


def test_the_command_resumes_describes_and_draws(config: Path, found: xr.Dataset) -> None:
    assert invoke("boundaries", config, "--output", config.parent).stderr.count("already complete") == 1
    assert "\n4 points, by " in invoke("info", config.with_name("line_boundaries.nc")).stdout
    (axes,) = picture.plot(found).axes
    (line,) = (line for line in axes.lines if line.get_gid() == "count")
    assert sorted({*line.get_ydata()}) == [1, 2, 3, 4, 5]
    assert line.get_xdata()[[0, -1]].tolist() == [30, 120]
    wide = found.assign(outcome=found.outcome * 0 + WIDE)
    assert "wide bracket: a cell failed or is not certain (4 of 4)" in entries(picture.plot(wide))

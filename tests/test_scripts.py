"""`same_numbers` finds whatever is planted, to the last bit, and scripts make rows of the reference tables again."""

import csv
import runpy
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support import ROOT

VERIFIED = ("verified_counts_changed", "verified_step")
WORDS = ("spin_final:description", "spin_final:long_name", "spin_final:units")
SAME = runpy.run_path(str(ROOT / "scripts" / "same_numbers.py"))


def dataset() -> xr.Dataset:
    variables = {
        "spin_final": ("mu", [0.1, np.nan, -0.0], {"long_name": "spin at t_stop", "units": "1"}),
        "status": ("mu", np.array([1, 2, 1], np.int8), {"flag_meanings": "settled time_limit"}),
        "verified_step": ("mu", [1.0, 2.0, 3.0]),
    }
    attributes = {"config": "verify: 0.01", "created": "today", "verified_counts_changed": 1}
    return xr.Dataset(variables, {"mu": [60.0, 70.0, 80.0]}, attributes)


def other_words(found: xr.Dataset) -> xr.Dataset:
    found["spin_final"].attrs |= {"units": "m", "long_name": "spin", "description": "spin at the end"}
    return found.assign_attrs(config="", created="tomorrow", sweep_kind="grid")


def with_spins(*values: float) -> Callable[[xr.Dataset], xr.Dataset]:
    return lambda found: found.assign(spin_final=found.spin_final.copy(data=np.array(values)))


@pytest.mark.parametrize(
    ("change", "wrong", "aside"),
    [
        (lambda d: d, [], []),
        (with_spins(np.nextafter(0.1, 1), np.nan, -0.0), ["spin_final (1 of 3 values)"], []),
        (with_spins(0.1, np.nan, 0.0), ["spin_final (1 of 3 values)"], []),
        (lambda d: d.assign(status=d.status.astype("int16")), ["status (type or shape)"], []),
        (lambda d: d.assign(status=d.status.assign_attrs(flag_meanings="settled")), ["status:flag_meanings"], []),
        (lambda d: d.drop_vars("status"), ["status"], []),
        (other_words, [], ["config", "sweep_kind", *WORDS]),
        (lambda d: d.drop_vars("verified_step").drop_attrs(deep=False), [], ["config", *VERIFIED]),
    ],
)  # fmt: skip
def test_what_differs_is_named(
    change: Callable[[xr.Dataset], xr.Dataset], wrong: list[str], aside: list[str], tmp_path: Path
) -> None:
    one, other = tmp_path / "one.nc", tmp_path / "other.nc"
    dataset().to_netcdf(one)
    change(dataset()).to_netcdf(other)
    found = list(SAME["differences"](one, other))
    assert [each for each in found if not SAME["meant"](each)] == wrong
    assert [each for each in found if SAME["meant"](each)] == aside


@pytest.mark.campaign
def test_scripts_make_rows_of_the_reference_tables_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """They use the package's equations, and so a change of these may break them."""
    pytest.importorskip("heyoka")
    monkeypatch.syspath_prepend(ROOT / "scripts")
    names = ("benchmark_references", "reference_counts_500", "reference_wide", "reference_spins")
    benchmark, counts, wide, spins = map(import_module, names)
    case, (first, *_), _ = benchmark.all_cases()["kane_levinson_left"]
    found = benchmark.compute("kane_levinson_left", case, np.array([first]), benchmark.Taylor("roll")).spins
    row = next(row for row in rows("benchmark/references.csv") if row["case"] == "kane_levinson_left")
    assert found == pytest.approx([float(row["spin"])], abs=1e-12)
    run = counts.follow(counts.draw()[4], counts.make_integrator(float, counts.TOLERANCE), float)
    row = rows("reference_counts_500.csv")[4]
    assert [run.reversals(), run.last_reversal()] == pytest.approx([1, float(row["t_last_reversal"])], abs=1e-3)
    (spin, *_), _, end, t_end = wide.own_run(wide.draw(wide.SEED)[0], wide.own_integrator(wide.TOLERANCE))
    row = rows("reference_wide.csv")[0]
    assert (end, t_end, spin) == (row["end"], float(row["t_end"]), pytest.approx(float(row["spin_50"]), abs=1e-12))
    model, row = spins.MODELS["slip"], rows("../sweep/bench/data/reference_spins.csv")[0]
    found = spins.taylor_spins(model, spins.SLIP[0], spins.Quadruple, spins.QUADRUPLE_TOLERANCES[0])[0]
    assert f"{spins.as_decimals([found])[0]:.18g}" == row["spin"]


@pytest.mark.campaign
def test_certain_counts_of_wide_cells_are_followed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("heyoka")
    monkeypatch.syspath_prepend(ROOT / "scripts")
    import_module("wide_counts").main(4, 3, 5.0)
    assert "{'followed': 2, 'false': 0, 'not followed': 2}" in capsys.readouterr().out


def rows(table: str) -> list[dict[str, str]]:
    with (ROOT / "data" / table).open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))

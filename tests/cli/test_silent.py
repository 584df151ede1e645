"""No option is accepted and does nothing: it is refused, or the command says what it did instead."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support.cli import invoke

import sweep
from sweep.config import InputError
from sweep.kernels.status import Doubt

GRID = {"name": "quick", "friction": {"mu": [40.0, 60.0, 80.0, 100.0, 120.0]}, "start": {"n0": [0.02, 0.05]}}
TEXT = "name: quick\nmodel: averaged\nfriction: {mu: [40, 60]}\nstart: {n0: [0.02, 0.05]}\nintegrator: {t_end: 40}\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The file of a dataset, with the pictures that its run drew."""
    found = sweep.predict(GRID)
    status = (("mu", "n0"), np.ones((5, 2), "int8"), {"flag_values": [1, 2], "flag_meanings": "settled time_limit"})
    found.assign(status=status).to_netcdf(tmp_path / "quick.nc")
    (tmp_path / "quick.png").write_bytes(b"of the run")
    return tmp_path / "quick.nc"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("--variable status --vmin 0", "vmin: status is drawn as categories, which have no scale; leave it out"),
        ("--at n0=0.02 --cmap gray", "cmap: reversals_predicted is drawn as a curve, which has no colour scale"),
        ("--at n0=0.066", "--at n0: 0.066 is far from all its values, 0.02 to 0.05; choose one of them"),
    ],
)
def test_what_a_picture_has_no_use_for_is_refused(options: str, said: str, file: Path) -> None:
    result = invoke("plot", file, *options.split())
    assert (result.exit_code, said in result.stderr) == (2, True), result.output
    assert {path.name for path in file.parent.iterdir()} == {"quick.nc", "quick.png"}


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ("--at n0=0.04", "quick_n0=0.04.png"),
        ("--variable form_factor", "quick_form_factor.png"),
        ("--x n0 --y mu --width 85mm --title=", "quick_x=n0_y=mu_width=85mm_title=.png"),
        ("--vmin 0 --vmax 3", "quick_vmin=0_vmax=3.png"),
    ],
)
def test_the_picture_of_the_run_is_not_overwritten(options: str, name: str, file: Path) -> None:
    result = invoke("plot", file, *options.split())
    assert result.stdout.endswith(f"wrote {file.parent / name}\n"), result.output
    assert (file.parent / "quick.png").read_bytes() == b"of the run"
    assert invoke("plot", file).stdout == f"wrote {file.parent / 'quick.png'}\n"


@pytest.mark.parametrize("value", [slice(0, 1), "a", [0.02, 0.05], np.nan, True])
def test_a_selection_is_a_number(value: Any) -> None:
    with pytest.raises(InputError, match=r"^at\.n0: must be one finite number, not "):
        sweep.plot(sweep.predict(GRID), at={"n0": value})


@pytest.mark.parametrize("every", [0, -1, np.nan, np.inf, "1", True])
def test_the_time_between_samples_is_a_positive_number(every: Any) -> None:
    with pytest.raises(InputError, match=r"^every: must be a finite number > 0, not"):
        sweep.trajectory({"model": "averaged", "friction": {"mu": 60}}, t_end=20, every=every)


@pytest.mark.parametrize("name", ["bracket", "deviation"])
@pytest.mark.parametrize("value", [0, -1, 2, np.nan])
def test_a_width_that_no_search_reaches_is_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"^{name}: must be between .* and .*, not "):
        sweep.boundaries(GRID, **{name: value})  # type: ignore[arg-type]


def summary(**variables: Any) -> str:
    from sweep.results.summary import accuracy, describe

    dataset = xr.Dataset(variables)
    return "\n".join([describe(dataset), *accuracy(dataset)])


def test_words_agree_with_their_number() -> None:
    one = {"status": ((), np.int8(2)), "step": ((), 0.5), "step_rule": ((), np.int8(1))}
    assert summary(**one) == "1 cell: 1 time_limit\nstep: 0.5 to 0.5, set by accuracy in 1 cell"


def test_the_last_lines_of_a_run_say_which_counts_are_certain_and_what_to_do_about_the_others() -> None:
    rules = {"step": ("mu", [1.0, 2, 3, 4]), "step_rule": ("mu", [1, 3, 3, 3])}
    counts = {"status": ("mu", np.array([1, 1, 2, 1], "int8")), "reversals": ("mu", [1, 2, 2, 5])}
    counts |= {"reversals_predicted": ("mu", [1, 2, 3, 1])}
    bits = [0, Doubt.TOLERANCE | Doubt.STEP, Doubt.TOLERANCE | Doubt.TIME_LIMIT, 0]
    doubts = {"certain": ("mu", [1, 0, 0, 1]), "doubts": ("mu", bits)}
    errors = {"spin_error": ("mu", [1e-9, 2e-3, np.nan, 1e-9]), "mu": [10.0, 20.0, 30.0, 40.0], **doubts}
    assert summary(**rules, **counts, **errors).splitlines() == [
        "4 cells (mu 4): 3 settled, 1 time_limit; 1 to 5 reversals; "
        "predicted correctly in 50.0% of the cells, within one in 75.0%",
        "2 of 4 counts are certain; the others:",
        "  1, at mu = 30: the time limit came first, so more reversals may follow; raise t_end",
        "  1, at mu = 20: longer steps give a different number of reversals; lower the tolerance",
        "final spins: 2 of 4 cells miss the tolerance, with errors up to 2.0e-03",
        "spin error: median 1.0e-09, largest 2.0e-03, as estimated",
        "step: 1 to 4, set by accuracy in 1 cell, repeat in 3 cells",
    ]


def test_a_longer_run_is_advised_only_if_some_cells_settle() -> None:
    doubts = {"certain": ("mu", [0, 0]), "doubts": ("mu", [int(Doubt.TIME_LIMIT)] * 2)}
    for status, advised in (([2, 1], True), ([2, 2], False)):
        text = summary(status=("mu", np.array(status, "int8")), reversals=("mu", [1, 2]), **doubts)
        assert "more reversals may follow" in text
        assert ("raise t_end" in text) == advised


def test_an_averaged_status_is_not_a_status() -> None:
    assert summary(status=("mu", [1.5, 2.0])) == "no status of individual cells: averaged"


def test_an_unknown_probability_is_shown_as_unknown() -> None:
    nothing = {name: ("count", [np.nan]) for name in ("probability", "probability_low", "probability_high")}
    text = summary(status=("sample", np.array([3, 3], "int8")), count=("count", [1]), **nothing)
    assert text.splitlines()[1] == "probability: 1 or more unknown"


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(0.0, "0 s"), (5e-5, "under 1 ms"), (0.351, "0.35 s"), (119, "120 s"), (200, "3 min 20 s"), (3400, "57 min"),
     (4800, "1 h 20 min"), (3600, "1 h"), (90000, "25 h"), (200000, "2 days 8 h"), (1e7, "116 days")],
)  # fmt: skip
def test_a_duration_is_written_as_people_write_it(seconds: float, said: str) -> None:
    from sweep.faults import duration

    assert duration(seconds) == said

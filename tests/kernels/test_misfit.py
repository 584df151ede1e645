"""The misfit to a film as a measurement: against trajectories by other code, and in runs of all kinds."""

from pathlib import Path
from typing import Any

import distributed
import numpy as np
import pytest
from support import Write, adaptive, columns
from support.cli import invoke
from support.runs import Heard, same_numbers

import sweep
from sweep.config import InputError
from sweep.explorer.setup import usable
from sweep.explorer.slices import Source
from sweep.faults import FileError
from sweep.kernels.status import LIFT_OFF, TIME_LIMIT
from sweep.models.ladder import slip
from sweep.models.model import take
from sweep.results.summary import describe
from sweep.studies.study import measuring

TEXT = """\
name: film
friction: {mu: [40, 60, 80]}
start: {n0: [0.03, 0.05]}
measure: [reversals, {misfit: film.csv}]
integrator: {step: 0.02, t_end: 150}
"""


def film(write: Write, times: np.ndarray, header: str = "time,spin,error", *, turned: float = 0.0) -> Path:
    """A film of nothing in particular, with errors that differ."""
    rows = np.stack([times, 0.05 * np.cos(times / 30 + turned), 0.01 + 1e-4 * times])
    return write("\n".join([header, *(",".join(f"{x:.17g}" for x in row) for row in rows.T), ""]), "film.csv")


def misfit(spins: np.ndarray, times: np.ndarray) -> Any:
    return np.sum(((spins - 0.05 * np.cos(times / 30)) / (0.01 + 1e-4 * times)) ** 2, axis=-1)


def spins(times: np.ndarray) -> np.ndarray:
    """The standard case by another integrator."""
    *states, _ = adaptive.motion(columns(), np.unique(times), rtol=1e-13, atol=1e-16)
    found = slip.MODEL.rhs(tuple(states), take(slip.MODEL.constants.of(columns()), 0))[1][0]
    return np.asarray(found)[np.searchsorted(np.unique(times), times)]


@pytest.fixture
def config(write: Write) -> Path:
    film(write, np.linspace(0, 150, 301))
    return write(TEXT)


def test_a_search_follows_no_film(config: Path) -> None:
    assert measuring(sweep.load_config(config)).film is None


@pytest.mark.parametrize("method", ["dopri5", "adams"])
def test_it_is_that_of_the_trajectories(write: Write, method: str) -> None:
    """At instants that lie anywhere, close to both ends, and twice."""
    times = np.concatenate([[0, 1e-3, 1e-3, 0.013], np.sort(np.random.default_rng(0).uniform(0.1, 39.9, 30)), [40]])
    film(write, times)
    found = sweep.run(write(TEXT), mu=60.0, n0=0.05, step="auto", method=method)
    assert found.misfit.item() == pytest.approx(misfit(spins(times), times), rel=1e-8)
    assert found.misfit.attrs["description"].startswith("Sum of squares of (spin - film) / error")


def test_all_other_numbers_are_those_of_a_run_without(config: Path) -> None:
    found = sweep.run(config, t_end=3000, step="auto")
    same_numbers(found.drop_vars("misfit"), sweep.run(config, t_end=3000, step="auto", measure=["reversals"]))
    assert np.isfinite(found.misfit).all()
    assert found.misfit.dims == found.reversals.dims


def test_a_run_that_fails_has_none(config: Path) -> None:
    found = sweep.run(config, n0=[0.05, 5.0], mu=60, step="auto")
    assert found.status.values.ravel().tolist() == [TIME_LIMIT, LIFT_OFF]
    assert np.isfinite(found.misfit).values.ravel().tolist() == [True, False]


def test_a_run_says_which_rows_of_the_film_are_left_out(write: Write, config: Path) -> None:
    file = film(write, np.linspace(0, 150, 301))
    file.write_text(f"{file.read_text(encoding='utf-8')}151,,0.01\n", encoding="utf-8")
    heard = Heard()
    sweep.run(config, reporter=heard)
    assert heard.notes == ["1 row of the film is left out: 1 row without a number"]


def test_workers_get_the_film(config: Path, client: distributed.Client) -> None:
    same_numbers(sweep.run(config, client=client), sweep.run(config))


def test_another_film_is_another_run(write: Write, config: Path, tmp_path: Path) -> None:
    first = sweep.run(config, tmp_path / "out")
    grown = sweep.run(config, tmp_path / "out", mu=[40, 60, 80, 100])
    assert "6 of 8" in grown.attrs["taken_over"]
    np.testing.assert_array_equal(grown.misfit.sel(mu=first.mu), first.misfit)
    film(write, np.linspace(0, 150, 301), turned=0.1)
    with pytest.raises(FileError, match="the film differs"):
        sweep.run(config, tmp_path / "out", mu=[40, 60, 80, 100])
    assert sweep.run(config).attrs["film_sha256"] != first.attrs["film_sha256"]


def test_it_is_drawn_told_and_explored(config: Path, tmp_path: Path) -> None:
    found = sweep.run(config, tmp_path)
    assert invoke("plot", tmp_path / "film.nc", "--var", "misfit").exit_code == 0
    said = invoke("info", tmp_path / "film.nc").stdout
    at = found.misfit.isel(found.misfit.argmin(...))
    assert f"misfit: {at.item():.6g} at least, of 301 instants, at mu = {at.mu.item():g}, n0 = {at.n0.item():g}" in said
    assert "misfit: 1, of 301 instants" in describe(found.isel(mu=0, n0=0).assign(misfit=1.0)).splitlines()
    assert usable(Source(found))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (TEXT.replace("t_end: 150", "t_end: 100"), "the film film.csv lasts 150, but trajectories 100; raise t_end"),
        (TEXT.replace("{misfit: film.csv}", "misfit"), "misfit needs a film; write {misfit: film.csv}"),
        (TEXT.replace("film.csv", "none.csv"), "none.csv: no such file"),
    ],
)
@pytest.mark.usefixtures("config")
def test_what_cannot_be_measured_is_refused_in_one_line(write: Write, text: str, words: str) -> None:
    with pytest.raises(InputError) as refusal:
        sweep.load_config(write(text))
    assert words in str(refusal.value)
    assert len(refusal.value.faults) == 1


def test_a_film_of_headings_is_refused(write: Write) -> None:
    film(write, np.linspace(0, 150, 301), "time,heading,error")
    with pytest.raises(InputError, match="shows a heading, but a misfit needs a spin"):
        sweep.load_config(write(TEXT))

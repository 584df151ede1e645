"""Laws of friction compared by films that another derivation has made."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support import Write, newton
from support.cli import invoke

import sweep
from sweep.config.film import Film

STONE = """\
name: stone
units: SI
body: {a: 0.2, b: 0.03, c: 0.02, offset: 0.01, mass: 1.0, Ixx: 2.0e-4, Iyy: 1.6e-3, Izz: 1.7e-3, Ixy: -2.0e-5}
friction: {law: coulomb, regularisation: sqrt, mu: 0.3, speed: 0.02}
start: {n0: 5, x0: 2.0e-3, y0: 2.0e-4}
integrator: {t_end: 2}
"""
VISCOUS = STONE.replace("law: coulomb, regularisation: sqrt, mu: 0.3, speed: 0.02", "mu: 2")
NOISE = 0.05


def film(config: Path, law: str, error: float | None = None) -> Film:
    """What Newton's equations give with a law, and noise."""
    checked, times = sweep.load_config(config), np.arange(0, 2, 1 / 60)
    columns, model = checked.grid.columns(), checked.equations
    p = {name: float(value[0]) for name, value in columns.items()}
    start = np.array(model.start(columns))[:, 0]
    spins = newton.spin(newton.follow(start, p, law, times, 1e-8))
    noisy = spins + np.random.default_rng(1).normal(0, NOISE, len(times))
    return Film(times, noisy, None if error is None else np.full(len(times), error))


@pytest.fixture(scope="module")
def dry(kept: Write) -> xr.Dataset:
    """A film with dry friction, which both laws are fitted to."""
    path = kept(STONE)
    return sweep.fit(path, film(path, "coulomb-sqrt"), ["mu", "n0", "mu_static"], laws=["viscous", "coulomb"])


def test_a_film_is_attributed_to_its_law(dry: xr.Dataset) -> None:
    found = dry
    assert found.law.values.tolist() == ["viscous", "coulomb-sqrt"]
    assert found.number_free.values.tolist() == [2, 2]
    assert found.weight.sel(law="coulomb-sqrt").item() > 0.9999
    assert "viscous is ruled out beside coulomb-sqrt: Akaike's criteria differ by" in found.attrs["undetermined"]
    true = found.sel(law="coulomb-sqrt", parameter="mu")
    assert true.lower_95.item() < 0.3 < true.upper_95.item()
    assert true.chi_square.item() == pytest.approx(len(found.time) - 2)
    assert "law: coulomb" in found.attrs["config"]


@pytest.mark.campaign
def test_laws_that_cannot_be_told_apart_are_said(write: Write) -> None:
    """A slip far below its speed: dry friction is viscous, with one parameter more."""
    config = write(VISCOUS)
    found = sweep.fit(config, film(config, "viscous", NOISE), ["mu", "n0"], laws=["viscous", "coulomb-sqrt"])
    words = found.attrs["undetermined"]
    assert "viscous and coulomb-sqrt cannot be told apart by this film" in words
    assert "coulomb-sqrt: speed and mu are known only together" in words
    assert "misses the film" not in words
    assert found.number_free.values.tolist() == [2, 3]
    assert np.isnan(found.value.sel(law="viscous", parameter="speed"))
    np.testing.assert_allclose(found.weight.sum(), 1)
    np.testing.assert_allclose(found.akaike, found.chi_square + 2 * found.number_free)


def test_a_film_that_no_law_reproduces_is_said(write: Write) -> None:
    config = write(VISCOUS)
    found = sweep.fit(config, film(config, "viscous", NOISE / 3), ["mu"], laws=["viscous"])
    assert "even viscous misses the film by more than its errors" in found.attrs["undetermined"]


def test_the_command_writes_table_picture_and_the_best_body(write: Write, tmp_path: Path) -> None:
    seen = film(write(VISCOUS), "viscous")
    config = write(STONE)
    rows = "".join(f"{time},{spin}\n" for time, spin in zip(seen.time, seen.value, strict=True))
    table = write("time,spin\n" + rows, "film.csv")
    out = tmp_path / "out"
    said = invoke("fit", config, table, "--free", "mu,n0,speed", "--laws", "none,viscous", "--output", out)
    assert said.exit_code == 0, said.output
    assert "law none: free are n0; it has no mu, speed\n" in said.stderr
    assert "law viscous: free are mu, n0; it has no speed\n" in said.stderr
    assert said.stdout.splitlines()[1].startswith("viscous ")
    best = sweep.load_config(out / "stone_laws.yaml")
    assert (best.law, best.integrator.t_end) == ("viscous", 2)
    for verb in ("info", "plot"):
        assert invoke(verb, out / "stone_laws.nc").exit_code == 0

"""Films as phones and trackers write them, and what is wrong with others."""

from pathlib import Path

import numpy as np
import pytest
from support import Write

from sweep.config import ConfigError, film

TIMES = np.arange(20) / 10
SPINS = np.cos(TIMES)


def table(header: str, *columns: np.ndarray, mark: str = ",") -> str:
    rows = [mark.join(f"{value:.17g}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join([header, *rows, ""])


@pytest.mark.parametrize(
    ("header", "mark", "unit"),
    [
        ("t,spin", ",", 1.0),
        ('"Time (s)","Gyroscope x (rad/s)","Gyroscope z (rad/s)"', ",", 1.0),
        ("time (ms);omega_z [deg/s]", ";", np.pi / 180),
        ("Time (min)\tspin (rpm)", "\t", np.pi / 30),
    ],
)
def test_spins_come_in_their_units(write: Write, header: str, mark: str, unit: float) -> None:
    clock = 1e3 if "(ms)" in header else 1 / 60 if "(min)" in header else 1.0
    between = [np.zeros(20)] if "Gyroscope x" in header else []
    found = film.read(write(table(header, 5 + TIMES * clock, *between, SPINS / unit, mark=mark), "film.csv"))
    np.testing.assert_allclose(found.time, TIMES, atol=1e-12)
    np.testing.assert_allclose(found.value, SPINS, rtol=1e-12)
    assert found.error is None
    assert found.what == ("spin" if "spin" in header else "gyroscope")


@pytest.mark.parametrize("mark", [";", "\t"])
def test_numbers_may_have_decimal_commas(write: Write, mark: str) -> None:
    text = table("t;n", TIMES, SPINS, mark=";").replace(".", ",").replace(";", mark)
    found = film.read(write(text, "film.csv"))
    assert found.left_out == 0
    np.testing.assert_allclose([found.time, found.value], [TIMES, SPINS], rtol=1e-12)


def test_a_heading_is_unwrapped(write: Write) -> None:
    turned = 300 * TIMES  # in degrees; a turn and two thirds
    found = film.read(write(table("time (s),angle (deg),error (deg)", TIMES, turned % 360, 1 + TIMES), "film.csv"))
    assert found.what == "heading"
    np.testing.assert_allclose(found.value, np.radians(turned), atol=1e-12)
    np.testing.assert_allclose(found.error, np.radians(1 + TIMES), rtol=1e-12)


@pytest.mark.parametrize(("unit", "factor"), [("", np.pi / 180), (" (deg/s)", np.pi / 180), (" (rad/s)", 1.0)])
def test_errors_are_in_the_unit_of_the_spin_unless_they_say_another(write: Write, unit: str, factor: float) -> None:
    found = film.read(write(table(f"time (s),spin (deg/s),error{unit}", TIMES, SPINS, 1 + TIMES), "film.csv"))
    np.testing.assert_allclose(found.error, factor * (1 + TIMES), rtol=1e-12)


def test_rows_without_a_number_are_left_out(write: Write) -> None:
    spins = SPINS.copy()
    spins[[3, 7]] = np.nan
    text = table("time,spin", TIMES, spins).replace("1.3,", "1.3,lost")
    found = film.read(write(text, "film.csv"))
    assert found.left_out == 3
    np.testing.assert_allclose(found.value, np.delete(SPINS, [3, 7, 13]), rtol=1e-12)


def test_a_film_of_very_many_rows_is_thinned(write: Write) -> None:
    times = np.arange(5 * film.MOST_ROWS) * 1e-4
    found = film.read(write(table("time,spin", times, np.cos(times)), "film.csv"))
    assert len(found.time) == film.MOST_ROWS
    np.testing.assert_allclose(found.value, np.cos(found.time), rtol=1e-12)
    turned = film.read(write(table("time,heading", times, np.mod(1e4 * times, 2 * np.pi)), "film.csv"))
    np.testing.assert_allclose(turned.value, 1e4 * turned.time, rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("time\n1\n2\n", ":1:", "'spin (rad/s)', 'gyroscope z (rad/s)' or 'heading (deg)'; it has time"),
        ("spin (m/s),time\n1,2\n", ":1:", "spin is in 'm/s'; its unit must be rad/s, 1/s, deg/s, °/s or rpm"),
        (table("t,spin", TIMES[::-1], SPINS), ":3:", "the time goes back; sort the rows by time"),
        ("t,spin\n\n0,1\n2,1\n1,1\n", ":5:", "the time goes back; sort the rows by time"),
        (table("t,spin (1/s),error (rad)", TIMES, SPINS, 1 + TIMES), ":1:", "error is in 'rad'; its unit must be"),
        (table("t,spin,error", TIMES, SPINS, TIMES), ":2:", "the error must be a number > 0"),
        (table("t,spin", TIMES[:5], SPINS[:5]), ":", "has 5 rows with a time and a spin; a fit needs at least 8"),
        (table("t,spin", 0 * TIMES, SPINS), ":", "a fit needs at least 8, not all at one time"),
        ("", ":", "cannot be read"),
        ("t,spin\n0,1\n1,2,3\n", ":", "cannot be read: no table; the first line must name all columns"),
        (table("t,spin", TIMES, TIMES, SPINS), ":2:", "no table; the first line must name all columns"),
        ("\0\0\1", ":", "film.csv"),
    ],
)  # fmt: skip
def test_a_film_that_is_none_is_refused_in_one_line(write: Write, text: str, line: str, words: str) -> None:
    path = write(text, "film.csv")
    with pytest.raises(ConfigError) as refusal:
        film.read(path)
    assert len(refusal.value.faults) == 1
    assert words in str(refusal.value)
    assert f"{path}{line}" in str(refusal.value)


def test_a_film_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    (tmp_path / "film.csv").write_bytes("t,spin (°/s)\n".encode("cp1252"))
    for name, words in (("none.csv", "No such file"), ("film.csv", "not UTF-8 text")):
        with pytest.raises(ConfigError, match=rf"{name}: cannot be read: {words}"):
            film.read(tmp_path / name)


def test_repeated_instants_and_gaps_are_kept(write: Write) -> None:
    times = np.array([0, 0, 0.1, 0.2, 0.2, 3, 3.1, 3.2, 9])
    found = film.read(write(table("t,n", times, np.cos(times)), "film.csv"))
    np.testing.assert_array_equal(found.time, times)

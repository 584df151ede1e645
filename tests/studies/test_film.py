"""Films as phones and trackers write them, and what is wrong with others."""

import re
from pathlib import Path

import numpy as np
import pytest
from support import Write
from support.physics import STONE

import sweep
from sweep.config import InputError, film

TIMES = np.arange(20) / 10
SPINS = np.cos(TIMES)


def table(header: str, *columns: np.ndarray, mark: str = ",") -> str:
    rows = [mark.join(f"{value:.17g}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join([header, *rows, ""])


TIME, UP = TIMES + 3, SPINS - 2


@pytest.mark.parametrize(
    ("name", "header", "columns"),
    [
        ("film.csv", "t,spin", [TIME, UP]),
        ("film.csv", "time (ms);omega_z [deg/s]", [1e3 * TIME, np.degrees(UP)]),
        ("film.csv", "Time (min)\tspin (rpm)", [TIME / 60, UP * 30 / np.pi]),
        ("film.csv", "time,spin,note\nms,deg/s,", [1e3 * TIME, np.degrees(UP), SPINS]),
        ("film.csv", "time,spin,note\n[ms],(°/s),", [1e3 * TIME, np.degrees(UP), SPINS]),
        ("film.csv", "time,spin (deg/s),note\nms,,", [1e3 * TIME, np.degrees(UP), SPINS]),
        ("phyphox.csv", '"Time (s)","Gyroscope x (rad/s)","Gyroscope z (rad/s)"', [TIME, SPINS, UP]),
        ("phyphox.csv", '"Zeit (s)","Gyroskop X (rad/s)","Gyroskop Z (rad/s)","Betrag (rad/s)"', [TIME, SPINS, UP, UP]),
        ("phyphox.csv", '"Czas (s)","Żyroskop - składowa z (rad/s)"', [TIME, UP]),
        ("phyphox.csv", '"時間 (s)","ジャイロスコープ z (rad/s)"', [TIME, UP]),
        ("Gyroscope.csv", "time,seconds_elapsed,z,y,x", [1e18 + TIME * 1e9, TIME, UP, SPINS, SPINS]),
        ("toolbox.csv", "time,wx,wy,wz", [TIME, SPINS, SPINS, UP]),
        ("tracker.csv", "t,x,y,ω (rad/s)", [TIME, SPINS, SPINS, UP]),
        ("capstone.csv", "Time (s) Run #1,Spin (deg/s) Run #1,Time (s) Run #2", [TIME, np.degrees(UP), 2 * TIME]),
        ("capstone.csv", "Time (s) Run #1,Angular Velocity (deg/s) Run #1", [TIME, np.degrees(UP)]),
        ("film.csv", "t,spin (dps)", [TIME, np.degrees(UP)]),
        *(("film.csv", f"time,{name}", [TIME, UP]) for name in ("gyrZ", "GyroZ", "motionRotationRateZ", "gz")),
        ("log.csv", "time (s),gyroRotationX (rad/s),gyroRotationZ (rad/s)", [TIME, SPINS, UP]),
        ("log.csv", "time (s),spin rate (raw) z (dps)", [TIME, np.degrees(UP)]),
    ],
)  # fmt: skip
@pytest.mark.parametrize("minus", ["-", "−"])
def test_columns_of_phones_and_trackers_are_known_with_their_units(
    write: Write, name: str, header: str, columns: list[np.ndarray], minus: str
) -> None:
    (mark,) = {each for each in ",;\t" if each in header}
    found = film.read(write(header + table("", *columns, mark=mark).replace("-", minus), name))
    np.testing.assert_allclose([found.time, found.value], [TIMES, UP], rtol=1e-12, atol=1e-12)
    assert found.what == ("spin" if re.search("spin|Spin|ω|Angular", header) and "z" not in header else "gyroscope")
    assert (found.left_out, found.clock == "ms", found.error) == (0, "ms" in header, None)


@pytest.mark.parametrize(("mark", "comma"), [("\t", False), ("\t", True), (";", True), (",", False)])
@pytest.mark.parametrize("name", ["ω", "θr"])
def test_a_table_of_tracker_has_what_it_followed_above_the_names(
    write: Write, name: str, mark: str, comma: bool
) -> None:
    """Its numbers have ten digits, with the comma of the language, and the ends of a derivative are empty."""
    rows = [[f"{value:.9E}" for value in row] for row in zip(TIMES + 3, SPINS, SPINS, strict=True)]
    rows[0][2] = rows[-1][2] = ""
    lines = [mark.join(each) for each in (["t", "x", name], *rows)]
    text = "\n".join(["mass_A", *lines, ""])
    found = film.read(write(text.replace(".", ",") if comma else text, "tracker.txt"))
    np.testing.assert_allclose([found.time, found.value], [TIMES[:-2], SPINS[1:-1]], rtol=1e-9, atol=1e-9)
    assert (found.what, found.left_out) == ("spin" if name == "ω" else "heading", 2)
    with pytest.raises(InputError, match=r"tracker\.txt:2:.* it has t, x, y"):
        film.read(write(text.replace(name, "y"), "tracker.txt"))


def test_columns_may_be_asked_for_by_name(write: Write) -> None:
    path = write(table("clock,time (s),spin (rad/s),turn,z", TIMES * 1e3, TIMES, UP, np.degrees(SPINS), UP), "film.csv")
    found = film.read(path, "clock (ms)", "turn (deg/s)")
    np.testing.assert_allclose([found.time, found.value], [TIMES, SPINS], rtol=1e-12, atol=1e-12)
    assert [film.read(path, "", each).what for each in ("turn", "z", "turn (deg)")] == ["spin", "gyroscope", "heading"]
    path = write(table("Time (s) Run #1,Pendulum (deg) Run #1,gyrZ (dps)", TIMES, np.degrees(SPINS), UP), "film.csv")
    heading, gyroscope = (film.read(path, "", each) for each in ("Pendulum (deg) Run #1", "gyrZ"))
    assert (heading.what, gyroscope.what) == ("heading", "gyroscope")
    np.testing.assert_allclose([heading.value, gyroscope.value], [SPINS, np.radians(UP)], rtol=1e-12, atol=1e-12)
    path = write(table("clock,time (s),spin (rad/s),turn,z", TIMES * 1e3, TIMES, UP, np.degrees(SPINS), UP), "film.csv")
    with pytest.raises(InputError, match=r"--spin-column: there is no column tunr .* .did you mean turn"):
        film.read(path, "", "tunr (deg/s)")


def test_the_accelerations_of_a_logger_are_no_spins(write: Write) -> None:
    with pytest.raises(InputError, match="'gyroscope z"):
        film.read(write(table("time,seconds_elapsed,z,y,x", TIMES, TIMES, UP, UP, UP), "Accelerometer.csv"))


def test_degrees_taken_for_radians_are_refused(write: Write) -> None:
    path = write(table("t (s),n", TIMES, 400 + SPINS), "film.csv")
    with pytest.raises(InputError, match="film: turns at 401 rad/s; if its spins are in degrees, name the unit"):
        sweep.fit(write(STONE), path, ["mu"])


def test_headings_in_degrees_without_their_unit_are_refused(write: Write) -> None:
    path = write(table("t (s),angle", TIMES, (300 * TIMES + 100 * SPINS) % 360), "film.csv")
    with pytest.raises(InputError, match=r"film: turns by \S+ rad from row to row, .* such as 'heading \(deg\)'"):
        sweep.fit(write(STONE), path, ["mu"])


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_film_may_come_from_a_spreadsheet(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "film.txt").write_text(table("t\tn", TIMES, SPINS, mark="\t"), encoding=encoding)
    np.testing.assert_allclose(film.read(tmp_path / "film.txt").value, SPINS, rtol=1e-12)


def quoted(*spins: str) -> str:
    return "t,n\n" + "".join(f'{i},"{spin}"\n' for i, spin in enumerate(spins * 4))


def test_quoted_decimal_commas_are_read_where_the_column_shows_that_they_are_decimal(write: Write) -> None:
    found = film.read(write(quoted("-1,442", "0,5", "3"), "film.csv"))
    np.testing.assert_array_equal(found.value[:3], [-1.442, 0.5, 3.0])


def test_a_heading_is_unwrapped(write: Write) -> None:
    turned = 300 * TIMES  # in degrees; a turn and two thirds
    found = film.read(write(table("time (s),angle (deg),error (deg)", TIMES, turned % 360, 1 + TIMES), "film.csv"))
    assert found.what == "heading"
    np.testing.assert_allclose(found.value, np.radians(turned), atol=1e-12)
    np.testing.assert_allclose(found.error, np.radians(1 + TIMES), rtol=1e-12)


def test_two_points_that_a_tracker_follows_are_a_heading(write: Write) -> None:
    """The first moves about, and both are in pixels of any size."""
    x, y, turned = 300 + 40 * TIMES, 200 - 9 * TIMES, 5 * TIMES
    columns = [TIMES, x + 120 * np.cos(turned), y + 120 * np.sin(turned), x, y]
    found = film.read(write(table("t (s),x_2,y_2,x_1,y_1", *columns), "film.csv"))
    assert (found.what, found.error) == ("heading", None)
    np.testing.assert_allclose(found.value, turned, atol=1e-12)
    columns[3] = np.where(np.arange(20) == 4, np.nan, x)
    assert film.read(write(table("t (s),x2,y2,x1,y1", *columns), "film.csv")).left_out == 1


@pytest.mark.parametrize(("run", "value"), [("Run #1", SPINS), ("Run #2", UP), ("fast", TIMES)])
def test_a_run_of_a_table_of_several_is_chosen_by_the_end_of_its_names(
    write: Write, run: str, value: np.ndarray
) -> None:
    header = "Time (s) Run #1,Spin (rad/s) Run #1,Time (s) Run #2,Spin (rad/s) Run #2,time (s),Spin fast (rad/s)"
    path = write(table(header, TIMES, SPINS, TIMES + 1, UP, TIMES, TIMES), "capstone.csv")
    np.testing.assert_allclose(film.read(path, run=run).value, value, rtol=1e-12, atol=1e-12)
    with pytest.raises(InputError, match="--run: there is no run Run #3; it has Time Run #1, Spin Run #1"):
        film.read(path, run="Run #3")


def test_a_run_of_a_table_of_several_is_chosen_by_the_word_of_its_column(write: Write) -> None:
    rows = [f"{run},{t!r},{n!r}" for run, n in (("slow", 1.0), ("fast", 5.0)) for t in TIMES.tolist()]
    path = write("\n".join(["run,t (s),n (rad/s)", *rows, ""]), "runs.csv")
    assert set(film.read(path, run="fast").value) == {5.0}
    with pytest.raises(InputError, match="--run: has several runs; name one; it has slow, fast"):
        film.read(path)
    with pytest.raises(InputError, match=r"there is no run fats \(did you mean fast\?\)"):
        film.read(path, run="fats")


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
    assert found.why == "3 rows without a number (one has 'lost0.26749882862458735')"
    np.testing.assert_allclose(found.value, np.delete(SPINS, [3, 7, 13]), rtol=1e-12)


def test_a_film_of_very_many_rows_is_thinned(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(film, "MOST_ROWS", 200)
    times = np.arange(5 * film.MOST_ROWS) * 1e-4
    found = film.read(write(table("time,spin", times, np.cos(times)), "film.csv"))
    assert len(found.time) == film.MOST_ROWS
    assert found.why == "all but one in 5 of 1000 rows, as more would hardly add information"
    np.testing.assert_allclose(found.value, np.cos(found.time), rtol=1e-12)
    turned = film.read(write(table("time,heading", times, np.mod(1e4 * times, 2 * np.pi)), "film.csv"))
    np.testing.assert_allclose(turned.value, 1e4 * turned.time, rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("time\n1\n2\n", ":1:", "'spin (rad/s)', 'gyroscope z (rad/s)', 'heading (deg)' or 'x1, y1, x2, y2'; it has"),
        ("spin (m/s),time\n1,2\n", ":1:", "spin: is in 'm/s'; its unit must be rad/s, 1/s, deg/s, °/s or rpm"),
        (table("t,spin", TIMES[::-1], SPINS), ":3:", "the time decreases; sort the rows by time"),
        ("t,spin\n\n0,1\n2,1\n1,1\n", ":5:", "the time decreases; sort the rows by time"),
        (table("t,spin (1/s),error (rad)", TIMES, SPINS, 1 + TIMES), ":1:", "error: is in 'rad'; its unit must be"),
        (table("t,spin,error", TIMES, SPINS, TIMES), ":2:", "the error must be a number > 0"),
        (table("t,spin", TIMES[:5], SPINS[:5]), ":", "has 5 rows with a time and a spin; a fit needs at least 8"),
        (table("t,spin", 0 * TIMES, SPINS), ":", "a fit needs at least 8 rows, at different times"),
        ("", ":", "empty; its first line has to name the columns"),
        ("t,spin\n0,1\n1,2,3\n", ":3:", "3 values, but 2 columns in line 1, with commas between them; use semicolons"),
        (table("t,spin", TIMES, TIMES, SPINS), ":2:", "with commas between them; 20 of 20 rows are like this; use"),
        ("\0\0\1", ":", "film.csv"),
        ("t n\n0 1\n", ":1:", "it has t n, with no commas, semicolons or tabs in the line"),
        (table("t,n\ns,m/s", TIMES, SPINS), ":2:", "n: is in 'm/s'; its unit must be rad/s"),
        (table("t,n (rad/s)\ns,deg/s", TIMES, SPINS), ":2:", "n: is in 'rad/s' in line 1, and in 'deg/s' here; give"),
        (quoted("-1,442"), ":2:", "n: '-1,442' may be -1.442 or -1442; write one of these, or semicolons"),
        (quoted("-1,442", "0.5"), ":1:", "n: has '-1,442' and '0.5'; use decimal points only"),
        (table("t,n", TIMES, SPINS).replace("1.3,0.26", "1.3,(0.26)"), ":15:", "is not a number (1 of 20 cells)"),
        (table("t,n", TIMES, SPINS).replace(",0.", ",~0."), ":3:", "is not a number (15 of 20 cells); write"),
        (table("t,n", TIMES, SPINS).replace("\n1.", "\nlost 1."), ":13:", "(9 of 20 cells); write numbers only"),
    ],
)  # fmt: skip
def test_a_table_that_is_not_a_film_is_refused_in_one_line(write: Write, text: str, line: str, words: str) -> None:
    path = write(text, "film.csv")
    with pytest.raises(InputError) as refusal:
        film.read(path)
    assert len(refusal.value.faults) == 1
    assert words in str(refusal.value)
    assert f"{path}{line}" in str(refusal.value)


def test_a_film_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    (tmp_path / "film.csv").write_bytes("t,spin (°/s)\n".encode("cp1252"))
    for name, words in (("none.csv", "no such file"), ("film.csv", "not UTF-8 text")):
        with pytest.raises(InputError, match=rf"{name}: {words}"):
            film.read(tmp_path / name)


def test_repeated_instants_and_gaps_are_kept(write: Write) -> None:
    times = np.array([0, 0, 0.1, 0.2, 0.2, 3, 3.1, 3.2, 9])
    found = film.read(write(table("t,n", times, np.cos(times)), "film.csv"))
    np.testing.assert_array_equal(found.time, times)


@pytest.mark.parametrize(
    ("header", "clock", "words"),
    [
        ("t,n", 1e9, "film: lasts 1.9e+09, but trajectories 5; raise t_end, or cut the film; if its"),
        ("t,n", 1e3, "name the unit in the header, such as 'time (ms)'"),
        ("t (s),n", 1e3, "film: lasts 1900, but trajectories 5; raise t_end, or cut the film"),
    ],
)
def test_a_film_in_another_unit_of_time_is_refused_before_it_is_followed(
    write: Write, header: str, clock: float, words: str
) -> None:
    path = write(table(header, TIMES * clock, SPINS), "film.csv")
    with pytest.raises(InputError, match=re.escape(words)):
        sweep.fit(write(STONE), path, ["mu"])
    with pytest.raises(InputError, match="has rows 100 s apart if its times are in s; name the unit in the header"):
        sweep.fit(
            write(STONE.replace("t_end: 5", "t_end: 5000")), write(table("t,n", TIMES * 1e3, SPINS), "f.csv"), ["mu"]
        )


def test_a_film_in_seconds_needs_a_body_in_si(write: Write) -> None:
    path = write(table("t (s),n", TIMES, SPINS), "film.csv")
    with pytest.raises(InputError, match=r"film: gives times in s; set units: SI, or convert all to sqrt\(c/g\)"):
        sweep.fit(write("friction: {mu: [30, 100]}\n"), path, ["mu"])

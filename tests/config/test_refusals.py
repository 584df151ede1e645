"""What is said of a configuration that cannot be run."""

import pickle
from pathlib import Path

import pytest
from support import SMALL, Write
from support.cli import invoke, refused
from support.physics import MOMENTS, stone

import sweep
from sweep import InputError, load_config
from sweep.faults import either, fault_of
from sweep.kernels.methods import AUTO, METHODS
from sweep.models import TIERS
from sweep.plots.quantities import DERIVED


def small(old: str, new: str) -> str:
    assert old in SMALL
    return SMALL.replace(old, new)


def step(setting: str) -> str:
    return small("{method: dopri5, t_end: 1500}", f"{{{setting}}}")


def mu(value: str) -> str:
    return small("[40, 60]", value)


def drawn(n0: str, more: str = "samples: 32") -> str:
    return small("[0.02, 0.05]", n0) + more + "\n"


BOWL = ("{a: 0.2", "{surface: paraboloid, a: 0.01")

# ruff: noqa: E501  (a table)
# (configuration, line of the fault, path, part of what is said)
BROKEN: list[tuple[str, int, str, str]] = [
    (SMALL + "colour: 3\n", 6, "colour", "unknown key; the keys here are name, model,"),
    (small("delta:", "dleta:"), 2, "body.dleta", "unknown key (did you mean delta?); the keys here are surface, solid, weights, a, b, c, delta"),
    ("mu: 60\n", 1, "mu", "unknown key (did you mean friction.mu?); the keys here are name"),
    (small("delta:", "centre_of_mass_y: 0.1, delta:"), 2, "body.centre_of_mass_y", "unknown key: the centre of mass lies on the axis through the surface's centre and lowest point, offset below that centre; no model"),
    (SMALL + "name: again\n", 6, "name", "duplicate key, first on line 1"),
    (mu("[]"), 3, "friction.mu", "axis is empty; give at least one value"),
    (mu(".nan"), 3, "friction.mu", "must be a finite number >= 0 and < 1e+12, not nan"),
    (small("10.0", "ten"), 2, "body.a", "a list of numbers, {start, stop, num, spacing: linear|log}, or {normal: [mean, standard deviation]}, not 'ten'"),
    (small("a: 10.0", "a: "), 2, "body.a", "not nothing"),
    (mu("{start: 1, num: 3}"), 3, "friction.mu.stop", "missing; give a finite number"),
    (mu("{start: 1, stop: 2, num: 2, spacing: cubic}"), 3, "friction.mu.spacing", "must be linear or log, not 'cubic'"),
    (mu("{start: -1, stop: 1, num: 3, spacing: log}"), 3, "friction.mu.spacing", "same sign"),
    (mu("{start: -5, stop: 5, num: 3}"), 3, "friction.mu", "reaches -5, but must be a finite number >= 0"),
    (mu("[40, 40.0]"), 3, "friction.mu", "equal values on one axis; keep each once"),
    (small("friction: {mu: [40, 60]}\n", ""), 1, "friction.mu", "missing; give a finite number >= 0"),
    (small("x0: 0.01", "x0: 11"), 4, "start.x0", "start point off the ellipsoid at x0=11, y0=0.01, a=10, b=2, delta=0.03; keep (x/a)² + (y/b)² < 1"),
    (SMALL + "model: slippery\n", 6, "model", f"must be {', '.join(TIERS)} or a Python file such as my_model.py, not 'slippery' (did you mean slip?)"),
    (step("method: euler"), 5, "integrator.method", f"must be {either([*METHODS, AUTO])}, not 'euler'"),
    ("model: averaged\nfriction: {mu: 60}\nintegrator: {method: adams}\n", 3, "integrator.method", "cannot run the averaged model; choose dopri5"),
    ("model: noslip\nfriction: {mu: [20, 60]}\n", 2, "friction.mu", "the noslip model has no mu; its param"),
    ("model: effective\nfriction: {mu: 60}\nmeasure: [reversals, energy_error]\n", 3, "measure[1]", "energy_error cannot be measured on the effective model"),
    ("model: effective\nfriction: {mu: [0, 60]}\n", 2, "friction.mu", "must be at least 1e-300 for the effective model, not 0"),
    (step("step: aut"), 5, "integrator.step", "not 'aut' (did you mean auto?)"),
    (step("step: 5"), 5, "integrator.step", "must be auto or at most 0.802, a quarter of the rattle's period, not 5"),
    (step("step: 1.0e-320"), 5, "integrator.step", "steps to t_end; keep to 1e+15, or choose auto"),
    (step("method: auto, step: 0.1"), 5, "integrator.step", "must be auto with method: auto; or choose a method"),
    (step("t_end: -1"), 5, "integrator.t_end", "must be settled or a number >= 1e-06 and <= 1e+12, not -1"),
    (step("t_end: settled, stop_early: false"), 5, "integrator.t_end", "settled needs stop_early, which is false; give a time"),
    (step("tolerance: 5e-324"), 5, "integrator.tolerance", "must be auto or a finite number >= 1e-14 and < 1, not 5e-324"),
    (step("stop_early: no"), 5, "integrator.stop_early", "must be true, false or a finite number > 0, not 'no'"),
    (SMALL + "measure: [colour]\n", 6, "measure[0]", "must be reversals, energy_error"),
    (SMALL + "measure: [reversals, reversal_times, {reversal_times: 3}]\n", 6, "measure", "duplicate measurement; name each once"),
    (SMALL + "measure: [{reversal_times: 3}]\n", 6, "measure[0]", "reversal_times is measured with the reversals; add reversals"),
    *((SMALL + f"measure: [reversals, {{reversal_times: {n}}}]\n", 6, "measure[1].reversal_times", f"must be a whole number from 1 to 1000, not {n}") for n in (0, 2.5)),
    (SMALL + "measure: [reversals, {energy_error: 3}]\n", 6, "measure[1]", "energy_error has no settings; write only the name"),
    (SMALL + "picture: [status, spn_mean]\n", 6, "picture[1]", f"must be a variable, such as {either(sorted(DERIVED))}, not 'spn_mean' (did you mean spin_mean?)"),
    (SMALL + "picture: [ratio]\n", 6, "picture[0]", "ratio is not measured; add reversal_times to measure"),
    (SMALL + "picture: [status, status]\n", 6, "picture[1]", "status appears twice; name each once"),
    (SMALL + "max_failed_fraction: 2\n", 6, "max_failed_fraction", "must be a finite number >= 0 and <= 1, not 2"),
    (small("name: small", "name: ../small"), 1, "name", "must be up to 100 letters, digits"),
    (small("{mu: [40, 60]}", "40"), 3, "friction", "must be a section with law, mu, speed"),
    (SMALL + "cases: nowhere.csv\n", 6, "cases", "nowhere.csv: no such file"),
    (SMALL + "cases: cells.parquet\n", 6, "cases", "cells.parquet: Parquet files are not supported; read it with pandas"),
    (small("10.0", "&a 10.0"), 2, "body.a", "a YAML tag or anchor"),
    ("- 1\n- 2\n", 1, "", "a configuration is a mapping of keys to values"),
    (SMALL + "---\nname: b\n", 6, "", "not YAML: a file holds one configuration; remove what follows the line ---"),
    *((SMALL + f"seed: {n}\n", 6, "seed", f"must be a whole number >= 0 and < 4294967296, not {n}") for n in (-1, 1.5, 2**32)),
    ("cases: {mu: [60]}\nbody: {b: [1, 2]}\n", 2, "body.b", "cannot be an axis together with cases"),
    (mu("{normal: [5, 9]}") + "samples: 32\n", 3, "friction.mu", "must be a finite number >= 0 and < 1e+12, but 9 of 32 samples"),
    (drawn("{normal: [0.05, -0.01]}"), 4, "start.n0.normal[1]", "must be the standard deviation, a finite"),
    (drawn("{normla: [0.05, 0.01]}"), 4, "start.n0.normla", "unknown key (did you mean normal?); give start, stop, num, spacing of a range, or a distribution: normal, lognormal or uniform"),
    (drawn("{uniform: [0.02, 0]}"), 4, "start.n0.uniform[1]", "must be the highest value, a finite number > 0.02"),
    (drawn("{normal: [0.05, 0.01], num: 3}"), 4, "start.n0", "a distribution together with other keys"),
    (drawn("0.05"), 6, "samples", "needs a parameter that is a distribution"),
    ("cases: {mu: [60]}\nstart: {n0: {normal: [0.05, 0.01]}}\n", 2, "start.n0", "cannot be a distribution together with cases"),
    # Beyond the paper: bodies, friction, starts and units.
    (stone(("1.7e-3", "1.9e-3")), 4, "body", "none of the principal ones may exceed the sum"),
    (stone(("Ixy: -2.0e-5", "Ixy: 6.0e-4")), 4, "body", "not positive definite"),
    (stone((" mass: 1.0,", "")), 4, "body.mass", "missing"),
    (stone(("offset: 0.01", "offset: 0.03")), 4, "body", "centre of mass outside the ellipsoid; keep |offset| < c (at a=0.2"),
    (stone(("b: 0.03", "b: [0.01, 0.012]"), ("offset: 0.01", "offset: 0.002")), 4, "body", "offset > c - b²/c (at a=0.2, b=0.01"),
    (stone(("offset", "delta: 0.03, offset")), 4, "body.delta", "cannot be combined with Ixx, Ixy, Iyy, Izz; leave out either"),
    (stone(("units: SI\ngravity: 9.81\n", "")), 2, "body.mass", "is 1 in the paper's units; leave it out, or set units: SI"),
    (stone(("units: SI", "units: paper"), (" mass: 1.0,", "")), 3, "gravity", "is 1 in the paper's units"),
    (stone(("coulomb", "coulumb")), 5, "friction.law", "did you mean coulomb?"),
    (stone(("law: coulomb, ", "law: viscous, ")), 5, "friction.speed", "does not belong to the law viscous"),
    (stone((" mu: 0.5,", "")), 5, "friction.mu", "missing"),
    (stone(("slip1: 0,", "n0: 1,")), 6, "start.n0", "with omega1, omega2, omega3, pitch, roll, slip2; give either n0, x0, y0 or angles"),
    (stone(("roll: 0.5 deg", "roll: 91 deg")), 6, "start.roll", "< 1.5708, not 1.588"),
    (stone(("{a: 0.2", "{surface: paraboloid, delta: 0, a: 0.01"), (MOMENTS, "")), 4, "body.delta", "has no meaning with surface: paraboloid; give the elements of inertia instead"),
    (stone(BOWL, ("offset: 0.01", "offset: 0.02")), 4, "body", "centre of mass outside the paraboloid; keep offset < c (at a=0.01"),
    (stone(("model: slip", "model: averaged"), ("{a:", "{surface: paraboloid, a:")), 1, "model", "units: SI, surface: paraboloid; choose slip or noslip"),
    (stone(("t_end: 5", "t_end: 5, method: adams")), 7, "integrator.method", "model; choose dopri5"),
    # What is nearly a value with a unit.
    (small("[0.02, 0.05]", "[0.02, 3 rpm]"), 4, "start.n0", "is in sqrt(g/c) here; give the number without rpm"),
    (stone(("mu: 0.5", "mu: 0.5 s/m")), 5, "friction.mu", "is a pure number here; leave out s/m"),
    (stone(("law: coulomb", "law: stribeck, mu_static: 0.4 m")), 5, "friction.mu_static", "not '0.4 m'"),
    (stone(("c: 0.02", "c: 20 g")), 4, "body.c", "not '20 g'; its unit must be m, cm, mm, in or ft"),
    (stone(("c: 0.02", "c: 20+-1 mm")), 4, "body.c", "not '20+-1 mm'; write an error as {normal: [value, error]}"),
    (stone(("c: 0.02", "c: '1,250 mm'")), 4, "body.c", "not '1,250 mm'; write 1.250 mm or 1250 mm"),
    (stone(("c: 0.02", "c: 2,5cm")), 4, "body.c", "a comma ends a value in braces; write 2.5cm for one"),
    (stone(("c: 0.02", "c: [2,5cm, 3cm]")), 4, "body.c", "a comma ends an item of a list; write 2.5cm"),
    (mu("1,5").replace("{mu: 1,5}", "\n  mu: 1,5"), 4, "friction.mu", "not '1,5'; write 1.5 or [1, 5]"),
    (mu("'60'"), 3, "friction.mu", "not '60'; leave out the quotes"),
    (mu("'20 to 60'"), 3, "friction.mu", "not '20 to 60'; a range is written {start: 20, stop: 60, num: 41}"),
    (stone(("c: 0.02", "c: 20cm..30 cm")), 4, "body.c", "; a range is written {start: 20cm, stop: 30 cm, num: 41}, with the number"),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(BROKEN)), ids=lambda i: f"{i} {BROKEN[i][2]} {BROKEN[i][3][:20]}")
def test_a_broken_configuration_is_refused_with_its_place(number: int, write: Write, tmp_path: Path) -> None:
    text, line, path, said = BROKEN[number]
    file = write(text)
    result = invoke("run", file, "--output", tmp_path / "out")
    assert (result.exit_code, result.stdout) == (2, "")
    message, *_ = result.stderr.splitlines()
    assert message.startswith(f"{file}:{line}:")
    assert said in message
    assert f": {path}: " in message if path else message.count(": ") >= 1
    assert sorted(tmp_path.iterdir()) == [file]


def test_all_faults_are_reported_at_once_in_the_order_of_lines(write: Write) -> None:
    text = "colour: red\nintegrator: {t_end: -1}\nstart: {n0: x}\nmeasure: [spin]\nfriction: {nu: 3}\nbody: {a: 0}\n"
    with pytest.raises(InputError) as error:
        load_config(write(text))
    assert [fault.line for fault in error.value.faults] == [1, 2, 3, 4, 5, 6]
    assert [int(line.split(":")[1]) for line in str(error.value).splitlines()] == [1, 2, 3, 4, 5, 6]
    file = write(text + "".join(f"colour{i}: red\n" for i in range(50)))
    lines = invoke("run", file).stderr.splitlines()
    assert (len(lines), lines[-1]) == (21, f"{file}: 36 more faults")


def test_faults_of_settings_without_lines_are_reported_in_the_order_of_the_laws() -> None:
    """Not in that of a set of strings, which changes from process to process."""
    foreign = ["speed", "mu_static", "speed_stick", "mu_viscous", "radius_contact"]
    with pytest.raises(InputError) as error:
        load_config({"model": "slip", "friction": {"mu": 5, **dict.fromkeys(foreign, 1)}})
    assert [line.split(":")[0] for line in str(error.value).splitlines()] == [f"friction.{name}" for name in foreign]


def test_faults_reach_another_process() -> None:
    error = fault_of("wrong", "body", "a", file="small.yaml", line=3)
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.faults) == ("small.yaml:3: body.a: wrong", error.faults)


@pytest.mark.parametrize(
    ("bytes_", "said"),
    [(b"name: \xff\n", "not UTF-8"), (b"a: \x00\n", "not YAML"), (b"[{" * 9999, "nested too deeply")],
)
def test_bytes_that_are_not_yaml(bytes_: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_bytes(bytes_)
    refused(invoke("run", tmp_path / "config.yaml"), said)


@pytest.mark.parametrize(("name", "said"), [("none.yaml", "no such file"), (".", "cannot be read: Is a directory")])
def test_a_file_that_cannot_be_read(name: str, said: str, tmp_path: Path) -> None:
    assert invoke("run", tmp_path / name).stderr == f"{tmp_path / name}: {said}\n"


def test_an_address_is_not_a_file_in_python() -> None:
    for call in (sweep.load_config, sweep.open_dataset, sweep.plot, lambda at: sweep.run({}, at, mu=60)):
        with pytest.raises(InputError, match=f"^s3://here/x: {FAR}$"):
            call("s3://here/x")


FAR = "an address, where only files of this machine are read and written; copy it here"


@pytest.mark.parametrize("mark", [b"\x89HDF\r\n\x1a\n", b"CDF\x02"])
def test_a_dataset_is_not_a_configuration(mark: bytes, tmp_path: Path) -> None:
    (tmp_path / "x.nc").write_bytes(mark + bytes(100))
    said = "x.nc: a dataset, not text; its attribute `config` holds the configuration, and `sweep info` describes it"
    refused(invoke("run", tmp_path / "x.nc"), said)


def test_a_spreadsheet_is_not_a_table(write: Write, tmp_path: Path) -> None:
    (tmp_path / "cells.xlsx").write_bytes(b"PK\x03\x04\0")
    refused(invoke("run", write("cases: cells.xlsx\n")), "a spreadsheet or another archive, not text; save it as CSV")


CASES = "name: table\ncases: cells.csv\nstart: {x0: 0.01}\n"


@pytest.mark.parametrize(
    ("table", "place", "said"),
    [
        ("mu,mu\n60,1\n", "cells.csv:1:2: mu", "duplicate column"),
        ("\nmu,detla\n60,1\n", "cells.csv:2:2: detla", "unknown parameter (did you mean delta?)"),
        ("mu,b\n60,wide\n", "cells.csv:2:2: b", "must be a finite number > 0 and < 1e+06, not 'wide'"),
        ("mu\n", "cells.csv", "must have 1 to 1000000 rows under its first line, not 0"),
        ("", "cells.csv", "empty; its first line has to name the columns"),
        ("mu,x0\n60,0.01\n", "small.yaml:3:9: start.x0", "is also a column of cells.csv; remove one of the two"),
        ("mu,b\r60,wide\r", "cells.csv:2:2: b", "must be a finite number > 0 and < 1e+06, not 'wide'"),
        ('mu\n"60', "cells.csv", "not a readable CSV file"),
        ("a (kg),mu\n20,60\n", "cells.csv:1:1: a", "is in 'kg'; its unit must be m, cm, mm, in or ft"),
        ("a (cm),mu\n20,60\n", "small.yaml:2:1: cases.a", "is in c here; give the number without cm, or set units"),
        ("a,mu\n1,5,60\n", "cells.csv:2", "3 values, but 2 columns in line 1, with commas between them; use semicol"),
        ("a;mu\n15\n", "cells.csv:2", "1 value, but 2 columns in line 1, with semicolons between them"),
    ],
)
def test_a_broken_table_of_cases_is_refused_with_its_place(
    table: str, place: str, said: str, write: Write, tmp_path: Path
) -> None:
    (tmp_path / "cells.csv").write_text(table, encoding="utf-8")
    result = invoke("run", write(CASES))
    refused(result, said)
    assert result.stderr.startswith(f"{tmp_path}/{place}: ")

"""What a configuration may say, and what is said of one that may not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import assume, given
from hypothesis import strategies as st
from support import ROOT, SMALL

from sweep import ConfigError, load_config
from sweep.cli import main
from sweep.config.values import Range
from sweep.grid import Grid

Write = Callable[..., Path]


def change(old: str, new: str) -> str:
    assert old in SMALL
    return SMALL.replace(old, new)


# ruff: noqa: E501  (a table)
# name: (configuration, line of the fault, path, part of what is said)
BROKEN: dict[str, tuple[str, int, str, str]] = {
    "unknown key": (SMALL + "colour: 3\n", 6, "colour", "unknown key; allowed: name, model,"),
    "unknown key in a section": (change("delta:", "dleta:"), 2, "body.dleta", "unknown key (did you mean delta?); allowed: surface, a, b, c, delta"),
    "duplicate key": (SMALL + "name: again\n", 6, "name", "duplicate key, first on line 1"),
    "duplicate key in a section": (change("mu: [40, 60]", "mu: 40, mu: 60"), 3, "friction.mu", "first on line 3"),
    "empty axis": (change("[40, 60]", "[]"), 3, "friction.mu", "an empty axis"),
    "not a number": (change("[40, 60]", ".nan"), 3, "friction.mu", "allowed: a finite number >= 0"),
    "infinite": (change("[40, 60]", "[40, .inf]"), 3, "friction.mu[1]", "allowed: a finite number >= 0"),
    "a word for a number": (change("10.0", "ten"), 2, "body.a", "'ten' is not a number"),
    "yes for a number": (change("10.0", "true"), 2, "body.a", "true is not a number"),
    "nothing for a number": (change("a: 10.0", "a: "), 2, "body.a", "nothing is not a number"),
    "no size": (change("a: 10.0", "a: 0"), 2, "body.a", "allowed: a finite number > 0"),
    "negative friction": (change("40", "-40"), 3, "friction.mu[0]", ">= 0"),
    "range without stop": (change("[40, 60]", "{start: 1, num: 3}"), 3, "friction.mu.stop", "missing; allowed: a finite number"),
    "empty range": (change("[40, 60]", "{start: 1, stop: 2, num: 0}"), 3, "friction.mu.num", "0; allowed: a whole number >= 1 and <= 1000000"),
    "unknown spacing": (change("[40, 60]", "{start: 1, stop: 2, num: 2, spacing: cubic}"), 3, "friction.mu.spacing", "'cubic'; allowed: linear, log"),
    "log range over zero": (change("[0.02, 0.05]", "{start: -1, stop: 1, num: 3, spacing: log}"), 4, "start.n0.spacing", "one sign"),
    "range out of bounds": (change("[40, 60]", "{start: -5, stop: 5, num: 3}"), 3, "friction.mu", "-5 is out of bounds"),
    "equal values": (change("[40, 60]", "[40, 40.0]"), 3, "friction.mu", "distinct"),
    "no friction given": (change("friction: {mu: [40, 60]}\n", ""), 1, "friction.mu", "missing; allowed: a finite number >= 0"),
    "off the ellipsoid": (change("x0: 0.01", "x0: 11"), 4, "start.x0", "start point off the ellipsoid"),
    "unknown model": (SMALL + "model: slippery\n", 6, "model", "'slippery' (did you mean slip?); allowed: slip, noslip"),
    "unknown method": (change("{method: dopri5, t_end: 1500}", "{method: euler}"), 5, "integrator.method", "'euler'; allowed: dopri5"),
    "no step": (change("{method: dopri5, t_end: 1500}", "{step: 0}"), 5, "integrator.step", "allowed: auto, or a finite number > 0"),
    "no time": (change("1500", "-1"), 5, "integrator.t_end", "-1; allowed: a number > 0 and <= 1e+12, or .inf"),
    "endless": (change("1500", "1e308"), 5, "integrator.t_end", "1e+308; allowed: a number > 0 and <= 1e+12"),
    "finer than numbers": (change("{method: dopri5, t_end: 1500}", "{tolerance: 5e-324}"), 5, "integrator.tolerance", "5e-324; allowed: a finite number >= 1e-14 and < 1"),
    "not a yes or no": (change("{method: dopri5, t_end: 1500}", "{stop_when_settled: no}"), 5, "integrator.stop_when_settled", "'no'; allowed: true or false"),
    "unknown measure": (SMALL + "measure: [colour]\n", 6, "measure[0]", "allowed: reversals, energy_error"),
    "measure twice": (SMALL + "measure: [reversals, reversals]\n", 6, "measure", "each once"),
    "impossible share": (SMALL + "max_failed_fraction: 2\n", 6, "max_failed_fraction", "2; allowed: a finite number >= 0 and <= 1"),
    "a name that leaves the folder": (change("name: small", "name: ../small"), 1, "name", "'../small'; allowed: up to 100 of A-Z"),
    "a section that is none": (change("{mu: [40, 60]}", "40"), 3, "friction", "40; allowed: a section with law, regularisation, mu"),
    "no such table": (SMALL + "cases: nowhere.csv\n", 6, "cases", "no such file"),
    "broken YAML": (change("[40, 60]", "[40, 60"), 3, "", "not YAML"),
    "a tag": (change("10.0", "!!python/name:os.system 1"), 2, "body.a", "a YAML tag or anchor; allowed: plain values"),
    "a tag of one's own": (change("10.0", "!ten 10.0"), 2, "body.a", "a YAML tag or anchor"),
    "a tagged section": (change("body: {", "body: !!set {"), 2, "body", "a YAML tag or anchor"),
    "an anchor": (change("10.0", "&a 10.0"), 2, "body.a", "a YAML tag or anchor"),
    "an endless alias": (change("[40, 60]", "&a [*a]"), 3, "friction.mu", "a YAML tag or anchor"),
    "a list of things": ("- 1\n- 2\n", 1, "", "a configuration is a mapping"),
    "nothing at all": ("", 1, "", "a configuration is a mapping"),
    "two documents": (SMALL + "---\nname: b\n", 6, "", "not YAML"),
}  # fmt: skip


@pytest.mark.parametrize("kind", BROKEN)
def test_broken_configuration(kind: str, write: Write, tmp_path: Path) -> None:
    text, line, path, said = BROKEN[kind]
    file = write(text)
    output = tmp_path / "out"
    result = CliRunner().invoke(main, ["run", str(file), "--output", str(output)])
    assert result.exit_code == 2
    assert result.stdout == ""
    (message,) = result.stderr.splitlines()
    assert message.startswith(f"{file}:{line}:")
    assert said in message
    assert f": {path}: " in message if path else message.count(": ") >= 1
    assert not output.exists()
    assert sorted(tmp_path.iterdir()) == [file]


def test_all_faults_are_reported_at_once(write: Write) -> None:
    text = SMALL.replace("10.0", "-1").replace("1500", "-1").replace("[40, 60]", "[]")
    with pytest.raises(ConfigError) as error:
        load_config(write(text))
    assert {fault.line for fault in error.value.faults} == {2, 3, 5}


@pytest.mark.parametrize(
    ("bytes_", "said"), [(b"name: \xff\n", "not UTF-8"), (b"a: \x00\n", "not YAML"), (b"[" * 1000, "nested too deeply")]
)
def test_bytes_that_are_not_yaml(bytes_: bytes, said: str, tmp_path: Path) -> None:
    file = tmp_path / "config.yaml"
    file.write_bytes(bytes_)
    result = CliRunner().invoke(main, ["run", str(file)])
    assert result.exit_code == 2
    assert said in result.stderr


def test_missing_file(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["run", str(tmp_path / "none.yaml")])
    assert (result.exit_code, result.stderr) == (2, f"{tmp_path / 'none.yaml'}: no such file\n")


@pytest.mark.parametrize(
    ("setting", "said"),
    [("friction.mu=-1", "--set friction.mu: -1 is out of bounds"), ("mu", "allowed: PATH=VALUE"),
     ("friction.nu=3", "allowed: law, regularisation, mu"), ("friction.mu=[", "not YAML"), ("name.first=3", "not a section")],
)  # fmt: skip
def test_broken_setting(setting: str, said: str, write: Write) -> None:
    result = CliRunner().invoke(main, ["run", str(write()), "--set", setting])
    assert result.exit_code == 2
    assert said in result.stderr


def test_settings_replace_the_files_values(write: Write) -> None:
    config = load_config(write(), {"friction.mu": 7.5, "integrator.step": 0.01, "n0": [0.1, 0.2]})
    assert config.parameters["mu"].numbers == (7.5,)
    assert config.integrator.step == 0.01
    assert list(config.axes) == ["b", "n0"]


def test_axes_are_mu_b_n0_then_as_written(write: Write) -> None:
    text = (
        SMALL.replace("delta: 0.03", "delta: [0.02, 0.03]").replace("10.0", "[9, 10]").replace("x0: 0.01", "x0: [0, 1]")
    )
    assert list(load_config(write(text)).axes) == ["mu", "b", "n0", "a", "delta", "x0"]


def test_ranges(write: Write) -> None:
    config = load_config(
        write(), {"mu": {"start": 1, "stop": 100, "num": 3, "spacing": "log"}, "b": {"start": 2, "stop": 3, "num": 3}}
    )
    np.testing.assert_allclose(config.parameters["mu"].numbers, [1, 10, 100])
    assert config.parameters["b"].numbers == (2.0, 2.5, 3.0)


def test_yaml_numbers_mean_what_they_look_like(write: Write) -> None:
    config = load_config(write(SMALL.replace("[40, 60]", "[1e1, 2.5E1, +3., 012]").replace("x0: 0.01", "x0: -1e-3")))
    assert config.parameters["mu"].numbers == (10.0, 25.0, 3.0, 12.0)
    assert config.parameters["x0"].numbers == (-0.001,)


def test_defaults_are_the_papers_standard_case(write: Write) -> None:
    config = load_config(write("friction: {mu: 60}\n", "plain.yaml"))
    assert config.name == "plain"
    assert {name: v.numbers for name, v in config.parameters.items()} == {
        "mu": (60.0,), "b": (3.0,), "n0": (0.05,), "a": (10.0,), "c": (1.0,), "delta": (0.03,), "x0": (0.01,), "y0": (0.01,),
    }  # fmt: skip
    assert config.integrator.t_end == 30_000
    assert config.measure == ("reversals", "energy_error", "noise_limited", "resting_spin")


def test_resolved_configuration_is_a_configuration(write: Write) -> None:
    config = load_config(write())
    again = load_config(write(config.to_yaml(), "again.yaml"))
    assert again == config
    assert again.fingerprint() == config.fingerprint()


def test_fingerprint_sees_what_decides_the_numbers(write: Write) -> None:
    first = load_config(write()).fingerprint()
    for same in ({"name": "other"}, {"max_failed_fraction": 0.5}, {"delta": 0.03}):
        assert load_config(write(), same).fingerprint() == first
    for other in ({"mu": [40, 61]}, {"t_end": 1501}, {"step": 0.01}, {"measure": ["reversals"]}, {"y0": 0.02}):
        assert load_config(write(), other).fingerprint() != first


@pytest.mark.parametrize("path", sorted((ROOT / "configs").glob("*.yaml")), ids=lambda p: p.stem)
def test_the_configurations_we_ship_load(path: Path) -> None:
    assert Grid.of(load_config(path)).size > 1


CASES = "name: table\ncases: cells.csv\nstart: {x0: 0.01}\n"


def test_cases(write: Write, tmp_path: Path) -> None:
    (tmp_path / "cells.csv").write_text("mu, b,n0\n60,3,0.05\n1e2,2.5,-0.02\n\n", encoding="utf-8")
    config = load_config(write(CASES))
    grid = Grid.of(config)
    assert (grid.dims, grid.shape) == (("case",), (2,))
    columns = grid.columns()
    assert (list(columns["mu"]), list(columns["n0"]), list(columns["a"])) == ([60, 100], [0.05, -0.02], [10, 10])


@pytest.mark.parametrize(
    ("table", "place", "said"),
    [
        ("mu,colour\n60,1\n", "cells.csv:1:2: colour", "unknown parameter; allowed: a, b,"),
        ("mu,mu\n60,1\n", "cells.csv:1:2: mu", "a column twice"),
        ("mu,b\n60\n", "cells.csv:2", "1 values; allowed: 2"),
        ("mu,b\n60,wide\n", "cells.csv:2:2: b", "'wide'; allowed: a finite number > 0"),
        ("mu\n60\n-1\n", "cells.csv:3:1: mu", ">= 0"),
        ("mu\ninf\n", "cells.csv:2:1: mu", "'inf'"),
        ("mu\n", "cells.csv", "no cases"),
        ("", "cells.csv", "empty"),
        ("mu,x0\n60,0.01\n", "small.yaml:3:9: start.x0", "also a column"),
        ('mu\n"60', "small.yaml:2:8: cases", "not a readable CSV"),
        ("b\n2\n", "small.yaml:1:1: friction.mu", "missing"),
    ],
)
def test_broken_cases(table: str, place: str, said: str, write: Write, tmp_path: Path) -> None:
    (tmp_path / "cells.csv").write_text(table, encoding="utf-8")
    result = CliRunner().invoke(main, ["run", str(write(CASES))])
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{tmp_path}/{place}: ")
    assert said in result.stderr


def test_an_axis_beside_cases_is_refused(write: Write, tmp_path: Path) -> None:
    (tmp_path / "cells.csv").write_text("mu\n60\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"small\.yaml:4:11: body\.b: an axis with cases"):
        load_config(write(CASES + "body: {b: [1, 2]}\n"))


@given(
    start=st.floats(-1e6, 1e6),
    stop=st.floats(-1e6, 1e6),
    num=st.integers(2, 50),
    finer=st.integers(1, 12),
    spacing=st.sampled_from(["linear", "log"]),
)
def test_a_finer_range_has_the_values_of_a_coarser_one(
    start: float, stop: float, num: int, finer: int, spacing: str
) -> None:
    assume(spacing == "linear" or start * stop > 0)
    coarse, fine = (
        Range(start=start, stop=stop, num=n, spacing=spacing).values() for n in (num, finer * (num - 1) + 1)
    )
    assert coarse == fine[::finer]
    assert (coarse[0], coarse[-1]) == (start, stop)
    spaced = np.linspace if spacing == "linear" else np.geomspace
    np.testing.assert_allclose(coarse, spaced(start, stop, num), rtol=1e-11, atol=1e-9 if spacing == "linear" else 0)


@pytest.mark.parametrize("model", ["effective", "averaged"])
def test_models_of_strong_friction_need_some(model: str, write: Write) -> None:
    """Their slip is a term of order 1/μ."""
    text = f"model: {model}\nfriction: {{mu: [0, 60]}}\n"
    with pytest.raises(ConfigError, match=rf"2:16: friction\.mu: 0; allowed with the {model} model: a number > 0"):
        load_config(write(text))
    (write(text).parent / "cells.csv").write_text("mu\n60\n0\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="column mu: 0; allowed"):
        load_config(write(f"model: {model}\ncases: cells.csv\n"))
    assert load_config(write(text.replace(model, "slip"))).axes["mu"] == (0.0, 60.0)

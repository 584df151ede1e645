"""Values with units: one grammar wherever a number stands, converted to SI, and what is nearly one of them."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from support import Write
from support.cli import invoke
from support.physics import STONE, stone

import sweep
from sweep import load_config
from sweep.config.document import parse_value


def test_a_body_in_any_units_is_the_one_in_those_of_si(write: Write) -> None:
    text = stone(
        ("a: 0.2, b: 0.03, c: 0.02, offset: 0.01", "a: 20 cm, b: '30,0mm', c: .02m, offset: 10 mm"),
        ("mass: 1.0", "mass: 1000 g"), ("Ixx: 2.0e-4", "Ixx: 2.0e3 g cm2"), ("Iyy: 1.6e-3", "Iyy: 1.6e-3 kg·m²"),
        ("gravity: 9.81", "gravity: 981 cm/s^2"), ("speed: 1.0e-3", "speed: 1 mm/s"), ("t_end: 5", "t_end: 5000 ms"),
        ("sigma: 1.0e-4", "sigma: 1.0e-4 N m s"), ("omega3: -5", "omega3: −5 rad/s"), ("0.5 deg", "0,5deg"),
    )  # fmt: skip
    found, expected = load_config(write(text.replace("0,5deg, ", "'0,5deg', "))), load_config(write(STONE))
    assert set(found.parameters) == set(expected.parameters)
    for name, value in expected.parameters.items():
        assert found.parameters[name].numbers == pytest.approx(value.numbers, rel=1e-14), name
    assert found.integrator == expected.integrator
    assert load_config(write(found.to_yaml(), "again.yaml")) == found


VALUES: Mapping[str, tuple[float, ...]] = {
    "30 mm": (0.03,),
    "30,0mm": (0.03,),
    "[30mm, 4.5 cm, 0.05]": (0.03, 0.045, 0.05),
    "{start: 3cm, stop: 50 mm, num: 3}": (0.03, 0.04, 0.05),
    "3cm..50 mm:3": (0.03, 0.04, 0.05),
    "1.5in": (0.0381,),
    "{normal: [30 mm, 1 mm]}": (0.03,),
    "{lognormal: [3 cm, 0.1]}": (0.03,),
}


@pytest.mark.parametrize("text", VALUES)
def test_lists_ranges_and_distributions_have_units_too(text: str, write: Write) -> None:
    found = load_config(write(STONE), {"b": parse_value(text, "--set b")}).parameters["b"]
    assert found.numbers == pytest.approx(VALUES[text], rel=1e-14)
    if found.distribution:
        assert found.distribution.second == {"normal": 0.001, "lognormal": 0.1}[found.distribution.family]


def test_the_command_line_takes_them_too(write: Write, tmp_path: Path) -> None:
    line = ["trajectory", write(STONE), "--set", "t_end=0.1", "--output", tmp_path, "--quiet"]
    assert invoke(*line, "--at", "c=2 cm", "--at", "c=25mm").exit_code == 0
    (file,) = tmp_path.glob("*_trajectory.nc")
    assert sweep.open_dataset(file)["c"].values == pytest.approx([0.02, 0.025])


@pytest.mark.parametrize(
    "table",
    [
        "a (cm),omega3\n20,-5\n10,5\n",
        "a;omega3\ncm;rad/s\n20,0;−5\n10,0;5\n",
        "a\tomega3\n20 cm\t-5\n100 mm\t5 rad/s\n",
    ],
)
def test_tables_of_cases_have_units_and_any_separator(table: str, write: Write, tmp_path: Path) -> None:
    (tmp_path / "cells.csv").write_text(table, encoding="utf-8")
    text = stone(("a: 0.2, ", ""), (" omega3: -5,", ""))
    config = load_config(write(text + "cases: cells.csv\n"))
    assert config.cases == {"a": pytest.approx((0.2, 0.1)), "omega3": (-5.0, 5.0)}
    assert load_config(config, {"t_end": 4}).cases == config.cases

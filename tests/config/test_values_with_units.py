"""Values with units: one grammar wherever a number stands, converted to SI, and what is nearly one of them."""

from collections.abc import Mapping
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pint
import pytest
import xarray as xr
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
    assert load_config(write(found.label(), "again.yaml")) == found


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


class Quantity:
    """A quantity as Astropy has it."""

    def __init__(self, value: object, unit: str) -> None:
        self.value, self.unit = value, unit

    def __array__(self, *_: object) -> np.ndarray:
        return np.asarray(self.value)


PINT = pint.UnitRegistry()

GIVEN: dict[str, tuple[str, Any, list[float]]] = {
    "pint": ("b", PINT.Quantity(3, "cm"), [0.03]),
    "pint, an axis": ("b", PINT.Quantity(np.array([30.0, 40.0]), "mm"), [0.03, 0.04]),
    "pint, a list": ("b", [PINT.Quantity(3, "cm"), PINT.Quantity(0.04, "m")], [0.03, 0.04]),
    "pint, a range": ("b", {"start": PINT.Quantity(3, "cm"), "stop": 0.04, "num": 2}, [0.03, 0.04]),
    "pint, a product": ("Izz", PINT.Quantity(1.75, "g * m**2"), [1.75e-3]),
    "pint, a quotient": ("omega3", PINT.Quantity(-180, "degree / second"), [-np.pi]),
    "pint, turns": ("omega3", PINT.Quantity(30, "rpm"), [np.pi]),
    "astropy": ("b", Quantity(3.0, "cm"), [0.03]),
    "astropy, an axis": ("Ixx", Quantity(np.array([2.0, 2.1]), "kg cm2"), [2e-4, 2.1e-4]),
    "astropy, a quotient": ("omega3", Quantity(180.0, "deg / s"), [np.pi]),
    "DataArray": ("b", xr.DataArray([30, 40], attrs={"units": "mm"}), [0.03, 0.04]),
    "DataArray of SI": ("omega3", xr.DataArray(-5.0, attrs={"units": "radian s-1"}), [-5.0]),
    "DataArray of quantities": ("b", xr.DataArray(PINT.Quantity(np.array([30.0]), "mm")), [0.03]),
    "Series": ("b", pd.Series([0.03, 0.04]), [0.03, 0.04]),
    "no unit": ("offset", xr.DataArray(0.01, attrs={"units": "1"}), [0.01]),
    "masked, nothing hidden": ("b", np.ma.masked_invalid([0.03, 0.04]), [0.03, 0.04]),
}


@pytest.mark.parametrize("kind", GIVEN)
def test_python_values_keep_their_units(kind: str, write: Write) -> None:
    name, value, expected = GIVEN[kind]
    assert load_config(write(STONE), {name: value}).parameters[name].numbers == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    "time", [timedelta(minutes=2), np.timedelta64(120_000, "ms"), pd.Timedelta(2, "min"), PINT.Quantity(2, "min")]
)
def test_python_times_keep_their_units(time: object, write: Write) -> None:
    assert load_config(write(STONE), {"t_end": time}).integrator.t_end == 120.0


def test_columns_of_cases_keep_their_units(write: Write) -> None:
    columns = {"a": PINT.Quantity([20.0, 10.0], "cm"), "omega3": [-5, Quantity(5, "rad / s")]}
    config = load_config(write(stone(("a: 0.2, ", ""), (" omega3: -5,", ""))), {"cases": columns})
    assert config.cases == {"a": pytest.approx((0.2, 0.1)), "omega3": (-5.0, 5.0)}


def test_a_variable_of_a_dataset_has_the_units_of_its_configuration(write: Write) -> None:
    """Also the paper's, which are refused in SI."""
    lengths = sweep.predict({"friction": {"mu": 60}, "body": {"b": [2, 3]}}).b
    assert lengths.attrs["units"] == "c"
    assert load_config({"friction": {"mu": 60}}, {"b": lengths}).axes["b"] == (2.0, 3.0)
    with pytest.raises(sweep.InputError, match=r"^b: is in m here, not in c$"):
        load_config(write(STONE), {"b": lengths})


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("b", PINT.Quantity(3, "s"), "must be a finite number > 0 and < 1e+06, not '3 s'; its unit must be m, cm"),
        ("b", PINT.Quantity(3, "furlong"), "its unit must be m, cm, mm, in or ft"),
        ("b", xr.DataArray([0.03], attrs={"units": "K"}), "[0]: must be a finite number > 0 and < 1e+06, not '0.03 K'"),
        ("b", np.array(["2001-01-01"], "M8[ns]"), "not '2001-01-01T00:00:00.000000000'"),
        ("b", np.ma.masked_greater([0.03, 0.04], 0.035), "b[1]: must be a finite number > 0 and < 1e+06, not nothing"),
        ("mu", PINT.Quantity(0.5, "m"), "must be a finite number >= 0"),
        ("t_end", PINT.Quantity(5, "m"), "must be settled or a number >= 1e-06"),
    ],
)
def test_python_values_in_other_units_are_refused(name: str, value: object, said: str, write: Write) -> None:
    with pytest.raises(sweep.InputError) as refusal:
        load_config(write(STONE), {name: value})
    assert said in str(refusal.value)

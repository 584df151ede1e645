"""Units and what variables are called: dimensions and factors as Pint has them, and long names that fit at an axis."""

import re
from typing import Any

import pint
import pytest

from sweep import units
from sweep.parameters import PARAMETERS, Parameter
from sweep.results.dataset import SERIES, VARIABLES
from sweep.results.margins import POINTS
from sweep.results.probabilities import PROBABILITIES
from sweep.studies import trajectory
from sweep.units import PAPER_UNITS, SI, WRITTEN, Unit, factor, named, pretty, quantity
from sweep.variables import Variable

PINT: pint.UnitRegistry[float] = pint.UnitRegistry()
UNITS = {name: unit for name, unit in vars(units).items() if isinstance(unit, Unit)}

RECORDS: dict[str, Parameter | Variable] = {
    **PARAMETERS, **VARIABLES, **PROBABILITIES, **POINTS,
    **{name: Variable("float64", *each) for name, each in trajectory.SERIES.items()},
    **SERIES,
}  # fmt: skip


def as_pint(text: str, **known: Any) -> Any:
    """A product of powers such as "m c sqrt(g c)", of quantities of Pint or of those `known` by another name."""
    spelled = re.sub(r"([a-z])(-?[1-9])", r"\1**\2", text).replace(" ", "*")
    names = {name: PINT.Quantity(1.0, name) for name in ("kg", "m", "s", "radian")} | known
    return PINT.Quantity(1.0) * (eval(spelled, {"sqrt": lambda square: square**0.5, **names}) if text else 1)


@pytest.mark.parametrize("name", UNITS)
def test_a_unit_has_its_dimension_in_both_systems(name: str) -> None:
    unit = UNITS[name]
    powers = {"[length]": unit.length, "[time]": unit.time, "[mass]": unit.mass}
    wanted = {dimension: power for dimension, power in powers.items() if power}
    si = as_pint(named(unit, SI))
    assert dict(si.dimensionality) == wanted
    assert si.to_base_units().magnitude == 1
    assert unit.angle == named(unit, SI).count("radian")
    c, m, g = PINT.Quantity(0.02, "m"), PINT.Quantity(0.1, "kg"), PINT.Quantity(9.8, "m/s**2")
    paper = as_pint(named(unit, PAPER_UNITS), c=c, m=m, g=g)
    assert {dimension: power for dimension, power in paper.dimensionality.items() if power} == wanted
    scale = 0.02**unit.length * (0.02 / 9.8) ** (unit.time / 2) * 0.1**unit.mass
    assert paper.to_base_units().magnitude == pytest.approx(scale, rel=1e-12)


@pytest.mark.parametrize("unit", WRITTEN, ids=lambda unit: unit.si)
def test_units_that_users_write_are_as_large_as_for_pint(unit: Unit) -> None:
    for written in WRITTEN[unit]:
        size = PINT.Quantity(1.0, re.sub(r"([a-z])([23])", r"\1**\2", written)).to_base_units()
        assert size.dimensionality == as_pint(unit.si).dimensionality
        assert factor(written, unit) == pytest.approx(size.magnitude, rel=1e-15)


def test_a_quantity_is_a_number_with_its_error_and_its_unit() -> None:
    assert quantity(" 12.0+-0.1 cm", units.LENGTH) == (0.12, 0.001)
    assert quantity("1e3mm", units.LENGTH) == (1.0, 0.0)
    assert quantity("1.24±.02 g/cm³", units.MASS_DENSITY) == quantity("1.24+/-0.02g/cm^3", units.MASS_DENSITY)
    assert quantity("12,5cm", units.LENGTH) == quantity("12.5 cm", units.LENGTH)
    assert quantity("−0,5±0,25 cm", units.LENGTH) == pytest.approx((-0.005, 0.0025), rel=1e-15)
    assert quantity("2 kg·m²", units.INERTIA) == quantity("2 kg*m^2", units.INERTIA) == (2.0, 0.0)
    for size in range(999):
        assert quantity(f"{size} mm", units.LENGTH) == (float(f"{size}e-3"), 0.0)
    assert quantity("7 cm**3*cm**-2", units.LENGTH) == (0.07, 0.0)
    wrong = ("1,250 cm", "1,5,2 cm", "12, cm", "12", "cm", "12 c", "12 g", "1.2.3cm", "12 cm cm", "nan cm", "12+-cm")
    assert [text for text in wrong if quantity(text, units.LENGTH)] == []


PRINTED = {
    "kg m2 s-1": "kg m²/s", "radian s-1": "rad/s", "s m-1": "s/m", "m s-2": "m/s²", "s-1": "1/s", "m/s": "m/s", "": "",
    "W m-2 K-1": "W/(m² K)", "sqrt(g/c)": "√(g/c)", "m c2": "m c²", "m c sqrt(g c)": "m c √(g c)",
}  # fmt: skip


@pytest.mark.parametrize("name", PARAMETERS)
def test_every_parameter_with_a_unit_can_be_written_in_it(name: str) -> None:
    unit = PARAMETERS[name].units
    assert isinstance(unit, Unit)
    assert (1.0 in WRITTEN.get(unit, {}).values()) == (unit != units.NUMBER)


def test_figures_print_units_as_fractions_and_roots() -> None:
    assert {each: pretty(each) for each in PRINTED} == PRINTED


def test_a_users_own_unit_is_the_same_in_every_system() -> None:
    assert {named("sqrt(g/R)", system) for system in (PAPER_UNITS, SI, "own")} == {"sqrt(g/R)"}
    assert (named("1", SI), named(units.SPIN, "own"), named(units.ANGLE, "own")) == ("", "", "radian")


@pytest.mark.parametrize("name", RECORDS)
def test_names_fit_at_an_axis_and_descriptions_are_sentences(name: str) -> None:
    record = RECORDS[name]
    assert 0 < len(record.long_name) <= 45
    assert ", in " not in record.long_name
    assert not record.long_name.endswith(".")
    assert not record.description or (record.description[0].isupper() and record.description[-1] == ".")

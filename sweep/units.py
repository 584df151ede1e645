"""Defines units: the powers of a quantity, their names in the paper's units and in SI, and what users may write."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import astuple, dataclass
from decimal import Decimal
from math import isfinite, nan, pi

PAPER_UNITS, SI = "paper", "SI"
"""Systems of units: lengths in c, times in sqrt(c/g) and mass one, or SI."""


@dataclass(frozen=True)
class Unit:
    """Powers of length, time, mass and angle; forces and energies of a moving body are per unit mass."""

    length: int = 0
    time: int = 0
    mass: int = 0
    angle: int = 0

    @property
    def si(self) -> str:
        """Return the CF unit in SI, such as "kg m2 s-1"; empty for a plain number."""
        powers = {"kg": self.mass, "radian": self.angle, "m": self.length, "s": self.time}
        return _product(dict(sorted(powers.items(), key=lambda each: each[1] < 0)))

    @property
    def paper(self) -> str:
        """Return the unit in the paper's c, g and m, such as "sqrt(g/c)"; "" for a plain number, "radian" for an
        angle."""
        if self == ANGLE:
            return self.si
        g, c = -self.time, 2 * self.length + self.time  # twice the powers, since a time is sqrt(c/g)
        whole = _product({"m": self.mass, "g": int(g / 2), "c": int(c / 2)})
        return f"{whole} {_ROOTS[g - 2 * int(g / 2), c - 2 * int(c / 2)]}".strip()


_ROOTS = {(0, 0): "", (1, 1): "sqrt(g c)", (1, -1): "sqrt(g/c)", (-1, 1): "sqrt(c/g)", (-1, -1): "1/sqrt(g c)"}


def _product(powers: dict[str, int]) -> str:
    return " ".join(f"{base}{power if power != 1 else ''}" for base, power in powers.items() if power)


NUMBER, LENGTH, TIME, MASS, ANGLE = Unit(), Unit(length=1), Unit(time=1), Unit(mass=1), Unit(angle=1)
SPEED, SLOWNESS = Unit(length=1, time=-1), Unit(length=-1, time=1)
SPIN = Unit(time=-1, angle=1)
ACCELERATION, ENERGY_PER_MASS = Unit(length=1, time=-2), Unit(length=2, time=-2)
MASS_DENSITY, INERTIA, DRAG = Unit(mass=1, length=-3), Unit(mass=1, length=2), Unit(mass=1, length=2, time=-1)

_DEGREE = pi / 180
WRITTEN: dict[Unit, dict[str, float]] = {
    LENGTH: {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048},
    MASS: {"kg": 1.0, "g": 1e-3, "mg": 1e-6, "oz": 0.028349523125, "lb": 0.45359237},
    MASS_DENSITY: {"kg/m3": 1.0, "g/cm3": 1e3},
    INERTIA: {"kg m2": 1.0, "g cm2": 1e-7, "g mm2": 1e-9},
    ANGLE: {"rad": 1.0, "deg": _DEGREE, "°": _DEGREE},
    TIME: {"s": 1.0, "ms": 1e-3, "μs": 1e-6, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    SPIN: {"rad/s": 1.0, "1/s": 1.0, "deg/s": _DEGREE, "°/s": _DEGREE, "rpm": pi / 30},
    SPEED: {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3},
    SLOWNESS: {"s/m": 1.0, "s/cm": 1e2, "s/mm": 1e3},
    ACCELERATION: {"m/s2": 1.0, "cm/s2": 1e-2},
    DRAG: {"kg m2/s": 1.0, "N m s": 1.0, "g cm2/s": 1e-7},
}
"""Units that users may write, as multiples of SI units; products of them are understood as well."""

_FACTORS = {name: (scale, unit) for unit in (LENGTH, MASS, ANGLE, TIME) for name, scale in WRITTEN[unit].items()} | {
    "radian": (1.0, ANGLE), "dps": (_DEGREE, SPIN), "rpm": (pi / 30, SPIN), "N": (1.0, Unit(length=1, time=-2, mass=1)),
}  # fmt: skip
_FACTOR = r"(/?) ?([^\W\d_]+|°)(?: ?(-?\d+))?"

NUMERAL = r"[-+−]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+−]?[0-9]+)?"
"""Decimal digits, with a hyphen or a minus sign."""

# A comma before three digits may be a thousands separator.
_WITH_COMMA = r"(?![-+−]?[1-9][0-9]{0,2},[0-9]{3}(?![0-9]))[-+−]?[0-9]+,[0-9]+"
_QUANTITY = re.compile(rf"({_WITH_COMMA}|{NUMERAL}) *(?:(?:±|\+/?-) *({_WITH_COMMA}|{NUMERAL}))? *([^\d,.].*|1 */.*)")


def number(text: str) -> float | None:
    """Return the number that a text spells in decimal digits; None if it is not a number."""
    return float(text.replace("−", "-")) if re.fullmatch(NUMERAL, text) else None


def factor(written: str, unit: Unit | None) -> float | None:
    """Return the SI factor of a unit, such as 1000 for "g/cm3"; None if it is unknown or of another quantity.

    Any order and notation of a product will do, such as "cm**-3*g".
    """
    plain = re.sub(r"[ *·]+", " ", unicodedata.normalize("NFKC", written).replace("^", "")).strip()
    if plain in (known := WRITTEN.get(unit or NUMBER, {})):
        return known[plain]
    scale, powers = Decimal(1), [0, 0, 0, 0]
    for over, name, power in re.findall(_FACTOR, plain):
        size, one = _FACTORS.get(name, (nan, NUMBER))
        times = int(power or 1) * (-1 if over else 1)
        try:
            scale *= Decimal(str(size)) ** times
        except ArithmeticError:
            return None
        powers = [each + times * more for each, more in zip(powers, astuple(one), strict=True)]
    same = bool(re.fullmatch(f"({_FACTOR} ?)+", plain)) and Unit(*powers) == unit
    return float(scale) if same and isfinite(float(scale)) else None


def converted(value: float, scale: float) -> float:
    """Return the product of two numbers as that of their decimal digits: 36 times 0.001 is 0.036."""
    return float(Decimal(str(value)) * Decimal(str(scale)))


def parts(text: str) -> tuple[str, str, str]:
    """Return number, error and unit in a text such as "12,0±0,1cm", with decimal points; all are "" in other texts."""
    found = _QUANTITY.fullmatch(text.strip())
    value, error, unit = found.groups(default="") if found else ("", "", "")
    return value.replace(",", "."), error.replace(",", "."), unit.strip()


def quantity(text: str, unit: Unit | None, own: str = "") -> tuple[float, float] | None:
    """Return a number and its error in SI, such as (0.12, 0.001) for "12.0+-0.1 cm" or "12,0±0,1cm".

    The result is None if the text has another form. A number in the unit `own` is not converted.
    """
    value, error, written = parts(text)
    scale = None if not written else 1.0 if written == own else factor(written, unit)
    return (converted(number(value) or 0.0, scale), converted(number(error) or 0.0, scale)) if scale else None


def unit_in(text: str) -> str:
    """Return the unit after the number in a text, such as "cm" in "12 cm"; empty if there is none."""
    return parts(text)[2]


def unit_of(units: Unit | str) -> Unit | None:
    """Return the unit that a user's model gives as text, such as "radian" or "m/s"; None if it is not an SI unit."""
    if isinstance(units, Unit):
        return units
    return next((unit for unit in WRITTEN if units == unit.si or factor(units, unit) == 1), None)


def named(units: Unit | str, system: str) -> str:
    """Return the unit in a system of units; empty for a plain number, and in a system of a user-defined model.

    A unit that a user's model gives as text is the same in every system.
    """
    if isinstance(units, str):
        return "" if units == "1" else units
    own = units.si if units == ANGLE else ""
    return {PAPER_UNITS: units.paper, SI: units.si}.get(system, own)


def is_of_paper(units: str) -> bool:
    """Return whether a unit is built from the paper's c, g and m."""
    letters = set(re.findall(r"[A-Za-z]+", units))
    return letters <= {"sqrt", "c", "g", "m"} and not letters <= {"m"}


SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def pretty(units: str) -> str:
    """Return a unit as figures print it: kg m²/s for "kg m2 s-1", and √(g/c) for "sqrt(g/c)"."""
    parts = [re.fullmatch(r"([A-Za-z]+)(-?)(\d*)", part) for part in units.replace("radian", "rad").split()]
    if not all(parts):
        return units.replace("sqrt", "√")
    over, under = ([f"{p[1]}{p[3].translate(SUPERSCRIPT)}" for p in parts if p and p[2] == sign] for sign in ("", "-"))
    under = [part.removesuffix("¹") for part in under]
    below = f"({' '.join(under)})" if len(under) > 1 else "".join(under)
    return f"{' '.join(over) or 1}/{below}" if below else " ".join(over)

"""Names, units and meanings in plain words, for the axes, legends and titles of figures."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from sweep.parameters import PARAMETERS, Parameter
from sweep.results.dataset import STATUS_WORDS, VARIABLES
from sweep.results.kind import is_of_own_body, parameters
from sweep.units import SUPERSCRIPT, is_of_paper, pretty
from sweep.variables import Variable

_NUMBER = re.compile(r"(?<= )-?\d[\d.e+-]*")
"""A number in the words for a distribution."""

_ORIGIN = re.compile(", (simulated|estimated|predicted.*)$")
"""The end of the words for a variable that has a prediction."""

_RECORDS: Mapping[str, Parameter | Variable] = {**PARAMETERS, **VARIABLES}


def symbol(name: str) -> str:
    """A parameter's symbol, such as n₀."""
    return PARAMETERS[name].symbol if name in PARAMETERS else name


def unit(dataset: xr.Dataset, name: str) -> str:
    """The unit of a variable or coordinate as figures print it, such as √(g/c) or m²/s; empty for a plain number."""
    units = str(dataset[name].attrs.get("units", "1"))
    return "" if units == "1" else pretty(units)


def words(dataset: xr.Dataset, name: str) -> str:
    """Return the words for a variable or coordinate, without its unit."""
    own = dataset[name].attrs.get("long_name") if name in dataset.variables else None
    usual = _RECORDS[name].long_name if name in _RECORDS else name.replace("_", " ")
    return str(own or usual)


def origin(dataset: xr.Dataset, name: str) -> str:
    """Return whether a variable is simulated, estimated or predicted."""
    found = _ORIGIN.search(words(dataset, name))
    return found[1] if found else "simulated"


def label(dataset: xr.Dataset, name: str) -> str:
    """The label of an axis: the quantity and its unit."""
    return with_unit(words(dataset, name), unit(dataset, name))


def with_unit(words: str, unit: str) -> str:
    """Join words and a unit, either of which may be empty."""
    return f"{words} ({unit})" if words and unit else words or unit


def common(dataset: xr.Dataset, name: str) -> str:
    """The label of an axis or a bar that a variable shares with its prediction."""
    alone = _ORIGIN.sub("", words(dataset, name.removesuffix("_predicted")))
    return with_unit(alone, unit(dataset, name))


def flag_words(dataset: xr.Dataset, name: str) -> dict[int, str]:
    """The meaning of each value of a variable with flags, in words; empty for another variable."""
    attributes = dataset[name].attrs
    if "flag_values" not in attributes or not is_code(dataset[name]):
        return {}
    values = [int(value) for value in attributes["flag_values"]]
    meanings = dict(zip(values, str(attributes.get("flag_meanings", "")).split(), strict=False))
    if name == "status":
        meanings |= STATUS_WORDS
    elif values == [0, 1] and words(dataset, name).endswith("?"):
        meanings = {0: "no", 1: "yes"}
    return {value: meanings.get(value, str(value)).replace("_", " ") for value in values}


def flags_set(bits: xr.DataArray) -> list[str]:
    """Return the words for the flags that are set in one value of a variable with `flag_masks`."""
    meanings = zip(np.atleast_1d(bits.attrs["flag_masks"]), str(bits.attrs["flag_meanings"]).split(), strict=True)
    return [words.replace("_", " ") for mask, words in meanings if int(bits) & int(mask)]


def is_code(flags: xr.DataArray) -> bool:
    """Return whether the values of a variable with flags are still codes; an averaged status is not."""
    return flags.dtype.kind in "iub"


def number(at: float) -> str:
    """A number as figures print it, such as −2×10⁻⁵."""
    digits, _, power = f"{at:g}".partition("e")
    digits = digits.replace("-", "−")
    if not power:
        return digits
    ten = f"10{str(int(power)).translate(SUPERSCRIPT)}"
    return f"{digits.removesuffix('1')}{ten}" if digits in ("1", "−1") else f"{digits}×{ten}"


def value(name: str, at: float) -> str:
    """A parameter with its value, such as "μ = 60"."""
    if name == "count":
        return f"{reversals(int(at))} or more"
    return f"{symbol(name)} = {number(at)}"


def reversals(count: int) -> str:
    """Such as "3 reversals"."""
    return f"{count} reversal{'' if count == 1 else 's'}"


def measured(dataset: xr.Dataset, name: str, at: float) -> str:
    """A parameter with its value and its unit, unless that is one of the paper's."""
    return f"{value(name, at)}{si_unit(dataset, name)}"


def si_unit(dataset: xr.Dataset, name: str) -> str:
    """The unit after a number, with the space before it; empty in the paper's units, and for a plain number."""
    found = unit(dataset, name) if name in dataset.variables else ""
    return f" {found}" if found and not is_of_paper(found) else ""


def constants(dataset: xr.Dataset) -> str:
    """The parameters that are the same in the whole dataset, with their values.

    Parameters of a rattleback whose default is zero are left out where they are zero.
    """
    numbers = {str(name): float(v) for name, v in dataset.coords.items() if v.ndim == 0 and v.dtype.kind in "fi"}
    if not is_of_own_body(dataset):
        numbers = {name: at for name, at in numbers.items() if at or name not in PARAMETERS or PARAMETERS[name].default}
    ordered = [name for name in parameters(dataset) if name in numbers]
    fixed = [measured(dataset, name, numbers[name]) for name in dict.fromkeys([*ordered, *numbers])]
    known = {str(name): v.attrs["distribution"] for name, v in dataset.coords.items() if "distribution" in v.attrs}
    sampled = [
        f"{symbol(name)}: {_NUMBER.sub(lambda match: number(float(match[0])), words)}{si_unit(dataset, name)}"
        for name, words in known.items()
    ]
    return ", ".join([*fixed, *sampled])


def escaped(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset in whose texts each dollar sign is escaped, because matplotlib reads mathematics between two."""
    return rewritten(dataset, lambda text: text.replace("$", r"\$"))


def rewritten(dataset: xr.Dataset, change: Callable[[str], str]) -> xr.Dataset:
    """Return a dataset in which `change` has been applied to all texts, except its configuration."""
    changed = dataset.copy()
    holders: list[Any] = [changed, *changed.variables.values()]
    for each in holders:
        texts = {key: text for key, text in each.attrs.items() if isinstance(text, str) and key != "config"}
        each.attrs = {**each.attrs, **{key: change(text) for key, text in texts.items()}}
    return changed


def in_maths(words: str) -> str:
    """Set n_c1 and n_c1⁺ as symbols of mathematics."""
    signs = {"": "", "⁺": "^+", "⁻": "^-"}
    return re.sub(r"n_(c\d)([⁺⁻]?)", lambda found: rf"n$_{{\mathrm{{{found[1]}}}}}{signs[found[2]]}$", words)

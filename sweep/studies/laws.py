"""Fits one or several laws of friction to a film, and compares them by Akaike's criterion.

The weight of a law is its share in the evidence, exp(-Δ/2) over the sum of these, where Δ is the excess of its
criterion over the smallest (Burnham and Anderson 2002, sections 2.6 and 2.9).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.config.film import Film, read
from sweep.engine.reporter import Reporter
from sweep.faults import brief, fault_of, refusal, suggestion
from sweep.models.general.laws import LAWS
from sweep.studies.changes import left_open, with_law
from sweep.studies.fit import fit, with_optional

# Differences of the criterion up to which two laws cannot be distinguished, and above which one is ruled out. A useless
# parameter makes a difference of two.
_ALIKE, _RULED_OUT = 4.0, 10.0

# Standard deviations by which chi square may exceed its mean before the film counts as missed.
_MISSED = 5.0

_SHARED = ("seen", "other", "minimum", "misfit", "correlation")
"""Variables of a fit that describe the film, or have no place in a comparison of laws."""


def fitted(
    config: Config,
    film: str | Path | Film,
    free: str | Sequence[str],
    laws: str | Sequence[str],
    reporter: Reporter,
    columns: tuple[str, str, str] = ("", "", ""),
) -> xr.Dataset:
    """Fit as `sweep.api.fit`; `columns` names the time and data columns and the run."""
    free, laws = _names(free, "free"), _names(laws, "laws")
    if laws and (config.origin or config.model != "slip"):
        raise fault_of("can be compared only in the slip model; set model: slip", "laws")
    for name in laws:
        if name not in LAWS:
            words = f"{brief(name)} is not a law of friction{suggestion(name, LAWS)}"
            raise fault_of(f"{words}; choose from {', '.join(LAWS)}", "laws")
    film, note = film if isinstance(film, Film) else read(film, *columns), reporter.note
    free = [*dict.fromkeys([*free, *left_open(config)])]
    config = with_optional(config, free)
    if not laws:
        return fit(config, film, free, note)
    found: dict[str, xr.Dataset] = {}
    for name in dict.fromkeys(laws):
        other, own = with_law(config, LAWS[name])
        theirs = [each for each in free if each in other.tier.parameters or each not in config.table]
        dropped, names = [each for each in free if each not in theirs], list(dict.fromkeys([*theirs, *own]))
        note(f"law {name}: free are {', '.join(names)}" + (f"; it has no {', '.join(dropped)}" if dropped else ""))
        found[name] = fit(other, film, names, note, compared=True)
    return _together(found, film)


def _names(given: str | Sequence[str], argument: str) -> Sequence[str]:
    """Return the names that an argument gives, a single one or several."""
    names = [given] if isinstance(given, str) else given
    if not (isinstance(names, list | tuple) and all(isinstance(name, str) for name in names)):
        raise fault_of(refusal(given, "a name or a list of names"), argument)
    return names


def _together(found: Mapping[str, xr.Dataset], film: Film) -> xr.Dataset:
    """Return the fits of all laws, with their weights."""
    fits, rows = list(found.values()), len(film.time)
    number = np.array([each.sizes["parameter"] for each in fits])
    squares = np.array([rows * each.attrs["root_mean_square"] ** 2 for each in fits])
    # A film without errors takes them from the best fit, the same for all laws.
    chi = np.array([each["misfit"].values[0] for each in fits]) if film.error is not None else (
        squares / (squares / (rows - number)).min()
    )  # fmt: skip
    akaike = np.array([each.attrs["akaike"] for each in fits])
    share = np.exp(-(akaike - akaike.min()) / 2)
    names, best = list(found), int(np.argmin(akaike))
    apart = [one.drop_vars(_SHARED) for one in fits]
    result = xr.concat(apart, xr.Variable("law", names), join="outer", combine_attrs="drop", coords="minimal")
    result = result.assign(
        seen=fits[0]["seen"],
        chi_square=("law", chi, {"long_name": "chi square"}),
        number_free=("law", number, {"long_name": "number of free parameters"}),
        akaike=("law", akaike, {"long_name": "Akaike's criterion"}),
        weight=("law", share / share.sum(), {"long_name": "Akaike's weight"}),
    )
    compared = _told_apart(names, akaike - akaike.min())
    sentences, excess = [*compared], chi[best] / (rows - number[best])
    if film.error is not None and excess > 1 + _MISSED * sqrt(2 / (rows - number[best])):
        words = f"even {names[best]} misses the film by more than its errors"
        sentences.append(f"{words}: {excess:.3g} chi square an instant")
    blind = ((name, each) for name, one in found.items() for each in one.attrs["undetermined"].split("; ") if each)
    sentences += [f"{name}: {each}" for name, each in blind]
    attributes: dict[str, Any] = dict(fits[best].attrs)
    attributes["title"] = attributes["title"].replace(": fitted", ": laws of friction fitted")
    attributes |= {"undetermined": "; ".join(sentences), "trajectories": sum(one.attrs["trajectories"] for one in fits)}
    attributes["verdict"] = f"{names[best]}: {attributes['verdict']}" + "".join(f"\n{each}." for each in compared)
    return result.assign_attrs(attributes)


def _told_apart(names: Sequence[str], excess: np.ndarray) -> list[str]:
    """Describe what the film says of each law compared with the best."""
    sentences, (best, *others) = [], np.argsort(excess, kind="stable")
    for i in others:
        by = f"Akaike's criteria differ by {excess[i]:.3g}"
        if excess[i] < _ALIKE:
            sentences.append(f"{names[best]} and {names[i]} cannot be distinguished by this film: {by}")
        elif excess[i] < _RULED_OUT:
            sentences.append(f"{names[i]} is less likely than {names[best]}: {by}")
        else:
            sentences.append(f"{names[i]} is ruled out in favour of {names[best]}: {by}")
    return sentences

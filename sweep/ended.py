"""List what has ended, with what to do instead, so that old files and commands get an answer."""

from __future__ import annotations

from typing import Any

ENDED: dict[str, str] = {
    "verify": "leave it out; to compare a few cells with dopri5 at half its step, see how-to/check",
    "until": "give a number of samples instead",
    "sensitivity": "leave it out; sensitive shows which counts depend on the step",
    "film_lean_x": "lay the sensor so that its z axis is upright at rest, or correct the film first",
    "film_lean_y": "lay the sensor so that its z axis is upright at rest, or correct the film first",
    "cluster": "give client, a distributed.Client or the address of a scheduler",
    "--workers": "a run uses all cores of this machine; for more machines start a dask cluster and give --scheduler",
    "width": "the width of brackets is bracket",
    "boundaries --width": "the width of brackets is --bracket",
    "critical --width": "the width of brackets is --bracket",
    "plot --histogram": "use xarray: dataset.reversals.plot.hist()",
    "plot --contours": "use xarray: dataset.spin_final.plot.contour()",
}
"""What to do instead of keys of a configuration ("verify", "integrator.step"), measurements, free parameters of `fit`
and options of all commands ("--workers") or of one ("plot --histogram")."""


def ended(*names: str) -> str:
    """Say that what once had one of these names has ended, and what to do instead; "" if nothing had."""
    return next((f"has ended; {ENDED[name]}" for name in names if name in ENDED), "")


def without_ended(document: dict[str, Any]) -> dict[str, Any]:
    """Drop what has ended from the configuration of a dataset, which may be older than this program."""
    found = {}
    for key, value in document.items():
        if isinstance(value, dict):
            value = {inner: each for inner, each in value.items() if f"{key}.{inner}" not in ENDED}
        elif key == "measure" and isinstance(value, list):
            value = [each for each in value if not ENDED.keys() & ({each} if isinstance(each, str) else {*each})]
        if key not in ENDED:
            found[key] = value
    return found

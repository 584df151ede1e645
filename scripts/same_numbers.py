"""Compare the datasets of all configurations with those of another revision, bit for bit.

    python scripts/same_numbers.py REVISION [--keep FOLDER] [CONFIG …]

Runs each configuration with the sources of the revision and with those of this checkout, in processes of their own.
Each takes the configuration of its own checkout.  Every variable, coordinate and attribute is compared, but for those
that say when, where and from which sources a dataset was made.  Differences that are meant are left aside, and named:
variables that only one of them has (`OTHERS`), and attributes that are words (`WORDS`).  Exits with 1 if anything else
differs.

All of them take about twenty minutes on two cores, less where FOLDER holds results already.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import netCDF4

ROOT = Path(__file__).parent.parent

ORIGIN = {
    "source_hash", "versions", "sweep_version", "git_commit", "created", "history", "wall_time",
    "trajectories_per_second", "model_place", "model_sha256", "cpu", "threads",
}  # fmt: skip

OTHERS = (
    "verified_*", "reversals_low", "reversals_high", "film_lean_?", "inferred", "raw_reversals", "t_first_reversal",
    "reversal_time_reason", "lyapunov*", "cycle_*", "misfit", "reversal_times", "reversal", "critical_reason", "sign",
    "end", "doubts",
)  # fmt: skip
"""Patterns of variables, and attributes of datasets, that only older or only newer revisions have."""

RENAMED = {
    "decided": "certain", "reversals_foreseen": "reversals_estimated", "foreseen_sure": "estimate_certain",
    **{f"{name}_{side}{old}": f"{name}{new}[{value:+d}]"
       for side, value in (("plus", 1), ("minus", -1))
       for name, old, new in (("n_c1", "", ""), ("n_c2", "", ""), ("n_c1", "_linear", "_linear"))},
}  # fmt: skip
"""Old names of variables, and the new ones; "[+1]" is the part at that `sign`."""

DOUBTS = {"sensitive": 2, "window_dependent": 4, "noise_limited": 32}
"""Variables of older revisions that are bits of `doubts`."""

WORDS = (
    "config", "config_hash", "coordinates", "measured", "pictured", "sweep_kind", "title", "units", "long_name",
    "description",
)  # fmt: skip
"""Attributes in words: the configuration, whose keys may have ended, and what a dataset or a variable is."""


def differences(one: Path, other: Path) -> Iterator[str]:
    """Name what differs between two datasets, the first as the measure."""
    with netCDF4.Dataset(one) as before, netCDF4.Dataset(other) as after:
        before.set_auto_maskandscale(False)
        after.set_auto_maskandscale(False)
        yield from _attributes("", before, after)
        theirs, ours = _parts(before), _parts(after)
        if "sensitive" in theirs:
            ours |= {name: (ours["doubts"] & bit != 0).astype("int8") for name, bit in DOUBTS.items() if name in theirs}
        yield from sorted(theirs.keys() ^ ours.keys())
        for name in sorted(theirs.keys() & ours.keys()):
            if name in before.variables and name in after.variables:
                yield from _attributes(f"{name}:", before[name], after[name])
            first, second = theirs[name], ours[name]
            if (first.dtype, first.shape) != (second.dtype, second.shape):
                yield f"{name} (type or shape)"
            elif differing := sum(one != other for one, other in zip(_bits(first), _bits(second), strict=True)):
                yield f"{name} ({differing} of {first.size} values)"


def _parts(dataset: netCDF4.Dataset) -> dict[str, Any]:
    """Return the values of the variables by their new names; those over `sign` in a part for each."""
    found = {}
    for name, variable in dataset.variables.items():
        values = variable[...]
        if variable.dimensions[-1:] == ("sign",) and name != "sign":
            found |= {f"{name}[{sign:+d}]": values[..., i] for i, sign in enumerate(dataset["sign"][:])}
        else:
            found[RENAMED.get(name, name)] = values
    return found


def _bits(values: Any) -> list[bytes]:
    return [value.encode() if isinstance(value, str) else value.tobytes() for value in values.ravel()]


def _attributes(place: str, before: netCDF4.Dataset, after: netCDF4.Dataset) -> Iterator[str]:
    for name in sorted({*before.ncattrs(), *after.ncattrs()} - ORIGIN):
        if str(getattr(before, name, None)) != str(getattr(after, name, None)):
            yield f"{place}{name}"


def meant(difference: str) -> bool:
    """Return whether a difference is left aside: no value of a variable that both datasets have."""
    return difference.rpartition(":")[2] in WORDS or any(fnmatch(difference, pattern) for pattern in OTHERS)


def run(checkout: Path, config: str, folder: Path) -> Path:
    """Run a configuration of a checkout, unless the folder has its dataset; return that."""
    name = Path(config).stem
    dataset = folder / name / f"{name}.nc"
    if not dataset.exists():
        command = [sys.executable, "-m", "sweep", "run", f"configs/{name}.yaml", "--output", str(dataset.parent)]
        subprocess.run([*command, "--quiet"], cwd=checkout, check=True, stderr=subprocess.DEVNULL)
    return dataset


def main() -> int:
    """Compare, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("revision")
    parser.add_argument("configs", nargs="*", default=sorted(path.stem for path in (ROOT / "configs").glob("*.yaml")))
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="where the revision's datasets are, or will be")
    asked, different = parser.parse_intermixed_args(), False
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        subprocess.run(["git", "clone", "-q", str(ROOT), str(scratch / "other")], check=True)
        subprocess.run(["git", "-C", str(scratch / "other"), "checkout", "-q", asked.revision], check=True)
        for config in asked.configs:
            theirs = run(scratch / "other", config, (asked.keep or scratch / "theirs").resolve())
            found = list(differences(theirs, run(ROOT, config, scratch / "ours")))
            aside = [each for each in found if meant(each)]
            wrong = [each for each in found if each not in aside]
            different |= bool(wrong)
            print(f"{Path(config).stem}: {', '.join(wrong) or 'the same'}", flush=True)
            if aside:
                print(f"  left aside: {', '.join(aside)}", flush=True)
    return int(different)


if __name__ == "__main__":
    sys.exit(main())

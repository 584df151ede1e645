"""Records the provenance of a dataset: what its numbers depend on, and what produced them.

What they depend on is its identity, which defines which runs may resume each other's files.
"""

from __future__ import annotations

import datetime
import platform
import re
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba

from sweep.config import Config
from sweep.faults import FileError, either, printable
from sweep.jit import vector_bits
from sweep.kernels.methods import AUTO, METHODS
from sweep.results import kind
from sweep.sources import hashed, versions

_PACKAGE = Path(__file__).parent.parent

_SHOWING = {"plots", "explorer", "cli", "report", "reproduce", "bench"}
"""Packages that only request or show numbers."""


_UNSEEN = {r"^cases: ": "table of cases", r"^model: .*\.py$": "text of the model's file"}
"""Inputs that a configuration names but does not contain, by a pattern of the line that names them."""


@dataclass(frozen=True)
class Identity:
    """Everything that the numbers of a run depend on. A run resumes only files with its own identity."""

    config: str
    """The resolved configuration, as YAML."""
    config_hash: str
    source_hash: str
    """Hash of the source code that decides the numbers."""
    versions: str
    """Versions of this program and of the libraries that compile it."""

    def difference(self, other: Identity) -> str:
        """Say why a run of `other` cannot resume files with this identity; return "" if it can."""
        if not self.config_hash:
            return "another program, or has been edited since"
        if self.config_hash != other.config_hash:
            old, new = (c.config.splitlines() for c in (self, other))
            changed = [f"- {printable(line.strip())}" for line in old if line not in new]
            changed += [f"+ {printable(line.strip())}" for line in new if line not in old]
            unseen = [name for key, name in _UNSEEN.items() if re.search(key, other.config, re.MULTILINE)]
            changed = changed or [f"the {either(unseen or ['order of the axes'])} differs"]
            return "another configuration:\n  " + "\n  ".join(changed)
        if self.versions != other.versions:
            return f"other versions: {self.versions or 'unknown'}, now {other.versions}"
        return "other sources of the model or kernel" if self.source_hash != other.source_hash else ""


def require_same(path: Path, found: Identity, wanted: Identity) -> None:
    """Raise a `FileError` if the file at `path`, with the identity `found`, does not belong to the run `wanted`."""
    if reason := found.difference(wanted):
        raise not_resumed(path, reason)


def not_resumed(path: Path, reason: str) -> FileError:
    """Return the error for a file that cannot be resumed, because it comes from `reason`."""
    return FileError(
        f"{path}: not resumed, it comes from {reason}\n"
        "  continue it with the same configuration or a larger one, choose another --output, or discard it with --fresh"
    )


def decisive_sources() -> list[Path]:
    """Return the source files on which the numbers of a dataset depend: all but those of packages that show them."""
    return [path for path in _PACKAGE.rglob("*.py") if path.relative_to(_PACKAGE).parts[0] not in _SHOWING]


def identify(config: Config) -> Identity:
    """Return the identity of the results that this program computes for `config`."""
    return Identity(config.label(), config.fingerprint(), *sources())


@cache
def sources() -> tuple[str, str]:
    """Return a hash of the decisive source files, with the versions of the libraries that compile and run them."""
    return hashed(decisive_sources())[:16], f"sweep {metadata.version('rattleback-sweep')}, {versions()}"


def this_cpu() -> str:
    """The type of CPU for which kernels are compiled here."""
    return str(llvmlite.binding.get_host_cpu_name())


def provenance(
    config: Config, seconds: float, cells: int, cpus: Iterable[str] = (), *, of: kind.Kind = kind.RUN
) -> dict[str, Any]:
    """Return the attributes of a dataset: its kind, configuration, versions, CPU types (by default this one) and
    cost."""
    return {
        kind.ATTRIBUTE: of.name,
        **vars(identify(config)),
        "measured": " ".join(config.measure),
        **({"pictured": " ".join(config.picture)} if config.picture else {}),
        **_brought(config),
        "integrator": _integrator_words(config),
        "sweep_version": metadata.version("rattleback-sweep"),
        "git_commit": _git_commit(),
        **{f"{name}_version": metadata.version(name) for name in ("numba", "numpy", "xarray", "netCDF4")},
        "python_version": platform.python_version(),
        "cpu": ", ".join(sorted(set(cpus) or {this_cpu()})),
        "vector_bits": vector_bits(),
        "threads": numba.get_num_threads(),
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "wall_time": seconds,
        "trajectories_per_second": cells / seconds if seconds else 0.0,
    }


def _brought(config: Config) -> dict[str, str]:
    """Describe a user-defined model or law: its kind, its file, its SHA-256, and its parameters."""
    if not (origin := config.origin):
        return {}
    return {
        "model_brings": "a law of friction" if config.of_rattlebacks else kind.OWN_BODY,
        "model_place": origin.place,
        "model_sha256": origin.digest,
        "model_parameters": " ".join(config.tier.parameters),
    }


def _integrator_words(config: Config) -> str:
    if not config.simulated:
        return "none"
    if config.integrator.step != "auto":
        return f"{config.integrator.method}, fixed step of {config.integrator.step:g} sqrt(c/g)"
    tolerance, method = config.tolerance, config.integrator.method
    rule = f"a spin error of {tolerance:g} sqrt(g/c) at t = 400 sqrt(c/g)"
    rule += ", and less until its count is certain" if config.by_count else ""
    if method != AUTO and METHODS[method].step_words:
        rule = f"the shorter of {METHODS[method].step_words} and {rule}"
    name = "the cheapest method" if method == AUTO else method
    return f"{name}, fixed step, per trajectory by {rule}"


@cache
def _git_commit() -> str:
    """Return the git commit from which the package runs; "unknown" for an installed package."""
    root = _PACKAGE.parent
    if not (root / ".git").exists():
        return "unknown"
    try:
        command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=5).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return "unknown"

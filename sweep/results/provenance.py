"""Where the numbers of a dataset come from: what they depend on, and what produced them."""

from __future__ import annotations

import datetime
import platform
import re
import subprocess
from collections.abc import Iterable
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba

from sweep.config import Config
from sweep.jit import vector_bits
from sweep.kernels.methods import AUTO, METHODS
from sweep.results import kind
from sweep.results.identity import Identity
from sweep.sources import hashed, versions

_PACKAGE = Path(__file__).parent.parent

RUN, _PICTURES = "sweep.engine.run", "sweep.plots"
"""The module that makes the datasets of runs, and the room that only draws what was made."""

# To look for imports in the text of all files takes 15 ms; their syntax trees would take 0.2 s.
_IMPORT = re.compile(r"^ *(?:from (sweep\.[\w.]+) import (\([^)]*\)|.*)|import (sweep\.[\w.]+))", re.MULTILINE)


def decisive_sources(maker: str = RUN) -> list[Path]:
    """The files on which the numbers of a dataset depend: those that the module `maker` imports, in any function."""
    files = {module_of(path): path for path in _PACKAGE.rglob("*.py")}
    found, waiting = set[Path](), [maker]
    while waiting:
        module = waiting.pop()
        path = files.pop(module, None)
        if path is None or module.startswith(_PICTURES):
            continue
        found.add(path)
        for source, names, plain in _IMPORT.findall(path.read_text(encoding="utf-8")):
            waiting += [source or plain, *(f"{source}.{name}" for name in re.findall(r"\w+", names))]
        waiting += [module.rpartition(".")[0]] if module.count(".") > 1 else []  # the package that it is in
    return sorted(found)


def module_of(path: Path) -> str:
    """The name of the module in a file of the package."""
    return ".".join(("sweep", *path.relative_to(_PACKAGE).with_suffix("").parts)).removesuffix(".__init__")


def identify(config: Config, maker: str = RUN) -> Identity:
    """The identity of what this program, by its module `maker`, makes of `config`."""
    return Identity(config.to_yaml(), config.fingerprint(), *sources(maker))


@cache
def sources(maker: str = RUN) -> tuple[str, str]:
    """Hash of the decisive source files, and the versions of what compiles and runs them."""
    return hashed(decisive_sources(maker))[:16], f"sweep {_version('rattleback-sweep')}, {versions()}"


@cache
def _version(package: str) -> str:
    return metadata.version(package)


def this_cpu() -> str:
    """The type of CPU for which kernels are compiled here."""
    return str(llvmlite.binding.get_host_cpu_name())


def provenance(
    config: Config, seconds: float, cells: int, cpus: Iterable[str] = (), *, of: kind.Kind = kind.RUN
) -> dict[str, Any]:
    """Attributes of a dataset: its kind, configuration, versions, types of CPU (by default this one's) and cost."""
    return {
        kind.ATTRIBUTE: of.name,
        **vars(identify(config)),
        "measured": " ".join(config.measure),
        **({"pictured": " ".join(config.picture)} if config.picture else {}),
        **({"film_sha256": film.sha256, "film_instants": len(film.time)} if (film := config.film) else {}),
        **_brought(config),
        "integrator": _integrator_words(config),
        "sweep_version": _version("rattleback-sweep"),
        "git_commit": _git_commit(),
        **{f"{name}_version": _version(name) for name in ("numba", "numpy", "xarray", "netCDF4")},
        "python_version": platform.python_version(),
        "cpu": ", ".join(sorted(set(cpus) or {this_cpu()})),
        "vector_bits": vector_bits(),
        "threads": numba.get_num_threads(),
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "wall_time": seconds,
        "trajectories_per_second": cells / seconds if seconds else 0.0,
    }


def _brought(config: Config) -> dict[str, str]:
    """Of what a user brings: what it is, its file or entry point, the SHA-256 of that, and the model's parameters."""
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
    tolerance, method = config.integrator.tolerance, config.integrator.method
    rule = f"a spin error of {tolerance:g} sqrt(g/c) at t = 400 sqrt(c/g)"
    if method != AUTO and METHODS[method].step_words:
        rule = f"the shorter of {METHODS[method].step_words} and {rule}"
    name = "the cheapest method" if method == AUTO else method
    return f"{name}, fixed step, per trajectory by {rule}"


@cache
def _git_commit() -> str:
    """The commit of the checkout from which the package runs; "unknown" for an installed package."""
    root = _PACKAGE.parent
    if not (root / ".git").exists():
        return "unknown"
    try:
        command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=5).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return "unknown"

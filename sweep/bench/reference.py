"""Reference spins and counts, and errors against them.  The project's `data/README.md` says how they were made."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable

import numpy as np

from sweep.engine.executor import execute
from sweep.grid import Array
from sweep.kernels.kernel import Kernel
from sweep.kernels.status import TIME_LIMIT
from sweep.models import MODELS
from sweep.parameters import PARAMETERS

_DATA = resources.files("sweep.bench") / "data"
SPINS, COUNTS = _DATA / "reference_spins.csv", _DATA / "reference_counts_500.csv"


@dataclass(frozen=True)
class Spins:
    """Spins of some bodies of a model at common times."""

    columns: dict[str, Array]
    """Physical parameters, each of shape (bodies,)."""
    times: Array
    """All are multiples of the first."""
    spins: Array
    """Shape (bodies, times)."""

    def select(self, which: Array) -> Spins:
        """The bodies chosen by `which`, a mask or indices."""
        return Spins({n: v[which] for n, v in self.columns.items()}, self.times, self.spins[which])

    def name(self, body: int) -> str:
        """The friction, and what else differs from the standard case, in words."""
        values = {name: float(column[body]) for name, column in self.columns.items()}
        shown = [
            f"{'μ' if name == 'mu' else name} = {value:g}"
            for name, value in values.items()
            if name == "mu" or value != PARAMETERS[name].default
        ]
        return ", ".join(shown) or "standard"


@dataclass(frozen=True)
class Counts:
    """Reversals of cells of the slip model."""

    columns: dict[str, Array]
    reversals: Array
    firm: Array
    """Whether the count depends neither on round-off nor on where the windows begin."""


def read_spins() -> dict[str, Spins]:
    """The reference spins of each model."""
    found: dict[str, dict[tuple[float, ...], dict[float, float]]] = {}
    for line in _lines(SPINS):
        body = tuple(float(line[name]) for name in MODELS[line["model"]].parameters)
        found.setdefault(line["model"], {}).setdefault(body, {})[float(line["t"])] = float(line["spin"])
    spins = {}
    for model, bodies in found.items():
        columns = dict(zip(MODELS[model].parameters, np.array(list(bodies)).T, strict=True))
        times = sorted(next(iter(bodies.values())))
        values = np.array([[series[t] for t in times] for series in bodies.values()])
        spins[model] = Spins(columns, np.array(times), values)
    return spins


def read_counts() -> Counts:
    """The reference counts."""
    lines = _lines(COUNTS)
    names = ("a", "b", "delta", "mu", "n0", "x0", "y0")
    columns = {name: np.array([float(line[name]) for line in lines]) for name in names}
    reversals = np.array([int(float(line["reversals"])) for line in lines])
    firm = np.array([line["firm"].strip().lower() in ("1", "true") for line in lines])
    return Counts(columns | {"c": np.ones(len(lines))}, reversals, firm)


def _lines(table: Traversable) -> list[dict[str, str]]:
    return list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))


def spin_errors(kernel: Kernel, reference: Spins, step: Array) -> tuple[Array, Array]:
    """Largest error in spin over the reference's times, and `energy_error` at the last, both of shape (bodies,).

    Each time gets a trajectory of its own, because the steps of adams depend on where it is to end.  The error of a
    trajectory that fails is infinite.
    """
    table = np.concatenate([kernel.images(reference.columns, step, t) for t in reference.times])
    execute(kernel, table, stop_when_settled=False)
    spin = kernel.model.energy(*kernel.unpack(table))[0]
    error = np.where(table[:, kernel.row("status")] == TIME_LIMIT, np.abs(spin - reference.spins.T.ravel()), np.inf)
    last = table[-len(step) :]
    violation = np.full(len(step), np.nan)
    if "energy_error" in kernel.measure:
        violation = last[:, kernel.row("violation")] / last[:, kernel.row("energy_start")]
    return error.reshape(len(reference.times), -1).max(axis=0), violation


def whole_steps(reference: Spins, step: Array) -> Array:
    """The longest steps, at most `step`, of which all times of the reference are multiples."""
    return np.asarray(reference.times[0] / np.ceil(reference.times[0] / step * (1 - 1e-12)))

"""Loads reference spins, and compares results with them. The project's `data/README.md` says how they were made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import resources

import numpy as np

from sweep.engine.executor import execute
from sweep.grid import Array
from sweep.kernels.kernel import Kernel
from sweep.kernels.methods import METHODS, allowed
from sweep.kernels.status import TIME_LIMIT
from sweep.models import MODELS
from sweep.parameters import PARAMETERS

STEEPEST = 1e4
"""Largest friction for a method with a stability limit: its time is proportional to μ."""

SPINS = resources.files("sweep.bench") / "data" / "reference_spins.csv"


@dataclass(frozen=True)
class Spins:
    """Spins of some bodies of a model at common times."""

    columns: dict[str, Array]
    """Physical parameters, each of shape (bodies,)."""
    times: Array
    """Times, all multiples of the first."""
    spins: Array
    """Shape (bodies, times)."""

    def select(self, which: Array) -> Spins:
        """Return the bodies selected by `which`, a mask or indices."""
        return Spins({n: v[which] for n, v in self.columns.items()}, self.times, self.spins[which])

    def is_standard(self, body: int) -> bool:
        """Return whether body and start are those of the standard case, at whatever friction."""
        others = (name for name in self.columns if name != "mu")
        return all(self.columns[name][body] == PARAMETERS[name].default for name in others)


def read_spins() -> dict[str, Spins]:
    """Read the reference spins of each model, whose lines are in the order of bodies and times."""
    table, spins = np.genfromtxt(str(SPINS), delimiter=",", names=True, dtype=None, encoding="utf-8"), {}
    for model in dict.fromkeys(table["model"].tolist()):
        lines = table[table["model"] == model]
        times = np.unique(lines["t"]).astype(float)
        bodies = lines.reshape(-1, len(times))
        columns = {name: bodies[name][:, 0].astype(float) for name in MODELS[model].parameters}
        spins[model] = Spins(columns, times, bodies["spin"])
    return spins


def comparisons() -> Iterator[tuple[str, str, Spins]]:
    """Pair each model with each method that runs it, and with the bodies that the method can run in reasonable time."""
    for model, reference in read_spins().items():
        for method in allowed(MODELS[model]):
            mu = reference.columns.get("mu", np.zeros(len(reference.spins)))
            yield model, method, reference.select((mu <= STEEPEST) | (METHODS[method].real_stability == np.inf))


def spin_errors(kernel: Kernel, reference: Spins, step: Array) -> Array:
    """Find the largest error in spin over the reference's times, of shape (bodies,).

    Each time needs a separate trajectory, because the steps of adams depend on where it is to end. The error of a
    trajectory that fails is infinite.
    """
    table = np.concatenate([kernel.start(reference.columns, step, t) for t in reference.times])
    execute(kernel, table)
    spin = kernel.model.energy(*kernel.unpack(table))[0]
    error = np.where(kernel.table(table)["status"] == TIME_LIMIT, np.abs(spin - reference.spins.T.ravel()), np.inf)
    return np.asarray(error.reshape(len(reference.times), -1).max(axis=0))


def whole_steps(reference: Spins, step: Array) -> Array:
    """Find the longest steps, at most `step`, that divide all times of the reference."""
    return np.asarray(reference.times[0] / np.ceil(reference.times[0] / step * (1 - 1e-12)))

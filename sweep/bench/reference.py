"""Reference spins, and errors against them.  The project's `data/README.md` says how they were made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import resources

import numpy as np

from sweep.bench.timing import runs_at
from sweep.engine.executor import execute
from sweep.grid import Array
from sweep.kernels.kernel import Kernel
from sweep.kernels.methods import allowed
from sweep.kernels.status import TIME_LIMIT
from sweep.models import MODELS
from sweep.parameters import PARAMETERS

SPINS = resources.files("sweep.bench") / "data" / "reference_spins.csv"


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
        shown = [
            f"{'μ' if name == 'mu' else name} = {column[body]:g}"
            for name, column in self.columns.items()
            if name == "mu" or column[body] != PARAMETERS[name].default
        ]
        return ", ".join(shown) or "standard"


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
    """Each model with each method that runs it, and those of its bodies that take the method a bearable time."""
    for model, reference in read_spins().items():
        for method in allowed(MODELS[model]):
            mu = reference.columns.get("mu", np.zeros(len(reference.spins)))
            yield model, method, reference.select(np.array([runs_at(method, x) for x in mu]))


def spin_errors(kernel: Kernel, reference: Spins, step: Array) -> Array:
    """Largest error in spin over the reference's times, and `energy_error` at the last, of shape (2, bodies).

    Each time gets a trajectory of its own, because the steps of adams depend on where it is to end.  The error of a
    trajectory that fails is infinite.
    """
    table = np.concatenate([kernel.images(reference.columns, step, t) for t in reference.times])
    execute(kernel, table, stop_when_settled=False)
    spin = kernel.model.energy(*kernel.unpack(table))[0]
    error = np.where(kernel.table(table)["status"] == TIME_LIMIT, np.abs(spin - reference.spins.T.ravel()), np.inf)
    violation = np.full(len(step), np.nan)
    if "energy_error" in kernel.measure:
        last = table[-len(step) :]
        violation = kernel.table(last)["violation"] / kernel.table(last)["energy_start"]
    return np.stack([error.reshape(len(reference.times), -1).max(axis=0), violation])


def whole_steps(reference: Spins, step: Array) -> Array:
    """The longest steps, at most `step`, of which all times of the reference are multiples."""
    return np.asarray(reference.times[0] / np.ceil(reference.times[0] / step * (1 - 1e-12)))

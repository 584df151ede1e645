"""What the estimate of a run (`sweep run CONFIG --dry-run`) goes by: time of steps with each measurement, of compiling.

    python scripts/run_costs.py [CONFIG …]

A step is timed on one thread, by the processor's clock and in turn with all others, so that a busy machine matters
little.  The first column is relative to `dopri5` on the slip model without measurements: enter it as `cost` of a
measurement, or as `step_cost` of a method (which also decides what `method: auto` takes).  Compiling is timed as the
processor's time of `python -m sweep.kernels.build …`, in an empty cache.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np

from sweep.config import load_config
from sweep.engine.plan import Choice, choose
from sweep.kernels.build import build
from sweep.kernels.measures import MEASURES

STANDARD = {"friction": {"mu": 60}, "start": {"n0": 0.05}, "integrator": {"method": "dopri5"}}
CELLS, BLOCKS, ROUNDS = 160, 120, 5
FILM = Path(__file__).parent.parent / "configs" / "wooden_film.csv"

Work = tuple[Choice, float]


def works(files: list[str]) -> dict[str, Work]:
    """What is timed, by name: a measurement beside those that it needs, a method, or the methods of a configuration."""
    found = {}
    names = [name for name, kind in MEASURES.items() if kind().in_kernel]
    measures = [[], *([*MEASURES[name].needs, {name: str(FILM)} if name == "misfit" else name] for name in names)]
    configs = [("+".join(map(str, each)) or "nothing", load_config(STANDARD, {"measure": each})) for each in measures]
    configs += [("adams", load_config(STANDARD, {"measure": [], "method": "adams"}))]
    configs += [(Path(file).stem, load_config(file)) for file in files]
    for name, config in configs:
        for choice in choose(config, config.grid.sample(64)):
            found[f"{name}, {choice.method}"] = choice, config.integrator.t_end
    return found


def nanoseconds(work: Work) -> float:
    """Time of a step of one lane."""
    choice, t_end = work
    kernel, columns = choice.kernel, {name: np.resize(values, CELLS) for name, values in choice.columns.items()}
    images = kernel.images(columns, np.resize(choice.step, CELLS), t_end)
    began = time.process_time()
    kernel.advance(images, np.arange(CELLS), BLOCKS, False)
    return 1e9 * (time.process_time() - began) / float(kernel.table(images)["done"].sum())


def compile_seconds(*piece: str) -> float:
    """Processor time to compile a piece, in a copy of the package without a cache."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(__file__).parent.parent / "sweep"
        shutil.copytree(source, Path(folder) / "sweep", ignore=shutil.ignore_patterns("__pycache__"))
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        command = [sys.executable, "-m", "sweep.kernels.build", *piece]
        with subprocess.Popen(command, cwd=folder, stdin=subprocess.PIPE) as process:  # it ends when its input closes
            if process.wait():
                raise RuntimeError(f"{' '.join(piece)}: not compiled")
        return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main(files: list[str]) -> None:
    timed = works(files)
    build([choice.kernel for choice, _ in timed.values()])
    for work in timed.values():
        nanoseconds(work)  # loads the kernel
    times = {name: np.array([]) for name in timed}
    for _ in range(ROUNDS):
        for name, work in timed.items():
            times[name] = np.append(times[name], nanoseconds(work))
    base = next(iter(times.values()))
    for name, values in times.items():
        print(f"{np.median(values / base):6.2f} {np.median(values):6.1f} ns a step  {name}", flush=True)
    for piece in ("kernel dopri5 slip reversals", "kernel adams slip reversals", "images adams slip",
                  "approach dopri5 slip", "endings dopri5 slip"):  # fmt: skip
        print(f"{compile_seconds(*piece.split()):6.1f} s  {piece}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

"""Draws the spin at a reversal with a beat, its average over a period, and the ripple-free spin.

python scripts/ripple_figure.py docs/_static/ripple.png
"""

from __future__ import annotations

import sys

import numpy as np
from matplotlib.figure import Figure

import sweep
from sweep.models.theory.rocking import slower_period

BODY = {"a": 10.0, "b": 5.0, "c": 1.0, "delta": 0.03}
FROM, TO = 0.0, 1100.0


def main(path: str) -> None:
    config = sweep.load_config("configs/mu_b.yaml", {**BODY, "t_end": TO, "stop_when_settled": False})
    one = sweep.trajectory(config, every=0.1, mu=160.0, n0=0.1, b=BODY["b"]).isel(trajectory=0)
    time, spin, free = (one[name].values for name in ("time", "spin", "ripple_free_spin"))
    tau = float(slower_period({name: np.array([value]) for name, value in BODY.items()})[0])
    width = round(tau / (time[1] - time[0]))
    mean = np.convolve(spin, np.full(width, 1 / width), mode="same")
    figure = Figure(figsize=(8, 3.4), dpi=110, layout="constrained")
    axes = figure.subplots()
    axes.axhline(0, color="black", linewidth=0.5)
    axes.plot(time, spin, color="0.75", linewidth=0.6, label="spin $n$")
    axes.plot(time, mean, color="C1", linewidth=1.2, label="$n$, averaged over one period")
    axes.plot(time, free, color="C0", linewidth=1.2, label="ripple-free spin $n^*$")
    axes.set(xlim=(FROM, TO), xlabel="t / sqrt(c/g)", ylabel="spin / sqrt(g/c)")
    axes.legend(fontsize=8)
    figure.savefig(path)


if __name__ == "__main__":
    main(sys.argv[1])

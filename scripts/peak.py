"""Share of the machine's peak that the kernel reaches: FMA peak and kernel, measured in turn.

    python scripts/peak.py [--threads 2] [--repeats 9]

The peak is what a loop of independent fused multiply-adds on registers reaches, two flops each.
The kernel's flops are counted by running the generated step on numbers that count: one for each
addition, subtraction, multiplication, division and square root, whatever the hardware takes
for it; a division or root costs it far more, and what is fused counts two, as in the peak.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from sweep.jit import OPTIONS
from sweep.kernels.lanes import BLOCK, LANES, Kernel
from sweep.kernels.stepper import step_source
from sweep.kernels.tableau import DOPRI5
from sweep.models import MODELS

WIDTH = 128
"""Elements of the loop that LLVM vectorises; each carries eight chains, enough to hide an FMA's latency."""

FMAS = 8 * 8
"""Per element and round."""


@numba.njit(parallel=True, **OPTIONS)
def fma_peak(rounds: int, threads: int) -> float:
    total = np.zeros(threads)
    for thread in numba.prange(threads):
        chains = np.ones(8 * WIDTH)
        for _ in range(rounds):
            for i in range(WIDTH):
                a, b, c, d = chains[i], chains[WIDTH + i], chains[2 * WIDTH + i], chains[3 * WIDTH + i]
                e, f, g, h = (chains[4 * WIDTH + i], chains[5 * WIDTH + i],
                              chains[6 * WIDTH + i], chains[7 * WIDTH + i])  # fmt: skip
                for _ in range(8):
                    a, b, c, d = a * 0.99 + 0.01, b * 0.98 + 0.02, c * 0.97 + 0.03, d * 0.96 + 0.04
                    e, f, g, h = e * 0.95 + 0.05, f * 0.94 + 0.06, g * 0.93 + 0.07, h * 0.92 + 0.08
                chains[i], chains[WIDTH + i], chains[2 * WIDTH + i], chains[3 * WIDTH + i] = a, b, c, d
                chains[4 * WIDTH + i], chains[5 * WIDTH + i] = e, f
                chains[6 * WIDTH + i], chains[7 * WIDTH + i] = g, h
        total[thread] = chains.sum()
    return total.sum()


class Counting:
    """A number that counts what is done with it."""

    flops = 0

    def __init__(self, value: float) -> None:
        self.value = value

    def _operate(self, value: float) -> Counting:
        Counting.flops += 1
        return Counting(value)

    def __add__(self, other: Any) -> Counting:
        return self._operate(self.value + plain(other))

    def __sub__(self, other: Any) -> Counting:
        return self._operate(self.value - plain(other))

    def __rsub__(self, other: Any) -> Counting:
        return self._operate(plain(other) - self.value)

    def __mul__(self, other: Any) -> Counting:
        return self._operate(self.value * plain(other))

    def __truediv__(self, other: Any) -> Counting:
        return self._operate(self.value / plain(other))

    def __rtruediv__(self, other: Any) -> Counting:
        return self._operate(plain(other) / self.value)

    def __neg__(self) -> Counting:  # folded into the operation it feeds
        return Counting(-self.value)

    def __gt__(self, other: Any) -> bool:
        return self.value > plain(other)

    def __le__(self, other: Any) -> bool:
        return self.value <= plain(other)

    def sqrt(self) -> Counting:
        return self._operate(self.value**0.5)

    __radd__, __rmul__ = __add__, __mul__


def plain(x: Any) -> float:
    return x.value if isinstance(x, Counting) else x


def flops_per_step() -> int:
    """Of one dopri5 step of the slip model without measurements."""
    model = MODELS["slip"]
    names: dict[str, Any] = {"rhs": model.rhs}
    exec(step_source(DOPRI5, len(model.states)), names)
    y = tuple(map(Counting, (1e-3, 2e-3, 1e-3, 1e-3, -0.05, 1e-5, 1e-5)))
    p = tuple(map(Counting, (100.0, -2.7, 9.1, 1.0, 0.5, 0.05, 0.05, -0.8, 0.98, -0.83, 60.0)))
    Counting.flops = 0
    names["step"](y, p, Counting(0.02))
    measuring = 5 * 9 + 5 * 3 + 18  # dissipation and spin in the weighted stages, their sums
    return Counting.flops - measuring


def kernel_images(kernel: Kernel, cells: int) -> np.ndarray:
    standard = {"a": 10.0, "b": 3.0, "c": 1.0, "delta": 0.03, "mu": 60.0, "n0": 0.05, "x0": 0.01, "y0": 0.01}
    columns = {name: np.full(cells, value) for name, value in standard.items()}
    return kernel.images(columns, np.full(cells, 0.02), 1e6, np.full((6, cells), np.nan), np.full(cells, 3.65))


def seconds(work: Callable[[], Any]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--threads", type=int, default=numba.config.NUMBA_NUM_THREADS)
    parser.add_argument("--repeats", type=int, default=9)
    options = parser.parse_args()
    numba.set_num_threads(options.threads)

    cells, blocks, rounds = LANES * options.threads, 30, 20_000
    kernels = {measure: Kernel(MODELS["slip"], DOPRI5, measure) for measure in ((), ("reversals", "energy_error"))}
    images = {measure: kernel_images(kernel, cells) for measure, kernel in kernels.items()}
    works: dict[Any, Callable[[], Any]] = {"peak": lambda: fma_peak(rounds, options.threads)}
    for measure, kernel in kernels.items():
        works[measure] = lambda k=kernel, i=images[measure]: k.advance(i, np.arange(cells), blocks, False)
    for work in works.values():
        work()
    # In turn, so that a drift of the machine's speed meets all alike.
    times = {name: [] for name in works}
    for _ in range(options.repeats):
        for name, work in works.items():
            times[name].append(seconds(work))

    peak = [2 * FMAS * WIDTH * rounds * options.threads / t / 1e9 for t in times["peak"]]
    print(f"{options.threads} threads; median of {options.repeats} repeats (smallest … largest)")
    print(f"FMA peak: {spread(peak, '.1f')} GFLOP/s")
    flops = flops_per_step()
    for measure in kernels:
        per_step = [t / (blocks * BLOCK * cells) * 1e9 for t in times[measure]]
        share = [flops / t / p for t, p in zip(per_step, peak, strict=True)]
        print(f"slip, dopri5, measuring {' and '.join(measure) or 'nothing'}:")
        print(f"  {spread(per_step, '.2f')} ns a step and trajectory, {flops} flops counted (measurements not)")
        print(f"  {spread([flops / t for t in per_step], '.1f')} GFLOP/s, {spread(share, '.1%')} of peak")


def spread(values: list[float], form: str) -> str:
    return f"{statistics.median(values):{form}} ({min(values):{form}} … {max(values):{form}})"


if __name__ == "__main__":
    main()

"""Share of the machine's peak that the kernels reach: FMA peak and kernels, measured in turn.

The peak is what a loop of independent fused multiply-adds on registers reaches, two flops each.
A kernel's flops are counted by running its generated step on numbers that count: one for each
addition, subtraction, multiplication, division and square root, whatever the hardware takes
for it; a division or root costs it far more, and what is fused counts two, as in the peak.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numba
import numpy as np

from sweep.bench.timing import Effort, Measurement, Part, Spread, in_turn
from sweep.grid import Array
from sweep.jit import OPTIONS
from sweep.kernels.adams import step_lines
from sweep.kernels.lanes import BLOCK, LANES, Kernel, watch_nothing
from sweep.kernels.methods import METHODS
from sweep.kernels.stepper import step_source
from sweep.kernels.tableau import DOPRI5
from sweep.models import MODELS
from sweep.models.coefficients import rattle_period
from sweep.models.slip_split import newton, slow
from sweep.report.cells import MEASURE, make_kernel, never_stable, standard
from sweep.report.rows import Section

WIDTH = 128
"""Elements of the loop that LLVM vectorises; each carries eight chains, enough to hide an FMA's latency."""

FMAS = 8 * 8
"""Per element and round."""

ROUNDS, BLOCKS = 20_000, 60


@numba.njit(parallel=True, **OPTIONS)  # type: ignore[untyped-decorator]
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
    return float(total.sum())


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

    def __eq__(self, other: object) -> bool:
        return bool(self.value == plain(other))

    def __lt__(self, other: Any) -> bool:
        return bool(self.value < plain(other))

    def __gt__(self, other: Any) -> bool:
        return bool(self.value > plain(other))

    def __le__(self, other: Any) -> bool:
        return bool(self.value <= plain(other))

    def sqrt(self) -> Counting:
        return self._operate(self.value**0.5)

    __radd__, __rmul__ = __add__, __mul__
    __hash__ = None  # type: ignore[assignment]


def plain(x: Any) -> Any:
    return x.value if isinstance(x, Counting) else x


def flops_of_dopri5(image: list[Counting]) -> int:
    """Of one step of the slip model without measurements."""
    model = MODELS["slip"]
    names: dict[str, Any] = {"rhs": model.rhs}
    exec(step_source(DOPRI5, len(model.states)), names)
    Counting.flops = 0
    names["step"](tuple(image[:7]), tuple(image[7:18]), Counting(0.02))
    measuring = 5 * 9 + 5 * 3 + 18  # dissipation and spin in the weighted stages, their sums
    return Counting.flops - measuring


def flops_of_adams(image: list[Counting]) -> int:
    """Of one step without measurements."""
    group = [Counting(0.0)] * (len(image) * LANES)
    group[::LANES] = image
    source = "\n".join(["lane = 0", *step_lines(make_kernel("adams", MODELS["slip"], ()).rows, 0)])
    Counting.flops = 0
    exec(
        source, {"slow": slow, "newton": newton, "watch_spin": watch_nothing, "add_work": watch_nothing, "group": group}
    )
    measuring = 3 + 3 + 2 + 1  # a window's share, the time, μ R; the count of steps
    return Counting.flops - measuring


FLOPS: dict[str, Callable[[list[Counting]], int]] = {"dopri5": flops_of_dopri5, "adams": flops_of_adams}


def peak(effort: Effort) -> Part:
    threads = numba.get_num_threads()
    cells = LANES * threads
    cases = {(method, measure): _images(method, measure, cells) for method in METHODS for measure in ((), MEASURE)}
    works: dict[Any, Callable[[], Any]] = {"peak": lambda: fma_peak(ROUNDS, threads)}
    for case, (kernel, images) in cases.items():
        works[case] = partial(kernel.advance, images, np.arange(cells), BLOCKS, False)
    for work in works.values():
        work()
    # Short works, repeated the more: what else the machine does spoils some and spares others.
    times = in_turn(works, replace(effort, repeats=5 * effort.repeats))

    part = Part(Section("Share of the FMA peak"))
    speed = [2 * FMAS * WIDTH * ROUNDS * threads / t / 1e9 for t in times["peak"].values]
    lines = [["method", "measuring", "ns a step and trajectory", "flops a step", "GFLOP/s", "share of the peak, %"]]
    for (method, measure), (_, images) in cases.items():
        flops = FLOPS[method]([Counting(float(value)) for value in images[0]])
        each = times[method, measure].times(1e9 / (BLOCKS * BLOCK * cells))
        rate = Spread(tuple(flops / t for t in each.values))
        share = Spread(tuple(100 * r / p for r, p in zip(rate.values, speed, strict=False)))
        what = " and ".join(measure) or "nothing"
        lines.append([method, what, f"{each:.2f}", str(flops), f"{rate:.1f}", f"{share:.0f}"])
        for quantity, spread in (("ns_a_step", each), ("percent_of_peak", share)):
            part.measurements.append(Measurement("peak", "slip", method, what, "threads", threads, quantity, spread))
    part.measurements.append(Measurement("peak", "", "", "", "threads", threads, "peak_gflops", Spread(tuple(speed))))
    caption = (
        f"{threads} threads, the slip model; peak measured in the same turns: {Spread(tuple(speed)):.1f} GFLOP/s. "
        "Flops of the step alone are counted; measurements take time without counting."
    )
    part.section.tables.append((caption, lines))
    return part


def _images(method: str, measure: tuple[str, ...], cells: int) -> tuple[Kernel, Array]:
    """Kernel and trajectories that run for longer than they are timed."""
    kernel, columns = make_kernel(method, MODELS["slip"], measure), standard(mu=np.full(cells, 60.0))
    images = kernel.images(columns, np.full(cells, 0.02), 1e6, never_stable(cells), rattle_period(columns))
    return kernel, images

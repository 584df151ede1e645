"""Share of the machine's peak that the kernels reach: FMA peak and kernels, measured in turn.

The peak is the rate of a loop of independent fused multiply-adds on registers, two flops each.  A kernel's flops are
counted by running its generated step on numbers that count: one for each addition, subtraction, multiplication,
division and square root.  A division or root takes the hardware far longer than that; a fused multiply-add counts as
two, as in the peak.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numba
import numpy as np
from matplotlib.axes import Axes

from sweep.bench.timing import COLOURS, Effort, Measurement, Part, Spread, in_turn
from sweep.grid import Array
from sweep.jit import OPTIONS, full_width
from sweep.kernels.adams.step import BDF, PREDICTOR_NODES
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK, LANES
from sweep.kernels.runge_kutta import step_source
from sweep.kernels.tableau import DOPRI5
from sweep.models import MODELS
from sweep.models.stiff.slip import STIFF_MODEL, newton, slow
from sweep.report.direct import MEASURE, make_kernel, standard
from sweep.report.rows import Section

WIDTH = 128
"""Elements of the loop that LLVM vectorises.  Each carries eight chains, enough to hide the latency of an FMA."""

FMAS = 8 * 8
"""FMAs per element and round."""

ROUNDS, BLOCKS = 20_000, 60


# The peak is that of the widest vectors that the CPU has, as kernels use them.
_wide = full_width()


@numba.njit(parallel=True, **OPTIONS)  # type: ignore[untyped-decorator]
def fma_peak(rounds: int, threads: int) -> float:
    total = np.zeros(threads)
    for thread in numba.prange(threads):
        _wide()
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
    """A number that counts the operations done with it."""

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

    def __neg__(self) -> Counting:  # free: folded into the operation that uses it
        return Counting(-self.value)

    def __gt__(self, other: Any) -> bool:
        return bool(self.value > plain(other))

    def __le__(self, other: Any) -> bool:
        return bool(self.value <= plain(other))

    def sqrt(self) -> Counting:
        return self._operate(self.value**0.5)

    __radd__, __rmul__ = __add__, __mul__


def plain(x: Any) -> Any:
    return x.value if isinstance(x, Counting) else x


def flops_of_dopri5(image: list[Counting]) -> int:
    """Flops of one step of the slip model without measurements."""
    model = MODELS["slip"]
    names: dict[str, Any] = {"rhs": model.rhs}
    exec(step_source(DOPRI5, len(model.states)), names)
    Counting.flops = 0
    names["step"](tuple(image[:7]), model.constants(*image[7:18]), Counting(0.02))
    measuring = 7 * (5 + 7) + 10  # spin and dissipation in the stages, the sum of the latter
    return Counting.flops - measuring


def flops_of_adams(image: list[Counting]) -> int:
    """Flops of one step without measurements: two evaluations, a Newton step, and sums over the history."""
    p, (u1, u2, M1, M2, M3, v1, v2) = STIFF_MODEL.constants(*image[7:21]), image[:7]
    Counting.flops = 0
    _, geometry = slow(u1, u2, M1, M2, M3, v1, v2, p)
    once = Counting.flops
    newton(u1, u2, v1, v2, geometry, p, Counting(0.02), v1, v2)
    weighted = (
        2 * 2 * (5 * len(PREDICTOR_NODES) + 2 * len(BDF))
    )  # two sums each for slopes and slips, a product and a sum a term
    corrections = 2 * (4 * 3 + 4 * 7 + 4 + 2) + 4 * 3  # residual, P r, new states; slopes as corrected
    return once + Counting.flops + weighted + corrections


FLOPS: dict[str, Callable[[list[Counting]], int]] = {"dopri5": flops_of_dopri5, "adams": flops_of_adams}


HEAD = ["method", "measuring", "ns per step and trajectory", "flops per step", "GFLOP/s", "share, %", "fastest, %"]


def peak(effort: Effort) -> Part:
    threads = numba.get_num_threads()
    cells = LANES * threads
    measures: tuple[tuple[str, ...], ...] = ((), MEASURE)
    cases = {(method, measure): _images(method, measure, cells) for method in FLOPS for measure in measures}
    times = _times(cases, effort, threads)
    speed = times["peak"].inverse(2 * FMAS * WIDTH * ROUNDS * threads / 1e9)
    part, lines, shares = Part(Section("Share of the FMA peak")), [HEAD], {}
    part.measurements.append(Measurement("peak", "", "", "", "threads", threads, "peak_gflops", speed))
    for (method, measure), (_, images) in cases.items():
        flops = FLOPS[method]([Counting(float(value)) for value in images[0]])
        each = times[method, measure].times(1e9 / (BLOCKS * BLOCK * cells))
        rate = each.inverse(flops)
        share = Spread(tuple(100 * r / p for r, p in zip(rate.values, speed.values, strict=False)))
        what = " and ".join(measure) or "nothing"
        shares[method, what] = share
        fastest = 100 * max(rate.values) / max(speed.values)
        lines.append([method, what, f"{each:.2f}", str(flops), f"{rate:.1f}", f"{share:.0f}", f"{fastest:.0f}"])
        for quantity, spread in (("ns_per_step", each), ("percent_of_peak", share)):
            part.measurements.append(Measurement("peak", "slip", method, what, "threads", threads, quantity, spread))
    caption = (
        f"{threads} threads, the slip model; the peak, measured in turn with the kernels, is {speed:.1f} GFLOP/s. "
        "Only the flops of the step count; measurements take time but add none. fastest: the kernel's best turn over "
        "the peak's, which is the better figure on a busy machine."
    )
    part.section.tables.append((caption, lines))
    part.panels.append(lambda axes: _draw(axes, shares))
    return part


def _times(cases: dict[tuple[str, tuple[str, ...]], tuple[Kernel, Array]], effort: Effort, threads: int) -> Any:
    """Seconds of the FMA loop and of each kernel, by name."""
    works: dict[Any, Callable[[], Any]] = {"peak": lambda: fma_peak(ROUNDS, threads)}
    for case, (kernel, images) in cases.items():
        works[case] = partial(kernel.advance, images, np.arange(len(images)), BLOCKS, False)
    for work in works.values():
        work()  # compiles
    # These works are short, so they are repeated more often: some turns escape the machine's other work.
    return in_turn(works, replace(effort, repeats=5 * effort.repeats))


def _draw(axes: Axes, shares: dict[tuple[str, str], Spread]) -> None:
    for place, ((method, what), share) in enumerate(shares.items()):
        reach = np.transpose([share.reach])
        axes.barh(place, share.median, xerr=reach, color=COLOURS[method], height=0.4, capsize=2)
        axes.text(0.5, place - 0.25, f"{method}, measuring {what}", va="bottom", fontsize=8)
    axes.set(title="Share of the FMA peak", xlabel="%", yticks=[])
    axes.set_ylim(len(shares) - 0.5, -0.7)


def _images(method: str, measure: tuple[str, ...], cells: int) -> tuple[Kernel, Array]:
    """A kernel and trajectories that run longer than they are timed, by steps alone."""
    kernel, columns = make_kernel(method, MODELS["slip"], measure), standard(mu=np.full(cells, 60.0))
    images = kernel.images(columns, np.full(cells, 0.02), 1e6)
    if "quiet_after" in kernel.layout:
        images[:, kernel.row("quiet_after")] = np.inf
    return kernel, images

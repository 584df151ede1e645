"""The largest Lyapunov exponent: the mean rate at which a tangent grows (`sweep.kernels.tangent`).

The growth is added up in bins of equal length.  When all `BINS` are full, pairs are merged and bins become twice as
long, so that however long the trajectory is, between half and all of them are full.  The exponent is the mean over the
later half of the full bins, which leaves out the start; its error is their scatter divided by the root of their number,
plus 1/τ, with the length τ of that half.

The scatter is the statistical error for chaotic motion, whose bins are long compared with its memory.  1/τ is the
change of the exponent that another norm of the tangent might cause, a factor of e.  Without it the error was far too
small where a bin is as long as a cycle of regular motion: all bins are alike then, whatever the phase of the cycle
adds.  In regular motion the distance grows like the time at most, so that the exponent of a trajectory of the length T
comes out as ln 2 / (T/2) or less, apart from oscillations of the distance.  See `docs/explanation/regimes.md`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sweep.jit import inline
from sweep.kernels.layout import BLOCK, LANES, Layout, Table
from sweep.kernels.measures.measurement import TANGENT, Measurement, measured
from sweep.kernels.tangent import GROWTH
from sweep.models.model import SPIN, Array, Columns, Model
from sweep.units import RATE

BINS = 32
"""Even; the exponent is the mean over 8 to 16 of them."""

_BIN_NAMES = tuple(f"bin{k}" for k in range(BINS))

_FEWEST = 8
"""Full bins below which there is no exponent: the trajectory has ended after fewer looks."""


class Lyapunov(Measurement):
    name = "lyapunov"
    summary = "largest Lyapunov exponent, with its statistical error, at three times the cost; with dopri5 alone"
    asks = SPIN
    cost = 3.0
    follows = frozenset({TANGENT})
    quantities = ("bin_width", "bin_looks", "bin_growth", "full_bins", *_BIN_NAMES)

    variables = {
        "lyapunov": measured(
            "float64", RATE, "largest Lyapunov exponent",
            "Largest Lyapunov exponent over the later half of the trajectory.",
        ),
        "lyapunov_error": measured("float64", RATE, "standard error of the Lyapunov exponent"),
    }  # fmt: skip

    def start(self, model: Model, columns: Columns, rattle: Array) -> Mapping[str, Array | float]:
        return {"bin_width": 1.0}

    def make_look(self, layout: Layout):
        WIDTH, LOOKS, SUM, FULL, FIRST, GREW, DONE = map(
            layout.at, ("bin_width", "bin_looks", "bin_growth", "full_bins", "bin0", GROWTH, "done")
        )

        @inline
        def look(group, lane, seen):
            # A block cut short by the end does not count.
            if seen.running & (group[DONE + lane] % BLOCK == 0.0):
                group[SUM + lane] += group[GREW + lane]
                group[LOOKS + lane] += 1.0
                if group[LOOKS + lane] == group[WIDTH + lane]:
                    full = int(group[FULL + lane])
                    group[FIRST + full * LANES + lane] = group[SUM + lane]
                    group[SUM + lane] = group[LOOKS + lane] = 0.0
                    if full + 1 == BINS:
                        for k in range(BINS // 2):
                            pair = FIRST + 2 * k * LANES + lane
                            group[FIRST + k * LANES + lane] = group[pair] + group[pair + LANES]
                        group[WIDTH + lane] *= 2.0
                        full = BINS // 2 - 1
                    group[FULL + lane] = full + 1.0

        return look

    def read(self, table: Table, times: Array) -> Mapping[str, Array]:
        full = table["full_bins"][:, None]
        length = table["bin_width"] * BLOCK * table["step"]
        rates = table.columns(_BIN_NAMES) / length[:, None]
        place = np.arange(BINS)
        used = (place >= full - full // 2) & (place < full)
        number = used.sum(axis=1)
        enough = full[:, 0] >= _FEWEST
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.where(used, rates, 0).sum(axis=1) / number
            scatter = np.where(used, (rates - mean[:, None]) ** 2, 0).sum(axis=1)
            error = np.sqrt(scatter / (number - 1) / number + (number * length) ** -2.0)
        return {"lyapunov": np.where(enough, mean, np.nan), "lyapunov_error": np.where(enough, error, np.nan)}

"""A small sweep with cells of many kinds, for the explorer."""

from pathlib import Path

import pytest
import xarray as xr
from support import Write

import sweep
from sweep.explorer.setup import Setup
from sweep.explorer.slices import Source, open_source
from sweep.kernels.status import LIFT_OFF, TIME_LIMIT, Doubt

TEXT = """\
name: tiny
body: {a: 10.0, b: {start: 2, stop: 5, num: 4}, delta: 0.03}
friction: {mu: {start: 40, stop: 80, num: 5}}
start: {n0: [0.02, 0.05], x0: 0.01, y0: 0.01}
integrator: {method: dopri5, t_end: 1500}
measure: [reversals, margin, energy_error, resting_spin]
"""


@pytest.fixture(scope="session")
def tiny(kept: Write) -> Path:
    """A dataset over mu (5), b (4) and n0 (2).

    At n0 = 0.05 the cell (0, 0) is made one that lifted off, (1, 0) one that settled, (2, 0) a lower bound, and (3, 0)
    one limited by round-off.
    """
    config = kept(TEXT, "tiny.yaml")
    dataset = sweep.run(config)
    status = dataset["status"].values
    status[:3, 0, 1] = LIFT_OFF, 1, TIME_LIMIT
    status[3, 0, 1] = 1
    dataset["doubts"].values[:] = 0
    dataset["doubts"].values[3, 0, 1] = Doubt.ROUND_OFF
    path = config.with_suffix(".nc")
    dataset.to_netcdf(path)
    return path


@pytest.fixture(scope="session")
def source(tiny: Path) -> Source:
    return open_source(tiny)


@pytest.fixture(scope="session")
def setup(source: Source) -> Setup:
    return Setup(source)


@pytest.fixture
def opened(tiny: Path) -> xr.Dataset:
    return xr.load_dataset(tiny, decode_times=False)

"""What can be read in a figure, and a run to draw."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.results.dataset import VARIABLES, described


def entries(figure: Figure) -> list[str]:
    """The words of the legends below a figure."""
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def maps(figure: Figure) -> list[Axes]:
    """The panels of a figure, without its colour bars."""
    return [axes for axes in figure.axes if axes.get_xlabel() or axes.get_title()]


def constants(figure: Figure) -> str:
    """The words over the legend."""
    return figure.legends[0].get_title().get_text()


def made(**axes: Any) -> xr.Dataset:
    """A run over these axes: counts rise with mu, the critical spins fall with it, and one cell is a lower bound."""
    mu = np.asarray(axes.get("mu", np.linspace(20, 200, 10)), float)
    b = np.asarray(axes.get("b", np.linspace(2, 9, 8)), float)
    n0 = np.asarray(axes.get("n0", [0.05]), float)
    shape = (len(mu), len(b), len(n0))
    count = np.broadcast_to((mu // 20)[:, None, None], shape)
    status = np.full(shape, SETTLED)
    status[2, 3, 0] = TIME_LIMIT
    n_c1 = np.broadcast_to(1.0 / mu[:, None, None], (*shape[:2], 1)) * [1, -1]
    values = {
        "reversals": count,
        "reversals_predicted": count + 2,
        "status": status,
        "spin_final": np.broadcast_to(np.linspace(-0.1, 0.02, len(mu))[:, None, None], shape),
        "doubts": np.zeros(shape),
        "n_c1_linear": n_c1,
        "n_c1": 3 * n_c1,
        "n_c2": 2 * n_c1,
    }
    variables = {
        name: xr.Variable(
            ("mu", "b", "sign" if VARIABLES[name].along else "n0"),
            v.astype(VARIABLES[name].dtype),
            described(VARIABLES[name]),
        )
        for name, v in values.items()
    }
    constants = {"a": 10.0, "c": 1.0, "delta": 0.03}
    attributes = {"title": "made", "sweep_kind": "run"}
    return xr.Dataset(variables, {"mu": mu, "b": b, "n0": n0, "sign": [1, -1], **constants}, attributes)

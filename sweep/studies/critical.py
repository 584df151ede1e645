"""Critical spins in three ways: the paper's formulas, the model's eigenvalues, and simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from sweep.config import Config, ConfigError, Fault, Values
from sweep.engine import executor
from sweep.engine.plan import plan
from sweep.grid import Array, Grid
from sweep.kernels.kernel import Kernel
from sweep.kernels.status import FAILURES, RUNNING
from sweep.models import MODELS
from sweep.models.coefficients import rattle_period
from sweep.models.linear import growth_rate
from sweep.parameters import START
from sweep.prediction import Prediction, predict
from sweep.results import dataset
from sweep.results.dataset import EXISTS, NO_COUPLING, NO_FRICTION, NOT_FOUND
from sweep.results.provenance import provenance
from sweep.studies.stepwise import stepwise

WIDTH = 1e-3
"""Relative width down to which simulation brackets a critical spin."""

TINY = 1e-8
"""Start contact point of the rattle whose growth is measured, in c: so small that it is linear to sixteen digits."""

# Growth is measured between two series of samples: one that begins when the other mode has decayed, and a
# later one.  Both beginnings are in units of the time in which the slower mode decays by a factor e at rest.
_FIRST_SERIES, _SECOND_SERIES = 5.0, 13.0
_SAMPLES = 24


@dataclass(frozen=True)
class Bracket:
    """Two spins between which a critical spin lies; arrays over the bodies, NaN where it was not found."""

    inner: Array
    """The end nearer zero, where the critical event does not happen yet."""
    outer: Array
    """The far end, where it happens."""

    @property
    def middle(self) -> Array:
        return (self.inner + self.outer) / 2


def critical(config: Config, width: float = WIDTH, note: Callable[[str], None] = lambda _: None) -> xr.Dataset:
    """Critical spins over all axes of `config` except n0.

    n_c1 is the spin beyond which a tiny rattle grows.  Its simulation follows a rattle of size `TINY`
    and measures the growth of its energy once the other mode has decayed.  n_c2 is the spin beyond
    which the trajectory from the configuration's start point reverses.  Its simulation counts
    reversals.  Both are found by bisection on n0, for all bodies at once.

    Parameters
    ----------
    width : of the brackets, relative to the spin
    note : called with a line before each bisection

    Returns
    -------
    Dataset over the axes without n0: each `*_simulated` with its bracket `*_inner`, `*_outer`, and
    `critical_reason`, which says why a spin is NaN.

    Raises
    ------
    ConfigError
        if the model is a formula, or the start point is an axis.
    """
    config = stepwise(config)
    if beyond := sorted((START - {"n0"}) & set(config.axes)):
        raise ConfigError([Fault("critical", None, None, ("start", beyond[0]), "an axis; allowed: a number")])
    grid = Grid.of(_without_n0(config))
    prediction = predict(MODELS[config.model], grid)
    arrays: dict[str, Array] = dict(dataset.predicted(prediction))
    arrays.pop("reversals_predicted", None)
    columns = grid.columns()
    reason = _reasons(prediction, columns, grid)
    arrays["critical_reason"] = reason
    search = np.flatnonzero(reason == EXISTS)
    for sign, side in ((1, "plus"), (-1, "minus")):
        for name, happens in (("n_c1", _rattle_grows), ("n_c2", _reverses)):
            note(f"{name} {side}: bisection over {len(search)} bodies")
            bracket = _bisect(config, happens, columns, search, sign, width)
            for suffix, values in (("", bracket.middle), ("_inner", bracket.inner), ("_outer", bracket.outer)):
                arrays[f"{name}_{side}_simulated{suffix}"] = values
            reason[search[np.isnan(bracket.middle[search])]] = NOT_FOUND
    attributes = {"relative_width": width, **provenance(config, 0.0, grid.size)}
    return dataset.label(config, grid, arrays, attributes).drop_vars("n0")


def _without_n0(config: Config) -> Config:
    """`config` with a single start spin, since no critical spin depends on it."""
    parameters = config.parameters | {"n0": Values((0.0,), False, 0.0)}
    cases = None if config.cases is None else {name: v for name, v in config.cases.items() if name != "n0"}
    return replace(config, parameters=parameters, cases=cases or None)


def _reasons(prediction: Prediction, columns: dict[str, Array], grid: Grid) -> Array:
    if prediction.formulas is None:
        return np.full(grid.size, NO_FRICTION)
    assert prediction.stability is not None  # it is a model
    upper = prediction.stability.n_c1[0][grid.bodies()[1]]
    reason = np.where(np.isinf(upper), NO_COUPLING, np.where(np.isnan(upper), NO_FRICTION, EXISTS))
    return np.where(columns["mu"] == 0, NO_FRICTION, reason)


def _bisect(
    config: Config, happens: Callable[..., Array], columns: dict[str, Array], search: Array, sign: int, width: float
) -> Bracket:
    """Bracket the |n0| beyond which something `happens`, for the cells `search`, all at once; `sign` is that of n0."""
    cells = len(columns["a"])
    inner, outer = np.zeros(cells), np.full(cells, 1e-3)

    def ask(which: Array, size: Array) -> Array:
        return happens(config, {n: v[which] for n, v in columns.items()} | {"n0": sign * size})

    # Double the spin until the event happens.
    walking = search
    while len(walking):
        yes = ask(walking, outer[walking])
        inner[walking[~yes]] = outer[walking[~yes]]
        walking = walking[~yes]
        outer[walking] *= 2
        walking = walking[outer[walking] < 2]
    lost = np.setdiff1d(np.arange(cells), search[outer[search] < 2])
    open_ = np.setdiff1d(search, lost)
    while len(open_):
        middle = (inner[open_] + outer[open_]) / 2
        yes = ask(open_, middle)
        outer[open_[yes]], inner[open_[~yes]] = middle[yes], middle[~yes]
        open_ = open_[outer[open_] - inner[open_] > width * outer[open_]]
    inner[lost] = outer[lost] = np.nan
    return Bracket(sign * inner, sign * outer)


def _reverses(config: Config, columns: dict[str, Array]) -> Array:
    """Whether trajectories reverse at least once."""
    kernel, images = _images(config, columns, ("reversals",), config.integrator.t_end)
    executor.execute(kernel, images, stop_when_settled=True)
    reverses = images[:, kernel.row("reversals")] > 0
    # A body that leaves the plane, or whose trajectory fails otherwise, is not below its critical spin.
    return np.asarray(reverses | np.isin(images[:, kernel.row("status")], FAILURES))


def _rattle_grows(config: Config, columns: dict[str, Array]) -> Array:
    """Whether a tiny rattle grows, by the mean logarithm of its energy in two series of samples.

    The energy ripples within a period.  The samples of a series are spaced so that the ripple averages
    out; what is left of it blurs the critical spin by less than 1e-4.
    """
    tiny = columns | {"x0": np.full_like(columns["n0"], TINY), "y0": np.full_like(columns["n0"], TINY)}
    model = MODELS[config.model]
    decay = -growth_rate(model, model.constants.of(tiny), np.zeros_like(columns["n0"]))
    kernel, images = _images(config, tiny, (), float(2 * _SECOND_SERIES / decay.min()))
    step, interval = images[:, kernel.row("step")], rattle_period(tiny) / (2 * np.pi)
    means = []
    for begin in (_FIRST_SERIES / decay, _SECOND_SERIES / decay):
        logs = []
        for sample in range(_SAMPLES):
            _continue_to(kernel, images, np.round((begin + sample * 1.618 * interval) / step))
            logs.append(np.log(_rattle(kernel, images)))
        means.append(np.mean(logs, axis=0))
    return np.asarray(means[1] > means[0])


def _continue_to(kernel: Kernel, images: Array, steps: Array) -> None:
    """Advance the trajectories until they have made this number of steps."""
    images[:, kernel.row("goal")] = steps
    images[:, kernel.row("status")] = RUNNING
    executor.execute(kernel, images, stop_when_settled=False)


def _rattle(kernel: Kernel, images: Array) -> Array:
    """Energy of the rattle, shape (cells,)."""
    _, rattle, _ = kernel.model.energy(*kernel.unpack(images))
    return np.asarray(np.broadcast_to(rattle, len(images)))


def _images(config: Config, columns: dict[str, Array], measure: tuple[str, ...], t_end: float) -> tuple[Kernel, Array]:
    """Kernel and images of the cells `columns`, laid out as a sweep of them would be."""
    integrator = config.integrator.model_copy(update={"t_end": t_end})
    cases = {name: tuple(values.tolist()) for name, values in columns.items()}
    (part,) = plan(replace(config, parameters={}, cases=cases, measure=measure, integrator=integrator)).parts
    return part.kernel, part.images

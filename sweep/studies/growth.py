"""The spin n_c1 beyond which a tiny rattle grows, by simulation.

A rattle that is followed until its fastest-growing mode stands out takes long, and if it grows too far it turns the
spin by which it was to be judged.  So here each component of the rattle is disturbed by itself, for one rattle period.
The disturbances at the end make up the propagator of the linear motion, whose largest eigenvalue is that mode.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sweep.config import Config
from sweep.engine.plan import plan
from sweep.grid import Array, Grid
from sweep.kernels.kernel import Kernel
from sweep.kernels.methods import PLAIN
from sweep.kernels.status import TIME_LIMIT
from sweep.kernels.tableau import DOPRI5
from sweep.models.model import Columns, Model, stack
from sweep.models.theory.linear import jacobian
from sweep.models.theory.stability import SPIN_LIMIT
from sweep.studies.bracket import FAILED, HAPPENS, NOT_YET, Bracket, Question, search
from sweep.studies.rounds import Batch, Rounds, Simulations
from sweep.studies.stepwise import stepwise

TINY = 1e-30
"""Size of a disturbance: its square is nothing beside one, and it stays tiny when it grows by a factor of 1e20."""

# Angle by which the leading modes advance in a step.  It shifts a growth rate by 3e-4 of its fifth power times the
# frequency.  Over 300 bodies (a = 1.5 … 50, |δ| <= 0.5, μ = 0.1 … 5000) growth rates at n_c1 are off by up to 1.2e-5 of
# the decay rate at rest, and in 99 % of them by 1e-7; with an angle of 0.03 by up to 1.4e-3 (effective model).
_RADIANS = 0.01
_STABILITY_SHARE = 0.9

# Largest logarithm by which a disturbance grows or decays.
_GROWTH = 10.0

# The search begins at this share of the decay rate at rest, below any n_c1: spin changes growth rates by rates of its
# own order.  Over 3000 of those bodies the smallest n_c1 was 0.14 of it.
_BELOW_ALL = 0.02


def find_n_c1(
    config: Config,
    bodies: Columns,
    sign: Array,
    expected: Array,
    width: float,
    rounds: Rounds,
    settled: Callable[[Array], None] = lambda share: None,  # noqa: ARG005
) -> Bracket:
    """The first |spin|, outwards from zero, at which a tiny rattle grows.

    Parameters
    ----------
    bodies : parameters, each of shape (cells,); the start is of no account
    sign : of all spins, shape (cells,)
    expected : |spin| that the eigenvalues give, shape (cells,).  Where it is right, all spins of the search are
        simulated at once.  Growth is simulated below it all the same, and the bracket lies wherever that begins
    rounds : run or recall the simulations
    settled : as of `bracket.search`
    """
    first = {name: values[:1] for name, values in bodies.items()}
    (part,) = plan(stepwise(config), Grid({}, {}, first)).parts

    def growth(cells: Array, spin: Array) -> Array:
        return simulated_growth(part.kernel, {name: v[cells] for name, v in bodies.items()}, spin, rounds)

    def ask(question: Question) -> tuple[Array, Array]:
        rate = growth(question.search, sign[question.search] * question.size)
        return np.where(np.isnan(rate), FAILED, np.where(rate >= 0, HAPPENS, NOT_YET)), -rate

    decay = -growth(np.arange(len(sign)), np.zeros(len(sign)))
    begin = np.fmax(_BELOW_ALL * decay, 1e-12)
    limit = SPIN_LIMIT * float(part.kernel.model.spin_unit(bodies).max())
    return search(ask, begin, limit, width, expected, precisely=True, settled=settled)


def simulated_growth(kernel: Kernel, bodies: Columns, spin: Array, rounds: Rounds) -> Array:
    """Growth rate of the rattle at constant `spin`, in sqrt(g/c), shape (cells,): negative where it decays.

    NaN where a simulation failed.

    Parameters
    ----------
    kernel : of dopri5, as the states that its images start from are replaced
    bodies : physical parameters, each of shape (cells,); the start point is of no account
    rounds : run or recall the simulations
    """
    model = kernel.model
    columns = {**bodies, "n0": spin, "x0": np.zeros_like(spin), "y0": np.zeros_like(spin)}
    rattle = [i for i in range(len(model.states)) if i != model.spin_state]
    duration, step = _duration_and_step(model, columns)

    def start() -> Batch:
        images = np.repeat(kernel.images(columns, step, duration), len(rattle), axis=0)
        states = kernel.states(images)
        states[:] = np.repeat(stack(model.upright(spin)), len(rattle), axis=1)
        for disturbance, component in enumerate(rattle):
            states[component, disturbance :: len(rattle)] = TINY
        spins, rattles, inertia = model.energy(*kernel.unpack(images))
        kernel.table(images)["energy"] = rattles + 0.5 * inertia * spins**2
        return {PLAIN: Simulations(kernel, images)}

    def read(batch: Batch) -> dict[str, Array]:
        images = batch[PLAIN].images
        sound = (kernel.table(images)["status"] == TIME_LIMIT).reshape(len(spin), len(rattle)).all(axis=1)
        disturbed = kernel.states(images)[rattle].reshape(len(rattle), len(spin), len(rattle)).swapaxes(0, 1)
        propagator = np.where(sound[:, None, None], disturbed / TINY, 1.0)
        growth = np.log(np.abs(np.linalg.eigvals(propagator)).max(axis=-1)) / duration
        return {"growth": np.where(sound, growth, np.nan)}

    return np.asarray(rounds.answer(start, read, stop_when_settled=False)["growth"])


def _duration_and_step(model: Model, columns: Columns) -> tuple[Array, Array]:
    """How long to simulate a tiny rattle at the start spin, and a step that is accurate and stable for it.

    The automatic step of dopri5 allows for all the energy to go into the rattle, and would be far too short here.
    """
    values = np.linalg.eigvals(jacobian(model, model.constants.of(columns), columns["n0"]))
    growth = np.abs(values.real.max(axis=-1))
    leading = -values.real <= np.maximum(np.abs(values.imag), 4 * growth[:, None])
    with np.errstate(divide="ignore"):
        duration = np.minimum(model.slower_period(columns), _GROWTH / growth)
        accurate = _RADIANS / np.where(leading, np.abs(values), 0.0).max(axis=-1)
        stable = _STABILITY_SHARE * DOPRI5.real_stability / np.abs(values).max(axis=-1)
    return duration, np.minimum(np.minimum(accurate, stable), duration)

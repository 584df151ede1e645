"""Define what a model is, and explain how to add one.

A model is a system of autonomous ordinary differential equations y' = f(y) for the motion of a rattleback near upright
spin.  It lives in one file, which defines one `Model` by the name `MODEL`; enter it in `sweep.models.__init__`.
Kernels, executor, store and plots then work with it.  `averaged` is a short example.

1. Choose the states so that all but one vanish in upright spin; the remaining one carries the spin
   (`states`, `spin_state`).  A rattle then keeps its relative precision however small it becomes.
2. Compute the coefficients and the starts of many cells at once, from arrays of parameters (`constants`, `start`).
3. Write `rhs` and `energy` for one trajectory, on scalars.
4. Declare what the model depends on and what it offers (`parameters`, `offers`).
5. Declare how fast it moves: by `slower_period` for counts, by `upright` or `fastest_motion` for steps, and by
   `fastest_decay` if friction or anything else makes the model stiff.

The conditions for settling and the displayed series have defaults that add no instruction to a kernel.

A user's model (`sweep.models.user`) may describe any body.  If the body has no steady upright spin, none of its states
has to vanish: the model does not offer `Offer.LINEAR`, gives its `fastest_motion`, and settles where its function
`decided` says so.

`constants.of`, `start` and `energy` are called when a run is prepared, `rhs` in every stage of a step, and `energy`
again at every check.  The linear theory (`sweep.models.theory.linear`) calls `upright` and `rhs`, the latter with
complex states.

Units: lengths in c, times in sqrt(c/g), spins in sqrt(g/c), the mass is one.  Equations that hold in any units give the
value of sqrt(g/c) in their own units (`spin_unit`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.jit import inline, nothing
from sweep.models.origin import Origin
from sweep.parameters import Parameter

Array = NDArray[Any]
Columns = Mapping[str, Array]
"""Physical parameters by name: arrays of a common shape (cells,)."""


class Offer(StrEnum):
    """What a model may offer."""

    COUNT = "count"
    """A number of reversals."""
    SPIN = "spin"
    """The spin as a function of time."""
    ENERGY = "energy"
    """An energy that only friction changes."""
    MODES = "modes"
    """Two rocking modes that the linear theory of the slip model describes, which alone change the spin."""
    FORMULAS = "formulas"
    """Takano's formulas for the critical spins and the number of reversals."""
    ENDING = "ending"
    """Slow equations that predict how a small rattle ends, also with a couple that damps the spin."""
    LINEAR = "linear"
    """The spins between which a tiny rattle decays, by the eigenvalues of its Jacobian, at which trajectories may
    settle."""
    REVERSAL_TIME = "reversal_time"
    """Garcia and Hubbard's formula for the time of the first reversal."""


OWN = "own"
"""Units of a model that uses neither the paper's nor SI: the labels of the dataset then name no unit."""


def zeros(columns: Columns) -> Array:
    """Zeros, shape (cells,)."""
    return np.zeros_like(next(iter(columns.values())))


@dataclass(frozen=True)
class Ripple:
    """How the spin of a model ripples with its rattle."""

    names: tuple[str, ...]
    """Names of the coefficients."""
    of: Callable[[Columns], tuple[Array, ...]]
    """(columns) -> the coefficients, each of shape (cells,)."""
    value: Callable[..., Any]
    """Inline, (states, constants, coefficients) -> n - n*, in sqrt(g/c)."""


NO_RIPPLE = Ripple((), lambda columns: (), nothing)
"""Used for a model whose spin does not ripple."""


@inline
def never_decided(y, p):
    """The default `decided`: nothing is known besides the linear theory."""
    return False


def never_upright(spin) -> tuple[Any, ...]:
    """The default `upright`: the model has no such motion."""
    raise NotImplementedError


def never_rocks(columns: Columns) -> Array:
    """The default `slower_period`: the model has no rocking to average over."""
    return zeros(columns) + np.inf


@dataclass(frozen=True, kw_only=True)
class Assumptions:
    """What holds in a scene.  Code that relies on one of these reads it here."""

    isotropic: bool = True
    """Whether all directions in the plane are alike: turned about the vertical, a start gives the same motion, turned.
    The equations about upright spin then have constant coefficients, and half a turn of a body changes nothing."""
    conservative: bool = True
    """Whether only friction and couples change the energy above rest, so that it is never larger than at the start."""
    steady_upright: bool = True
    """Whether a body without rattle can spin upright at a constant rate, apart from couples that damp it."""


PLAIN = Assumptions()
"""All of them hold."""


@dataclass(frozen=True, kw_only=True)
class Tier:
    """One rung of the ladder of models: equations of motion, or a formula."""

    name: str
    """As in the configuration."""
    summary: str
    """One line for the documentation."""
    parameters: tuple[str, ...] = ()
    """Names of the physical parameters that it depends on; `sweep.parameters` explains them."""
    offers: frozenset[Offer]
    """What it offers."""
    positive: frozenset[str] = frozenset()
    """Parameters by which the model divides, although `sweep.parameters` allows zero."""
    counts: str = "reversals"
    """The variable that its number of reversals is: for a tier that is not simulated, one of its predictions."""
    impossible: Callable[[Columns], Array] = lambda columns: zeros(columns).astype(bool)
    """(columns) -> whether there is no such body, or it does not stand upright at rest, shape (cells,).  No other
    function is called for such a body."""


@dataclass(frozen=True, kw_only=True)
class Model(Tier):
    """A rung that is simulated: its equations of motion, and optional further knowledge about it.

    The functions called "inline" are marked `sweep.jit.inline`.  They become part of the kernel, where they work on
    the scalars of one trajectory.  Called from Python they also take arrays, real or complex, so that energies and
    Jacobians come from the very same code.  They consist of plain arithmetic, without branches or loops, so
    that the loop over lanes can be vectorised.
    """

    # The equations, which every model has.
    states: tuple[str, ...]
    """Names of the states, in the order in which all functions take and return them."""
    spin_state: int
    """Index of the state that carries the spin; all others vanish in upright spin."""
    constants: type[Any]
    """The coefficients of the right-hand side by name: a `NamedTuple` class whose classmethod `of` computes them
    from columns of parameters, each coefficient of shape (cells,)."""
    start: Callable[[Columns], tuple[Array, ...]]
    """(columns) -> the states at t = 0, each of shape (cells,)."""
    rhs: Callable[..., tuple[Any, ...]]
    """Inline, (states, constants) -> (derivatives, (spin, dissipated power, normal force, Painlevé denominator)).
    Of the last three, a model that lacks them returns the literals 0.0, 1.0 and 1.0."""
    energy: Callable[..., tuple[Any, ...]]
    """Inline, (states, constants) -> (spin n, energy of the rattle, moment of inertia J of the spin).  Rattle + J n²/2
    is the energy above rest, which only friction changes.  Every term must keep its relative precision however
    small the rattle is: no difference of numbers of order one may be taken."""
    tilt: Callable[..., Any] = nothing
    """Inline, (states) -> sin² of the angle by which the body is tilted from upright spin.  The variables of a model
    with this function end at a right angle, where the body has toppled; by default there is no such limit."""

    # How fast it moves, rocks and decays: steps, the average of the spin, and predictions follow from it.
    slower_period: Callable[[Columns], Array] = never_rocks
    """(columns) -> period of the slower rocking about upright rest, shape (cells,); infinite if there is none.  The
    spin is averaged over it before its changes of sign are counted."""
    upright: Callable[..., tuple[Any, ...]] = never_upright
    """(spin) -> the states of steady upright spin without rattle.  A model that does not offer `Offer.LINEAR` may
    have `fastest_motion` instead."""
    characteristic: Callable[[Any, Any], tuple[Any, ...]] | None = None
    """(n, constants) -> the seven coefficients, lowest power first, of the characteristic polynomial in λ of the rattle
    in steady upright spin n, up to a common factor, by sums and products alone, because n may be a polynomial; by
    default the linear theory takes the Jacobian, which needs several times as long."""
    fastest_motion: Callable[[Columns], Array] | None = None
    """(columns) -> bound on the rate of the fastest motion that steps have to resolve, in sqrt(g/c), shape (cells,); by
    default the largest eigenvalue about upright spin."""
    extremes: Callable[[Columns], tuple[Columns, ...]] = lambda columns: (columns,)
    """(columns) -> the columns whose linear motions bound the fastest motion; by default the same ones."""
    radians_a_step: float = 0.07
    """Phase through which the fastest motion advances in one step of a fifth-order method at the default
    tolerance.  On the slip model 0.07 gives errors in spin at t = 400 of 3e-9 and 1e-8 (a = 10, b = 3, n0 = 0.05 and
    0.1, μ = 20, where accuracy determines the step); they fall as its fifth power."""
    fastest_decay: Callable[[Columns], Array] = zeros
    """(columns) -> bound on |λ| of the fastest damped mode anywhere on the trajectory, in sqrt(g/c), shape (cells,).
    It limits the step of an explicit method.  By default nothing is stiff."""
    ripple: Ripple = NO_RIPPLE
    """How the spin ripples with the rattle, for the ripple-free spin whose changes of sign are counted."""

    # When a trajectory may end because its spin can reverse no more, apart from the linear theory.
    decided: Callable[..., Any] = never_decided
    """Inline, (states, constants) -> whether the spin can reverse no more, so that the trajectory settles, whatever the
    linear theory says; by default it adds no instruction.  It is evaluated at every check."""
    faint: str = ""
    """Name of the constant that is the energy of the rattle below which friction is linear; "" if it always is.  Only a
    rattle below it may settle."""

    # What trajectories and labels show, and in which units.
    observe: Callable[[Array, Any], dict[str, Array]] = lambda y, p: {}
    """(states, of shape (states, samples); constants, each of shape (samples,)) -> the series that a single trajectory
    shows besides spin and energy, by names that `sweep.studies.trajectory` or `series` explains."""
    series: tuple[tuple[str, str, str], ...] = ()
    """Name, CF unit and meaning of each series that only this model can `observe`."""
    turned: Callable[[Columns], Array] = zeros
    """(columns) -> angle from the axes of the states to x and y, along which a trajectory shows vectors, of shape
    (cells,)."""
    path: Callable[..., Any] | None = None
    """Inline, (states, along, across, constants) -> (heading', along', across'), the rates at which a body turns about
    the vertical and its contact point travels over the table (`sweep.models.attitude`); None for a model that has no
    attitude.  The first two states are then u1 and u2."""
    spin_unit: Callable[[Columns], Array] = lambda columns: zeros(columns) + 1
    """(columns) -> sqrt(g/c) in the model's own units, shape (cells,): by default the unit itself.  Tolerances and the
    largest spin that the linear theory looks at are in sqrt(g/c), whatever the units are."""
    units: str = OWN
    """Units of a user's model, for the labels: "paper", "SI" or "own"."""

    assumes: Assumptions = PLAIN
    """What holds in its scene."""
    variant: Any = None
    """The `sweep.models.general.common.Variant` behind a variant for any body; None for other models."""

    # Additions for a user's model.
    own_parameters: tuple[Parameter, ...] = ()
    """Parameters of a user's model that are not in `sweep.parameters`."""
    origin: Origin | None = None
    """The origin of a user's model; None for a model of the package."""

    @property
    def damped(self) -> bool:
        """Whether a couple may damp the spin; it is assumed for a model that a user brings."""
        return bool(self.variant.couples) if self.variant else bool(self.origin)

    @property
    def key(self) -> str:
        """The name of its compiled code, which differs from that of every other model."""
        return f"{self.name}@{self.origin.digest}" if self.origin else self.name


def take(record: Any, cells: Any) -> Any:
    """Select the cells with the indices `cells` from a record of arrays, such as constants, or from columns."""
    if isinstance(record, Mapping):
        return {name: values[cells] for name, values in record.items()}
    return type(record)(*(values[cells] for values in record))


def stack(columns: tuple[Array, ...]) -> Array:
    """Stack arrays or numbers as the rows of one array, broadcast against each other."""
    return np.stack(np.broadcast_arrays(*columns))

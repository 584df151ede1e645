"""What a model is: implement this and kernel, executor, store and plots work.

A model is a system of ordinary differential equations y' = f(y) with constant coefficients for
the motion of a rattleback near upright spin.  It lives in one file, which defines one `MODEL`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Columns = Mapping[str, Array]
"""Physical parameters by name: arrays of one common shape (cells,)."""


def nothing_decays(columns: Columns) -> Array:
    """No mode is stiff."""
    return np.zeros_like(columns["a"])


@dataclass(frozen=True)
class Tier:
    """One rung of the ladder of models, be it equations of motion or a formula."""

    name: str
    summary: str
    parameters: tuple[str, ...]
    """Names of the physical parameters it depends on, `sweep.parameters` has their meaning."""
    measures: tuple[str, ...]
    """What can be measured on it, of `sweep.kernels.lanes.MEASURES`."""


@dataclass(frozen=True)
class Model(Tier):
    """A rung that is simulated.

    The functions marked `sweep.jit.inline` dissolve into the kernel, where they work on the scalars
    of one trajectory.  Called from Python they take arrays too, real or complex: starts, energies
    and Jacobians are computed with the very same code.
    """

    states: tuple[str, ...]
    spin_state: int
    """Index of the state that carries the spin; all others vanish in upright spin."""
    constants: Callable[[Columns], tuple[Array, ...]]
    """Coefficients of the right-hand side, each of shape (cells,)."""
    start: Callable[[Columns], tuple[Array, ...]]
    """States at t = 0, each of shape (cells,)."""
    upright: Callable[..., tuple[Any, ...]]
    """Inline, spin -> states: steady upright spin without rattle."""
    rhs: Callable[..., tuple[Any, ...]]
    """Inline, (states, constants) -> (derivatives, (spin, dissipated power, normal force,
    Painlevé denominator)); what a model lacks of the last three is a literal 0.0, 1.0, 1.0."""
    energy: Callable[..., tuple[Any, ...]]
    """Inline, (states, constants) -> (spin, energy of the rattle, inertia J of the spin):
    rattle + J n²/2 is the energy above rest, which friction alone changes.  Each term must keep
    its relative precision however small the rattle is."""
    fastest_decay: Callable[[Columns], Array] = nothing_decays
    """Bound on |λ| of the fastest damped mode anywhere on the trajectory, shape (cells,); it
    limits the step of an explicit method.  By default nothing is stiff."""
    radians_a_step: float = 0.07
    """Phase of the fastest motion in one step of a fifth-order method.  On the slip model 0.07 gives
    spin errors at t = 400 (a = 10, b = 3, n0 = 0.05 and 0.1, μ = 20, where accuracy decides) of 3e-9
    and 1e-8; they fall as its fifth power."""
    observe: Callable[[Array, Array], dict[str, Array]] = lambda y, p: {}  # noqa: ARG005
    """States (n, samples) and constants (k, 1) -> what a trajectory shows beside spin and energy,
    by names that `sweep.results.dataset` explains."""


def stack(columns: tuple[Array, ...]) -> Array:
    """Arrays (or numbers) as the rows of one array, broadcast against each other."""
    return np.stack(np.broadcast_arrays(*columns))

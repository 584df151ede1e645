"""The time of the first reversal of any rigid body that does not slip, a problem solved by Garcia and Hubbard (1988).

To lowest order in rattle and spin, and averaged over the rattle, three quantities change: the spin n and the energies
E_k of the two modes of rocking, all per unit mass.  With J = J33,

    J n' = -2 Σ σ_k E_k,   E_k' = 2 σ_k n E_k.

These are Takano's (ndotab) and (abdot) without friction: 2 σ_1 = k1 and 2 σ_2 = -k4, up to the order of the modes.

The σ_k.  About the contact point the contact force has no torque, so that at n = 0 the spin changes by the term of
second order in the motion of that point, with the height h of G and the radii of curvature R1 and R2,

    J n' = h (R1 - R2) u1' u2'   on average (compare H in `sweep.models.theory.ripple`).

A mode u = e q of u1, u2 with the matrix of inertia M has E = q'² eᵀ M e on average, hence
2 σ_k = -h (R1 - R2) e1 e2 / (eᵀ M e).  Summed over both modes e eᵀ / (eᵀ M e) is M⁻¹; divided by ν_k² first, it is the
inverse of the stiffness, which is diagonal.  These two sums give e1 e2 for each mode, and for any misalignment

    2 σ_k = ± h (R1 - R2) (M⁻¹)_12 ν_k² / (ν_2² - ν_1²),   + for the lower mode, - for the higher,

with the (M⁻¹)_12 = (1/M_1 - 1/M_2) sin(2 ξ)/2 of the moments of inertia M_1, M_2 of the two oscillations and the
angle ξ between their axes and those of the curvature.  So it is a product of misalignment, difference of the inverse
moments, difference of the radii and squared frequency: the four factors that Kondo and Nakanishi (2017,
arXiv:1704.06717, abstract) name for the formula of Garcia and Hubbard.  The two σ are proportional to the squared
frequencies, with opposite signs.

(R1 - R2) (M⁻¹)_12 is an element of R M⁻¹ - M⁻¹ R, which is the same along all axes.  Along those of the inertia, which
are the axes of the states, it is R_12 (1/M_2 - 1/M_1), where R_12 = k_12/g is that of the stiffness k.

The time.  Where only the growing mode counts, (n - n_c)² + 2 E/J = N² is conserved, n_c being the spin at which the
mode neither grows nor decays: zero without friction, the critical spin of (abdot) with it.  So

    n - n_c = N tanh(|σ| N (t_0 - t)),
    t_r = [asinh((n0 - n_c)/sqrt(2 E0/J)) + artanh(n_c/N)] / (|σ| N)

for n0 > 0, and by reflection for n0 < 0.  With n_c = 0 this is log((N + n0)/(N - n0)) over 2 |σ| N.  This neglects the
other mode, which decays, and all terms of higher order in n0/ν and in the rattle.
"""

from __future__ import annotations

import numpy as np

from sweep.models.general import rigid_body, starts
from sweep.models.general.surfaces import ELLIPSOID, Surface
from sweep.models.model import Array, Columns, zeros
from sweep.models.theory.ripple import matrix
from sweep.models.theory.rocking import frequencies


def growth(columns: Columns, surface: Surface = ELLIPSOID) -> tuple[Array, Array]:
    """σ of the slower and of the faster mode, half the rate per spin at which its energy grows, shape (cells,)."""
    of, arm = rigid_body.rocking(columns, surface), rigid_body.height(columns) / rigid_body.gravity(columns)
    lower, higher = frequencies(of)
    coupling = arm * of.C22 * (of.B12 + of.B21)
    with np.errstate(divide="ignore", invalid="ignore"):
        shared = coupling / (2 * (higher**2 - lower**2))
    # If a body is round in both directions, the modes are arbitrary, and nothing is coupled.
    shared = np.where(coupling == 0, 0.0, shared)
    return shared * lower**2, -shared * higher**2


def energies(columns: Columns, surface: Surface = ELLIPSOID) -> tuple[Array, Array]:
    """Energies of the slower and of the faster mode at the start, per unit mass, shape (cells,)."""
    of = rigid_body.rocking(columns, surface)
    # With u multiplied by the roots of the moments of inertia, these are one, and the stiffness has the eigenvalues ν².
    root1, root2 = np.sqrt(1 / of.B12), np.sqrt(-1 / of.B21)
    mixed = -of.C22 / (root1 * root2)
    _, modes = np.linalg.eigh(matrix(-of.C21 / root1**2, mixed, mixed, of.C12 / root2**2))
    u1, u2, w1, w2, w3 = starts.rolling(columns, surface)
    u3 = -np.sqrt(1 - u1**2 - u2**2)
    moves = u2 * w3 - u3 * w2, u3 * w1 - u1 * w3  # u' = u × ω
    weighted = (np.stack([root1 * x, root2 * y], axis=-1) for x, y in ((u1, u2), moves))
    q, p = (np.einsum("...i,...ik->k...", each, modes) for each in weighted)
    lower, higher = 0.5 * (np.stack(frequencies(of)) ** 2 * q**2 + p**2)
    return lower, higher


def first_reversal(columns: Columns, n_c: tuple[Array, Array], surface: Surface = ELLIPSOID) -> Array:
    """Predict the time of the first reversal, in the model's units, shape (cells,).

    It is NaN where nothing couples spin and rattle, there is no spin to reverse, the mode that would grow has no
    energy, friction stops the reversal, or the formula does not cover the body or its friction.

    Parameters
    ----------
    n_c : the critical spins n_c1+ and n_c1-, shape (cells,): zero without slip, NaN where they are not known
    """
    n0 = starts.spin(columns, surface)
    side = np.sign(n0)
    slower, faster = growth(columns, surface)
    grows_slower = slower * side > 0
    sigma = np.abs(np.where(grows_slower, slower, faster))
    e = 2 * np.where(grows_slower, *energies(columns, surface)) / rigid_body.inertia(columns)[2]
    critical = np.abs(np.where(side > 0, *n_c))
    beyond = np.abs(n0) - critical
    N = np.sqrt(beyond**2 + e)
    with np.errstate(divide="ignore", invalid="ignore"):
        time = (np.arcsinh(beyond / np.sqrt(e)) + np.arctanh(critical / N)) / (sigma * N)
    predicted = ~_unknown(columns) & (sigma > 0) & (n0 != 0) & (e > 0) & (critical < N)
    return np.where(predicted, time, np.nan)


def _unknown(columns: Columns) -> Array:
    """Where a couple resists the motion, or upright spin is no steady motion, shape (cells,)."""
    named = [columns[name] for name in ("sigma", "mu_rolling", "mu_spinning", "Ixz", "Iyz") if name in columns]
    return np.asarray(np.any([zeros(columns), *named], axis=0))

"""Explicit Runge-Kutta methods as data: Butcher tableaus.

A record holds what the kernel and the choice of the step need.  To add a method, write its record and enter it in
`TABLEAUS`; `tests/kernels/test_tableau.py` then checks it.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction as F


@dataclass(frozen=True)
class Tableau:
    """The Butcher tableau of an explicit Runge-Kutta method for autonomous systems, and how long its steps may be.

    `a[i]` holds the weights of the slopes 0 … i in the argument of slope i + 1, `b` those in the result, and `c` the
    abscissae.  They are exact fractions, so that the tests find a mistyped entry.
    """

    name: str
    """As in the configuration."""
    code: int
    """The number that stands for it in datasets; it must never change."""
    summary: str
    """One line for the documentation."""
    order: int
    a: tuple[tuple[F, ...], ...]
    b: tuple[F, ...]
    c: tuple[F, ...]
    real_stability: float
    """Largest z with |R(-z)| <= 1: the limit of h |λ| for real negative λ."""
    phase: float
    """Error constant: the phase of the fastest motion in a step at the default tolerance, in units of
    `Model.radians_a_step`.  The error falls with the power `order` of it."""
    layer_error: float
    """Error constant of the start: the relative error of the slip while it goes from zero to the value that follows
    from the slow motion, v' = λ (1 - v).  For short steps h it is |C| (h λ)^order / e, where the stability function is
    R(-z) = exp(-z) + C z^(order + 1) + …; give that at h λ = `LAYER_STEP`, whether or not such a step is stable."""

    automatic: bool = False
    """Whether `method: auto` may choose it."""

    @property
    def stages(self) -> int:
        return len(self.b)


LAYER_STEP = 3.0
"""Step, in decay times of the slip, to which `Tableau.layer_error` is scaled."""

# Dormand & Prince (1980), J. Comput. Appl. Math. 6, 19, table 2: RK5(4)7M.  Its seventh stage
# is left out: it serves only the embedded error estimate, which a fixed step does not use.
DOPRI5 = Tableau(
    name="dopri5",
    code=0,
    summary="the Runge-Kutta formula of order five by Dormand and Prince, with a fixed step, for every model",
    order=5,
    a=(
        (F(1, 5),),
        (F(3, 40), F(9, 40)),
        (F(44, 45), F(-56, 15), F(32, 9)),
        (F(19372, 6561), F(-25360, 2187), F(64448, 6561), F(-212, 729)),
        (F(9017, 3168), F(-355, 33), F(46732, 5247), F(49, 176), F(-5103, 18656)),
    ),
    b=(F(35, 384), F(0), F(500, 1113), F(125, 192), F(-2187, 6784), F(11, 84)),
    c=(F(0), F(1, 5), F(3, 10), F(4, 5), F(8, 9), F(1)),
    real_stability=3.3066,
    phase=1.0,
    layer_error=0.02,
    automatic=True,
)

TABLEAUS = (DOPRI5,)
"""All tableaus; the first runs every model."""

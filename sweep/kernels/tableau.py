"""Explicit Runge-Kutta methods as data: Butcher tableaus, which check themselves when they are made.

A record says what the kernel and the choice of the step need.  To add a method, write its record and enter it in
`TABLEAUS`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction as F
from math import prod


@dataclass(frozen=True)
class Tableau:
    """The Butcher tableau of an explicit Runge-Kutta method for autonomous systems, and how long its steps may be.

    `a[i]` holds the weights of the slopes 0 … i in the argument of slope i + 1, `b` those in the
    result, and `c` the abscissae.  They are exact fractions, so that a mistyped entry is found at once.

    Raises
    ------
    ValueError
        if the lengths do not match, a row sum differs from its abscissa, an order condition up to `order`
        (Butcher 2016, section 31: one for each rooted tree) is not met exactly, or `real_stability` is not the end
        of the real stability interval.
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
    """Error constant of the start: the share of the slip's change that steps of `LAYER_STEP` decay times get wrong
    while the slip, at first zero, comes to the value that the slow motion asks for.  It falls with the same power."""

    def __post_init__(self) -> None:
        if not len(self.a) + 1 == len(self.b) == len(self.c):
            raise ValueError(f"{self.name}: rows, weights and abscissae do not match")
        for row, node in zip(self.a, self.c[1:], strict=True):
            if sum(row) != node:
                raise ValueError(f"{self.name}: row {row} does not sum to its abscissa {node}")
        for tree in (each for order in range(1, self.order + 1) for each in trees(order)):
            weights = zip(self.b, self._weights(tree), strict=True)
            if sum((b * weight for b, weight in weights), F(0)) != F(1, _density(tree)):
                raise ValueError(f"{self.name}: the order condition of the tree {tree} = 1/{_density(tree)} fails")
        inside, outside = (abs(self.stability(-self.real_stability * s)) for s in (0.999, 1.001))
        if not inside < 1 < outside:
            raise ValueError(f"{self.name}: {self.real_stability} does not bound the real stability interval")

    @property
    def stages(self) -> int:
        return len(self.b)

    def stability(self, z: complex) -> complex:
        """The stability function R(z): one step of y' = λ y multiplies y by R(hλ)."""
        slopes: list[complex] = [1]
        for row in self.a:
            slopes.append(1 + z * sum(float(w) * k for w, k in zip(row, slopes, strict=True)))
        return 1 + z * sum(float(w) * k for w, k in zip(self.b, slopes, strict=True))

    def _weights(self, tree: Tree) -> list[F]:
        """The elementary weights of a rooted tree, one for each stage."""
        product = [F(1)] * self.stages
        for branch in tree:
            inner = self._weights(branch)
            sums = [sum((w * x for w, x in zip(row, inner, strict=False)), F(0)) for row in ((), *self.a)]
            product = [x * y for x, y in zip(product, sums, strict=True)]
        return product


Tree = tuple["Tree", ...]
"""A rooted tree: the trees that its root carries, in order."""


def trees(order: int) -> set[Tree]:
    """All rooted trees of so many nodes."""
    return {grown for tree in trees(order - 1) for grown in _grown(tree)} if order > 1 else {()}


def _grown(tree: Tree) -> Iterator[Tree]:
    """All trees that one more leaf makes of a tree."""
    yield tuple(sorted((*tree, ())))
    for i, branch in enumerate(tree):
        for grown in _grown(branch):
            yield tuple(sorted((*tree[:i], grown, *tree[i + 1 :])))


def _nodes(tree: Tree) -> int:
    return 1 + sum(map(_nodes, tree))


def _density(tree: Tree) -> int:
    return _nodes(tree) * prod(map(_density, tree))


LAYER_STEP = 3.0
"""Steps, in decay times of the slip, at which `Tableau.layer_error` is measured."""

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
)

TABLEAUS = (DOPRI5,)
"""The methods of this kind; the first runs every model."""

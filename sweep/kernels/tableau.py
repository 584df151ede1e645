"""Explicit Runge-Kutta methods as data: Butcher tableaus, which check themselves when they are made."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction as F


@dataclass(frozen=True)
class Tableau:
    """The Butcher tableau of an explicit Runge-Kutta method for autonomous systems.

    `a[i]` holds the weights of the slopes 0 … i in the argument of slope i + 1, `b` those in the
    result, and `c` the abscissae.  They are exact fractions, so that a mistyped entry is found at once.

    Raises
    ------
    ValueError
        if the lengths do not match, a row sum differs from its abscissa, an order condition up to `order`
        (at most 5; Butcher 2016, table 301(I)) is not met exactly, or `real_stability` is not the end of
        the real stability interval.
    """

    name: str
    order: int
    a: tuple[tuple[F, ...], ...]
    b: tuple[F, ...]
    c: tuple[F, ...]
    real_stability: float
    """Largest z with |R(-z)| <= 1: the limit of h |λ| for real negative λ."""

    def __post_init__(self) -> None:
        if not len(self.a) + 1 == len(self.b) == len(self.c):
            raise ValueError(f"{self.name}: rows, weights and abscissae do not match")
        for row, node in zip(self.a, self.c[1:], strict=True):
            if sum(row) != node:
                raise ValueError(f"{self.name}: row {row} does not sum to its abscissa {node}")
        for label, tree, density in self._conditions():
            if sum((b * t for b, t in zip(self.b, tree, strict=True)), F(0)) != F(1, density):
                raise ValueError(f"{self.name}: order condition {label} = 1/{density} fails")
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

    def _conditions(self) -> list[tuple[str, list[F], int]]:
        """The order conditions, one for each rooted tree up to `order`: name, elementary weights, density."""
        c = list(self.c)
        one = [F(1)] * len(c)

        def A(v: list[F]) -> list[F]:
            return [F(0)] + [sum((w * x for w, x in zip(row, v, strict=False)), F(0)) for row in self.a]

        def mul(*vs: list[F]) -> list[F]:
            out = one
            for v in vs:
                out = [x * y for x, y in zip(out, v, strict=True)]
            return out

        trees = {
            1: [("b", one, 1)],
            2: [("bc", c, 2)],
            3: [("bc2", mul(c, c), 3), ("bAc", A(c), 6)],
            4: [("bc3", mul(c, c, c), 4), ("bcAc", mul(c, A(c)), 8),
                ("bAc2", A(mul(c, c)), 12), ("bAAc", A(A(c)), 24)],
            5: [("bc4", mul(c, c, c, c), 5), ("bc2Ac", mul(c, c, A(c)), 10),
                ("b(Ac)2", mul(A(c), A(c)), 20), ("bcAc2", mul(c, A(mul(c, c))), 15),
                ("bcAAc", mul(c, A(A(c))), 30), ("bAc3", A(mul(c, c, c)), 20),
                ("bA(cAc)", A(mul(c, A(c))), 40), ("bAAc2", A(A(mul(c, c))), 60),
                ("bAAAc", A(A(A(c))), 120)],
        }  # fmt: skip
        return [condition for order in range(1, self.order + 1) for condition in trees[order]]


# Dormand & Prince (1980), J. Comput. Appl. Math. 6, 19, table 2: RK5(4)7M.  Its seventh stage
# is left out: it serves only the embedded error estimate, which a fixed step does not use.
DOPRI5 = Tableau(
    name="dopri5",
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
)

"""No entry of a tableau is mistyped, and the end of its real stability and its cost are right."""

from collections.abc import Iterator
from fractions import Fraction
from math import e, factorial, prod

import numpy as np
import pytest

from sweep.kernels.methods import METHODS
from sweep.kernels.runge_kutta import LAYER_STEP, TABLEAUS, RungeKutta

Tree = tuple["Tree", ...]
"""A rooted tree: the trees that its root carries, in order."""


def trees(order: int) -> set[Tree]:
    """All rooted trees with `order` nodes."""
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


def _weights(tableau: RungeKutta, tree: Tree) -> list[Fraction]:
    """The elementary weights of a rooted tree, one for each stage."""
    product = [Fraction(1)] * tableau.stages
    for branch in tree:
        inner = _weights(tableau, branch)
        sums = [sum((w * x for w, x in zip(row, inner, strict=False)), Fraction(0)) for row in ((), *tableau.a)]
        product = [x * y for x, y in zip(product, sums, strict=True)]
    return product


def stability(tableau: RungeKutta, z: complex) -> complex:
    """The stability function R(z): one step of y' = λ y multiplies y by R(hλ)."""
    slopes: list[complex] = [1]
    for row in tableau.a:
        slopes.append(1 + z * sum(float(w) * k for w, k in zip(row, slopes, strict=True)))
    return 1 + z * sum(float(w) * k for w, k in zip(tableau.b, slopes, strict=True))


@pytest.mark.parametrize("tableau", TABLEAUS, ids=lambda tableau: tableau.name)
def test_no_entry_is_mistyped(tableau: RungeKutta) -> None:
    """By the row sums, the order conditions (Butcher 2016, section 31: one for each tree) and the stability."""
    assert [sum(row) for row in ((), *tableau.a)] == list(tableau.c)
    for tree in (each for order in range(1, tableau.error_order + 1) for each in trees(order)):
        weights = zip(tableau.b, _weights(tableau, tree), strict=True)
        assert sum((b * weight for b, weight in weights), Fraction(0)) == Fraction(1, _density(tree)), tree
    inside, outside = (abs(stability(tableau, -tableau.real_stability * s)) for s in (0.999, 1.001))
    assert inside < 1 < outside
    assert tableau.step_cost == pytest.approx(tableau.stages / 6)


@pytest.mark.parametrize("tableau", TABLEAUS, ids=lambda tableau: tableau.name)
def test_the_error_constant_of_the_start_is_that_of_a_slip_that_sets_in(tableau: RungeKutta) -> None:
    """A message gives the number for a new method."""
    tall: Tree = ()
    for _ in range(tableau.error_order):
        tall = (tall,)
    power = sum(b * weight for b, weight in zip(tableau.b, _weights(tableau, tall), strict=True))
    expected = abs(float(power) - 1 / factorial(tableau.error_order + 1)) * LAYER_STEP**tableau.error_order / e
    assert tableau.layer_error == pytest.approx(expected, rel=0.5), f"layer_error={expected:.2g}"
    step, times = 0.01, 0.01 * np.arange(400)
    error = np.abs(stability(tableau, -step) ** np.arange(400) - np.exp(-times)).max()
    assert expected * (step / LAYER_STEP) ** tableau.error_order == pytest.approx(error, rel=0.02)


def test_the_codes_of_methods_are_those_of_old_datasets() -> None:
    codes = {name: method.code for name, method in METHODS.items()}
    assert codes | {"dopri5": 0, "adams": 1} == codes
    assert len({*codes.values()}) == len(codes)

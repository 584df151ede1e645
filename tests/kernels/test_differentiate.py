"""Traced derivatives of right-hand sides, against complex steps."""

from dataclasses import replace

import numpy as np
import pytest

from sweep.kernels.differentiate import Dual, make_extended
from sweep.models import MODELS, find
from sweep.models.general.laws import LAWS
from sweep.models.symbols import specialised

COUPLES = ("slip+viscous+sigma+rolling", "noslip+solid+sigma+rolling")


@pytest.mark.parametrize("name", [*MODELS, *(f"slip+{law}" for law in LAWS), "noslip+solid", *COUPLES])
def test_it_is_the_derivative_by_a_complex_step(name: str) -> None:
    model, random = find(name), np.random.default_rng(1)
    n, extended = len(model.states), make_extended(find(name))
    constants = model.constants(*random.uniform(0.5, 1.5, len(model.constants._fields)))
    for _ in range(20):
        y, v = random.uniform(-0.2, 0.2, n), random.normal(size=n)
        slopes, _ = extended((*y, *v), constants)
        stepped, _ = model.rhs(tuple(y + 1e-30j * v), constants)
        scale = np.abs(slopes).max()
        np.testing.assert_allclose(slopes[:n], np.real(stepped), rtol=1e-12, atol=1e-13 * scale)
        np.testing.assert_allclose(slopes[n:], np.imag(stepped) / 1e-30, rtol=1e-9, atol=1e-12 * scale)


def test_every_operation_has_its_derivative() -> None:
    """As difference quotients have it, on both sides of a bend."""

    def function(x: object, y: object) -> list[object]:
        return [
            x + y, 2 - x, x * y * 3, y / x, 1 / y, x / 2, -x, x**3, np.sqrt(y), abs(x), np.exp(x), np.log(y), np.sin(x),
            np.cos(x), np.tanh(x), np.square(y), np.minimum(x, y), np.maximum(x, 0.1), np.minimum(0.1, y) * x,
        ]  # fmt: skip

    def both(x: object, y: object, dx: object, dy: object) -> tuple[tuple[object, object], ...]:
        return tuple((each.value, each.slope) for each in function(Dual(x, dx), Dual(y, dy)))

    along = specialised(both, x=None, y=None, dx=None, dy=None)
    for at in ((0.7, 0.4), (-0.3, 0.8), (0.05, 0.06)):
        ahead, behind = (function(at[0] + h * 0.6, at[1] - h * 0.8) for h in (1e-6, -1e-6))
        for (value, slope), here, after, before in zip(
            along(*at, 0.6, -0.8), function(*at), ahead, behind, strict=True
        ):
            assert value == pytest.approx(here)
            assert slope == pytest.approx((after - before) / 2e-6, rel=1e-8, abs=1e-8)


def test_constants_need_not_be_finite() -> None:
    """A bound of infinity bounds nothing, and what is not a number stays so."""
    model = find("averaged")

    def rhs(y: tuple[object, ...], p: object) -> object:
        slopes, rest = model.rhs(y, p)
        return (*(np.maximum(np.minimum(slope, np.inf), -np.inf) for slope in slopes[:-1]), np.nan), rest

    y = np.linspace(0.1, 0.4, 2 * len(model.states))
    p = model.constants(*np.linspace(0.5, 1.5, len(model.constants._fields)))
    expected, _ = make_extended(model)(y, p)
    found, _ = make_extended(replace(model, rhs=rhs))(y, p)
    n = len(model.states)
    np.testing.assert_array_equal(found, (*expected[: n - 1], np.nan, *expected[n:-1], 0.0))


def test_a_branch_is_refused() -> None:
    with pytest.raises(TypeError, match="greater cannot be differentiated"):
        np.greater(Dual(1.0, 0.0), 0)
    with pytest.raises(TypeError, match="a branch cannot"):
        bool(Dual(1.0, 0.0))

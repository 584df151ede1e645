"""The tableau refuses any mistyped entry and knows its own stability."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
from scipy.integrate import RK45

from sweep.kernels.tableau import DOPRI5


def test_equals_scipys_dormand_prince() -> None:
    assert [[float(w) for w in row] for row in DOPRI5.a] == [list(RK45.A[i, :i]) for i in range(1, 6)]
    assert [float(w) for w in DOPRI5.b] == list(RK45.B)


@pytest.mark.parametrize("stage", range(5))
def test_refuses_a_wrong_entry(stage: int) -> None:
    row = list(DOPRI5.a[stage])
    row[0] += Fraction(1, 1000)
    with pytest.raises(ValueError, match="does not sum"):
        replace(DOPRI5, a=(*DOPRI5.a[:stage], tuple(row), *DOPRI5.a[stage + 1 :]))


def test_refuses_weights_that_miss_an_order_condition() -> None:
    b = list(DOPRI5.b)
    b[0], b[2] = b[0] + Fraction(1, 1000), b[2] - Fraction(1, 1000)
    with pytest.raises(ValueError, match="order condition bc "):
        replace(DOPRI5, b=tuple(b))


def test_refuses_a_row_that_keeps_its_sum() -> None:
    row = list(DOPRI5.a[3])
    row[0], row[1] = row[0] + Fraction(1, 1000), row[1] - Fraction(1, 1000)
    with pytest.raises(ValueError, match="order condition"):
        replace(DOPRI5, a=(*DOPRI5.a[:3], tuple(row), DOPRI5.a[4]))


@pytest.mark.parametrize("wrong", [3.0, 3.5])
def test_refuses_a_wrong_stability_interval(wrong: float) -> None:
    with pytest.raises(ValueError, match="real stability"):
        replace(DOPRI5, real_stability=wrong)

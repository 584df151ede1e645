"""A tableau refuses any mistyped entry, knows its own stability, and is all that another method needs."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest
from scipy.integrate import RK45

from sweep.kernels.methods import METHODS
from sweep.kernels.tableau import DOPRI5, trees


def test_equals_scipys_dormand_prince() -> None:
    assert [[float(w) for w in row] for row in DOPRI5.a] == [list(RK45.A[i, :i]) for i in range(1, 6)]
    assert [float(w) for w in DOPRI5.b] == list(RK45.B)


def test_there_are_as_many_order_conditions_as_rooted_trees() -> None:
    """Their numbers are those of Butcher (2016), table 300(I)."""
    assert [len(trees(order)) for order in range(1, 8)] == [1, 1, 2, 4, 9, 20, 48]


def shifted(row: tuple[Fraction, ...], *changes: int) -> tuple[Fraction, ...]:
    """A row with thousandths added to its entries."""
    more = (*changes, *[0] * (len(row) - len(changes)))
    return tuple(w + Fraction(change, 1000) for w, change in zip(row, more, strict=True))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        *(({"a": (*DOPRI5.a[:i], shifted(DOPRI5.a[i], 1), *DOPRI5.a[i + 1 :])}, "does not sum") for i in range(5)),
        ({"a": (*DOPRI5.a[:3], shifted(DOPRI5.a[3], 1, -1), DOPRI5.a[4])}, "order condition"),
        ({"b": shifted(DOPRI5.b, 1, 0, -1)}, r"order condition of the tree \(\(\),\) = 1/2"),
        ({"order": 6}, "order condition"),
        ({"real_stability": 3.0}, "real stability"),
        ({"real_stability": 3.5}, "real stability"),
    ],
)
def test_refuses_a_wrong_entry(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        replace(DOPRI5, **wrong)


def test_the_codes_of_methods_are_those_of_old_datasets() -> None:
    assert {name: method.code for name, method in METHODS.items()} == {"dopri5": 0, "adams": 1}

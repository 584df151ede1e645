"""A tableau refuses any mistyped entry, knows its own stability, and is all that another method needs."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy.integrate import RK45
from support import ROOT

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


ANOTHER = """
import json
from fractions import Fraction as F
from sweep.kernels import tableau
tableau.TABLEAUS += (tableau.Tableau(
    name="rk4", code=2, summary="the classical formula", order=4,
    a=((F(1, 2),), (F(0), F(1, 2)), (F(0), F(0), F(1))),
    b=(F(1, 6), F(1, 3), F(1, 3), F(1, 6)), c=(F(0), F(1, 2), F(1, 2), F(1)),
    real_stability=2.7853, phase=0.3, layer_error=0.1),)

import sweep
from sweep.bench.section import colour, marker
from sweep.kernels.methods import METHODS
from sweep.results.dataset import VARIABLES

scene = {"model": "averaged", "friction": {"mu": 20}, "start": {"n0": 0.1}, "measure": []}
def run(**settings):
    found = sweep.run(scene, t_end=400, stop_when_settled=False, **settings)
    return float(found.spin_final), float(found.step)
exact, _ = run(method="dopri5", step=0.02)
print(json.dumps({
    "errors": [abs(run(method="rk4", step=step)[0] - exact) for step in (0.8, 0.4, 0.2)],
    "automatic": [run(method="rk4", tolerance=tolerance) for tolerance in (1e-6, 1e-10)],
    "exact": exact,
    "codes": VARIABLES["method"].flags,
    "drawn": [colour("rk4"), marker("rk4")],
    "known": [*METHODS],
}))
"""


def test_another_method_is_one_record() -> None:
    """It runs, converges at its order and keeps the tolerance; configuration, datasets and bench know it."""
    done = subprocess.run([sys.executable, "-c", ANOTHER], cwd=ROOT, capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert np.diff(np.log2(found["errors"])) == pytest.approx(-4, abs=0.1)
    (loose, long), (tight, short) = found["automatic"]
    assert abs(loose - found["exact"]) < 1e-6
    assert abs(tight - found["exact"]) < 1e-10
    assert long / short == pytest.approx(10, rel=0.02)  # the fourth root of the ratio of the tolerances
    assert found["codes"] == {"0": "dopri5", "1": "adams", "2": "rk4"}
    assert "rk4" in found["known"]
    assert all(found["drawn"])


def test_the_codes_of_methods_are_those_of_old_datasets() -> None:
    assert {name: method.code for name, method in METHODS.items()} == {"dopri5": 0, "adams": 1}

"""What the scripts share, of which no other test makes use: the scripts themselves need hours or tools of others."""

import importlib
from math import sqrt

import numpy as np
import pytest
from support import ROOT, columns

from sweep.models.ladder import slip
from sweep.models.model import take


def test_traced_equations_are_those_of_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "scripts")
    called = []

    def counted(x: float) -> float:
        called.append(x)
        return sqrt(x)

    rhs = importlib.import_module("tracing").traced_rhs(slip.MODEL, counted)
    y, constants = (0.1, -0.05, 0.2, 0.1, 0.3, 0.01, -0.02), take(slip.Constants.of(columns(mu=75.0)), 0)
    slopes, extras = rhs(y, constants)
    np.testing.assert_allclose([*slopes, *extras], np.hstack(slip.rhs(y, constants)), rtol=1e-15)
    assert called

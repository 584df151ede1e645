"""Starts, limits and bounds of the full model; `test_general` has its equations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import columns, newton

from sweep.models.ladder import slip
from sweep.models.model import stack


@given(
    st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-1, 1), st.floats(-0.5, 0.5)
)  # fmt: skip
def test_start_puts_the_contact_where_asked(x0: float, y0: float, n0: float, delta: float) -> None:
    u1, u2, w1, w2, w3, v1, v2 = (float(s[0]) for s in slip.MODEL.start(columns(x0=x0, y0=y0, n0=n0, delta=delta)))
    u = np.array([u1, u2, -np.sqrt(1 - u1**2 - u2**2)])
    np.testing.assert_allclose(newton.contact(u, {"a": 10, "b": 3, "c": 1, "delta": delta})[:2], [x0, y0], atol=1e-14)
    np.testing.assert_allclose([w1, w2, w3], n0 * u, atol=1e-15)
    assert (v1, v2) == (0, 0)


@pytest.mark.parametrize("start", [{}, {"n0": 0.2}, {"x0": 5.0, "y0": 1.5}, {"b": 9.9}, {"b": 1.01}, {"a": 1.0}])
def test_fastest_decay_bounds_the_slip_at_the_start(start: dict[str, float]) -> None:
    body = columns(**start)
    y, p = stack(slip.MODEL.start(body)).astype(complex), slip.MODEL.constants.of(body)
    block = np.empty((2, 2))
    for j in range(2):
        shifted = y.copy()
        shifted[5 + j] += 1e-30j
        slopes, _ = slip.MODEL.rhs(shifted, p)
        block[:, j] = [slopes[5].imag[0] / 1e-30, slopes[6].imag[0] / 1e-30]
    rate = -np.linalg.eigvals(block).real.min()
    assert rate * 0.98 <= slip.MODEL.fastest_decay(body)[0] <= 12 * rate


def test_without_friction_nothing_is_stiff() -> None:
    assert slip.MODEL.fastest_decay(columns(mu=0.0)) == 0

"""The approach to a failure, against SciPy on the equations derived another way."""

import numpy as np
import pytest
from support import ENDED, ENDS, columns, newton

from sweep.kernels.failure import approach
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX, RUNNING, TOPPLED
from sweep.models import MODELS
from sweep.models.ladder import slip
from sweep.models.model import Array, stack


def met(body: dict[str, np.ndarray], stretch: float) -> tuple[Array, ...]:
    """What cells meet within so long a time from their start."""
    cells = len(body["a"])
    return approach(
        MODELS["slip"], stack(slip.MODEL.start(body)), slip.MODEL.constants.of(body), np.full(cells, stretch)
    )


@pytest.mark.parametrize("kind", ENDS)
def test_failures_with_their_times_and_spins(kind: int) -> None:
    body = columns(**ENDS[kind])
    (status,), (time,), (spin,), (doubt,) = met(body, 5.0)
    expected, expected_spin, height, force, determinant = newton.end(**ENDS[kind], t_end=5.0)
    assert (expected, expected_spin) == pytest.approx(ENDED[kind], abs=1e-9)
    assert status == kind
    assert time == pytest.approx(expected, abs=1e-7)
    assert spin == pytest.approx(expected_spin, abs=3e-9 + 3 * doubt)
    assert doubt < 1e-6
    # And SciPy ended there for the same reason.
    assert (height < 1e-6, abs(force) < 1e-6) == (kind == TOPPLED, kind == LIFT_OFF)
    assert (abs(determinant) < 1e-3 or force > 1e3) == (kind == PARADOX)


def test_a_stretch_without_failure_is_passed() -> None:
    body = columns(**ENDS[LIFT_OFF])
    _, (time,), *_ = met(body, 5.0)
    (status,), (passed,), *_ = met(body, 0.999 * time)
    assert (status, passed) == (RUNNING, 0.999 * time)
    assert met(body, 1.001 * time)[0] == LIFT_OFF


def test_the_paradox_may_have_a_finite_force() -> None:
    """Numerator and denominator of the force go to zero together: which sign a step meets first is chance."""
    body = {"a": 12.8, "b": 2.4, "c": 1.71, "delta": 0.16, "mu": 172.0, "n0": 1.0, "x0": 2.93, "y0": 0.241}
    (status,), (time,), *_ = met(columns(**body), 2.0)
    assert status == PARADOX
    assert time == pytest.approx(0.72344473, abs=1e-7)  # SciPy's DOP853 on the independent equations


def test_states_that_cannot_be_followed() -> None:
    body = columns()
    states = stack(slip.MODEL.start(body))
    states[2] = np.nan
    (status,), (time,), *_ = approach(MODELS["slip"], states, slip.MODEL.constants.of(body), np.ones(1))
    assert (status, time) == (DIVERGED, 0.0)


def test_each_cell_by_itself() -> None:
    bodies = {name: np.array([end[name] for end in ENDS.values()]) for name in columns()}
    together = met(bodies, 5.0)
    for i in range(len(ENDS)):
        alone = met({name: values[[i]] for name, values in bodies.items()}, 5.0)
        assert (alone[0][0], alone[1][0]) == (together[0][i], together[1][i])

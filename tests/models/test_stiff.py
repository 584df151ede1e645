"""The variables of the stiff method."""

import numpy as np
import pytest
from support import columns

from sweep.models.ladder import slip
from sweep.models.stiff.modes import slow_rates
from sweep.models.stiff.slip import form_of

FORM = form_of(slip.MODEL)
STIFF_MODEL = FORM.model


def test_no_function_takes_the_states_of_another_model() -> None:
    """Momentum and spin are alike in size, so a right-hand side of the wrong variables would pass unseen."""
    body = columns()
    with pytest.raises(NotImplementedError):
        STIFF_MODEL.rhs(STIFF_MODEL.start(body), STIFF_MODEL.constants.of(body))
    with pytest.raises(NotImplementedError):
        STIFF_MODEL.upright(np.ones(1))
    assert STIFF_MODEL.path is None


def test_fast_spin_has_a_mode_of_negative_energy() -> None:
    """Friction makes that one grow, at the cost of the spin, and the body rises; no leap may use it."""
    body = columns(a=[1.05, 1.05], b=1.04, mu=5000.0)
    rates, _, sound = slow_rates(FORM, FORM.model.constants.of(body), np.array([0.05, 5.0]))
    np.testing.assert_array_equal(sound, [True, False])
    assert (rates[0].real < 0).all()
    assert rates[1].real.max() > 0

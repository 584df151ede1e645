"""The variables of the stiff method."""

import numpy as np
import pytest
from support import columns

from sweep.models.ladder import slip
from sweep.models.stiff.slip import form_of

STIFF_MODEL = form_of(slip.MODEL).model


def test_no_function_takes_the_states_of_another_model() -> None:
    """Momentum and spin are alike in size, so a right-hand side of the wrong variables would pass unseen."""
    body = columns()
    with pytest.raises(NotImplementedError):
        STIFF_MODEL.rhs(STIFF_MODEL.start(body), STIFF_MODEL.constants.of(body))
    with pytest.raises(NotImplementedError):
        STIFF_MODEL.upright(np.ones(1))
    assert STIFF_MODEL.path is None

"""Which models the stiff method can integrate, and their equations in the variables that it needs."""

from __future__ import annotations

from sweep.models.ladder import slip
from sweep.models.model import Model
from sweep.models.stiff import general as stiff_general
from sweep.models.stiff import slip as stiff_slip
from sweep.models.stiff.form import StiffForm


def of(model: Model) -> StiffForm | None:
    """The stiff form of a model; None if there is none, or if a user brings the model."""
    if model.origin:
        return None
    return stiff_slip.PAPER_FORM if model.name == slip.MODEL.name else stiff_general.form_of(model)

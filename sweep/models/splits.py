"""Which models the stiff method can integrate, and their equations in the variables that it needs."""

from __future__ import annotations

from sweep.models import general_split, slip, slip_split
from sweep.models.model import Model
from sweep.models.split import Split


def of(model: Model) -> Split | None:
    """The split form of a model; None if there is none, or if a user brings the model."""
    if model.origin:
        return None
    return slip_split.PAPERS if model.name == slip.MODEL.name else general_split.split(model)

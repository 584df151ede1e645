"""The ladder of models, one file each; every model approximates the one before it."""

from sweep.models import variants
from sweep.models.ladder import analytic, averaged, effective, noslip, slip, slow
from sweep.models.model import Model, Tier

MODELS: dict[str, Model] = {module.MODEL.name: module.MODEL for module in (slip, noslip, effective, averaged)}


def find(name: str) -> Model:
    """The model of a name: one of `MODELS`, or a variant such as `slip+coulomb+sigma`."""
    return MODELS[name] if name in MODELS else variants.variant(name)


TIERS: dict[str, Tier] = {**MODELS, **{module.MODEL.name: module.MODEL for module in (slow, analytic)}}

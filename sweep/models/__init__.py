"""The ladder of models, one file each; every model approximates the one before it."""

from sweep.models import analytic, averaged, effective, noslip, slip
from sweep.models.model import Model, Tier

MODELS: dict[str, Model] = {module.MODEL.name: module.MODEL for module in (slip, noslip, effective, averaged)}

TIERS: dict[str, Tier] = {**MODELS, analytic.MODEL.name: analytic.MODEL}
